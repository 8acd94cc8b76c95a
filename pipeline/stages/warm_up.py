"""Compilation of the kernels before they are needed, by the solution of small problems that call all of them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, get_args

import numpy as np

from pipeline.errors import reason_of
from pipeline.process.workers import Call, WorkerDied, workers
from pipeline.scene.contact_section import Law

if TYPE_CHECKING:
    from nonlinear.contact.parameters import ContactParameters
    from pipeline.process.progress import Reporter
    from rom.cyclic.reduced_model import ReducedModel
    from rom.cyclic.sector_modes import RingModes


LAWS: tuple[str, ...] = get_args(Law)
INTEGRATIONS = ("exact", "sampled")
_SAMPLES = 32  # a period


def warm_up_all(reporter: Reporter) -> None:
    """Compile all kernels, those of each friction law in a process of its own; one that fails stops no other."""
    calls = {f"{law}, {way}": Call(_call, (law, way)) for way in INTEGRATIONS for law in LAWS}
    failed: dict[str, str] = {}
    interrupts = reporter.interrupts

    def retried(key: str, reason: str) -> None:
        reporter.line(f"{key}: {reason}; begun again in another process")

    with (
        reporter.counting("kernels", len(calls), len(LAWS)) as counter,
        interrupts.looking(),
        workers(len(LAWS), interrupts.check) as pool,
    ):
        for key, future in pool.completed(calls, retried=retried):
            try:
                reason = future.result()
            except WorkerDied as died:
                reason = str(died)
            if reason:
                failed[key] = reason
            counter.done(f"{key}: {reason or 'ready'}")
    if failed:
        raise RuntimeError("; ".join(f"kernels of {key}: {reason}" for key, reason in failed.items()))


def _call(law: str, integration: str) -> str:
    try:
        warm_up(law, integration)
    except Exception as error:  # told of at the end
        return reason_of(error)
    return ""


def warm_up(law: str, integration: str) -> None:
    """Call every kernel that curves with this friction law and integration run: it is compiled, or loaded."""
    from nonlinear.branches.branch_collection import branch_starts
    from nonlinear.options import Excitation, SolverOptions
    from nonlinear.response_extension import carry_branches
    from nonlinear.response_solver import forced_response
    from rom.cyclic.sector_modes import modal_model
    from rom.linear_algebra.threads import one_blas_thread

    modal, contact, excitation = modal_model(small_model(), damping_ratio=0.05), _contact(law), Excitation(1, 0.6)
    with one_blas_thread():
        options = SolverOptions(
            (0.10, 0.101),
            harmonics=2,  # with one, the largest displacement needs no kernel
            integration=integration,  # type: ignore[arg-type]
            samples=_SAMPLES,
            detached=False,
            truncation=False,
            search="off",
            max_points=2,
        )
        curve = forced_response(modal, contact, excitation, options)
        nearby = contact.with_interference(1.01 * contact.interference)
        carry_branches((modal, nearby, excitation, options), curve, branch_starts(curve, contact, excitation, "")[:1])
        _warm_up_time(modal, contact, curve.relative_displacement[0])
        if law == LAWS[0]:  # one kernel for all
            _warm_up_time(modal_model(small_disk(), damping_ratio=0.05), contact, curve.relative_displacement[0])


def _warm_up_time(modal: RingModes, contact: ContactParameters, displacement: np.ndarray) -> None:
    """The same for the motion of a ring in time and for the contact loops of the figures."""
    from nonlinear.contact.element_choice import contact_cycle
    from nonlinear.options import Excitation
    from nonlinear.time_integration.ring import Ring
    from nonlinear.time_integration.ring_motion import RingLimits, integrate_ring

    contact_cycle(displacement, contact, samples=_SAMPLES)
    limits = RingLimits(most_periods=2, window=1, settling=1)
    integrate_ring(Ring(modal, contact, Excitation(1, 0.6)), 2.0 * np.pi * 0.11, None, limits=limits)


def small_model() -> ReducedModel:
    """A ring of four blades, each three masses of three directions on a line of springs; two nodes touch."""
    from rom.cyclic.reduced_model import ReducedModel

    line = 2.0 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1)
    stiffness = np.kron(line, np.array([[1.0, 0.0, 0.2], [0.0, 1.5, 0.0], [0.2, 0.0, 2.0]])) * 4.0
    tip = np.zeros(9)
    tip[6], tip[8] = 1.0, 0.5
    return ReducedModel(
        mass=np.eye(9),
        stiffness=stiffness,
        contact_right=np.eye(6, 9),
        contact_left=np.roll(np.eye(6, 9), 1, axis=1),
        contact_position=np.zeros((2, 3)),
        force_excitation=tip,
        outputs={"tip": tip},
        n_blades=4,
    )


def small_disk() -> ReducedModel:
    """The same blades on masses that springs join."""
    blade = small_model()
    n, width = blade.size, ((0, 0), (0, 6))
    ends = np.eye(6, n + 6, n)
    apart, root = ends[:3] - ends[3:], np.eye(3, n + 6) - 0.5 * (ends[:3] + ends[3:])
    stiffness = np.pad(blade.stiffness, (0, 6)) + 4.0 * (apart.T @ apart + root.T @ root) + ends.T @ ends
    tip = np.pad(blade.outputs["tip"], (0, 6))
    return replace(
        blade,
        mass=np.eye(n + 6),
        stiffness=stiffness,
        contact_right=np.pad(blade.contact_right, width),
        contact_left=None if blade.contact_left is None else np.pad(blade.contact_left, width),
        force_excitation=tip,
        outputs={"tip": tip},
        cyclic_right=ends[3:],
        cyclic_left=ends[:3],
    )


def _contact(law: str) -> ContactParameters:
    """Contacts that stick, slip and open within a period."""
    from nonlinear.contact.parameters import ContactParameters

    return ContactParameters.shared(
        2,
        normal_stiffness=1.6,
        tangential_stiffness=0.8,
        friction=0.4,
        interference=0.1,
        law=law,  # type: ignore[arg-type]
    )

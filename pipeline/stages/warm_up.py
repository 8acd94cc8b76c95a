"""Compilation of the kernels before they are needed, by the solution of small problems that call all of them.

The problems are solved here or in worker processes; one that fails stops no other.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.errors import reason_of
from pipeline.process.progress import Counter, Reporter
from pipeline.process.workers import Call, WorkerDied, workers

if TYPE_CHECKING:
    from nonlinear import ContactParameters
    from pipeline.process.progress import Reporter
    from rom import ReducedModel, RingModes


@dataclass(frozen=True)
class Work:
    """A piece of work: `function(*args, progress=None)` returns why it failed, or an empty text."""

    label: str  # what progress calls it
    function: Callable[..., str]  # A function of a module, so that a worker process finds it
    args: tuple[Any, ...]  # its arguments, which can be pickled


@dataclass(frozen=True)
class CountedCalls:
    """Does pieces of work, `at_once` at a time: with 1 in this process, otherwise in worker processes."""

    reporter: Reporter  # reports progress and notices interrupts
    text: str  # what is counted
    at_once: int  # number of processes

    def run(self, works: Mapping[str, Work], line: Callable[[str], str]) -> dict[str, str]:
        """Do all of it; the reason of every piece that failed."""
        if not works:
            return {}
        return self._one_by_one(works, line) if self.at_once == 1 else self._in_workers(works, line)

    def _one_by_one(self, works: Mapping[str, Work], line: Callable[[str], str]) -> dict[str, str]:
        reasons: dict[str, str] = {}
        with self.reporter.counting(self.text, len(works)) as counter, self.reporter.interrupts.looking():
            for key, work in works.items():
                reason = work.function(*work.args, progress=self._progress(counter, work.label))
                _done(counter, reasons, key, reason, f"{work.label}: {reason or line(key)}")
        return reasons

    def _progress(self, counter: Counter, label: str) -> Callable[[float, int], None]:
        def within(frequency_hz: float, points: int) -> None:
            self.reporter.interrupts.check()
            counter.within(f"{label} at {frequency_hz:.5g} Hz, {points} points")

        return within

    def _in_workers(self, works: Mapping[str, Work], line: Callable[[str], str]) -> dict[str, str]:
        reasons: dict[str, str] = {}
        calls = {key: Call(work.function, work.args) for key, work in works.items()}

        def retried(key: str, reason: str) -> None:
            self.reporter.line(f"{works[key].label}: {reason}; begun again in another process")

        interrupts = self.reporter.interrupts
        with (
            self.reporter.counting(self.text, len(works), self.at_once) as counter,
            interrupts.looking(),
            workers(self.at_once, interrupts.check) as pool,
        ):
            for key, future in pool.completed(calls, retried=retried):
                try:
                    reason = future.result()
                except WorkerDied as died:
                    reason = str(died)
                _done(counter, reasons, key, reason, f"{works[key].label}: {reason or line(key)}")
        return reasons


def _done(counter: Counter, reasons: dict[str, str], key: str, reason: str, detail: str) -> None:
    if reason:
        reasons[key] = reason
    counter.done(detail)


LAWS = ("two_sliders", "cone")
INTEGRATIONS = ("exact", "sampled")
_SAMPLES = 32  # a period


def warm_up_all(reporter: Reporter) -> None:
    """Compile all kernels, those of each friction law in a process of its own."""
    works = {f"{law}, {way}": Work(f"{law}, {way}", _call, (law, way)) for way in INTEGRATIONS for law in LAWS}
    failed = CountedCalls(reporter, "kernels", len(LAWS)).run(works, lambda key: "ready")
    if failed:
        raise RuntimeError("; ".join(f"kernels of {key}: {reason}" for key, reason in failed.items()))


def _call(law: str, integration: str, progress: object = None) -> str:
    try:
        warm_up(law, integration)
    except Exception as error:  # told of at the end
        return reason_of(error)
    return ""


def warm_up(law: str, integration: str) -> None:
    """Call every kernel that curves with this friction law and integration run: it is compiled, or loaded."""
    from nonlinear import Excitation, SolverOptions, branch_starts, carry_branches, forced_response
    from rom import modal_model, one_blas_thread

    modal, contact, excitation = modal_model(small_model(), damping_ratio=0.05), _contact(law), Excitation(1, 0.6)
    with one_blas_thread():
        options = SolverOptions(
            (0.10, 0.101),
            harmonics=2,  # with one, the largest displacement needs no kernel
            integration=integration,  # type: ignore[arg-type]
            samples=_SAMPLES,
            detached=False,
            truncation=False,
            time_integration=False,
            max_points=2,
        )
        curve = forced_response(modal, contact, excitation, options)
        nearby = contact.with_interference(1.01 * contact.interference)
        carry_branches((modal, nearby, excitation, options), curve, branch_starts(curve, contact, excitation, "")[:1])
        _warm_up_time(modal, contact, curve.relative_displacement[0])
        if (law, integration) == (LAWS[0], INTEGRATIONS[0]):  # one kernel for all
            _warm_up_time(modal_model(small_disk(), damping_ratio=0.05), contact, curve.relative_displacement[0])


def _warm_up_time(modal: RingModes, contact: ContactParameters, displacement: np.ndarray) -> None:
    """The same for the motion of a ring in time and for the contact loops of the figures."""
    from nonlinear import Excitation, Ring, RingLimits, contact_cycle, integrate_ring

    contact_cycle(displacement, contact, samples=_SAMPLES)
    limits = RingLimits(most_periods=2, window=1, settling=1)
    integrate_ring(Ring(modal, contact, Excitation(1, 0.6)), 2.0 * np.pi * 0.11, None, limits=limits)


def small_model() -> ReducedModel:
    """A ring of four blades, each three masses of three directions on a line of springs; two nodes touch."""
    from rom import ReducedModel

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
    from nonlinear import ContactParameters

    return ContactParameters.shared(
        2,
        normal_stiffness=1.6,
        tangential_stiffness=0.8,
        friction=0.4,
        interference=0.1,
        law=law,  # type: ignore[arg-type]
    )

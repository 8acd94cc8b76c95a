"""Solution of one response curve: reduced model and scene in, curve file out."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.codec import prefixed_values
from pipeline.process.progress import seconds_since
from pipeline.stages.curve.curve_file import CURVE, read_curve, used_parameters, write_curve, write_searched
from pipeline.stages.curve.curve_summary import STATIC, keep_summary
from pipeline.stages.scene_to_solver import InterfaceContact, nonlinear_problem, resolved_contacts

if TYPE_CHECKING:
    from nonlinear.contact.parameters import ContactParameters
    from nonlinear.options import Excitation, SolverOptions
    from nonlinear.response_curve import ResponseCurve
    from pipeline.scene.schema import Scene
    from rom.cyclic.sector_modes import RingModes


Progress = Callable[[float, int], None]


def solve_curve(
    folder: Path,
    rom: Path,
    scene: Scene,
    parameters: Mapping[str, Any],
    progress: Progress | None = None,
    base: Path | None = None,
) -> None:
    """Solve one curve on one BLAS thread and write `curve.h5`, with its summary in `curve.json`.

    `base`: file of the curve with a shorter search for the worst motion; only that goes on.
    """
    import h5py

    from nonlinear.response_solver import forced_response
    from nonlinear.worst_motion.worst_motion import find_worst_motion
    from rom.files.reduced_model_file import read_reduced_model
    from rom.linear_algebra.threads import one_blas_thread
    from rom.reduction.contact_dofs import ContactNodes

    start = time.perf_counter()
    with one_blas_thread():
        model = read_reduced_model(rom, with_basis=False)
        contacts = resolved_contacts(scene, ContactNodes.of(model))
        used = used_parameters(scene, contacts, parameters)
        problem = nonlinear_problem(scene, model)
        if base is None:
            response = forced_response(*problem, progress)
            write_curve(folder / CURVE, response, used, interfaces_at_peak(problem, response, contacts))
        else:
            before = read_curve(base)
            with h5py.File(base, "r") as file:
                standard = file.attrs["response.search"] == "standard"
            worst = find_worst_motion(problem, before, before.worst if standard else None)
            seconds = before.seconds + seconds_since(start)
            write_searched(folder / CURVE, base, replace(before, worst=worst, seconds=seconds), used)
    keep_summary(folder / CURVE)


def interfaces_at_peak(
    problem: tuple[RingModes, ContactParameters, Excitation, SolverOptions],
    response: ResponseCurve,
    contacts: Sequence[InterfaceContact],
) -> list[dict[str, Any]]:
    """States and friction work at the peak, and static contact, of each of several interfaces, as `CurveSummary` has
    them.
    """
    import numpy as np

    from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK
    from nonlinear.contact_states import nodal_contact
    from nonlinear.response_curve import StaticContact

    if len(contacts) < 2:
        return []
    sizes = {each.name: each.nodes for each in contacts}
    found: dict[str, dict[str, Any]] = {name: {"name": name, "nodes": nodes} for name, nodes in sizes.items()}
    if response.peak is not None:
        nodes = nodal_contact(problem, response, response.peak.index)
        for name, own in zip(
            sizes, np.split(np.arange(sum(sizes.values())), np.cumsum([*sizes.values()])), strict=False
        ):
            states = {"sticking": STICK, "slipping": SLIP, "separating": LIFT_OFF}
            found[name] |= {state: int((nodes.state[own] == number).sum()) for state, number in states.items()}
            found[name]["dissipated_j"] = float(nodes.dissipated_j[own].sum())
    if response.static_displacement is not None:
        for name, static in StaticContact.by_interface(problem[1], response.static_displacement, sizes).items():
            found[name] |= prefixed_values(STATIC, static)
    return [*found.values()]

"""Ranges of interference and preload, from faces that never touch to faces that always stick.

In between the contacts are not linear: there is the best value, and there a sweep belongs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.scene.dotted_keys import interface_of, split_key
from pipeline.scene.sweep import as_in_scene
from pipeline.stages.scene_to_solver import contact_on_model, nonlinear_problem

if TYPE_CHECKING:
    from nonlinear.response_curve import ResponseCurve
    from pipeline.scene.schema import Scene
    from rom.cyclic.reduced_model import ReducedModel

Range = tuple[float, float]
APART = -100.0  # interference of contacts that never touch, m
PRESSED = 1e7  # preload of contacts that always stick, by the force of the excitation
LEAST_PRELOAD = 0.01  # of that at which all nodes stick
FLOATS = 1e-2  # m, beyond which a body moves that contacts alone hold
LEAST_PART = 1e-3  # of an interference that presses stiff faces of slender blades together
QUICK: dict[str, Any] = {  # what a response does without that only its main branch is needed of
    "response.detached": False,
    "response.truncation": False,
    "response.search": "off",
    "response.stability": "folds",
    "response.residual_tractions": "projected",
}


def static_ranges(
    scene: Scene, model: ReducedModel, linear: Callable[[Mapping[str, Any]], ResponseCurve]
) -> dict[str, Range]:
    """The ranges of `interference`, m, and `preload`, N, of each table, in which its contacts are not linear.

    The range of a key that does nothing, as of the interference without a normal stiffness, is left out. `linear`:
    the response with other values of some keys, and as few harmonics as the excitation has.
    """
    contact = contact_on_model(scene, model)
    interferences, preloads = ([f"{t}.{name}" for t in scene.contacts] for name in ("interference", "preload"))
    apart = linear(_given(scene, dict.fromkeys(preloads, 0.0) | dict.fromkeys(interferences, APART)))
    stuck = linear(_given(scene, dict.fromkeys(preloads, PRESSED * scene.excitation.force)))
    rates = np.abs(stuck.contact_force[:, 1:]).sum(axis=1)  # (P, n_c, 3), amplitudes of the forces
    friction = np.maximum(contact.friction, np.finfo(float).tiny)
    sliders = np.hypot(rates[..., 0], rates[..., 1]) / friction
    needed = (np.where(contact.friction > 0.0, sliders, 0.0) + rates[..., 2]).max(axis=0)
    gap = np.abs(apart.relative_displacement[:, 1:, :, 2]).sum(axis=1).max(axis=0)
    found = {}
    for table in scene.contacts:
        at = nodes_of(scene, model, f"{table}.interference")
        if np.all(contact.normal_stiffness[at] > 0.0) and at.any():
            most = (needed[at] / contact.normal_stiffness[at]).max()
            found[f"{table}.interference"] = (-float(gap[at].max()), float(most))
        if (at := nodes_of(scene, model, f"{table}.preload")).any():
            found[f"{table}.preload"] = (LEAST_PRELOAD * float(needed[at].max()), float(needed[at].max()))
    return {key: limits for key, limits in found.items() if limits[1] > limits[0]}


def nodes_of(scene: Scene, model: ReducedModel, key: str) -> NDArray[np.bool_]:
    """The contact nodes, (n_c,), whose parameter a key is."""
    name, own = split_key(key)[1], interface_of(key)
    tables = [scene.table_of(each) for each in model.interfaces]
    has_it = [each == own if own else getattr(scene.interface.get(each), name, None) is None for each in tables]
    return np.repeat(has_it, [*model.interfaces.values()])


def _given(scene: Scene, closure: Mapping[str, float]) -> dict[str, Any]:
    """Interference and preload as the scene gives them, and what a linear response does without."""
    values = {key: as_in_scene(scene, key, value) for key, value in closure.items()}
    return {**QUICK, "response.harmonics": scene.excitation.highest_harmonic, **values}


def closure_ranges(
    scene: Scene, model: ReducedModel, static: Mapping[str, Range], motions: Sequence[NDArray[np.complex128]]
) -> dict[str, Range]:
    """Ranges of interference at rest, from faces that never touch to faces that always stick, and those of preload.

    `static`: ranges of `static_ranges`, to which the static motion of the faces is added. `motions`: relative
    displacements (P, H+1, n_c, 3) of faces apart and of faces that stick; none where they have no response. The faces
    give way under the load of an interference: a part of it presses them together.
    """
    contact = contact_on_model(scene, model)
    found = dict(static)
    for table in scene.contacts:
        key, at = f"{table}.interference", nodes_of(scene, model, f"{table}.interference")
        kn, load = contact.normal_stiffness[at], static.get(f"{table}.preload", (0.0, 0.0))[1]
        if not at.any() or not kn.all() or (key not in static and not load):
            continue
        closing, part = 0.0, 1.0
        low, high = static.get(key, (-math.inf, load / kn.min()))
        means = [float(each[0, 0, at, 2].real.mean()) for each in motions if len(each)]
        if low < -FLOATS or any(abs(mean) > FLOATS for mean in means):
            low = -high
        elif len(means) == len(motions):
            apart, stuck = means
            own = float(contact.interference[at].mean())
            part = (own + stuck) / (own + apart) if own + apart != 0.0 else 1.0
            closing, part = apart, part if LEAST_PART < part < 1.0 else 1.0
        found[key] = low - closing, high / part - closing
    return found


def ranges_of_closure(
    scene: Scene, model: ReducedModel, derived: Callable[[Mapping[str, Any]], Scene]
) -> dict[str, Range]:
    """`closure_ranges` of a scene on a model; {} where no response tells them.

    `derived`: the scene with other values of some keys.
    """
    from nonlinear.response_solver import response_stages

    solved: list[ResponseCurve] = []

    def linear(given: Mapping[str, Any]) -> ResponseCurve:
        solved.append(next(response_stages(*nonlinear_problem(derived(given), model))).curve)
        if not solved[-1].points:
            raise ArithmeticError(solved[-1].termination.message)
        return solved[-1]

    try:
        found = static_ranges(scene, model, linear)
    except ArithmeticError:
        return {}
    return closure_ranges(scene, model, found, [each.relative_displacement for each in solved])

"""Static ranges of interference and preload: from contacts that never touch to contacts that always stick.

Both ends come from linear responses over the frequency range. With a wide gap the faces of neighbours approach each
other by at most max abs(d_n): a larger gap changes nothing. With a deep interference all nodes stick as long as
mu (kn v0 - abs(N1)) >= abs(T1), with the amplitudes T1 and N1 of the contact forces: a deeper one changes nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.scene.key_values import as_in_scene
from pipeline.scene.optimum_section import Range
from pipeline.stages.scene_to_solver import contact_on_model
from pipeline.stages.stored_curve import read_curve
from pipeline.studies.study import StudyContext, StudyError

if TYPE_CHECKING:
    from nonlinear import ResponseCurve
    from pipeline.stages.respond import CurveResult

APART = -1e3  # interference of contacts that never touch, m
PRESSED = 1e7  # preload of contacts that always stick, by the force of the excitation
LEAST_PRELOAD = 0.01  # of that at which all nodes stick
OVER = "--over"  # how messages name it
_QUICK: dict[str, Any] = {  # what the linear responses do without
    "response.detached": False,
    "response.truncation": False,
    "response.time_integration": False,
    "response.stability": "folds",
    "response.residual_tractions": "projected",
}


def static_ranges(context: StudyContext) -> dict[str, Range]:
    """The ranges of `contact.interference`, m, and `contact.preload`, N, in which the contacts are not linear.

    The range of a key that does nothing, as of the interference without a normal stiffness, is left out.
    """
    from rom import read_reduced_model

    scene = context.scene
    contact = contact_on_model(scene, read_reduced_model(context.model.rom, with_basis=False))
    apart = _linear(context, {"contact.preload": 0.0, "contact.interference": APART})
    stuck = _linear(context, {"contact.preload": PRESSED * scene.excitation.force})
    rates = np.abs(stuck.contact_force[:, 1:]).sum(axis=1)  # (P, n_c, 3), amplitudes of the forces
    friction = np.maximum(contact.friction, np.finfo(float).tiny)
    sliders = np.hypot(rates[..., 0], rates[..., 1]) / friction
    needed = (np.where(contact.friction > 0.0, sliders, 0.0) + rates[..., 2]).max(axis=0)
    found = {}
    if np.all(contact.normal_stiffness > 0.0):
        gap = float(np.abs(apart.relative_displacement[:, 1:, :, 2]).sum(axis=1).max())
        found["contact.interference"] = (-gap, float((needed / contact.normal_stiffness).max()))
    found["contact.preload"] = (LEAST_PRELOAD * float(needed.max()), float(needed.max()))
    return {key: limits for key, limits in found.items() if limits[1] > limits[0]}


def _linear(context: StudyContext, closure: Mapping[str, float]) -> ResponseCurve:
    """The response with this interference and preload, and as few harmonics as the excitation has."""
    given = {key: as_in_scene(context.scene, key, value) for key, value in closure.items()}
    member = context.member(
        {**_QUICK, "response.harmonics": context.scene.excitation.highest_harmonic, **given}, OVER
    )
    found: CurveResult = context.curves([replace(member, parameters=given)])[0]
    if found.file is None:
        raise StudyError(found.reason)
    return read_curve(found.file)

"""Trials of the optimum: scenes with other values of some keys, and the worst motion of their curves."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from pipeline.errors import InputError
from pipeline.results.worst import number_error
from pipeline.scene.key_values import as_in_scene
from pipeline.scene.optimum_checks import PLACE
from pipeline.studies.optimum.followed_peaks import objective_of
from pipeline.studies.optimum.optimum_result import Trial

if TYPE_CHECKING:
    from pathlib import Path

    from nonlinear import SolvedResponse
    from pipeline.scene.reading import Member
    from pipeline.stages.curve_summary import CurveSummary
    from pipeline.stages.respond import CurveResult
    from pipeline.studies.study import StudyContext


@dataclass
class CurveTrials:
    """Solves curves of a scene with other values of some keys, each once."""

    context: StudyContext  # the scene and what solves its curves

    def __call__(self, points: Sequence[Mapping[str, float]]) -> list[Trial]:
        """The worst motion at each of these points; all curves are solved as one sweep."""
        members: dict[int, Member] = {}
        refused: dict[int, str] = {}
        for place, point in enumerate(points):
            try:
                members[place] = member_at(self.context, point)
            except InputError as error:
                refused[place] = str(error)
        curves = dict(zip(members, self.context.curves(list(members.values())), strict=True))
        return [
            trial_of(point, curves[place], objective_of(self.context))
            if place in curves
            else Trial(dict(point), reason=refused[place])
            for place, point in enumerate(points)
        ]


def member_at(context: StudyContext, point: Mapping[str, float]) -> Member:
    """The scene with these values; a list node by node keeps its shape."""
    scene = context.scene
    return context.member({key: as_in_scene(scene, key, value) for key, value in point.items()}, PLACE)


def trial_of(point: Mapping[str, float], curve: CurveResult, objective: str = "displacement") -> Trial:
    """The worst motion of a curve at a point, as the objective counts it."""
    facts = curve.facts
    if facts is None:
        return Trial(dict(point), reason=curve.reason)
    amplitude, frequency, motion = worst_of(facts)
    if not math.isfinite(amplitude):
        return Trial(dict(point), reason="no peak in the frequency range")
    known = math.isfinite(facts.worst_amplitude_m)
    at_end, open_end = facts.at_end, facts.worst_unresolved
    if objective == "harmonic_1" and known and curve.file is not None:
        found = _of_first_harmonic(curve, curve.file)
        amplitude, frequency, at_end, open_end = found.bound_m, found.frequency_hz, found.at_end, found.unresolved
    return Trial(dict(point), amplitude, frequency, motion, at_end, open_end, "", number_error(facts))


def _of_first_harmonic(curve: CurveResult, file: Path) -> SolvedResponse:
    """The worst motion of a curve by its first harmonic."""
    from nonlinear import solved_response
    from pipeline.stages.scene_to_solver import solver_options
    from pipeline.stages.stored_curve import read_curve

    options = replace(solver_options(curve.member.scene), objective="harmonic_1")
    return solved_response(0.0, read_curve(file), "", options)


def worst_of(facts: CurveSummary) -> tuple[float, float, str]:
    """Amplitude, frequency and kind of the worst motion; of the highest peak where no motion is known to persist."""
    if math.isfinite(facts.worst_amplitude_m):
        return facts.worst_amplitude_m, facts.worst_frequency_hz, facts.worst_motion
    return facts.peak_amplitude_m, facts.peak_frequency_hz, "peak"

"""Scenes with other values of some keys: the worst motion of their curves, and the optimum of followed peaks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from nonlinear import ContactError, JointOptimum, Optimum, find_joint_optimum, find_optimum
from pipeline.errors import InputError
from pipeline.results.worst import number_error
from pipeline.scene.sweep import WHOLE_FACE, as_in_scene
from pipeline.stages.curve.curve_file import read_curve
from pipeline.stages.scene_to_solver import nonlinear_problem
from pipeline.studies.optimum.checks import PLACE, SOLVER_KEYS
from pipeline.studies.optimum.result import Trial
from pipeline.studies.study import StudyContext, StudyError

if TYPE_CHECKING:
    from pathlib import Path

    from nonlinear import ResponseCurve, SolvedResponse
    from pipeline.scene.reading import Member
    from pipeline.scene.schema import Scene
    from pipeline.stages.curve.curve_summary import CurveSummary
    from pipeline.stages.curve.respond import CurveResult
    from pipeline.studies.study import StudyContext


MOST_RESPONSES, FEWEST, FEWEST_JOINT = 40, 16, 20  # of one search
_DIGITS = 13  # of a value: the mean of equal numbers differs from them by rounding


@dataclass(frozen=True)
class FollowedPeaks:
    """Finds the optimum over one to three keys of the solver, with other values of some keys of the model."""

    context: StudyContext  # the scene, and what solves its curves
    limits: Mapping[str, tuple[float, float]]  # the keys with their ranges, in the units of the scene
    others: Mapping[str, float]  # further keys with their values
    rough: bool = False  # whether as few responses as possible are to be solved

    def optimum(self) -> Optimum | JointOptimum:
        """The optimum in the units of the solver (`per_unit`), found in the store where it is there."""
        member = self.context.member({key: self._given(key, value) for key, value in self.others.items()}, PLACE)
        model = self.context.model_of(member)
        inputs = {"limits": dict(self.limits), "rough": self.rough, "curve": self.context.key_of(member, model)}
        inputs["objective"] = objective_of(self.context)
        kind: type[Any] = Optimum if len(self.limits) == 1 else JointOptimum
        found: Optimum | JointOptimum = self.context.stored(
            "optimum", inputs, kind, __name__, lambda: self._found(member.scene, model.rom)
        )
        return found

    def _found(self, scene: Scene, rom: Path) -> Optimum | JointOptimum:
        from rom import read_reduced_model

        model = read_reduced_model(rom, with_basis=False)
        modal, contact, wave, options = nonlinear_problem(scene, model)
        problem = modal, contact, wave, replace(options, objective=objective_of(self.context))
        factors = {key: per_unit(key, scene, model.n_contacts) for key in self.limits}
        ranges = {
            SOLVER_KEYS[key]: (low / factors[key], high / factors[key]) for key, (low, high) in self.limits.items()
        }

        def responses(problems: Sequence[Any]) -> list[ResponseCurve]:
            return self._responses(problems, problem, factors)

        said = self.context.progress
        try:
            if len(ranges) > 1:
                most = FEWEST_JOINT if self.rough else MOST_RESPONSES
                return find_joint_optimum(problem, ranges, said, responses, most_responses=most)
            ((name, (low, high)),) = ranges.items()
            most = FEWEST if self.rough else MOST_RESPONSES
            return find_optimum(problem, name, low, high, said, responses, most_responses=most)
        except (ArithmeticError, ContactError) as error:
            raise StudyError(str(error)) from None

    def _responses(self, problems: Sequence[Any], base: Any, factors: Mapping[str, float]) -> list[ResponseCurve]:
        """The responses of some problems, as curves of the scene."""
        members = []
        for problem in problems:
            own = {key: _solver_value(problem, base, SOLVER_KEYS[key]) * factors[key] for key in self.limits}
            rounded = {key: float(f"{value:.{_DIGITS}g}") for key, value in own.items()}
            values = {key: self._given(key, value) for key, value in {**self.others, **rounded}.items()}
            if problem.options.harmonics != self.context.scene.response.harmonics:
                values["response.harmonics"] = problem.options.harmonics
            members.append(self.context.member(values, PLACE))
        curves = self.context.curves(members)
        for curve in curves:
            if curve.file is None:
                raise StudyError(curve.reason)
        return [read_curve(curve.file) for curve in curves if curve.file is not None]

    def _given(self, key: str, value: float) -> Any:
        return as_in_scene(self.context.scene, key, value)


def objective_of(context: StudyContext) -> Any:
    """What the optimum of a scene makes low, as of `SolverOptions`."""
    section = context.scene.optimum
    return "displacement" if section is None else section.objective


def per_unit(key: str, scene: Scene, n_contacts: int) -> float:
    """Value of a key of the scene for each unit of the solver's parameter.

    A stiffness of the scene is that of the whole face, of the solver the mean of the nodes. The damping of the solver
    is a factor on that of the scene.
    """
    if key in WHOLE_FACE:
        return float(n_contacts)
    ratio = scene.response.damping_ratio
    return ratio if key == "response.damping_ratio" and isinstance(ratio, float) else 1.0


def _solver_value(problem: Any, base: Any, name: str) -> float:
    """Value of a parameter of the solver in a problem; of the damping its ratio to that of another problem."""
    modal, contact, excitation, _ = problem
    if name == "damping":
        return float(modal.damping.flat[0] / base[0].damping.flat[0])
    return float(excitation.force if name == "force" else getattr(contact, name).mean())


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
    from pipeline.stages.curve.curve_file import read_curve
    from pipeline.stages.scene_to_solver import solver_options

    options = replace(solver_options(curve.member.scene), objective="harmonic_1")
    return solved_response(0.0, read_curve(file), "", options)


def worst_of(facts: CurveSummary) -> tuple[float, float, str]:
    """Amplitude, frequency and kind of the worst motion; of the highest peak where no motion is known to persist."""
    if math.isfinite(facts.worst_amplitude_m):
        return facts.worst_amplitude_m, facts.worst_frequency_hz, facts.worst_motion
    return facts.peak_amplitude_m, facts.peak_frequency_hz, "peak"

"""Scenes with other values of some keys: the worst motion of their curves, and the optimum of followed peaks."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.parameters import ContactError
from nonlinear.peak_curves.joint_optimum import find_joint_optimum
from nonlinear.peak_curves.optimum import find_optimum
from nonlinear.peak_curves.optimum_result import JointOptimum, Optimum
from pipeline.errors import InputError, StageError
from pipeline.process.interrupts import Stopped
from pipeline.results.worst import number_error, with_unit
from pipeline.scene.dotted_keys import of_contact
from pipeline.scene.labels import value_label
from pipeline.scene.schema import has_role
from pipeline.scene.sweep import WHOLE_FACE, as_in_scene, key_value
from pipeline.stages.curve.curve_file import read_curve
from pipeline.stages.scene_to_solver import nonlinear_problem
from pipeline.stages.stage import Stage
from pipeline.studies.optimum.checks import PLACE, SOLVER_KEYS
from pipeline.studies.optimum.result import Trial
from pipeline.studies.optimum.section import BY_STRESS, LIFE
from pipeline.studies.study import StudyContext, StudyError

if TYPE_CHECKING:
    from pathlib import Path

    from nonlinear.peak_curves.optimum_result import SolvedResponse
    from nonlinear.response_curve import ResponseCurve
    from pipeline.scene.reading import Member
    from pipeline.scene.schema import Scene
    from pipeline.stages.curve.curve_summary import CurveSummary
    from pipeline.stages.curve.respond import CurveResult
    from pipeline.studies.study import StudyContext
    from pipeline.studies.uncertainty.section import Marginal
    from pipeline.studies.wear.section import Wear


Array = NDArray[np.float64]
MOST_RESPONSES, FEWEST, FEWEST_JOINT = 40, 16, 20  # of one search
SAME = 1e-6  # relative difference of two amplitudes that are the same motion
_DIGITS = 13  # of a value: the mean of equal numbers differs from them by rounding


@dataclass(frozen=True)
class Followed:
    """The optimum over followed peaks."""

    optimum: Optimum | JointOptimum  # in the units of the solver
    solved: tuple[Trial, ...]  # the responses that it needed
    model_seconds: float  # what making its reduced model took, s


def model_seconds(context: StudyContext) -> float:
    """What making meshes and reduced models took so far, s."""
    return sum(context.log.cost[stage] for stage in (Stage.MESH, Stage.ASSEMBLE, Stage.REDUCE))


@dataclass(frozen=True)
class FollowedPeaks:
    """Finds the optimum over one to three keys of the solver, with other values of some keys of the model."""

    context: StudyContext  # the scene, and what solves its curves
    limits: Mapping[str, tuple[float, float]]  # the keys with their ranges, in the units of the scene
    others: Mapping[str, float]  # further keys with their values
    rough: bool = False  # whether as few responses as possible are to be solved
    seen: list[Trial] = field(default_factory=list)  # the responses solved are added

    def optimum(self) -> Followed:
        """The optimum in the units of the solver (`per_unit`), found in the store where it is there."""
        member = self.context.member({key: self._given(key, value) for key, value in self.others.items()}, PLACE)
        before = model_seconds(self.context)
        model = self.context.model_of(member)
        spent = model_seconds(self.context) - before
        inputs = {"limits": dict(self.limits), "rough": self.rough, "curve": self.context.key_of(member, model)}
        inputs["objective"] = objective_of(self.context)

        def follow() -> Followed:
            found = self._found(member.scene, model.rom)
            return Followed(found, tuple(self.seen[first:]), spent)

        first = len(self.seen)
        found = self.context.stored("optimum", inputs, Followed, __name__, follow)
        self.seen[first:] = found.solved
        return found

    def _found(self, scene: Scene, rom: Path) -> Optimum | JointOptimum:
        from rom.files.reduced_model_file import read_reduced_model

        model = read_reduced_model(rom, with_basis=False)
        modal, contact, wave, options = nonlinear_problem(scene, model)
        problem = modal, contact, wave, replace(options, objective=objective_of(self.context))
        factors = {key: per_unit(key, scene, model.n_contacts / len(model.interfaces)) for key in self.limits}
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
        for member, curve in zip(members, curves, strict=True):
            if curve.file is None:
                raise StudyError(curve.reason)
            at = {key: key_value(member.scene, key) or 0.0 for key in (*self.others, *self.limits)}
            self.seen.append(trial_of(at, curve, self.context))
        return [read_curve(curve.file) for curve in curves if curve.file is not None]

    def _given(self, key: str, value: float) -> Any:
        return as_in_scene(self.context.scene, key, value)


def objective_of(context: StudyContext) -> Any:
    """What the optimum of a scene makes low, as of `SolverOptions`."""
    section = context.scene.optimum
    return "displacement" if section is None else section.objective


def per_unit(key: str, scene: Scene, nodes: float) -> float:
    """Value of a key of the scene for each unit of the solver's parameter, with so many `nodes` in an interface.

    A stiffness of the scene is that of the whole face, of the solver the mean of the nodes. The damping of the solver
    is a factor on that of the scene.
    """
    if key in WHOLE_FACE:
        return float(nodes)
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
    own: Mapping[str, float] = field(default_factory=dict)  # the scene's values of keys that `around` has
    around: tuple[Mapping[str, float], ...] = ({},)  # deviations of toleranced keys, all of which count
    known: dict[tuple[tuple[str, Any], ...], Trial] = field(default_factory=dict)
    models: set[tuple[Any, ...]] = field(default_factory=set)  # the values of the model whose cost is counted

    def __call__(self, points: Sequence[Mapping[str, float]]) -> list[Trial]:
        """The worst motion at each of these points, the highest of all deviations and load cases."""
        return [highest(point, trials) for point, trials in zip(points, self.scattered(points), strict=True)]

    def scattered(self, points: Sequence[Mapping[str, float]]) -> list[list[Trial]]:
        """The same for each deviation; all curves are solved as one sweep."""
        wanted = [[self._deviated(point, deviation) for deviation in self.around] for point in points]
        cases = load_cases(self.context)
        members = [{**values, **case} for row in wanted for values in row for case in cases]
        self._solve({_known_by(member): member for member in members if _known_by(member) not in self.known})
        return [
            [highest(point, [self._of(point, {**values, **case}) for case in cases]) for values in row]
            for point, row in zip(points, wanted, strict=True)
        ]

    def are_known(self, point: Mapping[str, float]) -> bool:
        """Whether all curves of a point are solved."""
        cases = load_cases(self.context)
        every = [{**self._deviated(point, deviation), **case} for deviation in self.around for case in cases]
        return all(_known_by(values) in self.known for values in every)

    def of(self, values: Mapping[str, float]) -> list[Trial]:
        """The single curves with some values."""
        return [trial for name, trial in self.known.items() if values.items() <= dict(name).items()]

    def _deviated(self, point: Mapping[str, float], deviation: Mapping[str, float]) -> dict[str, float]:
        moved = {key: point.get(key, self.own.get(key, 0.0)) + shift for key, shift in deviation.items()}
        return {**point, **{key: float(f"{value:.12g}") for key, value in moved.items()}}

    def _of(self, point: Mapping[str, float], values: Mapping[str, Any]) -> Trial:
        """The trial with some values; what the point does not say of them stands apart."""
        where = {key: value for key, value in values.items() if point.get(key) != value}
        return replace(self.known[_known_by(values)], values=dict(point), where=where)

    def _solve(self, wanted: Mapping[Any, Mapping[str, Any]]) -> None:
        members: dict[Any, Member] = {}
        for name, values in wanted.items():
            try:
                members[name] = member_at(self.context, values)
            except InputError as error:
                self.known[name] = Trial(dict(values), reason=str(error))
        before = model_seconds(self.context)
        try:
            curves = self.context.curves(list(members.values()))
        except Stopped:
            self._keep(wanted, members, [curve for curve in self.context.done if curve.facts is not None], 0.0)
            raise
        self._keep(wanted, members, curves, model_seconds(self.context) - before)

    def _keep(
        self, wanted: Mapping[Any, Any], members: Mapping[Any, Any], curves: Sequence[CurveResult], seconds: float
    ) -> None:
        """The trials of some curves; the time of a model counts with its first curve."""
        names = list(members)
        count = len({_of_model(wanted[name]) for name in names})
        for curve in curves:
            name = names[curve.member.index]
            trial = trial_of(wanted[name], curve, self.context)
            solving = 0.0 if curve.facts is None else curve.facts.seconds
            making = 0.0 if _of_model(wanted[name]) in self.models else seconds / count
            self.models.add(_of_model(wanted[name]))
            took = trial.seconds + solving + making
            self.known[name] = replace(trial, curves=1, seconds=took, model_seconds=making)


def _of_model(values: Mapping[str, Any]) -> tuple[Any, ...]:
    return tuple((key, value) for key, value in sorted(values.items()) if of_contact(key) not in SOLVER_KEYS)


def _known_by(values: Mapping[str, Any]) -> tuple[tuple[str, Any], ...]:
    return tuple(sorted(values.items()))


def highest(point: Mapping[str, float], trials: Sequence[Trial]) -> Trial:
    """The one of some trials at a point that counts: without a motion, else the highest."""
    missing = [trial for trial in trials if not math.isfinite(trial.value)]
    return missing[0] if missing else max(trials, key=lambda trial: trial.value)


def load_cases(context: StudyContext) -> list[dict[str, Any]]:
    """The values of swept conditions: an optimum is that of the highest of them."""
    section = context.scene.optimum
    over = {} if section is None else section.ranges
    keys = [key for key in context.file.swept if has_role(key, "condition") and key not in over]
    cases = [{key: member.parameters[key] for key in keys} for member in context.file.members]
    return [case for place, case in enumerate(cases) if case not in cases[:place]]


def member_at(context: StudyContext, point: Mapping[str, Any]) -> Member:
    """The scene with these values; a list node by node keeps its shape."""
    scene = context.scene
    given = {
        key: as_in_scene(scene, key, value) if isinstance(value, float) else value for key, value in point.items()
    }
    return context.member(given, PLACE)


def trial_of(point: Mapping[str, float], curve: CurveResult, context: StudyContext) -> Trial:
    """The worst motion of a curve at a point, and what the objective counts of it."""
    facts, section = curve.facts, context.scene.optimum
    if facts is None:
        return Trial(dict(point), reason=curve.reason)
    amplitude, frequency, motion = worst_of(facts)
    if not math.isfinite(amplitude):
        return Trial(dict(point), reason="no peak in the frequency range")
    known = math.isfinite(facts.worst_amplitude_m)
    at_end, open_end = facts.at_end, facts.worst_unresolved
    if section is not None and section.objective == "harmonic_1" and known and curve.file is not None:
        found = _of_first_harmonic(curve, curve.file)
        amplitude, frequency, at_end, open_end = found.bound_m, found.frequency_hz, found.at_end, found.unresolved
    elif known and open_end:  # what the search has left open may be as high as the highest solution
        amplitude, frequency, motion = max((amplitude, frequency, motion), *_highest_solutions(facts))
    mean = facts.mean if amplitude == facts.height else 0.0
    trial = Trial(dict(point), amplitude, frequency, motion, at_end, open_end, "", number_error(facts), mean_m=mean)
    if section is not None and section.output is not None:
        return _of_output(trial, facts, section.output)
    if objective_of(context) == LIFE:
        return _of_life(trial, curve, context)
    return _of_stress(trial, curve, context) if objective_of(context) in BY_STRESS else trial


def worn_by(scene: Scene, hours: float | None) -> Wear:
    """The section [wear] with another life."""
    assert scene.wear is not None  # the checks see to it
    return scene.wear if hours is None else scene.wear.model_copy(update={"hours": hours, "cycles": None})


def _of_life(trial: Trial, curve: CurveResult, context: StudyContext) -> Trial:
    """The trial with the highest amplitude while the faces wear, its own worst motion among them."""
    from pipeline.studies.wear.life import highest_of_life

    section = context.scene.optimum
    assert section is not None
    try:
        found = highest_of_life(context, worn_by(context.scene, section.life), curve.member.parameters)
    except StudyError as error:
        return replace(trial, amplitude_m=math.nan, reason=str(error))
    said = ", ".join(value_label(key, value) for key, value in curve.member.parameters.items())
    context.progress(f"{said}: up to {with_unit(found.amplitude_m)} while it wears, after {found.hours:.4g} h")
    trial = replace(trial, seconds=found.seconds, unresolved=trial.unresolved or found.left)
    if found.amplitude_m <= trial.amplitude_m * (1.0 + SAME):
        return trial
    motion = f"worn, after {found.hours:.4g} h"
    return replace(trial, amplitude_m=found.amplitude_m, frequency_hz=found.frequency_hz, motion=motion, mean_m=0.0)


def _highest_solutions(facts: CurveSummary) -> Iterator[tuple[float, float, str]]:
    """Amplitude and frequency of the highest solution of each branch, stable or not."""
    yield facts.peak_amplitude_m, facts.peak_frequency_hz, "peak"
    for branch in facts.detached:
        yield branch["peak_amplitude_m"], branch["to_hz"], "peak"


def _of_output(trial: Trial, facts: CurveSummary, name: str) -> Trial:
    """The trial with the largest value of an output on any branch."""
    found = next((each for each in facts.outputs if each["name"] == name), None)
    if found is None or found["peak_amplitude"] is None:
        return replace(trial, amplitude_m=math.nan, reason=f"no output {name}")
    motion = {"frequency_hz": found["peak_frequency_hz"], "motion": "peak", "at_end": found.get("at_end", False)}
    left = "" if found.get("stable", True) else f"the largest {name} is on an unstable solution"
    return replace(trial, goal=found["peak_amplitude"], unresolved=left, **motion)


def _of_stress(trial: Trial, curve: CurveResult, context: StudyContext) -> Trial:
    """The trial with the largest stress amplitude, or the inverse of the least margin, at its motion."""
    if context.stress is None:
        raise StudyError("the stress on the mesh is not known here")
    try:
        found = context.stress(replace(context.run, log=context.log), curve, context.scene.fatigue)
    except (ArithmeticError, ValueError, StageError) as error:
        return replace(trial, amplitude_m=math.nan, reason=str(error))
    above = max(trial.amplitude_m / found["amplitude_m"], 1.0)  # the motion over the periodic solution it is of
    if objective_of(context) == "stress":
        return replace(trial, goal=found["largest_amplitude_pa"] * above)
    margin = found["least_margin"]
    if margin is None:
        return replace(trial, amplitude_m=math.nan, reason="no material has limits in [fatigue] at its temperature")
    return replace(trial, goal=above / max(margin, 1e-9))


def _of_first_harmonic(curve: CurveResult, file: Path) -> SolvedResponse:
    """The worst motion of a curve by its first harmonic."""
    from nonlinear.peak_curves.peak_search import solved_response
    from pipeline.stages.curve.curve_file import read_curve
    from pipeline.stages.scene_to_solver import solver_options

    options = replace(solver_options(curve.member.scene), objective="harmonic_1")
    return solved_response(0.0, read_curve(file), "", options)


def worst_of(facts: CurveSummary) -> tuple[float, float, str]:
    """Amplitude, frequency and kind of the worst motion; of the highest peak where no motion is known to persist."""
    if math.isfinite(facts.worst_amplitude_m):
        return facts.worst_amplitude_m, facts.worst_frequency_hz, facts.worst_motion
    return facts.peak_amplitude_m, facts.peak_frequency_hz, "peak"


@dataclass(frozen=True)
class Tolerance:
    """How far keys may be off, for a search: over one key a window slides, deviations of the others are curves."""

    half: Mapping[str, float]  # half widths; of distributions half the width of their middle 95 %
    key: str  # the key of the window; "" where no optimised key has a tolerance
    around: tuple[Mapping[str, float], ...]  # deviations of the other keys
    level: float = math.nan  # quantile of equally likely deviations; NaN: the highest counts
    shifts: Array | None = None  # equally likely deviations of the key of the window, rising
    spread: Array | None = None  # (deviations, n): mixes their heights to n equally likely ones; None: as they are

    def of_samples(self, heights: Sequence[float]) -> tuple[float, ...]:
        """Heights of equally likely deviations from those computed; the highest alone where that counts."""
        if math.isnan(self.level):
            return (max(heights),)
        return tuple(heights if self.spread is None else (np.asarray(heights) @ self.spread).tolist())

    def of_one(self, heights: Sequence[float]) -> float:
        """What is made low where there is no window."""
        samples = self.of_samples(heights)
        return max(samples) if math.isnan(self.level) else float(np.quantile(samples, self.level))


MOST_FACTORIAL = 2  # keys beside that of the window whose ends and middles are all combined
NODES = (0.02, 0.25, 0.5, 0.75, 0.98)  # probabilities of the values of one further uncertain key
SAMPLES, SHIFTS = 16, 200  # of several further uncertain keys; of that of the window


def tolerance_of(context: StudyContext, own: Mapping[str, float]) -> Tolerance | None:
    """The tolerances of a scene; None where it has none."""
    section = context.scene.optimum
    assert section is not None
    if section.tolerance == "uncertainty":
        return _by_distributions(context.scene, section.ranges, section.quantile, own)
    half = section.tolerances
    if not half:
        return None
    key = _window_key(half, section.ranges)
    others = [name for name in half if name != key]
    sides = (-1.0, 0.0, 1.0) if len(others) <= MOST_FACTORIAL else (-1.0, 1.0)
    chosen = list(product(sides, repeat=len(others)))
    middle = (0.0,) * len(others)
    around = [{name: sign * half[name] for name, sign in zip(others, signs, strict=True)} for signs in chosen]
    return Tolerance(half, key, tuple(around if middle in chosen else [dict.fromkeys(others, 0.0), *around]))


def _window_key(keys: Iterable[str], over: Mapping[str, Any]) -> str:
    """The key over which the window slides: one that is optimised, of the solver if any, as its curves cost least."""
    both = [key for key in keys if key in over]
    return next((key for key in both if of_contact(key) in SOLVER_KEYS), both[0] if both else "")


def _by_distributions(scene: Scene, over: Mapping[str, Any], level: float, own: Mapping[str, float]) -> Tolerance:
    from pipeline.studies.uncertainty.quantiles import unit_points
    from pipeline.studies.uncertainty.section import marginal_of

    assert scene.uncertainty is not None
    laws: dict[str, Marginal] = {item.key: marginal_of(item, own[item.key]) for item in scene.uncertainty.parameter}
    half = {key: float(np.diff(law.quantile(np.array([0.025, 0.975])))[0]) / 2.0 for key, law in laws.items()}
    key = _window_key(laws, over)
    others = [name for name in laws if name != key]
    shares = (np.arange(SHIFTS) + 0.5) / SHIFTS
    shifts = laws[key].quantile(shares) - laws[key].centre if key else None
    if len(others) == 1:
        (name,) = others
        nodes, values = laws[name].quantile(np.array(NODES)), laws[name].quantile((np.arange(40) + 0.5) / 40)
        spread = np.array([np.interp(values, nodes, row) for row in np.eye(len(NODES))])
        rows = nodes[:, None]
    else:
        points = unit_points(SAMPLES, len(others), 0) if others else np.zeros((1, 0))
        rows = (
            np.column_stack([laws[name].quantile(points[:, k]) for k, name in enumerate(others)])
            if others
            else points
        )
        spread = None
    centres = {name: laws[name].centre if name in over else own[name] for name in others}
    around = [{name: float(row[k]) - centres[name] for k, name in enumerate(others)} for row in rows]
    return Tolerance(half, key, tuple(around), level, shifts, spread)

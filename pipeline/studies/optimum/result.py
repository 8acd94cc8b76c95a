"""What the study `optimum` found, and its words: the message, the lines and cells of its table."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from nonlinear.peak_curves.optimum_result import KINDS, JointOptimum, Optimum
from pipeline.process.progress import duration
from pipeline.results.worst import END_MARK, motion_said, truncation_mark, with_unit
from pipeline.scene.labels import quantity
from pipeline.scene.units import key_unit
from pipeline.studies.optimum.section import LIFE, OBJECTIVES

ALIKE = 1.02  # ratio of two amplitudes that are said to be the same


@dataclass(frozen=True)
class Trial:
    """The worst motion with some values of the keys."""

    values: Mapping[str, float]  # the keys with their values, in the units of the scene
    # `amplitude_m`, `frequency_hz`: the worst motion, m and Hz; NaN where there is none
    amplitude_m: float = math.nan
    frequency_hz: float = math.nan
    # "periodic" or "quasi-periodic"; "peak" where no motion is known to persist and the highest peak is meant
    motion: str = ""
    at_end: bool = False  # whether its frequency is an end of the frequency range: no peak, and no candidate
    unresolved: str = ""  # what the search for the worst motion left open; "" where nothing
    reason: str = ""  # why there is no motion; "" where there is one
    # estimated relative error of the amplitude by neglected harmonics; NaN without an estimate
    truncation_error: float = math.nan
    # keys that are not optimised with their values there: of the load case, and within the tolerance, that count most
    where: Mapping[str, float] = field(default_factory=dict)
    # what is made low in place of the amplitude: stress amplitude, Pa, inverse margin, an output; NaN: the amplitude
    goal: float = math.nan
    # what it took, in this run or an earlier one: responses, and s, all in all, and mesh and reduced model alone
    curves: int = 0
    seconds: float = 0.0
    model_seconds: float = 0.0
    mean_m: float = 0.0  # mean displacement in the amplitude, m; 0 where it is small or not known

    @property
    def value(self) -> float:
        """What is made low; NaN without a motion."""
        return self.goal if math.isfinite(self.goal) else self.amplitude_m

    @property
    def height(self) -> float:
        """The same; infinite where there is no motion, and at an end of the frequency range."""
        return self.value if math.isfinite(self.value) and not self.at_end else math.inf

    def with_value(self, value: float) -> Trial:
        """The trial with another value of what is made low."""
        return replace(self, goal=value) if math.isfinite(self.goal) else replace(self, amplitude_m=value)


@dataclass(frozen=True, kw_only=True)
class Robust:
    """The worst motion within tolerances: what an optimum with tolerances is decided by."""

    tolerance: Mapping[str, float]  # half widths by keys; with distributions half the width of their middle 95 %
    quantile: float = math.nan  # of the distributions of [uncertainty] that counts; NaN: the highest counts
    # The key that is both optimised and toleranced, over which the worst motion is known; "" where there is none. All
    # below is about it, the other keys at the optimum.
    key: str = ""
    bracket: tuple[float, float] = (math.nan, math.nan)  # values that may be as good as the optimum
    bound: float = math.nan  # what no value is below, as far as the values computed tell
    nominal: Trial | None = None  # the worst motion at the optimum itself
    lowest: Trial | None = None  # the lowest single worst motion
    around_lowest: float = math.nan  # the worst within the tolerance around that
    around_own: float = math.nan  # and around the scene's own value
    computed: tuple[Trial, ...] = ()  # the worst motions computed, by rising values of the key
    value: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))  # values of the key
    worst: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))  # the worst within the tolerance


@dataclass(frozen=True, kw_only=True)
class OptimumResult:
    """Values of keys of a scene at which its worst motion is lowest."""

    ranges: Mapping[str, tuple[float, float]]  # the keys with their ranges, in the units of the scene
    values: Mapping[str, float]  # their values at the optimum
    amplitude_m: float  # the worst motion there, m
    frequency_hz: float  # its frequency, Hz
    motion: str  # what it is, as of `Trial`
    kind: str  # one of `KINDS`
    # second derivative of the amplitude by the key at a smooth minimum, m per unit squared; NaN else
    curvature: float = math.nan
    # range of each key around the optimum in which the worst motion is at most 10 % higher, the others at their
    # optimum; of keys for which it is not known there is none
    within: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    # derivatives of the amplitude with respect to keys of contact, load and damping, m per unit of the key
    derivatives: Mapping[str, float] = field(default_factory=dict)
    base: Trial  # the worst motion with the scene's own values
    # what `nonlinear.find_optimum` found, where peaks were followed over one key, or `nonlinear.find_joint_optimum`
    # over two or three, the other keys at the optimum: in the units of the solver
    followed: Optimum | JointOptimum | None = None
    # of one key: its value for each unit of the solver's parameter. Stiffnesses of the whole face and the mean of the
    # nodes differ, the damping of the solver is a factor
    per_unit: float = 1.0
    method: str  # "peaks": peaks followed over keys of the solver; "curves": curves at single values; "both"
    # the values tried, in their order: where curves were solved at single values, and of a joint optimum
    trials: tuple[Trial, ...]
    responses: int  # number of responses that were solved or found in the store
    seconds: float = 0.0  # time of the search, s
    message: str = ""  # one line that says what was found
    remarks: tuple[str, ...] = ()  # what was left open, a sentence each
    # what is made low: "displacement", the largest displacement over a period; "harmonic_1", its first harmonic;
    # "stress", the largest stress amplitude; "margin", the inverse of the least fatigue margin; "life", the highest
    # amplitude over the life
    objective: str = "displacement"
    output: str = ""  # the output whose largest value is made low; "": the worst motion of the default output
    goal: float = math.nan  # as of `Trial`
    harmonics: int = 0  # number of harmonics at the optimum; 0: not known
    # estimated relative error of the amplitude at the optimum by neglected harmonics; NaN without an estimate
    truncation_error: float = math.nan
    where: Mapping[str, float] = field(default_factory=dict)  # as of `Trial`
    robust: Robust | None = None  # with tolerances: `amplitude_m` is the worst within them
    complete: bool = True  # whether the search came to its end
    solved: tuple[Trial, ...] = ()  # all single curves of a search over several keys

    @property
    def over_one_key(self) -> Optimum | None:
        """What was found where peaks were followed over one key."""
        return self.followed if isinstance(self.followed, Optimum) else None

    @property
    def value(self) -> float:
        """What is made low; with tolerances the worst within them."""
        return self.goal if math.isfinite(self.goal) else self.amplitude_m

    @property
    def gain(self) -> float:
        """What is made low with the scene's own values over that at the optimum; NaN where one is not known."""
        if self.base.at_end or not self.value:
            return math.nan
        return (self.base.value if self.robust is None else self.robust.around_own) / self.value

    @property
    def named(self) -> str:
        """What is made low, or of a margin high, in words."""
        return f"largest {self.output}" if self.output else OBJECTIVES[self.objective]

    def said(self, value: float) -> str:
        """A value of what is made low, in words."""
        return value_said(self.objective, value)


def message_of(result: OptimumResult) -> str:
    """One line that says what was found."""
    digits = 6 if result.robust is None else 4
    values = ", ".join(f"{key} = {shown(key, value, digits)}" for key, value in result.values.items())
    if result.robust is not None:
        return f"{values}: {_within_tolerance(result, result.robust)}"
    if result.kind == "flat":
        return f"{', '.join(result.values)}: {KINDS['flat'].said}, {_motion(result)}"
    firsts = {"harmonic_1": "harmonic 1 of ", LIFE: f"{result.named} "}
    first = firsts.get(result.objective) or _goal_said(result, result)
    return f"{values}: {KINDS[result.kind].said}, {first}{_motion(result)}{_gain(result)}"


def _within_tolerance(result: OptimumResult, robust: Robust) -> str:
    """What the worst motion is within the tolerances, and what it would be around the lowest single value."""
    default = result.objective == "displacement" and not result.output
    said = f"{'' if default else f'{result.named} '}{bound_said(result, robust, result.value)}"
    lowest = robust.lowest
    if lowest is None:
        return said
    single, place = result.said(lowest.value), shown(robust.key, lowest.values[robust.key], 4)
    alone = f"the {'highest' if result.objective == 'margin' else 'lowest'} single value is {single} at {place}"
    if robust.around_lowest <= ALIKE * result.value:
        return f"{said} ({alone})"
    there = bound_said(result, robust, robust.around_lowest).removeprefix("at most ").removeprefix("at least ")
    return f"{said} ({alone}, but {there} there)"


def bound_said(result: OptimumResult, robust: Robust, value: float) -> str:
    """`at most 3.2 µm within ±1 µm`, or `95 % below 3.2 µm`."""
    least = result.objective == "margin"
    if math.isfinite(robust.quantile):
        return f"{100.0 * robust.quantile:g} % {'above' if least else 'below'} {result.said(value)}"
    alone = list(robust.tolerance) == [robust.key]
    sizes = [(key, f"±{quantity(key).value(half)}") for key, half in robust.tolerance.items()]
    within = sizes[0][1] if alone else ", ".join(f"{key} {size}" for key, size in sizes)
    return f"at {'least' if least else 'most'} {result.said(value)} within {within}"


def _goal_said(result: OptimumResult, trial: OptimumResult | Trial) -> str:
    """What is made low where it is not the motion: `12 MPa with `."""
    return f"{result.named} {result.said(trial.value)} with " if math.isfinite(trial.goal) else ""


def value_said(objective: str, value: float) -> str:
    """A value of what an objective makes low: `3.2 µm`, `41 MPa`, of a margin its inverse `2.31`."""
    if objective == "margin":
        return f"{1.0 / value:.3g}"
    return with_unit(value, "Pa" if objective == "stress" else "m")


def shown(key: str, value: float, digits: int = 6) -> str:
    """A value of a key with six digits and its unit."""
    return quantity(key).value(float(f"{value:.{digits}g}"))


def result_lines(result: OptimumResult) -> list[str]:
    """The table of the optimum for a terminal, with tolerances sentences, and what was left open."""
    if result.robust is not None:
        said = robust_said(result, result.robust)
    else:
        rows = table_rows(result)
        width = max(len(name) for name, _ in rows)
        said = [f"{name:<{width}}  {text}" for name, text in rows]
    lines = [f"optimum: {result.message}", *(f"  {text}" for text in [*said, *candidates_said(result)])]
    return [*lines, *(f"note: {remark}" for remark in result.remarks)]


def robust_said(result: OptimumResult, robust: Robust) -> list[str]:
    """How sure and how sharp an optimum with tolerances is, what the scene's own value would be, the cost."""
    lines = []
    for key, ends in result.within.items():
        between = ""
        if key == robust.key:
            first, last = (shown(key, end, 4) for end in robust.bracket)
            between = f"the best lies between {first} and {last}; "
        low, high = (shown(key, end, 4) for end in ends)
        worse = "worse" if result.objective == "margin" else "higher"
        named = f"{key}: " if len(result.within) > 1 else ""
        lines.append(f"{named}{between}at most 10 % {worse} from {low} to {high}")
    worst = ""  # a quantile is that of no sample
    if not math.isfinite(robust.quantile):
        where = "".join(f", {key} = {shown(key, value, 4)}" for key, value in result.where.items())
        worst = f"; worst at {result.frequency_hz:.6g} Hz{where}"
    lines.append(f"{KINDS[result.kind].said}{worst}")
    own = f"the scene's own value, {_base(result)}"
    if math.isfinite(result.gain):
        own += f", {bound_said(result, robust, robust.around_own)}"
        own += "" if result.objective == "margin" else f": {result.gain:.3g} times the optimum"
    return [*lines, own, cost_said(result)]


def cost_said(result: OptimumResult) -> str:
    """Number of responses and time, and of values tried that need a model of their own."""
    count = sum(trial.curves > 1 for trial in result.trials)
    candidates = f"{count} candidate{'s' * (count > 1)}, " if count else ""
    return f"{candidates}{result.responses} responses, {result.seconds:.1f} s"


def candidates_said(result: OptimumResult) -> list[str]:
    """A line for each of the values tried that took several curves, rising."""
    tried = [trial for trial in result.trials if trial.curves > 1 or trial.reason]
    if not any(trial.curves for trial in tried):
        return []
    ordered = sorted(tried, key=lambda trial: [trial.values[key] for key in result.ranges if key in trial.values])
    return [candidate_said(result.objective, trial) for trial in ordered]


def candidate_said(objective: str, trial: Trial) -> str:
    """What is made low with some values, and what finding it took."""
    values = ", ".join(f"{key} = {shown(key, value, 4)}" for key, value in trial.values.items())
    found = value_said(objective, trial.value) if math.isfinite(trial.value) else trial.reason
    model = f", {duration(trial.model_seconds)} of them mesh and reduction" if trial.model_seconds else ""
    return f"{values}: {found}; {trial.curves} curves, {duration(trial.seconds)}{model}"


def table_rows(result: OptimumResult) -> list[tuple[str, str]]:
    """Names and values of what was found."""
    rows = []
    for key, value in result.values.items():
        low, high = result.ranges[key]
        rows.append((key, f"{shown(key, value)} (range {shown(key, low)} to {shown(key, high)})"))
    rows.append((f"worst motion, {result.named}", f"{_goal_said(result, result)}{_motion(result)}, {result.motion}"))
    rows.append(("kind", KINDS[result.kind].said))
    if math.isfinite(result.curvature):
        key = [*result.within][-1]  # of the followed peaks
        rows.append(("curvature", f"{result.curvature:.4g} m{_per(key, 2)}"))
    for key, (low, high) in result.within.items():
        rows.append((f"at most 10 % higher, {key}", f"{shown(key, low)} to {shown(key, high)}"))
    for key, slope in result.derivatives.items():
        rows.append((f"derivative, {key}", f"{slope:.4g} m{_per(key)}"))
    rows.append(("scene's own value", _base(result)))
    if math.isfinite(result.gain):
        rows.append(("own value over optimum", f"{result.gain:.3g}"))
    rows.append(("cost", cost_said(result)))
    return rows


def _per(key: str, power: int = 1) -> str:
    """The rest of the unit of a derivative by a key: "", "/N" or "/(N/m)^2"."""
    unit = key_unit(key)
    if not unit:
        return ""
    bare = f"({unit})" if "/" in unit else unit
    return f"/{bare}" + (f"^{power}" if power > 1 else "")


def _motion(result: OptimumResult | Trial) -> str:
    """Amplitude and frequency with units."""
    at_end = END_MARK if isinstance(result, Trial) and result.at_end else ""
    mark = at_end + truncation_mark(result.truncation_error)
    return f"{motion_said(result.amplitude_m, result.frequency_hz, 6)}{mark}"


def _base(result: OptimumResult) -> str:
    base = result.base
    values = ", ".join(f"{key} = {shown(key, value)}" for key, value in base.values.items())
    said = f"{_goal_said(result, base)}{_motion(base)}" if math.isfinite(base.amplitude_m) else base.reason
    return f"{values}: {said}"


def _gain(result: OptimumResult) -> str:
    """How the worst motion of the scene's own values compares."""
    if not math.isfinite(result.gain):
        return ""
    return f" (scene: {result.said(result.base.value)}, {result.gain:.3g} times)"

"""What the study `optimum` found, and its words: the message, the lines and cells of its table."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from nonlinear import JointOptimum, Optimum
from pipeline.results.worst import END_MARK, motion_said, truncation_mark, with_unit
from pipeline.scene.labels import quantity
from pipeline.scene.units import key_unit
from pipeline.studies.optimum.section import OBJECTIVES


class KindWords(NamedTuple):
    """What is said of a kind of optimum, as of `nonlinear.Optimum`."""

    said: str  # in a table, a legend and the message
    sentence: str  # in the report


KINDS = {
    "smooth": KindWords("smooth minimum", "The minimum is smooth"),
    "kink": KindWords(
        "kink: two peaks exchange", "Two peaks exchange there: the worst motion rises on both sides at once"
    ),
    "jump": KindWords(
        "beside a jump of the worst motion: keep a distance",
        "It lies beside a jump: on one side of it a much higher motion persists",
    ),
    "plateau": KindWords("lowest and constant around it", "Around it the lowest worst motion is constant"),
    "sampled": KindWords(
        "lowest of single curves", "No stable peak could be followed there: it is the lowest of the responses solved"
    ),
    "edge": KindWords("lowest at an end of a range", "There is no minimum inside the range: it is lowest at an end"),
    "flat": KindWords(
        "the worst motion changes by less than 0.1 % over the range", "The parameter hardly changes the worst motion"
    ),
}


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

    @property
    def height(self) -> float:
        """The amplitude, m; infinite where there is none, and at an end of the frequency range."""
        return self.amplitude_m if math.isfinite(self.amplitude_m) and not self.at_end else math.inf


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
    trials: tuple[Trial, ...]  # the values tried, where curves were solved at single values
    responses: int  # number of responses that were solved or found in the store
    seconds: float = 0.0  # time of the search, s
    message: str = ""  # one line that says what was found
    remarks: tuple[str, ...] = ()  # what was left open, a sentence each
    # what is made low: "displacement", the largest displacement over a period; "harmonic_1", its first harmonic
    objective: str = "displacement"
    harmonics: int = 0  # number of harmonics at the optimum; 0: not known
    # estimated relative error of the amplitude at the optimum by neglected harmonics; NaN without an estimate
    truncation_error: float = math.nan

    @property
    def over_one_key(self) -> Optimum | None:
        """What was found where peaks were followed over one key."""
        return self.followed if isinstance(self.followed, Optimum) else None

    @property
    def gain(self) -> float:
        """Worst motion with the scene's own values over that at the optimum; NaN where one is not known."""
        if self.base.at_end:
            return math.nan
        return self.base.amplitude_m / self.amplitude_m if self.amplitude_m else math.nan


def message_of(result: OptimumResult) -> str:
    """One line that says what was found."""
    values = ", ".join(f"{key} = {shown(key, value)}" for key, value in result.values.items())
    if result.kind == "flat":
        return f"{', '.join(result.values)}: {KINDS['flat'].said}, {_motion(result)}"
    first = "harmonic 1 of " if result.objective == "harmonic_1" else ""
    return f"{values}: {KINDS[result.kind].said}, {first}{_motion(result)}{_gain(result)}"


def shown(key: str, value: float) -> str:
    """A value of a key with six digits and its unit."""
    return quantity(key).value(value)


def result_lines(result: OptimumResult) -> list[str]:
    """The table of the optimum for a terminal, and what was left open."""
    rows = table_rows(result)
    width = max(len(name) for name, _ in rows)
    lines = [f"optimum: {result.message}", *(f"  {name:<{width}}  {text}" for name, text in rows)]
    return [*lines, *(f"note: {remark}" for remark in result.remarks)]


def table_rows(result: OptimumResult) -> list[tuple[str, str]]:
    """Names and values of what was found."""
    rows = []
    for key, value in result.values.items():
        low, high = result.ranges[key]
        rows.append((key, f"{shown(key, value)} (range {shown(key, low)} to {shown(key, high)})"))
    rows.append((f"worst motion, {OBJECTIVES[result.objective]}", f"{_motion(result)}, {result.motion}"))
    rows.append(("kind", KINDS[result.kind].said))
    if math.isfinite(result.curvature):
        (key,) = result.within
        rows.append(("curvature", f"{result.curvature:.4g} m{_per(key, 2)}"))
    for key, (low, high) in result.within.items():
        rows.append((f"at most 10 % higher, {key}", f"{shown(key, low)} to {shown(key, high)}"))
    for key, slope in result.derivatives.items():
        rows.append((f"derivative, {key}", f"{slope:.4g} m{_per(key)}"))
    rows.append(("scene's own value", _base(result.base)))
    if math.isfinite(result.gain):
        rows.append(("own value over optimum", f"{result.gain:.3g}"))
    rows.append(("cost", f"{result.responses} responses, {result.seconds:.1f} s"))
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


def _base(base: Trial) -> str:
    values = ", ".join(f"{key} = {shown(key, value)}" for key, value in base.values.items())
    return f"{values}: {_motion(base) if math.isfinite(base.amplitude_m) else base.reason}"


def _gain(result: OptimumResult) -> str:
    """How the worst motion of the scene's own values compares."""
    if not math.isfinite(result.gain):
        return ""
    return f" (scene: {with_unit(result.base.amplitude_m)}, {result.gain:.3g} times)"

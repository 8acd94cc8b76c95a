"""The study `wear`: motions of the duty followed while the faces wear, responses at a few times, sampled lives."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import StageError
from pipeline.process.progress import seconds_since
from pipeline.results.worst import NOTICEABLE, motion_said, with_unit
from pipeline.scene.sweep import as_in_scene, key_value
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.curve.respond import CurveResult
from pipeline.studies.study import StudyContext
from pipeline.studies.uncertainty.quantiles import LEVELS, quantile, sampled_values
from pipeline.studies.uncertainty.section import Marginal, marginal_of
from pipeline.studies.wear.life import HOUR, Life, point_label
from pipeline.studies.wear.result import (
    LifeEvent,
    LifeQuantile,
    Numbers,
    PointHistory,
    SampledLives,
    WearResult,
    WornResponse,
)

if TYPE_CHECKING:
    from nonlinear.wear.wear_history import WearHistory
    from pipeline.scene.schema import Scene
    from pipeline.studies.wear.section import Wear

STRESS_CODE = "pipeline.stress.operating_stress"
SHALLOW = 0.1  # worn depth over the size of the face above which the law of small wear is doubtful
EVENTS = {
    "limit": "limit reached",
    "lowest amplitude": "lowest amplitude",
    "node separates": "a node loses contact",
    "jump": "jump",
    "higher peak": "a higher peak is followed",
    "stick": "no node slips any more, wear ends",
    "separation": "no node is in contact any more",
    "lost": "the motion is lost",
}
COEFFICIENT = "wear.coefficient"
FARTHEST = 1e3  # factor on the wear coefficient beyond which a lognormal distribution is truncated


class WearStudy:
    """Wear of the contact faces over a life, as `Study`."""

    name = "wear"
    result = WearResult

    def key(self, context: StudyContext) -> Mapping[str, Any]:
        """The limits of the fatigue, of which a margin is made, and the distributions of sampled lives."""
        fatigue, section, laws = context.scene.fatigue, context.scene.wear, context.scene.uncertainty
        found: dict[str, Any] = {}
        if fatigue is not None:
            found |= {"fatigue": fatigue.model_dump(), "stress": code_fingerprint(STRESS_CODE)}
        if laws is not None and section is not None and section.samples is not None:
            found["laws"] = laws.model_dump()["parameter"]
        return found

    def compute(self, context: StudyContext) -> WearResult:
        """The life, then whole responses at a few times of it."""
        section = context.scene.wear
        assert section is not None  # the study is asked for
        return _Computation(context, section).result()

    def lines(self, result: WearResult) -> Sequence[str]:
        """The result in a line, events, and what qualifies it."""
        said = [result.message, *told(result), *result.remarks]
        return [f"wear: {line}" for line in said]


@dataclass
class _Computation:
    """One computation of the study."""

    context: StudyContext
    section: Wear

    @cached_property
    def life(self) -> Life:
        """The life of the scene's own values."""
        return Life(self.context, self.section)

    def result(self) -> WearResult:
        """Everything, from the curves of the duty on."""
        start = time.perf_counter()
        history = self.life.history(self._progress())
        responses = self._responses(history)
        found = self._found(history, responses)
        margin_hours = _margin_hours(responses, self.section.margin_limit)
        found = replace(found, margin_hours=margin_hours, lives=sampled_lives(self.context, self.section))
        return replace(found, message=headline(found), remarks=tuple(_remarks(found)), seconds=seconds_since(start))

    def _progress(self) -> Callable[[float, float], None]:
        """Says the share of the life that is done, every tenth."""
        told = 0.0

        def progress(share: float, amplitude: float) -> None:
            nonlocal told
            if share >= told + 0.1:
                told = share
                self.context.progress(f"wear, {100.0 * share:.0f} % of the life: {with_unit(amplitude)}")

        return progress

    def _responses(self, history: WearHistory) -> tuple[WornResponse, ...]:
        """Whole responses at the beginning, at events, at the end, and between these."""
        at_peak = [point for point in self.section.points if point.share > 0.0 and point.frequency is None]
        pairs = [(place, point) for place in _times(history, self.section.responses) for point in at_peak]
        members = [
            self.life.member(
                point,
                self.life.worn(history.interference_m[place]),
                ", ".join(filter(None, (f"after {history.time_s[place] / HOUR:.5g} h", point_label(point)))),
            )
            for place, point in pairs
        ]
        if not members:
            return ()
        self.context.progress(f"wear: {len(members)} responses with their worst motion")
        curves = self.context.curves(members)
        by_time: dict[int, list[CurveResult]] = {}
        for (place, _), curve in zip(pairs, curves, strict=True):
            by_time.setdefault(place, []).append(curve)
        return tuple(self._worst(history, place, found) for place, found in by_time.items())

    def _worst(self, history: WearHistory, place: int, curves: Sequence[CurveResult]) -> WornResponse:
        """The worst motion of the responses at a time."""
        hours, followed = float(history.time_s[place] / HOUR), float(history.highest_m[place])
        known = [(curve.facts.worst_amplitude_m, curve) for curve in curves if curve.facts is not None]
        known = [each for each in known if math.isfinite(each[0])]
        reasons = [curve.facts.worst_unresolved if curve.facts else curve.reason for curve in curves]
        remark = next((reason for reason in reasons if reason), "")
        if not known:
            return WornResponse(hours, math.nan, math.nan, "", followed, math.nan, remark or "no peak in the range")
        height, worst = max(known, key=lambda each: each[0])
        assert worst.facts is not None
        margins = [margin for curve in curves if (margin := self._margin(curve)) is not None]
        return WornResponse(
            hours,
            float(height),
            worst.facts.worst_frequency_hz,
            worst.facts.worst_motion,
            followed,
            min(margins, default=math.nan),
            remark,
        )

    def _margin(self, curve: CurveResult) -> float | None:
        """The least fatigue margin at the worst motion of a curve; None where it is not known."""
        scene, stress = self.context.scene, self.context.stress
        facts = curve.facts
        if scene.fatigue is None or stress is None or facts is None or not math.isfinite(facts.worst_amplitude_m):
            return None
        try:
            found = stress(replace(self.context.run, log=self.context.log), curve, scene.fatigue)
        except (ArithmeticError, ValueError, StageError):
            return None
        margin = found["least_margin"]
        return None if margin is None else margin / max(facts.worst_amplitude_m / found["amplitude_m"], 1.0)

    def _found(self, history: WearHistory, responses: tuple[WornResponse, ...]) -> WearResult:
        """The result without its words."""
        coefficient, names, model = self.life.by_node(), self.life.names(), self.life.model
        shares = [point.share for point in self.section.points]
        frame = () if model.contact_frame is None else tuple(model.contact_frame.reshape(-1, 9))
        points = tuple(
            PointHistory(
                label=point_label(point) or "at the peak",
                share=point.share / sum(shares),
                values=point.values,
                amplitude_m=history.amplitude_m[:, d],
                frequency_hz=history.frequency_hz[:, d],
                load_n=history.load_n[:, d],
                sticking=history.sticking[:, d],
                slipping=history.slipping[:, d],
                separating=history.separating[:, d],
            )
            for d, point in enumerate(self.section.points)
        )
        return WearResult(
            coefficient=dict(zip(names, coefficient.tolist(), strict=True)),
            hours=history.time_s / HOUR,
            cycles=history.cycles,
            points=points,
            highest_m=history.highest_m,
            power_w=history.power_w,
            volume_m3=history.volume_m3.sum(axis=1),
            depth_m=tuple(history.depth_m.T),
            interference_m=tuple(history.interference_m.T),
            interface=tuple(names),
            area_m2=self.life.areas(),
            position_m=tuple(model.contact_position),
            frame=frame,
            events=tuple(LifeEvent(e.kind, e.time_s / HOUR, float(e.cycles), e.said) for e in history.events),
            responses=responses,
            margin_hours=None,
            tolerance=self.section.tolerance,
            error_m=history.error_m,
            evaluations=history.evaluations,
            traces=history.traces,
            complete=history.complete,
            seconds=0.0,
        )


def _times(history: WearHistory, count: int) -> list[int]:
    """Places of so many times: both ends, the lowest amplitude, the first limit, and evenly between."""
    last = len(history.time_s) - 1
    chosen = [0, last, int(history.highest_m.argmin()), int(history.highest_m.argmax())]
    for event in history.events:
        if event.kind == "limit":
            chosen.append(int(np.searchsorted(history.time_s, event.time_s).clip(0, last)))
            break
    found = list(dict.fromkeys(chosen))[:count]
    while len(found) < min(count, last + 1):  # the middle of the widest gap
        ordered = sorted(found)
        gap = max(range(len(ordered) - 1), key=lambda k: history.time_s[ordered[k + 1]] - history.time_s[ordered[k]])
        middle = 0.5 * (history.time_s[ordered[gap]] + history.time_s[ordered[gap + 1]])
        place = int(np.abs(history.time_s - middle).argmin())
        if place in found:
            break
        found.append(place)
    return sorted(found)


def _margin_hours(responses: Sequence[WornResponse], limit: float | None) -> float | None:
    """When the least margin falls to the limit, linear between the responses; None where it does not."""
    known = [(each.hours, each.margin) for each in responses if math.isfinite(each.margin)]
    if limit is None or not known:
        return None
    if known[0][1] <= limit:
        return known[0][0]
    for (start, above), (end, below) in pairwise(known):
        if above > limit >= below:
            return start + (above - limit) / (above - below) * (end - start)
    return None


def headline(found: WearResult) -> str:
    """The life in a line."""
    height, lowest = found.highest_m, int(found.highest_m.argmin())
    said = f"{with_unit(float(height[0]))} at first, {with_unit(float(height[-1]))} after {found.hours[-1]:.5g} h"
    if 0 < lowest < len(height) - 1:
        said += f", lowest {with_unit(float(height[lowest]))} after {found.hours[lowest]:.4g} h"
    deepest = max(float(each[-1]) for each in found.depth_m)
    return f"{said}; worn {with_unit(deepest)} at most, {found.volume_m3[-1] * 1e9:.4g} mm³"


def told(found: WearResult) -> Iterator[str]:
    """The events in words; nodes that lose contact are counted together."""
    nodes = [event.hours for event in found.events if event.kind == "node separates"]
    if nodes:
        last = "" if len(nodes) == 1 else f" to {nodes[-1]:.4g} h"
        yield f"{len(nodes)} of {len(found.area_m2)} nodes lose contact, after {nodes[0]:.4g}{last or ' h'}"
    minima = [event for event in found.events if event.kind == "lowest amplitude"]
    lowest = min(minima, key=lambda each: np.interp(each.hours, found.hours, found.highest_m), default=None)
    for event in found.events:
        if event.kind not in ("node separates", "lowest amplitude") or event is lowest:
            height = with_unit(float(np.interp(event.hours, found.hours, found.highest_m)))
            said = height if event is lowest else event.said
            yield f"{EVENTS[event.kind]}{f': {said}' if said else ''}, after {event.hours:.4g} h"
    if found.lives is not None:
        yield lives_said(found.lives)
    if found.margin_hours is not None:
        yield f"limit reached: margin, after {found.margin_hours:.4g} h, between whole responses"


def lives_said(lives: SampledLives) -> str:
    """The quantiles of the time until the first limit in words."""
    said = [f"{100.0 * e.level:g} % below {e.hours:.4g} h" for e in lives.quantiles if e.known]
    missed = int((lives.reached == 0).sum())
    left = f"; {missed} reach no limit" if missed else ""
    return f"{len(lives.hours)} sampled lives: {', '.join(said) or 'no quantile is known'}{left}"


def _remarks(found: WearResult) -> Iterator[str]:
    """What qualifies the result."""
    if not found.complete:
        yield f"it ends after {found.hours[-1]:.4g} h, before the end of the life"
    above = [each for each in found.responses if each.worst_m > NOTICEABLE * each.followed_m]
    if above:
        worst = max(above, key=lambda each: each.worst_m / each.followed_m)
        said = motion_said(worst.worst_m, worst.worst_hz)
        yield (
            f"after {worst.hours:.4g} h the worst motion is {said}, the followed one {with_unit(worst.followed_m)}: "
            "the faces wear by the followed motion"
        )
    size = math.sqrt(float(found.area_m2.sum()))
    deepest = max(float(each[-1]) for each in found.depth_m)
    if deepest > SHALLOW * size:
        yield f"worn {with_unit(deepest)} deep on a face of {with_unit(size)}: more than small wear; check the unit"
    yield f"error of the interference: {with_unit(found.error_m)}, the sum over all steps"


def marginals_of(scene: Scene, section: Wear) -> list[Marginal]:
    """The distributions: a factor on the wear coefficient, and the parameters of [uncertainty]."""
    found = []
    if section.coefficient_factor is not None:
        spread = section.coefficient_factor
        found.append(Marginal(COEFFICIENT, "lognormal", 1.0, spread, 1.0 / FARTHEST, FARTHEST))
    laws = () if scene.uncertainty is None else scene.uncertainty.parameter
    return [*found, *(marginal_of(item, key_value(scene, item.key) or 0.0) for item in laws)]


def sampled_lives(context: StudyContext, section: Wear) -> SampledLives | None:
    """The times until the first limit of some lives; None where none are asked for."""
    if section.samples is None:
        return None
    marginals = marginals_of(context.scene, section)
    keys = [marginal.key for marginal in marginals]
    drawn, _ = sampled_values(marginals, section.samples, section.seed)
    context.progress(f"wear: {len(drawn)} sampled lives")
    if keys == [COEFFICIENT]:
        hours, reached = _times_of_one(context, section, drawn[:, 0])
    else:
        rows = [dict(zip(keys, row.tolist(), strict=True)) for row in drawn]
        hours, reached = _times_of_each(context, [_sample(context, section, row) for row in rows])
    estimates = [(level, quantile(hours, level, ~reached)) for level in LEVELS]
    return SampledLives(
        values={key: drawn[:, k] for k, key in enumerate(keys)},
        hours=hours,
        reached=reached.astype(np.int64),
        quantiles=tuple(LifeQuantile(level, e.value, e.low, e.high, e.at_most is not None) for level, e in estimates),
    )


def _times_of_one(context: StudyContext, section: Wear, factors: Numbers) -> tuple[Numbers, NDArray[np.bool_]]:
    """Times until the first limit with factors on the wear coefficient: twice as much wears twice as fast."""
    given = {name: value for name in ("hours", "cycles") if (value := getattr(section, name)) is not None}
    longest = {name: value * factors.max() for name, value in given.items()}
    history = Life(context, section.model_copy(update=longest)).history()
    first = min((event.time_s for event in history.events if event.kind == "limit"), default=np.inf)
    span = section.hours * HOUR * factors if section.hours is not None else (section.cycles or 0.0) * factors
    ends = span if section.hours is not None else np.interp(span, history.cycles, history.time_s)
    return np.minimum(first, ends) / factors / HOUR, first <= ends


def _times_of_each(context: StudyContext, lives: Sequence[Life]) -> tuple[Numbers, NDArray[np.bool_]]:
    """Hours until the first limit of each life, else those of the life, and whether a limit was reached."""
    context.curves([member for life in lives for member in life.members()])  # all at once, into the store
    hours, reached = np.empty(len(lives)), np.empty(len(lives), dtype=bool)
    for number, life in enumerate(lives):
        history = life.history(one_of_many=True)
        limits = [event.time_s for event in history.events if event.kind == "limit"]
        reached[number] = bool(limits)
        hours[number] = (limits[0] if limits else float(history.time_s[-1])) / HOUR
        if (number + 1) % (len(lives) // 4) == 0:
            context.progress(f"wear: {number + 1} of {len(lives)} sampled lives")
    return hours, reached


def _sample(context: StudyContext, section: Wear, at: dict[str, float]) -> Life:
    """A life with some values of the uncertain parameters."""
    factor = at.pop(COEFFICIENT, 1.0)
    given = section.coefficient
    scaled = {k: v * factor for k, v in given.items()} if isinstance(given, dict) else given * factor
    values = {key: as_in_scene(context.scene, key, value) for key, value in at.items()}
    return Life(context, section.model_copy(update={"coefficient": scaled}), values)

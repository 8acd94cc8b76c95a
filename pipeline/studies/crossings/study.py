"""The study `crossings`: a run at each speed where an engine order meets a mode, gathered to one table.

Every row is an ordinary run of the scene at one speed and engine order, found in the store or solved. The frequency
f of its worst motion gives the speed 60 f / EO at which the engine order has it: the run is repeated there until both
agree. A mode changes much less with the speed than the excitation, so that few runs do.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.codec import plain
from pipeline.errors import StageError, reason_of
from pipeline.process.interrupts import Stopped
from pipeline.process.progress import duration, seconds_since, time_left
from pipeline.results.worst import end_said, open_remarks, with_unit
from pipeline.scene.labels import quantity
from pipeline.scene.sweep import key_value
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.studies.crossings.meetings import (
    ORDER,
    PLACE,
    RUN,
    Meeting,
    Meetings,
    find_meetings,
    padded,
    rounded_speed,
    values_at,
)
from pipeline.studies.crossings.result import Crossing, CrossingsResult, Scatter
from pipeline.studies.crossings.scatter import scatter_of
from pipeline.studies.crossings.table import csv_text, table_lines
from pipeline.studies.mistuning.result import MistuningResult
from pipeline.studies.mistuning.study import MistuningStudy
from pipeline.studies.study import StudyError
from pipeline.studies.uncertainty.remarks import distribution_said
from pipeline.studies.uncertainty.section import marginal_of

if TYPE_CHECKING:
    from pipeline.scene.reading import Member
    from pipeline.scene.schema import Scene
    from pipeline.stages.curve.curve_summary import CurveSummary
    from pipeline.stages.curve.respond import CurveResult
    from pipeline.studies.study import StudyContext

PAUSE = 5.0  # s of gathering from which progress is said
STRESS_CODE = "pipeline.stress.operating_stress"
SCATTER, MISTUNED = "pipeline.studies.crossings.scatter", "pipeline.studies.mistuning.study"
RANGE = "response.frequency"
ROUNDS = 5  # runs of one crossing at most
SETTLED = 5e-3  # relative difference of the excitation frequency and that of the worst motion
SAME_HZ, SAME_M = 2e-3, 2e-2  # relative differences of two rows of an engine order that are one motion


class CrossingsStudy:
    """All resonance crossings of a scene, as `Study`."""

    name = "crossings"
    result = CrossingsResult

    def key(self, context: StudyContext) -> Mapping[str, Any]:
        """The engine orders with their forces, and the limits of the stress."""
        scene = context.scene
        found: dict[str, Any] = {"orders": list(scene.excitation.forces.items()), "stress": scene.with_stress}
        if scene.with_stress:
            limits = None if scene.fatigue is None else scene.fatigue.model_dump()
            found |= {"fatigue": limits, "stress_code": code_fingerprint(STRESS_CODE)}
        if scene.mistuning is not None:
            found |= {"mistuning": scene.mistuning.model_dump()}
        return {**found, **asked_of(context)}

    def compute(self, context: StudyContext) -> CrossingsResult:
        """The table; of a study that is stopped the rows so far are left with the stop."""
        computation = _Computation(context)
        try:
            return computation.result()
        except Stopped as stop:
            if computation.runs:
                stop.summary = plain(computation.table(complete=False))
            raise

    def lines(self, result: CrossingsResult) -> Sequence[str]:
        """The table and what it leaves out."""
        return table_lines(result)

    def table(self, result: CrossingsResult) -> str:
        """crossings.csv."""
        return csv_text(result)


def asked_of(context: StudyContext) -> dict[str, Any]:
    """What the scatter of a row depends on beside its run."""
    section, laws = context.scene.crossings, context.scene.uncertainty
    assert section is not None  # the study is asked for
    limits = section.limit is not None or section.margin is not None
    drawn = None if laws is None or not limits else [laws.seed, laws.model_dump()["parameter"]]
    force = context.scene.excitation.force  # relative to which that of an order varies
    return {"limits": section.model_dump(include={"limit", "margin", "tolerance"}), "laws": drawn, "base": force}


@dataclass(frozen=True)
class _Run:
    """The last run of a meeting."""

    speed: float
    values: Mapping[str, Any]  # keys of the scene
    curve: CurveResult

    @property
    def frequency_error(self) -> float:
        """Frequency of the worst motion over that of the excitation at the speed, less 1; NaN without one."""
        facts = self.curve.facts
        return math.nan if facts is None else resonance_hz(facts) / (self.values[ORDER] * self.speed / 60.0) - 1.0

    @property
    def speed_rpm(self) -> float:
        """The speed at which the engine order has the frequency of the worst motion."""
        return self.speed * (1.0 + self.frequency_error)


def resonance_hz(facts: CurveSummary) -> float:
    """Frequency of the worst motion; at an end of the range, where no peak is, that of the highest peak inside."""
    if not facts.at_end:
        return facts.worst_frequency_hz if math.isfinite(facts.worst_amplitude_m) else facts.peak_frequency_hz
    highest = max(facts.peaks, key=lambda peak: float(peak["amplitude_m"]), default=None)
    return math.nan if highest is None else float(highest["frequency_hz"])


class _Computation:
    """One computation of the study."""

    def __init__(self, context: StudyContext) -> None:
        section = context.scene.crossings
        assert section is not None  # the study is asked for
        self.context, self.section = context, section
        self.asked = asked_of(context)
        self.meetings: Meetings | None = None
        self.runs: dict[Meeting, _Run] = {}
        self.rows: dict[Meeting, Crossing] = {}

    def result(self) -> CrossingsResult:
        """Everything, from the meetings on."""
        try:
            self.meetings = find_meetings(self.context)
        except (ArithmeticError, ValueError) as error:  # such as a given model without centrifugal forces
            raise StudyError(reason_of(error)) from None
        self._solve(self.meetings.computed)
        self._gather()
        return self.table(complete=True)

    def _solve(self, meetings: Sequence[Meeting]) -> None:
        """Runs of all meetings, repeated until speed and frequency agree."""
        speeds = {meeting: meeting.start_rpm for meeting in meetings}
        for count in range(1, ROUNDS + 1):
            if not speeds:
                return
            self.context.progress(f"crossings, round {count}: {len(speeds)} of {len(meetings)} to solve")
            self._run(speeds)
            moved = {meeting: self._next_speed(self.runs[meeting]) for meeting in speeds}
            speeds = {meeting: speed for meeting, speed in moved.items() if speed is not None}

    def _run(self, speeds: Mapping[Meeting, float]) -> None:
        """One run of each meeting at its speed; those that are done stay where a signal ends this."""
        asked, members = [], []
        for meeting, speed in speeds.items():
            values = {
                **values_at(self.context, speed, meeting.line.engine_order),
                RANGE: list(meeting.range_hz(speed)),
            }
            asked.append((meeting, speed, values))
            members.append(self._member(values, f"{meeting.label}, {speed:g} rev/min"))
        curves: Sequence[CurveResult] = []
        try:
            curves = self.context.curves(members)
        except Stopped:
            curves = [curve for curve in self.context.done if curve.facts is not None]
            raise
        finally:
            for curve in curves:
                meeting, speed, values = asked[curve.member.index]
                self.runs[meeting] = _Run(speed, values, curve)

    def _member(self, values: Mapping[str, Any], label: str) -> Member:
        """The scene with some values; with its stress, so that models have what that needs."""
        member, scene = self.context.member(values, PLACE), self.context.scene
        asked = {"stress": scene.stress, "fatigue": scene.fatigue}
        return replace(member, parameters={RUN: label}, scene=member.scene.model_copy(update=asked))

    def _next_speed(self, run: _Run) -> float | None:
        """The speed of the next run of a crossing; None where speed and frequency agree, or can not."""
        if not abs(run.frequency_error) > SETTLED:
            return None
        speed = rounded_speed(float(np.clip(run.speed_rpm, *padded(self.section.speed))))
        return None if speed == run.speed else speed

    def _gather(self) -> None:
        """The rows, with the stress where that is asked for."""
        if self.runs and not any(run.curve.facts for run in self.runs.values()):
            raise StudyError(f"no crossing has a curve: {next(iter(self.runs.values())).curve.reason}")
        start, groups = time.perf_counter(), self._groups()
        for count, group in enumerate(groups, start=1):
            row = self._stressed(self._row(group), self.runs[group[0]].curve)
            row = self._scattered(row, self.runs[group[0]])
            self.rows[group[0]] = self._mistuned(row, self.runs[group[0]])
            if seconds_since(start) > PAUSE and count < len(groups):
                left = duration(time_left(seconds_since(start), count, len(groups)))
                self.context.progress(f"crossings: {count} of {len(groups)} rows; about {left} left")

    def table(self, complete: bool) -> CrossingsResult:
        """The rows so far."""
        assert self.meetings is not None
        rows = [self.rows.get(group[0]) or self._row(group) for group in self._groups()]
        left_out = [f"{m.label}: {said}" for m, run in self.runs.items() if (said := self._no_row(run))]
        return CrossingsResult(
            speed_rpm=self.section.speed,
            steady_rpm=self.section.steady or self.section.speed,
            rows=tuple(sorted(rows, key=lambda row: (row.engine_order, row.speed_rpm))),
            speeds=self.meetings.speeds,
            lines=self.meetings.lines,
            asked=tuple(_asked_said(self.context.scene)),
            left_out=(*left_out, *self.meetings.left_out),
            complete=complete,
        )

    def _no_row(self, run: _Run) -> str:
        """Why a run has no row; "" where it has one."""
        facts = run.curve.facts
        if facts is None:
            return run.curve.reason
        if facts.at_end and not facts.peaks:
            low, high = run.values[RANGE]
            return f"no peak of its own from {low:g} to {high:g} Hz, at most {with_unit(facts.height)}"
        low, high = padded(self.section.speed)
        if run.speed_rpm < low * (1.0 - SETTLED) or run.speed_rpm > high * (1.0 + SETTLED):
            return f"resonance at about {run.speed_rpm:.4g} rev/min, outside of the range"
        return ""

    def _groups(self) -> list[list[Meeting]]:
        """The meetings that have a row; those of an engine order whose worst motion is the same one share it."""
        groups: list[list[Meeting]] = []
        for meeting in [m for m, run in self.runs.items() if not self._no_row(run)]:
            for group in groups:
                if self._is_one_motion(group[0], meeting):
                    group.append(meeting)
                    break
            else:
                groups.append([meeting])
        return groups

    def _is_one_motion(self, one: Meeting, other: Meeting) -> bool:
        """Whether the worst motions of two meetings are the same."""
        facts = [curve.facts for curve in (self.runs[one].curve, self.runs[other].curve) if curve.facts is not None]
        if one.line.engine_order != other.line.engine_order or len(facts) < 2:
            return False
        (f, a), (g, b) = ((resonance_hz(each), each.height) for each in facts)
        return abs(f / g - 1.0) < SAME_HZ and abs(a / b - 1.0) < SAME_M

    def _row(self, group: Sequence[Meeting]) -> Crossing:
        """The row of some meetings without its stress."""
        meeting = group[0]
        run = self.runs[meeting]
        facts, scene = run.curve.facts, run.curve.member.scene
        assert facts is not None
        steady = [speed for speed in self.section.steady or self.section.speed if speed > 0.0]
        remarks = [*filter(None, (end_said(facts),)), *open_remarks(facts)]
        if abs(run.frequency_error) > SETTLED:
            off = f"{100.0 * run.frequency_error:+.2g} %"
            remarks.append(f"speed not settled: the worst motion is {off} off the engine order")
        return Crossing(
            engine_order=meeting.line.engine_order,
            modes=tuple(each.line.mode for each in group),
            name=", ".join(dict.fromkeys(each.line.name for each in group)),
            nodal_diameter=meeting.nodal_diameter,
            wave=meeting.wave,
            speed_rpm=run.speed,
            parameters=run.values,
            worst=facts,
            distance=min((run.speed / speed - 1.0 for speed in steady), key=abs),
            frequency_error=run.frequency_error,
            temperature=_temperature(scene),
            remarks=tuple(remarks),
        )

    def _scattered(self, row: Crossing, run: _Run) -> Crossing:
        """The row with the effect of tolerances and the probability that a limit is exceeded, where asked for."""
        section, context = self.section, self.context
        if section.limit is None and section.margin is None and not section.tolerances:
            return row
        assert run.curve.file is not None
        inputs = {"curve": run.curve.file.parent.name, "margin": plain(row.margin), **self.asked}
        found = context.stored(
            PLACE, inputs, Scatter, SCATTER, lambda: scatter_of(context, run.curve, run.values, row.margin)
        )
        return replace(row, scatter=found, remarks=(*row.remarks, *found.remarks))

    def _mistuned(self, row: Crossing, run: _Run) -> Crossing:
        """The row with the amplification by mistuning, where the scene has [mistuning]."""
        context, keys = self.context, self.context.scene.mistuning
        if keys is None:
            return row
        keys = keys.model_copy(update={"frequency_range": None})  # that of the row
        member = replace(run.curve.member, index=0)
        model = context.model_of(member)
        member = replace(member, scene=member.scene.model_copy(update={"mistuning": keys}))
        request = replace(context.run.request, scene=replace(context.file, members=(member,), swept=()))
        alone = replace(context, run=replace(context.run, request=request), models={0: model})
        assert run.curve.file is not None
        inputs = {"curve": run.curve.file.parent.name, "mistuning": keys.model_dump()}
        try:
            found = context.stored(
                "mistuned", inputs, MistuningResult, MISTUNED, lambda: MistuningStudy().compute(alone)
            )
        except StudyError as error:
            return replace(row, remarks=(*row.remarks, f"amplification not known: {error}"))
        factors = [ring.factor for ring in found.rings if math.isfinite(ring.factor)]
        return replace(row, amplification=max(factors))

    def _stressed(self, row: Crossing, curve: CurveResult) -> Crossing:
        """The row with the stress at its worst motion, where the scene asks for it and there is a mesh."""
        context = self.context
        if not context.scene.with_stress or context.stress is None or context.run.request.without_mesh:
            return row
        try:
            found = context.stress(replace(context.run, log=context.log), curve, context.scene.fatigue)
        except (ArithmeticError, ValueError, StageError) as error:
            return replace(row, remarks=(*row.remarks, f"no stress: {reason_of(error)}"))
        margin = found["least_margin"]
        return replace(
            row, stress_pa=found["largest_amplitude_pa"], margin=math.nan if margin is None else float(margin)
        )


def _asked_said(scene: Scene) -> Iterator[str]:
    """Tolerances, limits and laws of a scene."""
    section, laws = scene.crossings, scene.uncertainty
    assert section is not None  # the study is asked for
    if section.tolerances:
        width = (f"{quantity(key).symbol} ± {quantity(key).value(half)}" for key, half in section.tolerances.items())
        yield f"tolerances: {', '.join(width)}"
    limits = [] if section.limit is None else [f"worst motion at most {with_unit(section.limit)}"]
    limits += [] if section.margin is None else [f"margin {section.margin:g} or more"]
    if limits and laws is not None:
        drawn = [marginal_of(item, key_value(scene, item.key) or 0.0) for item in laws.parameter]
        yield f"limit: {', '.join(limits)}; uncertain: {', '.join(map(distribution_said, drawn))}"


def _temperature(scene: Scene) -> tuple[float, float] | None:
    """Lowest and highest temperature of a body; None without a temperature, or where a file has it."""
    given, factor = scene.load.temperature, scene.load.temperature_factor
    if given is None:
        return None
    if (ends := given.linear) is None:
        if given.uniform is None:
            return None
        ends = given.uniform, given.uniform
    low, high = (given.reference + factor * (value - given.reference) for value in ends)
    return min(low, high), max(low, high)

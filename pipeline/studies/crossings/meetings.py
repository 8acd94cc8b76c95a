"""Where engine orders meet modes: natural frequencies at a few speeds, and which meetings are computed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.results.frequency_range import stored_resonances
from pipeline.results.modes import static_cases
from pipeline.stages.engine_orders import FEWEST, SPEED
from pipeline.stages.model.natural_frequencies import stored_frequencies
from pipeline.studies.crossings.result import ModeLine, Numbers
from rom.cyclic.resonance_crossings import excited_nodal_diameter, speed_crossings, wave_direction

if TYPE_CHECKING:
    from pipeline.scene.reading import Member
    from pipeline.stages.model.model_chain import BuiltModel
    from pipeline.studies.study import StudyContext

PLACE = "crossings"
RUN = "crossing"  # a word by which runs differ: no branch is carried to another, a row is its own run
BESIDE = 0.05  # of the ends of the speed range, up to which crossings are computed too
ROOM = 0.05  # of the free and the stuck frequency, by which the frequency range of a run goes beyond them
LEAST_FREE = 0.2  # of the stuck frequency, below which no resonance of a body that contacts alone hold is sought
MOSTLY_OPEN = 0.5  # share of open contacts from which a resonance is sought from the free frequency on
FACTOR, ORDER, FORCE = "load.temperature_factor", "excitation.engine_order", "excitation.force"


@dataclass(frozen=True, eq=False)
class Meeting:
    """A mode and an engine order whose line passes between its free and its stuck frequency in the speed range."""

    line: ModeLine
    below: ModeLine | None  # the next lower and the next higher mode of the wave
    above: ModeLine | None
    speeds: Numbers  # (K,), of the lines, rev/min
    start_rpm: float  # where the resonance is sought first
    nodal_diameter: int
    wave: str

    @property
    def label(self) -> str:
        """Engine order and mode."""
        return f"EO {self.line.engine_order}, {self.line.name}"

    def range_hz(self, speed: float) -> tuple[float, float]:
        """Frequency range of the run at a speed: around the mode, up to half-way to modes that lie apart."""
        free, stuck = (at_speed(self.speeds, hz, speed) for hz in (self.line.free_hz, self.line.stuck_hz))
        free = max(free, LEAST_FREE * stuck)
        low, high = (1.0 - ROOM) * free, (1.0 + ROOM) * stuck
        if self.below is not None and (ends := at_speed(self.speeds, self.below.stuck_hz, speed)) < free:
            low = max(low, 0.5 * (ends + free))
        if self.above is not None and (begins := at_speed(self.speeds, self.above.free_hz, speed)) > stuck:
            high = min(high, 0.5 * (begins + stuck))
        return _rounded(low, math.floor), _rounded(high, math.ceil)


def at_speed(speeds: Numbers, hertz: Numbers, speed: float) -> float:
    """A natural frequency at a speed: its square is linear in the squared speed."""
    return float(np.sqrt(np.interp(speed**2, speeds**2, hertz**2)))


def _rounded(frequency_hz: float, towards: Any) -> float:
    """A frequency with three digits, rounded in one direction: it does not hang on the last bit of an eigenvalue."""
    unit = 10.0 ** (math.floor(math.log10(frequency_hz)) - 2)
    return float(f"{towards(frequency_hz / unit) * unit:.6g}")


def padded(speed: tuple[float, float]) -> tuple[float, float]:
    """The speeds at which crossings are computed."""
    return (1.0 - BESIDE) * speed[0], (1.0 + BESIDE) * speed[1]


def rounded_speed(speed: float) -> float:
    """A speed with five digits, as it is typed."""
    return float(f"{speed:.5g}")


def values_at(context: StudyContext, speed: float, order: int) -> dict[str, Any]:
    """Keys of the scene at a speed under an engine order."""
    section, scene = context.scene.crossings, context.scene
    assert section is not None  # the study is asked for
    values: dict[str, Any] = {SPEED: speed, ORDER: order, FORCE: scene.excitation.forces[order]}
    if section.temperature_factor is not None:
        values[FACTOR] = float(f"{np.interp(speed, section.speed, section.temperature_factor):.6g}")
    return values


@dataclass(frozen=True)
class Meetings:
    """The mode lines of all engine orders, what is computed of them, and what is not."""

    speeds: Numbers
    lines: tuple[ModeLine, ...]
    computed: tuple[Meeting, ...]
    left_out: tuple[str, ...]


def find_meetings(context: StudyContext) -> Meetings:
    """The meetings of the engine orders of the scene with the modes, by models at a few speeds."""
    section = context.scene.crossings
    assert section is not None  # the study is asked for
    low, high = padded(section.speed)
    speeds = np.array([rounded_speed(math.sqrt(x)) for x in np.linspace(low**2, high**2, FEWEST)])
    orders = sorted(context.scene.excitation.forces)
    members = [[context.member(values_at(context, speed, order), PLACE) for order in orders] for speed in speeds]
    context.progress(f"crossings: natural frequencies at {', '.join(f'{n:g}' for n in speeds)} rev/min")
    models = context.models_of([row[0] for row in members])
    store = context.run.store
    static = [static_cases(store, model, row[0]) for model, row in zip(models, members, strict=True)]
    opened = np.array([np.mean([case.open_share for case in cases]) if cases else 1.0 for cases in static])
    blades = stored_frequencies(store, models[0], members[0][0].scene)["n_blades"]
    lines: list[ModeLine] = []
    computed: list[Meeting] = []
    left_out: list[str] = []
    for k in range(len(orders)):
        of_order = [row[k] for row in members]
        own = list(_lines(context, models, of_order))
        lines += own
        met = list(_met(own, speeds, opened, blades))
        excited = _excited(context, models[-1], of_order[-1])
        for meeting in met:
            if (height := excited.get(meeting.line.mode, 0.0)) >= section.least and height > 0.0:
                computed.append(meeting)
            else:
                left_out.append(f"{meeting.label}: not excited, {100.0 * height:.2g} % of the highest of its order")
    return Meetings(speeds, tuple(lines), tuple(computed), tuple(left_out))


def _lines(context: StudyContext, models: Sequence[BuiltModel], members: Sequence[Member]) -> Iterator[ModeLine]:
    """The modes of one engine order."""
    order = members[0].scene.excitation.engine_order
    found = [
        stored_frequencies(context.run.store, m, member.scene, order)
        for m, member in zip(models, members, strict=True)
    ]
    free, stuck = (np.array([each[f"{state}_hz"] for each in found]) for state in ("free", "stuck"))
    names = found[0].get("free_names") or [f"mode {mode}" for mode in range(1, free.shape[1] + 1)]
    for mode, name in enumerate(names):
        yield ModeLine(order, mode + 1, name, free[:, mode], stuck[:, mode])


def _met(lines: Sequence[ModeLine], speeds: Numbers, opened: Numbers, blades: int | None) -> Iterator[Meeting]:
    """The modes of an engine order that it meets, with the speed where a resonance is sought first."""
    for k, line in enumerate(lines):
        order = line.engine_order
        free, stuck = (speed_crossings(speeds, hz, order) for hz in (line.free_hz, line.stuck_hz))
        between = line.free_hz[0] <= order * speeds[0] / 60.0 <= line.stuck_hz[0]
        if not (free or stuck or between):
            continue
        of_free = free[0][0] if free else float(speeds[0])
        of_stuck = stuck[0][0] if stuck else float(speeds[-1])
        is_open = of_free > 0.0 and np.interp(of_free, speeds, opened) >= MOSTLY_OPEN
        yield Meeting(
            line,
            lines[k - 1] if k else None,
            lines[k + 1] if k + 1 < len(lines) else None,
            speeds,
            rounded_speed(of_free if is_open else of_stuck),
            excited_nodal_diameter(order, blades),
            wave_direction(order, blades),
        )


def _excited(context: StudyContext, model: BuiltModel, member: Member) -> Mapping[int, float]:
    """Height of the linear resonance of each mode over the highest, by number of the mode."""
    heights: dict[int, float] = {}
    for each in stored_resonances(context.run.store, model.key, member.scene, model.rom):
        heights[each.number] = max(each.amplitude_m, heights.get(each.number, 0.0))
    highest = max(heights.values(), default=0.0)
    return {number: height / highest for number, height in heights.items()} if highest > 0.0 else {}

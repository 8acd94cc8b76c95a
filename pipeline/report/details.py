"""Details of the page: contact nodes over the cycle at the peak of a curve, resonance crossings, stress, studies.

A contact node has states, largest force and friction work; crossings are those of each reduced model and over the
speeds of a sweep; stress has a picture, hot spots and errors of each curve; a study has its own section and figure.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.figures.data import PlottedCurve
from pipeline.report.charts import inline_figure, inline_render
from pipeline.report.report_source import ReportSource
from pipeline.results.publishing import Attempts
from pipeline.results.stress import errors_said, headline, spot_rows
from pipeline.scene.labels import member_label
from pipeline.stages.request import StudyOutcome
from pipeline.studies.registry import StudySection, figure_file, section_of


@dataclass(frozen=True)
class ShownStudy:
    """A study on the page: its name, which is its place, its section, its figure as a data URI."""

    name: str
    section: StudySection
    uri: str | None


def study_sections(source: ReportSource, attempts: Attempts) -> list[ShownStudy]:
    """Sections of all studies of the run, in the order of the scene."""
    shown = []
    for name, study in source.studies.items():
        section = attempts.result(name, partial(_section, study))
        if section is not None:
            shown.append(ShownStudy(name, section, _figure(source, name, attempts)))
    return shown


def _section(study: StudyOutcome) -> StudySection:
    return section_of(study.name)(study.result)


def _figure(source: ReportSource, study: str, attempts: Attempts) -> str | None:
    """The figure of a study as a data URI."""
    svg, png = (source.pictures.get(f"figures/{figure_file(study)}.{suffix}") for suffix in ("svg", "png"))
    return None if svg is None else attempts.result(f"figure {study}", partial(inline_figure, svg, png))


MOST_ROWS = 60
_NAMES = ("no.", "engine order", "nodal diameters", "wave", "mode", "free [Hz]", "stuck [Hz]", "speed [rev/min]")


@dataclass(frozen=True)
class CrossingTable:
    """Crossings of one reduced model, as texts; `left_out` of them stand in summary.json only."""

    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    left_out: int = 0


def crossing_tables(source: ReportSource) -> list[CrossingTable]:
    """One table for every entry of `models` in summary.json, with the numbers of the nodal diameter diagram."""
    return [_table(row.get("crossings", ())) for row in source.model_rows]


def campbell_table(entries: Sequence[dict[str, Any]]) -> CrossingTable | None:
    """Crossings over the speeds of a sweep; None without any."""
    headings = ("engine order", "mode", "shrouds", "frequency [Hz]", "speed [rev/min]")
    rows = tuple(
        (str(e["engine_order"]), str(e["mode"]), e["contact"], f"{e['frequency_hz']:.6g}", f"{e['speed_rpm']:.6g}")
        for e in entries[:MOST_ROWS]
    )
    return CrossingTable(headings, rows, max(len(entries) - MOST_ROWS, 0)) if rows else None


def _table(crossings: Sequence[dict[str, Any]]) -> CrossingTable:
    ordered = sorted(crossings, key=lambda each: (each["engine_order"], each["mode"]))
    at_speed = any(each["margin"] is not None for each in ordered)
    headings = (*_NAMES, "from the range", *(("margin at the steady speed",) if at_speed else ()))
    rows, number = [], 0
    for each in ordered:
        inside = each["range_distance"] == 0.0
        number += inside
        speeds = "-" if each["free_rpm"] is None else f"{_speed(each['free_rpm'])} to {_speed(each['stuck_rpm'])}"
        rows.append(
            (
                str(number) if inside else "-",
                str(each["engine_order"]),
                str(each["nodal_diameter"]),
                each["wave"],
                f"{each['mode']}{': ' * bool(each['name'])}{each['name']}",
                f"{each['free_hz']:.6g}",
                f"{each['stuck_hz']:.6g}",
                speeds,
                "inside" if inside else _percent(each["range_distance"]),
                *(("-" if each["margin"] is None else _percent(each["margin"]),) if at_speed else ()),
            )
        )
    return CrossingTable(headings, tuple(rows[:MOST_ROWS]), max(len(rows) - MOST_ROWS, 0))


def _speed(value: float) -> str:
    """A speed with five digits, or all before the point."""
    return f"{value:.0f}" if value >= 1e4 else f"{value:.5g}"


def _percent(distance: float) -> str:
    """A signed relative distance; 0: resonance."""
    return "resonance" if distance == 0.0 else f"{100.0 * distance:+.3g} %"


@dataclass(frozen=True)
class StressDetail:
    """The stress of one curve: texts, picture as a data URI, tables of hot spots with their captions."""

    label: str
    headline: str
    errors: str
    file: str
    uri: str | None
    margin: bool
    tables: tuple[tuple[str, list[tuple[str, ...]]], ...]
    notes: tuple[str, ...]


def stress_details(source: ReportSource, attempts: Attempts) -> list[StressDetail]:
    """What the page shows of each curve whose stress was computed."""
    return [_detail(source, entry, attempts) for entry in source.stress]


def _detail(source: ReportSource, entry: dict[str, Any], attempts: Attempts) -> StressDetail:
    number: int = entry["curve"]
    picture = next((source.pictures[name] for name in entry["pictures"] if name in source.pictures), None)
    drawn = None if picture is None else attempts.result(f"stress of curve {number}", partial(inline_render, picture))
    facts = source.curves[number].facts
    return StressDetail(
        label=member_label(source.curves[number].member),
        headline=headline(entry, facts is not None and facts.worst_unstable),
        errors=errors_said(entry),
        file=entry["file"],
        uri=drawn,
        margin=entry["required_margin"] is not None,
        tables=tuple(_tables(entry)),
        notes=tuple(entry["notes"]),
    )


def _tables(entry: dict[str, Any]) -> Sequence[tuple[str, list[tuple[str, ...]]]]:
    """Hot spots, and the largest values at singular places."""
    captions = (
        ("hot_spots", "Hot spots"),
        ("singular_spots", "Singular places: these numbers grow without limit, or nearly so, as the mesh is refined"),
    )
    return [(caption, spot_rows(entry[name])) for name, caption in captions if entry[name]]


Array = NDArray[np.float64]
SAMPLES = 720
NOTHING = 1e-9  # of the largest tangential force times the range of the motion


@dataclass(frozen=True)
class NodeCycle:
    """One contact node over one period."""

    number: int  # number of the node, from 1
    # `row`, `column`: place in the grid of the face, along the radius and along the segment, from 0
    row: int
    column: int
    # stick, slip and separation intervals: state, start and end as shares of the period
    intervals: tuple[tuple[str, float, float], ...]
    shares: dict[str, float]  # share of the period in each state
    work_j: float  # friction work per cycle, J
    largest_normal_n: float  # largest normal force, N


@dataclass(frozen=True)
class FaceCycle:
    """The nodes of a contact face at the peak of one curve; `work_j` is their friction work per cycle, J."""

    name: str  # its interface
    columns: int
    rows: int
    nodes: tuple[NodeCycle, ...]
    work_j: float


def face_cycles(curve: PlottedCurve, grid: tuple[int, int] | None) -> list[FaceCycle]:
    """The cycle at the peak of a curve on the face of each interface, of `grid` nodes (along segment, radius).

    Without a grid, or with another number of nodes, they stand in one row.
    """
    from nonlinear.contact.element_choice import contact_cycle
    from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK

    names = {STICK: "stick", SLIP: "slip", LIFT_OFF: "open"}
    contact = curve.contact_parameters
    cycle = contact_cycle(curve.peak_displacement, contact, samples=SAMPLES)
    velocity = np.roll(cycle.displacement, -1, axis=0) - np.roll(cycle.displacement, 1, axis=0)
    work = np.sum(cycle.force[:, :, :2] * velocity[:, :, :2] / 2.0, axis=(0, 2))
    # the path of a node that only sticks is a line in force and displacement: its work is round-off
    line = np.abs(cycle.force[:, :, :2]).max(axis=(0, 2)) * np.ptp(cycle.displacement[:, :, :2], axis=0).max(axis=1)
    work = np.where(work > NOTHING * line, work, 0.0)
    faces = []
    for interface, own in curve.interfaces.items():
        columns, rows = grid if grid is not None and grid[0] * grid[1] == len(own) else (len(own), 1)
        nodes = []
        for number, k in enumerate(own):
            states = [names[int(value)] for value in cycle.state[:, k]]
            nodes.append(
                NodeCycle(
                    number=number + 1,
                    row=number // columns,
                    column=number % columns,
                    intervals=_intervals(states),
                    shares={name: states.count(name) / SAMPLES for name in names.values()},
                    work_j=float(work[k]),
                    largest_normal_n=float(cycle.force[:, k, 2].max()),
                )
            )
        faces.append(FaceCycle(interface, columns, rows, tuple(nodes), sum(node.work_j for node in nodes)))
    return faces


def _intervals(states: list[str]) -> tuple[tuple[str, float, float], ...]:
    """Intervals of equal state over the period."""
    changes = [0, *(k for k in range(1, len(states)) if states[k] != states[k - 1]), len(states)]
    return tuple((states[a], a / len(states), b / len(states)) for a, b in pairwise(changes))

"""The page: its contents and the rendering of its template."""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from pipeline.figures.data import PlottedCurve, SweepPoint, curve_colours, plotted_curves, sweep_points
from pipeline.figures.hysteresis import most_damped
from pipeline.figures.peaks import curves_to_read, has_few_lines
from pipeline.figures.response import has_lines
from pipeline.report.charts import (
    captions,
    charts,
    inline_figure,
    inline_render,
    inline_vector,
    loops_drawing,
    ring_drawing,
)
from pipeline.report.details import (
    FaceCycle,
    campbell_table,
    crossing_tables,
    face_cycles,
    stress_details,
    study_sections,
)
from pipeline.report.error_budget import LEVELS, compared_designs, error_rows, quantile_rows, shown_rows, story
from pipeline.report.report_source import ReportSource
from pipeline.report.rows import (
    blade_rows,
    contact_rows,
    cost_rows,
    curve_table,
    frequency_tables,
    matrix_rows,
    mesh_rows,
    model_rows,
    nodal_contact_rows,
    output_rows,
    over_sweep,
)
from pipeline.report.viewer import MOST_MODELS, ViewerData, chosen_evenly
from pipeline.results.best_design import compares_designs, condition_keys, values_label
from pipeline.results.conclusion import (
    INTERFACES_SAID,
    STATIC_SAID,
    interface_rows,
    screen_curves,
    shown_numbers,
    static_rows,
)
from pipeline.results.publishing import Attempts
from pipeline.results.run_folder import origin
from pipeline.results.stress import SPOT_HEADINGS
from pipeline.results.tables import has_static_load
from pipeline.results.worst import END_MARK, with_unit
from pipeline.scene.labels import member_label, prefixed
from pipeline.scene.schema import Scene
from pipeline.stages.model.build_mesh import SECTOR
from pipeline.stages.model.model_chain import BuiltModel
from pipeline.stages.scene_to_solver import contact_on_model, springs_by_state

TEMPLATES = Path(__file__).parent / "templates"
MOST_CONTACTS, MOST_OPERATING, MOST_STILLS = 10, 10, 9
STILL_BLADES = 3


@dataclass(frozen=True)
class Picture:
    """An image as a data URI, with what it shows."""

    uri: str
    caption: str


@dataclass(frozen=True)
class ContactDetail:
    """The contact of one curve at its peak: cycle, friction work with its unit, hysteresis loops as a data URI."""

    label: str
    peak: str
    faces: list[FaceCycle]
    factor: float
    unit: str
    total: str
    loops: str | None
    open: bool

    @property
    def shares(self) -> dict[str, float]:
        """Share of nodes and time in each state."""
        nodes = [node for face in self.faces for node in face.nodes]
        return {name: sum(node.shares[name] for node in nodes) / len(nodes) for name in nodes[0].shares}

    @property
    def most_work(self) -> float:
        """Largest friction work of a node, J."""
        return max((node.work_j for face in self.faces for node in face.nodes), default=0.0)


def page(source: ReportSource, attempts: Attempts) -> str:
    """The whole page, HTML; a picture that fails is left out and noted in `attempts`."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("report.html").render(_content(source, attempts))


def _content(source: ReportSource, attempts: Attempts) -> dict[str, Any]:
    points = sweep_points(source.curves)
    shown = plotted_curves(source.curves, None if has_lines(points) else curves_to_read(points))
    errors = error_rows(source, shown)
    members = [curve.member for curve in source.curves]
    colours = dict(zip([member.index for member in members], curve_colours(members), strict=True))
    bifurcations = source.first.figures.bifurcations
    charts_of = attempts.result("charts", lambda: charts(shown, points, colours, bifurcations)) or {}
    model = next((found for found in source.models.values() if found is not None), None)
    details, of_curves = _contacts(source, shown, attempts)
    viewer = attempts.result("shapes", lambda: _viewer(source, shown))
    return {
        "source": source,
        "provenance": _origin(),
        "story": story(source, points, errors),
        "table": curve_table(source, shown_rows(points, source.curves)),
        "quantiles": quantile_rows(source.curves),
        "levels": [f"{100.0 * level:.0f} %" for level in LEVELS],
        "cards": _cards(source, points),
        "charts": charts_of,
        "chart_data": _json(charts_of),
        "figures": _figures(source, attempts, points),
        "frequencies": list(zip(frequency_tables(source), crossing_tables(source), strict=True)),
        "campbell": campbell_table(source.campbell),
        "facts": _facts(source, model),
        "ring": _ring(model, attempts),
        "stills": _stills(source, attempts),
        "studies": study_sections(source, attempts),
        "stresses": stress_details(source, attempts),
        "spot_headings": SPOT_HEADINGS,
        "viewer": None if viewer is None else _json(viewer.plain()),
        "viewer_left_out": 0 if viewer is None else viewer.left_out,
        "groups": [] if viewer is None else list(dict.fromkeys(shape["group"] for shape in viewer.shapes)),
        "shapes": [] if viewer is None else [(shape["group"], shape["name"]) for shape in viewer.shapes],
        "contacts": details,
        "contacts_of": of_curves,
        "by_interface": _by_interface(source),
        "errors": errors,
        "costs": cost_rows(source),
        "style": (TEMPLATES / "report.css").read_text(encoding="utf-8"),
        "script": (TEMPLATES / "viewer.js").read_text(encoding="utf-8"),
        "chart_script": (TEMPLATES / "chart.js").read_text(encoding="utf-8"),
    }


def _ring(model: BuiltModel | None, attempts: Attempts) -> str | None:
    """The blade between its neighbours as a data URI; None without a mesh."""
    if model is None or model.mesh is None:
        return None
    return attempts.result("ring", lambda: _png(ring_drawing(model, STILL_BLADES)))


def _origin() -> str:
    """Version, date and host of the moment in which the page is made."""
    found = origin()
    date = found["date"].replace("T", " ").replace("+00:00", " UTC")
    return f"{found['program']}, {date}, host {found['host'] or 'unknown'}"


def _cards(source: ReportSource, points: Sequence[SweepPoint]) -> list[tuple[str, str, str]]:
    """The main results: name, value, curve or condition."""
    worst = [point for point in points if math.isfinite(point.worst[1])]
    peaks = [point for point in points if math.isfinite(point.peak[1])]
    cards = _worst_cards(worst)
    said = {card[1:] for card in cards}
    marks = [END_MARK * point.facts.peak_at_end for point in peaks]
    of_peaks = _extremes(peaks, [point.peak for point in peaks], "peak of the main branch", marks)
    cards += [card for card in of_peaks if card[1:] not in said]
    if source.model_rows:
        row = source.model_rows[0]
        order, values = next(iter(row["stuck_hz"].items()))
        of_order = f", engine order {order}" if "free_at_order_hz" in row else ""
        cards.append(("first natural frequency", f"{row['free_hz'][0]:.5g} Hz", f"shrouds free{of_order}"))
        cards.append(("first natural frequency", f"{values[0]:.5g} Hz", f"shrouds stuck, engine order {order}"))
    return cards


def _worst_cards(curves: Sequence[SweepPoint]) -> list[tuple[str, str, str]]:
    """Highest and lowest worst motion; of the lowest only where nothing was left open that may be higher, and under
    conditions that of the best design.
    """
    if len(curves) > 1 and condition_keys(curves[0].parameters):
        return _cards_over_conditions(curves)
    closed = [curve for curve in curves if not curve.worst_open]
    cards = _extremes(curves, [curve.worst for curve in curves], "worst motion", [curve.mark for curve in curves])
    if len(closed) == len(curves):
        return cards
    title, value, of = cards[0]
    at_least = f"{len(curves) - len(closed)} of {len(curves)} curves" if len(curves) > 1 else "it"
    cards = [(title, f">= {value}", f"{of}; >=: {at_least} may be higher than found")]
    if closed and len(curves) > 1:
        marks = [curve.mark for curve in closed]
        title, value, of = _extremes(closed, [curve.worst for curve in closed], "worst motion", marks)[:2][-1]
        known = f"{len(closed)} of {len(curves)} curves, the others may be higher (>=)"
        cards.append(("lowest worst motion", value, f"{of}; {known}"))
    return cards


def _cards_over_conditions(curves: Sequence[SweepPoint]) -> list[tuple[str, str, str]]:
    """Highest worst motion, and where designs are compared the highest of the best one."""
    title, value, of = _extremes(curves, [curve.worst for curve in curves], "worst motion", [c.mark for c in curves])[
        0
    ]
    cards = [(title, f"{'>= ' * any(curve.worst_open for curve in curves)}{value}", of)]
    if compares_designs(curves[0].parameters):
        best = compared_designs(curves)
        if isinstance(best, str):
            return [*cards, ("best design", "-", best)]
        shown = curves[best.highest]
        of = f"{values_label(shown.parameters, design=True)}; at {values_label(shown.parameters, design=False)}"
        cards.append(
            ("best design, at most", with_unit(shown.worst[1]), f"{of}, {shown.worst[0]:.5g} Hz{shown.mark}")
        )
    return cards


def _extremes(
    curves: Sequence[SweepPoint], points: Sequence[tuple[float, float]], name: str, marks: Sequence[str]
) -> list[tuple[str, str, str]]:
    """Highest and lowest of these points (Hz, m) over the curves, and their ratio; the point of a single curve.

    `marks` are written behind the frequencies.
    """
    if not curves:
        return []
    order = sorted(range(len(curves)), key=lambda place: points[place][1])
    cards = []
    for title, place in ((f"highest {name}", order[-1]), (f"lowest {name}", order[0])):
        of = (
            f"{curves[place].label + ', ' if curves[place].parameters else ''}{points[place][0]:.5g} Hz{marks[place]}"
        )
        cards.append((title, with_unit(points[place][1]), of))
    if len(curves) == 1:
        return [(name, *cards[0][1:])]
    ratio = points[order[-1]][1] / points[order[0]][1] if points[order[0]][1] > 0.0 else math.inf
    if math.isfinite(ratio):
        cards.append((f"highest over lowest {name}", f"{ratio:.3g}", f"of {len(curves)} curves"))
    return cards


def _figures(source: ReportSource, attempts: Attempts, points: Sequence[SweepPoint]) -> dict[str, Picture]:
    """The figures of the run, by name."""
    found = {}
    bifurcations = source.first.figures.bifurcations
    said = captions(lines=has_lines(points), few=has_few_lines(points), bifurcations=bifurcations)
    for name, caption in said.items():
        svg, png = (source.pictures.get(f"figures/{name}.{suffix}") for suffix in ("svg", "png"))
        uri = attempts.result(name, partial(inline_figure, svg, png)) if svg is not None else None
        if uri is not None:
            found[name] = Picture(uri, caption)
    return found


def _stills(source: ReportSource, attempts: Attempts) -> list[Picture]:
    names = [name for name in source.pictures if name.startswith("renders/") and name.endswith(".png")]
    uris = {
        name: attempts.result(name, partial(inline_render, source.pictures[name])) for name in names[:MOST_STILLS]
    }
    return [Picture(uri, _render_caption(Path(name))) for name, uri in uris.items() if uri is not None]


def _render_caption(render: Path) -> str:
    """Caption of a render from its name: mode_2, model_1_mode_2 or operating_4."""
    *model, kind, number = render.stem.split("_")
    if kind == "operating":
        return f"Motion at the peak of curve {number}, animated in renders/{render.stem}.gif"
    return f"Mode {number}{f' of model {model[1]}' if model else ''}"


def _facts(source: ReportSource, model: BuiltModel | None) -> list[tuple[str, list[tuple[str, str]]]]:
    """Tables of a name and a value, with their headings."""
    if model is None:
        return []
    from rom.files.reduced_model_file import read_reduced_model
    from rom.files.sector_file import load_sector

    recorded = output_rows(source.curves)
    outputs = [("Largest values of the outputs", recorded)] if recorded else []
    if model.mesh is None:
        reduced = read_reduced_model(model.rom, with_basis=False)
        matrices = [] if source.first.model is None else [("Matrices", over_sweep(source, matrix_rows))]
        return [
            *matrices,
            ("Reduced model", model_rows(model)),
            ("Contact and load", over_sweep(source, lambda scene: nodal_contact_rows(reduced, scene))),
            *outputs,
        ]
    face = load_sector(model.mesh.parent / SECTOR).right
    return [
        ("Blade", over_sweep(source, blade_rows)),
        ("Mesh and reduced model", mesh_rows(model, source.first)),
        ("Contact and load", over_sweep(source, lambda scene: contact_rows(face, scene, model.facts["interfaces"]))),
        *outputs,
    ]


def _viewer(source: ReportSource, shown: Sequence[PlottedCurve]) -> ViewerData | None:
    """Mode shapes of the first models, and the motion at the peak of curves spread over the sweep."""
    first = source.first
    data = ViewerData(deformation=0.08 if first.render is None else first.render.deformation)
    seen: dict[str, tuple[BuiltModel, Scene, str]] = {}
    for curve in source.curves:
        model = source.models[curve.member.index]
        if model is not None and model.mesh is not None:
            seen.setdefault(model.key, (model, curve.member.scene, member_label(curve.member)))
    for model, scene, label in list(seen.values())[:MOST_MODELS]:
        data.add_modes(model, scene, _springs(model, scene), f" ({label})" if len(seen) > 1 else "")
    heights = [curve.peak[1] for curve in shown]
    ends = [heights.index(max(heights)), heights.index(min(heights))] if shown else []
    for place in chosen_evenly(len(shown), MOST_OPERATING, ends):
        solved = source.curves[shown[place].index]
        model = source.models[solved.member.index]
        if model is not None and model.mesh is not None:
            data.add_operating(model, solved, shown[place].label)
    return data if data.shapes else None


def _springs(model: BuiltModel, scene: Scene) -> dict[str, dict[str, Any]]:
    from rom.files.reduced_model_file import read_reduced_model

    contact = contact_on_model(scene, read_reduced_model(model.rom, with_basis=False))
    states = springs_by_state(contact)
    return {state: states[state] for state in ("free", "stuck")}


def _by_interface(source: ReportSource) -> list[tuple[str, list[str], list[list[str]]]]:
    """Titles, headings and rows of the tables of friction work and static contact; no rows with one interface."""
    curves = screen_curves(source.curves, {})
    shown = [curves[number] for number in shown_numbers([curve.height for curve in curves])]
    static = [(STATIC_SAID, *static_rows(shown))] * any(map(has_static_load, source.curves))
    return [(INTERFACES_SAID, *interface_rows(shown)), *static]


def _contacts(
    source: ReportSource, shown: Sequence[PlottedCurve], attempts: Attempts
) -> tuple[list[ContactDetail], int]:
    """Contact at the peak of curves spread over the sweep, and the number of curves."""
    damped = most_damped(shown)
    also = [number for number, curve in enumerate(shown) if curve is damped]
    details = []
    for place in chosen_evenly(len(shown), MOST_CONTACTS, also):
        curve = shown[place]
        mesh = curve.scene.mesh
        faces = face_cycles(curve, None if mesh is None else mesh.contact_grid)
        work = sum(face.work_j for face in faces)
        factor, unit = prefixed(work, "J")
        drawn = attempts.result(f"loops of curve {curve.index}", partial(loops_drawing, curve, source.title))
        details.append(
            ContactDetail(
                label=curve.label,
                peak=f"{curve.peak[0]:.5g} Hz, {with_unit(curve.peak[1])}",
                faces=faces,
                factor=factor,
                unit=unit,
                total=with_unit(work, "J"),
                loops=None if drawn is None else inline_vector(drawn),
                open=curve is damped,
            )
        )
    return details, len(shown)


def _json(values: dict[str, Any]) -> str:
    """JSON that is safe inside a script element."""
    return json.dumps(values, separators=(",", ":")).replace("<", "\\u003c")


def _png(content: bytes) -> str:
    return f"data:image/png;base64,{base64.b64encode(content).decode('ascii')}"

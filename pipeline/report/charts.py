"""Pictures of the page: charts with values under the pointer, the undeformed ring, hysteresis loops, captions.

Figures and renders are included as data URIs: SVG, or JPEG of the width of the page.
"""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.figures.curve_line import (
    END_OF_RANGE,
    KINDS,
    MARKS,
    PEAK,
    SAME_HEIGHT,
    UNSTABLE_PEAK,
    peak_kind,
    stability_segments,
)
from pipeline.figures.data import PlottedCurve, SweepKey, SweepPoint, is_isolated, sweep_keys
from pipeline.figures.hysteresis import node_figure, spread
from pipeline.figures.peaks import END_COLOURS, ENDS, MOST_KEYS, WORST, ends, has_few_lines, lines_over
from pipeline.figures.response import has_lines, panel_keys
from pipeline.figures.style import CURVES_LOG_FROM, LOG_FROM, drawn, group_colours, scale, styled, subplots
from pipeline.render.ring import LEFT_DARK, RIGHT_COLOUR, VIEW, blades_of, turned
from pipeline.report.viewer import Surface, outer_surface
from pipeline.scene.blade_section import DAMPER, INTERFACES
from pipeline.scene.labels import value_label
from pipeline.stages.model.build_mesh import SECTOR
from pipeline.stages.model.model_chain import BuiltModel

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from geometry.sector import SectorMesh
    from nonlinear.response_curve import ResponseCurve
    from rom.cyclic.reduced_model import ReducedModel


LARGEST_VECTOR = 450_000  # bytes; a larger figure is included as PNG
WIDTH = 1200  # pixels of a render
QUALITY = 86


def inline_figure(svg: bytes, png: bytes | None) -> str:
    """A figure as a data URI: its SVG, or its PNG where that is much smaller and there is one."""
    return inline_vector(svg) if png is None or len(svg) <= LARGEST_VECTOR else _uri("image/png", png)


def inline_vector(svg: bytes) -> str:
    """SVG as a data URI."""
    return _uri("image/svg+xml", svg)


def inline_render(png: bytes) -> str:
    """A render as a JPEG data URI, no wider than `WIDTH`."""
    from PIL import Image

    with Image.open(io.BytesIO(png)) as picture:
        image = picture.convert("RGB")
    if image.width > WIDTH:
        image = image.resize((WIDTH, round(image.height * WIDTH / image.width)), Image.Resampling.LANCZOS)
    stream = io.BytesIO()
    image.save(stream, "JPEG", quality=QUALITY, optimize=True)
    return _uri("image/jpeg", stream.getvalue())


def _uri(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"


_RESPONSE = (
    "Largest displacement over a period against frequency. Dashed: unstable; long dashes: against perturbations of "
    "another nodal diameter than the wave. Circles: peaks of the main branches; crosses: unstable ones; arrow heads: "
    "ends of the range, which are no peaks. Stars: worst motions that are not these peaks. Thin lines: isolated and "
    "detached branches."
)
_BIFURCATIONS = (
    " Squares: Neimark-Sacker bifurcations, where the motion becomes or stops being quasi-periodic; triangles: "
    "period doublings; diamonds: branch points."
)
_BANDS = (
    "Quantiles of the largest displacement over the curves at each frequency (main branches), and the curves with "
    "the highest, the median and the lowest worst motion."
)
_PEAKS = (
    "Height and frequency of the worst motions, and of the peaks of the main branches (bars), against the swept "
    "parameter, with the linear limits. Triangles: worst motions that are not settled."
)
_QUANTILES = (
    "Quantiles of the worst motions and of their frequencies against each swept parameter; dots: single curves."
)
_OTHERS = {
    "map": (
        "Worst motion over the two swept parameters: height on the left, frequency on the right. Frame: the lowest; "
        "dots in the corner of a cell: not settled."
    ),
    "nodal_diameters": (
        "Natural frequencies against nodal diameter; excitation and frequency range are marked. Bars: resonance "
        "crossings from free to stuck shrouds, numbered as in the table. With a disk: modes "
        "by their names (F flap, E edge, T torsion, R radial, D disk), in colours the disk's share of strain energy."
    ),
    "campbell": (
        "Campbell diagram: natural frequencies against speed, with the lines of the engine orders. Diamonds: "
        "resonance crossings."
    ),
    "flutter": (
        "Damping of all waves in the flow against nodal diameter, with free, sliding and stuck shrouds: below 0 the "
        "motion grows while the contacts are so."
    ),
    "outputs": "Largest values of the further outputs over a period against frequency, their means included.",
    "hysteresis_sweep": (
        "Hysteresis loops of one contact node, each curve at its own peak; curves without contact are left out."
    ),
}


def captions(*, lines: bool, few: bool, bifurcations: bool) -> dict[str, str]:
    """Captions by the name of the figure; `lines`: a line a curve, with marks of `bifurcations`; `few`: few
    combinations of the keys beside the one of the axis."""
    response = _RESPONSE + _BIFURCATIONS * bifurcations
    return {"response": response if lines else _BANDS, "peaks": _PEAKS if few else _QUANTILES, **_OTHERS}


Array = NDArray[np.float64]
BLADE, NEIGHBOUR = np.array([0.45, 0.60, 0.74]), np.array([0.82, 0.85, 0.88])


def loops_drawing(curve: PlottedCurve, title: str) -> bytes | None:
    """Hysteresis loops of a few nodes at the peak of a curve, SVG."""
    with styled():
        figure = node_figure(curve, title)
        if figure is None:
            return None
        return drawn(figure, "svg")


def ring_drawing(model: BuiltModel, blades: int) -> bytes:
    """The undeformed blade between its neighbours with its contact nodes, PNG; needs no GL library."""
    from matplotlib.collections import PolyCollection

    from rom.files.reduced_model_file import read_reduced_model
    from rom.files.sector_file import load_sector

    assert model.mesh is not None
    sector = load_sector(model.mesh.parent / SECTOR)
    surface = outer_surface(sector)
    flat, colours, screen = _projected(sector, surface, blades)
    contacts = _faces(read_reduced_model(model.rom, with_basis=False), 2.0 * np.pi / sector.n_blades, screen)
    with styled():
        figure, axes = subplots(size=(7.6, 5.6))
        axes.add_collection(PolyCollection(list(flat), facecolors=colours, edgecolors=colours, linewidths=0.3))
        for face in contacts:
            if face.in_view:
                axes.plot(*face.places.T, "o", color=face.colour, markersize=4, markeredgecolor="white")
            _label(axes, face)
        axes.set_aspect("equal")
        axes.autoscale_view()
        axes.set_axis_off()
        return drawn(figure, "png")


@dataclass(frozen=True)
class Face:
    """The contact nodes of a face on the picture, its name, and whether they are in view and on the right of it."""

    places: Array
    name: str
    in_view: bool
    on_right: bool  # the side of +y

    @property
    def colour(self) -> str:
        """Its colour."""
        return RIGHT_COLOUR if self.on_right else LEFT_DARK


def _label(axes: Axes, face: Face) -> None:
    """The name of a face above the ring, on the side where the face is, with a line to its middle."""
    beside = -1.0 if face.on_right else 1.0
    look = {"arrowstyle": "-", "color": face.colour, "linewidth": 1.0}
    where: dict[str, Any] = {"ha": "right" if beside < 0.0 else "left", "color": face.colour, "fontsize": 10}
    place = face.places.mean(axis=0)
    hidden = "" if face.in_view else ", on the far side"
    axes.annotate(
        face.name + hidden, place, (45.0 * beside, 75.0), textcoords="offset points", arrowprops=look, **where
    )


def _faces(model: ReducedModel, pitch: float, screen: Array) -> list[Face]:
    """The contact faces of the blade; `screen` (3, 3): the axes of the picture, and the one towards the viewer.

    The normal points out of a right face and into a left one, but out of the flank of the next blade that a damper
    touches. The left faces are those of the next blade turned back.
    """
    from rom.cyclic.reduced_model import interfaces_of

    *_, flank = INTERFACES[DAMPER]
    alone, found = len(model.interfaces) == 1, []
    for each in interfaces_of(model):
        assert each.frame is not None
        sides = [] if each.name == flank else [("right contact face (+y)", 0.0, 1.0, True)]
        if each.left is not None:
            sides.append(("left contact face (-y)", -pitch, 1.0 if each.name == flank else -1.0, False))
        for words, angle, outward, on_right in sides:
            normal = turned(each.frame[:, 2].mean(axis=0), angle)
            name = (
                words
                if alone and each.left is not None
                else each.name
                if len(sides) == 1
                else f"{each.name}, {words.split()[0]}"
            )
            seen = outward * float(normal @ screen[2]) > 0.0
            found.append(Face(turned(each.position, angle) @ screen[:2].T, name, seen, on_right))
    return found


def _projected(sector: SectorMesh, surface: Surface, blades: int) -> tuple[Array, Array, Array]:
    """Triangles (t, 3, 2) from back to front, their colours (t, 3), and the axes of the picture (3, 3): to the right,
    upwards and towards the viewer.
    """
    view = np.asarray(VIEW) / np.linalg.norm(VIEW)
    right = np.cross((0.0, 0.0, 1.0), view)
    right /= np.linalg.norm(right)
    screen = np.stack([right, np.cross(view, right), view])
    triangles, shades = [], []
    for blade in blades_of(blades):
        corners = turned(sector.points[surface.vertices], blade * 2.0 * np.pi / sector.n_blades)[surface.triangles]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        facing = normal @ view / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
        seen = facing > 0.0
        triangles.append(corners[seen])
        base = BLADE if blade == 0 else NEIGHBOUR
        shades.append(base * (0.55 + 0.45 * facing[seen, None]))
    corners, colours = np.concatenate(triangles), np.concatenate(shades)
    order = np.argsort((corners @ view).mean(axis=1), kind="stable")
    return (corners @ screen[:2].T)[order], colours[order], screen


MOST_POINTS = 60_000  # of all curves of a chart
MOST_DOTS = 2000  # of a chart over sampled keys
MOST_NAMED = 40  # values with a name of their own on an axis
DIGITS = 6
UNEVEN = 8.0  # ratio of the largest step between swept values to the median one
_PEAK_SHAPES = {PEAK: "circle", UNSTABLE_PEAK: "cross", END_OF_RANGE: "arrowhead"}  # as in the figures
_SHAPES = dict(zip(MARKS, ("diamond", "square", "triangle"), strict=True))


def charts(
    curves: Sequence[PlottedCurve],
    points: Sequence[SweepPoint],
    colours: Mapping[int, Any],
    bifurcations: bool = False,
) -> dict[str, dict[str, Any]]:
    """The charts of a page by the name of the figure that they stand for, values for JSON, in the `colours` of the
    figures by number of the curve; `bifurcations` but folds have marks where asked for."""
    found = {}
    if curves:
        found["response"] = _response(curves, points, colours, bifurcations)
    if len(points) > 1 and sweep_keys(points):
        found["peaks"] = _sweep(points, colours)
    return found


def _response(
    curves: Sequence[PlottedCurve], points: Sequence[SweepPoint], colours: Mapping[int, Any], bifurcations: bool
) -> dict[str, Any]:
    """Amplitude over frequency; of many curves those with the highest, the median and the lowest worst motion."""
    few = has_lines(points)
    kinds: dict[int, str] = {}
    if not few:
        kinds = {p.index: f"{name} worst motion: " for p, name in zip(ends(points), ENDS, strict=False)}
        curves = [curve for curve in curves if curve.index in kinds]
        colours = dict(zip(kinds, END_COLOURS, strict=False))
    keys = panel_keys(sweep_keys(points)) if few else None
    factor, unit = scale(np.concatenate([curve.response.amplitude_m for curve in curves]), "m")
    step = -(-sum(curve.response.points for curve in curves) // MOST_POINTS)
    lines, marks = [], []
    for curve in curves:
        name, part = f"{kinds.get(curve.index, '')}{curve.label}", None
        if keys:
            part = keys[1].number(curve.parameters[keys[1].name])
            name = value_label(keys[0].name, curve.parameters[keys[0].name])
        of: dict[str, Any] = {"name": name, "colour": _hex(colours[curve.index]), "part": part}
        lines.append({**of, "width": 1.8, **_line(curve.response, factor, step), "what": "main branch"})
        for count, branch in enumerate(curve.response.detached, start=1):
            what = f"{'isolated' if is_isolated(branch) else 'detached'} branch {count}"
            lines.append({**of, "width": 1.0, **_line(branch, factor, step), "what": what})
        marks += [{**of, **mark} for mark in _marks(curve, factor, bifurcations)]
    peaks = [height for curve in curves for height in (curve.peak[1], curve.worst[1])]
    return {
        "xlabel": "excitation frequency [Hz]",
        "ylabel": f"largest displacement over a period [{unit}]",
        "xunit": "Hz",
        "yunit": unit,
        "log": _spans_decades(peaks, CURVES_LOG_FROM),
        "lines": lines,
        "marks": marks,
        "parts": [value_label(keys[1].name, value) for value in keys[1].values] if keys else [],
        "xlabels": [],
        "replaces": few,
        "note": "" if few else "The curves with the highest, the median and the lowest worst motion.",
    }


def _line(curve: ResponseCurve, factor: float, step: int) -> dict[str, Any]:
    """Points and stability segments of a branch; every `step`-th point and the highest."""
    rows = np.arange(0, len(curve.frequency_hz), step)
    if step > 1:
        rows = np.unique(np.append(rows, [int(np.argmax(curve.amplitude_m)), len(curve.frequency_hz) - 1]))
    segments = stability_segments(curve.stable[rows], curve.growth_nodal_diameter[rows])
    return {
        "x": _numbers(curve.frequency_hz[rows]),
        "y": _numbers(curve.amplitude_m[rows] * factor),
        "kinds": [[first, last, KINDS.index(kind)] for first, last, kind in segments],
    }


def _marks(curve: PlottedCurve, factor: float, bifurcations: bool) -> Iterable[dict[str, Any]]:
    what = END_OF_RANGE if curve.facts.peak_at_end else f"{peak_kind(curve.facts)} of the main branch"
    yield {"shape": _PEAK_SHAPES[peak_kind(curve.facts)], "what": what, **_place([curve.peak], factor)}
    frequency, height = curve.worst
    if math.isfinite(height) and not np.isclose(height, curve.peak[1], rtol=SAME_HEIGHT):
        what = "worst motion, or higher" if curve.worst_open else "worst motion"
        yield {"shape": "star", "what": what, **_place([(frequency, height)], factor)}
    for kind, shape in _SHAPES.items() if bifurcations else ():
        places = [(e.frequency_hz, e.amplitude_m) for e in curve.response.bifurcations if e.kind.value == kind]
        if places:
            yield {"shape": shape, "what": kind, **_place(places, factor)}


def _place(places: Sequence[tuple[float, float]], factor: float) -> dict[str, Any]:
    return {"x": _numbers([x for x, _ in places]), "y": _numbers([y * factor for _, y in places])}


def _sweep(points: Sequence[SweepPoint], colours: Mapping[int, Any]) -> dict[str, Any]:
    """Worst motions over the key with the most values, in the colours of the figure; of many over several keys dots
    of one colour over each."""
    keys = sweep_keys(points)
    key = keys[0]
    factor, unit = scale([height for point in points for height in (point.peak[1], point.worst[1])], "m")
    lines = []
    if has_few_lines(points):
        groups = lines_over(points, key)
        for (name, members), colour in zip(groups.items(), group_colours(len(groups)), strict=True):
            line = _sweep_line(members, key, factor, name=name or WORST, colour=_hex(colour))
            own = {} if len(groups) > 1 else {"colours": [_hex(colours[point.index]) for point in members]}
            lines.append(line | own)
    else:
        dots = spread(points, MOST_DOTS)
        for part, of in enumerate(keys[:MOST_KEYS]):
            line = _sweep_line(dots, of, factor, name="curve", colour="#0072B2")
            lines.append(line | {"part": part})
    sampled = (
        "" if lines[0].get("part") is None or len(points) <= MOST_DOTS else f" {MOST_DOTS} of {len(points)} curves."
    )
    names = None if _even(key) or lines[0].get("part") is not None else _names(key)
    return {
        "xlabel": f"{key.axis}, values at equal distances" if names else key.axis,
        "ylabel": f"worst motion [{unit}]",
        "xunit": "Hz",
        "yunit": unit,
        "log": _spans_decades([point.facts.height for point in points]),
        "dots": True,
        "parts": [] if lines[0].get("part") is None else [f"over {of.axis}" for of in keys[:MOST_KEYS]],
        "xlabels": [of.axis for of in keys[:MOST_KEYS]],
        "replaces": True,
        "note": f"Worst motion of each curve; the pointer shows the curve and the frequency.{sampled}",
        "lines": lines,
        "names": names,
    }


def _sweep_line(
    points: Sequence[SweepPoint], key: SweepKey, factor: float, *, name: str, colour: str
) -> dict[str, Any]:
    said = []
    for point in points:
        known = math.isfinite(point.worst[1])
        frequency = point.worst[0] if known else point.peak[0]
        kind = "worst motion" if known else "peak of the main branch"
        said.append(
            f"curve {point.index}: {point.label}\n{kind} {'or higher ' * point.worst_open}at {frequency:.6g} Hz"
            f"{point.mark}"
        )
    place = key.position if _even(key) else key.number
    x = [place(point.parameters[key.name]) for point in points]
    return {
        "name": name,
        "colour": colour,
        "x": _numbers(x),
        "y": _numbers([point.facts.height * factor for point in points]),
        "said": said,
        "width": 0,  # nothing is computed between the values
    }


def _names(key: SweepKey) -> dict[int, str]:
    return {number: key.text(value) for number, value in enumerate(key.values)}


def _even(key: SweepKey) -> bool:
    """Whether the values stand on a linear axis; otherwise each has the same room, as where they are no numbers."""
    if not key.numeric or len(key.values) > MOST_NAMED:
        return key.numeric
    steps = np.diff([key.position(value) for value in key.values])
    return bool(steps.max() <= UNEVEN * np.median(steps))


def _numbers(values: Iterable[float]) -> list[float | None]:
    return [float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None for value in values]


def _spans_decades(heights: Iterable[float], log_from: float = LOG_FROM) -> bool:
    above = [height for height in heights if math.isfinite(height) and height > 0.0]
    return bool(above) and max(above) > log_from * min(above)


def _hex(colour: Any) -> str:
    from matplotlib.colors import to_hex

    return to_hex(colour)

"""Data of the charts with zoom and values under the pointer: response curves, and worst motions over the sweep."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from pipeline.figures.curve_line import KINDS, stability_segments
from pipeline.figures.curve_marks import END_OF_RANGE, MARKS, SAME_HEIGHT
from pipeline.figures.data import PlottedCurve, SweepPoint
from pipeline.figures.hysteresis import spread
from pipeline.figures.quantiles import ENDS, MOST_KEYS, ends
from pipeline.figures.response import has_lines, panel_keys
from pipeline.figures.style import LOG_FROM, ordered_colours, scale
from pipeline.figures.sweep_keys import SweepKey, sweep_keys
from pipeline.figures.trend import MOST_LINES
from pipeline.scene.labels import value_label

MOST_POINTS = 60_000  # of all curves of a chart
MOST_DOTS = 2000  # of a chart over sampled keys
MOST_NAMED = 40  # values with a name of their own on an axis
DIGITS = 6
UNEVEN = 8.0  # ratio of the largest step between swept values to the median one
_SHAPES = dict(zip(MARKS, ("diamond", "square", "triangle"), strict=True))


def charts(curves: Sequence[PlottedCurve], points: Sequence[SweepPoint]) -> dict[str, dict[str, Any]]:
    """The charts of a page by the name of the figure that they stand for; values for JSON."""
    found = {}
    if curves:
        found["response"] = _response(curves, points)
    if len(points) > 1 and sweep_keys(points):
        found["peaks"] = _sweep(points)
    return found


def _response(curves: Sequence[PlottedCurve], points: Sequence[SweepPoint]) -> dict[str, Any]:
    """Amplitude over frequency; of many curves those with the highest, the median and the lowest worst motion."""
    few = has_lines(points)
    kinds: dict[int, str] = {}
    if not few:
        kinds = {p.index: f"{name} worst motion: " for p, name in zip(ends(points), ENDS, strict=False)}
        curves = [curve for curve in curves if curve.index in kinds]
    keys = panel_keys(sweep_keys(points)) if few else None
    factor, unit = scale(np.concatenate([curve.amplitude_m for curve in curves]), "m")
    shades = [_hex(colour) for colour in ordered_colours(len(keys[0].values) if keys else len(curves))]
    step = -(-sum(len(curve.frequency_hz) for curve in curves) // MOST_POINTS)
    lines, marks = [], []
    for number, curve in enumerate(curves):
        name, part = f"{kinds.get(curve.index, '')}{curve.label}", None
        if keys:
            number, part = (key.number(curve.parameters[key.name]) for key in keys)
            name = value_label(keys[0].name, curve.parameters[keys[0].name])
        of: dict[str, Any] = {"name": name, "colour": shades[number], "part": part}
        lines.append({**of, "width": 1.8, **_line(curve, factor, step), "what": "main branch"})
        for count, branch in enumerate(curve.branches, start=1):
            what = f"{'isolated' if branch.closed else 'detached'} branch {count}"
            lines.append({**of, "width": 1.0, **_line(branch, factor, step), "what": what})
        marks += [{**of, **mark} for mark in _marks(curve, factor)]
    peaks = [height for curve in curves for height in (curve.peak[1], curve.worst[1])]
    return {
        "xlabel": "excitation frequency [Hz]",
        "ylabel": f"largest displacement over a period [{unit}]",
        "xunit": "Hz",
        "yunit": unit,
        "log": _spans_decades(peaks),
        "lines": lines,
        "marks": marks,
        "parts": [value_label(keys[1].name, value) for value in keys[1].values] if keys else [],
        "xlabels": [],
        "replaces": few,
        "note": "" if few else "The curves with the highest, the median and the lowest worst motion.",
    }


def _line(curve: Any, factor: float, step: int) -> dict[str, Any]:
    """Points and stability segments of a branch; every `step`-th point and the highest."""
    rows = np.arange(0, len(curve.frequency_hz), step)
    if step > 1:
        rows = np.unique(np.append(rows, [int(np.argmax(curve.amplitude_m)), len(curve.frequency_hz) - 1]))
    segments = stability_segments(curve.stable[rows], curve.nodal_diameter[rows])
    return {
        "x": _numbers(curve.frequency_hz[rows]),
        "y": _numbers(curve.amplitude_m[rows] * factor),
        "kinds": [[first, last, KINDS.index(kind)] for first, last, kind in segments],
    }


def _marks(curve: PlottedCurve, factor: float) -> Iterable[dict[str, Any]]:
    what = END_OF_RANGE if curve.peak_at_end else "peak of the main branch"
    yield {"shape": "circle", "what": what, **_place([curve.peak], factor)}
    frequency, height = curve.worst
    if math.isfinite(height) and not np.isclose(height, curve.peak[1], rtol=SAME_HEIGHT):
        what = "worst motion, or higher" if curve.worst_open else "worst motion"
        yield {"shape": "star", "what": what, **_place([(frequency, height)], factor)}
    for kind, shape in _SHAPES.items():
        places = [(item["frequency_hz"], item["amplitude_m"]) for item in curve.bifurcations if item["kind"] == kind]
        if places:
            yield {"shape": shape, "what": kind, **_place(places, factor)}


def _place(places: Sequence[tuple[float, float]], factor: float) -> dict[str, Any]:
    return {"x": _numbers([x for x, _ in places]), "y": _numbers([y * factor for _, y in places])}


def _sweep(points: Sequence[SweepPoint]) -> dict[str, Any]:
    """Worst motions over the key with the most values: a line for each value of the second key, or dots."""
    keys = sweep_keys(points)
    key, others = keys[0], keys[1:]
    factor, unit = scale([height for point in points for height in (point.peak[1], point.worst[1])], "m")
    joined = len(others) == 1 and len(others[0].values) <= MOST_LINES and len(key.values) < len(points)
    lines = []
    if not others or joined:
        groups = others[0].values if others else (None,)
        for value, colour in zip(groups, ordered_colours(len(groups)), strict=True):
            members = [p for p in points if not others or repr(p.parameters[others[0].name]) == repr(value)]
            members.sort(key=lambda p: key.number(p.parameters[key.name]))
            name = value_label(others[0].name, value) if others else "worst motion"
            lines.append(_sweep_line(members, key, factor, name=name, colour=_hex(colour)))
    else:
        dots = spread(points, MOST_DOTS)
        for part, of in enumerate(keys[:MOST_KEYS]):
            line = _sweep_line(dots, of, factor, name="curve", colour="#0072B2")
            lines.append(line | {"width": 0, "part": part})
    sampled = (
        "" if lines[0].get("part") is None or len(points) <= MOST_DOTS else f" {MOST_DOTS} of {len(points)} curves."
    )
    return {
        "xlabel": key.axis,
        "ylabel": f"worst motion [{unit}]",
        "xunit": "Hz",
        "yunit": unit,
        "log": _spans_decades([point.height for point in points]),
        "dots": True,
        "parts": [] if lines[0].get("part") is None else [f"over {of.axis}" for of in keys[:MOST_KEYS]],
        "xlabels": [of.axis for of in keys[:MOST_KEYS]],
        "replaces": True,
        "note": f"Worst motion of each curve; the pointer shows the curve and the frequency.{sampled}",
        "lines": lines,
        "names": None if _even(key) or lines[0].get("part") is not None else _names(key),
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
        "y": _numbers([point.height * factor for point in points]),
        "said": said,
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


def _spans_decades(heights: Iterable[float]) -> bool:
    above = [height for height in heights if math.isfinite(height) and height > 0.0]
    return bool(above) and max(above) > LOG_FROM * min(above)


def _hex(colour: Any) -> str:
    from matplotlib.colors import to_hex

    return to_hex(colour)

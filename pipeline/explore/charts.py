"""The charts of the page, of Bokeh: each is a figure and the data that it draws."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.curve_line import KINDS, stability_segments
from pipeline.scene.labels import prefixed

if TYPE_CHECKING:
    from bokeh.models import ColumnDataSource
    from bokeh.plotting import figure

    from nonlinear.response_curve import Peak, ResponseCurve
    from pipeline.explore.views import LiveView

INK, PALE, GRID = "#1b1f24", "#57606a", "#e8ebee"
STATE_COLOURS = {"stick": "#0072B2", "slip": "#C87800", "open": "#7d8590"}
CELL_COLOURS = STATE_COLOURS | {"open": "#8c959f"}
PIN_COLOURS = ("#CC79A7", "#009E73", "#6a4fb3", "#8c5a2b")
LIMIT_COLOUR, LOOP_COLOUR, PALE_LOOP = "#8c959f", "#0068a3", "#c5cdd5"
DASHES = dict(zip(KINDS, ("solid", "dashed", "dotdash"), strict=True))
MOST_PEAKS, APART = 3, 0.12  # labelled peaks, and their distance in shares of the frequency range
FULL, LEAST_FULL = 1.0, 0.55  # shares of a scale that data fill before it is changed
FONT = 'Inter, "Segoe UI", "Helvetica Neue", "DejaVu Sans", Arial, sans-serif'
THEME = {
    "attrs": {
        "Plot": {"background_fill_color": "#ffffff", "border_fill_color": "#ffffff", "outline_line_color": None},
        "Grid": {"grid_line_color": GRID},
        "Axis": {
            "axis_line_color": "#8c959f",
            "major_tick_line_color": "#8c959f",
            "minor_tick_line_color": None,
            "major_label_text_color": PALE,
            "axis_label_text_color": PALE,
            "major_label_text_font": FONT,
            "axis_label_text_font": FONT,
            "major_label_text_font_size": "11px",
            "axis_label_text_font_size": "11.5px",
            "axis_label_text_font_style": "normal",
            "axis_label_standoff": 4,
            "major_label_standoff": 4,
        },
    }
}


def states_of(curve: ResponseCurve) -> list[str]:
    """The worst contact state of each point: "open" where a node opens at some time, then "slip", then "stick"."""
    return np.where(curve.separating > 0, "open", np.where(curve.slipping > 0, "slip", "stick")).tolist()


def runs_of(curve: ResponseCurve, factor: float) -> dict[str, list[Any]]:
    """Lines (xs, ys, colour, dash) of one contact state and one stability each; amplitudes times `factor`."""
    found: dict[str, list[Any]] = {"xs": [], "ys": [], "colour": [], "dash": []}
    states = states_of(curve)
    for start, stop, kind in stability_segments(curve.stable, curve.growth_nodal_diameter):
        changes = [start, *(k for k in range(start + 1, stop) if states[k] != states[k - 1]), stop]
        for first, end in pairwise(changes):
            part = slice(max(first - 1, start), end)
            found["xs"].append(curve.frequency_hz[part].tolist())
            found["ys"].append((curve.amplitude_m[part] * factor).tolist())
            found["colour"].append(STATE_COLOURS[states[first]])
            found["dash"].append(DASHES[kind])
    return found


def joined(parts: Iterable[Mapping[str, list[Any]]]) -> dict[str, list[Any]]:
    """Columns one below the other."""
    found: dict[str, list[Any]] = {}
    for part in parts:
        for name, values in part.items():
            found.setdefault(name, []).extend(values)
    return found


@dataclass
class Scale:
    """The ends of an axis, which stay while data fill it fairly, so that a change is seen as one."""

    log: bool
    low: float = math.nan
    high: float = math.nan

    def holds(self, least: float, most: float) -> bool:
        """Fit to data from `least` to `most`; whether the ends stay as they were."""
        if not (math.isfinite(least) and math.isfinite(most) and most > 0.0):
            return True
        if self.log:
            least = max(least, 1e-12 * most)
            filled = math.log(most / least) / math.log(self.high / self.low) if self.high > self.low else 0.0
        else:
            filled = most / self.high if self.high > 0.0 else 0.0
        if filled >= LEAST_FULL and most <= FULL * self.high and (not self.log or least >= self.low):
            return True
        margin = (most / least) ** 0.06 if self.log else 1.08
        self.low, self.high = (least / margin, most * margin) if self.log else (0.0, most * margin)
        return False


@dataclass
class Chart:
    """A figure, and a second one of the same data where an axis can be linear or logarithmic."""

    figures: list[figure]
    sources: dict[str, ColumnDataSource]

    def show(self, **columns: Mapping[str, Any]) -> None:
        """Give sources new data, where these differ."""
        for name, data in columns.items():
            if self.sources[name].data != data:
                self.sources[name].data = dict(data)


def sources(**columns: str) -> dict[str, ColumnDataSource]:
    """Empty sources by name, each with columns of these names."""
    from bokeh.models import ColumnDataSource

    return {name: ColumnDataSource({column: [] for column in text.split()}) for name, text in columns.items()}


def plain_figure(name: str, xlabel: str, ylabel: str, **options: Any) -> figure:
    """A figure that fills its place in the page."""
    from bokeh.models import LogAxis, LogTicker, PrintfTickFormatter, Range1d
    from bokeh.plotting import figure

    tools = options.pop("tools", "")
    for axis in "xy":
        options.setdefault(f"{axis}_range", Range1d(0.1, 1.0))
    made = figure(name=name, sizing_mode="stretch_both", tools=tools, toolbar_location=None, **options)
    made.xaxis.axis_label, made.yaxis.axis_label = xlabel, ylabel
    made.min_border_right, made.min_border_top = 12, 8
    for axis in (*made.xaxis, *made.yaxis):
        if isinstance(axis, LogAxis):
            axis.ticker = LogTicker(mantissas=[1, 2, 5], desired_num_ticks=5)
            axis.formatter = PrintfTickFormatter(format="%.4g")
    return made


def fit(ends: Any, values: Iterable[float], log: bool = False) -> None:
    """Set the ends of an axis so that all values are seen."""
    found = [value for value in values if math.isfinite(value) and (not log or value > 0.0)]
    if not found:
        return
    low, high = min(found), max(found)
    if log:
        margin = max(high / low, 2.0) ** 0.08
        ends.update(start=low / margin, end=high * margin)
    else:
        margin = 0.08 * (high - low) or 0.1 * abs(high) or 1.0
        ends.update(start=low - margin, end=high + margin)


@dataclass
class ResponseChart(Chart):
    """Response curves over the frequency."""

    unit: str = "µm"
    factor: float = 1e6  # from m to the unit
    log: Scale = field(default_factory=lambda: Scale(True))
    linear: Scale = field(default_factory=lambda: Scale(False))
    range_hz: tuple[float, float] = (0.0, 1.0)
    zoomed: bool = False  # by hand: ends are left alone
    view: LiveView | None = None

    @classmethod
    def of(cls, view: LiveView) -> ResponseChart:
        """Axes for the curves of a scene, in a unit that suits its linear limits."""
        highest = max((limit.amplitude_m.max() for limit in view.limits), default=view.facts.peak_amplitude_m)
        factor, unit = prefixed(float(highest), "m")
        found = sources(
            runs="xs ys colour dash",
            points="x y text",
            limits="xs ys",
            names="x y text",
            pins="xs ys colour",
            peaks="x y text",
            worst="x y",
            picked="x y",
        )
        chart = cls([], found, unit, factor, range_hz=view.solved.response.frequency)
        chart.figures = [chart._figure(log) for log in (True, False)]
        chart.figures[1].visible = False
        return chart

    def _figure(self, log: bool) -> figure:
        from bokeh.events import RangesUpdate
        from bokeh.models import HoverTool, Range1d

        made = plain_figure(
            "response" if log else "response_linear",
            "frequency [Hz]",
            f"amplitude [{self.unit}]",
            tools="xbox_zoom",
            y_axis_type="log" if log else "linear",
            x_range=Range1d(*self.range_hz),
            y_range=Range1d(*((0.1, 10.0) if log else (0.0, 1.0))),
        )
        of = self.sources
        made.multi_line("xs", "ys", source=of["limits"], color=LIMIT_COLOUR, line_width=1.2)
        made.multi_line("xs", "ys", source=of["pins"], color="colour", line_width=1.5, alpha=0.9)
        made.multi_line(
            "xs", "ys", source=of["runs"], line_color="colour", line_dash="dash", line_width=2.6, line_join="round"
        )
        dots = made.scatter("x", "y", source=of["points"], size=9, alpha=0.0, hover_alpha=0.35, hover_color=INK)
        made.scatter("x", "y", source=of["peaks"], size=7, fill_color="white", line_color=INK, line_width=1.5)
        made.scatter("x", "y", source=of["worst"], marker="star", size=15, fill_color=INK, line_color="white")
        made.scatter("x", "y", source=of["picked"], size=14, fill_color=None, line_color=INK, line_width=2.0)
        words = {"text_font": {"value": FONT}, "text_font_size": "11px"}
        made.text("x", "y", text="text", source=of["peaks"], x_offset=9, y_offset=-3, text_color=INK, **words)
        made.text("x", "y", text="text", source=of["names"], x_offset=5, y_offset=12, text_color=PALE, **words)
        tips = '<div style="white-space: pre; font-size: 12px; color: #1b1f24">@text</div>'
        made.add_tools(HoverTool(renderers=[dots], tooltips=tips, point_policy="snap_to_data", mode="mouse"))
        made.on_event(RangesUpdate, lambda event: setattr(self, "zoomed", True))
        return made

    def show_view(self, view: LiveView, pins: Sequence[tuple[LiveView, str]]) -> None:
        """Draw a view and pinned ones with their colours."""
        self.view = view
        branches = [view.response, *view.response.detached]
        limits = [limit for limit in view.limits if len(limit.frequency_hz)]
        at_limit = [
            (limit, limit.resonance) for limit in limits if limit.resonance and self._inside(limit.resonance[0])
        ]
        peaks = self._labelled(view.response)
        worst = view.response.worst
        star = [] if worst is None or not math.isfinite(worst.amplitude_m) else [worst]
        self.show(
            limits={
                "xs": [limit.frequency_hz.tolist() for limit in limits],
                "ys": [(limit.amplitude_m * self.factor).tolist() for limit in limits],
            },
            names={
                "x": [at[0] for _, at in at_limit],
                "y": [at[1] * self.factor for _, at in at_limit],
                "text": [f"{limit.kind} {at[0]:.4g} Hz" for limit, at in at_limit],
            },
            pins=joined(
                {**self._lines(branch), "colour": [colour]}
                for pinned, colour in pins
                for branch in (pinned.response, *pinned.response.detached)
            )
            or {"xs": [], "ys": [], "colour": []},
            runs=joined(runs_of(branch, self.factor) for branch in branches),
            points=joined(self._points(branch) for branch in branches),
            peaks={
                "x": [peak.frequency_hz for peak in peaks],
                "y": [peak.amplitude_m * self.factor for peak in peaks],
                "text": [f"{peak.amplitude_m * self.factor:.4g} {self.unit}" for peak in peaks],
            },
            worst={"x": [one.frequency_hz for one in star], "y": [one.amplitude_m * self.factor for one in star]},
        )
        self._fit([view, *(pinned for pinned, _ in pins)])

    def show_picked(self, frequency_hz: float, amplitude_m: float) -> None:
        """Mark the point whose motion is shown."""
        self.show(picked={"x": [frequency_hz], "y": [amplitude_m * self.factor]})

    def show_all(self) -> None:
        """The whole frequency range, and all curves."""
        self.zoomed = False
        self.log, self.linear = Scale(True), Scale(False)
        for made in self.figures:
            made.x_range.update(start=self.range_hz[0], end=self.range_hz[1])
        if self.view is not None:
            self._fit([self.view])

    def nearest(self, x: float, y: float) -> int | None:
        """The point of the main branch next to a place, with the lengths of the axes as measures."""
        if self.view is None or not self.view.response.points:
            return None
        curve = self.view.response
        log = bool(self.figures[0].visible)
        ends = self.figures[0 if log else 1]
        across = (curve.frequency_hz - x) / (ends.x_range.end - ends.x_range.start)
        heights = np.maximum(curve.amplitude_m * self.factor, 1e-300)
        if log:
            up = np.log(heights / max(y, 1e-300)) / math.log(ends.y_range.end / ends.y_range.start)
        else:
            up = (heights - y) / (ends.y_range.end - ends.y_range.start)
        return int(np.argmin((2.0 * across) ** 2 + up**2))

    def _labelled(self, curve: ResponseCurve) -> list[Peak]:
        """The highest peaks that are far enough from each other for their labels."""
        found: list[Peak] = []
        room = APART * (self.range_hz[1] - self.range_hz[0])
        for peak in sorted(curve.peaks, key=lambda peak: -peak.amplitude_m):
            if len(found) < MOST_PEAKS and all(abs(peak.frequency_hz - each.frequency_hz) > room for each in found):
                found.append(peak)
        return found

    def _inside(self, frequency_hz: float) -> bool:
        return self.range_hz[0] <= frequency_hz <= self.range_hz[1]

    def _lines(self, curve: ResponseCurve) -> dict[str, list[Any]]:
        return {"xs": [curve.frequency_hz.tolist()], "ys": [(curve.amplitude_m * self.factor).tolist()]}

    def _points(self, curve: ResponseCurve) -> dict[str, list[Any]]:
        rows = zip(
            curve.frequency_hz.tolist(),
            (curve.amplitude_m * self.factor).tolist(),
            curve.sticking.tolist(),
            curve.slipping.tolist(),
            curve.separating.tolist(),
            strict=True,
        )
        text = [
            f"{f:.5g} Hz  {a:.4g} {self.unit}\nnodes: {stick} stick, {slip} slip, {apart} open"
            for f, a, stick, slip, apart in rows
        ]
        return {
            "x": curve.frequency_hz.tolist(),
            "y": (curve.amplitude_m * self.factor).tolist(),
            "text": text,
        }

    def _fit(self, views: Sequence[LiveView]) -> None:
        if self.zoomed:
            return
        heights = [
            branch.amplitude_m * self.factor
            for view in views
            for branch in (view.response, *view.response.detached)
            if branch.points
        ]
        if not heights:
            return
        worst = [view.facts.worst_amplitude_m * self.factor for view in views]
        most = max([float(each.max()) for each in heights] + [each for each in worst if math.isfinite(each)])
        least = min(float(each.min()) for each in heights)
        limits = [limit.amplitude_m * self.factor for limit in views[0].limits]
        for made, scale, shown in zip(self.figures, (self.log, self.linear), (limits, []), strict=True):
            ends = [*(float(each.max()) for each in shown), most]
            if not scale.holds(least, max(ends)):
                made.y_range.update(start=scale.low, end=scale.high)


@dataclass
class TrailChart(Chart):
    """The peak over the values that a knob has had; the second figure has a logarithmic axis of values."""

    @classmethod
    def of(cls, unit: str) -> TrailChart:
        """Axes in the unit of the response."""
        found = sources(line="x y", trail="x y", now="x y", best="x y")
        made = []
        for log in (False, True):
            figure = plain_figure(
                "trail_log" if log else "trail",
                "",
                f"peak [{unit}]",
                x_axis_type="log" if log else "linear",
                y_axis_type="log",
            )
            figure.line("x", "y", source=found["line"], color=LIMIT_COLOUR, line_width=1.2)
            figure.scatter("x", "y", source=found["trail"], size=5, color="#0072B2", alpha=0.55)
            figure.scatter("x", "y", source=found["best"], marker="star", size=14, color=INK)
            figure.scatter("x", "y", source=found["now"], size=11, fill_color=None, line_color=INK, line_width=2.0)
            made.append(figure)
        made[0].visible = made[1].visible = False  # until there is a trail
        return cls(made, found)

    def show_best(self, value: float, height: float) -> None:
        """Mark the optimum."""
        self.show(best={"x": [value], "y": [height]})

    def hide(self) -> None:
        """Show nothing."""
        for made in self.figures:
            made.visible = False

    def show_trail(self, label: str, log: bool, trail: Mapping[float, float], now: float) -> None:
        """Draw peaks by shown value of a knob, the value as it stands with a ring."""
        values = sorted(trail)
        line = {"x": values, "y": [trail[value] for value in values]}
        here = [now] if now in trail else []
        self.show(line=line, trail=line, now={"x": here, "y": [trail[value] for value in here]})
        for made, is_log in zip(self.figures, (False, True), strict=True):
            made.visible = is_log == log
            if made.visible:
                made.xaxis.axis_label = label
                fit(made.x_range, values, is_log)
                fit(made.y_range, trail.values(), True)

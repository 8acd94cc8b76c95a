"""Figures and tables of sweeps over two keys, and of sweeps with many curves."""

import csv
import json
import math
from dataclasses import MISSING, fields, replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from pipeline_support import overlapping_texts, small_scene, write_scene

from nonlinear import Peak, ResponseCurve, TerminationReason, WorstMotion
from pipeline.figures.data import PlottedCurve, SweepPoint, curve_colours, groups, is_grid, sweep_keys
from pipeline.figures.peaks import (
    band_figure,
    bins,
    curves_to_read,
    ends,
    has_few_lines,
    highest_at,
    quantile_figure,
    trend_figure,
)
from pipeline.figures.response import has_lines, response_figure
from pipeline.figures.style import figure_table, ordered_colours
from pipeline.figures.sweep_map import cell_figure, map_of_sweep, sweep_map_figure
from pipeline.report.charts import charts
from pipeline.report.error_budget import (
    ErrorRow,
    _stability,
    first_few,
    listed,
    quantile_rows,
    shown_rows,
    story,
)
from pipeline.results.worst import unstable_peaks
from pipeline.scene.reading import read_scene
from pipeline.stages.curve.curve_summary import CurveSummary, checked
from pipeline.stages.curve.respond import CurveResult

V0, MU = "contact.interference", "contact.friction"
SCENE = SimpleNamespace(name="scene", response=SimpleNamespace(frequency=(300.0, 500.0)))
REQUIRED = [f.name for f in fields(CurveSummary) if f.default is MISSING]


def point(index: int, parameters: dict[str, Any], height: float, unsure: bool = False) -> SweepPoint:
    """A summary with a worst motion beside the peak."""
    member: Any = SimpleNamespace(index=index, parameters=parameters, scene=SCENE)
    facts = CurveSummary(
        **dict.fromkeys(REQUIRED, 0),
        peak_frequency_hz=400.0,
        peak_amplitude_m=height,
        worst_frequency_hz=400.0 + index,
        worst_amplitude_m=height,
        worst_unresolved="something" * unsure,
    )
    return SweepPoint(member, facts)


def grid(n: int, m: int) -> list[SweepPoint]:
    """Curves over n interferences and m friction coefficients; the lowest one is at the first of both."""
    return [
        point(i * m + j, {V0: 1e-6 * (i - 2), MU: 0.1 * (j + 1)}, 1e-6 * (1.0 + i + 10.0 * j))
        for i in range(n)
        for j in range(m)
    ]


def curve(at: SweepPoint, folded: bool = False, **changes: Any) -> PlottedCurve:
    """A resonance of the height of a point, stable below its peak."""
    x = np.linspace(300.0, 500.0, 81)
    y = at.peak[1] / np.hypot(1.0, (x - 400.0) / 10.0)
    if folded:
        x = np.concatenate([x[:41], x[39:29:-1], x[31:]])
        y = np.concatenate([y[:41], np.linspace(0.9, 0.5, 10) * at.peak[1], 0.2 * y[31:]])
    values: dict[str, Any] = {
        "rom": Path("rom.h5"),
        "response": record(x, y, x <= 400.0, **changes),
        "outputs": ({},),
    }
    values |= {"peak_displacement": np.zeros((2, 1, 3), complex), "contacts": (), "contact_area": None}
    return PlottedCurve(at.member, replace(at.facts, peak_index=int(np.argmax(y))), **values)


def record(x: np.ndarray, y: np.ndarray, stable: np.ndarray, **changes: Any) -> ResponseCurve:
    """A curve with these points; what its other arrays hold is not drawn."""
    top = int(np.argmax(y))
    given: dict[str, Any] = {f.name: np.zeros(len(x), int) for f in fields(ResponseCurve) if f.default is MISSING}
    given |= {"frequency_hz": x, "amplitude_m": y, "stable": stable, "peaks": (), "bifurcations": (), "harmonics": 1}
    given |= {"peak": Peak(x[top], y[top], top), "termination": TerminationReason("complete", x[-1], "closed")}
    given.pop("outputs")
    return ResponseCurve(**(given | changes))


def lightness(colour: Any) -> np.ndarray:
    """CIE L*a*b* of an sRGB colour (D65)."""
    c = np.array(to_rgb(colour))
    linear = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]) @ linear
    f = np.cbrt(xyz / [0.9505, 1.0, 1.089])
    return np.array([116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])])


@pytest.mark.parametrize("count", [4, 8, 10, 12])
def test_colours_of_a_sweep_can_be_told_apart(count: int) -> None:
    """A difference of 2.3 in L*a*b* is just seen; in grey neighbours differ by a quarter of the range."""
    found = [lightness(colour) for colour in ordered_colours(count)]
    apart = [np.linalg.norm(a - b) for i, a in enumerate(found) for b in found[:i]]
    assert min(apart) > 20.0
    assert all(abs(a[0] - b[0]) > 25.0 for a, b in pairwise(found))
    assert max(each[0] for each in found) < 75.0  # legible on white


def test_swept_keys_are_sorted_and_grids_are_known() -> None:
    points = grid(6, 3)
    keys = sweep_keys(points)
    assert [key.name for key in keys] == [V0, MU]
    assert keys[0].axis == "interference v0 [µm], gap below 0"
    assert [keys[0].position(value) for value in keys[0].values] == pytest.approx([-2, -1, 0, 1, 2, 3])
    assert is_grid(points, keys)
    assert not is_grid(points[:-1], keys)
    assert [len(members) for _, members in groups(points, keys[1])] == [6, 6, 6]
    names = sweep_keys([point(0, {"rom.modes": "auto"}, 1.0), point(1, {"rom.modes": 3}, 1.0)])[0]
    assert (names.numeric, names.position("auto"), names.position(3)) == (False, 0.0, 1.0)
    assert sweep_keys([point(0, {V0: 1e-6}, 1.0)]) == []


def test_two_keys_are_told_by_colour_and_panel_and_the_legend_explains_the_lines() -> None:
    points = grid(4, 2)
    x, y, unstable = np.array([390.0, 410.0]), np.full(2, 1e-6), np.zeros(2, bool)
    isola = record(x, y, unstable, growth_nodal_diameter=np.array([0, 3]))
    curves = [curve(each, detached=(isola,) * (each.index == 0)) for each in points]
    figure = response_figure(curves, [], dict(enumerate(curve_colours(points))), "title")
    assert [axes.get_title() for axes in figure.axes] == ["friction coefficient 0.1", "friction coefficient 0.2"]
    of = [
        {line.get_label(): line.get_color() for line in axes.lines if str(line.get_label()).startswith("v0")}
        for axes in figure.axes
    ]
    assert of[0] == of[1]
    assert len(set(of[0].values())) == 4
    said = [text.get_text() for text in figure.legends[0].get_texts()]
    assert len(said) == len(set(said))
    wanted = {"unstable", "unstable, other nodal diameter", "isolated branch (thin)", "peak"}
    assert set(said) - set(of[0]) == wanted
    marks = [line for axes in figure.axes for line in axes.lines if line.get_marker() not in ("None", "")]
    assert marks
    assert all(line.get_markerfacecolor() == "none" for line in marks)  # the curve shows through
    figure.draw_without_rendering()
    assert figure.legends[0].get_window_extent().y1 < min(axes.bbox.y0 for axes in figure.axes)  # below the curves


def test_curves_that_coincide_are_all_seen() -> None:
    points = [point(number, {V0: 1e-6 * (number + 1)}, 1e-6) for number in range(5)]
    figure = response_figure([curve(each) for each in points], [], dict(enumerate(curve_colours(points))), "title")
    widths = {str(line.get_label()): line.get_linewidth() for line in figure.axes[0].lines}
    drawn = [widths[f"v0 = {number} µm"] for number in range(1, 6)]
    assert sorted(set(drawn), reverse=True) == drawn  # the last is on top, and the thinnest


def test_a_peak_that_the_ring_leaves_is_unstable_everywhere() -> None:
    """Looked at for folds alone, but for the highest solution: table "(unstable)", report "every peak is stable"."""
    at = point(0, {V0: 1e-6}, 158.6e-6)
    stable = curve(at)
    top = stable.facts.peak_index
    worst = WorstMotion(158.6e-6, 400.0, 0, top, searched="searched: ", nodal_diameter=3, unstable=True)
    response = checked(replace(stable.response, worst=worst))
    facts = replace(stable.facts, worst_unstable=True, worst_unresolved="unstable", peak_stable=False)
    found = replace(stable, response=response, facts=facts)
    assert response.stable.sum() == stable.response.stable.sum() - 1
    figure = response_figure([found], [], {0: "C0"}, "title")
    said = set(figure.axes[0].get_legend_handles_labels()[1])
    assert {"unstable peak", "unstable, other nodal diameter"} <= said
    assert "peak" not in said
    for each, shape in ((found, "cross"), (stable, "circle")):
        chart = cast(Any, charts([each], [at], {0: "black"}))["response"]
        assert chart["marks"][0]["shape"] == shape
    source: Any = SimpleNamespace(first=SimpleNamespace(response=SimpleNamespace(stability="folds")))
    row = _stability(source, [found])
    assert (row.found, row.verdict) == ("the peak of the main branch is unstable on curve 0", "unstable")
    elsewhere = replace(found, facts=replace(facts, peak_stable=True, worst_branch=1))
    assert _stability(source, [elsewhere]).found == "the highest solution found is unstable on curve 0"
    assert _stability(source, [stable]).found == "no unstable peak found by what was looked at"
    assert unstable_peaks({0: facts}) == [0]


def test_marks_of_the_trend_are_explained_outside_of_the_data() -> None:
    """An arrow head of the legend stood among the points; the triangle of an open motion behind its dot."""
    points = [point(k, {V0: k * 1e-6}, 1e-6 * (k + 1), unsure=k == 1) for k in range(4)]
    points[2] = replace(points[2], facts=replace(points[2].facts, peak_at_end=True))
    figure = trend_figure(points, [], dict.fromkeys(range(4), "C0"), "title")
    assert figure is not None
    assert all(axes.get_legend() is None for axes in figure.axes)
    said = [text.get_text() for text in figure.legends[0].get_texts()]
    assert {"end of the range, no peak", "worst motion, not settled"} <= set(said)
    sizes = {line.get_marker(): line.get_markersize() for line in figure.axes[0].lines if len(line.get_xdata())}
    assert sizes["^"] > 2.0 * sizes["o"]


def test_a_motion_followed_in_time_is_drawn_in_the_colour_of_its_curve() -> None:
    """As wide as it was followed, with one entry of the legend; nothing where nothing was followed."""
    points = [point(0, {V0: -1e-6}, 1e-6), point(1, {V0: 1e-6}, 2e-6)]
    seen = {"worst_followed_hz": (390.0, 400.0, 410.0), "worst_followed_m": (2e-6, 3e-6, 2.5e-6)}
    curves = [curve(replace(points[0], facts=replace(points[0].facts, **seen))), curve(points[1])]
    figure = response_figure(curves, [], {0: "tab:red", 1: "tab:blue"}, "title")
    (line,) = [
        each for each in figure.axes[0].lines if str(each.get_label()).endswith("worst motion by time integration")
    ][:-1]
    assert line.get_color() == "tab:red"
    assert line.get_xdata() == pytest.approx([390.0, 400.0, 410.0])
    assert line.get_ydata() == pytest.approx([2.0, 3.0, 2.5])
    said = [text.get_text() for text in figure.legends[0].get_texts()]
    assert said.count("worst motion by time integration") == 1


def test_a_map_has_the_height_of_each_curve_in_its_cell() -> None:
    points = grid(4, 3)
    figure = cell_figure(points, "title")
    assert figure is not None
    cells = figure.axes[0].collections[0].get_array().reshape(3, 4)
    rows = list(csv.DictReader(figure_table(figure, "again").splitlines()[1:]))
    heights = [float(row[name]) for row in rows for name in row if name.startswith("worst motion") and row[name]]
    assert heights == pytest.approx([each.worst[1] * 1e6 for each in points])
    friction = [float(row["friction coefficient"]) for row in rows[: len(points)]]
    assert friction == pytest.approx([each.parameters[MU] for each in points])
    for each in points:
        column, row = round(each.parameters[V0] * 1e6) + 2, round(each.parameters[MU] * 10) - 1
        assert cells[row, column] == pytest.approx(each.worst[1] * 1e6)
    frame = figure.axes[0].patches[0]
    assert (frame.get_x(), frame.get_y()) == (0, 2)  # of the lowest v0 the highest over the friction
    assert cell_figure([point(i, {V0: i * 1e-6}, 1e-6) for i in range(9)], "one key") is None
    rng = np.random.default_rng(1)
    samples = [point(i, {V0: x, MU: y}, 1e-6) for i, (x, y) in enumerate(rng.random((50, 2)))]
    scattered = cell_figure(samples, "samples")
    assert scattered is not None
    assert len(scattered.axes[0].collections[0].get_offsets()) == 50


def test_a_figure_of_many_curves_has_few_artists() -> None:
    rng = np.random.default_rng(2)
    points = [point(i, {V0: x, MU: y}, 1e-6 * (1.0 + x)) for i, (x, y) in enumerate(rng.random((10_000, 2)))]
    assert not has_lines(points)
    assert not has_few_lines(points)
    assert trend_figure(points, [], {}, "title") is None
    read = curves_to_read(points)
    assert len(read) < 310
    assert {each.index for each in ends(points)} <= set(read)
    figure = quantile_figure(points, "title")
    assert overlapping_texts(figure) == []
    assert figure is not None
    assert sum(len(axes.lines) + len(axes.collections) for axes in figure.axes) < 30
    median = next(line for line in figure.axes[0].lines if line.get_label() == "median")
    x, y = median.get_xdata(), median.get_ydata()
    assert len(x) <= 16
    assert y == pytest.approx(1.0 + np.asarray(x) * 1e-6, rel=0.01)  # the axis is in µm
    bands = band_figure([curve(points[k]) for k in read[:60]], points, "title")
    assert "10000 curves, bands from 60 of them" in bands.axes[0].get_title()
    assert len(bands.axes[0].lines) + len(bands.axes[0].collections) < 20


def test_bins_hold_every_value_once_and_equal_values_together() -> None:
    rng = np.random.default_rng(3)
    for x in (rng.integers(0, 7, 200).astype(float), rng.integers(0, 60, 500) * 1.0, rng.random(300), np.ones(5)):
        found = bins(x)
        assert sorted(np.concatenate(found)) == list(range(len(x)))
        assert len(found) <= 16
        assert all(x[a].max() < x[b].min() for a, b in pairwise(found))


def test_the_highest_of_a_folded_curve() -> None:
    """Against every segment of the polyline, one after the other."""
    folded = curve(point(0, {}, 1e-6), folded=True)
    frequency = np.linspace(290.0, 510.0, 177)
    x, y = folded.response.frequency_hz, folded.response.amplitude_m
    exact = np.full(len(frequency), np.nan)
    for k, (a, b) in enumerate(pairwise(x)):
        inside = (frequency >= min(a, b)) & (frequency <= max(a, b)) & (a != b)
        line = y[k] + (frequency - a) / (b - a if a != b else 1.0) * (y[k + 1] - y[k])
        exact = np.fmax(exact, np.where(inside, line, np.nan))
    np.testing.assert_allclose(highest_at(folded.response, frequency), exact, rtol=1e-12)


def test_the_story_gives_the_worst_and_the_best_and_what_is_open(tmp_path: Path) -> None:
    file = read_scene(write_scene(tmp_path / "s.toml", small_scene(sweep={V0: [-1e-6, 0.0, 1e-6, 2e-6]})))
    heights = (4e-6, 1e-6, 2e-6, 5e-7)
    known = [point(0, {}, h, unsure=i == 3).facts for i, h in enumerate(heights)]
    known[2] = replace(known[2], truncation_error=0.07)
    source: Any = SimpleNamespace(
        first=file.first,
        curves=[SimpleNamespace(facts=facts) for facts in known],
        swept=(V0,),
        model_rows=({"coriolis_error": 0.031},),
    )
    points = [SweepPoint(member, facts) for member, facts in zip(file.members, known, strict=True)]
    errors = [
        ErrorRow("truncation error", "7 %", "large", ""),
        ErrorRow("mesh error", "not measured", "not known", ""),
    ]
    told = dict(story(source, points, errors))
    assert list(told) == ["Computed", "Worst motion", "Best value", "How sure"]
    assert "from -1 to 2 µm (4 values)" in told["Computed"]
    assert told["Worst motion"].startswith("4 µm at 400 Hz, with v0 = -1 µm")
    assert told["Best value"].startswith("v0 = 0 µm, with a worst motion of 1 µm")  # 0.5 µm may be higher
    assert "1 curve has a lower one so far" in told["Best value"]
    assert "The worst motion of curve 3 may be higher than found (>=)" in told["How sure"]
    assert "by at most 7 % (curve 2), too much: raise response.harmonics." in told["How sure"]
    assert "Coriolis forces are neglected: they change natural frequencies in the range by 3.1 %." in told["How sure"]
    assert told["How sure"].endswith("The mesh error was not measured.")


def test_tables_of_many_curves_have_the_ends_and_the_quantiles() -> None:
    heights = np.random.default_rng(4).permutation(np.arange(1, 1002)) * 1e-6
    names = (
        "worst_frequency_hz",
        "peak_amplitude_m",
        "peak_frequency_hz",
        "truncation_error",
        "energy_error",
        "seconds",
    )
    curves: Any = [
        SimpleNamespace(
            complete=i != 77, facts=SimpleNamespace(worst_amplitude_m=h, **dict.fromkeys(names, math.nan))
        )
        for i, h in enumerate(heights)
    ]
    points = [point(i, {V0: float(i)}, h) for i, h in enumerate(heights)]
    shown = shown_rows(points, curves)
    assert len(shown) <= 3 * 8
    assert {int(np.argmin(heights)), int(np.argmax(heights)), 77} <= set(shown)
    (row,) = quantile_rows(curves)
    assert row.name == "worst motion [µm]"
    assert [float(value) for value in row.values] == pytest.approx([1.0, 101.0, 501.0, 901.0, 1001.0])
    assert shown_rows(points[:40], curves[:40]) == list(range(40))
    assert quantile_rows(curves[:40]) == []
    assert first_few([str(i) for i in range(20)], 3) == ["0", "1", "2", "and 17 more"]
    assert listed([1, 2], 1) == "1 and 1 more"


def test_charts_have_the_points_of_the_curves() -> None:
    points = grid(4, 2)
    curves = [curve(each) for each in points]
    colours = dict(enumerate(curve_colours(points)))
    found: dict[str, Any] = json.loads(json.dumps(charts(curves, points, colours), allow_nan=False))
    response, sweep = found["response"], found["peaks"]
    assert (response["yunit"], response["parts"]) == ("µm", ["friction coefficient 0.1", "friction coefficient 0.2"])
    for line, exact in zip(response["lines"], curves, strict=True):
        assert line["x"] == pytest.approx(exact.response.frequency_hz, rel=1e-5)
        assert line["y"] == pytest.approx(exact.response.amplitude_m * 1e6, rel=1e-5)
        assert [kind for *_, kind in line["kinds"]] == [0, 1]
        assert to_rgb(line["colour"]) == pytest.approx(to_rgb(colours[exact.index]), abs=2e-3)
    assert all(line["width"] == 0 for line in sweep["lines"])  # no lines between the values
    heights = {text: y for line in sweep["lines"] for text, y in zip(line["said"], line["y"], strict=True)}
    assert len(heights) == len(points)
    for each in points:
        (text,) = (text for text in heights if text.startswith(f"curve {each.index}:"))
        assert heights[text] == pytest.approx(each.worst[1] * 1e6)
    many = [point(i, {V0: i * 1e-6}, 1e-6 * (i + 1)) for i in range(500)]
    few = cast(Any, charts([curve(each) for each in many[::50]], many, dict.fromkeys(range(500), "black")))
    assert len(few["response"]["lines"]) <= 3
    assert len(few["peaks"]["lines"][0]["x"]) == 500
    rng = np.random.default_rng(5)
    sampled = [point(i, {V0: x * 1e-6, MU: y}, 1e-6 * (1.0 + x)) for i, (x, y) in enumerate(rng.random((3000, 2)))]
    dots = cast(Any, charts([curve(ends(sampled)[0])], sampled, {}))["peaks"]
    assert dots["parts"] == ["over interference v0 [µm], gap below 0", "over friction coefficient"]
    assert [len(line["x"]) for line in dots["lines"]] == [2000, 2000]
    over_v0, over_mu = dots["lines"]
    assert over_v0["y"] == over_mu["y"] == pytest.approx([1.0 + x for x in over_v0["x"]], rel=1e-4)
    assert 0.0 <= min(over_mu["x"]) < max(over_mu["x"]) <= 1.0


def test_a_grid_of_numbers_is_drawn_with_contours_and_other_sweeps_with_cells(tmp_path: Path) -> None:
    def curves(first: tuple[str, list[Any]], second: tuple[str, list[Any]]) -> list[CurveResult]:
        scene = small_scene(sweep={first[0]: first[1], second[0]: second[1]})
        members = read_scene(write_scene(tmp_path / "scene.toml", scene)).members
        return [CurveResult(member, None, None, None, "not solved") for member in members]

    v0, mu = (V0, [-2e-6, 0.0, 2e-6, 4e-6]), (MU, [0.1, 0.2, 0.4, 0.8])
    found = map_of_sweep(curves(mu, v0))
    assert found is not None
    assert [axis.logarithmic for axis in found.grid.axes] == [key == MU for key in found.keys]
    assert {point.values for point in found.points} == {
        (x, y) if found.keys[0] == V0 else (y, x) for x in v0[1] for y in mu[1]
    }
    assert all(point.may_be_higher == "not solved" for point in found.points)
    assert sweep_map_figure(curves(mu, v0), grid(4, 4), "title") is not None  # nothing solved: axes alone
    assert map_of_sweep(curves(v0, (MU, [0.1, 0.2, 0.3]))) is None
    assert map_of_sweep(curves(v0, ("excitation.engine_order", [1, 2, 3, 4]))) is None
    assert map_of_sweep(curves(v0, mu)[:-1]) is None
    cells = sweep_map_figure(curves(v0, ("excitation.engine_order", [1, 2, 3, 4])), grid(4, 4), "title")
    assert cells is not None
    assert len(cells.axes[0].collections[0].get_array().ravel()) == 16

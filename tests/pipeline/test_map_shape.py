"""Shape of a map: cells, refinement, what is interpolated and what is not, the figure."""

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from map_support import exact_point, peak
from matplotlib.tri import LinearTriInterpolator, Triangulation
from pipeline_support import overlapping_texts

from pipeline.figures.style import styled, subplots
from pipeline.results.worst import SLIPPING, STUCK
from pipeline.studies.map.figure import MapShape, draw_contours, levels_of, map_figure
from pipeline.studies.map.grid import MapAxis, MapGrid, MapPoint, even_in_logarithm, spaced
from pipeline.studies.map.result import (
    WorstMotionMap,
    cell_areas,
    circumcentres,
    continue_each_other,
    triangulated,
    worst_motion_map,
)
from pipeline.studies.map.study import base_cells, conclusion, missing_places, refined

X, Y = "contact.interference", "contact.friction"


def grid(columns: int, rows: int) -> MapGrid:
    return MapGrid((MapAxis(X, spaced(0.0, 1e-6, columns, False)), MapAxis(Y, spaced(0.1, 0.5, rows, False))))


def damper_grid(count: int) -> MapGrid:
    axes = (("contact.preload", 0.5, 60.0), ("contact.friction", 0.1, 0.8))
    first, second = (MapAxis(key, spaced(low, high, count, False)) for key, low, high in axes)
    return MapGrid((first, second))


def two_peaks(at: MapGrid, told: bool = True) -> WorstMotionMap:
    """The worst motion is a peak at 300 Hz on the left and one at 320 Hz on the right, both on every curve."""

    def point(place: tuple[float, float]) -> MapPoint:
        high = 1.0 + 0.02 * place[0]
        peaks = (300.0, 1e-6 * (2.0 - 0.3 * place[0])), (320.0, 1e-6 * high)
        worst = max(peaks, key=lambda each: each[1])
        return MapPoint(
            place, at.values_at(place), worst[1], worst[0], SLIPPING, 0, "periodic", "", peaks if told else ()
        )

    return worst_motion_map(at, [point(place) for place in at.places()])


def drawn_levels(result: WorstMotionMap) -> set[int]:
    """Colours of the drawn frequency, as numbers of levels."""
    values = np.array([point.frequency_hz for point in result.points], dtype=float)
    shape, levels = MapShape(result), levels_of(values)
    with styled():
        figure, axes = subplots(size=(3.0, 3.0))
        axes.set(position=(0.0, 0.0, 1.0, 1.0), xlim=shape.points[[0, -1], 0], ylim=shape.points[[0, -1], 1])
        axes.set_axis_off()
        mappable = draw_contours(axes, shape, values, levels, "viridis")
        figure.set_layout_engine("none")
        figure.canvas.draw()
        pixels = np.asarray(cast(Any, figure.canvas).buffer_rgba())[..., :3].reshape(-1, 3)
    middles = 0.5 * (levels.limits[1:] + levels.limits[:-1])
    colours = (255.0 * mappable.to_rgba(middles)[:, :3]).round()
    apart = np.abs(pixels[:, None, :].astype(float) - colours[None]).max(axis=2)
    assert apart.min(axis=1).max() <= 1.0  # nothing but colours of levels: no gaps, no blending
    return set(apart.argmin(axis=1).tolist())


def test_no_colour_lies_between_two_peaks_that_exchange() -> None:
    """The same numbers without the second peak of each curve are one peak that moves: then all levels are there."""
    result = two_peaks(grid(7, 4))
    assert {point.frequency_hz for point in result.points} == {300.0, 320.0}
    assert len(drawn_levels(result)) == 2
    assert len(drawn_levels(two_peaks(grid(7, 4), told=False))) > 6


def test_which_points_continue_each_other() -> None:
    here = MapPoint((0.0, 0.0), (0.0, 0.1), 1e-6, 300.0, SLIPPING, 0, "periodic", "", ((300.0, 1e-6), (350.0, 9e-7)))
    there = replace(here, place=(1.0, 0.0), amplitude_m=1.3e-6, frequency_hz=304.0, peaks=((304.0, 1.3e-6),))
    assert continue_each_other(here, there)
    assert continue_each_other(here, replace(there, state=STUCK, branch=1))  # a peak that got detached
    exchanged = replace(there, frequency_hz=349.0, peaks=((303.0, 1.2e-6), (349.0, 1.3e-6)))
    assert not continue_each_other(here, exchanged)
    isola = replace(there, amplitude_m=3.5e-6, frequency_hz=305.0, peaks=((302.0, 1.1e-6), (305.0, 3.5e-6)))
    assert not continue_each_other(here, isola)  # the main branch goes on below
    assert not continue_each_other(here, replace(there, frequency_hz=340.0, peaks=()))  # too fast for the grid
    assert not continue_each_other(here, replace(there, amplitude_m=4.5e-6, peaks=()))
    assert not continue_each_other(here, replace(there, motion="quasi-periodic"))
    assert not continue_each_other(here, replace(there, amplitude_m=None))


def test_an_end_of_the_range_is_never_the_lowest_point() -> None:
    """The response rises up to the end of its range there: what peak follows is not known."""
    base = grid(4, 4)
    points = [exact_point(base, place) for place in base.places()]
    points[3] = replace(points[3], amplitude_m=1e-9, at_end=True, may_be_higher="an end of the frequency range")
    points = [replace(point, truncation_error=0.24) for point in points]
    result = worst_motion_map(base, points)
    assert result.basin is not None
    assert result.basin.lowest != 3
    assert 3 not in result.basin.points
    said = " | ".join(conclusion(result))
    assert "at 1 of 16 points the worst motion lies at an end of the frequency range, which is no peak" in said
    assert "(too few harmonics: truncation error 24 %)" in said
    assert "too few harmonics on 16 of 16 curves" in said
    nowhere = worst_motion_map(base, [replace(point, at_end=True) for point in points])
    assert nowhere.basin is None
    assert conclusion(nowhere)[-1] == "the worst motion is not known anywhere on the map"


def test_refined_cells_resolve_a_line_and_cover_the_map() -> None:
    """A state that changes along a circle: cells that it cuts are small, sides are 2 to 1, no triangle is obtuse."""
    base = grid(6, 5)

    def point(place: tuple[float, float]) -> MapPoint:
        outside = np.hypot(place[0] - 2.0, place[1] - 2.0) > 1.3
        return MapPoint(place, base.values_at(place), 1e-6, 300.0, STUCK if outside else SLIPPING, 0, "periodic")

    cells, points = base_cells(base), [point(place) for place in base.places()]
    for _ in range(3):
        cells = refined(cells, points, 0.1)
        points += [point(place) for place in missing_places(cells, points)]
    assert sum(side**2 for _, _, side in cells) == 20.0
    assert len({each.place for each in points}) == len(points)
    angle = np.linspace(0.0, 2.0 * np.pi, 721)
    for x, y in zip(2.0 + 1.3 * np.cos(angle), 2.0 + 1.3 * np.sin(angle), strict=True):
        assert {s for u, v, s in cells if u <= x <= u + s and v <= y <= v + s} == {0.125}
    assert len(points) < 0.6 * (5 * 8 + 1) * (4 * 8 + 1)
    places = np.array([each.place for each in points])
    triangles = triangulated(places)
    centre, corners = circumcentres(places, triangles), places[triangles]
    radius = np.linalg.norm(centre - corners[:, 0], axis=1)
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    others = np.sort(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2), axis=1)[:, :2]
    assert np.all((others**2).sum(axis=1) >= longest**2 * (1.0 - 1e-12))
    assert np.all(radius > 0.0)
    areas = cell_areas(places, triangles)
    assert areas.sum() == pytest.approx(20.0)
    regular = cell_areas(np.array(base.places()), triangulated(np.array(base.places())))
    assert sorted(set(regular.round(12).tolist())) == [0.25, 0.5, 1.0]
    inside = np.array([each.state == SLIPPING for each in points])
    assert areas[inside].sum() == pytest.approx(np.pi * 1.3**2, rel=0.03)


def test_refined_cells_are_worth_their_curves() -> None:
    """Error of the interpolated amplitude of the friction damper, against an even grid of as many curves."""
    rng = np.random.default_rng(4)
    at = np.column_stack([rng.uniform(0.5, 60.0, 400), rng.uniform(0.1, 0.8, 400)])
    exact = np.log([peak(load * friction)[1] for load, friction in at])

    def error(result: WorstMotionMap) -> float:
        values = np.array([point.values for point in result.points])
        mesh = Triangulation(values[:, 0], values[:, 1], result.triangles)
        found = LinearTriInterpolator(mesh, np.log([point.height for point in result.points]))(at[:, 0], at[:, 1])
        return float(np.abs(found - exact).mean())

    coarse = damper_grid(5)
    cells, points = base_cells(coarse), [exact_point(coarse, place) for place in coarse.places()]
    for _ in range(3):
        cells = refined(cells, points, 0.05)
        points += [exact_point(coarse, place) for place in missing_places(cells, points)]
    even = damper_grid(round(len(points) ** 0.5))
    uniform = worst_motion_map(even, [exact_point(even, place) for place in even.places()])
    assert error(worst_motion_map(coarse, points)) < 0.7 * error(uniform)


def test_the_figure_marks_what_the_map_knows() -> None:
    base = two_peaks(grid(7, 4))
    changed: list[MapPoint] = []
    for point in base.points:
        values: dict[str, Any] = {"state": STUCK if point.place[1] >= 2.0 else SLIPPING}
        values |= {"branch": 1} if point.place[0] == 0.0 else {}
        values |= {"may_be_higher": "a reason"} if point.place == (3.0, 1.0) else {}
        changed.append(replace(point, **values))
    changed[-1] = replace(changed[-1], amplitude_m=None, frequency_hz=None, may_be_higher="not solved")
    figure = map_figure(worst_motion_map(base.grid, changed), "50 $ for a title")
    assert overlapping_texts(figure) == []
    said = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "contact state changes" in said
    assert any("jumps" in each for each in said)
    assert any("detached" in each for each in said)
    assert "not settled" in said
    assert any(each.startswith("highest of the best design: ") for each in said)
    states = figure.axes[0].collections
    assert {text.get_text() for text in figure.axes[0].texts} == {"slipping", "stuck"}
    lines = next(each for each in states if each.get_label() != "" and hasattr(each, "get_segments"))
    assert np.concatenate(lines.get_segments())[:, 1] == pytest.approx(0.1 + 0.4 / 3 * 1.5)


def test_values_of_a_grid() -> None:
    assert spaced(-2e-5, 6e-5, 5, False) == (-2e-5, 0.0, 2e-5, 4e-5, 6e-5)
    values = spaced(1.0, 100.0, 5, True)
    assert values == (1.0, 3.162, 10.0, 31.62, 100.0)
    assert even_in_logarithm(values)
    assert not even_in_logarithm((1.0, 2.0, 3.0, 4.0))
    assert not even_in_logarithm((-1.0, 1.0, 2.0))
    assert MapAxis(X, values, True).value_at(1.5) == pytest.approx(np.sqrt(31.62))
    assert MapAxis(X, (0.0, 1.0, 4.0)).value_at(1.5) == 2.5
    assert MapAxis(X, (0.0, 1.0, 4.0)).value_at(2.0) == 4.0

"""Figures and the section of the report about an optimum: what is drawn and said, against a mass with a slider."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pipeline_support import overlapping_texts

from nonlinear import Optimum, PerformanceCurve
from nonlinear.peak_curves.optimum_result import PeakCurve, SolvedResponse, WorstEnvelope
from pipeline.figures.performance_figure import MULTIPLES, performance_figure
from pipeline.studies.optimum.figure import optimum_figure
from pipeline.studies.optimum.report import LINES, optimum_section
from pipeline.studies.optimum.result import OptimumResult, Robust, Trial

BEST = math.pi / 2.0  # r / F of the lowest peak of a mass on a slider, X = r^2 / (r - pi/4 F)


def height(limit: Any, force: float = 1.0) -> Any:
    """Peak of a mass of 1 kg on springs of 1 N/m with a slider of this slip limit, m."""
    return limit**2 / (limit - 0.25 * math.pi * force)


def optimum(low: float, high: float, **changes: Any) -> Optimum:
    """That slider over its slip limit; unstable below 1.2."""
    limit = np.linspace(low, high, 201)
    rate = np.where(limit < 1.2, 0.1, -0.1)
    frequency = 0.2 + 0.01 * limit
    zeros = 0.0 * limit
    followed = PeakCurve(limit, height(limit), frequency, rate < 0.0, rate, zeros, "main branch")
    texts = [np.full(201, text) for text in ("followed", "periodic", "main branch")]
    solved = [
        SolvedResponse(x, height(x), 0.2 + 0.01 * x, height(x), "periodic", "", height(x), 1, 0.01, 1, "first", left)
        for x, left in ((low, "too long"), (high, ""))
    ]
    values: dict[str, Any] = {
        "name": "preload",
        "low": low,
        "high": high,
        "value": BEST,
        "frequency_hz": 0.2 + 0.01 * BEST,
        "amplitude_m": math.pi,
        "motion": "periodic",
        "kind": "smooth",
        "curvature": 8.0 / math.pi,
        "slopes": (0.0, 0.0),
        "within": (1.21, 2.24),
        "derivatives": {},
        "elasticities": {"preload": 0.0, "force": 1.0, "normal_stiffness": -2.5},
        "worst": None,
        "envelope": WorstEnvelope(limit, height(limit), frequency, *texts, 0.0),
        "curves": (followed,),
        "responses": tuple(solved),
        "harmonics": 1,
        "truncation_error": 0.0,
        "seconds": 1.0,
        "message": "",
    }
    return Optimum(**(values | changes))


def result(found: Optimum, factor: float = 1.0, own: float = 1.2) -> OptimumResult:
    base = Trial({"contact.preload": own * factor}, height(own), 0.2 + 0.01 * own, "periodic")
    return OptimumResult(
        ranges={"contact.preload": (found.low * factor, found.high * factor)},
        values={"contact.preload": found.value * factor},
        amplitude_m=found.amplitude_m,
        frequency_hz=found.frequency_hz,
        motion=found.motion,
        kind=found.kind,
        curvature=found.curvature,
        within={"contact.preload": (found.within[0] * factor, found.within[1] * factor)},
        derivatives={},
        base=base,
        method="peaks",
        trials=(),
        responses=len(found.responses),
        seconds=1.0,
        message="",
        followed=found,
        per_unit=factor,
    )


def lines(axes: Any) -> dict[str, Any]:
    """Lines of a panel by their labels."""
    return {line.get_label(): line for line in axes.get_lines()}


def test_what_is_drawn_is_what_was_found() -> None:
    figure = optimum_figure(result(optimum(1.0, 3.0), factor=4.0), "slider")  # a key of 4 per unit of the parameter
    assert figure is not None
    upper, lower, bars = figure.axes
    drawn = lines(upper)
    key, heights = drawn["worst motion"].get_data()
    np.testing.assert_allclose(heights, height(key / 4.0), rtol=1e-12)
    stable, unstable = (drawn[f"followed peak, {kind}"] for kind in ("stable", "unstable"))
    assert np.nanmin(np.where(np.isfinite(stable.get_ydata()), key, np.nan)) >= 4.0 * 1.2
    assert np.nanmax(np.where(np.isfinite(unstable.get_ydata()), key, np.nan)) <= 4.0 * 1.2 + 0.05
    assert unstable.is_dashed()
    assert not stable.is_dashed()
    star = drawn["optimum, 6.283 N (smooth minimum)"]
    assert star.get_xydata()[0] == pytest.approx([4.0 * BEST, math.pi])
    assert drawn["the scene's value, 4.8 N"].get_xydata()[0] == pytest.approx([4.8, height(1.2)])
    assert drawn["response solved"].get_xydata()[0] == pytest.approx([12.0, height(3.0)])
    assert drawn["response solved, counted by the highest solution"].get_xydata()[0] == pytest.approx(
        [4.0, height(1.0)]
    )
    (shade,) = [patch for patch in upper.patches if patch.get_label().startswith("at most 10 %")]
    assert [shade.get_x(), shade.get_x() + shade.get_width()] == pytest.approx([4.84, 8.96])
    assert lines(lower)["worst motion"].get_ydata() == pytest.approx(0.2 + 0.01 * key / 4.0)
    assert [bar.get_width() for bar in bars.patches] == [1.0, -2.5]  # a parameter that is 0 has none
    assert upper.get_yscale() == lower.get_xscale() == "linear"


def test_jumps_are_gaps_and_wide_ranges_have_logarithmic_axes() -> None:
    found = optimum(0.8, 40.0)
    envelope = found.envelope
    values = np.insert(envelope.value, 100, envelope.value[100])  # two equal values: a jump
    both = {
        name: np.insert(getattr(envelope, name), 100, getattr(envelope, name)[100])
        for name in ("frequency_hz", "source", "motion", "origin")
    }
    jumped = replace(
        envelope, value=values, amplitude_m=np.r_[height(values[:101]), 5.0 * height(values[101:])], **both
    )
    figure = optimum_figure(result(replace(found, envelope=jumped, elasticities={})), "slider")
    assert figure is not None
    upper, lower = figure.axes  # no derivatives: no bars
    heights = lines(upper)["worst motion"].get_ydata()
    assert np.flatnonzero(np.isnan(heights)).tolist() == [101]
    assert upper.get_yscale() == lower.get_xscale() == "log"


def test_values_tried_are_drawn_over_every_key() -> None:
    keys = {"shroud.angle": 60.0, "contact.friction": 0.3}
    tried = [Trial({"shroud.angle": 50.0 + k, "contact.friction": 0.1 * k}, 1e-6 * k, 400.0) for k in range(1, 5)]
    tried.append(Trial({"shroud.angle": 10.0, "contact.friction": 0.9}, reason="no mesh"))
    several = replace(
        result(optimum(1.0, 3.0)),
        ranges={"shroud.angle": (40.0, 80.0), "contact.friction": (0.1, 0.9)},
        values=keys,
        within={},
        base=Trial({"shroud.angle": 70.0, "contact.friction": 0.4}, 3e-6, 400.0),
        trials=tuple(tried),
        followed=None,
    )
    figure = optimum_figure(several, "blade")
    assert figure is not None
    assert overlapping_texts(figure) == []
    for panel, key in zip(figure.axes, keys, strict=True):
        places = [trial.values[key] for trial in tried[:4]]
        np.testing.assert_allclose(lines(panel)["values tried"].get_xydata(), np.c_[places, [1.0, 2.0, 3.0, 4.0]])
    assert optimum_figure(replace(several, trials=()), "blade") is None


def test_an_angle_and_an_interference_are_a_line_for_each_angle() -> None:
    """Beside the lines the best of each angle and its interference, with the tolerance as a bar."""

    def trial(angle: float, interference: float) -> Trial:
        height = 1e-6 * (1.0 + 0.01 * (angle - 70.0) ** 2 + abs(1e6 * interference - 100.0) / 10.0)
        return Trial({"shroud.angle": angle, "contact.interference": interference}, height, 400.0)

    angles, places = (65.0, 70.0, 80.0), (60e-6, 90e-6, 110e-6, 140e-6)
    found = replace(
        result(optimum(1.0, 3.0)),
        ranges={"shroud.angle": (60.0, 80.0), "contact.interference": (70e-6, 130e-6)},
        values={"shroud.angle": 70.0, "contact.interference": 100e-6},
        amplitude_m=2e-6,
        robust=Robust(tolerance={"contact.interference": 10e-6}, key="contact.interference"),
        solved=tuple(trial(angle, place) for angle in angles for place in places),
        trials=tuple(replace(trial(angle, 100e-6), curves=4) for angle in angles),
        followed=None,
    )
    figure = optimum_figure(found, "blade")
    assert figure is not None
    left, upper, lower = figure.axes
    np.testing.assert_allclose(lines(left)["80 °"].get_xdata(), np.multiply(places, 1e6))
    np.testing.assert_allclose(lines(left)["80 °"].get_ydata(), [6.0, 3.0, 3.0, 6.0])
    assert lines(upper)["optimum, 70 °, 100 µm"].get_xydata()[0] == pytest.approx([70.0, 2.0])
    bars = [bar.get_segments()[0] for bar in lower.collections]
    np.testing.assert_allclose(bars, [[[angle, 90.0], [angle, 110.0]] for angle in angles])
    assert optimum_section(found).caption == LINES
    assert optimum_figure(replace(found, trials=()), "blade") is not None  # stopped in the first search


def test_derivatives_of_several_keys_are_in_the_table() -> None:
    joint: Any = SimpleNamespace(elasticities={"preload": 0.0, "friction": 0.25})
    rows = optimum_section(replace(result(optimum(1.0, 3.0)), followed=joint)).rows
    assert [(row[0], row[-1]) for row in rows] == [("contact.preload", "-"), ("contact.friction", "+0.250")]


def test_every_force_lies_on_one_performance_curve() -> None:
    """Points of other forces at the scene's slip limit, against the closed form at these forces."""
    ratio = np.geomspace(0.9, 30.0, 4001)
    texts = [np.full(len(ratio), text) for text in ("periodic", "followed", "main branch")]
    found = {"best_ratio": BEST, "least_compliance": math.pi, "best_frequency_hz": 0.2157, "kind": "smooth"}
    found |= {"within": (1.2, 2.2), "force": 2.0, "message": ""}
    curve = PerformanceCurve("preload", ratio, height(ratio), 0.2 + 0.01 * ratio, *texts, (), **found)
    figure = performance_figure(curve, "slider", own=(8.0, 2.0))
    left, right = figure.axes
    assert left.get_xscale() == left.get_yscale() == right.get_xscale() == "log"
    points = [line for line in left.get_lines() if line.get_marker() == "o"]
    assert len(points) == len(MULTIPLES)
    for line, multiple in zip(points, MULTIPLES, strict=True):
        force = 2.0 * multiple
        assert line.get_xydata()[0] == pytest.approx([8.0 / force, height(8.0, force) / force], rel=1e-5)
    assert lines(left)["the design: 2 N"].get_xydata()[0] == pytest.approx([4.0, height(4.0)], rel=1e-5)
    assert {text.get_text() for text in left.texts} == {"0.5 N", "1 N", "4 N", "8 N"}


def test_the_section_says_what_to_choose_and_what_it_gains() -> None:
    found = result(replace(optimum(1.0, 3.0), remarks=("5 values searched",)))
    section = optimum_section(replace(found, remarks=("5 values searched",)))
    choice, sharpness, searched = section.conclusion
    better = "9.5 % lower than with the scene's 1.2 N (3.473 m)"
    assert choice == f"Choose preload 1.571 N: worst motion (largest displacement) 3.142 m at 0.21571 Hz, {better}."
    assert sharpness.startswith("The minimum is smooth")
    assert sharpness.endswith("at most 10 % higher with preload from 1.21 to 2.24 N.")
    assert searched == "5 values searched."
    swept, *others = section.rows
    assert swept == ("contact.preload", "1.571 N", "1.2 N", "1 to 3 N", "1.21 to 2.24 N", "-")
    assert [(row[0], row[-1]) for row in others] == [
        ("contact.normal_stiffness", "−2.500"),
        ("excitation.force", "+1.000"),
    ]
    worse = replace(found, base=replace(found.base, amplitude_m=4.0 * math.pi, unresolved="too long"))
    assert "at least 4 times lower" in optimum_section(worse).conclusion[0]
    same = optimum_section(replace(found, base=replace(found.base, amplitude_m=1.001 * math.pi)))
    assert same.conclusion[0].endswith("the scene's 1.2 N is as good.")

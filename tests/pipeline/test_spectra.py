"""Diagrams of natural frequencies: the lines are those of the model, the engine orders where they belong."""

import json
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from pipeline_support import overlapping_texts, small_scene, write_scene

from pipeline.cli import command
from pipeline.errors import InputError
from pipeline.figures.campbell import campbell_figure, nodal_diameter_figure
from pipeline.figures.data import PlottedCurve, plotted_curves
from pipeline.figures.linear_limits import linear_limits
from pipeline.process.progress import Reporter
from pipeline.results.conclusion import modes_line
from pipeline.results.results import read_results
from pipeline.run import execute
from pipeline.scene.reading import read_scene
from pipeline.scene.schema import Scene
from pipeline.stages.engine_orders import excited_orders
from pipeline.stages.request import Request, RunOutcome
from rom.cyclic.resonance_crossings import excited_nodal_diameter

SPEEDS = [0.0, 4000.0, 8000.0]
COLOURS = {"free": "0.0", "sliding": "#0072B2", "stuck": "#D55E00"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("speeds")


@pytest.fixture(scope="module")
def outcome(folder: Path) -> RunOutcome:
    """The small blade at three speeds, run to its figures."""
    scene = write_scene(folder / "s.toml", small_scene(sweep={"load.speed_rpm": SPEEDS}))
    return execute(Request(read_scene(scene), folder / "out"), Reporter(quiet=True))


@pytest.fixture(scope="module")
def curves(outcome: RunOutcome) -> list[PlottedCurve]:
    return plotted_curves(outcome.curves)


def lines(axes: Axes, state: str) -> np.ndarray:
    """Heights of the lowest lines of one state of the shrouds, (4, points), ascending at each place."""
    found = [line.get_ydata() for line in axes.lines if line.get_color() == COLOURS[state]]
    points = max(len(line) for line in found)
    return np.sort([line for line in found if len(line) == points], axis=0)[:4]


def test_campbell_lines_are_the_frequencies_of_the_summary(outcome: RunOutcome, curves: list[PlottedCurve]) -> None:
    assert {"campbell", "nodal_diameters"} <= {Path(name).stem for name in outcome.pictures}
    figure = campbell_figure(curves, "title")
    axes = figure.axes[0]
    assert overlapping_texts(figure) == []
    for state in COLOURS:
        drawn = lines(axes, state)
        assert drawn.shape == (4, len(SPEEDS))
        for speed, model in enumerate(outcome.models):
            known = model["free_hz"] if state == "free" else model[f"{state}_hz"]["36"]
            assert drawn[:, speed] == pytest.approx(known[:4], rel=1e-9)
    assert np.all(np.diff(lines(axes, "free")[0]) > 0.0)  # rotation stiffens
    rays = {text.get_text() for text in axes.texts}
    assert "EO 36" in rays  # the excited engine order


def test_a_mode_has_one_frequency_wherever_it_stands(outcome: RunOutcome, curves: list[PlottedCurve]) -> None:
    """Table of modes, line of the run and limits of the figures, with the Coriolis forces of the response."""
    fastest, model = curves[-1], outcome.models[-1]
    assert model["coriolis_included"]
    (entry,) = outcome.summary["linear"]
    for limit in linear_limits([fastest]):
        known = model["free_hz"] if limit.kind == "free" else model["stuck_hz"]["36"]
        assert limit.resonance is not None
        assert limit.resonance[0] == pytest.approx(known[entry["mode"] - 1], rel=1e-12)
        assert entry[f"{limit.kind}_hz"][1] == pytest.approx(limit.resonance[0], rel=1e-12)
    at = str(entry["engine_order"])
    assert [entry["name"], entry["stuck_name"]] == [model[f"{s}_names"][at][0] for s in ("free", "stuck")]
    crossed = modes_line([entry | {"name": "1F", "stuck_name": "1E"}], (1.0, 1e5))
    assert crossed.startswith("mode 1: ")
    assert " Hz free (1F), " in crossed
    assert " Hz stuck (1E); both inside" in crossed


def test_campbell_crossings_lie_on_the_ray_and_on_the_frequencies(
    outcome: RunOutcome, curves: list[PlottedCurve]
) -> None:
    order = 36
    found = outcome.summary["campbell"]
    assert {entry["contact"] for entry in found} == {"free", "sliding", "stuck"}
    for entry in found:
        assert entry["frequency_hz"] == pytest.approx(order * entry["speed_rpm"] / 60.0, rel=1e-12)
        model = outcome.models[0]  # the crossings are below 4000 rev/min, where rotation changes little
        state = entry["contact"]
        at_rest = (model["free_hz"] if state == "free" else model[f"{state}_hz"]["36"])[entry["mode"] - 1]
        assert at_rest < entry["frequency_hz"] < 1.2 * at_rest
    figure = campbell_figure(curves, "title")
    assert figure is not None
    marks = sorted(tuple(point.get_offsets()[0]) for point in figure.axes[0].collections if len(point.get_offsets()))
    shown = [e for e in found if e["mode"] <= 4 and e["contact"] != "sliding"]
    expected = sorted((e["speed_rpm"], e["frequency_hz"]) for e in shown)
    np.testing.assert_allclose(np.array(marks), np.array(expected), rtol=1e-9)


def test_peaks_lie_between_the_limits_of_the_modes_that_are_crossed(outcome: RunOutcome) -> None:
    for curve, model in zip(outcome.summary["curves"], outcome.models, strict=True):
        inside = [each for each in model["crossings"] if each["range_distance"] == 0.0]
        peak = curve["peak_frequency_hz"]
        assert any(0.99 * each["free_hz"] <= peak <= 1.01 * each["stuck_hz"] for each in inside)
    still, turning = outcome.models[0]["crossings"], outcome.models[1]["crossings"]
    assert all(each["margin"] is None for each in still)
    order = 36 * SPEEDS[1] / 60.0  # 2400 Hz, above the range: its nearest mode is listed too
    nearest = min(turning, key=lambda each: abs(each["margin"]))
    limits = (nearest["free_hz"], nearest["stuck_hz"])
    side = 0 if limits[0] > order else 1
    expected = 0.0 if limits[0] <= order <= limits[1] else limits[side] / order - 1.0
    assert nearest["margin"] == pytest.approx(expected, abs=1e-12)


def test_multiples_of_the_engine_order_have_multiples_of_the_range() -> None:
    tables = small_scene(excitation__harmonic=[{"order": 3}, {"order": 2, "amplitude": 0.5}])
    scene = Scene.model_validate(tables)
    assert excited_orders(scene) == [(36, (300.0, 700.0)), (72, (600.0, 1400.0)), (108, (900.0, 2100.0))]
    assert excited_orders(scene, 5)[1] == (10, (600.0, 1400.0))


def test_two_speeds_make_no_campbell_diagram(curves: list[PlottedCurve]) -> None:
    assert campbell_figure(curves[:2], "title") is None


def test_nodal_diameters(curves: list[PlottedCurve]) -> None:
    axes = nodal_diameter_figure(curves[0], "title").axes[0]
    free, sliding, stuck = (lines(axes, state) for state in COLOURS)
    assert free.shape == stuck.shape == (4, 37)
    assert free == pytest.approx(
        np.repeat(free[:, :1], 37, axis=1), rel=1e-12
    )  # without contact no blade sees another
    assert np.all(sliding >= free * (1.0 - 1e-12))  # springs only raise frequencies
    assert np.all(stuck >= sliding * (1.0 - 1e-12))
    assert stuck[0, 36] > 1.1 * free[0, 36]


def test_results_draw_themselves(outcome: RunOutcome, folder: Path) -> None:
    results = read_results(folder / "out")
    assert len(results) == len(SPEEDS) == len(list(results))
    axes = results.plot(Figure().subplots(), unit="mm")
    assert len(axes.get_legend().get_texts()) == len(SPEEDS)
    own = results[1].plot(Figure().subplots(), unit="mm", color="red")
    drawn = np.concatenate([line.get_ydata() for line in own.lines[:-1]])
    assert drawn.max() == pytest.approx(1e3 * results[1].amplitude_m.max(), rel=1e-12)
    results[2].plot(own, unit="mm", label="the third")  # two curves on one axes: a legend with the name given
    assert [text.get_text() for text in own.get_legend().get_texts()][-1] == "the third"
    peaks = results.plot_peaks(ax=Figure().subplots(), unit="m")
    assert peaks.get_xlabel() == "speed [rev/min]"
    assert peaks.lines[0].get_xdata().tolist() == SPEEDS
    assert peaks.lines[0].get_ydata().tolist() == [curve.peak.amplitude_m for curve in results if curve.peak]
    with pytest.raises(InputError, match=r"over: 'contact.friction', allowed: load.speed_rpm"):
        results.plot_peaks("contact.friction")


def test_modes_before_the_response(outcome: RunOutcome, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`shroud modes` against the run of the same scene: frequencies of its models, static contact of its curves."""
    arguments = ["modes", str(folder / "s.toml"), "--out", str(folder / "out"), "--json"]
    assert command(arguments) == 0
    found = json.loads(capsys.readouterr().out)
    assert found == json.loads((folder / "out/modes/modes.json").read_text())
    assert found["campbell"] == outcome.summary["campbell"]
    for model, known, curve in zip(found["models"], outcome.models, outcome.curves, strict=True):
        (wave,), (static,) = model["waves"], model["static"]
        states = known["free_hz"], known["sliding_hz"]["36"], known["stuck_hz"]["36"]
        assert [mode["frequency_hz"] for mode in wave["modes"]] == [list(each) for each in zip(*states, strict=True)]
        assert wave["modes"][0]["names"] == ["1F"] * 3
        assert curve.facts is not None
        assert static["force_n"] == pytest.approx(curve.facts.static_force_n, rel=1e-9, abs=1e-12)
        low, high = model["proposed_hz"]
        free, _, stuck = wave["modes"][0]["frequency_hz"]
        assert low < free < stuck < high
        margin = wave["modes"][0]["margin"]
        assert (margin is None) == (model["speed_rpm"] == 0.0)
    assert {file.name for file in (folder / "out/modes").iterdir()} == {
        "modes.json",
        *(f"{name}.{kind}" for name in ("nodal_diameters", "campbell") for kind in ("png", "csv")),
    }


def test_run_until_reduce_prints_the_modes(
    outcome: RunOutcome, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command(["run", str(folder / "s.toml"), "--out", str(folder / "out"), "--until", "reduce"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert sum(line.startswith("mode  free [Hz]") for line in lines) == len(SPEEDS)
    assert any("resonance at [rev/min]" in line for line in lines)
    assert any(line.startswith("EO 36 meets mode 1 with stuck shrouds at") for line in lines)
    headings = " ".join(line for line in lines if "[" in line)
    for line in (line for line in lines if line.startswith(("resonance at: ", "margin: ", "open: "))):
        assert line.partition(":")[0] in headings, line


def test_engine_orders_fold_onto_nodal_diameters() -> None:
    assert [excited_nodal_diameter(order, 72) for order in (0, 4, 36, 37, 68, 72, 76, 108)] == [
        0,
        4,
        36,
        35,
        4,
        0,
        4,
        36,
    ]

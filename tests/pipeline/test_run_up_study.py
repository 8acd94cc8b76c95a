"""The study `run_up` of a scene: peaks of sweeps beside the steady ones, figure, page, careless values."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pipeline_support import (
    ground_scene,
    overlapping_texts,
    shroud,
    small_scene,
    summary_of,
    write_ground_model,
    write_scene,
)

from pipeline.codec import restored
from pipeline.results.results import read_results
from pipeline.studies.run_up.figure import run_up_figure
from pipeline.studies.run_up.result import RunUpResult

FREE = {"contact__interference": -1e-3, "response__frequency": [275.0, 360.0], "response__damping_ratio": 0.01}


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A free blade swept at r = 2 and 10."""
    folder = tmp_path_factory.mktemp("run_up")
    rates = [r * (0.01 * 313.3) ** 2 * 2.0 * np.pi for r in (2.0, 10.0)]
    path = write_scene(folder / "s.toml", small_scene(**FREE, run_up={"rate": rates, "direction": "up"}))
    status, said, error = shroud("run", path, "--out", folder / "out", "--until", "report")
    assert status == 0, error
    assert "% of the steady" in said
    return folder / "out"


def result_of(folder: Path) -> RunUpResult:
    result: RunUpResult = restored(RunUpResult, {"curves": read_results(folder).studies["run_up"]["curves"]})
    return result


def test_a_faster_sweep_shows_less_of_the_peak_and_later(done: Path) -> None:
    """Lewis, at a damping of 1 %, from 12 half bandwidths below to 15 above."""
    (curve,) = result_of(done).curves
    slow, fast = curve.sweeps
    assert [curve.share(slow), curve.share(fast)] == pytest.approx([0.82287, 0.57059], rel=0.03)
    assert [curve.lag_bands(slow), curve.lag_bands(fast)] == pytest.approx([2.052, 5.6], rel=0.1)
    assert np.all(slow.open_share == 1.0)
    assert slow.envelope_m.max() == slow.peak_m


def test_figure_and_page_show_the_sweeps(done: Path) -> None:
    assert (done / "figures" / "run_up.png").is_file()
    figure = run_up_figure(result_of(done), "title")
    assert figure is not None
    assert overlapping_texts(figure) == []
    text = (done / "report.html").read_text(encoding="utf-8")
    assert "Sweeps of the excitation" in text
    assert "Lowest beside its steady peak" in text
    assert summary_of(done)["problems"] == []


def test_a_gauge_reads_less_of_a_fast_sweep_too(tmp_path: Path) -> None:
    """Strain of a gauge: the same share of its steady amplitude as the tip where one mode moves."""
    gauge = {"name": "gauge", "at": [0.0, 0.0045, 0.33], "direction": "z", "quantity": "strain"}
    asked = {"rate": [10.0 * (0.01 * 313.3) ** 2 * 2.0 * np.pi], "direction": "up", "output": "gauge"}
    path = write_scene(tmp_path / "s.toml", small_scene(**FREE, output=[gauge], run_up=asked))
    status, said, error = shroud("run", path, "--out", tmp_path / "out", "--until", "study")
    assert status == 0, error
    assert "gauge" in said
    assert "µm/m" in said
    (curve,) = result_of(tmp_path / "out").curves
    assert curve.share(curve.sweeps[0]) == pytest.approx(0.57059, rel=0.03)


@pytest.mark.parametrize(
    ("section", "line"),
    [
        ({}, "run_up.speed_rate: missing, allowed: a list of 1 to 20 different num"),
        ({"rate": [1.0], "speed_rate": [2.0]}, "(give this or rate)"),
        ({"rate": [0.0]}, "run_up.rate[0]: 0.0, allowed: a list of 1 to 20"),
        ({"rate": [1.0, 1.0]}, "run_up.rate: [1.0, 1.0], allowed: a list of 1 to 20 different"),
        ({"rate": [1.0], "frequency": [100.0, 330.0]}, "run_up.frequency: [100.0, 330.0], allowed: two numbers"),
        ({"rate": [1.0], "output": "gauge"}, 'run_up.output: "gauge", allowed: the name of an [[output]]'),
        ({"rate": [1.0], "curves": [3]}, 'run_up.curves: [3], allowed: "all" or a list of numbers of curves, 0 to 0'),
    ],
)
def test_careless_values_get_one_line(tmp_path: Path, section: dict[str, Any], line: str) -> None:
    path = write_scene(tmp_path / "s.toml", small_scene(**FREE, run_up=section))
    status, _, error = shroud("validate", path)
    assert (status, len(error.strip().splitlines())) == (2, 1), error
    assert line in error


def test_probes_read_the_passages_of_the_tips(tmp_path: Path) -> None:
    """What four probes tell of the vibration is the envelope; a table has every passage."""
    probes = {"angles": [3.0, 74.0, 158.0, 251.0], "blades": 2, "resolution": 1e-9}
    rate = 0.05 * (0.01 * 313.3) ** 2 * 2.0 * np.pi  # in a revolution a tenth of half a bandwidth
    asked: dict[str, Any] = {"rate": [rate], "direction": "up", "frequency": [303.0, 326.0], "probes": probes}
    path = write_scene(tmp_path / "s.toml", small_scene(**FREE, run_up=asked))
    status, said, error = shroud("run", path, "--out", tmp_path / "out", "--until", "figures")
    assert status == 0, error
    assert "probes tell a vibration of" in said
    (curve,) = result_of(tmp_path / "out").curves
    (sweep,) = curve.sweeps
    assert sweep.read_m.max() == pytest.approx(sweep.peak_m, rel=0.02)
    assert sweep.read_hz[sweep.read_m.argmax()] == pytest.approx(sweep.peak_hz, rel=5e-3)
    rows = (tmp_path / "out" / "run_up.csv").read_text().splitlines()
    assert rows[0].split(",")[-1] == "displacement_m"
    assert len(rows) == sweep.passages + 1
    asked = {"rate": [2000.0], "direction": "up"}  # the table of before is gone
    path = write_scene(tmp_path / "s.toml", small_scene(**FREE, run_up=asked))
    assert shroud("run", path, "--out", tmp_path / "out", "--until", "study")[0] == 0
    assert not (tmp_path / "out" / "run_up.csv").exists()


@pytest.mark.parametrize(
    ("probes", "said"),
    [
        ({"angles": [0.0, 360.0]}, "different numbers"),
        ({"angles": [10.0], "blades": 73}, "blades: 73, allowed: 1 to 72"),
        ({"angles": [10.0], "noise": -1.0}, "noise: -1"),
    ],
)
def test_careless_probes(tmp_path: Path, probes: dict[str, Any], said: str) -> None:
    path = write_scene(tmp_path / "s.toml", small_scene(**FREE, run_up={"rate": [5.0], "probes": probes}))
    status, _, error = shroud("validate", path)
    assert status == 2
    assert said in error


@pytest.mark.parametrize("direction", ["x", "-y", [0.5, 1.0, 0.0]])
def test_probes_of_an_output_that_is_not_along_the_circumference_are_refused(tmp_path: Path, direction: Any) -> None:
    output = [{"name": "tip_moves", "at": "tip", "direction": direction}]
    asked: dict[str, Any] = {"rate": [5.0], "probes": {"angles": [0.0]}}
    for scene, key in (
        (small_scene(**FREE, run_up=asked, excitation__direction=direction), "excitation.direction"),
        (small_scene(**FREE, run_up={**asked, "output": "tip_moves"}, output=output), "run_up.output"),
    ):
        status, _, error = shroud("validate", write_scene(tmp_path / "s.toml", scene))
        assert (status, key in error, 'with direction = "y"' in error) == (2, True, True), error


def test_more_blades_than_a_model_from_elsewhere_has_are_told(tmp_path: Path) -> None:
    model = write_ground_model(tmp_path / "m.h5", force_centrifugal=np.zeros(12))
    probes = {"angles": [0.0], "blades": 2, "radius": 1.0}
    scene = {**ground_scene(), "load": {"speed_rpm": 0.001}, "run_up": {"rate": [1e-3], "probes": probes}}
    path = write_scene(tmp_path / "s.toml", scene)
    _, said, error = shroud("respond", path, "--out", tmp_path / "out", "--rom", model)
    assert "run_up.probes.blades = 2: the reduced model has 1" in said + error

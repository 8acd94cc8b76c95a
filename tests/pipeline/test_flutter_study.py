"""The study `flutter` in a run: cycles that friction holds, over the interference, files, figure, what is refused."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pipeline_support import overlapping_texts, shroud, small_scene, write_scene

from pipeline import run_scene
from pipeline.codec import plain, restored
from pipeline.results.results import Results
from pipeline.studies.flutter.figure import flutter_figure
from pipeline.studies.flutter.report import flutter_section
from pipeline.studies.flutter.result import FlutterResult
from pipeline.studies.flutter.study import FlutterStudy

N = 12


def scene(**section: Any) -> dict[str, Any]:
    """The small blade in a flow that feeds backward waves, pressed together and apart."""
    tables = small_scene()
    tables["blade"] = tables["blade"] | {"n_blades": N}
    tables["excitation"] = tables["excitation"] | {"engine_order": 3}
    tables["response"] |= {"harmonics": 1, "search": "off", "detached": False, "truncation": False}
    family = {"mode": 1, "offset": [-1, 0, 1], "real": [-0.04, 0.0, 0.04], "imaginary": [0.0, -0.005, 0.0]}
    tables["aero"] = {"family": [family]}
    tables["sweep"] = {"contact.interference": [-1e-3, 1e-5, 2e-5]}
    return tables | {"flutter": section}


IN_TIME = {"periods": 60, "in_time": [2], "disturbance": 0.8}


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Results]:
    folder = tmp_path_factory.mktemp("flutter")
    return folder, run_scene(scene(**IN_TIME), folder / "out")


@pytest.fixture(scope="module")
def result(done: tuple[Path, Results]) -> FlutterResult:
    values = json.loads((done[0] / "out" / "flutter.json").read_text())
    return restored(FlutterResult, {name: values[name] for name in ("mode", "curves")})


def test_friction_holds_waves_at_an_amplitude_proportional_to_the_interference(result: FlutterResult) -> None:
    _, small, large = result.curves
    held = [wave for wave in small.waves if wave.held is not None]
    assert held
    for wave, other in zip(small.waves, large.waves, strict=True):
        assert wave.damping_ratio == pytest.approx(other.damping_ratio, rel=1e-9)
        for one, two in zip(wave.cycles, other.cycles, strict=True):
            assert two.vibration_m == pytest.approx(2.0 * one.vibration_m, rel=1e-6)
            assert two.flow_j == pytest.approx(4.0 * one.flow_j, rel=1e-6)
            assert one.flow_j == pytest.approx(one.friction_j + one.damping_j, rel=1e-9)
            assert one.vibration_m > wave.linear_limit_m


def test_the_waves_are_those_that_flutter_in_the_table_of_modes(
    done: tuple[Path, Results], result: FlutterResult
) -> None:
    wide = result.curves[0]
    for wave in wide.waves:  # a gap: the damping of the pole, and that of a periodic motion fed by so much
        assert wave.free_damping_ratio == pytest.approx(wave.damping_ratio, abs=1e-4)
    assert min(wave.nodal_diameter for wave in wide.waves) > 0  # backward waves alone are fed
    assert np.all([wave.free_damping_ratio < 0.0 for wave in wide.waves])


def test_files_figure_and_report(done: tuple[Path, Results], result: FlutterResult) -> None:
    folder, run = done
    assert run.complete
    assert (folder / "out" / "figures" / "limit_cycles.png").is_file()
    assert plain(run.studies["flutter"])["curves"] == plain(result)["curves"]
    said = FlutterStudy().lines(result)
    assert len(said) == 4
    assert said[3].startswith(f"flutter in time, {result.curves[2].label}: ")
    assert "held by friction" in said[1]
    figure = flutter_figure(result, "title")
    assert figure is not None
    assert not overlapping_texts(figure)
    section = flutter_section(result)
    assert len(section.headings) == len(section.rows[0])
    assert any(text.startswith("In time") for text in section.conclusion)
    table = (folder / "out" / "figures" / "limit_cycles.csv").read_text()
    assert "amplitude of the wave" in table


def test_the_ring_in_time_grows_as_the_table_of_waves_says(result: FlutterResult) -> None:
    curve = result.curves[2]
    ring = curve.ring
    assert ring is not None
    assert [each.ring for each in result.curves[:2]] == [None, None]
    assert len(ring.amplitude_m) == len(ring.nodal_diameter) == N
    fastest = min(curve.waves, key=lambda wave: wave.damping_ratio)
    assert ring.frequency_hz == pytest.approx(fastest.frequency_hz, rel=1e-4)
    row = ring.amplitude_m[ring.nodal_diameter.index(fastest.nodal_diameter)]
    rate = np.log(row[2] / row[0]) / (2.0 * np.pi * (ring.periods[2] - ring.periods[0]))
    assert rate == pytest.approx(-fastest.damping_ratio, rel=0.05)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"aero": None}, "flutter: given without [aero], allowed: with [aero], the flow that feeds the motion"),
        ({"flutter": {"nodal_diameters": [1, 1]}}, "flutter.nodal_diameters: [1, 1], allowed: "),
        ({"flutter": {"curves": [3]}}, 'flutter.curves: [3], allowed: "all" or a list of numbers of curves, 0 to 2'),
        ({"flutter": {"mode": 0}}, "flutter.mode: 0, allowed: a whole number, 1 to 1000"),
        (
            {"flutter": {"in_time": [1]}},
            "flutter.in_time: given without flutter.periods, allowed: with flutter.periods",
        ),
        (
            {"flutter": {"periods": 9, "curves": [0], "in_time": [1]}},
            "flutter.in_time: [1], allowed: numbers of curves of flutter.curves, 0 to 0",
        ),
        ({"flutter": {"nodal_diameters": [7]}}, "flutter.nodal_diameters: [7], allowed: -5 to 6, waves of 12 blades"),
    ],
)
def test_what_does_not_fit_is_said_in_a_line(tmp_path: Path, change: dict[str, Any], said: str) -> None:
    tables = {name: value for name, value in (scene() | change).items() if value is not None}
    status, _, error = shroud("validate", write_scene(tmp_path / "s.toml", tables))
    assert status == 2
    assert said in error

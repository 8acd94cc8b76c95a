"""`pipeline` from Python: run a scene, read its results back, draw a curve; cheap until it is used."""

import csv
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from matplotlib import pyplot as plt
from pipeline_support import ground_scene, shroud, small_scene, write_ground_model, write_scene

import pipeline
from pipeline import InputError, plot_curve, read_results, read_scene, run_scene
from rom import inter_blade_phase


def test_results_are_those_of_the_files(finished: Path) -> None:
    results = read_results(finished)
    assert results.complete
    assert results.problems == ()
    assert [curve.parameters["contact.interference"] for curve in results.curves] == [1e-5, 1e-3]
    with (finished / "response.csv").open() as file:
        rows = list(csv.DictReader(file))
    for index, curve in enumerate(results.curves):
        mine = [row for row in rows if row["curve"] == str(index) and row["branch"] == "0"]
        np.testing.assert_array_equal(curve.frequency_hz, [float(row["frequency_hz"]) for row in mine])
        np.testing.assert_array_equal(curve.amplitude_m, [float(row["amplitude_m"]) for row in mine])
        np.testing.assert_array_equal(curve.datasets["static_m"], [float(row["static_m"]) for row in mine])
        np.testing.assert_array_equal(curve.stable, [row["stable"] == "1" for row in mine])
        assert curve.complete
        assert curve.peak is not None
        assert curve.peak.amplitude_m == curve.amplitude_m[curve.peak.index]
        assert curve.peak.frequency_hz == curve.frequency_hz[curve.peak.index]
        assert curve.rom is not None
        assert curve.rom.is_file()


def test_a_scene_run_from_python_is_the_one_of_the_command_line(tmp_path: Path) -> None:
    scene, rom = write_scene(tmp_path / "g.toml", ground_scene()), write_ground_model(tmp_path / "g.h5")
    results = run_scene(scene, tmp_path / "python", rom=rom)
    again = run_scene(read_scene(str(scene), given_model=True), tmp_path / "python", rom=str(rom))
    assert shroud("respond", scene, "--rom", rom, "--out", tmp_path / "command", "--quiet")[0] == 0
    command = read_results(tmp_path / "command")
    for other in (again, command):
        np.testing.assert_array_equal(other.curves[0].amplitude_m, results.curves[0].amplitude_m)
    assert again.summary["stages"]["respond"]["status"] == "reused"


def test_a_curve_that_could_not_be_solved_says_why(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = write_scene(tmp_path / "g.toml", ground_scene() | {"sweep": {"contact.friction": [0.1, 0.2]}})
    file = read_scene(scene, given_model=True)

    def lost(folder: Path, rom: Path, scene: object, parameters: dict[str, float], *_: object) -> None:
        raise ArithmeticError(f"lost at {parameters['contact.friction']}")

    monkeypatch.setattr("pipeline.stages.curve.respond.solve_curve", lost)
    results = run_scene(file, tmp_path / "out", rom=write_ground_model(tmp_path / "g.h5"))
    curve = results.curves[1]
    assert not results.complete
    assert (curve.complete, curve.reason, curve.peak, curve.harmonics) == (False, "lost at 0.2", None, 0)
    assert curve.frequency_hz.size == curve.stable.size == 0
    assert curve.detached == curve.bifurcations == ()
    assert "incomplete: lost at 0.2" in repr(curve)


def test_what_is_no_result_is_refused_in_one_line(tmp_path: Path, finished: Path) -> None:
    cases = {"absent": None, "text": "no JSON", "list": "[]", "other": '{"complete": true}'}
    for name, text in cases.items():
        (folder := tmp_path / name).mkdir()
        if text is not None:
            (folder / "summary.json").write_text(text)
        with pytest.raises(InputError, match=f"{name}.*allowed: the output folder of a run") as caught:
            read_results(folder)
        assert "\n" not in str(caught.value)
    (tmp_path / "absent" / "summary.json").write_bytes((finished / "summary.json").read_bytes())
    with pytest.raises(InputError, match=r"holds no response\.h5"):
        read_results(tmp_path / "absent")


def test_files_of_two_runs_are_not_taken_for_one(tmp_path: Path, finished: Path) -> None:
    for name in ("summary.json", "response.h5"):
        (tmp_path / name).write_bytes((finished / name).read_bytes())
    assert len(read_results(tmp_path).curves) == 2
    with h5py.File(tmp_path / "response.h5", "r+") as file:
        file["curve/0/amplitude_m"][0] += 1.0
    with pytest.raises(InputError, match=r"summary\.json and response\.h5 are not of one run"):
        read_results(tmp_path)


def test_bad_input_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "s.toml", small_scene(shroud__angle=300.0))
    with pytest.raises(InputError, match=r"shroud\.angle: 300"):
        run_scene(scene, tmp_path / "out")
    with pytest.raises(InputError, match=r"until: .*mesh, assemble"):
        run_scene(scene, tmp_path / "out", until="everything")
    assert not (tmp_path / "out").exists()


def test_a_curve_is_drawn_dashed_where_it_is_unstable(finished: Path) -> None:
    curve = read_results(finished).curves[0]
    stable = curve.stable.copy()
    stable[3:6] = False
    datasets = {**curve.datasets, "stable": stable}
    shown = replace(curve, datasets=datasets)
    with pipeline.styled():
        figure, axes = plt.subplots()
        plot_curve(axes, shown, label="one", unit="mm")
        with pytest.raises(ValueError, match="unit = 'inch'"):
            plot_curve(axes, shown, unit="inch")
        *pieces, dot = axes.lines
        plt.close(figure)
    drawn = [line for line in pieces if len(np.asarray(line.get_xdata()))]  # the line of the legend has no points
    assert [line.get_linestyle() for line in drawn] == ["-", "--", "-"]
    assert len({line.get_color() for line in axes.lines}) == 1
    assert [line.get_label() for line in pieces].count("one") == 1
    assert curve.peak is not None
    np.testing.assert_allclose(dot.get_ydata(), [1e3 * curve.peak.amplitude_m])


def test_the_inter_blade_phase() -> None:
    assert inter_blade_phase(3, 12) == inter_blade_phase(15, 12) == pytest.approx(np.pi / 2)
    assert inter_blade_phase(3, None) == 0.0


def test_every_public_name_is_there_and_costs_nothing_until_it_is_used() -> None:
    for name in pipeline.__all__:
        assert getattr(pipeline, name) is not None
        assert name in dir(pipeline)
    with pytest.raises(AttributeError, match="no attribute 'run_everything'"):
        getattr(pipeline, "run_" + "everything")
    code = "import sys, pipeline; print(sorted({name.partition('.')[0] for name in sys.modules}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"numpy", "pydantic", "matplotlib", "h5py", "rich"}.intersection(done.stdout.split("'"))

"""Stress on the mesh as a stage of a run: files, summary, report, what is refused and what is said."""

import csv
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5py
import numpy as np
import pytest
import pyvista
from PIL import Image
from pipeline_support import (
    overlapping_texts,
    shroud,
    small_scene,
    statuses,
    summary_of,
    without_lines,
    write_scene,
)

from pipeline import read_results
from pipeline.results.stress import stress_lines, stress_warning, with_prefix
from pipeline.scene.material_section import Fatigue
from pipeline.stress.field_pictures import round_top
from pipeline.stress.haigh import LOWER, haigh_figure, margin_figure
from pipeline.stress.operating_stress import operating_point, write_vtu
from rom.stress.stress_recovery import von_mises

SWEEP = {"contact.interference": [1e-5, 1e-3]}
LIMITS = {"endurance_limit": 300e6, "tensile_strength": 900e6, "yield_strength": 700e6, "factor": 1.5}


@pytest.fixture(scope="module")
def stressed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Output folder of a run at speed with stress and limits, and its report."""
    folder = tmp_path_factory.mktemp("stressed")
    assert run(folder, "report")[0] == 0
    return folder / "out"


def run(folder: Path, until: str = "stresses", **changes: Any) -> tuple[int, str, str]:
    asked: dict[str, Any] = {"stress": {"hot_spots": 3, "curves": [1]}, "fatigue": LIMITS, "load__speed_rpm": 3000.0}
    values = asked | {"excitation__force": 5.0, "sweep": SWEEP}
    scene = write_scene(folder / "s.toml", small_scene(**(values | changes)))
    return shroud("run", scene, "--out", folder / "out", "--quiet", "--until", until)


def test_fields_and_summary_are_those_of_the_solved_point(stressed: Path) -> None:
    assert statuses(stressed)["stresses"] == "ran"
    (entry,) = summary_of(stressed)["stress"]
    assert (entry["curve"], entry["file"], entry["motion"]) == (1, "stress/stress_1.vtu", "periodic")
    assert entry == read_results(stressed).stress[0]
    mesh = pyvista.read(stressed / entry["file"])
    fields = {name: np.asarray(mesh.point_data[name]) for name in mesh.point_data}
    one = fields["stress_1_real_pa"] + 1j * fields["stress_1_imag_pa"]
    static = fields["stress_0_pa"]
    np.testing.assert_allclose(fields["von_mises_static_pa"], von_mises(static), rtol=1e-9)
    # the amplitude of one harmonic: half of the largest distance of two opposite instants
    angles = np.linspace(0.0, np.pi, 181)
    sizes = np.array([von_mises(np.real(one * np.exp(1j * angle))) for angle in angles])
    np.testing.assert_allclose(fields["von_mises_amplitude_pa"], sizes.max(axis=0), rtol=1e-3)
    regular = fields["singular"] < 0
    assert entry["largest_amplitude_pa"] == pytest.approx(fields["von_mises_amplitude_pa"][regular].max())
    inverse = fields["von_mises_amplitude_pa"] / 300e6 + np.maximum(fields["mean_stress_pa"], 0.0) / 900e6
    plastic = (fields["von_mises_amplitude_pa"] + np.abs(fields["mean_stress_pa"])) / 700e6
    np.testing.assert_allclose(fields["margin"], np.minimum(1.0 / np.maximum(inverse, plastic), 1e6), rtol=1e-9)
    assert entry["least_margin"] == pytest.approx(fields["margin"][regular].min())
    assert entry["least_amplitude_margin"] == pytest.approx(fields["amplitude_margin"][regular].min())
    for spots, singular in ((entry["hot_spots"], False), (entry["singular_spots"], True)):
        assert 0 < len(spots) <= 3
        for spot in spots:
            at = np.argmin(np.linalg.norm(mesh.points - spot["position_m"], axis=1))
            assert spot["amplitude_pa"] == pytest.approx(fields["von_mises_amplitude_pa"][at])
            assert (spot["singular"] is not None) == singular
            assert spot["amplitude_margin"] >= spot["margin"]
    assert [spot["margin"] for spot in entry["hot_spots"]] == sorted(spot["margin"] for spot in entry["hot_spots"])


def test_the_haigh_diagram_has_the_places_their_margins_and_the_line_of_the_required_factor(stressed: Path) -> None:
    """Against 1 / (Sa / Se + Sm / Su) and the yield line, written out; hot spots are those of the summary."""
    (entry,) = summary_of(stressed)["stress"]
    assert "stress/haigh_1.png" in entry["pictures"]
    lines = (stressed / "stress" / "haigh_1.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0].startswith("# redraw: shroud run ")
    rows = list(csv.DictReader(lines[1:]))
    mean, amplitude = ([float(row[name]) for row in rows] for name in ("mean stress [MPa]", "stress amplitude [MPa]"))
    used = [max(a / 300 + max(m, 0.0) / 900, (a + abs(m)) / 700) for a, m in zip(amplitude, mean, strict=True)]
    places = [k for k, row in enumerate(rows) if row["margin (required 1.5)"]]
    assert len(places) > 50
    assert [1.0 / used[k] for k in places] == pytest.approx([float(rows[k]["margin (required 1.5)"]) for k in places])
    at_limit = [1.0 / used[k] for k, row in enumerate(rows) if row["series"] == "required factor 1.5"]
    assert at_limit == pytest.approx([1.5] * len(at_limit))
    numbered = sorted({row["series"] for row in rows if row["series"][0].isdigit()})
    assert len(numbered) == len(entry["hot_spots"])
    for number, spot in enumerate(entry["hot_spots"]):
        k = next(k for k, row in enumerate(rows) if row["series"] == numbered[number])
        assert (amplitude[k], mean[k]) == pytest.approx((spot["amplitude_pa"] / 1e6, spot["mean_pa"] / 1e6))
    cycles = np.array([[1e6 * mean[k], 1e6 * amplitude[k], 1.0 / used[k], 0.0] for k in places])
    limits = Fatigue(endurance_limit=300e6, tensile_strength=900e6, yield_strength=700e6, factor=1.5)
    assert overlapping_texts(haigh_figure(entry, cycles, limits, "title")) == []


def test_a_margin_that_may_be_lower_is_marked(stressed: Path) -> None:
    (entry,) = summary_of(stressed)["stress"]
    members: Any = [SimpleNamespace(index=k, parameters={"contact.interference": 1e-5 * k}) for k in (0, 1)]
    figure = margin_figure([entry | {"curve": 0}, entry], members, {0: "C0", 1: "C1"}, "title", unsure=[1])
    assert figure is not None
    series = {str(line.get_label()): list(line.get_xdata()) for line in figure.axes[0].lines}
    assert series[f"_{LOWER}"] == [10.0]
    assert overlapping_texts(figure) == []


def test_the_displacement_of_the_tip_is_that_of_the_curve(stressed: Path) -> None:
    (entry,) = summary_of(stressed)["stress"]
    mesh = pyvista.read(stressed / entry["file"])
    tip = np.argmin(np.linalg.norm(mesh.points - (0.0, 0.0, 0.45), axis=1))
    with h5py.File(stressed / "response.h5") as file:
        curve = file["curve/1"]
        index = int(curve.attrs["worst_index"])
        output = curve["output"][index]
        assert entry["frequency_hz"] == curve["frequency_hz"][index]
    moved = mesh.point_data["displacement_1_real_m"][tip, 1] + 1j * mesh.point_data["displacement_1_imag_m"][tip, 1]
    assert moved == pytest.approx(output[1], rel=1e-3)
    assert mesh.point_data["displacement_0_m"][tip, 1] == pytest.approx(output[0].real, rel=1e-6)
    assert entry["model_error"] < 0.01
    assert entry["expansion_error"] < 0.1


def test_page_and_picture_show_the_stress(stressed: Path) -> None:
    text = (stressed / "report.html").read_text(encoding="utf-8")
    section = text.partition('<section id="stress">')[2].partition("</section>")[0]
    assert "clamped edge" in section
    assert "Singular places" in section
    assert section.count("data:image/jpeg") == 1
    assert "stress/stress_1.png" in summary_of(stressed)["pictures"]
    with Image.open(stressed / "stress" / "stress_1.png") as picture:
        assert len(np.unique(np.asarray(picture).reshape(-1, 3), axis=0)) > 200


def test_a_second_run_reuses_the_stress(stressed: Path) -> None:
    before = summary_of(stressed)["stress"]
    assert run(stressed.parent)[0] == 0
    assert statuses(stressed)["stresses"] == "reused"
    assert summary_of(stressed)["stress"] == before


def test_numbers_beside_the_colours_of_a_stress_are_round() -> None:
    """4.57, 9.15, 13.7 ... MPa stood there; the end is at most a quarter above the largest value."""
    for largest in np.geomspace(0.013, 8e3, 97):
        top = round_top(float(largest))
        assert largest * (1.0 - 1e-9) <= top <= 1.34 * largest
        assert float(f"{top / 4.0:.2g}") == pytest.approx(top / 4.0, rel=1e-12)


def test_what_is_said_of_a_margin_and_of_its_errors(stressed: Path) -> None:
    entries = summary_of(stressed)["stress"]
    line, errors = stress_lines(entries, ())
    unstable, _ = stress_lines(entries, [entries[0]["curve"]])
    spot = entries[0]["hot_spots"][0]  # all that is said of it is of one place
    assert spot["margin"] == pytest.approx(entries[0]["least_margin"], rel=1e-12)
    place = ", ".join(f"{1e3 * x:.1f}" for x in spot["position_m"])
    parts = f"amplitude {with_prefix(spot['amplitude_pa'])}, mean {with_prefix(spot['mean_pa'])}"
    assert f"hot spot 1 at x, y, z = {place} mm: {parts}, margin {spot['margin']:.3g}, the least" in line
    assert unstable == line.replace(": stress", ": the blades leave this motion, stress", 1)
    assert "reduced against full model" in errors
    assert stress_warning(entries) == ""
    entries[0]["required_margin"] = 90.0
    assert "below the required 90 (curve 1)" in stress_warning(entries)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"stress": {"curves": [2]}},
            'stress.curves: [2], allowed: true, false, "all" or a list of numbers of curves, 0 to 1',
        ),
        ({"fatigue": {"endurance_limit": 3e8}}, "fatigue.tensile_strength: missing, allowed: a number above 0"),
        (
            {"fatigue": {"endurance_limit": 3e8, "tensile_strength": 2e8}},
            "fatigue.endurance_limit: 300000000.0, allo",
        ),
        (
            {"fatigue": {"endurance_limit": 3e8, "tensile_strength": 9e8, "yield_strength": {"soft": 1e9}}},
            "fatigue.yield_strength.soft: 1000000000.0, allowed: a number above 0",
        ),
        ({"fatigue": LIMITS | {"factor": 0.0}}, "fatigue.factor: 0.0, allowed: a number, 0.1 to 100"),
        ({"stress": {"hot_spot": 3}}, "stress.hot_spot: unknown key, did you mean stress.hot_spots?"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_line(tmp_path: Path, changes: dict[str, Any], said: str) -> None:
    scene = write_scene(tmp_path / "s.toml", small_scene(sweep=SWEEP, **changes))
    status, _, error = shroud("validate", scene)
    assert status == 2
    assert without_lines(error).startswith(f"{scene}: {said}")
    assert error.count("\n") == 1


def written_curve(path: Path, **attributes: Any) -> h5py.File:
    """A curve of two points with a detached branch of three."""
    file = h5py.File(path, "w")
    for name, count, start in ((".", 2, 100.0), ("branch/1", 3, 200.0)):
        group = file.require_group(name) if name != "." else file
        group["frequency_hz"] = start + np.arange(count)
        group["amplitude_m"] = np.full(count, 1e-3)
        group["contact_force"] = np.full((count, 2, 1, 3), start, dtype=complex)
    file.attrs.update({"peak_index": 1, "worst_branch": -1, "worst_index": -1, "worst_motion": ""} | attributes)
    return file


def test_the_point_is_the_worst_motion_or_the_peak_where_that_is_not_known(tmp_path: Path) -> None:
    with written_curve(tmp_path / "a.h5") as file:
        point = operating_point(file)
        assert point is not None
        assert (point.frequency_hz, point.motion, len(point.notes)) == (101.0, "peak", 1)
    worst = {"worst_branch": 1, "worst_index": 2, "worst_motion": "periodic", "worst_amplitude_m": 1e-3}
    with written_curve(tmp_path / "b.h5", **worst) as file:
        point = operating_point(file)
        assert point is not None
        assert (point.frequency_hz, point.branch, point.notes) == (202.0, 1, [])
        assert point.contact_force[0, 0, 0] == 200.0
    with written_curve(
        tmp_path / "c.h5", **worst | {"worst_motion": "quasi-periodic", "worst_amplitude_m": 1.5e-3}
    ) as f:
        point = operating_point(f)
        assert point is not None
        assert "by the factor 1.5" in point.notes[0]
    with written_curve(tmp_path / "d.h5", peak_index=-1) as file:
        assert operating_point(file) is None


def test_a_vtu_file_is_read_by_vtk_as_it_was_written(tmp_path: Path) -> None:
    points = np.random.default_rng(0).normal(size=(12, 3))
    cells = [(12, np.arange(8)[None]), (10, np.array([[8, 9, 10, 11], [0, 1, 2, 8]]))]
    fields = {"a": points[:, 0].copy(), "b <6>": np.arange(72.0).reshape(12, 6), "whole": np.arange(12)}
    write_vtu(tmp_path / "x.vtu", points, cells, fields)
    read = pyvista.read(tmp_path / "x.vtu")
    np.testing.assert_array_equal(read.points, points)
    assert read.celltypes.tolist() == [12, 10, 10]
    assert read.get_cell(2).point_ids == [0, 1, 2, 8]
    for name, values in fields.items():
        np.testing.assert_array_equal(read.point_data[name], values)
    assert json.dumps(read.array_names) == json.dumps(list(fields))

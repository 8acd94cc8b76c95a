"""Exports, read back by the libraries of their formats."""

import importlib.util
import json
from pathlib import Path
from typing import Any

import h5py
import meshio
import numpy as np
import pytest
import pyuff
import pyvista as pv
from pipeline_support import ground_scene, shroud, small_scene, write_ground_model, write_scene
from scipy.io import loadmat

from rom import natural_frequencies, read_reduced_model


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Output folder of two curves of the small blade, three harmonics."""
    folder = tmp_path_factory.mktemp("export")
    sweep = {"contact.interference": [-1e-5, 1e-5]}  # a scene with renders: a model with its basis
    file = write_scene(folder / "s.toml", small_scene(response__harmonics=3, sweep=sweep, render={"modes": [1]}))
    status, _, error = shroud("run", file, "--out", folder / "out", "--until", "respond", "--quiet")
    assert status == 0, error
    return folder / "out"


def model_of(out: Path) -> tuple[Path, Path]:
    """Reduced model and mesh.vtu of the run."""
    found = json.loads((out / "summary.json").read_text())["models"][0]
    return out / found["rom"], (out / found["mesh"]).with_suffix(".vtu")


def written(source: Path, target: Path, *options: object) -> str:
    status, said, error = shroud("export", source, "--to", target, *options)
    assert (status, error) == (0, "")
    assert said.startswith(f"{target}: ")
    assert [file for file in target.parent.iterdir() if file.name.startswith(".")] == []
    return said


def test_response_as_matlab_file(ran: Path, tmp_path: Path) -> None:
    target = tmp_path / "new" / "r.mat"
    assert "2 curves" in written(ran / "response.h5", target)
    curves = loadmat(target, simplify_cells=True)["curve"]
    with h5py.File(ran / "response.h5") as file:
        for index, curve in enumerate(curves):
            group = file[f"curve/{index}"]
            assert curve["name"] == str(index)
            for name in ("frequency_hz", "amplitude_m", "output", "contact_force"):
                assert np.array_equal(curve[name], group[name][()])
            assert curve["parameter"]["contact_interference"] == group.attrs["contact.interference"]
            assert curve["parameter"]["excitation_engine_order"] == group.attrs["excitation.engine_order"]


def test_reduced_model_as_matlab_file(ran: Path, tmp_path: Path) -> None:
    rom, _ = model_of(ran)
    written(rom, tmp_path / "m.mat")
    found, model = loadmat(tmp_path / "m.mat", simplify_cells=True), read_reduced_model(rom)
    for name in ("mass", "stiffness", "contact_right", "contact_left", "force_excitation", "basis"):
        assert np.array_equal(found[name], getattr(model, name))
    assert np.array_equal(found["outputs"]["tip"], model.outputs["tip"])
    assert found["n_blades"] == model.n_blades


def test_response_functions_as_universal_file(ran: Path, tmp_path: Path) -> None:
    target = tmp_path / "r.uff"
    assert "6 response functions" in written(ran / "response.h5", target)
    sets = pyuff.UFF(str(target)).read_sets()
    assert {item["type"] for item in sets} == {58}
    with h5py.File(ran / "response.h5") as file:
        for number, item in enumerate(sets):
            curve, harmonic = divmod(number, 3)
            group = file[f"curve/{curve}"]
            assert item["x"] == pytest.approx(group["frequency_hz"][()], rel=5e-6)  # six digits, as the format has
            expected = group["output"][:, harmonic + 1] / group.attrs["excitation.force"]
            assert item["data"] == pytest.approx(expected, rel=1e-11, abs=1e-11 * np.abs(expected).max())
            assert item["id1"].strip() == f"curve {curve}, harmonic {harmonic + 1}"
            assert (item["abscissa_axis_units_lab"].strip(), item["ordinate_axis_units_lab"].strip()) == ("Hz", "m")


def test_shapes_on_the_mesh(ran: Path, tmp_path: Path) -> None:
    rom, mesh = model_of(ran)
    written(rom, tmp_path / "s.vtu", "--mesh", mesh)
    found, model = meshio.read(tmp_path / "s.vtu"), read_reduced_model(rom)
    frequency = natural_frequencies(model, 0.0, count=10)
    assert list(found.point_data) == [f"mode_{k + 1:02d}_{hz:.4g}_Hz" for k, hz in enumerate(frequency)]
    first = next(iter(found.point_data.values()))
    assert first.shape == found.points.shape
    clamped = np.abs(found.points[:, 2] - found.points[:, 2].min()) < 1e-9
    tip = np.linalg.norm(first, axis=1).argmax()
    assert np.abs(first[clamped]).max() == 0.0
    assert found.points[tip, 2] > 0.9 * found.points[:, 2].max()
    assert np.abs(first[tip]).argmax() == 1  # first bending is circumferential


def test_the_motion_at_a_peak_on_the_mesh_and_on_the_ring(ran: Path, tmp_path: Path) -> None:
    """The output at the tip has the amplitude of the peak; a sector moves as its neighbour, later."""
    said = written(ran, tmp_path / "m.vtu", "--curve", 1)
    with h5py.File(ran / "response.h5") as file:
        curve = file["curve/1"]
        peak = int(curve.attrs["peak_index"])
        output, hertz = curve["output"][peak], curve["frequency_hz"][peak]
        order = int(curve.attrs["excitation.engine_order"])
    assert f"motion at the peak of curve 1, {hertz:.6g} Hz" in said
    found = meshio.read(tmp_path / "m.vtu")
    tip = np.linalg.norm(found.point_data["displacement_1_real_m"], axis=1).argmax()
    moved = found.point_data["displacement_1_real_m"] + 1j * found.point_data["displacement_1_imag_m"]
    assert np.abs(moved[tip]).max() == pytest.approx(abs(output[1]), rel=0.2)
    said = written(ran, tmp_path / "ring.pvd", "--curve", 1)
    assert "the ring of 72 blades at 24 instants of a period" in said
    frames = sorted(tmp_path.glob("ring_*.vtp"))
    assert len(frames) == 24
    assert (tmp_path / "ring.pvd").read_text().count(".vtp") == 24
    ring = pv.read(frames[0])
    of_sector = ring.n_points // 72
    first, second = np.split(ring.point_data["displacement"][: 2 * of_sector], 2)
    later = pv.read(frames[round(24 * order / 72) % 24]).point_data["displacement"][:of_sector]
    assert np.linalg.norm(second, axis=1) == pytest.approx(np.linalg.norm(later, axis=1), rel=1e-6, abs=1e-12)
    assert np.abs(first).max() > 0.0
    assert shroud("export", ran, "--to", tmp_path / "m.vtu", "--curve", 7)[0] == 2
    written(ran, tmp_path / "mode.pvd", "--mode", 2)


@pytest.mark.parametrize("suffix", [".vtu", ".mat"])
def test_the_output_folder_stands_for_its_files(ran: Path, tmp_path: Path, suffix: str) -> None:
    rom, mesh = model_of(ran)
    own = (rom, ["--mesh", mesh]) if suffix == ".vtu" else (ran / "response.h5", [])
    said = written(own[0], tmp_path / f"a{suffix}", *own[1])
    assert written(ran, tmp_path / f"b{suffix}").partition(": ")[2] == said.partition(": ")[2]
    if suffix == ".vtu":  # .mat has the time in its head
        assert (tmp_path / "a.vtu").read_bytes() == (tmp_path / "b.vtu").read_bytes()


def test_a_folder_that_is_no_output_folder(ran: Path, tmp_path: Path) -> None:
    for command in (["export", tmp_path, "--to", tmp_path / "r.mat"], ["info", tmp_path]):
        status, said, error = shroud(*command)
        assert (status, said) == (2, "")
        assert error == f"{tmp_path}: holds no summary.json, allowed: the output folder of a run, with summary.json\n"
    (tmp_path / "summary.json").write_text("{")
    assert shroud("info", tmp_path)[0] == 2
    (tmp_path / "summary.json").write_text('{"models": [], "curves": []}')
    assert shroud("export", tmp_path, "--to", tmp_path / "r.vtu")[0] == 2
    assert shroud("export", tmp_path, "--to", tmp_path / "r.mat")[0] == 2
    assert [file.name for file in tmp_path.iterdir()] == ["summary.json"]


def test_info_on_an_output_folder(ran: Path) -> None:
    status, said, error = shroud("info", ran)
    assert (status, error) == (0, "")
    first = said.splitlines()[0]
    assert first == f"{ran}: run, complete; reduced models: 1; curves: 2"
    of_response = shroud("info", ran / "response.h5")[1]
    points = [text[text.index("Points and errors") :].split("\n\n")[0] for text in (said, of_response)]
    assert points[0] == points[1]
    found = json.loads(shroud("info", ran, "--json")[1])
    assert found["kind"] == "run"
    of_run = {"contact", "free_blade_m"}  # stand in summary.json alone
    curves = [{key: value for key, value in curve.items() if key not in of_run} for curve in found["curves"]]
    assert curves == json.loads(shroud("info", ran / "response.h5", "--json")[1])["curves"]


def test_ground_model_without_a_basis(tmp_path: Path) -> None:
    rom = write_ground_model(tmp_path / "g.h5")
    scene = write_scene(tmp_path / "g.toml", ground_scene())
    assert shroud("respond", scene, "--rom", rom, "--out", tmp_path / "out", "--quiet")[0] == 0
    written(tmp_path / "out" / "response.h5", tmp_path / "g.uff")
    written(rom, tmp_path / "g.mat")
    assert "basis" not in loadmat(tmp_path / "g.mat")


@pytest.mark.parametrize(
    ("source", "target", "options", "word"),
    [
        ("response.h5", "r.xyz", [], ".mat, .uff, .unv, .vtu"),
        ("response.h5", "r.vtu", [], "reduced model"),
        ("rom", "r.uff", [], "response.h5"),
        ("rom", "r.vtu", [], "--mesh"),
        ("rom", "r.vtu", ["--mesh", "nowhere.vtu"], "nowhere.vtu"),
        ("ground", "r.vtu", ["--mesh", "mesh"], "basis: missing"),
        ("nowhere.h5", "r.mat", [], "no such file"),
        ("summary.json", "r.mat", [], "cannot be read"),
    ],
)
def test_what_does_not_go_together(
    ran: Path, tmp_path: Path, source: str, target: str, options: list[Any], word: str
) -> None:
    rom, mesh = model_of(ran)
    path = rom if source == "rom" else ran / source
    if source == "ground":
        path = write_ground_model(ran.parent / "ground.h5")
    options = [mesh if option == "mesh" else option for option in options]
    status, said, error = shroud("export", path, "--to", tmp_path / target, *options)
    assert (status, said) == (2, "")
    assert error.count("\n") == 1
    assert word in error
    assert list(tmp_path.iterdir()) == []


def test_a_damaged_response(ran: Path, tmp_path: Path) -> None:
    content = (ran / "response.h5").read_bytes()
    for length in (100, len(content) // 2, len(content) - 200):
        damaged = tmp_path / "damaged.h5"
        damaged.write_bytes(content[:length])
        status, _, error = shroud("export", damaged, "--to", tmp_path / "d.mat")
        assert status == 2
        assert error.count("\n") == 1
        assert not (tmp_path / "d.mat").exists()


def test_without_the_package_for_universal_files(ran: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "pyuff" else found(name))
    status, _, error = shroud("export", ran / "response.h5", "--to", tmp_path / "r.uff")
    assert status == 2
    assert "shroud[uff]" in error
    assert list(tmp_path.iterdir()) == []


def test_a_target_that_cannot_be_written(ran: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    status, _, error = shroud("export", ran / "response.h5", "--to", tmp_path / "file" / "r.mat")
    assert status == 2
    assert error.count("\n") == 1
    assert (tmp_path / "file").read_text() == "in the way"

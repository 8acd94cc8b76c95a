"""Scenes with [model]: matrices of another program from files to the response, without a mesh of ours."""

import json
import os
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pipeline_support import shroud, write_scene
from scipy.io import loadmat, mmread, mmwrite, savemat

from rom import (
    BoundaryChoice,
    Material,
    ReducedModel,
    ReductionOptions,
    assemble,
    natural_frequencies,
    read_reduced_model,
    reduce_sector,
    write_reduced_model,
)
from rom.matrix_files.matrix_choice import MatrixChoice
from rom.matrix_files.matrix_model import model_from_matrices

sys.path.append(str(Path(__file__).parents[1] / "rom"))
import calculix
from matrix_tables import stocky_sector, store_matrices, write_nodes

pytestmark = pytest.mark.xdist_group("matrices")
STEEL = Material(2e11, 0.3, 7800.0)
NODAL = BoundaryChoice(contact_dofs="nodal")
MODES = 8


def matrix_scene(**model: Any) -> dict[str, Any]:
    return {
        "name": "matrices",
        "model": {"stiffness": "K.mtx", "mass": "M.mtx", "nodes": "nodes.csv", "n_blades": 40, **model},
        "rom": {"modes": MODES},
        "contact": {
            "normal_stiffness": 2e7,
            "tangential_stiffness": 1.5e7,
            "friction": 0.3,
            "interference": 5e-7,
        },
        "excitation": {"engine_order": 8, "force": 10.0},
        "response": {
            "frequency": [1700.0, 2600.0],
            "damping_ratio": 0.01,
            "stability": "folds",
            "detached": False,
            "truncation": False,
        },
    }


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Stiffness and mass of a blade with clamped nodes among the rows, its nodes, and its own reduced model."""
    place = tmp_path_factory.mktemp("matrices")
    sector = stocky_sector()
    full = assemble(sector, STEEL, "hex8")
    mmwrite(place / "K.mtx", full.stiffness, symmetry="symmetric", precision=17)
    mmwrite(place / "M.mtx", full.mass, symmetry="symmetric", precision=17)
    write_nodes(place / "nodes.csv", sector.points, sector, sector.node_sets["root"])
    write_reduced_model(place / "own.h5", reduce_sector(full, sector, ReductionOptions(MODES), NODAL).model)
    return place


@pytest.fixture(scope="module")
def ran(folder: Path) -> Path:
    """Output folder of the scene."""
    scene = write_scene(folder / "s.toml", matrix_scene())
    status, _, error = shroud("run", scene, "--out", folder / "out", "--quiet")
    assert (status, error) == (0, "")
    return folder / "out"


def curve(out: Path) -> np.ndarray:
    """Frequency and amplitude of the points of the only curve."""
    table = np.genfromtxt(out / "response.csv", delimiter=",", names=True)
    return np.column_stack([table["frequency_hz"], table["amplitude_m"]])


def test_response_is_that_of_the_assembled_model(folder: Path, ran: Path) -> None:
    scene = matrix_scene()
    scene.pop("model")
    given = write_scene(folder / "given.toml", scene)
    status, _, error = shroud("respond", given, "--rom", folder / "own.h5", "--out", folder / "own", "--quiet")
    assert (status, error) == (0, "")
    ours, theirs = curve(folder / "own"), curve(ran)
    assert ours.shape == theirs.shape
    assert np.allclose(theirs, ours, rtol=1e-9)


@pytest.mark.skipif(calculix.PROGRAM is None, reason="CalculiX is not installed: no ccx on PATH")
def test_response_from_the_matrices_of_calculix_is_that_of_our_elements(tmp_path: Path) -> None:
    """The whole chain without our elements, friction and partial lift-off included: 1e-8 of the peak."""
    sector = stocky_sector()
    mesh = calculix.quadratic_mesh(sector)
    store_matrices(tmp_path, mesh, STEEL)
    write_nodes(tmp_path / "nodes.csv", mesh.points, sector, mesh.clamped)
    scene = matrix_scene(stiffness="blade.sti", mass="blade.mas")
    status, _, error = shroud("run", write_scene(tmp_path / "s.toml", scene), "--out", tmp_path / "out", "--quiet")
    assert (status, error) == (0, "")
    own = reduce_sector(assemble(sector, STEEL, "hex20"), sector, ReductionOptions(MODES), NODAL).model
    write_reduced_model(tmp_path / "own.h5", own)
    scene.pop("model")
    given = write_scene(tmp_path / "given.toml", scene)
    shroud("respond", given, "--rom", tmp_path / "own.h5", "--out", tmp_path / "own", "--quiet")
    ours, theirs = curve(tmp_path / "own"), curve(tmp_path / "out")
    assert ours.shape == theirs.shape
    assert len(ours) > 20
    assert np.abs(theirs[:, 0] / ours[:, 0] - 1.0).max() < 1e-8
    assert np.abs(theirs[:, 1] - ours[:, 1]).max() < 1e-8 * ours[:, 1].max()
    table = np.genfromtxt(tmp_path / "out" / "response.csv", delimiter=",", names=True)
    assert table["slipping"].max() > 0
    assert table["separating"].max() == 6


def test_files_and_results_are_kept_by_content(folder: Path, ran: Path) -> None:
    """The same files under other names: nothing runs again. Another stiffness: everything does."""
    summary = json.loads((ran / "summary.json").read_text())
    assert summary["stages"]["mesh"]["status"] == "skipped"
    assert summary["stages"]["reduce"]["status"] == "ran"
    model = summary["models"][0]
    assert model["mesh"] is None
    assert any("pairs of nodes" in note for note in model["notes"])
    (folder / "again.mtx").write_bytes((folder / "K.mtx").read_bytes())
    scene = write_scene(folder / "s.toml", matrix_scene(stiffness="again.mtx"))
    shroud("run", scene, "--out", folder / "out", "--quiet")
    stages = json.loads((ran / "summary.json").read_text())["stages"]
    assert {stages[name]["status"] for name in ("reduce", "respond")} == {"reused"}
    mmwrite(folder / "again.mtx", 1.0001 * mmread(folder / "K.mtx"), symmetry="symmetric", precision=17)
    shroud("run", scene, "--out", folder / "out", "--until", "reduce", "--quiet")
    assert json.loads((ran / "summary.json").read_text())["stages"]["reduce"]["status"] == "ran"
    write_scene(folder / "s.toml", matrix_scene())
    shroud("run", folder / "s.toml", "--out", folder / "out", "--quiet")


def test_report_without_a_mesh_and_renders_skipped_with_one_line(folder: Path, ran: Path) -> None:
    scene = matrix_scene()
    scene["render"] = {"modes": [1]}
    file = write_scene(folder / "drawn.toml", scene)
    status, _, error = shroud("report", file, "--out", folder / "out")
    assert status == 0, error
    assert "render: skipped" in error
    page = (ran / "report.html").read_text()
    assert "matrices of another program" in page
    assert "K.mtx" in page
    assert "6 pairs of nodes" in page
    status, _, error = shroud("run", file, "--until", "render", "--out", folder / "out", "--quiet")
    assert status == 2
    assert error.count("\n") == 1
    assert "no elements" in error
    status, _, error = shroud("verify", file, "--out", folder / "out", "--quiet")
    assert (status, error.count("\n")) == (2, 1)


def test_superelement_from_a_scene(folder: Path, ran: Path) -> None:
    """The reduced matrices of the run and their basis, exported, come back as a superelement."""
    rom = ran / json.loads((ran / "summary.json").read_text())["models"][0]["rom"]
    model = read_reduced_model(rom)
    if model.basis is None:
        write_reduced_model(folder / "with_basis.h5", _with_basis(folder))
        rom = folder / "with_basis.h5"
    status, _, error = shroud("export", rom, "--to", folder / "r.mat", "--format", "mat-7.3")
    assert (status, error) == (0, "")
    count = len(read_reduced_model(rom).basis) // 3
    (folder / "d.csv").write_text(
        "node,component\n" + "\n".join(f"{node},{axis}" for node in range(1, count + 1) for axis in (1, 2, 3))
    )
    files = {"stiffness": "r.mat", "mass": "r.mat", "transformation": "r.mat", "dofs": "d.csv", "reduced": True}
    scene = write_scene(folder / "super.toml", matrix_scene(**files))
    status, _, error = shroud("run", scene, "--out", folder / "super", "--until", "reduce", "--quiet")
    assert (status, error) == (0, "")
    ours, theirs = (json.loads((out / "summary.json").read_text())["models"][0] for out in (ran, folder / "super"))
    for name in ("free_hz", "sliding_hz", "stuck_hz"):
        expected = ours[name] if name == "free_hz" else ours[name]["8"]
        assert np.allclose(theirs[name] if name == "free_hz" else theirs[name]["8"], expected, rtol=1e-9)


def _with_basis(folder: Path) -> ReducedModel:
    found = model_from_matrices(MatrixChoice(folder / "K.mtx", folder / "M.mtx", folder / "nodes.csv", 40))
    return reduce_sector(found.full, found.sector, ReductionOptions(MODES), NODAL).model


@pytest.mark.parametrize(("target", "options"), [("r.op4", ()), ("r.mtx", ()), ("r.mtx", ("--format", "abaqus"))])
def test_export_of_the_reduced_matrices(ran: Path, tmp_path: Path, target: str, options: tuple[str, ...]) -> None:
    rom = ran / json.loads((ran / "summary.json").read_text())["models"][0]["rom"]
    model = read_reduced_model(rom, with_basis=False)
    status, said, error = shroud("export", rom, "--to", tmp_path / target, *options)
    assert (status, error) == (0, "")
    assert f"{model.size} coordinates" in said
    if target == "r.op4":
        from pyyeti.nastran import op4

        found = op4.load(str(tmp_path / target))
        assert np.array_equal(found["k"][0], model.stiffness)
        assert np.array_equal(found["m"][0], model.mass)
        assert np.array_equal(found["cright"][0], model.contact_right)
    elif options:
        files = sorted(file.name for file in tmp_path.iterdir())
        assert files == ["r_mass.mtx", "r_stiffness.mtx"]
        table = np.loadtxt(tmp_path / "r_stiffness.mtx", delimiter=",", skiprows=2)
        assert len(table) == np.count_nonzero(np.tril(model.stiffness))
    else:
        assert np.array_equal(mmread(tmp_path / "r_mass.mtx").toarray(), model.mass)
        assert np.array_equal(mmread(tmp_path / "r_contact_left.mtx").toarray(), model.contact_left)


def test_export_refuses_what_does_not_fit(ran: Path, tmp_path: Path) -> None:
    for source, target, options, said in (
        (ran / "response.h5", "r.op4", (), "a response"),
        (ran / "response.h5", "r.mat", ("--format", "abaqus"), "mat-7.3"),
        (ran / "response.h5", "r.vtu", ("--format", "op4"), "--format"),
    ):
        status, _, error = shroud("export", source, "--to", tmp_path / target, *options)
        assert (status, error.count("\n")) == (2, 1), error
        assert said in error
        assert list(tmp_path.iterdir()) == []


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "no such file": ({"model__mass": "N.mtx"}, 'model.mass: ".*N.mtx": no such file, did you mean'),
    "a zero byte": ({"model__mass": "M\x00.mtx"}, "model.mass: "),
    "a long name": ({"model__mass": 300 * "m" + ".mtx"}, "model.mass: "),
    "a folder": ({"model__stiffness": "."}, "model.stiffness: .*not a file"),
    "no nodes": ({"model__nodes": None}, "model.nodes: missing"),
    "unknown key": ({"model__massen": "M.mtx"}, "unknown key, did you mean model.mass"),
    "unknown set": ({"model__sets": {"hub": "a"}}, "model.sets.hub: unknown key"),
    "set that is not there": ({"model__sets": {"root": "hub"}}, "nodes.csv: no node is in the set hub"),
    "unit": ({"model__unit": "cm"}, 'model.unit: "cm", allowed: "m", "mm" or "in"'),
    "blades": ({"model__n_blades": 43}, "model.sets.contact_left: .*43 blades"),
    "beside a mesh": ({"mesh__size": 0.01}, r"mesh: given beside \[model\]"),
    "averages": ({"rom__contact_dofs": "mortar"}, 'rom.contact_dofs: "mortar", allowed: "nodal"'),
    "another speed": ({"load__speed_rpm": 3000.0}, "load.speed_rpm: 3000.0, allowed: 0, the speed that the stiff"),
    "equilibrium": ({"load__equilibrium": "linear"}, "load.equilibrium: .*without elements"),
    "transformation": ({"model__transformation": "K.mtx"}, "model.transformation: .*nothing without reduced"),
    "list for other nodes": ({"contact__friction": [0.3, 0.4]}, "contact.friction: a list of 2, allowed: .* 6"),
    "punch": ({"contact__normal_stiffness": "punch"}, r"needs \[material\]"),
    "no dofs of a superelement": ({"model__reduced": True}, "coordinates without dofs"),
    "mass and stiffness in one file": (
        {"model__mass": "both.mat", "model__mass_name": "Mred"},
        "has no matrix 'Mred', ",
    ),
    "pressure": ({"load__pressure": [{"surface": "face_right", "pressure": 1e5}]}, "load.surface: .*has no elements"),
    "loads of a superelement": (
        {"model__reduced": True, "load__force": [{"set": "tip", "force": 1.0, "direction": "y"}]},
        "load.force: loads or outputs on nodes, allowed: nothing with model.reduced",
    ),
    "hostile": ({"model__stiffness": "hostile.mat"}, "hostile.mat: "),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_scene_that_does_not_fit_is_refused_with_one_line(folder: Path, tmp_path: Path, case: str) -> None:
    changes, said = REFUSED[case]
    for file in folder.iterdir():
        if file.is_file():
            os.link(file, tmp_path / file.name)
    scene = matrix_scene()
    for dotted, value in changes.items():
        section, key = dotted.split("__")
        scene.setdefault(section, {})[key] = value
        if value is None:
            del scene[section][key]
    if "both" in str(changes):
        savemat(tmp_path / "both.mat", {"Kff": np.eye(3), "Mff": np.eye(3)})
    (tmp_path / "hostile.mat").write_bytes(b"\x89HDF\r\n\x1a\n" + os.urandom(4000))
    status, _, error = shroud("run", write_scene(tmp_path / "case.toml", scene), "--out", tmp_path / "o", "--quiet")
    assert status == 2, error
    assert error.count("\n") == 1, error
    assert ", allowed: " in error or "no such file" in error
    assert re.search(said, error), error


def test_validate_reads_the_table_of_nodes(folder: Path, tmp_path: Path) -> None:
    """A table without contact sets makes no model: the scene is not valid."""
    for name in ("K.mtx", "M.mtx"):
        os.link(folder / name, tmp_path / name)
    table = (folder / "nodes.csv").read_text()
    path = write_scene(tmp_path / "s.toml", matrix_scene())
    (tmp_path / "nodes.csv").write_text(table)
    assert shroud("validate", path)[0] == 0
    (tmp_path / "nodes.csv").write_text(table.replace("contact_right", "").replace("contact_left", ""))
    status, said, error = shroud("validate", path)
    assert (status, said, error.count("\n")) == (2, "", 1)
    assert "nodes.csv: no node is in the set contact_right, allowed: " in error


def test_frequencies_are_those_of_the_full_matrices(folder: Path, ran: Path) -> None:
    """Stuck and free natural frequencies in the summary against the matrices themselves."""
    from scipy.sparse.linalg import eigsh

    summary = json.loads((ran / "summary.json").read_text())["models"][0]
    sector = stocky_sector()
    held = np.concatenate([3 * sector.node_sets["root"] + k for k in range(3)])
    k, m = (mmread(folder / name).tocsr() for name in ("K.mtx", "M.mtx"))
    free = np.setdiff1d(np.arange(k.shape[0]), held)
    squared = eigsh(k[free][:, free], 5, m[free][:, free], sigma=0.0, return_eigenvectors=False)
    assert np.allclose(summary["free_hz"][:2], np.sort(np.sqrt(squared))[:2] / (2 * np.pi), rtol=5e-4)
    assert natural_frequencies(read_reduced_model(ran / summary["rom"]), 0.0)[0] == pytest.approx(
        summary["free_hz"][0]
    )


def test_a_force_on_a_set_of_the_table_of_nodes(folder: Path, tmp_path: Path) -> None:
    """On the set of the tip it is the force at the tip; with another set the model is another one."""
    models = []
    for name in ("", "tip", "contact_left"):
        scene = matrix_scene()
        if name:
            scene["excitation"]["load"] = [{"set": name, "direction": "y"}]
        for file in ("K.mtx", "M.mtx", "nodes.csv"):
            if not (tmp_path / file).exists():
                os.link(folder / file, tmp_path / file)
        out = tmp_path / f"out_{name}"
        file = write_scene(tmp_path / "loads.toml", scene)
        status, _, error = shroud("run", file, "--out", out, "--until", "reduce", "--quiet")
        assert (status, error) == (0, "")
        model = read_reduced_model(out / json.loads((out / "summary.json").read_text())["models"][0]["rom"])
        models.append(model.outputs["tip_y"] @ np.linalg.solve(model.stiffness, model.force_excitation))
    assert models[1] == pytest.approx(models[0], rel=1e-9)
    assert abs(models[2] / models[0] - 1.0) > 1e-3


def test_a_sweep_over_files(folder: Path, tmp_path: Path) -> None:
    """Several blades in one scene: the file of the stiffness is swept."""
    for name in ("K.mtx", "M.mtx", "nodes.csv"):
        os.link(folder / name, tmp_path / name)
    mmwrite(tmp_path / "stiff.mtx", 1.21 * mmread(folder / "K.mtx"), symmetry="symmetric", precision=17)
    scene = matrix_scene()
    del scene["model"]["stiffness"]
    scene["sweep"] = {"model.stiffness": ["K.mtx", "stiff.mtx"]}
    file = write_scene(tmp_path / "sweep.toml", scene)
    status, _, error = shroud("run", file, "--out", tmp_path / "out", "--until", "reduce", "--quiet")
    assert (status, error) == (0, "")
    first, second = json.loads((tmp_path / "out" / "summary.json").read_text())["models"]
    assert second["free_hz"][0] / first["free_hz"][0] == pytest.approx(1.1, rel=1e-9)


def test_matlab_export_of_the_whole_model_stays_as_it_was(ran: Path, tmp_path: Path) -> None:
    rom = ran / json.loads((ran / "summary.json").read_text())["models"][0]["rom"]
    status, _, _ = shroud("export", rom, "--to", tmp_path / "r.mat")
    assert status == 0
    assert np.array_equal(loadmat(tmp_path / "r.mat")["stiffness"], read_reduced_model(rom).stiffness)

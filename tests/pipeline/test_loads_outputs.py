"""Loads, harmonics of the excitation and outputs of a scene, from the file to the results."""

import csv
import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from pipeline_support import ground_scene, shroud, small_scene, write_ground_model, write_scene
from scipy.sparse.linalg import spsolve

from pipeline import InputError, read_scene
from pipeline.stages.model.build_reduced_model import at_speed
from pipeline.stages.model.scene_loads import scene_loads
from pipeline.stages.scene_to_solver import excitation, solver_options
from rom import Material, RomParameterError, assemble, modal_model, read_reduced_model
from rom.files.sector_file import load_sector
from rom.finite_elements.loads import pressure_force, thermal_force

LOADS = {
    "load__force": [{"set": "tip_surface", "direction": "x", "force": 3.0}, {"at": "tip", "direction": [0, 0, 1]}],
    "load__pressure": [{"surface": "pressure_side", "pressure": 2e4}],
    "load__temperature": {"uniform": 220.0},
    "material__expansion": 12e-6,
    "excitation__force": 0.5,
    "excitation__harmonic": [{"order": 2, "amplitude": 0.3, "phase": 40.0}],
    "excitation__load": [
        {"surface": "suction_side", "amplitude": 50.0},
        {"at": [0.0, 0.0, 0.4], "direction": "x", "phase": 90.0},
        {"mode": 2, "amplitude": 0.1, "harmonic": 3},
    ],
    "output": [
        {"name": "mid", "at": [0.0, 0.0, 0.38], "direction": "magnitude"},
        {"name": "gauge", "at": [0.0, 0.0045, 0.33], "direction": "z", "quantity": "strain"},
        {"name": "top", "set": "tip_surface", "direction": "y"},
        {"name": "tip_x"},
    ],
    "response__harmonics": 3,
    "response__stability": "wave",
    "response__detached": False,
    "response__truncation": False,
    "response__search": "off",
    "response__frequency": [400.0, 450.0],
    "contact__integration": "exact",
}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("loads")
    scene = write_scene(folder / "scene.toml", small_scene(**LOADS))
    status, said, error = shroud("run", scene, "--out", folder / "out", "--until", "report")
    assert status == 0, (said, error)
    return scene, folder / "out"


def summary(out: Path) -> Any:
    return json.loads((out / "summary.json").read_text(encoding="utf-8"))


def model_of(out: Path) -> Any:
    return read_reduced_model(out / summary(out)["models"][0]["rom"])


def test_the_static_response_is_that_of_the_full_model(run: tuple[Path, Path]) -> None:
    """Forces on a set and a point, pressure and temperature together: from the mesh, with free contacts."""
    scene, out = run
    model = model_of(out)
    sector = load_sector(_sector(out, scene))
    steel = Material(210e9, 0.3, 7850.0, expansion=12e-6)
    full = assemble(sector, steel, element="hex8")
    force = pressure_force(full, sector, sector.surfaces["pressure_side"], 2e4)
    force += thermal_force(full, sector, steel, 200.0)
    top = full.vertex_node[sector.node_sets["tip_surface"]]
    np.add.at(force, 3 * top, 3.0 / len(top))
    force[3 * full.vertex_node[sector.node_sets["tip"][0]] + 2] += 1.0
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    motion = np.zeros(full.n_dofs)
    motion[free] = spsolve(full.stiffness[free][:, free].tocsc(), force[free])
    q = np.linalg.solve(model.stiffness, model.force_static)
    exact = motion.reshape(-1, 3)[top, 1].mean()
    assert model.outputs["top"] @ q == pytest.approx(exact, rel=1e-7)
    mid = full.vertex_node[np.argmin(np.linalg.norm(sector.points - [0.0, 0.0, 0.38], axis=1))]
    found = [model.outputs[f"mid_{axis}"] @ q for axis in "xyz"]
    np.testing.assert_allclose(found, motion.reshape(-1, 3)[mid], atol=1e-8 * np.abs(motion).max())
    assert model.outputs["gauge"] @ q == pytest.approx(12e-6 * 200.0, rel=0.3)  # thermal strain first of all


def _sector(out: Path, scene: Path) -> Path:
    from geometry import build_sector
    from pipeline.scene.geometry_parameters import geometry_parameters
    from rom.files.sector_file import save_sector

    path = out / "again.h5"
    save_sector(path, build_sector(**geometry_parameters(read_scene(scene).first)))
    return path


def test_excitation_on_a_surface_a_point_and_a_mode(run: tuple[Path, Path]) -> None:
    _, out = run
    model = model_of(out)
    assert np.iscomplexobj(model.force_excitation)  # the force at the point is a quarter of a period ahead
    assert list(model.force_harmonics) == [3]
    modal = modal_model(model, damping_ratio=0.01)
    forces = np.abs(modal.harmonic_forces[3])
    assert forces[1] == pytest.approx(0.1, rel=1e-6)
    assert np.delete(forces, 1).max() < 1e-9
    # pressure of 50 Pa on the whole flank, towards -y, by what it does to a rigid motion of the shroud and airfoil
    assert abs(modal.force[0].real) > 0.0


def test_every_harmonic_and_output_is_in_the_files(run: tuple[Path, Path]) -> None:
    _, out = run
    with h5py.File(out / "response.h5") as file:
        curve = file["curve/0"]
        points = len(curve["frequency_hz"])
        assert curve["output_mid"].shape == (points, 4, 3)
        assert curve["output_gauge"].shape == (points, 4)
        np.testing.assert_array_equal(curve["output_tip_x"][:, 0].imag, 0.0)
        assert json.loads(curve.attrs["excitation.harmonic"]) == [{"order": 2, "amplitude": 0.3, "phase": 40.0}]
        harmonics = np.array([curve[f"harmonic_{h}_m"][()] for h in (1, 2, 3)])
        assert (harmonics.max(axis=1) > 0.0).all()
        theta = 2.0 * np.pi * np.arange(4000) / 4000
        at = int(np.argmax(curve["amplitude_mid"][()]))
        dense = (np.exp(1j * np.outer(theta, np.arange(4))) @ curve["output_mid"][at]).real
        largest = np.linalg.norm(dense, axis=1).max()
        assert curve["amplitude_mid"][at] == pytest.approx(largest, rel=1e-5)
        energy = curve["energy_error"][()].max()
    assert energy < 1e-9
    with (out / "response.csv").open(encoding="utf-8") as text:
        rows = list(csv.DictReader(text))
    assert list(rows[0])[-5:] == ["amplitude_mid", "amplitude_gauge", "amplitude_top", "amplitude_tip_x", "branch"]
    found = {item["name"]: item for item in summary(out)["curves"][0]["outputs"]}
    assert found["mid"]["peak_amplitude"] == pytest.approx(largest, rel=1e-5)
    assert (found["gauge"]["unit"], found["top"]["unit"]) == ("1", "m")
    assert (out / "figures" / "outputs.png").is_file()


def test_the_report_says_loads_and_outputs(run: tuple[Path, Path]) -> None:
    _, out = run
    page = (out / "report.html").read_text(encoding="utf-8")
    for text in ("engine order 72", "0.3 of it, phase 40°", "20000 Pa on pressure_side", "mode 2", "µm/m at"):
        assert text in page, text


def test_results_in_python_have_the_outputs(run: tuple[Path, Path]) -> None:
    from pipeline.results.results import read_results

    _, out = run
    results = read_results(out)
    curve = results.curves[0]
    peaks = {item["name"]: item["peak_amplitude"] for item in summary(out)["curves"][0]["outputs"]}
    assert curve.datasets["amplitude_gauge"].max() == pytest.approx(peaks["gauge"])
    assert [item["name"] for item in curve.outputs] == ["mid", "gauge", "top", "tip_x"]


def test_a_scene_with_one_force_keeps_its_keys_and_files(tmp_path: Path) -> None:
    """Nothing new in the solver's input of a plain scene."""
    scene = read_scene(write_scene(tmp_path / "scene.toml", small_scene())).first
    assert excitation(scene).harmonics == ()
    assert solver_options(scene).outputs == ()
    from geometry import SectorMesh

    assert scene_loads(scene, SectorMesh.__new__(SectorMesh), None) is None


@pytest.mark.parametrize("equilibrium", ["nonlinear", "linear"])
def test_gas_loads_are_part_of_the_equilibrium_in_rotation(tmp_path: Path, equilibrium: str) -> None:
    """f_int(u) = W^2 (f_0 + M_yz u) + f at 9000 rpm; what superposition leaves out is of second order in f."""
    from rom.finite_elements.assembly import ElasticBody
    from rom.finite_elements.discretisation import discretise
    from rom.finite_elements.rotation import centrifugal_displacement
    from rom.units import angular_speed

    steel = Material(210e9, 0.3, 7850.0)
    squared, motions = angular_speed(9000.0) ** 2, {}
    for pressure in (0.0, 1e6, 2e6):
        loads = [{"surface": "pressure_side", "pressure": pressure}] if pressure else []
        changes = {"load__speed_rpm": 9000.0, "load__equilibrium": equilibrium, "load__pressure": loads}
        path = write_scene(tmp_path / "scene.toml", small_scene(**changes))
        scene, sector = read_scene(path).first, load_sector(_sector(tmp_path, path))
        full = assemble(sector, steel, element="hex8")
        motions[pressure] = squared * centrifugal_displacement(at_speed(full, sector, scene, steel))
    if equilibrium == "nonlinear":
        internal, _ = ElasticBody.of(discretise(sector, "hex8"), steel).internal_force(motions[2e6])
        arm = motions[2e6].reshape(-1, 3) * (0.0, 1.0, 1.0)
        gas = pressure_force(full, sector, sector.surfaces["pressure_side"], 2e6)
        external = squared * (full.centrifugal + full.mass @ arm.ravel()) + gas
        free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
        assert np.abs((external - internal)[free]).max() < 1e-7 * np.abs(external).max()
    one, two = (motions[pressure] - motions[0.0] for pressure in (1e6, 2e6))
    deviation = np.abs(two - 2.0 * one).max() / np.abs(two).max()
    assert deviation < 0.02
    assert np.abs(two).max() > 1e-4


def forces_file(path: Path, header: str, *rows: str) -> Path:
    path.write_text("\n".join((header, *rows)) + "\n", encoding="utf-8")
    return path


def test_forces_and_temperatures_from_files(tmp_path: Path) -> None:
    """Complex forces by position and by number, temperatures over the height: as vectors on the mesh."""
    forces_file(tmp_path / "wave.csv", "x,y,z,fy_re,fy_im", "0,0,0.45,1.0,2.0")
    forces_file(tmp_path / "gas.csv", "node,fx", "0,4.0")
    forces_file(tmp_path / "heat.csv", "x,y,z,temperature", "0,0,0.3,20.0", "0,0,0.45,120.0")
    scene_file = write_scene(
        tmp_path / "scene.toml",
        small_scene(
            excitation__load=[{"file": "wave.csv", "amplitude": 2.0}],
            load__force=[{"file": "gas.csv"}],
            load__temperature={"file": "heat.csv", "reference": 20.0},
            material__expansion=1e-5,
        ),
    )
    scene = read_scene(scene_file).first
    sector = load_sector(_sector(tmp_path, scene_file))
    steel = Material(210e9, 0.3, 7850.0, expansion=1e-5)
    full = assemble(sector, steel, element="hex8")
    loads = scene_loads(scene, sector, steel)
    assert loads is not None
    vectors = loads(full)
    tip = full.vertex_node[sector.node_sets["tip"][0]]
    assert vectors.excitation[1][3 * tip + 1] == pytest.approx(2.0 + 4.0j)
    assert np.count_nonzero(vectors.excitation[1]) == 1
    assert vectors.static is not None
    heat = np.where(sector.points[:, 2] > 0.375, 100.0, 0.0)
    gas = np.zeros(full.n_dofs)
    gas[3 * full.vertex_node[0]] = 4.0
    near = np.abs(sector.points[:, 2] - 0.375) < 1e-3
    assert not near.any()
    np.testing.assert_allclose(vectors.static, thermal_force(full, sector, steel, heat) + gas, atol=1e-6)


def test_harmonics_on_a_given_model(tmp_path: Path) -> None:
    """A model from elsewhere with a force of its own in harmonic 2: `shroud respond --rom`."""
    force = np.zeros(12)
    force[10] = 0.2
    rom = write_ground_model(tmp_path / "rom.h5", force_harmonics={2: force})
    scene = ground_scene()
    scene["excitation"]["harmonic"] = [{"order": 3, "amplitude": 0.1}]
    scene["output"] = [{"name": "tip"}]
    quick = {"detached": False, "stability": "wave", "truncation": False, "search": "off"}
    scene["response"] |= {"harmonics": 3, **quick}
    path = write_scene(tmp_path / "scene.toml", scene)
    status, said, error = shroud("respond", path, "--rom", rom, "--out", tmp_path / "out")
    assert status == 0, (said, error)
    with h5py.File(tmp_path / "out" / "response.h5") as file:
        curve = file["curve/0"]
        np.testing.assert_allclose(curve["amplitude_tip"][()], curve["amplitude_m"][()], rtol=1e-6)
        assert curve["harmonic_2_m"][()].max() > 0.0
    scene["response"]["harmonics"] = 1
    scene["excitation"]["harmonic"] = []
    status, _, error = shroud("respond", write_scene(path, scene), "--rom", rom, "--out", tmp_path / "few")
    assert status != 0
    assert "harmonics: 1, allowed: 2 or more, the highest harmonic of the excitation" in error


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        (
            {"excitation__harmonic": [{"order": 0}]},
            "excitation.harmonic[0].order: 0, allowed: a whole number, 1 to 31",
        ),
        ({"excitation__harmonic": [{"amplitude": 1.0}]}, "excitation.harmonic[0].order: missing, allowed"),
        ({"excitation__harmonic": [{"order": 2}, {"order": 2}]}, "each order once"),
        ({"excitation__harmonic": [{"ordr": 2}]}, "excitation.harmonic[0].ordr: unknown key, did you mean order?"),
        ({"excitation__harmonic": 2}, "excitation.harmonic: 2, allowed: tables [[excitation.harmonic]]"),
        ({"excitation__harmonic": [{"order": 3}]}, "response.harmonics: 1, allowed: 3 or more, the highest harmonic"),
        ({"excitation__load": [{"at": "tip", "set": "tip"}]}, "allowed: one of at, set, surface, file, mode"),
        ({"excitation__load": [{"amplitude": 2.0}]}, "one of at, set, surface, file, mode (given: none)"),
        ({"excitation__load": [{"file": "no.csv"}]}, "no.csv: no such file"),
        ({"load__force": [{"at": "tip", "direction": [0, 0, 0]}]}, "load.force[0].direction: [0, 0, 0], allowed"),
        ({"load__pressure": [{"pressure": 1.0}]}, "load.pressure[0].surface: missing"),
        ({"load__temperature": {}}, "allowed: one of uniform, linear, file, of_mesh (given: none)"),
        ({"load__temperature": {"unifrm": 3.0}}, "load.temperature.unifrm: unknown key, did you mean uniform?"),
        ({"output": [{"name": "tip_y", "at": "tip"}]}, "other names than tip, tip_x"),
        ({"output": [{"name": "a b"}]}, "output[0].name: 'a b', allowed: letters, digits and '_'"),
        ({"output": [{"name": "a"}, {"name": "a"}]}, "tables [[output]] with different names"),
        ({"output": [{"name": "a", "at": "tip", "quantity": "strain"}]}, '"strain" with a point at = [x, y, z]'),
        ({"sweep": {"excitation.harmonic": [[], []]}}, "excitation.harmonic"),
    ],
)
def test_careless_values_get_one_line(tmp_path: Path, changes: dict[str, Any], line: str) -> None:
    path = write_scene(tmp_path / "scene.toml", small_scene(**changes))
    status, said, error = shroud("run", path, "--out", tmp_path / "out")
    assert status == 2
    assert len(error.strip().splitlines()) == 1, error
    assert line.replace("'a b'", '"a b"') in error or line in error
    assert "Traceback" not in said + error


@pytest.fixture(scope="module")
def blade(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Sector, material and full model of the small blade."""
    folder = tmp_path_factory.mktemp("blade")
    sector = load_sector(_sector(folder, write_scene(folder / "scene.toml", small_scene())))
    steel = Material(210e9, 0.3, 7850.0)
    return sector, steel, assemble(sector, steel, element="hex8")


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"excitation__load": [{"set": "nose"}]}, "'nose': a node set of the mesh: contact_left, "),
        ({"load__pressure": [{"surface": "nose", "pressure": 1.0}]}, "'nose': a surface of the mesh: "),
        ({"load__temperature": {"uniform": 100.0}}, "material.expansion = 0.0: the expansion coefficient"),
        ({"output": [{"name": "g", "at": [1.0, 0.0, 0.0], "quantity": "strain"}]}, "must lie on the mesh"),
        ({"excitation__load": [{"file": "far.csv"}]}, "positions on nodes (m); [5.0, 0.0, 0.0] is"),
        ({"excitation__load": [{"file": "high.csv"}]}, "numbers of nodes from 0 to"),
        ({"excitation__load": [{"file": "word.csv"}]}, 'word.csv: line 2: "0,0,0,much", allowed: numbers'),
        (
            {"excitation__load": [{"file": "head.csv"}]},
            'head.csv: column "force", allowed: node, x, y, z, fx, fy, fz',
        ),
        ({"excitation__load": [{"file": "short.csv"}]}, "short.csv: line 2: 2 values, allowed: 4, one for each"),
    ],
)
def test_what_only_the_mesh_tells_gets_one_line(
    tmp_path: Path, blade: Any, changes: dict[str, Any], line: str
) -> None:
    forces_file(tmp_path / "far.csv", "x,y,z,fy", "5,0,0,1")
    forces_file(tmp_path / "high.csv", "node,fy", "100000000,1")
    forces_file(tmp_path / "word.csv", "x,y,z,fy", "0,0,0,much")
    forces_file(tmp_path / "head.csv", "x,y,z,force", "0,0,0,1")
    forces_file(tmp_path / "short.csv", "x,y,z,fy", "0,0")
    sector, steel, full = blade
    scene = read_scene(write_scene(tmp_path / "scene.toml", small_scene(**changes))).first
    loads = scene_loads(scene, sector, steel)
    assert loads is not None
    with pytest.raises((InputError, RomParameterError)) as caught:
        loads(full)
    assert line in str(caught.value), str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        (
            {"excitation__load": [{"set": "nose"}]},
            'excitation.load[0].set: "nose", allowed: one of contact_left, ',
        ),
        ({"output": [{"name": "nose"}]}, "outputs: 'nose', allowed: tip, tip_x, tip_y, tip_z"),
        ({"excitation__load": [{"mode": 900}]}, "mode 900: not a mode of the model, allowed: 1 to "),
    ],
)
def test_what_a_run_finds_out_gets_one_line(tmp_path: Path, changes: dict[str, Any], line: str) -> None:
    path = write_scene(tmp_path / "scene.toml", small_scene(**changes))
    status, said, error = shroud("run", path, "--out", tmp_path / "out")
    assert status != 0
    assert line in error, error
    assert "Traceback" not in said + error

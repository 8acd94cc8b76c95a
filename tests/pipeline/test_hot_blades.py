"""Materials over the temperature and crystals of a scene, from the file to frequencies and stress."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mesh_file_scenes import scene_with_mesh, small_sector
from mesh_writer import write_mesh
from pipeline_support import shroud, small_scene, summary_of, write_scene

from geometry.mesh_files.read import read_mesh
from pipeline import read_scene
from pipeline.scene.elastic_material import elastic_material
from pipeline.scene.material_section import Fatigue
from pipeline.stages.model.mesh_temperature import temperature_of_mesh
from pipeline.stages.model.scene_materials import materials_of_file
from rom import AnisotropicMaterial, MaterialTable, natural_frequencies, read_reduced_model
from rom.files.sector_file import load_sector
from rom.stress.resolved_shear import octahedral_shear

TABLE = {"at": [{"temperature": 420.0, "young_modulus": 1.5e11}, {"temperature": 820.0, "young_modulus": 1.2e11}]}
ISOTROPIC = {"young_modulus": 2e11, "poisson_ratio": 0.3, "density": 7800.0}
FATIGUE = {"endurance_limit": 3e8, "tensile_strength": 9e8, "at": [{"temperature": 300.0}]}
STEEL = {"steel": ISOTROPIC}
CRYSTAL, AXES = {"material__shear_modulus": 8e10}, [[1, 0, 0], [0, 1, 0]]
CUBIC = {"young_modulus": 1.25e11, "poisson_ratio": 0.39, "shear_modulus": 1.25e11, "density": 8600.0}


def hot(**changes: Any) -> dict[str, Any]:
    values = {f"material__{name}": value for name, value in (ISOTROPIC | TABLE).items()}
    return small_scene(**(values | {"load__temperature": {"uniform": 420.0}} | changes))


def first_frequencies(folder: Path, scene: dict[str, Any], count: int = 1) -> list[np.ndarray]:
    """Free natural frequencies of the members of a scene, Hz."""
    path = write_scene(folder / "scene.toml", scene)
    status, said, error = shroud("run", path, "--out", folder / "out", "--until", "reduce", "--quiet")
    assert status == 0, (said, error)
    models = sorted((folder / "out" / "store").rglob("rom.h5"), key=lambda file: file.stat().st_mtime)
    assert len(models) == count
    return [natural_frequencies(read_reduced_model(model), 0.0)[:6] for model in models]


def test_frequencies_of_a_hot_blade_are_as_the_root_of_young_s_modulus(tmp_path: Path) -> None:
    sweep = {"load.temperature_factor": [0.0, 1.0, 2.0]}
    cold, *warm = first_frequencies(tmp_path, hot(sweep=sweep), 3)
    for frequencies, modulus in zip(warm, (1.5e11, 1.2e11), strict=True):
        np.testing.assert_allclose(frequencies, cold * np.sqrt(modulus / 2e11), rtol=1e-9)


def test_a_crystal_turned_by_a_right_angle_is_the_same_and_one_leant_is_not(tmp_path: Path) -> None:
    scene = {f"material__{name}": value for name, value in CUBIC.items()}
    sweep = {"points": [{"material.turn": turn, "material.tilt": tilt} for turn, tilt in ((0, 0), (90, 0), (0, 15))]}
    straight, turned, leant = first_frequencies(tmp_path, small_scene(**scene, sweep=sweep), 3)
    np.testing.assert_allclose(turned, straight, rtol=1e-9)
    assert leant[0] > 1.02 * straight[0]  # <100> is the softest direction


def test_the_axes_of_a_crystal_turn_with_the_mesh_of_its_file(tmp_path: Path) -> None:
    """The blade as it is and with its engine axis along z of the file, its orientation turned alike."""
    blade, cubic = small_sector(0.018), "1.25E11, 1.25E11, 1.25E11, .39, .39, .39, 1.25E11, 1.25E11\n1.25E11\n"
    found = []
    for place, (order, direction) in enumerate(
        (([0, 1, 2], (1, 0, 1)), ([1, 2, 0], (1, 0, 1)), ([0, 1, 2], (1, 0, 3)))
    ):
        turned = replace(blade, points=blade.points[:, order], blocks=(replace(blade.blocks[0], material="steel"),))
        folder = tmp_path / str(place)
        folder.mkdir()
        write_mesh(folder / "blade.inp", turned, STEEL)
        one, two = (", ".join(f"{x}" for x in np.array(axis)[order]) for axis in (direction, (0, 1, 0)))
        deck = (folder / "blade.inp").read_text()
        deck = re.sub(r"\*ELASTIC\n.*\n", f"*ELASTIC, TYPE=ENGINEERING CONSTANTS\n{cubic}", deck)
        deck = re.sub(r"(\*SOLID SECTION[^\n]*)", r"\1, ORIENTATION=frame", deck)
        (folder / "blade.inp").write_text(deck + f"*ORIENTATION, NAME=frame\n{one}, {two}\n")
        scene = scene_with_mesh("blade.inp", mesh__axis="xyz"[order.index(0)], material=None)
        found += first_frequencies(folder, scene)
    np.testing.assert_allclose(found[1], found[0], rtol=1e-8)
    assert np.abs(found[2] / found[0] - 1.0).max() > 1e-2


def test_temperatures_of_the_mesh_file_are_those_of_a_linear_field(tmp_path: Path) -> None:
    blade = small_sector(0.018)
    write_mesh(tmp_path / "blade.inp", replace(blade, blocks=(replace(blade.blocks[0], material="steel"),)), STEEL)
    deck = (tmp_path / "blade.inp").read_text()
    radius = np.hypot(blade.points[:, 1], blade.points[:, 2])
    heat = 200.0 + 600.0 * (radius - radius.min()) / np.ptp(radius)
    lines = "".join(f"{k}, {value:.12g}\n" for k, value in enumerate(heat, 1))
    found = []
    for name, given in (("own", {"of_mesh": True}), ("linear", {"linear": [200.0, 800.0]})):
        (tmp_path / name).mkdir()
        (tmp_path / name / "blade.inp").write_text(deck + f"*INITIAL CONDITIONS, TYPE=TEMPERATURE\n{lines}")
        scene = scene_with_mesh("blade.inp", materials={"steel": TABLE}, load__temperature=given)
        found += first_frequencies(tmp_path / name, scene)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)
    (tmp_path / "own" / "blade.inp").write_text(deck + f"*TEMPERATURE\n{lines[:40]}".rpartition("\n")[0] + "\n")
    status, _, error = shroud("run", tmp_path / "own" / "scene.toml", "--until", "reduce", "--quiet")
    assert (status, error.count("\n")) == (2, 1)
    assert 'load.temperature.of_mesh: "none at ' in error


def test_the_axes_of_a_crystal_are_where_they_are_asked_for() -> None:
    for along, modulus in (([0, 0, 1], 1.25e11), ([0, 1, 1], 2.2523e11), ([1, 1, 1], 3.0738e11)):
        material = elastic_material({**CUBIC, "along": along, "turn": 20.0}, (0.0, 0.6, 0.8))
        assert isinstance(material, AnisotropicMaterial)
        assert material.modulus_along([0.0, 0.6, 0.8]) == pytest.approx(modulus, rel=1e-4)
    leant = elastic_material({**CUBIC, "tilt": 30.0})
    assert isinstance(leant, AnisotropicMaterial)
    np.testing.assert_allclose(leant.axes[2], [0.5, 0.0, np.sqrt(0.75)], atol=1e-12)
    given = elastic_material({**CUBIC, "axes": [[0, 0, 2], [3, 0, 0]]})
    assert isinstance(given, AnisotropicMaterial)
    np.testing.assert_allclose(given.axes, [[0, 0, 1], [1, 0, 0], [0, 1, 0]])


def test_constants_that_are_left_out_are_on_the_lines_between_other_temperatures() -> None:
    rows = [{"temperature": 500.0, "expansion": 2e-5}, {"temperature": 1000.0, "young_modulus": 1e11}]
    table = elastic_material({**ISOTROPIC, "expansion": 1e-5, "temperature": 0.0, "at": rows})
    assert isinstance(table, MaterialTable)
    assert [table.at(500.0).young_modulus, table.at(1000.0).expansion] == pytest.approx([1.5e11, 2e-5])  # type: ignore[union-attr]


def test_the_expansion_of_a_row_holds_where_no_other_is_given(tmp_path: Path) -> None:
    path = write_scene(tmp_path / "scene.toml", hot(material__at=[{"temperature": 820.0, "expansion": 1.4e-5}]))
    material = read_scene(path).first.material
    assert material is not None
    table = elastic_material(material.properties)
    assert isinstance(table, MaterialTable)
    assert float(table.free_strain(520.0) - table.free_strain(20.0)) == pytest.approx(7e-3)


def _deck_with_table(folder: Path, rows: str) -> str:
    """A mesh file whose material `steel` has these rows; its name."""
    blade = small_sector(0.018)
    write_mesh(folder / "blade.inp", replace(blade, blocks=(replace(blade.blocks[0], material="steel"),)), STEEL)
    deck = (folder / "blade.inp").read_text()
    (folder / "blade.inp").write_text(re.sub(r"\*ELASTIC\n.*\n", rows, deck))
    return "blade.inp"


def test_a_table_of_the_scene_completes_those_of_the_file(tmp_path: Path) -> None:
    """Young's modulus over the temperature of the file, expansion of the scene."""
    name = _deck_with_table(tmp_path, "*ELASTIC\n2E11, .3, 20.\n1E11, .3, 520.\n*EXPANSION\n9E-5, 0.\n9E-5, 520.\n")
    heat: dict[str, Any] = {"load__temperature": {"uniform": 520.0}, "material": None}
    of_scene = {"temperature": 100.0, "expansion": 1e-5, "at": [{"temperature": 300.0, "expansion": 2e-5}]}
    path = write_scene(tmp_path / "scene.toml", scene_with_mesh(name, materials={"steel": of_scene}, **heat))
    found = {"used": ["steel"], "unread_materials": {}, "material_notes": {}}
    found["materials"] = read_mesh(tmp_path / name).materials
    steel = elastic_material(materials_of_file(read_scene(path).first, found)["steel"].properties)
    assert isinstance(steel, MaterialTable)
    assert (steel.ends, steel.mean_from) == ((0.0, 520.0), None)
    states = [steel.at(temperature) for temperature in (0.0, 200.0, 270.0, 520.0)]
    rows = [(state.young_modulus / 1e11, 1e5 * float(state.expansion)) for state in states]  # type: ignore[union-attr,arg-type]
    np.testing.assert_allclose(rows, [(2.0, 1.0), (1.64, 1.5), (1.5, 1.85), (1.0, 2.0)], rtol=1e-12)


@pytest.mark.parametrize(("coldest", "reference"), [(0.0, 20.0), (100.0, 100.0)])
def test_a_new_scene_takes_the_temperatures_of_the_file(tmp_path: Path, coldest: float, reference: float) -> None:
    name = _deck_with_table(tmp_path, f"*ELASTIC\n2E11, .3, {coldest}\n1E11, .3, 520.\n*EXPANSION\n1E-5\n")
    heat = "".join(f"{k}, {300 + k % 100}.\n" for k in range(1, len(small_sector(0.018).points) + 1))
    with (tmp_path / name).open("a") as file:
        file.write(f"*INITIAL CONDITIONS, TYPE=TEMPERATURE\n{heat}")
    status, said, error = shroud("new", tmp_path / "new", "--mesh", tmp_path / name)
    assert (status, error) == (0, "")
    assert "nodes, 300 to 399" in said
    assert "without [load.temperature]" not in said
    field = read_scene(tmp_path / "new" / "scene.toml").first.load.temperature
    assert field is not None
    assert (field.of_mesh, field.reference) == (True, reference)
    assert shroud("validate", tmp_path / "new" / "scene.toml")[0] == 0


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"tilt": 5.0}, 'materials.steel.tilt: "given for an isotropic material", allowed: shear_modulus'),
        ({"shear_modulus": 8e10, "axes": AXES, "turn": 5.0}, "materials.steel.turn: given beside axes"),
    ],
)
def test_axes_of_the_material_of_a_file_that_are_not_used(tmp_path: Path, changes: dict[str, Any], line: str) -> None:
    name = _deck_with_table(tmp_path, "*ELASTIC\n2E11, .3\n")
    path = write_scene(tmp_path / "scene.toml", scene_with_mesh(name, material=None, materials={"steel": changes}))
    status, _, error = shroud("validate", path)
    assert (status, len(error.strip().splitlines())) == (2, 1), error
    assert line.replace('"', "") in error.replace('"', "")


def test_a_linear_field_and_stiffnesses_in_place_of_moduli(tmp_path: Path) -> None:
    stiffness = [2.5e11, 1.6e11, 1.3e11]
    scene = hot(
        load__temperature={"linear": [300.0, 700.0], "reference": 100.0},
        load__temperature_factor=0.5,
        material__young_modulus=None,
        material__poisson_ratio=None,
        material__stiffness=stiffness,
        material__at=[{"temperature": 900.0, "stiffness": [2.2e11, 1.5e11, 1.1e11]}],
    )
    path = write_scene(tmp_path / "scene.toml", scene)
    first = read_scene(path).first
    assert first.material is not None
    crystal = elastic_material(first.material.properties)
    assert isinstance(crystal, MaterialTable)
    state = crystal.states[0]
    assert isinstance(state, AnisotropicMaterial)
    assert [state.stiffness[0, 0], state.stiffness[0, 1], state.stiffness[5, 5]] == pytest.approx(stiffness)
    assert shroud("run", path, "--out", tmp_path / "out", "--until", "mesh")[0] == 0
    sector = load_sector(next((tmp_path / "out" / "store").rglob("sector.h5")))
    radius = np.hypot(sector.points[:, 1], sector.points[:, 2])
    share = (radius - radius.min()) / np.ptp(radius)
    np.testing.assert_allclose(temperature_of_mesh(first, sector), 200.0 + 200.0 * share)


def test_the_resolved_shear_of_a_tension_along_100_and_111() -> None:
    """Largest Schmid factors of the twelve octahedral systems: 1/sqrt(6) and 2/sqrt(54)."""
    along_x = np.array([[2.0, 0, 0, 0, 0, 0], [1.0, 0, 0, 0, 0, 0]])
    assert octahedral_shear(along_x, np.eye(3)) == pytest.approx((1 / np.sqrt(6.0), 2 / np.sqrt(6.0)), rel=1e-12)
    diagonal = np.full(6, 1.0 / 3.0)
    assert octahedral_shear(np.array([0 * diagonal, diagonal]), np.eye(3))[0] == pytest.approx(2 / np.sqrt(54.0))


def test_limits_over_the_temperature_and_the_stress_of_a_hot_crystal(tmp_path: Path) -> None:
    values: dict[str, Any] = {f"material__{name}": value for name, value in CUBIC.items()}
    cold = {"endurance_limit": 4e8, "tensile_strength": 9e8}
    limits = {**cold, "at": [{"temperature": 820.0, "endurance_limit": 2e8, "tensile_strength": 5e8}]}
    values |= {"stress": {"hot_spots": 2}, "load__temperature": {"uniform": 420.0}, "mesh__size": 0.018}
    values |= {"material__at": [{"temperature": 820.0, "young_modulus": 1.0e11}]}
    for name, given in (("hot", limits), ("same", {"endurance_limit": 3e8, "tensile_strength": 7e8})):
        scene = small_scene(**values, fatigue=given)
        path = write_scene(tmp_path / f"{name}.toml", scene)
        status, _, error = shroud("run", path, "--out", tmp_path / name, "--until", "stresses", "--quiet")
        assert status == 0, error
    one, other = (summary_of(tmp_path / name)["stress"][0] for name in ("hot", "same"))
    assert one["least_margin"] == pytest.approx(other["least_margin"], rel=1e-12)  # half-way between both rows
    spot = one["hot_spots"][0]
    assert spot["temperature"] == 420.0
    assert 0.2 * spot["amplitude_pa"] < spot["resolved_shear_amplitude_pa"] < 0.6 * spot["amplitude_pa"]
    assert any("octahedral" in note for note in one["notes"])
    path = write_scene(tmp_path / "hot.toml", small_scene(**values, fatigue={**limits, "temperature": 500.0}))
    assert shroud("run", path, "--out", tmp_path / "hot", "--until", "stresses", "--quiet")[0] == 0
    (beyond,) = (note for note in summary_of(tmp_path / "hot")["stress"][0]["notes"] if "no margin" in note)
    assert beyond == "no margin at 100 % of the nodes, at 420 to 420: [[fatigue.at]] has limits from 500 to 820"
    table = Fatigue.model_validate(limits)
    assert table.limits_of("", 420.0) == (3e8, 7e8, None)
    assert table.limits_of("", 900.0) is None


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"load__temperature": None}, "load.temperature: missing, allowed: a table [load.temperature]: the material"),
        (
            {"load__temperature": None, "material__at": None, "load__temperature_factor": 2.0},
            "load.temperature_factor",
        ),
        ({"load__temperature": {"uniform": 1000.0}}, "load.temperature: 1000.0, allowed: must lie within the table"),
        ({"load__temperature": {"uniform": 900.0, "reference": 293.15}}, "is one in K and one in degrees C?"),
        (
            {"load__temperature": {"uniform": 1.0, "linear": [1.0, 2.0]}},
            "one of uniform, linear, file, of_mesh (given: unif",
        ),
        (
            {"material__at": [{"temperature": 20.0}]},
            "material.at: [{'temperature': 20.0}], allowed: tables [[materia",
        ),
        ({"material__at": [{"young_modulus": 1e11}]}, "material.at[0].temperature: missing, allowed: a number"),
        ({"material__turn": 5.0}, "material.turn: given for an isotropic material, allowed: shear_modulus (a cubic"),
        ({"material__shear_modulus": -1.0}, "material.shear_modulus: -1.0, allowed: a number above 0"),
        ({"material__shear_modulus": 8e10, "material__axes": [[1, 0, 0], [1, 1, 0]]}, "material.axes: [[1, 0, 0]"),
        (
            {"material__shear_modulus": 8e10, "material__poisson_ratio_13": 0.99},
            "material.poisson_ratio: [0.3, 0.99,",
        ),
        ({"material__stiffness": [2e11, 1e11, 1e11]}, "without young_modulus, poisson_ratio and shear_modulus"),
        (
            {"material__at": None, "load__temperature": None, "fatigue": FATIGUE},
            "load.temperature: missing, allowed: ",
        ),
        ({"load__temperature": {"uniform": 0.0}}, "load.temperature: 0.0, allowed: must lie within the table, 20 to"),
        ({"load__temperature": {"of_mesh": True}}, "load.temperature.of_mesh: true, allowed: one of uniform, linear"),
        ({"material__at": None}, "material.expansion: missing, allowed: the expansion coefficient, 1/K"),
        (
            {**CRYSTAL, "material__axes": AXES, "material__tilt": 5.0},
            "material.tilt: given beside axes, allowed: `al",
        ),
        ({**CRYSTAL, "material__along": [0.0, 1e-200, 0.0]}, "material.along: [0.0, 1e-200, 0.0], allowed: three nu"),
        (
            {"material__young_modulus": None, "material__poisson_ratio": None, "material__stiffness": [1e11] * 3},
            "material.stiffness: [100000000000.0, 10000000",
        ),
        ({"sweep": {"material.axes": [1.0]}}, "material.axes"),
        ({"sweep": {"material.young_modulus": [2e11, 1e11]}}, "has no effect: material.at has it at other temperatu"),
        (
            {"material__at": [{"temperature": 500.0, "young_modulus": 1.6e5}]},
            "material.at[0].young_modulus: 1600",
        ),
    ],
)
def test_materials_that_no_solid_is_and_fields_that_are_not_there(
    tmp_path: Path, changes: dict[str, Any], line: str
) -> None:
    path = write_scene(tmp_path / "scene.toml", hot(**changes))
    status, _, error = shroud("validate", path)
    assert (status, len(error.strip().splitlines())) == (2, 1), error
    assert line in error

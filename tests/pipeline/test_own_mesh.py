"""A scene with a mesh from a file gives the same pipeline as the dummy blade."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mesh_file_scenes import gmsh_tetrahedra, hexahedra_as, scene_with_mesh, small_sector, with_mid_sides
from mesh_writer import write_mesh
from pipeline_support import shroud, small_scene, write_scene

from geometry import ElementBlock, SectorMesh, read_mesh
from geometry.exchange import export_sector, import_sector
from geometry.quality import scaled_jacobian
from geometry.subdivision import subdivided
from pipeline.new_scene.mesh_survey import survey
from pipeline.report.viewer import boundary_sides, outer_surface
from pipeline.scene.input_files import content_hash, file_parts
from pipeline.scene.reading import read_scene
from pipeline.stages.cache_keys import model_keys

FORMATS = ("inp", "bdf", "cdb", "msh")
STEEL = {"steel": {"young_modulus": 210e3, "poisson_ratio": 0.3, "density": 7.85e-9}}  # N, mm, t


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small blade in files of several programs."""
    place = tmp_path_factory.mktemp("own")
    blade = with_mid_sides(small_sector(), "hex20")
    for suffix in FORMATS:
        write_mesh(place / f"blade.{suffix}", blade)
    steel = replace(blade.blocks[0], material="steel")
    write_mesh(place / "blade_mm.inp", replace(blade, points=1e3 * blade.points, blocks=(steel,)), STEEL)
    gmsh_tetrahedra(small_sector(0.02), place / "tetrahedra.msh", 0.05)
    return place


def frequencies(folder: Path, scene: dict[str, Any], *options: str) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    """Natural frequencies with free and stuck shrouds, Hz, and the summary."""
    name = scene["name"]
    status, _, error = shroud(
        "run", write_scene(folder / f"{name}.toml", scene), "--out", folder / name, "--until", "reduce", *options
    )
    assert status == 0, error
    summary = json.loads((folder / name / "summary.json").read_text())
    model = summary["models"][0]
    return np.array(model["free_hz"]), np.array(model["stuck_hz"]["36"]), summary


@pytest.fixture(scope="module")
def made(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Natural frequencies of the small blade as the program meshes it."""
    free, stuck, _ = frequencies(folder, small_scene(name="made", mesh__element="hex20"))
    return free, stuck


@pytest.fixture(scope="module")
def reference(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    free, stuck, _ = frequencies(folder, scene_with_mesh("blade.inp", name="reference"))
    return free, stuck


@pytest.mark.parametrize("suffix", FORMATS)
def test_the_blade_through_a_file_has_the_same_frequencies(
    folder: Path, suffix: str, made: tuple[np.ndarray, ...], reference: tuple[np.ndarray, ...]
) -> None:
    free, stuck, summary = frequencies(folder, scene_with_mesh(f"blade.{suffix}", name=f"by_{suffix}"))
    np.testing.assert_allclose(free, made[0], rtol=1e-9)
    # the frames are those of the meshed faces, which follow the circumference; the dummy's are those of its drawing
    np.testing.assert_allclose(stuck, made[1], rtol=5e-6)
    np.testing.assert_allclose(stuck, reference[1], rtol=1e-9)
    model = summary["models"][0]
    assert model["elements"] == {"hex20": 302}
    assert any("nodes match" in line for line in model["mesh_findings"])


def test_millimetres_and_the_materials_of_the_file(folder: Path, made: tuple[np.ndarray, ...]) -> None:
    scene = scene_with_mesh("blade_mm.inp", name="in_mm", mesh__unit="mm", material=None)
    np.testing.assert_allclose(frequencies(folder, scene)[0], made[0], rtol=1e-9)


@pytest.mark.long
def test_tetrahedra_of_gmsh_agree_within_the_mesh_error_that_verify_states(
    folder: Path, made: tuple[np.ndarray, ...]
) -> None:
    scene = scene_with_mesh("tetrahedra.msh", name="tetrahedra")
    path = write_scene(folder / "tetrahedra.toml", scene)
    status, said, error = shroud("verify", path, "--out", folder / "tetrahedra", "--json")
    assert status == 0, error
    case = json.loads(said)["cases"][0]
    assert case["element"] == "tet10"
    assert case["other"]["dofs"] > 6 * case["dofs"]
    stated = {joint["joint"]: joint for joint in case["joints"]}
    for state, own in (("free", made[0]), ("stuck", made[1])):
        joint = stated[state]
        numbers = slice(joint["first_mode"] - 1, joint["first_mode"] - 1 + len(joint["full_hz"]))
        difference = np.abs(np.array(joint["full_hz"]) / own[numbers] - 1.0)
        known = np.abs(joint["mesh_error"])
        assert np.all(difference < known + 2e-3)  # the reduced model of the hexahedra has errors of its own
        assert np.all(known < 0.02)
    assert "refine tetrahedra.msh: edges of" in json.loads(said)["advice"][0]["text"]


def test_a_response_is_that_of_the_dummy_blade(folder: Path) -> None:
    changes: dict[str, Any] = {"response__frequency": [405.0, 435.0], "contact__integration": "exact"}
    found = []
    for scene, until in (
        (small_scene(name="response_made", mesh__element="hex20", **changes), ("--until", "respond")),
        (scene_with_mesh("blade.inp", name="response_own", **changes), ()),
    ):
        path = write_scene(folder / f"{scene['name']}.toml", scene)
        status, _, error = shroud("run", path, "--out", folder / scene["name"], "--quiet", *until)
        assert status == 0, error
        found.append(json.loads((folder / scene["name"] / "summary.json").read_text())["curves"][0])
    for key in ("peak_frequency_hz", "peak_amplitude_m"):
        assert found[1][key] == pytest.approx(found[0][key], rel=1e-4)


def test_constraints_that_are_left_out_are_a_warning_at_every_command(folder: Path, tmp_path: Path) -> None:
    text = (folder / "blade.inp").read_text() + "*EQUATION\n2\n1, 1, 1., 2, 1, -1.\n"
    (tmp_path / "tied.inp").write_text(text)
    path = write_scene(tmp_path / "tied.toml", scene_with_mesh("tied.inp", name="tied"))
    warned = "warning: 1 *EQUATION left out: nodes that they tie move freely here"
    assert warned in shroud("validate", path)[2]
    run = ("run", path, "--out", tmp_path / "out", "--until", "mesh")
    for _ in range(2):  # the second time the mesh is there
        status, said, error = shroud(*run)
        assert status == 0, error
        assert warned in said + error
    assert any(line.startswith(warned) for line in survey(read_mesh(tmp_path / "tied.inp")))


def test_results_are_cached_by_the_content_of_the_file(folder: Path, tmp_path: Path) -> None:
    text = (folder / "blade.inp").read_text()
    (tmp_path / "a.inp").write_text(text)
    (tmp_path / "b.inp").write_text(text)
    keys = [
        model_keys(read_scene(write_scene(tmp_path / f"{name}.toml", scene_with_mesh(f"{name}.inp"))).first)
        for name in ("a", "b")
    ]
    assert keys[0] == keys[1]  # whatever its name
    (tmp_path / "b.inp").write_text(text + "** one more line\n")
    assert model_keys(read_scene(tmp_path / "b.toml").first).mesh != keys[0].mesh


@pytest.mark.parametrize(
    ("name", "statement"),
    [
        ("main.inp", "*INCLUDE, INPUT=nodes.inc"),
        ("main.inp", '** a comment\n * include , format=free, Input = "nodes.inc"'),
        ("main.inp", "*INCLUDE,\nINPUT=nodes.inc"),
        ("main.inp", "*NODE, NSET=all, INPUT=nodes.inc"),
        ("main.inp", "*INCLUDE, INPUT=.\\nodes.inc"),
        ("main.bdf", "INCLUDE 'nodes.inc'"),
        ("main.bdf", "INCLUDE './\n  nodes.inc'"),
        ("main.bdf", "include nodes.inc  $ the nodes"),
        ("main.dat", "  Include = nodes.inc"),
    ],
)
def test_included_files_count_with_the_file(name: str, statement: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(f"{statement}\n")
    (tmp_path / "nodes.inc").write_text("*NODE\n1, 0., 0., 0.\n")
    before = content_hash(str(tmp_path / name))
    assert [part.name for part in file_parts(str(tmp_path / name))] == [name, "nodes.inc"]
    (tmp_path / "nodes.inc").write_text("*NODE\n1, 0., 0., 1.0\n")
    assert content_hash(str(tmp_path / name)) != before


def test_a_file_that_an_included_one_takes_from_the_main_folder_counts_too(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "main.inp").write_text("*INCLUDE, INPUT=parts/all.inc\n")
    (tmp_path / "parts" / "all.inc").write_text("*INCLUDE, INPUT=parts/nodes.inc\n")
    (tmp_path / "parts" / "nodes.inc").write_text("*NODE\n1, 0., 0., 0.\n")
    assert [part.name for part in file_parts(str(tmp_path / "main.inp"))] == ["main.inp", "all.inc", "nodes.inc"]


@pytest.mark.parametrize("line", ["** *INCLUDE, INPUT=nodes.inc", "*HEADING\ninclude nodes.inc"])
def test_comments_include_nothing(line: str, tmp_path: Path) -> None:
    (tmp_path / "main.inp").write_text(f"{line}\n")
    assert len(file_parts(str(tmp_path / "main.inp"))) == 1


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"mesh__file": "blad.inp"}, 'mesh.file: .*blad.inp": no such file, did you mean blade.inp'),
        ({"mesh__file": "ä" * 200 + ".inp"}, "mesh.file: .*cannot be read: File name too long"),
        ({"mesh__file": "."}, "mesh.file: .*: not a file"),
        ({"mesh__n_blades": None}, "mesh.n_blades: missing, allowed: a whole number, 3 to 10000"),
        ({"mesh__size": 0.01}, "mesh.size: 0.01, allowed: nothing beside mesh.file"),
        ({"mesh__unit": "cm"}, 'mesh.unit: "cm", allowed: "m", "mm" or "in"'),
        ({"mesh__sets": {"rot": "root"}}, "mesh.sets.rot: unknown key, did you mean .*root"),
        ({"mesh__sets__root": 3}, "mesh.sets.root: 3, allowed: the name of a node set or surface"),
        ({"mesh__sets__root": "rooot"}, "mesh.sets.root: .*rooot.*root"),
        ({"mesh__n_blades": 70}, "mesh.n_blades: 70, allowed: .*72"),
        ({"mesh__unit": "mm"}, 'mesh.unit: "mm", allowed: .*"m"'),
        ({"blade": {}}, "blade.n_blades: missing"),
        ({"blade": small_scene()["blade"]}, "blade: given beside mesh.file, allowed: one of the two"),
        (
            {"materials": {"S": {"young_modulus": 1e11}}},
            "materials.S: unknown name, allowed: a material or an element",
        ),
        ({"materials": {"S": {"young": 1.0}}}, "materials.S.young: unknown key"),
        ({"excitation__at": [0.0, 0.0, 9.0]}, "excitation.at: .* allowed: a point of the blade"),
        ({"load__speed_rpm": 2e5}, "load.speed_rpm: 200000.0, allowed: 0 to "),
        ({"contact__interference": [0.0] * 5}, "contact.interference: a list of 5, allowed: a number or a list of 4"),
        ({"material": None}, r"material: \"missing\", allowed: a table \[material\]|material.*missing"),
    ],
)
def test_what_is_wrong_is_one_line(folder: Path, tmp_path: Path, changes: dict[str, Any], said: str) -> None:
    scene = scene_with_mesh("blade.inp")
    for name in ("blade.inp",):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    scene = scene_with_mesh("blade.inp", **changes)
    path = write_scene(tmp_path / "s.toml", scene)
    status, _, error = shroud("run", path, "--out", tmp_path / "out", "--until", "reduce", "--quiet")
    assert (status, error.count("\n")) == (2, 1), error
    assert re.search(said, error), error


def test_validate_reads_the_mesh(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "blade.inp").write_bytes((folder / "blade.inp").read_bytes())
    path = write_scene(tmp_path / "s.toml", scene_with_mesh("blade.inp"))
    assert shroud("validate", path)[0] == 0
    path = write_scene(tmp_path / "s.toml", scene_with_mesh("blade.inp", mesh__n_blades=70))
    status, _, error = shroud("validate", path)
    assert (status, error.count("\n")) == (2, 1)
    assert "72" in error


def test_meshes_can_be_swept(folder: Path) -> None:
    """Three meshes, three models, several at the same time; each is read here and goes out as a file of a task."""
    sweep = {"mesh.file": ["blade.inp", "blade.msh", "tetrahedra.msh"]}
    scene = scene_with_mesh("blade.inp", name="swept", sweep=sweep, response__frequency=[300.0, 305.0])
    path = write_scene(folder / "swept.toml", scene)
    status, _, error = shroud("run", path, "--out", folder / "swept", "--until", "respond", "--jobs", "2")
    assert status == 0, error
    assert "models, 3 of 3 done: mesh " in error
    models = json.loads((folder / "swept" / "summary.json").read_text())["models"]
    assert [model["elements"] for model in models] == [{"hex20": 302}, {"hex20": 302}, models[2]["elements"]]
    assert "tet10" in models[2]["elements"]
    assert models[0]["free_hz"] == pytest.approx(models[1]["free_hz"], rel=1e-9)


def test_a_new_scene_for_a_mesh_can_be_run(folder: Path, tmp_path: Path) -> None:
    status, said, error = shroud("new", tmp_path / "mine", "--mesh", folder / "blade_mm.inp")
    assert (status, error) == (0, "")
    for line in ("elements: 302 hex20", "unit mm: Young's modulus", "72 blades", 'root: "root"', "axis x"):
        assert line in said
    assert (tmp_path / "mine" / "mesh.png").stat().st_size > 20_000
    scene = read_scene(tmp_path / "mine" / "scene.toml").first
    assert scene.mesh is not None
    assert (scene.n_blades, scene.mesh.unit, scene.mesh.sets.contact_right) == (72, "mm", "face_right")
    assert scene.response.frequency[0] < 275.0 < scene.response.frequency[1]
    assert shroud("validate", tmp_path / "mine" / "scene.toml")[0] == 0
    status, _, error = shroud("new", tmp_path / "mine", "--mesh", folder / "blade_mm.inp")
    assert (status, error.count("\n")) == (2, 1)


def test_a_mesh_without_named_faces_says_what_is_to_be_changed(folder: Path, tmp_path: Path) -> None:
    write_mesh(tmp_path / "bare.inp", replace(small_sector(), node_sets={}, surfaces={}))
    status, said, error = shroud("new", tmp_path / "mine", "--mesh", tmp_path / "bare.inp")
    assert (status, error.count("\n")) == (0, 1)
    assert "axis x, 72 blades: 3 pairs of surfaces are 5 degrees apart" in said
    assert "mesh.sets.contact_right: name the faces: 3 pairs of surfaces are one pitch apart" in error
    assert "n_blades = 72 " in (tmp_path / "mine" / "scene.toml").read_text()


def test_a_mesh_without_faces_a_pitch_apart_says_that_the_number_is_missing(tmp_path: Path) -> None:
    sector = small_sector()
    points = sector.points + np.random.default_rng(1).uniform(-3e-4, 3e-4, sector.points.shape)
    write_mesh(tmp_path / "bare.inp", replace(sector, points=points, node_sets={}, surfaces={}))
    status, said, error = shroud("new", tmp_path / "mine", "--mesh", tmp_path / "bare.inp")
    assert (status, error.count("\n")) == (0, 1)
    assert "axis, number of blades: not known" in said
    assert "mesh.n_blades: missing" in error
    assert "n_blades = ..." in (tmp_path / "mine" / "scene.toml").read_text()


def volume(sector: SectorMesh) -> float:
    surface = outer_surface(sector, most=10**9)
    corners = sector.points[surface.vertices][surface.triangles]
    return float(np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))) / 6.0


@pytest.fixture(
    scope="module", params=["hex8", "hex20", "wedge6", "wedge15", "tet4", "tet10"], ids=lambda kind: str(kind)
)
def sector_of_kind(request: pytest.FixtureRequest) -> SectorMesh:
    """The small blade in elements of a kind."""
    kind = request.param
    linear = {"hex20": "hex8", "wedge15": "wedge6", "tet10": "tet4"}.get(kind, kind)
    sector = hexahedra_as(small_sector(0.018), linear)
    return sector if kind == linear else with_mid_sides(sector, kind)


@pytest.mark.parametrize("parts", [2, 3])
def test_a_finer_mesh_fills_the_same_body_with_more_elements(sector_of_kind: SectorMesh, parts: int) -> None:
    finer = subdivided(sector_of_kind, parts)
    assert finer.n_elements == parts**3 * sector_of_kind.n_elements
    assert finer.points[: len(sector_of_kind.points)] == pytest.approx(sector_of_kind.points, abs=1e-12)
    assert len(np.unique(finer.points.round(9), axis=0)) == len(finer.points)  # sides are shared
    assert min(scaled_jacobian(finer.points, block).min() for block in finer.blocks) > 0.0
    exact = sector_of_kind.blocks[0].topology.quadratic or sector_of_kind.blocks[0].kind == "tet4"
    # sides with four corners are curved: two triangles are not the same body as eight
    assert volume(finer) == pytest.approx(volume(sector_of_kind), rel=1e-12 if exact else 1e-4)
    inside = sum(len(sides) for sides in boundary_sides(finer.blocks))
    assert inside == parts**2 * sum(len(sides) for sides in boundary_sides(sector_of_kind.blocks))
    assert len(finer.node_sets["face_right"]) == len(finer.node_sets["face_left"])
    np.testing.assert_array_equal(finer.node_sets["contact_right"], sector_of_kind.node_sets["contact_right"])


def test_new_nodes_of_curved_elements_lie_on_the_curve() -> None:
    """An edge with its middle on a parabola has its quarter points there too."""
    x = np.array([0.0, 1.0, 1.0, 0.0])
    corners = np.array([[a, b, c] for c in (0.0, 1.0) for a, b in zip(x, [0.0, 0.0, 1.0, 1.0], strict=True)])
    block = ElementBlock("hex8", np.arange(8)[None])
    sets = {name: np.arange(4) for name in ("face_right", "face_left", "tip_surface", "root")}
    cube = replace(small_sector(0.018), points=corners, blocks=(block,), node_sets=sets, surfaces={})
    curved = with_mid_sides(cube, "hex20")
    curved = replace(curved, points=curved.points + np.outer(curved.points[:, 0] ** 2, [0.0, 0.3, 0.0]))
    finer = subdivided(curved)
    straight = finer.points - np.outer(finer.points[:, 0] ** 2, [0.0, 0.3, 0.0])
    assert set(np.round(4.0 * straight, 9).ravel()) == {0.0, 1.0, 2.0, 3.0, 4.0}


def test_a_sector_of_any_elements_goes_to_files_and_back(sector_of_kind: SectorMesh, tmp_path: Path) -> None:
    block = sector_of_kind.blocks[0]
    half = len(block) // 2
    parts = ElementBlock(block.kind, block.nodes[:half], "a"), ElementBlock(block.kind, block.nodes[half:], "b")
    sector = replace(sector_of_kind, blocks=parts)
    for suffix in ("vtu", "msh"):
        export_sector(tmp_path / f"x.{suffix}", sector)
        found = import_sector(tmp_path / f"x.{suffix}")
        assert [(b.kind, b.material) for b in found.blocks] == [(b.kind, b.material) for b in parts]
        for one, other in zip(found.blocks, parts, strict=True):
            np.testing.assert_array_equal(one.nodes, other.nodes)
        assert found.n_blades == sector.n_blades


ALUMINIUM = "*ELASTIC\n70000., 0.3\n"
KG_MM3, MM_KG_S = "*ELASTIC\n2.1e5, 0.3\n*DENSITY\n7.85e-6\n", "*ELASTIC\n2.1e8, 0.3\n*DENSITY\n7.85e-6\n"
CUBIC = "*ELASTIC, TYPE=ENGINEERING CONSTANTS\n1.25e5, 1.25e5, 1.25e5, .38, .38, .38, 1.25e5, 1.25e5\n1.25e5\n"
CUBIC += "*DENSITY\n8.7e-9\n"
CRYSTAL = CUBIC.replace("ENGINEERING CONSTANTS", "ANISOTROPIC")
HOT = "*ELASTIC\n2.1e5, 0.3, 20.\n1.6e5, 0.3, 600.\n*DENSITY\n7.85e-9\n"
IN_FULL = {"steel": {"young_modulus": 125e9, "poisson_ratio": 0.38, "density": 8700.0}}


@pytest.fixture(scope="module")
def steel_deck(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A coarse small blade in mm, all of a material `steel`."""
    blade, path = small_sector(0.018), tmp_path_factory.mktemp("deck") / "blade.inp"
    blade = replace(blade, points=1e3 * blade.points, blocks=(replace(blade.blocks[0], material="steel"),))
    write_mesh(path, blade, STEEL)
    return path.read_text()


def with_numbers(deck: str, numbers: str) -> str:
    """The deck with other lines below its *MATERIAL."""
    return re.sub(r"(?<=NAME=steel\n)\*ELASTIC\n.*\n\*DENSITY\n.*\n", numbers, deck)


@pytest.mark.parametrize(
    ("numbers", "changes", "status", "said"),
    [
        (
            ALUMINIUM,
            {},
            2,
            r"materials\.steel\.density: missing, .*kg/m\^3: only Young's modulus and Poisson's ratio",
        ),
        ("*ELASTIC\n7e4\n*DENSITY\n2.7e-9\n", {}, 2, r"materials\.steel\.poisson_ratio: missing"),
        ("*DENSITY\n2.7e-9\n", {}, 2, r"materials\.steel\.young_modulus: missing, .* only density of"),
        (ALUMINIUM, {"materials": {"STEEL": {"density": 2700.0}}}, 0, ""),
        (ALUMINIUM, {"materials": {"stel": {"density": 2700.0}}}, 2, r'materials\.stel: unknown name, .*"steel"'),
        (KG_MM3, {}, 2, r"none fits this file: .* density = 7850 \(7.85e-06 kg/mm\^3\).*7.85e\+06 kg/m\^3.*--force"),
        (KG_MM3, {"materials": {"steel": {"density": 7850.0}}}, 0, "density of .materials.steel., not of the file"),
        (MM_KG_S, {}, 2, r'mesh\.unit: "mm", allowed: "mm-kg-s": Young.s modulus 2.1e\+08 kPa is 210 GPa'),
        (MM_KG_S, {"mesh__unit": "mm-kg-s"}, 0, ""),
        (CRYSTAL, {}, 2, r"materials\.steel: missing, allowed: all of .* this one is \*ELASTIC, TYPE=ANISOTROPIC"),
        (CRYSTAL, {"materials": {"steel": {"density": 1.0}}}, 2, r"materials\.steel: given in part, allowed: all of"),
        (
            CRYSTAL,
            {"materials": IN_FULL},
            0,
            r"TYPE=ANISOTROPIC in the file: that of .materials",
        ),
        (CUBIC, {}, 0, ""),
        (HOT, {"load__temperature": {"uniform": 300.0}}, 0, ""),
        (
            HOT,
            {"load__temperature": {"uniform": 700.0}},
            2,
            r"must lie within the table of steel, 20 to 600, or extended",
        ),
        (
            CUBIC,
            {"materials": {"steel": {"poisson_ratio_13": 0.99}}},
            2,
            r"materials\.steel\.poisson_ratio: .0.38, 0.99",
        ),
        ("** no numbers\n", {}, 0, r"material steel has no numbers in the file: \[material\] is taken"),
        (
            HOT.replace("2.1e5", "7e4"),
            {"contact__normal_stiffness": "punch"},
            2,
            r'contact.normal_stiffness: "punch", allowed: .* modulus 7e\+10 Pa .* material steel has',
        ),
        (HOT, {}, 0, r"material steel depends on the temperature: without .load.temperature. the first values hold"),
    ],
)
def test_materials_of_the_file_are_completed_and_checked(
    steel_deck: str, tmp_path: Path, numbers: str, changes: dict[str, Any], status: int, said: str
) -> None:
    """With a [material] of steel in the scene, which must not stand in for numbers of the file."""
    (tmp_path / "blade.inp").write_text(with_numbers(steel_deck, numbers))
    path = write_scene(tmp_path / "s.toml", scene_with_mesh("blade.inp", **{"mesh__unit": "mm", **changes}))
    found, _, error = shroud("validate", path)
    assert (found, error.count("\n")) == (status, 1 if said else 0), error
    assert re.search(said, error), error
    if "--force" in said:
        found, _, error = shroud("validate", path, "--force")
        assert found == 0
        assert 'with unit = "mm" density of material steel is 7.85e+06 kg/m^3' in error


def test_a_run_takes_what_the_file_has_and_says_so_every_time(steel_deck: str, tmp_path: Path) -> None:
    """Of one geometry sqrt(E / rho) scales free frequencies; stuck ones depend on the unit of force too."""
    found = {}
    for name, numbers, changes in (
        ("mm", "*ELASTIC\n2.1e5, 0.3\n*DENSITY\n7.85e-9\n", {}),
        ("mm-kg-s", MM_KG_S, {"mesh__unit": "mm-kg-s"}),
        ("aluminium", HOT.replace("2.1e5", "7e4"), {"materials": {"steel": {"density": 2700.0}}}),
    ):
        (tmp_path / "blade.inp").write_text(with_numbers(steel_deck, numbers))
        scene = scene_with_mesh("blade.inp", name=name, **{"mesh__unit": "mm", **changes})
        found[name] = frequencies(tmp_path, scene)
    for k in (0, 1):
        np.testing.assert_allclose(found["mm-kg-s"][k], found["mm"][k], rtol=1e-9)
    ratio = np.sqrt(7e10 / 2700.0 / (2.1e11 / 7850.0))
    np.testing.assert_allclose(found["aluminium"][0], ratio * found["mm"][0], rtol=1e-9)
    assert any(
        "density 2700 kg/m^3 ([materials.steel])" in line
        for line in found["aluminium"][2]["models"][0]["mesh_findings"]
    )
    again = shroud("run", tmp_path / "aluminium.toml", "--out", tmp_path / "aluminium", "--until", "reduce")
    assert "warning: material steel depends on the temperature" in again[2]
    (tmp_path / "blade.inp").write_text(with_numbers(steel_deck, KG_MM3))
    status, _, error = shroud("run", tmp_path / "mm.toml", "--out", tmp_path / "mm", "--until", "reduce", "--quiet")
    assert (status, error.count("\n")) == (2, 1)
    assert "mesh.unit" in error


def test_a_new_scene_has_the_materials_of_the_run(steel_deck: str, tmp_path: Path) -> None:
    """Density in kg/mm^3 beside MPa, no Poisson's ratio."""
    (tmp_path / "blade.inp").write_text(with_numbers(steel_deck, "*ELASTIC\n7e4\n*DENSITY\n2.7e-6\n"))
    scene = tmp_path / "mine" / "scene.toml"
    status, said, error = shroud("new", tmp_path / "mine", "--mesh", tmp_path / "blade.inp")
    assert status == 0
    assert "material steel: density = 2700 (2.7e-06 kg/mm^3)" in said
    assert "material steel: Young's modulus 7e+10 Pa (of the file); density 2700 kg/m^3 ([materials.steel])" in said
    assert "materials.steel.poisson_ratio: missing" in error
    assert "[material]" not in scene.read_text()
    assert shroud("validate", scene)[0] == 2
    scene.write_text(scene.read_text().replace("# poisson_ratio = ...", "poisson_ratio = 0.33"))
    assert shroud("validate", scene)[0] == 0

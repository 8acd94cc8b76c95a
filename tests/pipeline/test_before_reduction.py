"""What the reduction of a mesh from a file needs is said by new and validate, and new writes what the mesh has."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from mesh_decks import Body, write_deck
from mesh_file_scenes import scene_with_mesh, small_sector, with_mid_sides
from mesh_writer import write_mesh
from pipeline_support import shroud, small_scene, write_scene

from geometry import MeshFileError, read_mesh

BLADE = Body((100.0, 120.0), (-5.0, 5.0), (0.0, 20.0), (1, 4, 3))
FACES = {
    "root": lambda body, r, angle, z: r < 100.1,
    "shroud right": lambda body, r, angle, z: (angle > 4.99) & (r > 99.9),
    "shroud left": lambda body, r, angle, z: (angle < -4.99) & (r > 99.9),
}


def made(folder: Path, deck: Path) -> dict:
    """The scene that new makes of a deck, which validate and the reduction take."""
    status, _, error = shroud("new", folder / "n", "--mesh", deck, "--blades", "36")
    assert status == 0, error
    assert shroud("validate", folder / "n" / "scene.toml")[0] == 0
    status, _, error = shroud("run", folder / "n" / "scene.toml", "--out", folder / "out", "--until", "reduce")
    assert status == 0, error
    return tomllib.loads((folder / "n" / "scene.toml").read_text())


def test_a_face_of_few_sides_gets_few_contact_nodes(tmp_path: Path) -> None:
    scene = made(tmp_path, write_deck(tmp_path / "b.inp", [BLADE], FACES))
    grid = scene["mesh"]["contact_grid"]
    assert np.prod(grid) < 9
    text = (tmp_path / "n" / "scene.toml").read_text().replace(str(grid), "[3, 3]")
    (tmp_path / "n" / "scene.toml").write_text(text)
    status, _, error = shroud("validate", tmp_path / "n" / "scene.toml")
    assert status == 2
    assert "fewer contact nodes" in error


def test_the_range_is_about_the_mode_that_the_engine_order_excites(tmp_path: Path) -> None:
    """The first bending of this plate is axial, at some 500 Hz, and the force is circumferential."""
    plate = Body((100.0, 160.0), (-5.0, 5.0), (0.0, 2.0), (8, 4, 2))
    assert (
        shroud("new", tmp_path / "n", "--mesh", write_deck(tmp_path / "b.inp", [plate], FACES), "--blades", "36")[0]
        == 0
    )
    text = (tmp_path / "n" / "scene.toml").read_text()
    low, high = tomllib.loads(text)["response"]["frequency"]
    assert 1500.0 < low < 4000.0 < high
    assert "Hz, around the first mode that this engine order excites" in text


def test_a_face_across_the_engine_axis(tmp_path: Path) -> None:
    """Of a damper beside the blade."""
    blade = Body((100.0, 120.0), (-3.0, 3.0), (0.0, 20.0), (3, 3, 3))
    bodies = [blade, Body((100.0, 120.0), (-3.0, 3.0), (20.0, 30.0), (3, 3, 3))]
    sets = {
        "root": lambda body, r, angle, z: r < 100.1,
        "own face": lambda body, r, angle, z: (body == 0) & (z > 19.9),
        "damper face": lambda body, r, angle, z: (body == 1) & (z < 20.1),
    }
    scene = write_deck(tmp_path / "b.inp", bodies, sets)
    assert [each["kind"] for each in made(tmp_path, scene)["mesh"]["interface"].values()] == ["inside"]


def test_mid_side_nodes_in_the_order_of_another_program(tmp_path: Path) -> None:
    blade = with_mid_sides(small_sector(0.02), "hex20")
    write_mesh(tmp_path / "good.inp", blade)
    read_mesh(tmp_path / "good.inp")
    swapped = blade.blocks[0].nodes.copy()
    swapped[:, [18, 19]] = swapped[:, [19, 18]]
    blade.blocks[0].nodes[:] = swapped
    write_mesh(tmp_path / "bad.inp", blade)
    with pytest.raises(MeshFileError, match="mid-side nodes that are not between their corners"):
        read_mesh(tmp_path / "bad.inp")


def test_validate_says_that_a_surface_does_not_exist(tmp_path: Path) -> None:
    made_here = small_scene(load__pressure=[{"surface": "NOWHERE", "pressure": 1e3}])
    status, _, error = shroud("validate", write_scene(tmp_path / "made.toml", made_here))
    assert status == 2
    assert 'load.pressure[0].surface: "NOWHERE", allowed: one of contact_left' in error
    write_mesh(tmp_path / "blade.inp", with_mid_sides(small_sector(0.02), "hex20"))
    scene = scene_with_mesh("blade.inp", load__pressure=[{"surface": "NOWHERE", "pressure": 1e3}])
    status, _, error = shroud("validate", write_scene(tmp_path / "s.toml", scene))
    assert status == 2
    assert '"NOWHERE", allowed: a surface of the mesh' in error

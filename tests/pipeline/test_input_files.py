"""Files exchanged between any two steps: what is used is what was hashed when the scene was read, or is refused."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mesh_file_scenes import scene_with_mesh, small_sector
from mesh_writer import write_mesh
from pipeline_support import changing_when_locked, shroud, small_scene, write_scene

import pipeline.scene.input_files
from geometry.mesh_files import read as mesh_reading
from pipeline.errors import InputError
from pipeline.scene.input_files import content_hash, file_parts
from pipeline.scene.loads_section import force_table, temperature_table
from pipeline.scene.reading import input_files, read_scene
from pipeline.scene.schema import Scene
from pipeline.stages.cache_keys import model_keys
from pipeline.stages.model.build_from_matrices import read_matrices
from pipeline.stages.model.build_mesh import read_mesh_file
from rom.matrix_files import matrix_model

NODES = "*NODE\n1, 0., 0., 0.\n2, 1., 0., 0.\n3, 0., 1., 0.\n4, 0., 0., 1.\n"
MAIN = "*INCLUDE, INPUT=parts/nodes.inc\n*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n"
CHANGED = "changed since the scene was read, allowed: a file that stays as it is while it is used: run again"
Read = Callable[[Scene], float]


def mesh_case(folder: Path) -> tuple[Scene, Path, Read]:
    """A deck with an included file: the height of its tetrahedron."""
    (folder / "parts").mkdir()
    (folder / "blade.inp").write_text(MAIN)
    (folder / "parts" / "nodes.inc").write_text(NODES)
    scene = read_scene(write_scene(folder / "s.toml", scene_with_mesh("blade.inp"))).first
    return (
        scene,
        folder / "parts" / "nodes.inc",
        lambda scene: read_mesh_file(str(scene.mesh_file), scene.contents).points[:, 2].max(),
    )


def matrix_case(folder: Path) -> tuple[Scene, Path, Read]:
    """Two masses on springs: the stiffness of one."""
    for name in ("K", "M"):
        rows = "".join(f"{k} {k} 1.0\n" for k in range(1, 7))
        (folder / f"{name}.mtx").write_text(f"%%MatrixMarket matrix coordinate real symmetric\n6 6 6\n{rows}")
    table = ["node,x,y,z,sets,nx,ny,nz,area"]
    table += ["1,0,0.05,1,contact_right,0,1,0,1e-4", "2,0,-0.05,1,contact_left tip,0,-1,0,1e-4"]
    (folder / "nodes.csv").write_text("\n".join(table))
    files = {"stiffness": "K.mtx", "mass": "M.mtx", "nodes": "nodes.csv"}
    contents = small_scene(model={**files, "n_blades": 63, "tolerance": 1e-2})
    for name in ("blade", "shroud", "mesh"):
        del contents[name]
    scene = read_scene(write_scene(folder / "s.toml", contents)).first
    return scene, folder / "K.mtx", lambda scene: read_matrices(scene).full.stiffness[0, 0]


def table_case(folder: Path, section: str) -> tuple[Scene, Path, Read]:
    """A CSV file of forces or temperatures: its one value."""
    column, read = {"force": ("fz", force_table), "temperature": ("temperature", temperature_table)}[section]
    (folder / "t.csv").write_text(f"node,{column}\n0,1.0\n")
    given: Any = (
        {"file": "t.csv", "reference": 20.0} if section == "temperature" else [{"file": "t.csv", "force": 1.0}]
    )
    contents = small_scene(load={section: given}, material__expansion=1e-5)
    scene = read_scene(write_scene(folder / "s.toml", contents)).first
    return scene, folder / "t.csv", lambda scene: float(np.max(read(*input_files(scene), scene.contents).values))


CASES: dict[str, Callable[[Path], tuple[Scene, Path, Read]]] = {
    "mesh": mesh_case,
    "matrices": matrix_case,
    "force": lambda folder: table_case(folder, "force"),
    "temperature": lambda folder: table_case(folder, "temperature"),
}


@pytest.mark.parametrize("case", CASES)
def test_a_file_exchanged_after_it_was_hashed_is_refused(case: str, tmp_path: Path) -> None:
    """In place, by another of the same size, and put back; the keys are those of what was hashed."""
    scene, file, read = CASES[case](tmp_path)
    text, keys = file.read_text(), model_keys(scene)
    assert read(scene) == 1.0
    file.write_text(text.replace("1.", "2."))
    assert model_keys(scene) == keys
    with pytest.raises(InputError, match=CHANGED):
        read(scene)
    file.unlink()
    file.write_text(text)
    assert read(scene) == 1.0
    (tmp_path / "other").write_text(text.replace("1.", "3."))
    (tmp_path / "other").replace(file)
    with pytest.raises(InputError, match=CHANGED):
        read(scene)
    scene = read_scene(tmp_path / "s.toml").first  # run again
    assert read(scene) == 3.0
    assert model_keys(scene) != keys


@pytest.mark.parametrize("case", ["mesh", "matrices"])
def test_a_file_exchanged_while_it_is_read(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before its copy is complete: refused. Before its reader opens it: the copy counts."""
    scene, file, read = CASES[case](tmp_path)
    text, copy = file.read_text(), pipeline.scene.input_files._copy
    place, name = (mesh_reading, "read_mesh") if case == "mesh" else (matrix_model, "model_from_matrices")
    reader = getattr(place, name)

    def exchanged_then(function: Callable[..., Any]) -> Callable[..., Any]:
        def first_exchanged(*arguments: Any) -> Any:
            file.write_text(text.replace("1.", "2."))
            return function(*arguments)

        return first_exchanged

    with monkeypatch.context() as patch:
        patch.setattr(place, name, exchanged_then(reader))
        assert read(scene) == 1.0
    assert "2." in file.read_text()
    file.write_text(text)
    monkeypatch.setattr(pipeline.scene.input_files, "_copy", exchanged_then(copy))
    with pytest.raises(InputError, match=CHANGED):
        read(scene)


def test_a_mesh_exchanged_while_the_run_waits(tmp_path: Path) -> None:
    """Nothing is stored; the same command then runs with the new one."""
    sector, mesh, out = small_sector(0.02), tmp_path / "blade.inp", tmp_path / "out"
    write_mesh(mesh, sector)
    text = mesh.read_text()
    scene = write_scene(tmp_path / "s.toml", scene_with_mesh("blade.inp"))
    command = ("run", scene, "--out", out, "--until", "mesh", "--quiet")
    with changing_when_locked(lambda: mesh.write_text(text + "** another\n")):
        status, _, error = shroud(*command)
    assert (status, error) == (2, f"{mesh}: {CHANGED}\n")
    assert not list(out.rglob("sector.h5"))
    assert shroud(*command) == (0, "", "")
    assert len(list(out.rglob("sector.h5"))) == 1


def test_messages_name_the_file_and_not_its_copy(tmp_path: Path) -> None:
    scene, file, read = mesh_case(tmp_path)
    file.write_text(NODES.replace("4, 0., 0., 1.\n", ""))
    scene = read_scene(tmp_path / "s.toml").first
    with pytest.raises(InputError, match=f"^{tmp_path}/blade.inp: .*names node 4, which is not defined"):
        read(scene)
    file.write_text(NODES.replace("3, 0., 1.", "3, zero, 1."))
    with pytest.raises(InputError, match=f"^{tmp_path}/[a-z./]*: ") as caught:
        read(read_scene(tmp_path / "s.toml").first)
    assert "/shroud-" not in str(caught.value)


def test_links_are_followed_for_the_file_itself_and_inside_its_folder(tmp_path: Path) -> None:
    inside, outside = tmp_path / "inside", tmp_path / "outside"
    for folder in (inside, outside):
        folder.mkdir()
        (folder / "nodes.inc").write_text(NODES)
    (outside / "deck.inp").write_text(MAIN.replace("parts/nodes.inc", "link.inc"))
    (inside / "blade.inp").symlink_to(outside / "deck.inp")
    (inside / "link.inc").symlink_to(inside / "nodes.inc")
    assert read_mesh_file(str(inside / "blade.inp")).n_elements == 1
    before = content_hash(str(inside / "blade.inp"))
    (inside / "nodes.inc").write_text(NODES + "5, 2., 2., 2.\n")
    assert content_hash(str(inside / "blade.inp")) != before
    (inside / "link.inc").unlink()
    (inside / "link.inc").symlink_to(outside / "nodes.inc")
    assert [part.name for part in file_parts(str(inside / "blade.inp"))] == ["blade.inp", "link.inc"]
    with pytest.raises(InputError, match="only files in its own folder can be included"):
        read_mesh_file(str(inside / "blade.inp"))

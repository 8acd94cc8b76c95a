"""Contact interfaces of meshes from elsewhere: kinds, patches, several bodies, files, and what is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from own_mesh_support import N_BLADES as OF_DUMMY
from own_mesh_support import NAMES, dummy, imported

from benchmarks.root_mesh import N_BLADES, root_mesh
from geometry import read_mesh
from geometry.errors import OwnMeshError
from geometry.exchange import export_sector, import_sector
from geometry.own_mesh.own_sector import sector_from_mesh
from geometry.own_mesh.sector_choice import InterfaceChoice, SectorChoice
from geometry.subdivision import subdivided
from rom.files.sector_file import load_sector, save_sector

SETS = {"root": "BORE", "cyclic_right": "CYCLIC_HIGH", "cyclic_left": "CYCLIC_LOW"}
ROOT = InterfaceChoice("BLADE_FLANKS", "DISK_FLANKS", "inside", (3, 2))


def choice(**interfaces: InterfaceChoice) -> SectorChoice:
    return SectorChoice(N_BLADES, "m", sets=SETS, interfaces=interfaces)


def same_face(one, other, tolerance=1e-12):
    assert np.array_equal(one.nodes, other.nodes)
    for name in ("position", "frame", "area"):
        assert getattr(one, name) == pytest.approx(getattr(other, name), abs=tolerance)


def test_a_shroud_that_is_named_as_an_interface_is_that_of_the_sets():
    mesh = imported(dummy())
    faces = {"shroud": InterfaceChoice("PS_FACE", "SS_FACE")}
    sets = SectorChoice(OF_DUMMY, sets=NAMES)
    named = SectorChoice(OF_DUMMY, sets={"root": "ROOT"}, interfaces=faces)
    one, other = (sector_from_mesh(mesh, each) for each in (sets, named))
    assert one.findings.lines == other.findings.lines
    for side in ("right", "left"):
        same_face(getattr(one.sector, side), getattr(other.sector, side))


def test_flanks_are_patches_of_one_interface_and_face_each_other():
    sector = sector_from_mesh(root_mesh(), choice(root=ROOT)).sector
    assert [sector.main, *sector.pairs] == ["root/1", "root/2"]
    assert sector.interfaces == {"root": 12}
    for view in sector.views.values():
        assert view.kind == "inside"
        assert view.turn == 0.0
        assert view.left.position == pytest.approx(view.right.position, abs=1e-12)
        assert view.left.frame == pytest.approx(view.right.frame, abs=1e-12)
        side = np.sign(view.right.position[:, 1])
        assert view.right.frame[:, 2] == pytest.approx(
            np.outer(np.ones(6), [0, 6, 4]) / np.sqrt(52) * (np.stack([side, side, np.ones(6)], axis=1)), abs=1e-9
        )


def test_a_finer_mesh_has_the_faces_of_every_patch():
    finer = subdivided(sector_from_mesh(root_mesh(), choice(root=ROOT)).sector)
    sizes = {len(view.node_sets[f"face_{side}"]) for view in finer.views.values() for side in ("right", "left")}
    assert sizes == {93}  # 6 x 4 sides of 20-node hexahedra


def test_files_keep_kinds_and_patches(tmp_path):
    sector = sector_from_mesh(root_mesh(), choice(root=replace(ROOT, contact_grid=(3, 1)))).sector
    for name, write, read in (("s.vtu", export_sector, import_sector), ("s.h5", save_sector, load_sector)):
        write(tmp_path / name, sector)
        back = read(tmp_path / name)
        assert back.interfaces == sector.interfaces
        assert [(each, view.kind) for each, view in back.views.items()] == [
            ("root/1", "inside"),
            ("root/2", "inside"),
        ]
        same_face(back.pairs["root/2"].left, sector.pairs["root/2"].left)


def test_a_damper_is_a_body_with_an_interface_inside_and_one_with_the_neighbour():
    faces = {
        "root": ROOT,
        "damper": InterfaceChoice("PLATFORM_RIGHT", "DAMPER_OWN", "inside", (2, 2)),
        "next": InterfaceChoice("DAMPER_NEXT", "PLATFORM_LEFT", "neighbours", (2, 2)),
    }
    own = sector_from_mesh(root_mesh(damper=True), choice(**faces))
    assert own.sector.interfaces == {"root": 12, "damper": 4, "next": 4}
    assert sum("held by contacts alone" in line for line in own.findings.lines) == 2


def refused(mesh, **interfaces):
    with pytest.raises(OwnMeshError) as error:
        sector_from_mesh(mesh, choice(**interfaces))
    return str(error.value)


def test_what_does_not_fit_is_said_in_one_line():
    mesh = root_mesh()
    flanks = mesh.node_sets["DISK_FLANKS"]
    apart = replace(mesh, points=mesh.points.copy())
    blade = slice(0, 974)
    apart.points[blade, 2] -= 0.003
    assert "mesh.interface.root.left = 'DISK_FLANKS': must lie opposite" in refused(apart, root=ROOT)
    neighbours = replace(ROOT, kind="neighbours")
    told = refused(mesh, root=neighbours)
    assert 'kind = "inside" would fit' in told
    assert "mesh.interface.root.left = 'DISK_FLANKS'" in told
    told = refused(mesh, root=ROOT, other=InterfaceChoice("DISK_FLANKS", kind="ground"))
    assert "mesh.interface.other.right = 'DISK_FLANKS': must have no element face of another" in told
    half = {"HALF": flanks[mesh.points[flanks, 1] > 0.0]}
    mesh = replace(mesh, node_sets=mesh.node_sets | half)
    assert "has 1 separate patches" in refused(mesh, root=replace(ROOT, left="HALF"))
    told = refused(mesh, tip=InterfaceChoice("TIP", kind="ground", contact_grid=(1, 1)))
    assert "nothing holds it even where all contacts stick" in told
    assert "it touches at tip alone" in told
    assert "no such set; near: BLADE_FLANKS" in refused(mesh, root=replace(ROOT, right="BLADE_FLANK"))
    with pytest.raises(OwnMeshError, match=r"must be one connected body; there are 2.*mesh\.interface\.NAME"):
        sector_from_mesh(mesh, choice())


def test_faces_that_are_a_pitch_apart_are_none_inside_the_sector():
    mesh = imported(dummy())
    faces = {"shroud": InterfaceChoice("PS_FACE", "SS_FACE", "inside")}
    with pytest.raises(OwnMeshError, match=r'mesh\.interface\.shroud\.left.*kind = "neighbours" would fit'):
        sector_from_mesh(mesh, SectorChoice(OF_DUMMY, sets={"root": "ROOT"}, interfaces=faces, other_faces="free"))


def test_faces_with_normals_that_point_the_same_way_are_refused():
    mesh = imported(dummy())
    faces = {"shroud": InterfaceChoice("PS_FACE", "TIP", "inside")}
    with pytest.raises(OwnMeshError, match=r"mesh\.interface\.shroud\.left = 'TIP'"):
        sector_from_mesh(mesh, SectorChoice(OF_DUMMY, sets={"root": "ROOT"}, interfaces=faces, other_faces="free"))


@pytest.mark.parametrize(
    ("key", "faces"),
    [
        ("mesh.interface.a.left", InterfaceChoice("X")),
        ("mesh.interface.a.left", InterfaceChoice("X", "Y", "ground")),
        ("mesh.interface.a.kind", InterfaceChoice("X", "Y", "outside")),
        ("mesh.interface.a.contact_grid", InterfaceChoice("X", "Y", contact_grid=(0, 2))),
    ],
)
def test_bad_values_are_named_by_their_keys(key, faces):
    with pytest.raises(OwnMeshError, match=rf"^{key}"):
        SectorChoice(40, interfaces={"a": faces})


def test_the_mesh_of_the_shipped_scene_is_the_one_described():
    shipped = read_mesh(Path(__file__).parents[2] / "scenes/root.inp")
    made = root_mesh()
    assert shipped.points == pytest.approx(made.points, abs=1e-12)
    assert np.array_equal(shipped.blocks[0].nodes, made.blocks[0].nodes)

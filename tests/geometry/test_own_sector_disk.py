"""Sectors of bladed disks from mesh files: cut faces by name, their pairs, and what is refused."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from mesh_writer import write_mesh
from own_mesh_support import NAMES, dummy, five_tets, imported, wedge, with_sets

from geometry import (
    BladeParameters,
    DiskParameters,
    ElementBlock,
    MeshParameters,
    ShroudParameters,
    build_sector,
    read_mesh,
)
from geometry.errors import OwnMeshError
from geometry.own_mesh.own_sector import sector_from_mesh
from geometry.own_mesh.sector_choice import SectorChoice
from pipeline.new_scene.mesh_survey import guess

CUTS = ("cyclic_right", "cyclic_left")


@cache
def made():
    blade = BladeParameters(72, 0.3, 0.08, chord=0.036, thickness=0.009, twist=25.0, section="lens")
    shroud = ShroudParameters(70.0, thickness=0.005, axial_width=0.04, contact_length=0.012)
    disk = DiskParameters(bore_radius=0.2, rim_width=0.05)
    return build_sector(blade, shroud, MeshParameters(size=0.018, grading=1.0), disk)


def in_file(**names):
    """The sector as a file has it, its cut faces under other names."""
    sets = made().node_sets
    return with_sets(imported(made()), **{name: np.sort(sets[role]) for name, role in names.items()})


def own(mesh, n_blades=72, **sets):
    return sector_from_mesh(mesh, SectorChoice(n_blades, sets=NAMES | sets))


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ({"Cyclic_Right": "cyclic_right", "CYCLIC_LEFT": "cyclic_left"}, {}),
        ({"high": "cyclic_right", "low": "cyclic_left"}, {"cyclic_right": "HIGH", "cyclic_left": "low"}),
        ({"low": "cyclic_right", "high": "cyclic_left"}, {"cyclic_right": "high", "cyclic_left": "low"}),
    ],
    ids=["by name", "as named", "swapped"],
)
def test_cut_faces_come_back(names, said):
    """Where the contact faces are not named, the cut faces are not among those to choose from."""
    found = own(in_file(**names), **said)
    for role in CUTS:
        assert np.array_equal(found.sector.node_sets[role], np.sort(made().node_sets[role]))
    assert np.array_equal(found.sector.right.nodes, made().right.nodes)
    count = len(made().node_sets["cyclic_right"])
    assert f"sector of a disk: {count} nodes of each cut face are joined to the neighbours" in found.findings.lines
    swapped = any("right and left cut face swapped: right is" in line for line in found.findings.lines)
    assert swapped == (names.get("high") == "cyclic_left")
    with pytest.raises(OwnMeshError, match=r"3 pairs of surfaces are .* at radius 0\.375 to 0\.38 m"):
        sector_from_mesh(in_file(**names), SectorChoice(72, sets={"root": "ROOT"} | said))


def test_a_blade_alone_has_none():
    assert not set(CUTS) & set(own(imported(dummy())).sector.node_sets)


@pytest.mark.parametrize(
    ("right", "left"),
    [
        ("CYCLIC_M01H", "CYCLIC_M01L"),  # Ansys, command CYCLIC
        ("rotor_u02h", "rotor_u02l"),  # the same with a name of its own, nodes that need not match
        ("Cyclic_High", "Cyclic_Low"),
        ("HIGH", "LOW"),
        ("sector high", "sector low"),
        ("cyc_2", "cyc_1"),
        ("PERIODIC_SLAVE", "PERIODIC_MASTER"),
    ],
)
def test_names_of_other_programs_tell_cut_faces_from_contact_faces(right, left):
    names = {right: "cyclic_right", left: "cyclic_left"}
    found = own(in_file(**names))
    for role in CUTS:
        assert np.array_equal(found.sector.node_sets[role], np.sort(made().node_sets[role]))
    assert any(right in note and left in note for note in found.findings.notes)
    told = guess(in_file(**names)).sets  # what `shroud new` would write
    assert (told["contact_right"], told["contact_left"]) == ("PS_FACE", "SS_FACE")
    bare = in_file(**names)
    unnamed = {name: rows for name, rows in bare.node_sets.items() if name not in NAMES.values()}
    assert "contact_right" not in guess(replace(bare, node_sets=unnamed)).sets


def test_the_tie_of_a_cyclic_symmetry_names_the_cut_faces(tmp_path):
    """*TIE, CYCLIC SYMMETRY of Abaqus and CalculiX."""
    write_mesh(
        tmp_path / "disk.inp", replace(made(), node_sets={**in_file(B="cyclic_right", A="cyclic_left").node_sets})
    )
    with (tmp_path / "disk.inp").open("a") as file:
        file.write("*SURFACE, NAME=SB, TYPE=NODE\nB\n*SURFACE, NAME=SA, TYPE=NODE\nA\n")
        file.write(
            "*TIE, NAME=T1, CYCLIC SYMMETRY, POSITION TOLERANCE=0.1\nSB, SA\n*CYCLIC SYMMETRY MODEL, N=72, TIE=T1\n"
        )
    mesh = read_mesh(tmp_path / "disk.inp")
    assert any("*TIE, CYCLIC SYMMETRY of SB and SA" in note for note in mesh.notes), mesh.notes
    found = own(mesh)
    assert np.array_equal(found.sector.node_sets["cyclic_right"], np.sort(made().node_sets["cyclic_right"]))


def test_components_of_several_pairs_of_edges_are_one_cut():
    radius = np.hypot(*made().points[:, 1:].T)
    parts = {}
    for role, end in (("cyclic_right", "H"), ("cyclic_left", "L")):
        nodes = np.sort(made().node_sets[role])
        middle = np.median(radius[nodes])
        parts |= {f"CYCLIC_M01{end}": nodes[radius[nodes] < middle + 1e-6]}
        parts |= {f"CYCLIC_M02{end}": nodes[radius[nodes] > middle - 1e-6]}
    found = own(with_sets(in_file(), **parts))
    assert np.array_equal(found.sector.node_sets["cyclic_left"], np.sort(made().node_sets["cyclic_left"]))
    del parts["CYCLIC_M02H"], parts["CYCLIC_M02L"]  # a part of the cut is not named
    with pytest.raises(OwnMeshError, match=r"mesh\.sets: 3 more pairs .* at radius 0\.26\d+ to 0\.3 m"):
        own(with_sets(in_file(), **parts))


def test_surfaces_that_match_and_have_no_name_are_asked_for():
    """Contact faces named, cut faces not: the sector is neither joined nor free until the scene says so."""
    mesh = in_file(FACE_A="cyclic_right", FACE_B="cyclic_left")
    with pytest.raises(OwnMeshError) as caught:
        own(mesh)
    for part in ("3 more pairs", "pitch of 5 degrees", 'sets "FACE_A", "FACE_B"', "25 nodes", "0.2 to 0.3 m", "mm^2"):
        assert part in str(caught.value)
    for word in ("cyclic_right", 'mesh.other_faces = "cut"', '"free"'):
        assert word in str(caught.value)
    joined = sector_from_mesh(mesh, SectorChoice(72, sets=NAMES, other_faces="cut")).sector
    assert np.array_equal(joined.node_sets["cyclic_right"], np.sort(made().node_sets["cyclic_right"]))
    free = sector_from_mesh(mesh, SectorChoice(72, sets=NAMES, other_faces="free"))
    assert not set(CUTS) & set(free.sector.node_sets)
    assert any(
        note.startswith("free surfaces that match under the pitch: 16 element faces") for note in free.findings.notes
    )
    crossed = {"contact_right": "FACE_A", "contact_left": "FACE_B"}  # the cut taken for the contact
    with pytest.raises(OwnMeshError, match=r"more pairs? .* at radius 0\.375 to 0\.38 m"):
        own(mesh, **crossed)
    with pytest.raises(OwnMeshError, match="is named as a cut face too"):
        own(mesh, **crossed, cyclic_right="FACE_A", cyclic_left="FACE_B")


def test_a_snubber_is_asked_for_and_sides_beside_the_contact_are_not():
    """Bricks with full width at the contact and at half height; the blade between is narrow."""
    whole = wedge(divisions=(2, 3, 5))
    j, k = (each.ravel() for each in np.meshgrid(range(2), range(3), range(5), indexing="ij")[1:])
    kept = whole.blocks[0].nodes[(j == 1) | (k == 4) | (k == 2)]
    middle = [(whole.points[whole.node_sets[name]], whole.node_sets[name]) for name in ("PS_FACE", "SS_FACE")]
    outer = {
        name: rows[np.hypot(*at[:, 1:].T) > 0.3155] for (at, rows), name in zip(middle, ("PS", "SS"), strict=True)
    }
    mesh = replace(with_sets(whole, **outer), blocks=(ElementBlock("hex8", kept),))
    names = {"root": "ROOT", "contact_right": "PS", "contact_left": "SS"}
    with pytest.raises(
        OwnMeshError, match=r"1 more pair of surfaces .*: 2 element faces, 6 nodes, .* 0\.308 to 0\.312 m"
    ):
        sector_from_mesh(mesh, SectorChoice(40, sets=names))
    assert sector_from_mesh(mesh, SectorChoice(40, sets=names, other_faces="free"))
    # the only pair reaches the root: contact or cut?
    (doubt,) = sector_from_mesh(wedge(), SectorChoice(40, sets={"root": "ROOT"})).findings.warnings
    assert "reach the innermost radius (12 element faces, 20 nodes" in doubt
    assert "cyclic_right and cyclic_left" in doubt
    beside = own(imported(dummy()))
    assert any(note.startswith("free element faces beside the contact faces") for note in beside.findings.notes)


@pytest.mark.parametrize("layers", [1, 2])
def test_cut_faces_of_tetrahedra_are_found_whole(layers):
    """The upper part of both walls is the contact, what is below is cut."""
    divisions = (3, layers, 4)
    mesh = five_tets(wedge(divisions=divisions), divisions)
    radius = np.hypot(*mesh.points[:, 1:].T)
    sides = {name: mesh.node_sets[name] for name in ("PS_FACE", "SS_FACE")}
    upper = {name: rows[radius[rows] > 0.3149] for name, rows in sides.items()}
    names = {"root": "ROOT", "contact_right": "PS_FACE", "contact_left": "SS_FACE"}
    found = sector_from_mesh(with_sets(mesh, **upper), SectorChoice(40, sets=names, other_faces="cut")).sector
    for role, name in zip(CUTS, sides, strict=True):
        assert np.array_equal(found.node_sets[role], np.sort(sides[name][radius[sides[name]] < 0.3151]))


def test_cut_faces_that_hold_the_contact_faces_are_the_rest():
    """As $Periodic of gmsh has them where the contact faces were made periodic too."""
    sets = made().node_sets
    both = {
        role: np.union1d(sets[role], sets[f"face_{side}"]) for role, side in zip(CUTS, ("right", "left"), strict=True)
    }
    found = own(with_sets(imported(made()), **both)).sector
    assert np.array_equal(found.node_sets["cyclic_right"], np.sort(sets["cyclic_right"]))


def test_cut_faces_that_do_not_fit_are_refused():
    mesh = in_file(high="cyclic_right", low="cyclic_left")
    with pytest.raises(OwnMeshError, match=r"mesh\.sets\.cyclic_left: .*name both cut faces of the disk, or neither"):
        own(mesh, cyclic_right="high")
    with pytest.raises(OwnMeshError, match="whole element faces"):
        own(with_sets(mesh, low=[0, 1]), cyclic_right="high", cyclic_left="low")
    moved = mesh.points.copy()
    inner = made().node_sets["cyclic_left"][5]
    moved[inner] *= 1.001
    with pytest.raises(OwnMeshError, match=r"node by node; a node has no partner within 0\.000"):
        own(replace(mesh, points=moved), cyclic_right="high", cyclic_left="low")
    sides = {"cyclic_right": "high", "cyclic_left": "TIP"}
    with pytest.raises(OwnMeshError, match="turned by one pitch, 5 degrees"):
        own(mesh, **sides)

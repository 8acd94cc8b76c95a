"""Careless and broken meshes: each is refused, or put right, in one line that says what is there and what is near."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from own_mesh_support import N_BLADES, NAMES, dummy, imported, wedge, with_sets

from geometry import ElementBlock, ElementSides, ImportedMesh
from geometry.errors import OwnMeshError
from geometry.own_mesh.own_sector import sector_from_mesh
from geometry.own_mesh.sector_choice import SectorChoice

TURN = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # our x is y of the file


def choice(**changes):
    return SectorChoice(**{"n_blades": N_BLADES, "sets": NAMES, **changes})


def named(**changes):
    """Sets with other names."""
    return choice(sets={**NAMES, **changes})


def moved_face(vector, angle=180.0):
    """The right face moved rigidly: the faces are no longer images of each other."""
    mesh = imported(dummy(angle))
    points = mesh.points.copy()
    points[mesh.node_sets["PS_FACE"]] += vector
    return replace(mesh, points=points)


def mirrored_left(angle):
    """The left face replaced by the mirror image of the right one."""
    mesh = imported(dummy(angle))
    sector = dummy(angle)
    points = mesh.points.copy()
    points[sector.node_sets["face_left"]] = points[sector.node_sets["face_right"]] * [1.0, -1.0, 1.0]
    return replace(mesh, points=points)


def part_of_left():
    """The left set with the nodes of one half only."""
    mesh = imported(dummy())
    left = mesh.node_sets["SS_FACE"]
    return with_sets(mesh, SS_FACE=left[mesh.points[left, 0] < 1e-9])


def two_bodies():
    mesh = imported(dummy())
    block, n = mesh.blocks[0], len(mesh.points)
    twice = ElementBlock("hex8", np.concatenate([block.nodes, block.nodes[:3] + n]))
    points = np.concatenate([mesh.points, mesh.points + 1.0])
    return replace(mesh, points=points, node_labels=np.arange(2 * n), blocks=(twice,))


def inside_out():
    mesh = imported(dummy())
    block = ElementBlock("hex8", mesh.blocks[0].nodes[:, [0, 3, 2, 1, 4, 7, 6, 5]])
    return replace(mesh, blocks=(block,))


def loose_root():
    """A root set whose nodes no element uses, as from a part that was left out."""
    mesh, n = imported(dummy()), len(dummy().points)
    points = np.concatenate([mesh.points, mesh.points[:5] - 0.01])
    mesh = replace(mesh, points=points, node_labels=np.arange(n + 5))
    return with_sets(mesh, ROOT=np.arange(n, n + 5))


def empty():
    return ImportedMesh("beam.inp", np.eye(3), np.arange(3), (), ())


def inside_set():
    """A set of nodes in the middle of the blade."""
    mesh = wedge(divisions=(4, 4, 4))
    y = np.arctan2(mesh.points[:, 1], mesh.points[:, 2])
    return with_sets(mesh, PS_FACE=np.flatnonzero(np.abs(y) < 1e-9))


FULL = imported(dummy())
CASES = {
    "mm taken for m": (
        imported(dummy(), 1e-3),
        choice(),
        "mesh.unit = 'm': the outer radius .* 380 m; with .mm. .0.38 m.",
    ),
    "m taken for mm": (FULL, choice(unit="mm"), "mesh.unit = 'mm': .* 0.00038 m; with .m. .0.38 m."),
    "unknown unit": (FULL, {"unit": "cm"}, "mesh.unit = 'cm': must be one of m, mm, in"),
    "wrong axis": (FULL, choice(axis="z"), r"mesh.axis = 'z': .*; they are with \"x\""),
    "unknown axis": (FULL, {"axis": "r"}, "mesh.axis = 'r': must be one of x, -x"),
    "axis of length 0": (FULL, {"axis": (0, 0, 0)}, "mesh.axis = .*not all 0"),
    "wrong point of the axis": (
        imported(dummy()),
        choice(axis_point=(0.0, 0.05, 0.0)),
        "mesh.axis = 'x': .*same radius",
    ),
    "too few blades": (
        FULL,
        choice(n_blades=60),
        r"mesh.n_blades = 60: .* 5 degrees apart, not 6; n_blades = 72 would",
    ),
    "no ring": (FULL, {"n_blades": 1}, "mesh.n_blades = 1: must be a whole number from 3"),
    "name nearly right": (
        FULL,
        named(root="Roots"),
        "mesh.sets.root = 'Roots': the file has no such set; near: ROOT",
    ),
    "name far off": (FULL, named(root="xyz"), "no such set; it has PS_FACE, ROOT, SS_FACE, TIP"),
    "no sets at all": (replace(FULL, node_sets={}), choice(), "the file has no node sets and no surfaces"),
    "empty set": (with_sets(FULL, ROOT=np.empty(0, int)), choice(), "mesh.sets.root = 'ROOT': this set has no node"),
    "no whole side": (
        with_sets(FULL, PS_FACE=dummy().node_sets["face_right"][::7]),
        choice(),
        r"mesh.sets.contact_right = 'PS_FACE': must hold whole element faces .* set of nodes \(\d+\) with no whole",
    ),
    "sides inside": (
        inside_set(),
        choice(n_blades=40),
        "16 set of nodess? inside|sides inside the body|inside the body",
    ),
    "set of elements": (
        replace(FULL, node_sets={}, element_sets={"PS_FACE": np.array([[0, 1]])}),
        choice(),
        "is a set of elements; must be a node set or a surface",
    ),
    "one face named": (FULL, choice(sets={"contact_right": "PS_FACE"}), "mesh.sets.contact_left: name both contact"),
    "the same set twice": (FULL, named(contact_left="PS_FACE"), "must have no node of contact_right"),
    "clamped face": (
        FULL,
        named(root="PS_FACE"),
        "mesh.sets.root = 'PS_FACE': must not hold a contact face: 16 element faces",
    ),
    "root beside the mesh": (loose_root(), choice(), "mesh.sets.root = 'ROOT': this set has no node of an element"),
    "tip nearly right": (FULL, named(tip="TIPS"), "mesh.sets.tip = 'TIPS': the file has no such set; near: TIP"),
    "root of two nodes": (
        with_sets(FULL, ROOT=[400, 401]),
        choice(),
        "three nodes that are not on one line; it has 2",
    ),
    "part of a face": (
        part_of_left(),
        choice(),
        r"contact faces are .* axial position|area of the right face|axial pos",
    ),
    "faces at two radii": (moved_face([0.0, 0.0, 0.004]), choice(), "same radius; right 0.38.* m, left 0.37"),
    "faces at two axial places": (moved_face([0.004, 0.0, 0.0]), choice(), "same axial position; right 0.004 m"),
    "faces overlap in part": (
        moved_face([0.0, 0.0, 0.0012]),
        choice(),
        r"opposite .* only [78]\d\.?\d* % of the right",
    ),
    "faces apart": (moved_face([0.0, 0.004, 0.0]), choice(), "5.60623 degrees apart, not 5; n_blades = 64 would fit"),
    "mirrored faces": (mirrored_left(45.0), choice(), "mirror image of the right face"),
    "no elements": (empty(), choice(), "mesh.file = 'beam.inp': must hold solid elements; there are none"),
    "two bodies": (two_bodies(), choice(), r"one connected body; there are 2, of \d+, 3 elements: merge"),
    "inside out": (inside_out(), choice(), "turned inside out .* mirrored mesh"),
    "a point missing": (replace(FULL, points=FULL.points * np.nan), choice(), "a node that is not finite"),
    "grid of 0": (FULL, {"contact_grid": (0, 3)}, "mesh.contact_grid = .*whole numbers from 1"),
    "unknown role": (FULL, {"sets": {"tips": "TIP"}}, "mesh.sets.tips = 'TIP': the sets of a sector are root"),
    "a blade alone that nothing holds": (FULL, {"bore": "free"}, "mesh.bore = 'free': needs the cut faces of a disk"),
    "a bore that is neither": (FULL, {"bore": "held"}, "mesh.bore = 'held': must be one of clamped, free"),
    "tolerance below 0": (FULL, {"tolerance": -1.0}, "mesh.tolerance = -1.0: must be above 0"),
    "faces not found": (FULL, SectorChoice(71), "mesh.sets.contact_right: name the faces: .* with n_blades = 72"),
    "faces not unique": (
        imported(dummy(70.0)),
        SectorChoice(72),
        "3 pairs of surfaces are one pitch apart: 16 element faces, 25 nodes, 60 mm.2 at",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_careless_mesh_is_refused_in_one_line(name):
    mesh, chosen, message = CASES[name]
    with pytest.raises(OwnMeshError, match=message) as caught:
        sector_from_mesh(mesh, chosen if isinstance(chosen, SectorChoice) else choice(**chosen))
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 330
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_what_can_be_put_right_is_put_right_and_said():
    swapped = named(contact_right="SS_FACE", contact_left="PS_FACE")
    wanted = sector_from_mesh(FULL, choice())
    found = sector_from_mesh(FULL, swapped)
    assert "right and left face swapped: right is the one on the +y side" in " ".join(found.findings.lines)
    np.testing.assert_array_equal(found.sector.right.nodes, wanted.sector.right.nodes)
    loose = replace(
        FULL, points=np.concatenate([FULL.points, [[9.0, 9.0, 9.0]]]), node_labels=np.arange(len(FULL.points) + 1)
    )
    found = sector_from_mesh(loose, choice())
    assert "1 nodes belong to no element and are left out" in found.findings.lines
    np.testing.assert_array_equal(found.sector.points, wanted.sector.points)
    # names without sets: found where only one pair of surfaces can be meant
    found = sector_from_mesh(FULL, choice(sets={}))
    assert sum("found" in line for line in found.findings.lines) == 2
    np.testing.assert_array_equal(found.sector.node_sets["root"], np.sort(wanted.sector.node_sets["root"]))


def test_a_surface_counts_before_a_node_set_of_the_same_name():
    mesh, sector = FULL, sector_from_mesh(FULL, choice()).sector
    face = sector.surfaces["face_right"]
    half = ElementSides(face.block[:8], face.element[:8], face.side[:8])
    with pytest.raises(OwnMeshError, match="must be at the same radius"):
        sector_from_mesh(replace(mesh, surfaces={"PS_FACE": half}), choice())
    found = sector_from_mesh(replace(mesh, surfaces={"PS_FACE": face}), choice()).sector
    np.testing.assert_array_equal(found.right.position, sector.right.position)


def test_names_of_sets_may_be_in_another_case():
    own = sector_from_mesh(FULL, named(root="Root", contact_right="ps_face"))
    assert np.array_equal(np.sort(own.sector.node_sets["root"]), np.sort(FULL.node_sets["ROOT"]))
    assert 'mesh.sets.root: "Root" is "ROOT" in the file' in own.findings.lines
    twice = with_sets(FULL, root=FULL.node_sets["ROOT"])
    with pytest.raises(OwnMeshError, match=r"mesh.sets.root = 'Root': the file has no such set"):
        sector_from_mesh(twice, named(root="Root"))


@pytest.mark.parametrize(("n_blades", "what"), [(N_BLADES - 1, "a gap"), (N_BLADES + 1, "an overlap")])
def test_a_number_of_blades_off_by_one_is_said_first(n_blades, what):
    found = sector_from_mesh(FULL, choice(n_blades=n_blades, tolerance=1e-3)).findings
    assert found.lines[0].startswith(f"warning: n_blades = {n_blades} leaves {what} of ")
    assert found.lines[0].endswith(f"with n_blades = {N_BLADES} they touch")
    assert sector_from_mesh(FULL, choice()).findings.warnings == ()


def test_a_design_gap_is_no_wrong_number_of_blades():
    found = sector_from_mesh(moved_face((0.0, -50e-6, 0.0)), choice()).findings
    assert found.gap[0] > 40e-6
    assert found.warnings == ()

"""Sectors of bladed disks from mesh files: cut faces by name, their pairs, and what is refused."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from own_mesh_support import NAMES, imported, with_sets

from geometry import (
    BladeParameters,
    DiskParameters,
    MeshParameters,
    OwnMeshError,
    SectorChoice,
    ShroudParameters,
    build_sector,
    sector_from_mesh,
)

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
    ids=["by name", "as named", "exchanged"],
)
def test_cut_faces_come_back(names, said):
    """Where the contact faces are not named, the cut faces are not among those to choose from."""
    found = own(in_file(**names), **said)
    for role in CUTS:
        assert np.array_equal(found.sector.node_sets[role], np.sort(made().node_sets[role]))
    assert np.array_equal(found.sector.right.nodes, made().right.nodes)
    count = len(made().node_sets["cyclic_right"])
    assert f"sector of a disk: {count} nodes of each cut face are joined to the neighbours" in found.findings.lines
    exchanged = "right and left cut face exchanged: the right one is on the +y side" in found.findings.lines
    assert exchanged == (names.get("high") == "cyclic_left")
    with pytest.raises(OwnMeshError, match=r"3 pairs of surfaces are .* at radius 0\.375 to 0\.38 m"):
        sector_from_mesh(in_file(**names), SectorChoice(72, sets={"root": "ROOT"} | said))


def test_a_blade_alone_has_none():
    assert not set(CUTS) & set(own(imported(made())).sector.node_sets)


def test_cut_faces_that_do_not_fit_are_refused():
    mesh = in_file(high="cyclic_right", low="cyclic_left")
    with pytest.raises(OwnMeshError, match=r"mesh\.sets\.cyclic_left: .*name both cut faces of the disk, or neither"):
        own(mesh, cyclic_right="high")
    with pytest.raises(OwnMeshError, match="whole sides of elements"):
        own(with_sets(mesh, low=[0, 1]), cyclic_right="high", cyclic_left="low")
    moved = mesh.points.copy()
    inner = made().node_sets["cyclic_left"][5]
    moved[inner] *= 1.001
    with pytest.raises(OwnMeshError, match=r"node by node; a node has no partner within 0\.000"):
        own(replace(mesh, points=moved), cyclic_right="high", cyclic_left="low")
    sides = {"cyclic_right": "high", "cyclic_left": "TIP"}
    with pytest.raises(OwnMeshError, match="turned by one pitch, 5 degrees"):
        own(mesh, **sides)

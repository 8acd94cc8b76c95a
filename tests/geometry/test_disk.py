"""The disk under a blade: cuts that match, a mesh that is joined to the blade, its volume, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from geometry import BladeParameters, DiskParameters, GeometryError, MeshParameters, ShroudParameters, build_sector
from geometry.quality import hexahedron_scaled_jacobian

BLADE = BladeParameters(72, 0.3, 0.15, 0.036, 0.009, 0.006, 25.0, "lens")
SHROUD = ShroudParameters(70.0, 0.005, 0.04, 0.012)
MESH = MeshParameters(size=0.006)
DISK = DiskParameters(bore_radius=0.15, rim_width=0.046, bore_width=0.06, profile=((0.22, 0.02),))
CASES = {
    "default": {},
    "straight": {"shroud": replace(SHROUD, angle=180.0)},
    "axial": {"shroud": replace(SHROUD, angle=90.0)},
    "stagger": {"blade": replace(BLADE, root_stagger=30.0, twist=10.0), "shroud": replace(SHROUD, angle=110.0)},
    "rectangle, fillet": {"blade": replace(BLADE, section="rectangle", fillet_radius=0.002, n_blades=60)},
    "camber": {"blade": replace(BLADE, camber=20.0, twist=10.0, n_blades=60)},
}


def build(blade=BLADE, shroud=SHROUD, mesh=MESH, disk=DISK):
    return build_sector(blade, shroud, mesh, disk)


def volumes(sector):
    """Volume of each hexahedron, by its six tetrahedra."""
    p = sector.points[sector.hexahedra]
    parts = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))
    return sum(np.linalg.det(p[:, part[1:]] - p[:, part[:1]]) for part in map(list, parts)) / 6.0


@pytest.mark.parametrize("case", CASES)
def test_cuts_match_and_the_mesh_is_in_one_piece(case):
    changes = CASES[case]
    sector, blade = build(**changes), build(**changes, disk=None)
    pitch = 2.0 * np.pi / sector.n_blades
    c, s = np.cos(pitch), np.sin(pitch)
    turn = np.array([[1, 0, 0], [0, c, s], [0, -s, c]])
    right, left = (sector.points[sector.node_sets[f"cyclic_{side}"]] for side in ("right", "left"))
    assert np.abs(left @ turn.T - right).max() < 1e-12
    assert hexahedron_scaled_jacobian(sector.points, sector.hexahedra).min() > 0.1
    # the blade is as it was, and stands on its own root nodes
    assert np.array_equal(sector.points[: len(blade.points)], blade.points)
    assert np.array_equal(sector.blocks[0].nodes, blade.blocks[0].nodes)
    assert np.array_equal(sector.node_sets["rim"], blade.node_sets["root"])
    sides = np.sort(
        sector.hexahedra[:, [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]]
    )
    unique, count = np.unique(sides.reshape(-1, 4), axis=0, return_counts=True)
    assert count.max() == 2
    outer = unique[count == 1]
    on_root = np.isin(outer, sector.node_sets["rim"]).all(axis=1)
    assert not on_root.any()  # the whole root is inside
    # each free side of the disk lies on a cut, an axial end, the bore or the rim
    below = np.isin(outer, np.unique(sector.blocks[1].nodes)).all(axis=1)
    for name in ("cyclic_right", "cyclic_left"):
        below &= ~np.isin(outer, sector.node_sets[name]).all(axis=1)
    radius = np.hypot(sector.points[:, 1], sector.points[:, 2])
    width = np.array([DISK.width(r, 0.3) for r in radius])
    on_end = np.abs(2.0 * np.abs(sector.points[:, 0]) - width) < 1e-9
    rest = outer[below]
    ends = on_end[rest].all(axis=1)
    levels = np.ptp(radius[rest], axis=1) < 1e-12
    assert (ends | levels).all()
    assert np.allclose(np.unique(radius[rest[levels & ~ends]].round(9)), [0.15, 0.3])


def test_volume_is_that_of_the_profile():
    sector = build(mesh=MeshParameters(size=0.003))
    found = volumes(sector)[len(sector.blocks[0].nodes) :].sum()
    radius = np.linspace(0.15, 0.3, 20001)
    width = np.array([DISK.width(r, 0.3) for r in radius])
    exact = 2.0 * np.pi / 72 * np.trapezoid(width * radius, radius)
    assert found == pytest.approx(exact, rel=1e-3)


def test_a_mirrored_shroud_has_a_mirrored_disk():
    mirrored = build(blade=replace(BLADE, twist=-25.0), shroud=replace(SHROUD, angle=110.0))
    assert np.abs(build().points * [-1, 1, 1] - mirrored.points).max() < 1e-13  # m: sines differ between C libraries


def test_a_free_bore_is_not_held():
    assert len(build(disk=replace(DISK, bore="free")).node_sets["root"]) == 0
    held = build()
    assert np.allclose(np.hypot(*held.points[held.node_sets["root"], 1:].T), 0.15)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"bore_radius": 0.31}, "disk.bore_radius = 0.31: must lie between 0 and the hub radius (0.3 m)"),
        ({"bore_radius": 0.0}, "disk.bore_radius = 0.0: must lie between 0 and the hub radius (0.3 m)"),
        ({"rim_width": 0.03}, "disk.rim_width = 0.03: must be at least 0.0368 m to carry the root"),
        ({"bore_width": -1.0}, "disk.bore_width = -1.0: must be a positive number"),
        ({"bore": "held"}, 'disk.bore = \'held\': must be "clamped" or "free"'),
        ({"size": 1.0}, "disk.size = 1.0: must lie between a tenth of mesh.size and 0.15 m"),
    ],
)
def test_what_is_refused(changes, message):
    with pytest.raises(GeometryError) as caught:
        build(disk=replace(DISK, **changes))
    assert str(caught.value) == message


def test_a_profile_out_of_order():
    with pytest.raises(GeometryError, match=r"ascending radii between 0\.15 and 0\.3 m"):
        build(disk=replace(DISK, profile=((0.25, 0.02), (0.2, 0.02))))

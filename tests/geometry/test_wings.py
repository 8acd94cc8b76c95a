"""Part-span snubber and platform: elements, contact faces of further pairs, files, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from geometry_support import volume

from geometry import (
    BladeParameters,
    DiskParameters,
    GeometryError,
    MeshParameters,
    PlatformParameters,
    ShroudParameters,
    SnubberParameters,
    build_sector,
)
from geometry.elements import sides_on
from geometry.exchange import export_sector, import_sector
from geometry.frames import rotate_about_axis
from geometry.quality import hexahedron_scaled_jacobian
from rom.files.sector_file import load_sector, save_sector

BLADE = BladeParameters(24, 0.2, 0.08, 0.024, 0.006, 0.004, 15.0, "lens")
SHROUD = ShroudParameters(angle=150.0, thickness=0.005, axial_width=0.03, contact_length=0.008)
MESH = MeshParameters(size=0.005, contact_grid=(3, 2))
SNUBBER = SnubberParameters(radius=0.24, thickness=0.005, width=0.012, angle=150.0, gap=2e-4)
PLATFORM = PlatformParameters(radius=0.212, thickness=0.005, flank_angle=40.0, gap=1e-3)
PITCH = 2 * np.pi / BLADE.n_blades


@pytest.fixture(scope="module")
def sector():
    return build_sector(BLADE, SHROUD, MESH, snubber=SNUBBER, platform=PLATFORM)


def face_area(sector, side):
    """Area of the element sides on a face, by their diagonals."""
    block = sector.blocks[0]
    found = sides_on(sector.blocks, sector.node_sets[f"face_{side}"])
    quads = block.nodes[found.element[:, None], np.array(block.topology.sides)[found.side]]
    a, b, c, d = np.moveaxis(sector.points[quads], 1, 0)
    normals = 0.5 * np.cross(c - a, d - b)
    return np.linalg.norm(normals, axis=1).sum(), normals.sum(axis=0)


@pytest.mark.parametrize("angle", [30.0, 180.0])
@pytest.mark.parametrize(("stagger", "camber", "disk"), [(0.0, 0.0, None), (25.0, 30.0, DiskParameters(0.1, 0.04))])
def test_elements_of_wings_are_not_folded_and_fill_a_pitch(angle, stagger, camber, disk):
    blade = replace(BLADE, root_stagger=stagger, camber=camber)
    shroud = replace(SHROUD, angle=angle)
    plain = build_sector(blade, shroud, MESH, disk)
    found = build_sector(blade, shroud, MESH, disk, snubber=SNUBBER, platform=PLATFORM)
    assert hexahedron_scaled_jacobian(found.points, found.hexahedra).min() > 0.1
    # a snubber of constant width would fill the pitch between the airfoils; it widens towards them
    length = PITCH * SNUBBER.radius - SNUBBER.gap - blade.thickness
    least = SNUBBER.width * SNUBBER.thickness * length
    assert least < volume(found) - volume(plain) < 12 * least
    faces = np.sort(found.hexahedra[:, np.array(found.blocks[0].topology.sides)].reshape(-1, 4), axis=1)
    assert np.unique(faces, axis=0, return_counts=True)[1].max() == 2


@pytest.mark.parametrize("side", ["right", "left"])
def test_frames_and_areas_are_those_of_the_faces(sector, side):
    for name, view in sector.views.items():
        face = getattr(view, side)
        area, outward = face_area(view, side)
        assert area == pytest.approx(face.area.sum(), rel=2e-3)
        normal = face.frame[:, 2].mean(axis=0) * (-1.0 if side == "left" and name != "platform" else 1.0)
        assert normal @ outward == pytest.approx(area, rel=2e-3)
        assert np.allclose(face.frame @ face.frame.transpose(0, 2, 1), np.eye(3), atol=1e-14)


def test_left_face_of_a_snubber_is_the_right_one_turned_back(sector):
    pair = sector.pairs["snubber"]
    back = rotate_about_axis(sector.points[pair.face_left], PITCH - SNUBBER.gap / SNUBBER.radius)
    right = sector.points[pair.face_right]
    distance = np.linalg.norm(back[:, None] - right[None], axis=2).min(axis=1)
    assert distance.max() < 1e-12
    turned = rotate_about_axis(pair.left.position, PITCH - SNUBBER.gap / SNUBBER.radius)
    assert np.abs(turned - pair.right.position).max() < 1e-12
    assert np.abs(rotate_about_axis(pair.left.frame, PITCH) - pair.right.frame).max() < 1e-12


def test_flanks_of_neighbours_are_a_symmetric_roof(sector):
    pair, tilt = sector.pairs["platform"], np.radians(PLATFORM.flank_angle)
    to_middle = [rotate_about_axis(pair.right.position, -PITCH / 2), rotate_about_axis(pair.left.position, PITCH / 2)]
    assert np.abs(to_middle[0] - to_middle[1] * [1.0, -1.0, 1.0]).max() < 1e-12
    right = rotate_about_axis(sector.points[pair.face_right], -PITCH / 2)
    height = right[:, 2] - np.tan(tilt) * right[:, 1]
    assert np.ptp(height) < 1e-12
    assert right[:, 1].max() == pytest.approx(-PLATFORM.gap / 2)
    assert np.ptp(right[:, 1]) == pytest.approx(PLATFORM.length_of_flank)
    frame = rotate_about_axis(pair.right.frame, -PITCH / 2)[0]
    assert frame[2] == pytest.approx([0.0, np.sin(tilt), -np.cos(tilt)], abs=1e-14)
    assert frame[1] == pytest.approx([0.0, np.cos(tilt), np.sin(tilt)], abs=1e-14)
    assert np.array_equal(pair.left.frame, pair.right.frame * [1.0, -1.0, 1.0])


def test_surfaces_of_the_airfoil_leave_out_what_wings_cover(sector):
    plain = build_sector(BLADE, SHROUD, MESH)
    for name in ("suction_side", "pressure_side"):
        sides = sector.surfaces[name]
        corners = np.array(sector.blocks[0].topology.sides)[sides.side]
        quads = np.sort(sector.blocks[0].nodes[sides.element[:, None], corners], axis=1)
        faces = np.sort(sector.hexahedra[:, np.array(sector.blocks[0].topology.sides)].reshape(-1, 4), axis=1)
        keys, counts = np.unique(faces, axis=0, return_counts=True)
        open_ = {tuple(key) for key, count in zip(keys, counts, strict=True) if count == 1}
        assert {tuple(quad) for quad in quads} <= open_
        assert len(sides) > 0.5 * len(plain.surfaces[name])


def test_a_sector_without_wings_is_as_it_was(sector):
    plain = build_sector(BLADE, SHROUD, MESH)
    assert plain.pairs == {}
    assert plain.main == "shroud"
    assert plain.seen_from("shroud") is plain
    assert sector.seen_from("shroud").right is sector.right


@pytest.mark.parametrize("suffix", [".h5", ".vtu", ".msh"])
def test_pairs_survive_a_file(sector, tmp_path, suffix):
    path = tmp_path / f"sector{suffix}"
    (save_sector if suffix == ".h5" else export_sector)(path, sector)
    found = (load_sector if suffix == ".h5" else import_sector)(path)
    assert list(found.pairs) == list(sector.pairs) == ["snubber", "platform"]
    for name, pair in sector.pairs.items():
        other = found.pairs[name]
        assert set(other.face_right) == set(pair.face_right)
        assert set(other.face_left) == set(pair.face_left)
        for side in ("right", "left"):
            for key in ("nodes", "position", "frame", "area"):
                assert np.array_equal(getattr(getattr(other, side), key), getattr(getattr(pair, side), key))


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"snubber": replace(SNUBBER, radius=0.3)}, "snubber.radius"),
        ({"snubber": replace(SNUBBER, radius=0.213)}, "snubber.radius"),
        ({"snubber": replace(SNUBBER, angle=90.0)}, "snubber.angle"),
        ({"snubber": replace(SNUBBER, width=0.03)}, "snubber.width"),
        ({"snubber": replace(SNUBBER, gap=0.1)}, "snubber.gap"),
        ({"snubber": replace(SNUBBER, thickness=-1.0)}, "snubber.thickness"),
        ({"platform": replace(PLATFORM, flank_length=0.02)}, "platform.flank_length"),
        ({"platform": replace(PLATFORM, flank_angle=80.0)}, "platform.flank_angle"),
        ({"mesh": replace(MESH, size=0.012), "shroud": replace(SHROUD, angle=80.0)}, "mesh.size"),
        ({"platform": replace(PLATFORM, flank_angle=0.0, flank_length=0.024)}, "platform.flank_length"),
        ({"snubber": replace(SNUBBER, angle=75.0, width=0.018)}, "snubber.angle"),
    ],
)
def test_wings_that_do_not_fit_are_refused_with_what_does(changes, key):
    given = {"blade": BLADE, "shroud": SHROUD, "mesh": MESH, "snubber": SNUBBER, "platform": PLATFORM} | changes
    with pytest.raises(GeometryError) as error:
        build_sector(**given)
    assert str(error.value).startswith(f"{key} = ")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("disk", [None, DiskParameters(0.1, 0.04)])
def test_a_blade_without_shroud_is_its_airfoil_with_wings(disk):
    blade = replace(BLADE, root_stagger=20.0, camber=20.0)
    found = build_sector(blade, None, MESH, disk, snubber=SNUBBER, platform=PLATFORM)
    assert (found.main, list(found.pairs)) == ("snubber", ["platform"])
    assert hexahedron_scaled_jacobian(found.points, found.hexahedra).min() > 0.1
    assert len(np.unique(found.hexahedra)) == len(found.points)
    radius = np.hypot(found.points[:, 1], found.points[:, 2])
    top = np.flatnonzero(np.isclose(radius, BLADE.hub_radius + BLADE.length))
    assert set(found.node_sets["tip_surface"]) == set(top)
    assert found.node_sets["tip"][0] in top
    assert radius.max() == pytest.approx(BLADE.hub_radius + BLADE.length)
    for view in found.views.values():
        for side in ("right", "left"):
            face = getattr(view, side)
            assert np.array_equal(view.points[face.nodes], face.position)
            assert face_area(view, side)[0] == pytest.approx(face.area.sum(), rel=2e-3)
    corners = np.array(found.blocks[0].topology.sides)
    sides = found.surfaces["suction_side"]
    nodes = found.blocks[0].nodes[sides.element[:, None], corners[sides.side]]
    assert radius[nodes].max() == pytest.approx(BLADE.hub_radius + BLADE.length)
    with pytest.raises(GeometryError, match="neither a snubber nor a platform"):
        build_sector(blade, None, MESH)

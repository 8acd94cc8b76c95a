"""Camber: a section about a circular arc, with thickness normal to it and its centroid on the stacking axis."""

from dataclasses import replace

import numpy as np
import pytest
from geometry_support import SLENDER, jacobians, mid_radius, next_blade, polar, sector, slender_shroud, volume
from test_symmetry import element_sets

from geometry.quality import hexahedron_scaled_jacobian

CHORD, THICKNESS = 0.030, 0.004
# a large hub, so that a section lies in a plane
CURVED = replace(SLENDER, chord=CHORD, thickness=THICKNESS, twist=0.0, hub_radius=3.0, n_blades=520)


def curved(camber, **changes):
    return replace(CURVED, camber=camber, **changes)


def root_quads(mesh):
    """Corners (k, 4, 2) of the elements' faces on the hub, along x and along the circumference, m."""
    faces = mesh.hexahedra[:, [0, 1, 2, 3]]
    faces = faces[np.isin(faces, mesh.node_sets["root"]).all(axis=1)]
    x, theta, radius = polar(mesh.points)
    return np.stack([x, theta * radius], axis=-1)[faces]


def area_and_centroid(quads):
    """Of plane polygons (k, 4, 2)."""
    a, b = quads, np.roll(quads, -1, axis=1)
    cross = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    area = np.abs(cross.sum() / 2)
    return area, np.abs((cross[..., None] * (a + b)).sum(axis=(0, 1)) / (6 * area))


@pytest.mark.parametrize("camber", [-40.0, 30.0, 60.0, 90.0])
@pytest.mark.parametrize("section", ["rectangle", "lens"])
def test_area_is_length_of_the_arc_times_thickness_and_the_centroid_is_at_the_stacking_axis(camber, section):
    mesh = sector(curved(camber, section=section), slender_shroud(70.0), 0.003)
    arc = CHORD * np.radians(abs(camber)) / 2 / np.sin(np.radians(abs(camber)) / 2)
    area, centroid = area_and_centroid(root_quads(mesh))
    fullness = {"rectangle": 1.0, "lens": 0.75}[section]
    step = np.radians(camber) / (arc / 0.003)
    assert area == pytest.approx(fullness * arc * THICKNESS, rel=step**2 / 12)
    assert centroid.max() < 1e-3 * CHORD


def test_volume_converges_at_second_order():
    blade = replace(SLENDER, camber=70.0, section="lens", thickness=0.006, tip_thickness=0.004, twist=20.0)
    shroud = slender_shroud(120.0)
    arc = blade.chord * np.radians(70.0) / 2 / np.sin(np.radians(35.0))
    platform = 2 * np.pi * mid_radius(blade, shroud) / blade.n_blades * shroud.axial_width * shroud.thickness
    exact = platform + 0.75 * arc * 0.005 * (blade.length - shroud.thickness)
    errors = [abs(volume(sector(blade, shroud, size)) / exact - 1) for size in (0.008, 0.004, 0.002)]
    assert errors[-1] < 5e-4
    assert errors[0] / errors[-1] > 8.0, errors  # sixteen with the divisions exactly doubled


@pytest.mark.parametrize("camber", [25.0, -80.0])
def test_ends_of_the_section(camber):
    """The ends are a chord apart, turned against each other by the camber, as thick as asked for."""
    mesh = sector(curved(camber), slender_shroud(180.0), 0.004)
    places = root_quads(mesh).reshape(-1, 2)
    ends = []
    for direction in (-1.0, 1.0):
        # the corners reach furthest along the normal of their end
        turn = -direction * np.radians(camber) / 2
        reach = places @ (direction * np.array([np.cos(turn), np.sin(turn)]))
        corner = np.unique(places[reach > reach.max() - 1e-9].round(9), axis=0)
        ends.append(corner[np.argsort(corner[:, 1])][[0, -1]])
    middles = [end.mean(axis=0) for end in ends]
    assert np.linalg.norm(middles[1] - middles[0]) == pytest.approx(CHORD, rel=2e-3)
    across = [end[1] - end[0] for end in ends]
    np.testing.assert_allclose(np.linalg.norm(across, axis=1), THICKNESS, rtol=1e-2)
    angles = [np.degrees(np.arctan2(side[1], side[0])) for side in across]
    assert angles[0] - angles[1] == pytest.approx(camber, abs=1e-3)
    middle_of_arc = places[np.argmin(np.abs(places[:, 0]))]
    assert np.sign(middle_of_arc[1] - middles[0][1]) == np.sign(camber)


@pytest.mark.parametrize("angle", [45.0, 70.0, 90.0, 120.0, 180.0])
@pytest.mark.parametrize("camber", [45.0, -90.0])
def test_elements_are_sound_and_neighbours_match(angle, camber):
    blade = replace(SLENDER, camber=camber, section="lens", thickness=0.005, fillet_radius=0.002)
    shroud = slender_shroud(angle, fillet_radius=0.001)
    mesh = sector(blade, shroud, 0.004)
    assert jacobians(mesh, [-1.0, 0.0, 1.0]).min() > 0
    assert hexahedron_scaled_jacobian(mesh.points, mesh.hexahedra).min() > 0.2
    assert len(np.unique(mesh.points.round(12), axis=0)) == len(mesh.points)
    neighbour = next_blade(mesh.left.position, 2 * np.pi / blade.n_blades)
    np.testing.assert_allclose(neighbour, mesh.right.position, atol=1e-12)
    tip = mesh.points[mesh.node_sets["tip"][0]]
    assert np.hypot(tip[0], tip[1]) < 0.004


def test_opposite_camber_is_the_blade_turned_round_and_obtuse_angles_its_mirror_image():
    blade = replace(SLENDER, camber=50.0, twist=15.0)
    mesh = sector(blade, slender_shroud(70.0), 0.005)
    round_about = sector(replace(blade, camber=-50.0), slender_shroud(70.0), 0.005)
    turned = mesh.points * [-1.0, -1.0, 1.0]
    order, other = (np.lexsort(points.round(9).T) for points in (turned, round_about.points))
    np.testing.assert_allclose(turned[order], round_about.points[other], atol=1e-12)
    image = sector(replace(blade, twist=-15.0), slender_shroud(110.0), 0.005)
    mirror = np.array([-1.0, 1.0, 1.0])
    np.testing.assert_array_equal(mesh.points * mirror + 0.0, image.points + 0.0)
    assert element_sets(mesh, mirror) == element_sets(image, 1.0)

"""Side edges slanted with the stagger: blades of ordinary solidity fit, and neighbours still match."""

from dataclasses import replace

import numpy as np
import pytest
from geometry_support import SLENDER, boundary_quads, mid_radius, next_blade, polar, sector, slender_shroud, volume
from test_symmetry import element_sets

from geometry import GeometryError, MeshParameters
from geometry.blade.checks import check_parameters
from geometry.blade.fitting import side_edge_angle
from geometry.quality import hexahedron_scaled_jacobian

# chord sin(50 degrees) = 51 mm, pitch 39 mm: no room between axial edges
SOLID = replace(SLENDER, chord=0.066, root_stagger=30.0, twist=20.0)
STAGGER = 50.0


def solid_shroud(angle, **changes):
    return slender_shroud(angle, axial_width=0.050, **changes)


def outer_rim(mesh):
    """x, s at the mid radius (m) of the nodes on the rim of the outer surface."""
    top = mesh.node_sets["tip_surface"]
    quads = boundary_quads(mesh)
    sides = quads[np.isin(quads, top).sum(axis=1) == 2]
    x, theta, _ = polar(mesh.points[np.intersect1d(sides, top)])
    return x, theta * mid_radius(SOLID, solid_shroud(70.0))


@pytest.mark.parametrize("angle", [40.0, 70.0, 90.0, 120.0, 180.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_blade_with_chord_sine_stagger_above_the_pitch_fits(angle, side):
    blade = replace(SOLID, root_stagger=side * SOLID.root_stagger, twist=side * SOLID.twist)
    shroud = solid_shroud(angle, gap=1e-4)
    pitch = 2 * np.pi * mid_radius(blade, shroud) / blade.n_blades
    assert blade.chord * np.sin(np.radians(STAGGER)) > pitch
    with pytest.raises(GeometryError):
        check_parameters(blade, replace(shroud, edge_angle=0.0), MeshParameters(0.005))
    mesh = sector(blade, shroud, 0.005)
    assert hexahedron_scaled_jacobian(mesh.points, mesh.hexahedra).min() > 0.2
    turn = (pitch - shroud.gap) / mid_radius(blade, shroud)
    neighbour = next_blade(mesh.points[mesh.node_sets["face_left"]], turn)
    np.testing.assert_allclose(neighbour, mesh.points[mesh.node_sets["face_right"]], atol=1e-12)
    platform = (pitch - shroud.gap) * shroud.axial_width * shroud.thickness
    airfoil = blade.chord * blade.thickness * (blade.length - shroud.thickness)
    assert volume(mesh) == pytest.approx(platform + airfoil, rel=2e-4)


@pytest.mark.parametrize("slant", [42.0, 50.0, 60.0])
@pytest.mark.parametrize("angle", [60.0, 120.0, 180.0])
def test_both_sides_are_the_slanted_line_one_pitch_apart(angle, slant):
    """Every node of the rim lies on an axial edge or on the Z, worked out here from its definition."""
    shroud = solid_shroud(angle, edge_angle=slant)
    x, s = outer_rim(sector(SOLID, shroud, 0.005))
    pitch = 2 * np.pi * mid_radius(SOLID, shroud) / SOLID.n_blades
    direction = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))]) * (1 if angle <= 90 else -1)
    end = shroud.contact_length / 2 * direction
    corner = 0.050 / 2
    rise = (corner - end[0]) * np.tan(np.radians(slant))
    line = np.interp(x, [-corner, -end[0], end[0], corner], [-end[1] - rise, -end[1], end[1], end[1] + rise])
    right, left = np.abs(s - line - pitch / 2) < 1e-12, np.abs(s - line + pitch / 2) < 1e-12
    axial = np.abs(np.abs(x) - corner) < 1e-12
    assert (right | left | axial).all()
    assert right.sum() == left.sum() > 8


@pytest.mark.parametrize("stagger", [45.0, 55.0, -60.0])
def test_the_slant_with_the_most_room_follows_a_thin_airfoil(stagger):
    """Without a notch to speak of, the middle of the platform is widest along the chord."""
    blade = replace(SOLID, thickness=0.003, root_stagger=stagger, twist=0.0)
    angle = stagger % 180.0  # the contact segment is part of a nearly straight line
    shroud = solid_shroud(angle, contact_length=0.001)
    assert side_edge_angle(blade, shroud) == pytest.approx(stagger, abs=3.0)


def test_axial_edges_stay_where_the_airfoil_fits():
    for angle in (45.0, 135.0, 180.0):
        assert side_edge_angle(SLENDER, slender_shroud(angle)) == 0.0
    assert side_edge_angle(SLENDER, slender_shroud(70.0, edge_angle=12.0)) == 12.0
    assert side_edge_angle(SLENDER, slender_shroud(110.0, edge_angle=12.0)) == 12.0


@pytest.mark.parametrize("edge_angle", [40.0, "auto"])
def test_obtuse_angles_are_mirror_images(edge_angle):
    mesh = sector(SOLID, solid_shroud(70.0, edge_angle=edge_angle), 0.005)
    mirrored = replace(SOLID, root_stagger=-SOLID.root_stagger, twist=-SOLID.twist)
    other_angle = edge_angle if edge_angle == "auto" else -edge_angle
    other = sector(mirrored, solid_shroud(110.0, edge_angle=other_angle), 0.005)
    mirror = np.array([-1.0, 1.0, 1.0])
    np.testing.assert_array_equal(mesh.points * mirror + 0.0, other.points + 0.0)
    assert element_sets(mesh, mirror) == element_sets(other, 1.0)


def test_sections_are_staggered_at_the_root():
    mesh = sector(SOLID, solid_shroud(180.0), 0.005)
    for nodes, stagger in ((mesh.node_sets["root"], 30.0),):
        x, theta, radius = polar(mesh.points[nodes])
        turn, arc = np.radians(stagger), theta * radius
        along = x * np.cos(turn) + arc * np.sin(turn)
        across = arc * np.cos(turn) - x * np.sin(turn)
        np.testing.assert_allclose([along.min(), along.max()], [-0.033, 0.033], rtol=1e-9)
        np.testing.assert_allclose([across.min(), across.max()], [-0.002, 0.002], rtol=1e-7)

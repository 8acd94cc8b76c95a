"""Is the mesh the blade that was asked for: volumes, sections, node sets, no undercut."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from geometry_support import SLENDER, boundary_quads, polar, quad_vectors, sector, slender_shroud, volume


def analytic_volume(blade, shroud):
    """Platform of one pitch less the gap at mid radius, airfoil of linearly varying thickness on true cylinders."""
    tip = blade.hub_radius + blade.length
    platform = (2 * np.pi * (tip - shroud.thickness / 2) / blade.n_blades - shroud.gap) * shroud.axial_width
    thickness = (blade.thickness + (blade.tip_thickness or blade.thickness)) / 2
    fullness = {"rectangle": 1.0, "lens": 0.75}[blade.section]
    return platform * shroud.thickness + fullness * blade.chord * thickness * (blade.length - shroud.thickness)


@pytest.mark.parametrize("angle", [30.0, 70.0, 90.0, 120.0, 180.0])
@pytest.mark.parametrize(
    "change",
    [
        {},
        {"twist": 25.0},
        {"tip_thickness": 0.004},
        {"section": "lens"},
        {"section": "lens", "tip_thickness": 0.008, "twist": -20.0},
    ],
    ids=str,
)
def test_volume_is_the_analytic_one(angle, change):
    blade = replace(SLENDER, twist=0.0, thickness=0.007)
    blade, shroud = replace(blade, **change), slender_shroud(angle, gap=3e-4)
    assert volume(sector(blade, shroud, 0.003)) == pytest.approx(analytic_volume(blade, shroud), rel=2e-4)


def volume_errors(section, tip_thickness):
    blade = replace(SLENDER, section=section, twist=35.0, thickness=0.006, tip_thickness=tip_thickness)
    shroud = slender_shroud(120.0)
    exact = analytic_volume(blade, shroud)
    return [abs(volume(sector(blade, shroud, size)) / exact - 1) for size in (0.008, 0.004, 0.002)]


def test_volume_of_a_twisted_blade_converges_at_second_order():
    errors = volume_errors("rectangle", None)
    assert errors[-1] < 2e-5
    assert all(3.5 < coarse / fine < 4.5 for coarse, fine in pairwise(errors)), errors


def test_volume_of_a_twisted_lens_is_as_good():
    """Its flanks are parabolas between straight edges of elements, but on average where they ought to be."""
    errors = volume_errors("lens", 0.004)
    assert errors[-1] < 2e-5
    assert all(coarse / fine > 3.5 for coarse, fine in pairwise(errors)), errors


@pytest.mark.parametrize("size", [0.008, 0.004, 0.002])
def test_sections_of_a_lens_have_its_area_and_nearly_its_bending_stiffness(size):
    """Straight edges between nodes of the right thickness on average, whatever the layout of the mesh."""
    for angle in (30.0, 70.0, 180.0):
        blade = replace(SLENDER, section="lens", thickness=0.006, twist=0.0)
        half, along = half_thickness_at_the_root(sector(blade, slender_shroud(angle), size))
        step = np.diff(along)
        a, b = half[:-1], half[1:]
        assert np.sum(step * (a + b)) == pytest.approx(0.75 * 0.034 * 0.006, rel=1e-12)
        cubes = step * (a**3 + a**2 * b + a * b**2 + b**3) / 4
        places = np.linspace(-0.017, 0.017, 20001)
        exact = np.trapezoid((0.003 * (0.25 + 0.75 * (1 - (places / 0.017) ** 2))) ** 3, places)
        assert np.sum(cubes) == pytest.approx(exact, rel=2e-2 * (size / 0.008) ** 3)


@pytest.mark.parametrize("twist", [0.0, 25.0, -40.0])
def test_sections_have_their_size_at_every_radius(twist):
    blade = replace(SLENDER, twist=twist, tip_thickness=0.003)
    mesh = sector(blade, slender_shroud(180.0))
    x, theta, radius = polar(mesh.points)
    inner = blade.hub_radius + blade.length - 0.005
    for level in np.unique(radius[radius < inner - 1e-9].round(9)):
        here = np.abs(radius - level) < 1e-8
        height = (level - blade.hub_radius) / (inner - blade.hub_radius)
        turn = np.radians(twist) * height
        arc = theta[here] * level
        along = x[here] * np.cos(turn) + arc * np.sin(turn)
        across = arc * np.cos(turn) - x[here] * np.sin(turn)
        np.testing.assert_allclose([along.min(), along.max()], [-0.017, 0.017], rtol=1e-9)
        thickness = 0.004 + (0.003 - 0.004) * height
        np.testing.assert_allclose([across.min(), across.max()], [-thickness / 2, thickness / 2], rtol=1e-7)


def half_thickness_at_the_root(mesh):
    """Upper half thickness of an untwisted blade and where along the chord, from the rim of its root, ascending."""
    x, theta, radius = polar(mesh.points)
    root = mesh.node_sets["root"]
    outline = boundary_quads(mesh)
    outline = np.unique(outline[np.isin(outline, root).sum(axis=1) == 2])
    upper = np.intersect1d(root, outline)
    upper = upper[theta[upper] > 1e-9]
    rim = [
        np.max((theta * radius)[upper[np.abs(x[upper] - place) < 1e-9]]) for place in np.unique(x[upper].round(12))
    ]
    return np.array(rim), np.unique(x[upper].round(12))


def test_lens_is_made_of_two_parabolas():
    blade = replace(SLENDER, section="lens", thickness=0.006)
    for size in (0.004, 0.002):
        half, along = half_thickness_at_the_root(sector(blade, slender_shroud(70.0), size))
        expected = 0.003 * (0.25 + 0.75 * (1 - (along / 0.017) ** 2))
        assert len(along) >= 7
        # nodes stand off the curve by a part of what a straight edge cuts off it
        sagitta = 0.003 * 0.75 * (np.diff(along).max() / 0.034) ** 2
        np.testing.assert_allclose(half, expected, atol=sagitta)
        assert np.max(np.abs(half - expected)) > 0.1 * sagitta


@pytest.mark.parametrize("angle", [30.0, 90.0, 150.0])
def test_node_sets(angle):
    mesh = sector(SLENDER, slender_shroud(angle))
    assert len(mesh.node_sets["tip"]) == 1
    np.testing.assert_array_equal(mesh.points[mesh.node_sets["tip"][0]], [0.0, 0.0, 0.30 + 0.15])
    radius = np.hypot(mesh.points[:, 1], mesh.points[:, 2])
    np.testing.assert_array_equal(np.flatnonzero(radius < 0.30 + 1e-9), np.sort(mesh.node_sets["root"]))
    np.testing.assert_array_equal(np.flatnonzero(radius > 0.45 - 1e-9), np.sort(mesh.node_sets["tip_surface"]))
    np.testing.assert_allclose(radius[mesh.node_sets["root"]], 0.30, rtol=1e-13)
    np.testing.assert_allclose(radius[mesh.node_sets["tip_surface"]], 0.45, rtol=1e-13)
    assert all(nodes.dtype == np.int64 for nodes in mesh.node_sets.values())
    assert mesh.points.dtype == np.float64
    assert mesh.hexahedra.dtype == np.int64


@pytest.mark.parametrize("angle", [30.0, 70.0, 90.0, 120.0, 180.0])
def test_no_undercut(angle):
    """Every side of the shroud is radial and neighbours fill the ring without overlap: a blade lifts straight out."""
    shroud = slender_shroud(angle)
    mesh = sector(SLENDER, shroud)
    x, theta, radius = polar(mesh.points)
    inside = 0.45 - 0.005 - 1e-9
    quads = boundary_quads(mesh)
    sides = quads[(radius[quads].min(axis=1) > inside) & (np.ptp(radius[quads], axis=1) > 1e-6)]
    for quad in sides:
        # the four corners stand in two radial lines: two pairs with the same x and angle
        stations = {(round(x[node], 12), round(theta[node], 12)) for node in quad}
        assert len(stations) == 2
    # the outer surface has the area of one pitch, so it leaves neither room nor overlap
    outer = quads[np.isin(quads, mesh.node_sets["tip_surface"]).all(axis=1)]
    a, b = outer, np.roll(outer, -1, axis=1)
    area = ((x[a] * theta[b] - x[b] * theta[a]).sum() / 2) * 0.45
    assert area == pytest.approx(0.040 * 0.45 * 2 * np.pi / 72, rel=1e-12)
    # seen from the next blade nothing of the right side hides behind itself: no face of it looks back
    vectors = quad_vectors(mesh, sides)
    side_edges_and_contact = (theta[sides] > 0).all(axis=1) & (np.ptp(theta[sides], axis=1) < 1)
    towards = np.stack([0 * theta, np.cos(theta), -np.sin(theta)], axis=-1)[sides[:, 0]]
    look = (vectors * towards).sum(axis=1) / np.linalg.norm(vectors, axis=1)
    assert side_edges_and_contact.sum() > 20
    assert look[side_edges_and_contact].min() > -1e-9

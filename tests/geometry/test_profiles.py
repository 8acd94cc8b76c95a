"""An airfoil from sections as points: the parametric blade from its own, any outline, any surface, bad ones."""

from dataclasses import replace

import numpy as np
import pytest
from geometry_support import SLENDER, jacobians, polar, sector, slender_shroud, volume
from profile_support import naca, outline, placed, sections_of

from geometry import DiskParameters, GeometryError, MeshParameters, SnubberParameters, build_sector
from geometry.blade.profile_loop import section_curves
from geometry.blade.profiles import blade_of_sections, profile_points, profile_stack

LENS = replace(SLENDER, section="lens", thickness=0.006, tip_thickness=0.004)
TIP = LENS.hub_radius + LENS.length - 0.005


def blade_of(sections, thickness=0.005, **changes):
    """The slender blade with sections of points."""
    blade = replace(LENS, **changes)
    return blade_of_sections(
        blade.n_blades, blade.hub_radius, blade.length, profile_stack("blade.csv", sections), thickness
    )


@pytest.mark.parametrize("angle", [70.0, 130.0])
@pytest.mark.parametrize("count", [12, 60])
def test_parametric_blade_from_its_own_sections(angle, count):
    shroud = slender_shroud(angle)
    blade = blade_of(sections_of(LENS, TIP, (0.0, 1.0), count))
    own, made = sector(LENS, shroud), sector(blade, shroud)
    assert blade.twist == pytest.approx(LENS.twist)
    assert volume(made) == pytest.approx(volume(own), rel=2e-4)
    root = own.node_sets["root"]
    np.testing.assert_allclose(made.points[root], own.points[root], atol=4e-3 * LENS.chord)
    assert made.node_sets.keys() == own.node_sets.keys()


def test_two_sections_keep_the_chord_between_them():
    blade = blade_of([placed(outline(0.034, 0.006), stagger, radius) for stagger, radius in ((0, 0.3), (50, 0.445))])
    curves = blade.sections.curves(0.3725)
    ends = curves.trailing.mean(axis=0) - curves.leading.mean(axis=0)
    assert np.hypot(*ends) == pytest.approx(0.034, rel=1e-6)
    assert np.degrees(np.arctan2(*ends[::-1])) == pytest.approx(25.0)


@pytest.mark.parametrize("sharp", [True, False])
@pytest.mark.parametrize("start", [0, 17, 40])
@pytest.mark.parametrize("way", [1, -1])
def test_outline_begins_anywhere_and_leads_either_way(sharp, start, way):
    points = np.roll(naca(0.034, 0.12, sharp=sharp), start, axis=0)[::way]
    points = np.vstack([points, points[:1]])  # closed, and a point twice
    blade = blade_of([placed(points, stagger, radius) for stagger, radius in ((0, 0.3), (20, 0.445))])
    mesh = sector(blade, slender_shroud(70.0))
    assert jacobians(mesh, (-0.5, 0.5)).min() > 0.0
    shape = 2 * 0.2969 / 3 - 0.1260 / 2 - 0.3516 / 3 + 0.2843 / 4 - (0.1036 if sharp else 0.1015) / 5
    area = 10 * shape * 0.12 * 0.034**2
    platform = 2 * np.pi * 0.4475 / 72 * 0.040 * 0.005
    # what is cut of a sharp edge is a thousandth
    assert volume(mesh) - platform == pytest.approx(area * 0.145, rel=2e-3)


@pytest.mark.parametrize("camber", [0.0, 80.0])
def test_sides_are_split_at_the_edges(camber):
    curves = section_curves(placed(np.roll(outline(1.0, 0.1, camber, 25), 13, axis=0), 30.0, 1.0))
    for edge in (curves.leading, curves.trailing):
        assert np.hypot(*(edge[-1] - edge[0])[:2]) == pytest.approx(0.025, rel=1e-6)
    assert curves.leading[0, 0] < curves.trailing[0, 0]


def test_section_error_along_the_height_falls_with_the_fourth_power_of_their_distance():
    def shape(radius):
        t = (radius - 0.3) / 0.145
        camber, stagger = 30.0 + 20.0 * np.sin(2.0 * t), 40.0 * np.sin(1.5 * t)
        return placed(outline(0.03 + 0.004 * np.cos(3.0 * t), 0.005 - 0.001 * t**3, camber), stagger, radius)

    errors, at = [], np.linspace(0.3, 0.445, 41)
    exact = [section_curves(shape(radius)).upper[:, :2] for radius in at]
    for count in (5, 9, 17):
        stack = profile_stack("blade.csv", [shape(radius) for radius in np.linspace(0.3, 0.445, count)])
        found = [stack.curves(float(radius)).upper for radius in at]
        errors.append(np.abs(np.array(found) - exact).max())
    assert errors[0] / errors[1] > 10.0
    assert errors[1] / errors[2] > 10.0


def test_sections_of_planes_and_cones_are_those_of_cylinders():
    """Of a prism: y and x alike at all heights, whatever surface cuts it."""
    points = outline(0.034, 0.006, 40.0)
    on_plane, on_cone = [], []
    for height in np.linspace(0.28, 0.47, 5):
        radius = np.hypot(points[:, 1], height)
        on_plane.append(np.column_stack([points[:, 0], radius * np.arctan2(points[:, 1], height), radius]))
        radius = height + 0.3 * points[:, 0]
        on_cone.append(np.column_stack([points[:, 0], radius * np.arcsin(points[:, 1] / radius), radius]))
    plane, cone = (profile_stack("blade.csv", sections).curves(0.37) for sections in (on_plane, on_cone))
    for curves in (plane, cone):
        y = 0.37 * np.sin(curves.upper[:, 1] / 0.37)
        exact = section_curves(placed(points, 0.0, 1.0)).upper
        np.testing.assert_allclose(np.stack([curves.upper[:, 0], y], axis=1), exact[:, :2], atol=2e-6)


def test_nodes_of_straight_edges_keep_area_of_a_curved_section():
    curves = section_curves(placed(outline(1.0, 0.2, 60.0, 200), 0.0, 1.0))
    nodes = np.linspace(0.0, 1.0, 7)
    sides = [profile_points(curves, np.stack([nodes, 0 * nodes + v], axis=1), (nodes, nodes)) for v in (1.0, 0.0)]
    polygon = np.vstack([sides[1], sides[0][::-1]])
    a, b = polygon, np.roll(polygon, -1, axis=0)
    arc = np.radians(60.0) / 2 / np.sin(np.radians(30.0))
    assert np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2 == pytest.approx(0.75 * 0.2 * arc, rel=5e-4)


def test_sections_with_disk_snubber_and_lean():
    sections = sections_of(replace(LENS, camber=30.0), LENS.hub_radius + LENS.length)
    leaned = [each + (each[0, 2] - 0.3) * np.array([0.01, 0.02, 0.0]) for each in sections]
    blade = blade_of(leaned, 0.0)
    mesh = MeshParameters(0.006, (3, 2))
    snubber = SnubberParameters(0.38, 0.005, 0.012)
    made = build_sector(blade, None, mesh, DiskParameters(0.2, 0.05), snubber=snubber)
    assert jacobians(made, (-0.5, 0.5)).min() > 0.0
    tip = made.points[made.node_sets["tip_surface"]]
    x, theta, radius = polar(tip)
    np.testing.assert_allclose([x.mean(), (theta * radius).mean()], [0.0015, 0.003], atol=4e-4)
    assert made.surfaces["suction_side"].side.size == made.surfaces["pressure_side"].side.size


GOOD = sections_of(LENS, TIP)
SWAPPED = GOOD[1].copy()
SQUARE = 0.01 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
SWAPPED[[40, 20]] = SWAPPED[[20, 40]]
BAD = {
    "at least two at different radii": [GOOD[0]],
    "rising radii": [GOOD[2], GOOD[1], GOOD[0]],
    "after 0.445 m": [GOOD[0], GOOD[2], GOOD[2]],
    "section 2 .radius 0.3725 m.: 3 different points": [GOOD[0], GOOD[1][:3], GOOD[2]],
    "section 2 .*crosses itself": [GOOD[0], SWAPPED, GOOD[2]],
    "enclose no area": [GOOD[0], GOOD[1] * [1.0, 0.0, 1.0], GOOD[2]],
    "go round more than once": [GOOD[0], np.vstack([GOOD[1], GOOD[1]]), GOOD[2]],
    "no leading and trailing edge": [placed(SQUARE, 0.0, radius) for radius in (0.3, TIP)],
    "missing at the tip": GOOD[:2],
    "missing at the root": GOOD[1:],
    "the file is in mm": [each * 1e3 for each in GOOD],
    "x and y are in mm": [each * [1e3, 1e3, 1.0] for each in GOOD],
    "within half a chord of the stacking axis": [each + np.array([0.2, 0.0, 0.0]) for each in GOOD],
}


@pytest.mark.parametrize("told", BAD)
def test_bad_sections_are_refused_in_one_line(told):
    with pytest.raises(GeometryError, match=f"^blade.sections = 'blade.csv': [^\\n]*{told}[^\\n]*$"):
        blade_of(BAD[told])


def test_neighbours_of_points_that_touch_are_refused():
    blade = blade_of(sections_of(replace(LENS, thickness=0.024), TIP), n_blades=90)
    with pytest.raises(GeometryError, match=r"^blade.sections = 'blade.csv': neighbouring airfoils would touch"):
        build_sector(blade, slender_shroud(70.0), MeshParameters(0.004))


def test_fillets_are_refused_beside_sections():
    with pytest.raises(GeometryError, match=r"^shroud.fillet_radius = 0.001: must be 0 with blade.sections"):
        build_sector(blade_of(GOOD), slender_shroud(70.0, fillet_radius=0.001), MeshParameters(0.004))

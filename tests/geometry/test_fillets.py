"""Fillets at the root and at the shroud: their volume, their profile, their elements."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from geometry_support import SLENDER, jacobians, polar, sector, slender_shroud, volume

from geometry import GeometryError, MeshParameters
from geometry.blade.checks import check_parameters
from geometry.quality import hexahedron_scaled_jacobian

RADIUS = 0.002
PLAIN = replace(SLENDER, twist=0.0, chord=0.030, thickness=0.006)


def filleted(section="rectangle", root=RADIUS, tip=RADIUS, **changes):
    blade = replace(PLAIN, section=section, fillet_radius=root, **changes)
    return blade, slender_shroud(70.0, fillet_radius=tip)


def outline(section, chord, thickness):
    """Length of the outline of a section, m, from its definition."""
    along = np.linspace(-chord / 2, chord / 2, 20001)
    fullness = 1.0 if section == "rectangle" else 0.25 + 0.75 * (1 - (2 * along / chord) ** 2)
    half = thickness / 2 * fullness * np.ones_like(along)
    return 2 * np.hypot(np.diff(along), np.diff(half)).sum() + 2 * half[0] + 2 * half[-1]


def corner_volume(radius):
    """What the four right-angled corners add, each a square of the offset: integral of 4 offset^2 over the height."""
    height = np.linspace(0.0, radius, 200001)
    offset = radius - np.sqrt(radius**2 - (radius - height) ** 2)
    return np.trapezoid(4 * offset**2, height)


@pytest.mark.parametrize("section", ["rectangle", "lens"])
@pytest.mark.parametrize(("root", "tip"), [(RADIUS, 0.0), (0.0, RADIUS), (RADIUS, RADIUS)])
def test_volume_of_a_fillet_is_that_of_a_quarter_circle(section, root, tip):
    """(1 - pi / 4) r^2 for each length of outline, and the corners."""
    with_fillets = volume(sector(*filleted(section, root, tip), 0.003))
    without = volume(sector(*filleted(section, 0.0, 0.0), 0.003))
    expected = (np.count_nonzero([root, tip])) * (
        (1 - np.pi / 4) * RADIUS**2 * outline(section, 0.030, 0.006) + corner_volume(RADIUS)
    )
    assert with_fillets - without == pytest.approx(expected, rel=0.03)


@pytest.mark.parametrize("radius", [1e-3, 2.5e-4])
def test_volume_of_a_fillet_on_a_plane_wall_is_exact(radius):
    """The hub is nearly flat; of the corners the share falls with the radius."""
    flat = {"hub_radius": 30.0, "n_blades": 4857}
    plain = volume(sector(*filleted("rectangle", 0.0, 0.0, **flat), 0.003))
    gained = volume(sector(*filleted("rectangle", radius, 0.0, **flat), 0.003)) - plain
    wall = (1 - np.pi / 4) * radius**2 * outline("rectangle", 0.030, 0.006)
    assert gained - corner_volume(radius) == pytest.approx(wall, rel=radius)


@pytest.mark.parametrize("size", [0.003, 0.0005])
def test_profile_is_a_quarter_circle(size):
    """Half the thickness over the height, at the nodes; straight edges of elements stay within their sagitta."""
    blade, shroud = filleted(root=RADIUS, tip=0.0, length=0.03, thickness=0.004, chord=0.008)
    mesh = sector(blade, replace(shroud, thickness=0.004, contact_length=0.004, axial_width=0.014), size)
    x, theta, radius = polar(mesh.points)
    levels = np.unique(radius[radius < 0.30 + RADIUS + 1e-9].round(9))
    layers = len(levels) - 1
    assert layers >= 3
    for level in levels:
        here = np.abs(radius - level) < 1e-8
        d = level - 0.30
        circle = RADIUS - np.sqrt(RADIUS**2 - (RADIUS - min(d, RADIUS)) ** 2)
        for extent, half in (((theta * radius)[here].max(), 0.002), (x[here].max(), 0.004)):
            # at the wall the circle is tangent to it, and no straight edge follows it there
            assert extent - half == pytest.approx(circle, abs=RADIUS * (0.25 if d < 1e-9 else 0.04))


@pytest.mark.parametrize("angle", [70.0, 120.0, 180.0])
@pytest.mark.parametrize("section", ["rectangle", "lens"])
def test_elements_are_sound(angle, section):
    blade = replace(SLENDER, section=section, thickness=0.006, tip_thickness=0.004, fillet_radius=0.003)
    mesh = sector(blade, slender_shroud(angle, fillet_radius=0.002), 0.004)
    assert jacobians(mesh, [-1.0, 0.0, 1.0]).min() > 0
    assert hexahedron_scaled_jacobian(mesh.points, mesh.hexahedra).min() > 0.2
    assert len(np.unique(mesh.points, axis=0)) == len(mesh.points)


def test_sections_beyond_the_fillets_are_untouched():
    blade, shroud = filleted("lens", thickness=0.006, tip_thickness=0.004)
    mesh = sector(blade, shroud)
    x, theta, radius = polar(mesh.points)
    inner = 0.30 + 0.15 - 0.005
    between = np.unique(radius[(radius > 0.30 + RADIUS - 1e-9) & (radius < inner - RADIUS + 1e-9)].round(9))
    for level in between:
        here = np.abs(radius - level) < 1e-8
        assert x[here].max() == pytest.approx(0.015, rel=1e-9)
    for lower, upper in pairwise(between):
        tops = [(theta * radius)[np.abs(radius - level) < 1e-8].max() for level in (lower, upper)]
        slope = (tops[1] - tops[0]) / (upper - lower)
        assert slope == pytest.approx(-0.001 / (inner - 0.30), rel=0.02)  # the taper alone


def test_a_fillet_must_fit_on_the_platform_and_between_neighbours():
    blade, shroud = filleted()
    with pytest.raises(GeometryError, match=r"shroud\.fillet_radius = 0\.01: .*at most"):
        check_parameters(blade, replace(shroud, fillet_radius=0.01), MeshParameters(0.004))
    with pytest.raises(GeometryError, match=r"blade\.fillet_radius = 0\.012: neighbouring airfoils.*at most"):
        check_parameters(replace(blade, fillet_radius=0.012), shroud, MeshParameters(0.004))
    with pytest.raises(GeometryError, match=r"blade\.fillet_radius = 0\.08: .*half of the airfoil"):
        check_parameters(replace(blade, fillet_radius=0.08), shroud, MeshParameters(0.004))

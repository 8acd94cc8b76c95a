"""Layers of elements that are thinner at the root and at the shroud than at mid span."""

from dataclasses import replace

import numpy as np
import pytest
from geometry_support import SLENDER, polar, sector, slender_shroud, volume

from geometry import MeshParameters, build_sector
from geometry.quality import hexahedron_scaled_jacobian

SHROUD = slender_shroud(70.0)
INNER = SLENDER.hub_radius + SLENDER.length - SHROUD.thickness


def layers(mesh):
    """Thickness of the airfoil's layers from the root up, m."""
    radius = polar(mesh.points)[2]
    levels = np.unique(radius[radius < INNER + 1e-9].round(9))
    return np.diff(levels)


@pytest.mark.parametrize("grading", [1.5, 4.0, 20.0])
@pytest.mark.parametrize("size", [0.006, 0.003])
def test_layers_grow_steadily_from_both_ends(grading, size):
    found = layers(build_sector(SLENDER, SHROUD, MeshParameters(size, grading=grading)))
    assert np.sum(found) == pytest.approx(INNER - SLENDER.hub_radius, rel=1e-9)
    np.testing.assert_allclose(found, found[::-1], atol=2e-9)
    assert found.max() <= size * (1 + 1e-6)
    assert found.max() / found[0] == pytest.approx(grading, rel=1e-3)
    ratios = found[1:] / found[:-1]
    assert ratios.max() < 1.51
    assert np.all(np.diff(found[: len(found) // 2]) > -2e-9)


def test_without_grading_layers_are_alike_and_grading_adds_few():
    alike = layers(build_sector(SLENDER, SHROUD, MeshParameters(0.004, grading=1.0)))
    np.testing.assert_allclose(alike, alike[0], atol=2e-9)
    graded = layers(build_sector(SLENDER, SHROUD, MeshParameters(0.004, grading=4.0)))
    assert len(alike) < len(graded) <= len(alike) + 8


def test_no_layer_is_twisted_by_more_than_without_grading():
    blade = replace(SLENDER, twist=60.0)
    for grading in (1.0, 8.0):
        found = layers(build_sector(blade, SHROUD, MeshParameters(0.018, grading=grading)))
        assert found.max() / np.sum(found) * 60.0 <= 15.0 + 1e-6


@pytest.mark.parametrize("angle", [30.0, 120.0, 180.0])
def test_graded_elements_are_sound(angle):
    shroud = slender_shroud(angle)
    mesh = build_sector(SLENDER, shroud, MeshParameters(0.005, grading=8.0))
    assert hexahedron_scaled_jacobian(mesh.points, mesh.hexahedra).min() > 0.4
    assert volume(mesh) == pytest.approx(volume(sector(SLENDER, shroud, 0.003)), rel=3e-4)

"""The elements: positive everywhere, well shaped, joined face to face, few."""

from dataclasses import replace

import numpy as np
import pytest
from geometry_support import (
    FIGURE,
    SLENDER,
    boundary_quads,
    figure_shroud,
    jacobians,
    sector,
    slender_shroud,
)

from geometry.quality import hexahedron_scaled_jacobian

ANGLES = (30.0, 45.0, 60.0, 70.0, 90.0, 110.0, 120.0, 150.0, 180.0)


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("size", [0.005, 0.003])
@pytest.mark.parametrize("twist", [0.0, 25.0])
def test_jacobians_are_positive_and_shapes_good(angle, size, twist):
    mesh = sector(replace(SLENDER, twist=twist), slender_shroud(angle), size)
    assert jacobians(mesh, [-1.0, -0.7, 0.0, 0.7, 1.0]).min() > 0
    assert hexahedron_scaled_jacobian(mesh.points, mesh.hexahedra).min() > 0.4


@pytest.mark.parametrize("angle", [70.0, 180.0])
@pytest.mark.parametrize("size", [0.005, 0.004])
def test_figure_blade_is_small_and_well_shaped(angle, size):
    mesh = sector(FIGURE, figure_shroud(angle), size)
    assert hexahedron_scaled_jacobian(mesh.points, mesh.hexahedra).min() > 0.6
    edges = np.concatenate(
        [
            mesh.hexahedra[:, [a, b]]
            for a, b in (
                (0, 1),
                (1, 2),
                (2, 3),
                (3, 0),
                (4, 5),
                (5, 6),
                (6, 7),
                (7, 4),
                (0, 4),
                (1, 5),
                (2, 6),
                (3, 7),
            )
        ]
    )
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    dofs = 3 * (len(mesh.points) + len(edges))  # 20-node hexahedra: corners and mid-sides
    assert 10_000 < dofs < 25_000


def test_scaled_jacobian_against_the_angles_of_a_skewed_brick():
    """A brick sheared by an angle has the cosine of it; a squeezed one keeps 1; a folded one is negative."""
    brick = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
    table = np.arange(8)[None]
    shear = np.array([[1, 0, 0], [0, 1, 0], [0.75, 0, 1]])
    assert hexahedron_scaled_jacobian(brick, table)[0] == pytest.approx(1.0)
    assert hexahedron_scaled_jacobian(brick * [10, 1, 0.1], table)[0] == pytest.approx(1.0)
    assert hexahedron_scaled_jacobian(brick @ shear, table)[0] == pytest.approx(np.cos(np.arctan(0.75)))
    assert hexahedron_scaled_jacobian(brick * [1, 1, -1], table)[0] == pytest.approx(-1.0)


@pytest.mark.parametrize("angle", [30.0, 70.0, 90.0, 180.0])
def test_elements_are_joined_face_to_face(angle):
    mesh = sector(SLENDER, slender_shroud(angle))
    assert len(np.unique(mesh.points, axis=0)) == len(mesh.points)
    np.testing.assert_array_equal(np.unique(mesh.hexahedra), np.arange(len(mesh.points)))
    # the surface is closed: every edge of it belongs to two of its quads, one in each direction; Euler: a ball
    quads = boundary_quads(mesh)
    edges = np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2)
    forward = {tuple(edge) for edge in edges}
    assert len(forward) == len(edges)
    assert forward == {(b, a) for a, b in forward}
    assert len(np.unique(quads)) - len(edges) // 2 + len(quads) == 2


@pytest.mark.parametrize("angle", [70.0, 120.0])
def test_size_is_respected(angle):
    """No edge of the airfoil or platform is much longer than asked for, and refining refines."""
    for size in (0.004, 0.002):
        mesh = sector(SLENDER, slender_shroud(angle), size)
        corners = mesh.points[mesh.hexahedra]
        longest = max(
            np.linalg.norm(corners[:, a] - corners[:, b], axis=1).max() for a, b in ((0, 1), (1, 2), (0, 4))
        )
        assert longest < 2.0 * size
    assert len(sector(SLENDER, slender_shroud(angle), 0.002).points) > 3 * len(
        sector(SLENDER, slender_shroud(angle), 0.004).points
    )

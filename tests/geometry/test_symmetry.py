"""Exact symmetries of the mesh: half turn about the stacking axis, mirror image for alpha > 90."""

from dataclasses import replace

import numpy as np
import pytest
from geometry_support import FIGURE, SLENDER, figure_shroud, sector, slender_shroud


def as_set(points):
    return {tuple(point) for point in points + 0.0}  # -0.0 and 0.0 are the same place


def element_sets(mesh, factors):
    """Each element as the set of its corner places; two meshes are equal when these are."""
    moved = mesh.points * factors + 0.0
    return {frozenset(map(tuple, moved[corners])) for corners in mesh.hexahedra}


@pytest.mark.parametrize("angle", [30.0, 70.0, 90.0, 120.0, 180.0])
@pytest.mark.parametrize("section", ["rectangle", "lens"])
def test_half_turn_about_the_stacking_axis(angle, section):
    mesh = sector(replace(SLENDER, section=section), slender_shroud(angle, gap=1e-4))
    turn = np.array([-1.0, -1.0, 1.0])
    assert as_set(mesh.points) == as_set(mesh.points * turn)
    assert element_sets(mesh, 1.0) == element_sets(mesh, turn)
    # it exchanges the faces and turns the order along t1 round
    right = mesh.right.position.reshape(3, 3, 3)[:, ::-1].reshape(9, 3)
    np.testing.assert_array_equal(right * turn, mesh.left.position)


@pytest.mark.parametrize("angle", [30.0, 45.0, 70.0, 89.5])
@pytest.mark.parametrize("grid", [(3, 3), (4, 2)])
def test_obtuse_angles_are_mirror_images(angle, grid):
    mesh = sector(SLENDER, slender_shroud(angle), 0.004, grid)
    other = sector(replace(SLENDER, twist=-SLENDER.twist), slender_shroud(180.0 - angle), 0.004, grid)
    mirror = np.array([-1.0, 1.0, 1.0])
    np.testing.assert_array_equal(mesh.points * mirror + 0.0, other.points + 0.0)
    assert element_sets(mesh, mirror) == element_sets(other, 1.0)
    for side in ("right", "left"):
        face, image = getattr(mesh, side), getattr(other, side)
        order = np.arange(grid[0] * grid[1]).reshape(grid[1], grid[0])[:, ::-1].ravel()
        np.testing.assert_array_equal(face.position[order] * mirror + 0.0, image.position + 0.0)
        # t1 keeps pointing towards +x, so it changes sign; t2 and n are mirrored
        np.testing.assert_allclose(
            face.frame[order] * mirror * np.array([-1, 1, 1])[:, None], image.frame, atol=1e-13
        )


def test_straight_sides_are_the_limit_of_both_kinds():
    """alpha 180 and alpha near 0 describe the same straight side."""
    straight = sector(FIGURE, figure_shroud(180.0))
    shallow = sector(FIGURE, figure_shroud(1e-7))
    np.testing.assert_allclose(straight.right.position, shallow.right.position, atol=1e-10)
    np.testing.assert_allclose(straight.right.frame, shallow.right.frame, atol=1e-8)
    assert straight.right.position[:, 0].min() == pytest.approx(-0.004)

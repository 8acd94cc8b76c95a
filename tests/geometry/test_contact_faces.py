"""The two contact faces: where their nodes lie, how they match, their frames and areas."""

import numpy as np
import pytest
from geometry_support import (
    FIGURE,
    SLENDER,
    face_quads,
    figure_shroud,
    mid_radius,
    next_blade,
    polar,
    quad_vectors,
    sector,
    slender_shroud,
)

ANGLES = (30.0, 45.0, 60.0, 70.0, 90.0, 110.0, 120.0, 150.0, 180.0)

ROUND_OFF = 1e-13  # of unit vectors and coordinates below 1 m; sines and roots differ between C libraries


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("gap", [0.0, 2e-4])
def test_left_is_right_turned_back_by_one_pitch_less_the_gap(angle, gap):
    shroud = slender_shroud(angle, gap=gap)
    mesh = sector(SLENDER, shroud)
    turn = 2 * np.pi / SLENDER.n_blades - gap / mid_radius(SLENDER, shroud)
    neighbour = next_blade(mesh.left.position, turn)
    radius = SLENDER.hub_radius + SLENDER.length
    assert np.abs(neighbour - mesh.right.position).max() < 1e-12 * radius
    # all nodes of the faces, not only the grid
    face = next_blade(mesh.points[mesh.node_sets["face_left"]], turn)
    assert np.abs(face - mesh.points[mesh.node_sets["face_right"]]).max() < 1e-12 * radius
    # the frames turn by the whole pitch, so that cyclic symmetry needs no further rotation
    back = next_blade(mesh.left.frame, 2 * np.pi / SLENDER.n_blades)
    assert np.abs(back - mesh.right.frame).max() < ROUND_OFF


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("grid", [(3, 3), (2, 2), (5, 3), (1, 1), (4, 6)])
def test_nodes_are_the_centres_of_equal_rectangles(angle, grid):
    shroud = figure_shroud(angle)
    mesh = sector(FIGURE, shroud, 0.005, grid)
    middle = mid_radius(FIGURE, shroud)
    x, theta, radius = polar(mesh.right.position)
    # along t1 from the centre of the face; design section 3
    t1 = np.array([1.0, 1.0]) if angle <= 90 else np.array([-1.0, -1.0])
    t1 = t1 * [np.cos(np.radians(angle)), np.sin(np.radians(angle))]
    along = (np.arange(grid[0]) + 0.5) / grid[0] - 0.5
    height = (np.arange(grid[1]) + 0.5) / grid[1] - 0.5
    along, height = np.tile(along, grid[1]), np.repeat(height, grid[0])  # k = i_t1 + n_t1 i_t2
    np.testing.assert_allclose(x, along * 0.012 * t1[0], atol=ROUND_OFF)
    np.testing.assert_allclose(middle * theta, np.pi * middle / 120 + along * 0.012 * t1[1], atol=ROUND_OFF)
    np.testing.assert_allclose(radius, middle + height * 0.006, rtol=ROUND_OFF)
    assert np.array_equal(mesh.points[mesh.right.nodes], mesh.right.position)
    assert np.array_equal(mesh.points[mesh.left.nodes], mesh.left.position)
    assert np.array_equal(mesh.node_sets["contact_right"], mesh.right.nodes)
    assert np.array_equal(mesh.node_sets["contact_left"], mesh.left.nodes)


@pytest.mark.parametrize("angle", ANGLES)
def test_frames_follow_the_conventions(angle):
    mesh = sector(FIGURE, figure_shroud(angle))
    t1, t2, n = np.moveaxis(mesh.right.frame, 1, 0)
    np.testing.assert_allclose(
        mesh.right.frame @ np.swapaxes(mesh.right.frame, 1, 2), np.tile(np.eye(3), (9, 1, 1)), atol=ROUND_OFF
    )
    # seen from the tip: e_x, e_theta (towards the next blade), e_r make a right-handed triad
    e_r = mesh.right.position * [0, 1, 1]
    e_r /= np.linalg.norm(e_r, axis=1)[:, None]
    e_x = np.tile([1.0, 0, 0], (9, 1))
    e_theta = np.cross(e_r, e_x)
    assert (e_theta[:, 1] > 0).all()
    a = np.radians(angle)
    sign = 1 if angle <= 90 else -1
    np.testing.assert_allclose(t1, sign * (np.cos(a) * e_x + np.sin(a) * e_theta), atol=ROUND_OFF)
    np.testing.assert_allclose(n, sign * (-np.sin(a) * e_x + np.cos(a) * e_theta), atol=ROUND_OFF)
    np.testing.assert_allclose(t2, e_r, atol=ROUND_OFF)
    # with these conventions (t1, n, t2) is the right-handed order
    np.testing.assert_allclose(np.cross(t1, n), t2, atol=ROUND_OFF)


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("side", ["right", "left"])
def test_frames_are_tangent_and_normal_to_the_meshed_face(angle, side):
    """The true face is radial, and its slope grows with r / mid radius: the frame is exact at mid height."""
    shroud = figure_shroud(angle)
    mesh = sector(FIGURE, shroud, 0.002)
    face = getattr(mesh, side)
    quads = face_quads(mesh, mesh.node_sets[f"face_{side}"])
    vectors = quad_vectors(mesh, quads)
    outward = 1 if side == "right" else -1  # the left frame is the right one turned, so its n points inward
    for k, node in enumerate(face.nodes):
        normal = vectors[(quads == node).any(axis=1)].sum(axis=0)
        normal *= outward / np.linalg.norm(normal)
        angle_between = np.arcsin(np.linalg.norm(np.cross(normal, face.frame[k, 2])))
        assert normal @ face.frame[k, 2] > 0
        at_mid_height = 3 <= k < 6
        tolerance = 2e-5 if at_mid_height else shroud.thickness / 2 / mid_radius(FIGURE, shroud)
        assert angle_between < tolerance


@pytest.mark.parametrize("angle", ANGLES)
def test_areas_are_those_of_the_meshed_face(angle):
    mesh = sector(FIGURE, figure_shroud(angle), 0.002)
    for side in ("right", "left"):
        area = getattr(mesh, side).area
        np.testing.assert_allclose(area, 0.012 * 0.006 / 9, rtol=1e-12)
        quads = face_quads(mesh, mesh.node_sets[f"face_{side}"])
        meshed = np.linalg.norm(quad_vectors(mesh, quads), axis=1).sum()
        assert meshed == pytest.approx(area.sum(), rel=2e-5)


@pytest.mark.parametrize("angle", ANGLES)
def test_profile_is_a_z_that_rises_or_falls_as_it_should(angle):
    shroud = figure_shroud(angle)
    mesh = sector(FIGURE, shroud)
    middle = mid_radius(FIGURE, shroud)
    x, theta, _ = polar(mesh.points[mesh.node_sets["tip_surface"]])
    s = theta * middle
    a = np.radians(angle)
    rise = 0.012 * np.sin(a) * (1 if angle <= 90 else -1)
    run = 0.012 * abs(np.cos(a))
    pitch = 2 * np.pi * middle / 120
    # highest node at both axial edges: the side edges lie half the rise below and above half a pitch
    for edge, sign in ((-0.028, -1), (0.028, 1)):
        at_edge = np.abs(x - edge) < 1e-12
        assert s[at_edge].max() == pytest.approx(pitch / 2 + sign * rise / 2, abs=ROUND_OFF)
        assert s[at_edge].min() == pytest.approx(-pitch / 2 + sign * rise / 2, abs=ROUND_OFF)
    # beyond the contact segment nothing is higher than the side edge of its side
    before, after = x < -run / 2 - 1e-12, x > run / 2 + 1e-12
    assert s[before].max() == pytest.approx(pitch / 2 - rise / 2, abs=ROUND_OFF)
    assert s[after].max() == pytest.approx(pitch / 2 + rise / 2, abs=ROUND_OFF)

"""Faces of meshes from elsewhere: axes and units, pairs and gaps, areas, frames and contact points."""

import numpy as np
import pytest
from own_mesh_support import N_BLADES, NAMES, Form, dummy, five_tets, imported, tet_wedge, wedge

from geometry.errors import OwnMeshError
from geometry.frames import rotate_about_axis
from geometry.own_mesh.own_sector import sector_from_mesh
from geometry.own_mesh.ring import fitting_ring
from geometry.own_mesh.sector_choice import SectorChoice
from geometry.own_mesh.side_quadrature import quadrature, side_shapes
from geometry.sector import check_sector

ANGLES = np.radians([33.0, -71.0, 118.0])


def some_rotation():
    matrix = np.eye(3)
    for k, angle in enumerate(ANGLES):
        i, j = [axis for axis in range(3) if axis != k]
        turn = np.eye(3)
        turn[[i, i, j, j], [i, j, i, j]] = np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)
        matrix = matrix @ turn
    return matrix


def own(mesh, n_blades=40, **changes):
    return sector_from_mesh(mesh, SectorChoice(n_blades, **{"sets": NAMES, **changes}))


@pytest.mark.parametrize(
    ("angle", "frames", "areas"), [(180.0, 1e-12, 1e-12), (90.0, 1e-12, 3e-5), (70.0, 2e-3, 2e-5)]
)
def test_the_blade_of_the_mesher_comes_back_with_its_faces(angle, frames, areas):
    """At 180 degrees the faces are plane; at the others they bend with the ring, the sides of elements do not."""
    made = dummy(angle)
    found = own(imported(made), N_BLADES).sector
    check_sector("blade.inp", found)
    np.testing.assert_array_equal(found.points, made.points)
    for face, wanted in ((found.right, made.right), (found.left, made.left)):
        np.testing.assert_array_equal(face.nodes, wanted.nodes)
        np.testing.assert_array_equal(face.position, wanted.position)
        np.testing.assert_allclose(face.frame, wanted.frame, atol=frames)
        assert face.area.sum() == pytest.approx(wanted.area.sum(), rel=areas)
        np.testing.assert_allclose(face.area, wanted.area, rtol=max(areas, 5e-3 if angle != 180.0 else 0.0))
    for name in ("tip", "contact_right", "contact_left"):
        np.testing.assert_array_equal(found.node_sets[name], made.node_sets[name])
    for name in ("root", "face_right", "face_left"):
        np.testing.assert_array_equal(found.node_sets[name], np.sort(made.node_sets[name]))


@pytest.mark.parametrize(("unit", "metres"), [("m", 1.0), ("mm", 1e-3), ("in", 0.0254)])
def test_any_axes_and_units_give_the_same_sector(unit, metres):
    made, turn = dummy(70.0), some_rotation()
    mesh = imported(made, metres, turn)
    point = np.array([3.0, -2.0, 5.0]) / metres
    mesh = type(mesh)(**{**vars(mesh), "points": mesh.points + point, "materials": {"steel": {"density": 2.0}}})
    found = own(mesh, N_BLADES, unit=unit, axis=turn[:, 0], axis_point=point)
    np.testing.assert_allclose(found.sector.points, made.points, atol=1e-12)
    np.testing.assert_allclose(found.sector.right.position, made.right.position, atol=1e-12)
    np.testing.assert_allclose(found.findings.rotation, turn.T, atol=1e-12)
    assert found.findings.lines[2].startswith("axes: x, y, z here = (")
    # 1 t/mm^3 = 1e12 kg/m^3, 1 lbf s^2/in^4 = 1.0686896e7 kg/m^3
    factor = {"m": 1.0, "mm": 1e12, "in": 1.0686896e7}[unit]
    assert found.materials["steel"]["density"] == pytest.approx(2.0 * factor, rel=1e-7)


def test_the_opposite_direction_of_the_axis_exchanges_the_faces():
    forward, backward = own(imported(dummy(70.0)), N_BLADES), own(imported(dummy(70.0)), N_BLADES, axis="-x")
    assert any("swapped" in line for line in backward.findings.lines)
    np.testing.assert_allclose(backward.sector.points, forward.sector.points * [-1.0, -1.0, 1.0], atol=1e-13)
    for found in (forward, backward):
        right, left = found.sector.right, found.sector.left
        assert right.position[:, 1].mean() > left.position[:, 1].mean()
        pitch = 2 * np.pi / N_BLADES
        np.testing.assert_allclose(left.position, rotate_about_axis(right.position, -pitch), atol=1e-12)


@pytest.mark.parametrize("gap", [2e-5, 1e-4])
@pytest.mark.parametrize("angle", [180.0, 70.0])
def test_the_gap_is_the_distance_along_the_normal(angle, gap):
    """The design gap is along the circumference; the contact normal sees its part sin(alpha) or 1."""
    findings = own(imported(dummy(angle, gap)), N_BLADES).findings
    share = 1.0 if angle == 180.0 else np.cos(np.radians(angle))
    assert findings.matching
    np.testing.assert_allclose(findings.gap, share * gap, rtol=0.02)
    assert findings.mismatch == pytest.approx(gap * np.sqrt(1 - share**2), rel=0.02, abs=2e-7)


FORMS = {"rectangle": Form(), "skew": Form(skew=0.4), "trapezium": Form(taper=0.5), "curved": Form(bulge=0.002)}


@pytest.mark.parametrize("name", FORMS)
def test_faces_that_do_not_match_are_as_good(name):
    form = FORMS[name]
    fine, found = own(wedge(form, (10, 1, 8))), own(tet_wedge(form))
    assert fine.findings.matching
    assert not found.findings.matching
    np.testing.assert_allclose(found.findings.areas, fine.findings.areas, rtol=1e-9 if name != "curved" else 2e-3)
    assert np.abs(found.findings.gap).max() < (1e-11 if name != "curved" else 1e-6)
    assert found.findings.overlap > 0.999
    for face, other in ((found.sector.right, fine.sector.right), (found.sector.left, fine.sector.left)):
        np.testing.assert_allclose(face.frame, other.frame, atol=1e-6 if name != "curved" else 0.02)
        assert np.linalg.norm(face.position - other.position, axis=1).max() < 1.5e-3  # cells of 10 by 7 mm
        assert face.area.sum() == pytest.approx(found.findings.areas[0], rel=1e-12)
    t1, t2, n = np.moveaxis(found.sector.right.frame, 1, 0)
    np.testing.assert_allclose(np.cross(n, t2), t1, atol=1e-12)
    assert (n[:, 1] > 0.9).all()
    assert (t2[:, 2] > 0.9).all()


def test_frames_follow_a_curved_face():
    """Parabola y = b (1 - (2 x / w)^2) at radius 0.31: the normal turns by its slope, 8 b x / w^2."""
    form = Form(bulge=0.003)
    sector = own(wedge(form, (20, 1, 6)), contact_grid=(5, 3)).sector
    at, normal = sector.right.position, sector.right.frame[:, 2]
    slope = 8.0 * 0.003 * at[:, 0] / 0.03**2 * np.hypot(at[:, 1], at[:, 2]) / 0.31
    np.testing.assert_allclose(normal[:, 0] / np.hypot(normal[:, 1], normal[:, 2]), slope, atol=0.01)
    assert np.abs(slope).max() > 0.3


@pytest.mark.parametrize("grid", [(1, 1), (3, 3), (5, 2), (12, 8)])
def test_contact_points_have_equal_parts_of_the_area(grid):
    for form in (Form(), Form(taper=0.5)):
        face = own(wedge(form, (12, 1, 8)), contact_grid=grid).sector.right
        assert len(face.nodes) == grid[0] * grid[1]
        assert face.area.sum() == pytest.approx(0.03 * 0.02 * (0.75 if form.taper else 1.0), rel=1e-9)
        assert face.area.min() > 0.7 * face.area.mean()
        along = (face.position @ face.frame[0, 0]).reshape(grid[1], grid[0])
        assert (np.diff(along, axis=1) > 0.0).all()


def test_without_a_grid_all_corner_nodes_are_contact_nodes():
    found = own(wedge(divisions=(3, 2, 4)), contact_grid=None).sector
    assert len(found.right.nodes) == 16  # four of 20 are clamped
    pitch = 2 * np.pi / 40
    np.testing.assert_allclose(found.left.position, rotate_about_axis(found.right.position, -pitch), atol=1e-12)
    assert found.right.area.sum() == pytest.approx(6e-4)
    with pytest.raises(OwnMeshError, match=r"mesh.contact_grid: must be two numbers"):
        own(tet_wedge(), contact_grid=None)


@pytest.mark.parametrize("count", [3, 4, 6, 8])
def test_sides_have_the_area_of_a_sphere(count):
    """Sides of an octant of a sphere, from coarse to fine: the error of the area falls as h^2 or h^4."""
    errors = []
    for n in (4, 8):
        line = np.linspace(0.0, 1.0, 2 * n + 1)
        a, b = np.meshgrid(line * 0.8, line * 0.8 - 0.4, indexing="ij")
        points = np.stack([np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)], axis=-1).reshape(-1, 3)
        index = np.arange(len(points)).reshape(a.shape)
        i, j = (2 * each.ravel() for each in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
        ring = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
        first = [(0, 0), (2, 0), (2, 2), (1, 0), (2, 1), (1, 1)]
        second = [(0, 0), (2, 2), (0, 2), (1, 1), (1, 2), (0, 1)]
        local = [ring[:count]] if count in (4, 8) else [first[:count], second[:count]]
        tables = [np.concatenate([np.stack([index[i + u, j + v] for u, v in each], axis=1) for each in local])]
        errors.append(abs(quadrature(points, tables).area.sum() - 0.8 * 2.0 * np.sin(0.4)))
    assert errors[1] < errors[0] / (3.5 if count in (3, 4) else 12.0)
    values, slopes = side_shapes(count, np.array([[0.2, 0.3]]))
    assert values.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(slopes.sum(axis=1), 0.0, atol=1e-12)


@pytest.mark.parametrize("layers", [1, 2])
def test_unnamed_faces_of_tetrahedra_are_whole(layers):
    """With one layer the triangles of the two faces share their nodes, with two layers their edges as well."""
    divisions = (3, layers, 4)
    mesh = five_tets(wedge(divisions=divisions), divisions)
    found = own(mesh, sets={"root": "ROOT"})
    assert found.findings.matching
    np.testing.assert_allclose(found.findings.areas, 0.03 * 0.02, rtol=1e-9)
    assert np.array_equal(found.sector.node_sets["face_right"], np.sort(mesh.node_sets["PS_FACE"]))
    assert fitting_ring(mesh).n_blades == 40


@pytest.mark.parametrize("form", [Form(), Form(skew=0.4), Form(bulge=0.002)])
def test_unnamed_faces_without_common_nodes_lie_on_each_other(form):
    """Only the corners and a few triangles at them match node by node: these are no faces."""
    mesh = tet_wedge(form, right=(4, 4), left=(4, 6))
    found = own(mesh, sets={"root": "ROOT"})
    assert not found.findings.matching
    np.testing.assert_allclose(found.findings.areas, own(mesh).findings.areas, rtol=1e-12)
    assert fitting_ring(mesh).n_blades == 40


def test_parallel_walls_are_no_faces():
    """A straight airfoil: its two sides are parallel, near images under a pitch as small as it is thin."""
    mesh = five_tets(wedge(Form(n_blades=400), (3, 1, 4)), (3, 1, 4))
    flat = mesh.points.copy()
    flat[:, 1] = np.sign(flat[:, 1]) * np.abs(flat[:, 1]).mean()
    assert fitting_ring(type(mesh)(**{**vars(mesh), "points": flat})) is None


def test_parts_of_larger_surfaces_are_named_and_refused():
    """One edge of the right wall is elsewhere: the rest of the two walls matches."""
    mesh = wedge(divisions=(3, 2, 4))
    points = mesh.points.copy()
    moved = (np.hypot(points[:, 1], points[:, 2]) < 0.307) & (points[:, 1] > 1e-4) & (points[:, 0] < 0.0)
    moved &= np.hypot(points[:, 1], points[:, 2]) > 0.301
    points[moved, 0] += 0.002
    with pytest.raises(OwnMeshError, match=r"1 pair of surfaces .* a part of a larger surface on both sides"):
        own(type(mesh)(**{**vars(mesh), "points": points}), sets={"root": "ROOT"})

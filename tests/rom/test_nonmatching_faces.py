"""Faces whose meshes differ: statics on both sides, tied frequencies against a matching mesh, large faces."""

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from geometry import ContactFace
from geometry.own_mesh.own_sector import sector_from_mesh
from geometry.own_mesh.sector_choice import SectorChoice
from rom import (
    BoundaryChoice,
    Material,
    ReductionOptions,
    RomParameterError,
    assemble,
    natural_frequencies,
    reduce_sector,
)
from rom.finite_elements.discretisation import discretise
from rom.reduction.boundary_dofs import averaged_variables
from rom.reduction.contact_dofs import averaged_dofs, contact_nodes

sys.path.append(str(Path(__file__).parents[1] / "geometry"))
from own_mesh_support import NAMES, Form, tet_wedge, wedge

STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0)
PITCH = 2 * np.pi / 40
FORWARD = np.array([[1, 0, 0], [0, np.cos(PITCH), np.sin(PITCH)], [0, -np.sin(PITCH), np.cos(PITCH)]])
FORMS = {
    "rectangle": Form(),
    "parallelogram": Form(skew=0.5),
    "trapezium": Form(taper=0.5),
    "cylinder": Form(bulge=0.002),
}


def sector_of(mesh, grid=(3, 3)):
    return sector_from_mesh(mesh, SectorChoice(40, sets=NAMES, contact_grid=grid)).sector


@pytest.mark.parametrize("kind", ["mortar", "patch"])
@pytest.mark.parametrize("name", FORMS)
@pytest.mark.parametrize("order", [1, 2])
def test_contact_forces_are_equivalent_on_both_faces(name, order, kind):
    """Nodal forces of any forces at the contact points: one resultant and one moment, those of the points."""
    sector = sector_of(tet_wedge(FORMS[name], order=order))
    dofs, positions = averaged_dofs(sector, None, kind), discretise(sector).positions
    force = np.random.default_rng(2).standard_normal((dofs.count, 3))
    resultants, moments = [], []
    for weights, turn in ((dofs.weights[: dofs.count], np.eye(3)), (dofs.weights[dofs.count :], FORWARD.T)):
        nodal = weights.T @ force
        resultants.append(nodal.sum(axis=0))
        moments.append(np.cross(positions @ turn, nodal).sum(axis=0))
    size = 0.03 * np.abs(force).sum()
    np.testing.assert_allclose(resultants[0], force.sum(axis=0), atol=1e-12 * np.abs(force).sum())
    np.testing.assert_allclose(resultants[1], resultants[0], atol=1e-12 * np.abs(force).sum())
    np.testing.assert_allclose(moments[1], moments[0], atol=1e-12 * size)
    np.testing.assert_allclose(moments[0], np.cross(dofs.position, force).sum(axis=0), atol=1e-12 * size)
    assert dofs.area.sum() == pytest.approx(sector.right.area.sum(), rel=1e-12)
    np.testing.assert_allclose(contact_nodes(sector, kind).area, dofs.area, rtol=1e-12)


@pytest.mark.parametrize("name", FORMS)
def test_springs_have_the_rotational_stiffness_of_any_face(name):
    """Rigid rotations about the axes of the face: the energy of springs spread over it, by plain quadrature."""
    sector = sector_of(wedge(FORMS[name], (8, 2, 8)))
    dofs, positions = averaged_dofs(sector, None, "mortar"), discretise(sector).positions
    fine = sector_of(wedge(FORMS[name], (16, 1, 16)), (16, 16)).right
    centre = fine.area @ fine.position / fine.area.sum()
    for axis in fine.frame[len(fine.frame) // 2, :2]:
        normal = np.sum(np.cross(axis, fine.position - centre) * fine.frame[:, 2], axis=1)
        turned = np.cross(axis, positions - centre)
        found = (dofs.motion @ turned.ravel())[2 : 3 * dofs.count : 3]
        assert dofs.area @ found**2 == pytest.approx(fine.area @ normal**2, rel=1e-2)


@cache
def body(name):
    """Sector and full model of fine bricks, of tetrahedra with faces alike, and with other divisions on the left."""
    makers = {
        "fine": lambda: wedge(Form(), (6, 4, 4)),
        "matching": lambda: tet_wedge(Form(), (5, 4), (5, 4)),
        "other": lambda: tet_wedge(Form(), (5, 4), (6, 5)),
    }
    sector = sector_of(makers[name]())
    return sector, assemble(sector, STEEL, "hex20" if name == "fine" else None)


def tied_hz(name, kind, phase):
    """Lowest frequencies with nearly rigid springs on the faces."""
    sector, full = body(name)
    options = ReductionOptions(modes=15, store_basis=False)
    model = reduce_sector(full, sector, options, BoundaryChoice(contact_dofs=kind)).model
    share = 1e9 * model.contact_area / model.contact_area.sum()
    return natural_frequencies(model, phase, normal=share, tangential=share, count=5)


@pytest.mark.parametrize("kind", ["mortar", "patch"])
def test_stuck_frequencies_are_those_of_a_matching_mesh(kind):
    """Against fine bricks, faces that do not match are off by as much as matching ones of the same elements."""
    exact, matching, other = (tied_hz(name, kind, 0.6) for name in ("fine", "matching", "other"))
    mesh_error = np.abs(matching / exact - 1.0).max()
    assert mesh_error < 8e-3
    assert np.abs(other / exact - 1.0).max() < 1.5 * mesh_error


def test_nodal_contact_dofs_need_meshes_that_match():
    sector = sector_of(tet_wedge())
    full = assemble(sector, STEEL, None)
    with pytest.raises(RomParameterError, match="needs faces whose meshes match") as caught:
        reduce_sector(full, sector, ReductionOptions(modes=2), BoundaryChoice(contact_dofs="nodal"))
    assert "\n" not in str(caught.value)


def test_a_face_that_touches_the_clamped_root_is_reduced():
    """The boundary dofs stand at nodes that are free, though the averages hold clamped ones."""
    sector = sector_of(wedge(divisions=(3, 2, 3)))
    full = assemble(sector, STEEL)
    model = reduce_sector(full, sector, ReductionOptions(modes=5), BoundaryChoice(contact_dofs="mortar")).model
    assert np.linalg.eigvalsh(model.stiffness).min() > 0.0
    assert np.isin(sector.node_sets["face_right"], full.fixed // 3).any()


def test_thousands_of_nodes_on_a_face_have_dofs():
    sector = sector_of(wedge(divisions=(28, 1, 28)), (6, 6))
    dofs = averaged_dofs(sector, None, "mortar")
    nodes, change = averaged_variables(dofs.weights, np.empty(0, dtype=np.int64), "mortar")
    assert len(nodes) == 72
    values = np.random.default_rng(1).standard_normal(len(sector.points))
    assert isinstance(sector.right, ContactFace)
    np.testing.assert_allclose((dofs.weights @ (change @ values)), values[nodes], atol=1e-9)

"""Natural frequencies of the assembled matrices against closed forms and published benchmarks."""

import numpy as np
import pytest
from rom_meshes import annulus, box, mesh_of
from rom_reference import lowest_hz, timoshenko_cantilever_hz

from rom import Material
from rom.finite_elements.assembly import elastic_matrices
from rom.finite_elements.discretisation import discretise
from rom.finite_elements.full_model import node_dofs
from rom.linear_algebra.factorisation import factorise
from rom.reduction.fixed_interface_modes import lowest_modes

NAFEMS_STEEL = Material(young_modulus=200e9, poisson_ratio=0.3, density=8000.0)


def cantilever_hz(divisions, material, element="hex20", lengths=(1.0, 0.03, 0.02)):
    points, hexahedra = box(divisions, lengths)
    mesh = discretise(mesh_of(points, hexahedra), element)
    root = node_dofs(np.flatnonzero(mesh.positions[:, 0] < 1e-9)).ravel()
    return lowest_hz(*elastic_matrices(mesh, material), 6, root)


def test_cantilever_beam_bends_at_the_closed_form_frequencies():
    # Without a Poisson's ratio the clamped end is the beam's clamped end and nothing but the mesh is left over.
    material = Material(2.1e11, 0.0, 7800.0)
    found = cantilever_hz((40, 2, 2), material)
    both = [timoshenko_cantilever_hz(1.0, *section, material) for section in ((0.03, 0.02), (0.02, 0.03))]
    np.testing.assert_allclose(found, np.sort(np.concatenate(both)), rtol=3.5e-4)
    slender = 1.8751041**2 / (2 * np.pi) * 0.02 * np.sqrt(2.1e11 / (12 * 7800.0))
    assert found[0] == pytest.approx(slender, rel=3e-4)


def test_cantilever_beam_converges_from_above_at_fourth_order():
    material = Material(2.1e11, 0.0, 7800.0)
    exact = cantilever_hz((160, 1, 1), material)[:4]
    coarse, middle, fine = (cantilever_hz((n, 1, 1), material)[:4] / exact - 1 for n in (20, 40, 80))
    assert np.all((coarse > middle) & (middle > fine) & (fine > 0))
    assert np.all(np.log2(coarse / middle) > 3.4)
    np.testing.assert_allclose(np.log2(middle / fine), 4.0, atol=0.2)


def fv52_hz(divisions, element="hex20"):
    points, hexahedra = box(divisions, (10.0, 10.0, 1.0))
    mesh = discretise(mesh_of(points, hexahedra), element)
    x, y, z = mesh.positions.T
    edge = (np.abs(x * (10 - x)) < 1e-9) | (np.abs(y * (10 - y)) < 1e-9)
    held = 3 * np.flatnonzero(edge & (z < 1e-9)) + 2
    return lowest_hz(*elastic_matrices(mesh, NAFEMS_STEEL), 10, held, shift=-1.0)


def test_nafems_fv52_thick_square_plate():
    found = fv52_hz((4, 4, 1))
    assert np.max(found[:3]) < 1e-3
    bricks = [44.762, 110.52, 110.52, 169.08, 193.93, 206.64, 206.64]
    np.testing.assert_allclose(found[3], bricks[0], rtol=1e-3)
    np.testing.assert_allclose(found[4:], bricks[1:], rtol=3e-4)
    mindlin = [45.897, 109.44, 109.44, 167.89, 193.59, 206.19, 206.19]
    np.testing.assert_allclose(found[3:], mindlin, rtol=2.5e-2)


def test_nafems_fv32_tapered_cantilever_membrane():
    # Half the thickness with its middle plane held: plane stress, free to thin where it stretches.
    points, hexahedra = box((16, 8, 1), (10.0, 1.0, 0.025), (0.0, -0.5, 0.0))
    points[:, 1] *= 5.0 - 4.0 * points[:, 0] / 10.0
    mesh = discretise(mesh_of(points, hexahedra), "hex20")
    root, middle = np.flatnonzero(mesh.positions[:, 0] < 1e-9), np.flatnonzero(mesh.positions[:, 2] < 1e-9)
    held = np.unique(np.concatenate([3 * root, 3 * root + 1, 3 * middle + 2]))
    found = lowest_hz(*elastic_matrices(mesh, NAFEMS_STEEL), 6, held)
    np.testing.assert_allclose(found, [44.623, 130.03, 162.70, 246.05, 379.90, 391.44], rtol=1e-4)


def annular_plate_hz(divisions, element):
    points, hexahedra = annulus(divisions, 0.1, 0.2, 0.001)
    mesh = discretise(mesh_of(points, hexahedra), element)
    bore = np.flatnonzero(np.hypot(points[:, 1], points[:, 2]) < 0.1 + 1e-9)
    free = np.setdiff1d(np.arange(mesh.n_nodes), mesh.nodes_on(bore))
    dofs = node_dofs(free).ravel()
    stiffness, mass = (matrix[dofs][:, dofs] for matrix in elastic_matrices(mesh, Material(200e9, 0.3, 7800.0)))
    return lowest_modes(mass, factorise(stiffness), 9).omega / (2 * np.pi)


def test_annular_plate_clamped_at_its_bore():
    kirchhoff = np.array([79.409, 81.028, 81.028, 89.649, 89.649, 113.173, 113.173, 156.058, 156.058])
    coarse, fine = (annular_plate_hz((n, 48, 1), "hex27") / kirchhoff - 1 for n in (4, 8))
    # A one-millimetre sheet is hard on solid elements: from above, and below 1.4 % in the end.
    assert np.all(coarse > fine)
    assert np.all((fine > 0.0) & (fine < 1.4e-2))
    np.testing.assert_allclose(fine[1::2], fine[2::2], atol=1e-5)

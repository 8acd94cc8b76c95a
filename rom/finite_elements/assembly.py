"""Stiffness and mass matrices of linear elasticity.

scikit-fem's own vector forms evaluate every pair of vector shape functions in Python. Here its scalar gradients go
through batched matrix products instead, one 3 x 3 block after another, for a bounded number of elements at a time:
the same integrals to round-off, some 30 times faster.

References
----------
K. J. Bathe, Finite Element Procedures, Prentice Hall (1996), chapters 5 and 6.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.finite_elements.discretisation import Discretisation
from rom.finite_elements.material import Materials, material_of
from rom.finite_elements.node_matrix import UPPER, node_pattern

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


def elastic_matrices(discretisation: Discretisation, materials: Materials) -> tuple[csr_matrix, csr_matrix]:
    """Stiffness and consistent mass (3n, 3n) of the free body, N/m and kg; dofs node-major x, y, z.

    The blocks of the node pair (a, b), with shape functions N_a and their gradients g_a, are

        K_ij = int lambda g_ai g_bj + mu g_aj g_bi + delta_ij mu g_a.g_b dV,    M_ij = delta_ij int rho N_a N_b dV.

    Raises RomParameterError when an element is turned inside out or its material is not given.
    """
    pattern = node_pattern([block.nodes for block in discretisation.blocks], discretisation.n_nodes)
    stiffness = np.zeros((len(UPPER), pattern.n_pairs))
    volume: dict[float, NDArray[np.float64]] = {}  # int N_a N_b dV of the elements of a density
    for batch in discretisation.batches():
        block = discretisation.blocks[batch.block]
        material = material_of(materials, block.material)
        lame, shear = material.lame
        slots = pattern.locate(batch.nodes)
        products = gradient_products(batch.gradients, batch.weights)
        trace = shear * (products[:, 0, :, 0] + products[:, 1, :, 1] + products[:, 2, :, 2])
        for row, (i, j) in enumerate(UPPER):
            component = lame * products[:, i, :, j] + shear * products[:, j, :, i]
            if i == j:
                component += trace
            np.add.at(stiffness[row], slots, component.ravel())
        found = volume.setdefault(material.density, np.zeros(pattern.n_pairs))
        np.add.at(found, slots, _value_products(block.table.values, batch.weights).ravel())
    mass = sum(density * found for density, found in volume.items())
    return pattern.symmetric_matrix(stiffness), pattern.isotropic_matrix(np.asarray(mass))


def stress_at_quadrature(
    discretisation: Discretisation, materials: Materials, displacement: NDArray[np.float64]
) -> tuple[NDArray[np.float64], ...]:
    """Cauchy stress (E, q, 3, 3) in Pa of small strains in each block, of displacements (3n,) or (n, 3) in m.

    The points are those of the quadrature.
    """
    nodal = np.asarray(displacement).reshape(-1, 3)
    found = tuple(np.empty((len(block), len(block.table.weights), 3, 3)) for block in discretisation.blocks)
    for batch in discretisation.batches():
        material = material_of(materials, discretisation.blocks[batch.block].material)
        gradient = batch.gradients @ nodal[batch.nodes][:, None]
        found[batch.block][batch.part] = material.stress(0.5 * (gradient + gradient.swapaxes(-1, -2)))
    return found


def gradient_products(gradients: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """int g_ai g_bj dV, (e, 3, b, 3, b) with the index order i, a, j, b."""
    elements, points, _, nodes = gradients.shape
    table = gradients.reshape(elements, points, 3 * nodes)
    products = table.swapaxes(1, 2) @ (weights[..., None] * table)
    return products.reshape(elements, 3, nodes, 3, nodes)


def _value_products(values: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """int N_a N_b dV, (e, b, b): one matrix product over the quadrature points for all elements."""
    points, nodes = values.shape
    pairs = (values[:, :, None] * values[:, None, :]).reshape(points, nodes * nodes)
    return weights @ pairs

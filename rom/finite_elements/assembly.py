"""Stiffness and mass of linear elasticity; forces and tangent stiffness at large displacements.

scikit-fem's own vector forms evaluate every pair of vector shape functions in Python. Here its scalar gradients go
through batched matrix products instead, one 3 x 3 block after another, for a bounded number of elements at a time:
the same integrals to round-off, some 30 times faster.

All matrices share one sparsity pattern over pairs of nodes, filled component by component.

Large displacements are in total Lagrangian form. With the displacement gradient H, F = I + H, the Green-Lagrange
strain E = (F^T F - I) / 2 and the second Piola-Kirchhoff stress S = C E, of an isotropic body lambda tr(E) I + 2 mu E
(St. Venant-Kirchhoff), all on the undeformed body,

    f_a = int F S g_a dV,
    K_ab = int lambda p_a p_b^T + mu p_b p_a^T + mu (g_a.g_b) F F^T + (g_a.S g_b) I dV,    p_a = F g_a,

for the nodes a, b with the gradients g_a of their shape functions; of an anisotropic body the first three terms are
int B_a^T C B_b dV with the strains B_a of a displacement of the node. These terms are the stiffness with the
initial-displacement (large-displacement) part, the last one is the geometric (initial-stress) stiffness.

References
----------
K. J. Bathe, Finite Element Procedures, Prentice Hall (1996), chapters 5 and 6.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.finite_elements.discretisation import Batch, Discretisation
from rom.finite_elements.elastic_law import ElasticLaw, strain_rows
from rom.finite_elements.material import Materials, law_of

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

# Components (i, j) on and above the diagonal of a 3 x 3 block; the others follow from symmetry.
UPPER = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
Array = NDArray[np.float64]
Stress = Sequence[Array]  # (E, q, 3, 3) of each block
# Gradients at the quadrature points, in doubles, up to which they are kept from one evaluation to the next (64 MB).
_KEPT_DOUBLES = 8_000_000


@dataclass(frozen=True)
class NodePattern:
    """CSR pattern of the p node pairs that share an element, each row sorted."""

    # `indptr`, `indices`: (n + 1,), the CSR pattern
    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    keys: NDArray[np.int64]  # (p,), row * n + column of each pair, ascending: a pair is found by bisection

    @property
    def n_pairs(self) -> int:
        """Number of stored node pairs."""
        return len(self.indices)

    def locate(self, element_nodes: NDArray[np.int64]) -> NDArray[np.int64]:
        """Slots (e b b,) of the pairs (row node, column node) of elements given as (e, b) nodes."""
        n = len(self.indptr) - 1
        return np.searchsorted(self.keys, (element_nodes[:, :, None] * n + element_nodes[:, None, :]).ravel())

    def transposed_slots(self) -> NDArray[np.int64]:
        """Slot of pair (b, a) for every pair (a, b), shape (p,)."""
        from scipy.sparse import csr_matrix

        n = len(self.indptr) - 1
        slots = csr_matrix((np.arange(self.n_pairs), self.indices, self.indptr), shape=(n, n))
        return slots.tocsc().data  # column by column, rows ascending: the pairs of the transposed pattern in order

    def symmetric_matrix(self, upper: NDArray[np.float64]) -> csr_matrix:
        """CSR matrix (3n, 3n) from the components `UPPER` (6, p) of the block of every pair."""
        swap = self.transposed_slots()
        blocks = np.empty((self.n_pairs, 3, 3))
        for row, (i, j) in enumerate(UPPER):
            if i == j:
                # The round-off of batched products is not symmetric, but factorisation and modes rely on symmetry.
                blocks[:, i, i] = 0.5 * (upper[row] + upper[row][swap])
            else:
                blocks[:, i, j] = upper[row]
                blocks[:, j, i] = upper[row][swap]
        return self.block_matrix(blocks)

    def block_matrix(self, blocks: NDArray[np.float64]) -> csr_matrix:
        """CSR matrix (3n, 3n) from one 3 x 3 block for each pair, (p, 3, 3); dofs are node-major x, y, z."""
        from scipy.sparse import bsr_matrix

        n = 3 * (len(self.indptr) - 1)
        return bsr_matrix((blocks, self.indices, self.indptr), shape=(n, n)).tocsr()

    def isotropic_matrix(self, values: NDArray[np.float64]) -> csr_matrix:
        """CSR matrix (3n, 3n) with values (p,) times the 3 x 3 identity as blocks, off-diagonal zeros not stored."""
        from scipy.sparse import csr_matrix, identity, kron

        n = len(self.indptr) - 1
        return kron(csr_matrix((values, self.indices, self.indptr), shape=(n, n)), identity(3), format="csr")


def node_pattern(tables: Sequence[NDArray[np.int64]], n_nodes: int) -> NodePattern:
    """Pattern of all node pairs of elements, given as tables (E, b) of nodes; symmetric, each row sorted."""
    from scipy.sparse import csr_matrix

    nodes = np.concatenate([table.ravel() for table in tables])
    starts = np.concatenate([[0], *(np.full(len(table), table.shape[1]) for table in tables)]).cumsum()
    incidence = csr_matrix((np.ones(len(nodes), dtype=np.int32), nodes, starts), shape=(len(starts) - 1, n_nodes))
    pairs = (incidence.T @ incidence).tocsr()
    pairs.sort_indices()
    keys = np.repeat(np.arange(n_nodes), np.diff(pairs.indptr)) * n_nodes + pairs.indices
    # 32-bit indices make every product with the matrices, which is bound by memory, a quarter faster.
    return NodePattern(pairs.indptr.astype(np.int32), pairs.indices.astype(np.int32), keys)


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
        law = law_of(materials, block, batch.part)
        slots = pattern.locate(batch.nodes)
        if law.stiffness is None:
            lame, shear, of_lame, of_shear = _isotropic_products(law, batch.gradients, batch.weights)
            trace = shear * (of_shear[:, 0, :, 0] + of_shear[:, 1, :, 1] + of_shear[:, 2, :, 2])
        else:
            blocks = _stiffness_products(law.stiffness, batch.gradients, batch.weights)
        for row, (i, j) in enumerate(UPPER):
            if law.stiffness is None:
                component = lame * of_lame[:, i, :, j] + shear * of_shear[:, j, :, i]
                if i == j:
                    component += trace
            else:
                component = blocks[:, i, :, j]
            np.add.at(stiffness[row], slots, component.ravel())
        uniform = np.ndim(law.density) == 0
        found = volume.setdefault(float(law.density) if uniform else 1.0, np.zeros(pattern.n_pairs))
        weights = batch.weights if uniform else law.density * batch.weights
        np.add.at(found, slots, _value_products(block.table.values, weights).ravel())
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
        law = law_of(materials, discretisation.blocks[batch.block], batch.part)
        gradient = batch.gradients @ nodal[batch.nodes][:, None]
        found[batch.block][batch.part] = law.stress(0.5 * (gradient + gradient.swapaxes(-1, -2)))
    return found


def gradient_products(gradients: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """int g_ai g_bj dV, (e, 3, b, 3, b) with the index order i, a, j, b."""
    elements, points, _, nodes = gradients.shape
    table = gradients.reshape(elements, points, 3 * nodes)
    products = table.swapaxes(1, 2) @ (weights[..., None] * table)
    return products.reshape(elements, 3, nodes, 3, nodes)


def _isotropic_products(law: ElasticLaw, gradients: Array, weights: Array) -> tuple[float, float, Array, Array]:
    """Factors of Lame's two terms and their `gradient_products`, which hold constants that differ between points."""
    if np.ndim(law.lame) == 0:
        products = gradient_products(gradients, weights)
        return float(law.lame), float(law.shear), products, products
    of_lame, of_shear = (gradient_products(gradients, constant * weights) for constant in (law.lame, law.shear))
    return 1.0, 1.0, of_lame, of_shear


def _stiffness_products(
    stiffness: Array, gradients: Array, weights: Array, deformation: Array | None = None
) -> Array:
    """int B^T C B dV (e, 3, b, 3, b) with the index order i, a, j, b."""
    rows = strain_rows(gradients, deformation)
    elements, _, _, size = rows.shape
    products = _contracted(rows, weights[..., None, None] * (stiffness @ rows))
    return products.reshape(elements, 3, size // 3, 3, size // 3)


def _value_products(values: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """int N_a N_b dV, (e, b, b): one matrix product over the quadrature points for all elements."""
    points, nodes = values.shape
    pairs = (values[:, :, None] * values[:, None, :]).reshape(points, nodes * nodes)
    return weights @ pairs


@dataclass(frozen=True)
class ElasticBody:
    """A body of n nodes; its displacements (3n,) are node-major x, y, z, in m."""

    discretisation: Discretisation  # nodes and shape functions
    materials: Materials  # the material, or the materials by the names in the mesh
    pattern: NodePattern  # pattern of its matrices

    @classmethod
    def of(cls, discretisation: Discretisation, materials: Materials) -> ElasticBody:
        """The body of a discretisation, with its pattern."""
        pattern = node_pattern([block.nodes for block in discretisation.blocks], discretisation.n_nodes)
        return cls(discretisation, materials, pattern)

    def _batches(self) -> Iterator[Batch]:
        """The batches of the discretisation; on a small mesh they are computed once."""
        small = self.discretisation.n_gradients <= _KEPT_DOUBLES
        return iter(self._kept if small else self._new_batches())

    def _new_batches(self) -> Iterator[Batch]:
        """The batches, each array in one piece, for the reshapes that follow."""
        for batch in self.discretisation.batches():
            yield batch._replace(
                gradients=np.ascontiguousarray(batch.gradients), weights=np.ascontiguousarray(batch.weights)
            )

    def _law(self, batch: Batch) -> ElasticLaw:
        return law_of(self.materials, self.discretisation.blocks[batch.block], batch.part)

    @cached_property
    def _kept(self) -> tuple[Batch, ...]:
        return tuple(self._new_batches())

    def internal_force(self, displacement: Array) -> tuple[Array, float]:
        """Internal forces (3n,), N, and the largest Frobenius norm of the Green-Lagrange strain.

        Shapes: `displacement` (3n,).
        """
        nodal = displacement.reshape(-1, 3)
        force = np.zeros((self.discretisation.n_nodes, 3))
        largest = 0.0
        for batch in self._batches():
            deformation = _deformation_gradient(batch.gradients, nodal[batch.nodes])
            strain = _green_lagrange(deformation)
            largest = max(largest, float(np.sqrt(np.max(np.sum(strain**2, axis=(-2, -1))))))
            flux = (deformation @ self._law(batch).stress(strain)) * batch.weights[..., None, None]
            np.add.at(force, batch.nodes, np.einsum("eqik,eqka->eai", flux, batch.gradients, optimize=True))
        return force.ravel(), largest

    def tangent(self, displacement: Array, stress: Stress | None = None) -> csr_matrix:
        """Tangent stiffness (3n, 3n), N/m: the derivative of the internal forces; `tangent_blocks` as a matrix."""
        return self.pattern.symmetric_matrix(self.tangent_blocks(displacement, stress))

    def tangent_blocks(self, displacement: Array, stress: Stress | None = None) -> Array:
        """Components `UPPER` (6, p) of the tangent stiffness for every pair of nodes, N/m.

        Shapes: `displacement` (3n,), `stress` (E, q, 3, 3).
        """
        nodal = displacement.reshape(-1, 3)
        upper = np.zeros((len(UPPER), self.pattern.n_pairs))
        for batch in self._batches():
            gradients, weights, law = batch.gradients, batch.weights, self._law(batch)
            slots = self.pattern.locate(batch.nodes)
            deformation = _deformation_gradient(gradients, nodal[batch.nodes])
            known = None if stress is None else stress[batch.block][batch.part]
            inner = law.stress(_green_lagrange(deformation)) if known is None else known
            if law.stiffness is None:
                lame, shear, of_lame, of_shear = _isotropic_products(law, deformation @ gradients, weights)
                left = (deformation @ deformation.swapaxes(-1, -2)) * np.asarray(law.shear)[..., None, None]
            else:
                blocks = _stiffness_products(law.stiffness, gradients, weights, deformation)
            for row, (i, j) in enumerate(UPPER):
                if law.stiffness is None:
                    block = lame * of_lame[:, i, :, j] + shear * of_shear[:, j, :, i]
                    flux = left[..., i, j, None, None] * gradients
                else:
                    block, flux = blocks[:, i, :, j].copy(), np.zeros_like(gradients)
                if i == j:
                    flux += inner @ gradients
                block += _contracted(gradients, weights[..., None, None] * flux)
                np.add.at(upper[row], slots, block.ravel())
        return upper


def _deformation_gradient(gradients: Array, nodal: Array) -> Array:
    """F (e, q, 3, 3) of nodal displacements (e, b, 3)."""
    return np.eye(3) + (gradients @ nodal[:, None]).swapaxes(-1, -2)


def _green_lagrange(deformation: Array) -> Array:
    return 0.5 * (deformation.swapaxes(-1, -2) @ deformation - np.eye(3))


def _contracted(left: Array, right: Array) -> Array:
    """Sum over quadrature points and directions of left (e, q, 3, a) and right (e, q, 3, b): (e, a, b)."""
    elements, points, directions, nodes = left.shape
    flat = (elements, points * directions, nodes)
    return left.reshape(flat).swapaxes(1, 2) @ right.reshape(flat)

"""Internal forces and tangent stiffness of an elastic body at large displacements, total Lagrangian form.

With the displacement gradient H, F = I + H, the Green-Lagrange strain E = (F^T F - I) / 2 and the second
Piola-Kirchhoff stress S = lambda tr(E) I + 2 mu E (St. Venant-Kirchhoff), all on the undeformed body,

    f_a = int F S g_a dV,
    K_ab = int lambda p_a p_b^T + mu p_b p_a^T + mu (g_a.g_b) F F^T + (g_a.S g_b) I dV,    p_a = F g_a,

for the nodes a, b with the gradients g_a of their shape functions. The first three terms are the stiffness with the
initial-displacement (large-displacement) part, the last one is the geometric (initial-stress) stiffness.

References
----------
K. J. Bathe, Finite Element Procedures, Prentice Hall (1996), section 6.2.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.finite_elements.assembly import gradient_products
from rom.finite_elements.discretisation import Batch, Discretisation
from rom.finite_elements.material import Material, Materials, material_of
from rom.finite_elements.node_matrix import UPPER, NodePattern, node_pattern

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

Array = NDArray[np.float64]
Stress = Sequence[Array]  # (E, q, 3, 3) of each block
# Gradients at the quadrature points, in doubles, up to which they are kept from one evaluation to the next (64 MB).
_KEPT_DOUBLES = 8_000_000


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

    def _material(self, batch: Batch) -> Material:
        return material_of(self.materials, self.discretisation.blocks[batch.block].material)

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
            flux = (deformation @ self._material(batch).stress(strain)) * batch.weights[..., None, None]
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
            gradients, weights, material = batch.gradients, batch.weights, self._material(batch)
            lame, shear = material.lame
            slots = self.pattern.locate(batch.nodes)
            deformation = _deformation_gradient(gradients, nodal[batch.nodes])
            known = None if stress is None else stress[batch.block][batch.part]
            inner = material.stress(_green_lagrange(deformation)) if known is None else known
            left = shear * (deformation @ deformation.swapaxes(-1, -2))
            products = gradient_products(deformation @ gradients, weights)
            for row, (i, j) in enumerate(UPPER):
                block = lame * products[:, i, :, j] + shear * products[:, j, :, i]
                flux = left[..., i, j, None, None] * gradients
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

"""Stress at the nodes of a mesh from displacements: extrapolated in each element, averaged within one material.

Symmetric stress tensors have the six components xx, yy, zz, xy, yz, zx, the order of VTK.

With the displacement gradient H, F = I + H and the second Piola-Kirchhoff stress S of the Green-Lagrange strain (St.
Venant-Kirchhoff) the Cauchy stress is F S F^T / det F. Its derivative in the direction of dF is, with L = dF F^-1 and
dS = C : sym(F^T dF),

    d sigma = L sigma + sigma L^T - tr(L) sigma + F dS F^T / det F.

In each element the stress at the quadrature points is projected (least squares with the quadrature weights) on the
linear shape functions of the corners; a mid-side node gets the mean of the corners between which it lies. On a line
that projection of a quadratic takes its values at the two Gauss points, where the strains of quadratic elements are
one order more accurate than elsewhere (Barlow): values at the nodes themselves are the worst of an element.

References
----------
K. J. Bathe, Finite Element Procedures, Prentice Hall (1996), section 6.2.
J. Barlow, Optimal stress locations in finite element models, Int. J. Numer. Methods Eng. 10 (1976) 243.
E. Hinton, J. S. Campbell, Local and global smoothing of discontinuous finite element functions using a least squares
method, Int. J. Numer. Methods Eng. 8 (1974) 461.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from geometry.elements import ELEMENT_KINDS
from rom.finite_elements.discretisation import Batch, DiscreteBlock, Discretisation
from rom.finite_elements.elastic_law import ElasticLaw
from rom.finite_elements.loads import at_quadrature
from rom.finite_elements.material import Materials, law_of
from rom.finite_elements.reference_element import shape_functions, volume_rule, vtk_shape_functions

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

Array = NDArray[np.float64]
_LINEAR = {4: "tet4", 6: "wedge6", 8: "hex8"}  # by the number of corners
ROWS, COLUMNS = (0, 1, 2, 0, 1, 2), (0, 1, 2, 1, 2, 0)


def cauchy_stress(law: ElasticLaw, gradient: Array) -> Array:
    """Cauchy stress (..., 3, 3), Pa, of a displacement gradient (..., 3, 3), H_ij = du_i / dX_j, of any size."""
    deformation = np.eye(3) + gradient
    strain = 0.5 * (_transposed(deformation) @ deformation - np.eye(3))
    return pushed_forward(law.stress(strain), gradient)


def pushed_forward(stress: NDArray[Any], gradient: Array) -> NDArray[Any]:
    """Cauchy stress F S F^T / det F of a second Piola-Kirchhoff stress S (..., 3, 3)."""
    deformation = np.eye(3) + gradient
    return deformation @ stress @ _transposed(deformation) / np.linalg.det(deformation)[..., None, None]


def cauchy_increment(law: ElasticLaw, gradient: Array, increment: NDArray[Any]) -> NDArray[Any]:
    """Increment (k, ..., 3, 3) of the Cauchy stress for small further gradients (k, ..., 3, 3), real or complex."""
    deformation = np.eye(3) + gradient
    stress = cauchy_stress(law, gradient)
    velocity = increment @ np.linalg.inv(deformation)
    mixed = _transposed(deformation) @ increment
    inner = law.stress(0.5 * (mixed + _transposed(mixed)))
    turned = velocity @ stress
    trace = np.trace(velocity, axis1=-2, axis2=-1)[..., None, None]
    return turned + _transposed(turned) - trace * stress + pushed_forward(inner, gradient)


def _transposed(tensor: NDArray[Any]) -> NDArray[Any]:
    return tensor.swapaxes(-1, -2)


@dataclass(frozen=True)
class StressBlock:
    """E elements of b nodes, all of one kind and material."""

    nodes: NDArray[np.int64]  # (E, b), nodes of each element
    extrapolation: Array  # (b, q), from values at the quadrature points to values at the nodes
    material: str  # name of the material


def stress_blocks(discretisation: Discretisation) -> tuple[StressBlock, ...]:
    """The elements of a discretisation, for the recovery of stresses; as many as it has blocks."""
    return tuple(
        StressBlock(block.nodes, _extrapolation_in(block), block.material) for block in discretisation.blocks
    )


def _extrapolation_in(block: DiscreteBlock) -> Array:
    """From the quadrature points to the nodes of the elements of a block."""
    reference = block.reference
    points, weights = volume_rule(reference.element)
    if reference.promoted:
        (values, _), (shares, _) = shape_functions("hex8", points), shape_functions("hex8", reference.nodes.T)
    else:
        corners = _LINEAR[ELEMENT_KINDS[reference.kind].corners]
        (values, _), (shares, _) = (
            vtk_shape_functions(corners, points),
            vtk_shape_functions(corners, reference.nodes.T),
        )
    return extrapolation(values, weights, shares)


def extrapolation(corner_values: Array, weights: Array, shares: Array) -> Array:
    """Least squares projection on the corner functions, then their values at the nodes.

    Shapes: `corner_values` (q, c), `weights` (q,), `shares` (b, c), returns (b, q).
    """
    root = np.sqrt(weights)
    return np.asarray(shares @ (np.linalg.pinv(root[:, None] * corner_values) * root))


def components(tensor: NDArray[Any]) -> NDArray[Any]:
    """Six components (..., 6) of symmetric tensors (..., 3, 3)."""
    return tensor[..., ROWS, COLUMNS]


def von_mises(stress: NDArray[Any]) -> NDArray[np.float64]:
    """Von Mises stress of tensors, sqrt(3/2 s:s) with the deviator s.

    `stress` (..., 6): components xx, yy, zz, xy, yz, zx. Of complex amplitudes the Hermitian norm sqrt(3/2 s:s*) is
    taken, which is at least the amplitude of the cycle and equal to it where the components are in phase. Returns
    (...): von Mises stress, in the unit of the components.
    """
    return np.linalg.norm(deviator(stress), axis=-1)


def deviator(stress: NDArray[Any]) -> NDArray[Any]:
    """Coordinates (..., 5) of the deviators of tensors (..., 6) whose Euclidean norm is the von Mises stress."""
    xx, yy, zz = stress[..., 0], stress[..., 1], stress[..., 2]
    shear = np.sqrt(3.0) * stress[..., 3:]
    normal = np.stack([xx - 0.5 * (yy + zz), np.sqrt(0.75) * (yy - zz)], axis=-1)
    return np.concatenate([normal, shear], axis=-1)


@dataclass(frozen=True)
class NodalStress:
    """Stress at s places: a node, or one for each material that meets at a node."""

    values: NDArray[Any]  # (..., s, 6) components xx, yy, zz, xy, yz, zx, Pa; complex for a harmonic
    # (..., s) root mean square, over the elements at a place, of the von Mises stress of their deviations from the
    # average, Pa: an estimate of the error of the mesh. At a place of a single element it is that of its other nodes
    spread: Array


@dataclass(frozen=True)
class StressRecovery:
    """Recovers nodal stresses of one mesh."""

    discretisation: Discretisation  # the mesh
    blocks: Sequence[StressBlock]  # its elements
    materials: Materials  # the material, or the materials by name
    # (s,), node and number of the material of each place; the materials are numbered in the order of `names`
    node: NDArray[np.int64]
    # (s,), node and number of the material of each place; the materials are numbered in the order of `names`
    material: NDArray[np.int64]
    names: tuple[str, ...]  # names of the materials
    base: Array | None = None  # (n, 3), displacement about which increments are linearised, m; None: small strains
    temperature: Array | None = None  # (V,), of the points of the mesh above the stress-free state, K
    _places: tuple[NDArray[np.int64], ...] = field(default=(), repr=False)

    @classmethod
    def of(
        cls,
        discretisation: Discretisation,
        materials: Materials,
        base: Array | None = None,
        temperature: Array | None = None,
    ) -> StressRecovery:
        """The recovery on a discretisation.

        `base` (3n,) or (n, 3): static displacement with large strains, m; `temperature` (V,): of the points of the
        mesh above the stress-free state, K.
        """
        blocks = stress_blocks(discretisation)
        names = tuple(dict.fromkeys(block.material for block in blocks))
        n = discretisation.n_nodes
        keys = [names.index(block.material) * n + block.nodes for block in blocks]
        used, place = np.unique(np.concatenate([key.ravel() for key in keys]), return_inverse=True)
        ends = np.cumsum([0, *(key.size for key in keys)])
        places = tuple(
            place[start:end].reshape(key.shape).astype(np.int64)
            for key, start, end in zip(keys, ends[:-1], ends[1:], strict=True)
        )
        at = None if base is None else np.asarray(base).reshape(-1, 3)
        return cls(discretisation, blocks, materials, used % n, used // n, names, at, temperature, places)

    @property
    def places(self) -> tuple[NDArray[np.int64], ...]:
        """Place of each node of each element, (E, b) for each block."""
        return self._places

    def static(self, displacement: NDArray[Any]) -> NodalStress:
        """Stress of a static displacement (N,) or (n, 3), m.

        About a base it is the Cauchy stress there, and linear in the rest.
        """
        nodal = np.real(np.asarray(displacement)).reshape(-1, 3)
        change = nodal if self.base is None else nodal - self.base
        return self._averaged(
            (places, block, self._static_stress(batch, change)) for places, block, batch in self._batches()
        )

    def increments(self, displacement: NDArray[Any]) -> list[NodalStress]:
        """Stress of small displacements (k, N) or (k, n, 3), real or complex, about the base: one for each."""
        nodal = np.asarray(displacement)
        return [
            self._averaged((places, block, self._increment(batch, each)) for places, block, batch in self._batches())
            for each in nodal.reshape(len(nodal), -1, 3)
        ]

    def _static_stress(self, batch: Batch, change: Array) -> NDArray[Any]:
        """Stress (e, q, 3, 3) of the base and a further displacement (n, 3), less that of the free expansion."""
        stress, heat = self._increment(batch, change), None
        if self.temperature is not None:
            rise = at_quadrature(self.discretisation.blocks[batch.block], batch.part, self.temperature)
            heat = self._law(batch).restrained_stress(rise)
        if self.base is not None:
            gradient = _gradient(batch.gradients, self.base[batch.nodes])
            stress = stress + cauchy_stress(self._law(batch), gradient)
            heat = None if heat is None else pushed_forward(heat, gradient)
        return stress if heat is None else stress - heat

    def _increment(self, batch: Batch, nodal: NDArray[Any]) -> NDArray[Any]:
        """Stress (e, q, 3, 3) of a displacement (n, 3)."""
        change = _gradient(batch.gradients, nodal[batch.nodes])
        if self.base is None:
            return self._law(batch).stress(0.5 * (change + change.swapaxes(-1, -2)))
        return cauchy_increment(self._law(batch), _gradient(batch.gradients, self.base[batch.nodes]), change)

    def _law(self, batch: Batch) -> ElasticLaw:
        return law_of(self.materials, self.discretisation.blocks[batch.block], batch.part)

    def _batches(self) -> Iterator[tuple[NDArray[np.int64], StressBlock, Batch]]:
        """Places (e, b) of the nodes, block and elements of bounded batches."""
        for batch in self.discretisation.batches():
            yield self._places[batch.block][batch.part], self.blocks[batch.block], batch

    def _averaged(self, parts: Iterator[tuple[NDArray[np.int64], StressBlock, NDArray[Any]]]) -> NodalStress:
        """Averages over the elements at each place of stresses (e, q, 3, 3) at the quadrature points."""
        size = len(self.node)
        total: NDArray[Any] = np.zeros((size, 6))
        square, count = np.zeros(size), np.zeros(size)
        for places, block, stress in parts:
            values = (block.extrapolation @ components(stress)).reshape(-1, 6)
            gather = _gathering(places, size)
            total = total + gather @ values
            square += gather @ np.sum(np.abs(deviator(values)) ** 2, axis=-1)
            count += np.bincount(places.ravel(), minlength=size)
        mean = total / count[:, None]
        deviation = square / count - np.sum(np.abs(deviator(mean)) ** 2, axis=-1)
        return NodalStress(mean, self._filled(np.sqrt(np.maximum(deviation, 0.0)), count))

    def _filled(self, spread: Array, count: Array) -> Array:
        """The spread (s,), at the place of a single element that of the other places of this element, the largest."""
        found = spread.copy()
        for places in self._places:
            largest = spread[places].max(axis=1)
            alone = count[places] == 1
            found[places[alone]] = np.broadcast_to(largest[:, None], places.shape)[alone]
        return found


def _gathering(places: NDArray[np.int64], size: int) -> csr_matrix:
    """Sums (s, e b) over the nodes of elements that stand at a place."""
    from scipy.sparse import csr_matrix

    flat = places.ravel()
    return csr_matrix((np.ones(len(flat)), (flat, np.arange(len(flat)))), shape=(size, len(flat)))


def _gradient(gradients: Array, nodal: NDArray[Any]) -> NDArray[Any]:
    """H (e, q, 3, 3), H_ij = du_i / dX_j, of nodal displacements (e, b, 3)."""
    return (gradients @ nodal[:, None]).swapaxes(-1, -2)

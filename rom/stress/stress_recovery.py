"""Stress at the nodes of a mesh from displacements: extrapolated in each element, averaged within one material."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rom.finite_elements.discretisation import Batch, Discretisation
from rom.finite_elements.material import Material, Materials, material_of
from rom.finite_elements.thermal_load import thermal_stress
from rom.stress.cauchy_stress import cauchy_increment, cauchy_stress
from rom.stress.stress_blocks import StressBlock, stress_blocks
from rom.stress.stress_tensor import components, deviator

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

Array = NDArray[np.float64]


@dataclass(frozen=True)
class NodalStress:
    """Stress at s places: a node, or one for each material that meets at a node.

    Attributes
    ----------
    values : (..., s, 6) array
        Components xx, yy, zz, xy, yz, zx, Pa; complex for a harmonic.
    spread : (..., s) array
        Root mean square, over the elements at a place, of the von Mises stress of their deviations from the average,
        Pa: an estimate of the error of the mesh. At a place of a single element it is that of its other nodes.

    Examples
    --------
    >>> from rom import NodalStress
    >>> NodalStress(np.zeros((4, 6)), np.zeros(4)).values.shape
    (4, 6)
    """

    values: NDArray[Any]
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
    # (E, q), pressure of the heated elements if they could not expand, E alpha T / (1 - 2 nu), Pa, block by block
    thermal: tuple[Array, ...] | None = None
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
        heated = None if temperature is None else thermal_stress(discretisation, materials, temperature)
        return cls(discretisation, blocks, materials, used % n, used // n, names, at, heated, places)

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
        found = self._increment(batch, change)
        if self.base is not None:
            gradient = _gradient(batch.gradients, self.base[batch.nodes])
            found = found + cauchy_stress(self._law(batch), gradient)
        if self.thermal is not None:
            found = found - self.thermal[batch.block][batch.part][..., None, None] * np.eye(3)
        return found

    def _increment(self, batch: Batch, nodal: NDArray[Any]) -> NDArray[Any]:
        """Stress (e, q, 3, 3) of a displacement (n, 3)."""
        change = _gradient(batch.gradients, nodal[batch.nodes])
        if self.base is None:
            return self._law(batch).stress(0.5 * (change + change.swapaxes(-1, -2)))
        return cauchy_increment(self._law(batch), _gradient(batch.gradients, self.base[batch.nodes]), change)

    def _law(self, batch: Batch) -> Material:
        return material_of(self.materials, self.blocks[batch.block].material)

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

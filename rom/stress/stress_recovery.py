"""Stress at the nodes of a mesh from displacements: extrapolated in each element, averaged within one material."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rom.finite_elements.discretisation import Discretisation
from rom.finite_elements.material import Material, Materials, material_of
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
        Pa: an estimate of the error of the mesh.

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
    """Recovers nodal stresses of one mesh.

    Attributes
    ----------
    discretisation : Discretisation
        The mesh.
    blocks : sequence of StressBlock
        Its elements.
    materials : Material or mapping of str to Material
        The material, or the materials by name.
    node, material : (s,) array
        Node and number of the material of each place; the materials are numbered in the order of `names`.
    names : tuple of str
        Names of the materials.
    base : (n, 3) array or None
        Displacement about which increments are linearised, m; None: small strains.
    """

    discretisation: Discretisation
    blocks: Sequence[StressBlock]
    materials: Materials
    node: NDArray[np.int64]
    material: NDArray[np.int64]
    names: tuple[str, ...]
    base: Array | None = None
    _places: tuple[NDArray[np.int64], ...] = field(default=(), repr=False)

    @classmethod
    def of(
        cls,
        discretisation: Discretisation,
        materials: Materials,
        base: Array | None = None,
    ) -> StressRecovery:
        """The recovery on a discretisation; `base` (3n,) or (n, 3): static displacement with large strains, m."""
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
        return cls(discretisation, blocks, materials, used % n, used // n, names, at, places)

    @property
    def places(self) -> tuple[NDArray[np.int64], ...]:
        """Place of each node of each element, (E, b) for each block."""
        return self._places

    def base_stress(self) -> NodalStress:
        """Cauchy stress of the base displacement; without one, zero."""
        count = len(self.node)
        if self.base is None:
            return NodalStress(np.zeros((count, 6)), np.zeros(count))
        base = self.base
        return self._averaged(
            (place, block, cauchy_stress(self._law(block), _gradient(gradients, base[nodes]))[None])
            for place, block, nodes, gradients in self._batches()
        )[0]

    def increments(self, displacement: NDArray[Any]) -> list[NodalStress]:
        """Stress of small displacements (k, N) or (k, n, 3), real or complex, about the base: one for each."""
        nodal = np.asarray(displacement)
        nodal = nodal.reshape(len(nodal), -1, 3)
        return [
            self._averaged(
                (place, block, self._increment(block, gradients, nodes, each)[None])
                for place, block, nodes, gradients in self._batches()
            )[0]
            for each in nodal
        ]

    def _increment(
        self, block: StressBlock, gradients: Array, nodes: NDArray[np.int64], nodal: NDArray[Any]
    ) -> NDArray[Any]:
        """Stress (e, q, 3, 3) of a displacement (n, 3)."""
        change = _gradient(gradients, nodal[nodes])
        if self.base is None:
            return self._law(block).stress(0.5 * (change + change.swapaxes(-1, -2)))
        return cauchy_increment(self._law(block), _gradient(gradients, self.base[nodes]), change)

    def _law(self, block: StressBlock) -> Material:
        return material_of(self.materials, block.material)

    def _batches(self) -> Iterator[tuple[NDArray[np.int64], StressBlock, NDArray[np.int64], Array]]:
        """Places (e, b), block, nodes (e, b) and gradients (e, q, 3, b) of bounded batches."""
        for batch in self.discretisation.batches():
            yield self._places[batch.block][batch.part], self.blocks[batch.block], batch.nodes, batch.gradients

    def _averaged(self, parts: Iterator[tuple[NDArray[np.int64], StressBlock, NDArray[Any]]]) -> list[NodalStress]:
        """Averages over the elements at each place of stresses (k, e, q, 3, 3) at the quadrature points."""
        total: NDArray[Any] | None = None
        square: Array | None = None
        count = np.zeros(len(self.node))
        for places, block, stress in parts:
            k = len(stress)
            values = np.moveaxis(block.extrapolation @ components(stress), 0, 2)  # (e, b, k, 6)
            gather = self._gathering(places)
            flat = values.reshape(places.size, k * 6)
            sizes = np.sum(np.abs(deviator(values)) ** 2, axis=-1).reshape(places.size, k)
            total = gather @ flat if total is None else total + gather @ flat
            square = gather @ sizes if square is None else square + gather @ sizes
            count += np.asarray(gather.sum(axis=1)).ravel()
        assert total is not None
        assert square is not None
        mean = (total / count[:, None]).reshape(len(count), -1, 6)
        deviation = square / count[:, None] - np.sum(np.abs(deviator(mean)) ** 2, axis=-1)
        spread = np.sqrt(np.maximum(deviation, 0.0))
        return [NodalStress(mean[:, i], spread[:, i]) for i in range(mean.shape[1])]

    def _gathering(self, places: NDArray[np.int64]) -> csr_matrix:
        """Sums (s, e b) over the nodes of elements that stand at a place."""
        from scipy.sparse import csr_matrix

        flat = places.ravel()
        return csr_matrix((np.ones(len(flat)), (flat, np.arange(len(flat)))), shape=(len(self.node), len(flat)))


def _gradient(gradients: Array, nodal: NDArray[Any]) -> NDArray[Any]:
    """H (e, q, 3, 3), H_ij = du_i / dX_j, of nodal displacements (e, b, 3)."""
    return (gradients @ nodal[:, None]).swapaxes(-1, -2)

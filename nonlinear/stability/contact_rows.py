"""Where the coefficients of contact motions and forces stand in an eigenvalue problem: by dofs, or by few motions."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.parameters import Array
from nonlinear.stability.block_matrices import Matrix, MotionBlocks, NodeBlocks
from nonlinear.stability.slider_memory import SliderMemory


@dataclass(frozen=True)
class ContactRows:
    """Rows of the contact dofs in the eigenvalue problem: (S, nodes, 3), S Fourier coefficients."""

    node: NDArray[np.int64]  # (M,), node of each slider, or of each stick interval, among the nodes that touch
    n_nodes: int  # number of nodes that touch
    # (S, S), real Fourier coefficients from harmonic amplitudes; None where the rows are real coefficients themselves
    to_real: Matrix | None
    first_row: int  # 1 where harmonic 0 is left out, else 0
    size: int  # number of Fourier coefficients, with that of harmonic 0

    def positions(self, memory: SliderMemory) -> Matrix:
        """Q^T (M, n): the slider positions dw(theta_s) = Q^T d = du + r dd_n."""
        basis: Matrix = memory.basis
        if self.to_real is not None:
            basis = basis @ self.to_real
        return self._spread(basis, memory.direction) + self._spread(basis * memory.dw_dn[:, None], 2)

    def at_sliders(self, memory: SliderMemory, columns: Matrix) -> Matrix:
        """The rows of each slider's own dof among all (n, k): (M, S, k)."""
        result: Matrix = columns[self._places(memory)]
        return result

    def forces(self, memory: SliderMemory, force: Matrix) -> Matrix:
        """Coefficients (M, S) of forces at the sliders, in all rows: (n,)."""
        result = np.zeros(3 * self.n_nodes * force.shape[1], dtype=force.dtype)
        np.add.at(result, self._places(memory), force)
        return result

    def contact(self, values: Matrix) -> NodeBlocks:
        """Jacobians (M, 2, 3, 2H+1, 2H+1) of the friction of the nodes of a friction cone."""
        if self.to_real is not None:
            values = np.linalg.inv(self.to_real) @ values @ self.to_real
        size = self.size - self.first_row
        result = np.zeros((self.n_nodes, size, 3, size, 3), dtype=values.dtype)
        result[self.node, :, :2] = values.transpose(0, 3, 1, 4, 2)[:, self.first_row :, :, self.first_row :]
        return NodeBlocks(result)

    def _spread(self, values: Matrix, direction: NDArray[np.int64] | int) -> Matrix:
        """`values` (M, S) in the rows of each node and `direction`: (M, n)."""
        count = self.node.size
        result = np.zeros((count, values.shape[1], self.n_nodes, 3), dtype=values.dtype)
        result[np.arange(count), :, self.node, direction] = values
        return result[:, self.first_row :].reshape(count, -1)

    def _places(self, memory: SliderMemory) -> NDArray[np.int64]:
        """Rows of each slider's own dof, (M, S)."""
        first = 3 * self.node + memory.direction
        return np.asarray(first[:, None] + 3 * self.n_nodes * np.arange(self.size - self.first_row))


@dataclass(frozen=True)
class MotionRows:
    """Rows (S, r) of few contact motions, d = D v, in S real Fourier coefficients."""

    node: NDArray[np.int64]  # (M,), node of each slider, or of each stick interval, among the nodes that touch
    motions: Array  # (n, r), D
    first_row: int  # 1 where harmonic 0 is left out, else 0
    to_real: ClassVar[None] = None

    def positions(self, memory: SliderMemory) -> Matrix:
        """Q^T D (M, n): the slider positions of the motions."""
        slider = self._of_slider(memory) + memory.dw_dn[:, None] * self.motions[3 * self.node + 2]
        basis = memory.basis[:, self.first_row :]
        return np.asarray((basis[:, :, None] * slider[:, None]).reshape(self.node.size, -1))

    def at_sliders(self, memory: SliderMemory, columns: Matrix) -> Matrix:
        """What rows (n, k) of the motions are at each slider's own dof: (M, S, k)."""
        shape = -1, self.motions.shape[1], columns.shape[1]
        return np.asarray(np.einsum("mr,srk->msk", self._of_slider(memory), columns.reshape(shape), optimize=True))

    def forces(self, memory: SliderMemory, force: Matrix) -> Matrix:
        """Coefficients (M, S) of forces at the sliders, on the motions: (n,)."""
        return np.asarray(force.T @ self._of_slider(memory)).ravel()

    def contact(self, values: Matrix) -> MotionBlocks:
        """Jacobians (M, 2, 3, 2H+1, 2H+1) of the friction of the nodes of a friction cone, D^T K D."""
        every = self.motions.reshape(-1, 3, self.motions.shape[1])[self.node]
        return in_motions(values, every[:, :2], every, self.first_row)

    def _of_slider(self, memory: SliderMemory) -> Array:
        """The motions at each slider's own dof, (M, r)."""
        return np.asarray(self.motions[3 * self.node + memory.direction])


def in_motions(values: Matrix, rows: Array, columns: Array, first_row: int) -> MotionBlocks:
    """Jacobians of nodes in few motions, the sum of rows^T K columns over the nodes.

    Shapes: `values` (M, a, b, 2H+1, 2H+1), `rows` (M, a, r), `columns` (M, a, r).
    """
    kept = values[..., first_row:, first_row:]
    nodes, a, b, size, _ = kept.shape
    r = rows.shape[2]
    by_column = kept.transpose(0, 1, 3, 4, 2).reshape(nodes, a * size * size, b) @ columns
    result = rows.reshape(nodes * a, r).T @ by_column.reshape(nodes * a, size * size * r)
    return MotionBlocks(result.reshape(r, size, size, r).transpose(1, 0, 2, 3).reshape(size * r, size * r))

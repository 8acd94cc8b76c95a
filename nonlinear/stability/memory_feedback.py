"""The slider memory as a second feedback around the contact-free modal model with its contact Jacobian.

The algebra of `SliderMemoryFeedback` is the Sherman-Morrison-Woodbury formula.

References
----------
W. W. Hager, Updating the inverse of a matrix, SIAM Review 31(2), 1989.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonlinear.stability.block_matrices import Matrix, NodeBlocks
from nonlinear.stability.cone_slider_memory import ConeSliderMemory
from nonlinear.stability.contact_feedback import ContactFeedback
from nonlinear.stability.slider_memory import SliderMemory


class MemoryTerms(NamedTuple):
    """What the slider memory adds to sigma z = (A + B S C + sigma B S' C) z at one sigma, each (n_z, n_z).

    Attributes
    ----------
    state
        B (S(sigma) - S) C.
    derivative
        Its derivative in sigma.
    flexibility
        B (S(sigma) G_1 S(sigma) - S') C.
    """

    state: Matrix
    derivative: Matrix
    flexibility: Matrix


@dataclass(frozen=True)
class ContactRows:
    """Rows of the contact dofs in the eigenvalue problem: (S, nodes, 3), S Fourier coefficients.

    Attributes
    ----------
    node : (M,) int
        Node of each slider, or of each stick interval, among the nodes that touch.
    n_nodes : int
        Number of nodes that touch.
    to_real : (S, S) complex or None
        Real Fourier coefficients from harmonic amplitudes; None where the rows are real coefficients themselves.
    first_row : int
        1 where harmonic 0 is left out, else 0.
    size : int
        Number of Fourier coefficients, with that of harmonic 0.
    """

    node: NDArray[np.int64]
    n_nodes: int
    to_real: Matrix | None
    first_row: int
    size: int

    def spread(self, values: Matrix, direction: NDArray[np.int64] | int) -> Matrix:
        """`values` (M, S) in the rows of each node and `direction`: (M, n)."""
        count = self.node.size
        result = np.zeros((count, values.shape[1], self.n_nodes, 3), dtype=values.dtype)
        result[np.arange(count), :, self.node, direction] = values
        return result[:, self.first_row :].reshape(count, -1)

    def places(self, direction: NDArray[np.int64]) -> NDArray[np.int64]:
        """Where `spread` puts the coefficients, without the ones left out: (M, S)."""
        first = 3 * self.node + direction
        return np.asarray(first[:, None] + 3 * self.n_nodes * np.arange(self.size - self.first_row))


@dataclass(frozen=True)
class SliderMemoryFeedback:
    """The forces P(sigma) Q^T d of M stick intervals, beside f = K d.

    With dw = Q^T d = C_m z + V P dw and X_m = (I - V P)^-1 the memory changes B S C by B_m P X_m C_m. A prime is the
    derivative in sigma that the flexibility derivative G_1 makes:

        B_m = B Y,          B_m' = B S G_1 Y
        C_m = Q^T X C,      C_m' = Q^T X G_1 S C
        V   = Q^T X G_0,    V'   = Q^T X G_1 Y

    Attributes
    ----------
    memory, rows
        The stick intervals, and the rows of their nodes.
    input_matrix, input_derivative : (n_z, n)
        B_m and B_m'.
    output_matrix, output_derivative : (M, n_z)
        C_m and C_m'.
    feedthrough, feedthrough_derivative : (M, n)
        V and V'.
    slider_rows : (M, n)
        Q^T X.
    loop : ContactFeedback
        The loop of the contact Jacobian.
    """

    memory: SliderMemory
    rows: ContactRows
    input_matrix: Matrix
    input_derivative: Matrix
    output_matrix: Matrix
    output_derivative: Matrix
    feedthrough: Matrix
    feedthrough_derivative: Matrix
    slider_rows: Matrix
    loop: ContactFeedback

    @classmethod
    def closed(cls, memory: SliderMemory, rows: ContactRows, loop: ContactFeedback) -> "SliderMemoryFeedback":
        """Close the memory around the `loop` of the contact Jacobian."""
        model = loop.model
        q_x = loop.times_x(_slider_positions(memory, rows))
        q_x_g1 = q_x @ model.flexibility_derivative
        q_x_g1_s = loop.times_s(q_x_g1)
        return cls(
            memory,
            rows,
            input_matrix=loop.times_y(model.input_matrix, loop.b_s),
            input_derivative=loop.times_y(loop.b_s_g1, loop.b_s_derivative),
            output_matrix=q_x @ model.output_matrix,
            output_derivative=q_x_g1_s @ model.output_matrix,
            feedthrough=q_x @ model.flexibility,
            feedthrough_derivative=loop.times_y(q_x_g1, q_x_g1_s),
            slider_rows=q_x,
            loop=loop,
        )

    def x_times(self, sigma: complex, column: Matrix) -> Matrix:
        """X(sigma) = X + X G_0 P X_m Q^T X times a column (n,): the displacement of one without contact forces."""
        force = _memory_forces(self.memory, self.rows, sigma)[0]
        places, every = self.rows.places(self.memory.direction), np.arange(len(force))
        difference = -np.sum(self.feedthrough[:, places] * force, axis=2)
        difference[every, every] += 1.0
        motion = np.linalg.solve(difference, self.slider_rows @ column)
        added = np.zeros(column.size, dtype=complex)
        np.add.at(added, places, motion[:, None] * force)
        return self.loop.x_times(column + (self.loop.model.flexibility @ added[:, None])[:, 0])

    def terms(self, sigma: complex) -> MemoryTerms:
        """The terms of the memory at `sigma`."""
        values, derivatives = self._times_forces(sigma)
        n_z, size = len(self.input_matrix), len(self.feedthrough)
        b_p, b_p_g1, v_p, v_p_g1 = np.split(values, [n_z, 2 * n_z, 2 * n_z + size])
        b_dp, v_dp = derivatives[:n_z], derivatives[2 * n_z : 2 * n_z + size]
        x_m = np.linalg.inv(np.eye(size) - v_p)
        dw = x_m @ self.output_matrix
        b_p_x = b_p @ x_m
        derivative = (b_dp + b_p_x @ v_dp) @ dw
        flexibility = b_p_g1 @ dw + b_p_x @ (self.output_derivative + v_p_g1 @ dw)
        return MemoryTerms(b_p @ dw, derivative, flexibility)

    @cached_property
    def _at_sliders(self) -> Matrix:
        """Rows of B_m, B_m', V and V' at the contact dof of each stick interval: (M, 2 n_z + 2 M, coefficients)."""
        parts = self.input_matrix, self.input_derivative, self.feedthrough, self.feedthrough_derivative
        columns = np.concatenate(parts).T[self.rows.places(self.memory.direction)]
        return np.ascontiguousarray(columns.transpose(0, 2, 1))

    def _times_forces(self, sigma: complex) -> tuple[Matrix, Matrix]:
        """B_m, B_m', V and V', one below the other, times P(sigma), and times its derivative: (2 n_z + 2 M, M)."""
        values = np.stack(_memory_forces(self.memory, self.rows, sigma), axis=2)
        at_sliders = self._at_sliders
        if np.iscomplexobj(values) and not np.iscomplexobj(at_sliders):  # a product of real matrices is faster
            product = (at_sliders @ values.view(float)).view(complex)
        else:
            product = at_sliders @ values
        return product[:, :, 0].T, product[:, :, 1].T


def _slider_positions(memory: SliderMemory, rows: ContactRows) -> Matrix:
    """Q^T (M, n): the slider positions dw(theta_s) = Q^T d = du + r dd_n."""
    basis: Matrix = memory.basis
    if rows.to_real is not None:
        basis = basis @ rows.to_real
    return rows.spread(basis, memory.direction) + rows.spread(basis * memory.dw_dn[:, None], 2)


def _memory_forces(memory: SliderMemory, rows: ContactRows, sigma: complex) -> tuple[Matrix, Matrix]:
    """P(sigma), f = P dw(theta_s), and its derivative: coefficients (M, S) at the slider of each interval."""
    force, derivative = memory.force(sigma) if rows.to_real is None else memory.force_in_harmonics(sigma)
    return force[:, rows.first_row :], derivative[:, rows.first_row :]


@dataclass(frozen=True)
class ConeMemoryFeedback:
    """The contact Jacobian K(sigma) of sliders under the friction cone in place of K.

    S(sigma) = K(sigma) (I - G_0 K(sigma))^-1 is solved for at each sigma; dS = Y dK X.

    Attributes
    ----------
    memory, rows
        The sliders, and the rows of their nodes.
    loop : ContactFeedback
        The loop at sigma = 0.
    """

    memory: ConeSliderMemory
    rows: ContactRows
    loop: ContactFeedback

    def terms(self, sigma: complex) -> MemoryTerms:
        """The terms of the memory at `sigma`."""
        change, derivative = (self._blocks(values) for values in self.memory.jacobian(sigma))
        loop, model = self.loop, self.loop.model
        if sigma != 0.0:
            loop = ContactFeedback.closed(model, NodeBlocks(loop.contact.values + change))
        b_y = loop.times_y(model.input_matrix, loop.b_s)
        output_matrix = model.output_matrix
        return MemoryTerms(
            (loop.b_s - self.loop.b_s) @ output_matrix,
            loop.times_x(b_y @ NodeBlocks(derivative)) @ output_matrix,
            (loop.b_s_derivative - self.loop.b_s_derivative) @ output_matrix,
        )

    def x_times(self, sigma: complex, column: Matrix) -> Matrix:
        """X(sigma) times a column (n,): the displacement of one without contact forces."""
        change = self._blocks(self.memory.jacobian(sigma)[0])
        contact = NodeBlocks(self.loop.contact.values + change)
        return ContactFeedback.closed(self.loop.model, contact).x_times(column)

    def _blocks(self, values: Matrix) -> Matrix:
        """(M, 2, 3, 2H+1, 2H+1) as values of `NodeBlocks`."""
        rows, contact = self.rows, self.loop.contact.values
        if rows.to_real is not None:
            values = np.linalg.inv(rows.to_real) @ values @ rows.to_real
        result = np.zeros(contact.shape, dtype=np.result_type(values, contact))
        result[rows.node, :, :2] = values.transpose(0, 3, 1, 4, 2)[:, rows.first_row :, :, rows.first_row :]
        return result

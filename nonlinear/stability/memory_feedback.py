"""The slider memory as a second feedback around the contact-free modal model with its contact Jacobian.

The algebra of `SliderMemoryFeedback` is the Sherman-Morrison-Woodbury formula.

References
----------
W. W. Hager, Updating the inverse of a matrix, SIAM Review 31(2), 1989.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from nonlinear.stability.block_matrices import Matrix, MotionBlocks, NodeBlocks
from nonlinear.stability.cone_slider_memory import ConeSliderMemory
from nonlinear.stability.contact_feedback import ContactFeedback
from nonlinear.stability.contact_rows import ContactRows, MotionRows
from nonlinear.stability.slider_memory import SliderMemory


class MemoryTerms(NamedTuple):
    """What the slider memory adds to sigma z = (A + B S C + sigma B S' C) z at one sigma, each (n_z, n_z)."""

    state: Matrix  # B (S(sigma) - S) C
    derivative: Matrix  # its derivative in sigma
    flexibility: Matrix  # B (S(sigma) G_1 S(sigma) - S') C


class MemoryFactors(NamedTuple):
    """`MemoryTerms` at one sigma as products of low rank; C_m' as in `SliderMemoryFeedback`."""

    dw: Matrix  # (M, n_z), slider positions X_m C_m
    state: Matrix  # (n_z, M), factors that `dw` is multiplied by
    derivative: Matrix  # (n_z, M), factors that `dw` is multiplied by
    flexibility: Matrix  # (n_z, M), factors that `dw` is multiplied by
    inputs: Matrix  # (n_z, M), b_m P X_m, the factor of C_m' in the term `flexibility`


@dataclass(frozen=True)
class SliderMemoryFeedback:
    """The forces P(sigma) Q^T d of M stick intervals, beside f = K d.

    With dw = Q^T d = C_m z + V P dw and X_m = (I - V P)^-1 the memory changes B S C by B_m P X_m C_m. A prime is the
    derivative in sigma that the flexibility derivative G_1 makes:

        B_m = B Y,          B_m' = B S G_1 Y
        C_m = Q^T X C,      C_m' = Q^T X G_1 S C
        V   = Q^T X G_0,    V'   = Q^T X G_1 Y
    """

    memory: SliderMemory  # the stick intervals, and the rows of their nodes
    rows: ContactRows | MotionRows  # the stick intervals, and the rows of their nodes
    input_matrix: Matrix  # (n_z, n), b_m and B_m'
    input_derivative: Matrix  # (n_z, n), b_m and B_m'
    output_matrix: Matrix  # (M, n_z), c_m and C_m'
    output_derivative: Matrix  # (M, n_z), c_m and C_m'
    feedthrough: Matrix  # (M, n), V and V'
    feedthrough_derivative: Matrix  # (M, n), V and V'
    slider_rows: Matrix  # (M, n), Q^T X
    loop: ContactFeedback  # the loop of the contact Jacobian

    @classmethod
    def closed(
        cls, memory: SliderMemory, rows: ContactRows | MotionRows, loop: ContactFeedback
    ) -> "SliderMemoryFeedback":
        """Close the memory around the `loop` of the contact Jacobian."""
        model = loop.model
        q_x = loop.times_x(rows.positions(memory))
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
        difference = -np.sum(self._feedthrough_at_sliders * force, axis=2)
        difference[np.diag_indices_from(difference)] += 1.0
        motion = np.linalg.solve(difference, self.slider_rows @ column)
        added = self.rows.forces(self.memory, motion[:, None] * force)
        return self.loop.x_times(column + (self.loop.model.flexibility @ added[:, None])[:, 0])

    def terms(self, sigma: complex) -> MemoryTerms:
        """The terms of the memory at `sigma`."""
        factors = self.factors(sigma)
        flexibility = factors.flexibility @ factors.dw + factors.inputs @ self.output_derivative
        return MemoryTerms(factors.state @ factors.dw, factors.derivative @ factors.dw, flexibility)

    def factors(self, sigma: complex) -> MemoryFactors:
        """The terms of the memory at `sigma` as products with M rows."""
        values, derivatives = self._times_forces(sigma)
        n_z, size = len(self.input_matrix), len(self.feedthrough)
        b_p, b_p_g1, v_p, v_p_g1 = np.split(values, [n_z, 2 * n_z, 2 * n_z + size])
        b_dp, v_dp = derivatives[:n_z], derivatives[2 * n_z : 2 * n_z + size]
        x_m = np.linalg.inv(np.eye(size) - v_p)
        b_p_x = b_p @ x_m
        return MemoryFactors(
            dw=x_m @ self.output_matrix,
            state=b_p,
            derivative=b_dp + b_p_x @ v_dp,
            flexibility=b_p_g1 + b_p_x @ v_p_g1,
            inputs=b_p_x,
        )

    @cached_property
    def _at_sliders(self) -> Matrix:
        """Rows of B_m, B_m', V and V' at the contact dof of each stick interval: (M, 2 n_z + 2 M, coefficients)."""
        parts = self.input_matrix, self.input_derivative, self.feedthrough, self.feedthrough_derivative
        columns = self.rows.at_sliders(self.memory, np.concatenate(parts).T)
        return np.ascontiguousarray(columns.transpose(0, 2, 1))

    @cached_property
    def _feedthrough_at_sliders(self) -> Matrix:
        """Columns of V at the contact dof of each stick interval, (M, M, coefficients)."""
        return np.ascontiguousarray(self.rows.at_sliders(self.memory, self.feedthrough.T).transpose(2, 0, 1))

    def _times_forces(self, sigma: complex) -> tuple[Matrix, Matrix]:
        """B_m, B_m', V and V', one below the other, times P(sigma), and times its derivative: (2 n_z + 2 M, M)."""
        values = np.stack(_memory_forces(self.memory, self.rows, sigma), axis=2)
        at_sliders = self._at_sliders
        if np.iscomplexobj(values) and not np.iscomplexobj(at_sliders):  # a product of real matrices is faster
            product = (at_sliders @ values.view(float)).view(complex)
        else:
            product = at_sliders @ values
        return product[:, :, 0].T, product[:, :, 1].T


def _memory_forces(memory: SliderMemory, rows: ContactRows | MotionRows, sigma: complex) -> tuple[Matrix, Matrix]:
    """P(sigma), f = P dw(theta_s), and its derivative: coefficients (M, S) at the slider of each interval."""
    force, derivative = memory.force(sigma) if rows.to_real is None else memory.force_in_harmonics(sigma)
    return force[:, rows.first_row :], derivative[:, rows.first_row :]


@dataclass(frozen=True)
class ConeMemoryFeedback:
    """The contact Jacobian K(sigma) of sliders under the friction cone in place of K.

    S(sigma) = K(sigma) (I - G_0 K(sigma))^-1 is solved for at each sigma; dS = Y dK X.
    """

    memory: ConeSliderMemory  # the sliders, and the rows of their nodes
    rows: ContactRows | MotionRows  # the sliders, and the rows of their nodes
    loop: ContactFeedback  # the loop at sigma = 0

    def terms(self, sigma: complex) -> MemoryTerms:
        """The terms of the memory at `sigma`."""
        change, derivative = (self.rows.contact(values) for values in self.memory.jacobian(sigma))
        model = self.loop.model
        loop = self.loop if sigma == 0.0 else self._with(change)
        b_y = loop.times_y(model.input_matrix, loop.b_s)
        output_matrix = model.output_matrix
        return MemoryTerms(
            (loop.b_s - self.loop.b_s) @ output_matrix,
            loop.times_x(b_y @ derivative) @ output_matrix,
            (loop.b_s_derivative - self.loop.b_s_derivative) @ output_matrix,
        )

    def x_times(self, sigma: complex, column: Matrix) -> Matrix:
        """X(sigma) times a column (n,): the displacement of one without contact forces."""
        return self._with(self.rows.contact(self.memory.jacobian(sigma)[0])).x_times(column)

    def _with(self, change: NodeBlocks | MotionBlocks) -> ContactFeedback:
        """The loop of K and a change of it."""
        contact = self.loop.contact
        return ContactFeedback.closed(self.loop.model, replace(contact, values=contact.values + change.values))

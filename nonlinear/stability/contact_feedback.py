"""The contact Jacobian as a feedback around the contact-free modal model."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from nonlinear.stability.block_matrices import Matrix, MotionBlocks, NodeBlocks
from nonlinear.stability.modal_condensation import CondensedModes


@dataclass(frozen=True)
class ContactFeedback:
    """The feedback f = K d around sigma z = A z + B f, d = C z + (G_0 + sigma G_1) f.

    With

        X = (I - G_0 K)^-1,    Y = (I - K G_0)^-1 = I + S G_0,    S = K X = Y K

    the forces are f = (S + sigma S') C z to first order in sigma, S' = S G_1 S, and so

        sigma z = (A + B S C + sigma B S' C) z.

    The products with B have n_z rows; X, Y and S are never formed.
    """

    model: CondensedModes  # A, B, C, G_0 and G_1
    contact: NodeBlocks | MotionBlocks  # K, the Jacobian of the contact forces
    factors: tuple[Any, Any]  # LU factors of (I - G_0 K)^T, the transposed return difference

    @classmethod
    def closed(cls, model: CondensedModes, contact: NodeBlocks | MotionBlocks) -> "ContactFeedback":
        """Close K around the model."""
        from scipy.linalg.lapack import dgetrf, zgetrf

        difference = contact.return_difference(model.flexibility)
        factorise = zgetrf if np.iscomplexobj(difference) else dgetrf
        upper, pivots, _ = factorise(difference.T, overwrite_a=True)  # its columns are contiguous: nothing is copied
        return cls(model, contact, (upper, pivots))

    def times_x(self, rows: Matrix) -> Matrix:
        """`rows` X, (k, n): rows of d as rows of the displacement C z without contact forces."""
        from scipy.linalg.lapack import dgetrs, zgetrs

        upper, pivots = self.factors
        solve = dgetrs if upper.dtype == float else zgetrs
        if np.iscomplexobj(rows) and upper.dtype == float:
            return self.times_x(rows.real) + 1j * self.times_x(rows.imag)
        return np.asarray(solve(upper, pivots, rows.T)[0]).T

    def x_times(self, column: Matrix) -> Matrix:
        """X times a column (n,): the displacement of one without contact forces."""
        from scipy.linalg.lapack import dgetrs, zgetrs

        upper, pivots = self.factors
        if np.iscomplexobj(column) and upper.dtype == float:
            both = dgetrs(upper, pivots, np.stack([column.real, column.imag], axis=1), trans=1)[0]
            return np.asarray(both[:, 0] + 1j * both[:, 1])
        solve = dgetrs if upper.dtype == float else zgetrs
        return np.asarray(solve(upper, pivots, column, trans=1)[0])

    def times_s(self, rows: Matrix) -> Matrix:
        """`rows` S, (k, n): rows of f as rows of C z."""
        return self.times_x(rows @ self.contact)

    def times_y(self, rows: Matrix, rows_s: Matrix) -> Matrix:
        """`rows` Y, (k, n), from `rows_s` = `rows` S: rows of all forces as rows of external ones."""
        return rows + rows_s @ self.model.flexibility

    @cached_property
    def b_s(self) -> Matrix:
        """B S, (n_z, n)."""
        return self.times_s(self.model.input_matrix)

    @cached_property
    def b_s_g1(self) -> Matrix:
        """B S G_1, (n_z, n)."""
        return self.b_s @ self.model.flexibility_derivative

    @cached_property
    def b_s_derivative(self) -> Matrix:
        """B S' = B S G_1 S, (n_z, n)."""
        return self.times_s(self.b_s_g1)

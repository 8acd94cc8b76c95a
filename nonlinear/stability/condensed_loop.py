"""Hill's eigenvalue problem where each unknown has its own poles: modal coordinates of all harmonics."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray


@dataclass(frozen=True)
class CondensedPoles:
    """Poles retained as states, and the flexibility of the others, g_0 + sigma g_1, around sigma = 0."""

    state: NDArray[np.int64]  # (n_z,), unknown (harmonic and mode) of each state
    pole: ComplexArray  # (n_z,), p and a of each state, in units of omega
    residue: ComplexArray  # (n_z,), p and a of each state, in units of omega
    flexibility: ComplexArray  # (D,), g_0 and g_1 of each unknown
    derivative: ComplexArray  # (D,), g_0 and g_1 of each unknown

    @classmethod
    def of(
        cls, poles: ComplexArray, residues: ComplexArray, retained: NDArray[np.bool_], nearest: float
    ) -> "CondensedPoles":
        """Retain some of the poles.

        Shapes: `poles` (S, 2, q), `residues` (S, 2, q), `retained` (S, 2, q).
        """
        g_0, g_1 = condensed_flexibility(poles, residues, retained, nearest)
        row, _, mode = np.nonzero(retained)
        state = row * poles.shape[2] + mode
        return cls(state, poles[retained], residues[retained], g_0.ravel(), g_1.ravel())


def condensed_flexibility(
    poles: ComplexArray, residues: ComplexArray, retained: NDArray[np.bool_], nearest: float
) -> tuple[ComplexArray, ComplexArray]:
    """Flexibility of the poles that are no states, g_0 + sigma g_1 around sigma = 0, (..., q) each.

    Shapes: `poles` (..., 2, q), `residues` (..., 2, q), `retained` (..., 2, q).
    """
    distance = np.where(retained, 1.0, -poles)
    g_0 = np.where(retained, 0.0, residues / distance)
    g_1 = np.where(np.abs(distance) < nearest, 0.0, -g_0 / distance)
    return g_0.sum(axis=-2), g_1.sum(axis=-2)


@dataclass(frozen=True)
class CondensedLoop:
    """sigma E_c z = A_c z, the contact Jacobian K closed around condensed poles.

    The formulas are those of `ContactFeedback`, with G_0 and G_1 diagonal and K full.
    """

    matrix: ComplexArray  # (n_z, n_z), a_c and E_c
    descriptor: ComplexArray  # (n_z, n_z), a_c and E_c

    @classmethod
    def closed(
        cls,
        poles: CondensedPoles,
        contact: ComplexArray,
        memory: tuple[ComplexArray, ComplexArray] | ComplexArray | None,
        shift: complex = 0.0,
    ) -> "CondensedLoop":
        """Close the loop.

        Shapes: `contact` (D, D), `memory` (D, D).
        """
        from scipy.linalg.lapack import zgetrf, zgetrs

        state, every = poles.state, np.arange(poles.state.size)
        difference = contact * -poles.flexibility
        difference[np.diag_indices_from(difference)] += 1.0
        # LAPACK itself: its wrappers take as long as the solutions; transposed, as its matrices stand in columns
        upper, pivots, _ = zgetrf(difference.T, overwrite_a=True)
        force = zgetrs(upper, pivots, contact[:, state], trans=1)[0]  # S C
        change = contact @ (poles.derivative[:, None] * force)
        matrix = force[state]
        if memory is not None:  # dS = Y dK X
            inputs, outputs = memory if isinstance(memory, tuple) else (None, memory)
            change_of_memory = outputs @ (poles.flexibility[:, None] * force) + outputs[:, state]
            if inputs is not None:
                change_of_memory = inputs @ change_of_memory
            if shift:
                change_of_memory = zgetrs(upper, pivots, change_of_memory, trans=1)[0][state]
                matrix = matrix - shift * change_of_memory
            else:
                change = change + change_of_memory
        change = zgetrs(upper, pivots, change, trans=1)[0][state]
        if memory is not None and shift:
            change = change + change_of_memory
        matrix = poles.residue[:, None] * matrix
        descriptor = -poles.residue[:, None] * change
        matrix[every, every] += poles.pole
        descriptor[every, every] += 1.0
        return cls(matrix, descriptor)

    def eigenvalues(self) -> ComplexArray:
        """All of them."""
        return np.asarray(np.linalg.eigvals(np.linalg.solve(self.descriptor, self.matrix)), dtype=complex)

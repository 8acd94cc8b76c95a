"""One harmonic of the vibration with linear springs between the contacts, compiled."""

from typing import NamedTuple

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.numba_cache import compiled, lapack_lu
from nonlinear.contact.parameters import Array
from nonlinear.continuation.bordered_kernels import solve_factorised

_lu = lapack_lu(of_complex=True)
_COMPLEX = ord("z")


class SprungHarmonic(NamedTuple):
    """The structure in one harmonic h as the kernel takes it."""

    relative: ComplexArray  # (3 n_c, m), relative contact motion of the modes, B_h phi, and its adjoint
    adjoint: ComplexArray  # (3 n_c, m), relative contact motion of the modes, B_h phi, and its adjoint
    springs: Array  # (3 n_c,), contact springs k, N/m
    force: ComplexArray  # (m,), modal force of the excitation
    stiffness: Array  # (m,), w_m^2 and 2 zeta_m w_m
    damping: Array  # (m,), w_m^2 and 2 zeta_m w_m
    harmonic: float  # h


@compiled
def sprung_motion(
    structure: SprungHarmonic, omega: float
) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
    """Relative motion d and modal coordinates at `omega` (rad/s), each with its derivative in w behind it.

    (I + G k) d = d_lin with G = B D^-1 B^H, D the denominators of the modal sum. The derivative of the modal
    coordinates eta = D^-1 (f - B^H k d) is D^-1 (-D' eta - B^H k d'), so that d' solves the same system.
    """
    relative, adjoint, springs, h = structure.relative, structure.adjoint, structure.springs, structure.harmonic
    count, modes = relative.shape
    inverses, rates = np.empty(modes, np.complex128), np.empty(modes, np.complex128)
    coordinates, change = np.empty(modes, np.complex128), np.empty(modes, np.complex128)
    for m in range(modes):
        real, imaginary = structure.stiffness[m] - (h * omega) ** 2, structure.damping[m] * h * omega
        square = real * real + imaginary * imaginary  # zero: not a number, where a complex division raises an error
        inverses[m] = complex(real / square, -imaginary / square)
        rates[m] = complex(-2.0 * omega * h * h, structure.damping[m] * h)
        coordinates[m] = structure.force[m] * inverses[m]
    motion = np.dot(relative, coordinates)
    matrix, pivots = np.empty((count, count), np.complex128), np.empty(count, np.int32)
    sprung = False
    for i in range(count):
        sprung = sprung or springs[i] != 0.0
    if sprung:
        weighted = np.empty((count, modes), np.complex128)
        for i in range(count):
            for m in range(modes):
                weighted[i, m] = relative[i, m] * inverses[m]
        np.dot(weighted, adjoint, matrix)
        for i in range(count):
            for j in range(count):
                matrix[i, j] *= springs[j]
            matrix[i, i] += 1.0
        _lu(_COMPLEX, count, count, matrix.ctypes, count, pivots.ctypes)
        for i in range(count):
            if matrix[i, i] == 0.0:
                matrix[i, i] = complex(np.nan, np.nan)
        solve_factorised(matrix.reshape(count * count), pivots, motion, count)
        forces = np.dot(adjoint, springs * motion)
        for m in range(modes):
            coordinates[m] -= forces[m] * inverses[m]
    for m in range(modes):
        change[m] = -rates[m] * coordinates[m] * inverses[m]
    moved = np.dot(relative, change)
    if sprung:
        solve_factorised(matrix.reshape(count * count), pivots, moved, count)
        forces = np.dot(adjoint, springs * moved)
        for m in range(modes):
            change[m] -= forces[m] * inverses[m]
    return motion, moved, coordinates, change

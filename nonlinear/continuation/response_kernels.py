"""Quantities of a point, compiled: the largest displacement of a period, the change of forces with the motion, and
one harmonic of the vibration with linear springs between the contacts.
"""

import math
from typing import NamedTuple

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.numba_cache import compiled, inner, lapack_lu
from nonlinear.contact.parameters import Array
from nonlinear.contact.trigonometric_roots import PERIOD, cosine_sine
from nonlinear.continuation.bordered_kernels import solve_factorised

_lu = lapack_lu(of_complex=True)
_COMPLEX = ord("z")


class SprungHarmonic(NamedTuple):
    """The structure in one harmonic h as the kernel takes it."""

    relative: ComplexArray  # (3 n_c, m), relative contact motion of the modes, B_h phi
    adjoint: ComplexArray  # (m, 3 n_c), its adjoint
    springs: Array  # (3 n_c,), contact springs k, N/m
    force: ComplexArray  # (m,), modal force of the excitation
    # `stiffness`, `damping`: (m,), w_m^2 and 2 zeta_m w_m, and what the flow adds
    stiffness: ComplexArray
    damping: ComplexArray
    inertia: float  # coefficient of the squared frequency: 1, with Coriolis forces 0 of poles in place of modes
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
        rotated = 1j * h * structure.damping[m]
        value = structure.stiffness[m] - structure.inertia * (h * omega) ** 2 + rotated * omega
        square = value.real * value.real + value.imag * value.imag
        # zero: not a number, where a complex division raises an error
        inverses[m] = complex(value.real / square, -value.imag / square)
        rates[m] = rotated - 2.0 * structure.inertia * omega * h * h
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


SAMPLES_PER_HARMONIC = 32
NEWTON_STEPS = 6


@compiled
def largest_displacement(harmonics: ComplexArray) -> tuple[float, float, float]:
    """Value, angle and sign of the largest ``|x|``, x(theta) = Re sum_h x_h exp(i h theta), x_h (H+1,).

    The largest of 32 H samples, improved by Newton's method on x' = 0.
    """
    count = SAMPLES_PER_HARMONIC * (harmonics.shape[0] - 1)
    value, angle, sign = -1.0, 0.0, 1.0
    for k in range(count):
        displacement, _, _ = _derivatives(harmonics, k * (PERIOD / count))
        if abs(displacement) > value:
            value, angle, sign = abs(displacement), k * (PERIOD / count), -1.0 if displacement < 0.0 else 1.0
    for _ in range(NEWTON_STEPS):
        _, derivative, curvature = _derivatives(harmonics, angle)
        if curvature * sign >= 0.0:
            break
        next_angle = angle - derivative / curvature
        displacement, _, _ = _derivatives(harmonics, next_angle)
        if not sign * displacement >= value:
            break
        angle, value = next_angle, sign * displacement
    return value, angle, sign


@inner
def _derivatives(harmonics: ComplexArray, angle: float) -> tuple[float, float, float]:
    """x, x' and x'' at an angle."""
    c, s = cosine_sine(angle - PERIOD * math.floor(angle / PERIOD))
    ch, sh = 1.0, 0.0
    x, dx, ddx = harmonics[0].real, 0.0, 0.0
    for h in range(1, harmonics.shape[0]):
        ch, sh = ch * c - sh * s, sh * c + ch * s
        real, imag = harmonics[h].real, harmonics[h].imag
        part = real * ch - imag * sh
        x += part
        dx -= h * (real * sh + imag * ch)
        ddx -= h * h * part
    return x, dx, ddx


@compiled
def moving_forces(force: Array, jacobian: Array, motion: Array) -> ComplexArray:
    """Complex coefficients of the contact forces, and of their change by a motion, df/dx dx: (H+1, 3 n_c, 2).

    Shapes: `force` (2H+1, n_c, 3), `jacobian` (2H+1, n_c, 3), `motion` (2H+1, n_c, 3).
    """
    size, nodes = force.shape[0], force.shape[1]
    first = size - motion.shape[0]
    forces, own = np.zeros(((size + 1) // 2, 3 * nodes, 2), np.complex128), np.zeros((3, size))
    for k in range(nodes):
        for b in range(3):
            for j in range(motion.shape[0]):
                own[b, first + j] = motion[j, k, b]
        for a in range(3):
            for i in range(size):
                part = 1.0 if i == 0 or i % 2 == 1 else 1j
                forces[(i + 1) // 2, 3 * k + a, 0] += part * force[i, k, a]
                forces[(i + 1) // 2, 3 * k + a, 1] += part * _product(jacobian[k, a, :, i], own)
    return forces


@inner
def _product(derivative: Array, motion: Array) -> float:
    """Sum of the products of two arrays (3, 2H+1)."""
    total = 0.0
    for b in range(motion.shape[0]):
        for j in range(motion.shape[1]):
            total += derivative[b, j] * motion[b, j]
    return total

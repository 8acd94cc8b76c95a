"""Real Fourier coefficients, their samples and their complex form.

The basis is phi_0 = 1 and, for h = 1 .. H, phi_(2h-1) = cos(h theta), phi_(2h) = -sin(h theta).
"""

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.parameters import Array

ComplexArray = NDArray[np.complex128]
SAMPLES_PER_HARMONIC = 32  # of a search for an extreme value
LENGTH_SAMPLES = 64  # for each harmonic, of a search for a largest length
NEWTON_STEPS = 6


def basis_table(n_harmonics: int, n_samples: int) -> Array:
    """Values of 1, cos(theta), -sin(theta), cos(2 theta), ... at theta_k = 2 pi k / n: (n, 2H+1)."""
    return basis_at(2.0 * np.pi * np.arange(n_samples) / n_samples, n_harmonics)


def basis_at(angles: Array, n_harmonics: int, derivative: int = 0) -> Array:
    """1, cos, -sin, cos 2, ... (or a derivative) at the angles, (n, 2H+1)."""
    order = np.arange(1, n_harmonics + 1)
    phase = np.outer(angles, order) + 0.5 * np.pi * derivative
    table = np.empty((angles.size, 2 * n_harmonics + 1))
    table[:, 0] = float(derivative == 0)
    table[:, 1::2], table[:, 2::2] = order**derivative * np.cos(phase), -(order**derivative) * np.sin(phase)
    return table


def to_complex(real: Array) -> ComplexArray:
    """Rows (0, Re 1, Im 1, ...) to rows (harmonic 0, 1, ...): (2H+1, ...) to (H+1, ...)."""
    result = np.empty(((real.shape[0] + 1) // 2, *real.shape[1:]), dtype=complex)
    result[0] = real[0]
    result[1:] = real[1::2] + 1j * real[2::2]
    return result


def to_real(coefficients: ComplexArray) -> Array:
    """The inverse of `to_complex`; the imaginary part of harmonic 0 is dropped."""
    result = np.empty((2 * coefficients.shape[0] - 1, *coefficients.shape[1:]))
    result[0] = coefficients[0].real
    result[1::2] = coefficients[1:].real
    result[2::2] = coefficients[1:].imag
    return result


def smallest_values(coefficients: ComplexArray) -> Array:
    """Smallest value over theta of x_0 + Re sum_h x_h exp(i h theta) for each column of coefficients (H+1, k): (k,).

    The smallest of 32 H samples, improved by Newton's method on x' = 0.
    """
    order = np.arange(len(coefficients))
    samples = SAMPLES_PER_HARMONIC * (len(coefficients) - 1)
    theta = 2.0 * np.pi * np.arange(samples) / samples
    values = (np.exp(1j * np.outer(theta, order)) @ coefficients).real
    angle, least = theta[values.argmin(axis=0)], values.min(axis=0)
    for _ in range(NEWTON_STEPS):
        terms = np.exp(1j * np.outer(order, angle)) * coefficients
        slope = (1j * order[:, None] * terms).real.sum(axis=0)
        curvature = -(order[:, None] ** 2 * terms).real.sum(axis=0)
        convex = curvature > 0.0
        angle = angle - np.where(convex, slope, 0.0) / np.where(convex, curvature, 1.0)
        value = (np.exp(1j * np.outer(order, angle)) * coefficients).real.sum(axis=0)
        least = np.minimum(least, value)
    return np.asarray(least)


def largest_lengths(harmonics: ComplexArray) -> Array:
    """Largest length over a period of a vector x(theta) = x_0 + Re sum_h x_h exp(i h theta), at each of P points.

    The largest of 64 H samples, improved by Newton's method on the derivative of its square.

    `harmonics` (P, H+1, c): Fourier coefficients of its c components. Returns (P,): lengths; of one component the
    largest abs(x).
    """
    if harmonics.shape[0] == 0:
        return np.zeros(0)
    order = np.arange(harmonics.shape[1])
    samples = LENGTH_SAMPLES * max(len(order) - 1, 1)
    theta = np.linspace(0.0, 2.0 * np.pi, samples, endpoint=False)
    found = [_largest(each, order, theta) for each in harmonics]
    return np.array(found)


def _largest(harmonics: ComplexArray, order: NDArray[np.int64], theta: Array) -> float:
    squares = ((np.exp(1j * np.outer(theta, order)) @ harmonics).real ** 2).sum(axis=1)
    angle, largest = theta[squares.argmax()], float(squares.max())
    for _ in range(NEWTON_STEPS):
        turn = np.exp(1j * order * angle)
        x, dx, ddx = (((1j * order) ** power * turn @ harmonics).real for power in range(3))
        curvature = dx @ dx + x @ ddx
        if curvature >= 0.0:
            break
        angle -= (x @ dx) / curvature
        x = (np.exp(1j * order * angle) @ harmonics).real
        largest = max(largest, float(x @ x))
    return float(np.sqrt(largest))

"""Real Fourier coefficients, their samples and their complex form.

The basis is phi_0 = 1 and, for h = 1 .. H, phi_(2h-1) = cos(h theta), phi_(2h) = -sin(h theta).
"""

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.parameters import Array

ComplexArray = NDArray[np.complex128]


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

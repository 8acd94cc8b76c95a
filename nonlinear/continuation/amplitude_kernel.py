"""The output of a point and its largest displacement in a period, compiled: a curve asks for them at each point."""

import math

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.numba_cache import compiled, inner
from nonlinear.contact.parameters import Array
from nonlinear.contact.trigonometric_roots import PERIOD, cosine_sine

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
def output_along_curve(
    denominators: tuple[ComplexArray, ComplexArray],
    adjoint: ComplexArray,
    modal_force: ComplexArray,
    output: ComplexArray,
    forces: tuple[Array, Array],
    motion: Array,
    rate: float,
) -> tuple[ComplexArray, ComplexArray]:
    """Fourier coefficients of an output and their derivatives in the arc length, (H+1,) each.

    `denominators`: those of the modal sum and their derivatives in w, (H+1, m); `adjoint` (H+1, m, 3 n_c) and
    `modal_force` (H+1, m) as of the receptance; `output` (m,); `forces`: the contact forces (2H+1, n_c, 3) and their
    Jacobian (n_c, 3, 3, 2H+1, 2H+1); `motion` (2H+1, n_c, 3) and `rate`: dx/ds and dw/ds.
    """
    value, derivative = denominators
    force, jacobian = forces
    n_h, modes = value.shape
    size, n_contacts = force.shape[0], force.shape[1]
    change = np.zeros((size, 3 * n_contacts))
    for k in range(n_contacts):
        for a in range(3):
            for i in range(size):
                change[i, 3 * k + a] = _times_motion(jacobian[k, a, :, i], motion[:, k])
    found, changes = np.zeros(n_h, np.complex128), np.zeros(n_h, np.complex128)
    of_force, of_change = np.empty(3 * n_contacts, np.complex128), np.empty(3 * n_contacts, np.complex128)
    for h in range(n_h):
        for k in range(n_contacts):
            for a in range(3):
                c = 3 * k + a
                if h == 0:
                    of_force[c], of_change[c] = force[0, k, a], change[0, c]
                else:
                    of_force[c] = complex(force[2 * h - 1, k, a], force[2 * h, k, a])
                    of_change[c] = complex(change[2 * h - 1, c], change[2 * h, c])
        modal, modal_change = np.dot(adjoint[h], of_force), np.dot(adjoint[h], of_change)
        for m in range(modes):
            coordinate = (modal_force[h, m] + modal[m]) / value[h, m]
            found[h] += output[m] * coordinate
            changes[h] += output[m] * (modal_change[m] - rate * derivative[h, m] * coordinate) / value[h, m]
    return found, changes


@inner
def _times_motion(row: Array, motion: Array) -> float:
    """A row of the Jacobian of one node (3, 2H+1) times its motion (2H+1, 3)."""
    total = 0.0
    for b in range(3):
        for j in range(motion.shape[0]):
            total += row[b, j] * motion[j, b]
    return total

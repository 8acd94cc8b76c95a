"""The largest displacement of a period, compiled: a curve asks for it twice a point."""

import math

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.numba_cache import compiled, inner
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

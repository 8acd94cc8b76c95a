"""Quantities of a solved point: output amplitude and its slope along the curve, work put in and dissipated."""

from dataclasses import dataclass

import numpy as np

from nonlinear.contact import ContactForces
from nonlinear.curve_point import CurvePoint
from nonlinear.fourier import ComplexArray, to_complex
from rom import RelativeReceptance


@dataclass(frozen=True)
class Amplitude:
    """Largest |x(t)| over a period, metres, and the angle theta (rad) and sign of x where it is reached."""

    value: float
    angle: float
    sign: float


def largest_amplitude(harmonics: ComplexArray) -> Amplitude:
    """Largest |x| of x(theta) = x_0 + Re sum_h x_h exp(i h theta); `harmonics` (H+1,).

    Closed form for one harmonic; else the best of 32 H samples, polished by Newton's method on x'.
    """
    static, first = harmonics[0].real, harmonics[1]
    if np.all(harmonics[2:] == 0.0):
        sign = -1.0 if static < 0.0 else 1.0
        angle = -np.angle(first) if sign > 0.0 else np.pi - np.angle(first)
        return Amplitude(float(abs(static) + abs(first)), float(angle), sign)
    order = np.arange(harmonics.size)
    theta = 2.0 * np.pi * np.arange(32 * (order.size - 1)) / (32 * (order.size - 1))
    samples = (np.exp(1j * np.outer(theta, order)) @ harmonics).real
    best = int(np.argmax(np.abs(samples)))
    angle, sign = float(theta[best]), float(np.sign(samples[best]) or 1.0)
    value = abs(float(samples[best]))
    for _ in range(6):
        terms = harmonics * np.exp(1j * order * angle)
        slope, curvature = (1j * order * terms).sum().real, (-(order**2) * terms).sum().real
        if curvature * sign >= 0.0:
            break
        moved = angle - slope / curvature
        trial = sign * float((harmonics * np.exp(1j * order * moved)).sum().real)
        if trial < value:
            break
        angle, value = moved, trial
    return Amplitude(value, float(angle), sign)


def output_harmonics(point: CurvePoint, output: str) -> ComplexArray:
    """Fourier coefficients of the output, (H+1,)."""
    return output_under(point.balance.receptance, point.frequency, point.contact, output)


def output_under(
    receptance: RelativeReceptance, frequency: float, contact: ContactForces, output: str
) -> ComplexArray:
    """Fourier coefficients of the output under the excitation and given contact forces, (H+1,)."""
    coordinates, _ = receptance.modal_response(frequency, complex_force(contact))
    return coordinates @ receptance.modal.outputs[output]


def amplitude_slope(point: CurvePoint, output: str) -> float:
    """Derivative of the largest |x(t)| with respect to the arc length at `point`, metres."""
    balance, receptance = point.balance, point.balance.receptance
    output_shape = receptance.modal.outputs[output]
    coordinates, slope = receptance.modal_response(point.frequency, complex_force(point.contact))
    first = balance.first_row
    motion = point.tangent[0].reshape(-1, balance.n_contacts, 3)
    change = np.einsum("kabij,jkb->ika", point.contact.jacobian[..., first:], motion)
    force_change = to_complex(change.reshape(change.shape[0], -1))
    rows = receptance.output_rows(output, point.frequency)
    derivative = (rows * force_change).sum(axis=1) + (slope @ output_shape) * point.tangent[1]
    amplitude = largest_amplitude(coordinates @ output_shape)
    order = np.arange(derivative.size)
    return float(amplitude.sign * (derivative * np.exp(1j * order * amplitude.angle)).sum().real)


@dataclass(frozen=True)
class Work:
    """Work a cycle on one blade, J: put in by the excitation, dissipated by structural damping and by friction."""

    excitation: float
    damping: float
    friction: float

    @property
    def mismatch(self) -> float:
        """|put in - dissipated| relative to the larger of the two."""
        scale = max(abs(self.excitation), abs(self.damping) + abs(self.friction), 1e-300)
        return abs(self.excitation - self.damping - self.friction) / scale


def work(point: CurvePoint) -> Work:
    """Work balance of a cycle: W = -pi h Im(conj(F) X) for force and displacement coefficients of harmonic h."""
    receptance = point.balance.receptance
    force = complex_force(point.contact)
    coordinates, _ = receptance.modal_response(point.frequency, force)
    order = np.asarray(receptance.harmonics, dtype=float)
    excitation = -np.pi * (order[:, None] * (receptance.modal_force.conj() * coordinates).imag).sum()
    damping = np.pi * (order[:, None] ** 2 * receptance.modal.damping * np.abs(coordinates) ** 2).sum()
    displacement = to_complex(point.displacement).reshape(force.shape)
    friction = np.pi * (order[:, None] * (force.conj() * displacement).imag).sum()
    return Work(float(excitation), float(damping * point.frequency), float(friction))


def complex_force(contact: ContactForces) -> ComplexArray:
    """f_R^(h), (H+1, 3 n_c)."""
    return to_complex(contact.force.reshape(contact.force.shape[0], -1))

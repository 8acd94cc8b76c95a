"""Quantities of a solved point: output amplitude and its slope along the curve, work put in and dissipated."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nonlinear.contact.fourier import ComplexArray, to_complex
from nonlinear.contact.parameters import Array, ContactForces
from nonlinear.continuation.solution_point import SolutionPoint
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


def output_harmonics(point: SolutionPoint, output: str) -> ComplexArray:
    """Fourier coefficients of the output, (H+1,)."""
    return output_under(point.balance.receptance, point.omega, point.contact, output)


def output_under(receptance: RelativeReceptance, omega: float, contact: ContactForces, output: str) -> ComplexArray:
    """Fourier coefficients of the output under the excitation and given contact forces, (H+1,)."""
    coordinates, _ = receptance.modal_response(omega, complex_force(contact))
    return coordinates @ receptance.modal.outputs[output]


def amplitude_slope(point: SolutionPoint, output: str) -> float:
    """Derivative of the largest |x(t)| with respect to the arc length at `point`, metres."""
    balance, receptance = point.balance, point.balance.receptance
    output_shape = receptance.modal.outputs[output]
    coordinates, slope = receptance.modal_response(point.omega, complex_force(point.contact))
    first = balance.first_row
    motion = point.tangent[0].reshape(-1, balance.n_contacts, 3)
    change = np.einsum("kabij,jkb->ika", point.contact.jacobian[..., first:], motion)
    force_change = to_complex(change.reshape(change.shape[0], -1))
    rows = receptance.output_rows(output, point.omega)
    derivative = (rows * force_change).sum(axis=1) + (slope @ output_shape) * point.tangent[1]
    amplitude = largest_amplitude(coordinates @ output_shape)
    order = np.arange(derivative.size)
    return float(amplitude.sign * (derivative * np.exp(1j * order * amplitude.angle)).sum().real)


@dataclass(frozen=True)
class Responses:
    """What P points of one balance answer.

    output : Fourier coefficients of the output, (P, H+1).
    excitation, damping, friction : work a cycle on one blade, J, (P,): put in by the excitation, dissipated by
        structural damping and by friction. For coefficients F of a force and X of its displacement in harmonic h,
        W = -pi h Im(conj(F) X).
    """

    output: ComplexArray
    excitation: Array
    damping: Array
    friction: Array

    @property
    def mismatch(self) -> Array:
        """|put in - dissipated| relative to the larger of the two, (P,)."""
        scale = np.maximum(np.abs(self.excitation), np.abs(self.damping) + np.abs(self.friction))
        return np.abs(self.excitation - self.damping - self.friction) / np.maximum(scale, 1e-300)


def responses(points: Sequence[SolutionPoint], output: str) -> Responses:
    """The output and the work of points that have one balance."""
    receptance = points[0].balance.receptance
    omega = np.array([point.omega for point in points])
    force = _flat([point.contact.force for point in points])
    displacement = _flat([point.displacement for point in points])
    coordinates = receptance.coordinates(omega, force)
    order = np.asarray(receptance.harmonics, dtype=float)
    excited = (receptance.modal_force.conj() * coordinates).imag.sum(axis=-1)
    damped = (receptance.modal.damping * (coordinates.real**2 + coordinates.imag**2)).sum(axis=-1)
    rubbed = (force.conj() * displacement).imag.sum(axis=-1)
    return Responses(
        output=coordinates @ receptance.modal.outputs[output],
        excitation=-np.pi * (excited @ order),
        damping=np.pi * omega * (damped @ order**2),
        friction=np.pi * (rubbed @ order),
    )


def _flat(coefficients: list[Array]) -> ComplexArray:
    """Real coefficients of the points, (2H+1, n_c, 3) each, as complex ones: (P, H+1, 3 n_c)."""
    rows = np.stack([values.reshape(values.shape[0], -1) for values in coefficients], axis=1)
    return to_complex(rows).transpose(1, 0, 2)


def complex_force(contact: ContactForces) -> ComplexArray:
    """f_R^(h), (H+1, 3 n_c)."""
    return to_complex(contact.force.reshape(contact.force.shape[0], -1))

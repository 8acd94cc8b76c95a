"""Amplitudes of all blades along a curve of a ring, and their highest maximum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nonlinear.branches.special_point_location import locate_zero
from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import largest_amplitude
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.mistuned_ring.ring_balance import RingBalance

NEARLY_HIGHEST = 0.97  # of the largest sample: a maximum whose largest sample is lower is not the highest one
UNCERTAIN = 5e-3  # relative error of the height expected of a maximum between two points


@dataclass(frozen=True)
class RingPeak:
    """The highest amplitude of any blade.

    Attributes
    ----------
    frequency_hz : float
        Frequency, Hz.
    amplitude_m : float
        Amplitude of the vibration of the output about its mean, m.
    blade : int
        Number of the blade, 0 ... N_b - 1.
    blade_amplitude_m : (N_b,) array
        Amplitudes of all blades there, m.
    index : int
        Index among the points of the curve.
    located : bool
        Whether the maximum was solved for. False where the largest amplitude lies at an end of the curve.

    Examples
    --------
    With the names of the example of `forced_response`; the softest blade vibrates highest:

    >>> from nonlinear import Mistuning, mistuned_response
    >>> softer = Mistuning.of(12, frequency=[0.0, 0.0, -0.02] + 9 * [0.0])
    >>> peak = mistuned_response(modal, contact, excitation, options, softer).peak
    >>> peak.located, peak.blade, bool(peak.amplitude_m > curve.peak.amplitude_m)
    (True, 2, True)
    """

    frequency_hz: float
    amplitude_m: float
    blade: int
    blade_amplitude_m: Array
    index: int
    located: bool


def ring_output(point: SolutionPoint, output: str) -> ComplexArray:
    """Fourier coefficients of an output of all blades, each in its own time: (N_b, H+1), m."""
    balance = ring_of(point)
    coordinates, _ = balance.structure.coordinates(point.omega, balance.by_harmonic(point.contact.force))
    return balance.structure.output(output, coordinates)


def ring_of(point: SolutionPoint) -> RingBalance:
    """The balance of a point, which is that of a ring."""
    assert isinstance(point.balance, RingBalance)
    return point.balance


def vibration_amplitudes(harmonics: ComplexArray) -> Array:
    """Largest abs(x(t) - x_0) over a period of coefficients (..., H+1), (...)."""
    if harmonics.shape[-1] == 2:
        return np.abs(harmonics[..., 1])
    rows = harmonics.reshape(-1, harmonics.shape[-1]).copy()
    rows[:, 0] = 0.0
    return np.array([largest_amplitude(row).value for row in rows]).reshape(harmonics.shape[:-1])


def amplitude_slopes(point: SolutionPoint, output: str) -> Array:
    """Derivatives of the amplitudes of all blades with respect to the arc length, (N_b,), m.

    With the coefficients x_h of the output and the angle theta at which its vibration is largest, dA/ds =
    sign(x(theta)) Re sum_h dx_h/ds exp(i h theta).
    """
    balance = ring_of(point)
    jacobian = balance.forces(point.unknown).jacobian  # that of a recorded point is not kept
    dx_ds = balance.displacement(point.tangent[0])
    dforce = balance.by_harmonic(np.einsum("kabij,jkb->ika", jacobian, dx_ds))
    ring = balance.structure
    value, by_omega = ring.coordinates(point.omega, balance.by_harmonic(point.contact.force))
    by_force = ring.increments(point.omega, dforce)
    harmonics = ring.output(output, value)
    changes = ring.output(output, by_force + by_omega * point.tangent[1])
    harmonics[:, 0] = changes[:, 0] = 0.0
    order = np.arange(changes.shape[1])
    largest = [largest_amplitude(row) for row in harmonics]
    rates = [
        each.sign * (change * np.exp(1j * order * each.angle)).sum().real
        for each, change in zip(largest, changes, strict=True)
    ]
    return np.array(rates)


def with_peak(
    continuation: Continuation, points: Sequence[SolutionPoint], amplitudes: Array, output: str
) -> tuple[list[SolutionPoint], int | None]:
    """The points with the highest maximum of any blade located and inserted; its index, None if it lies at an end.

    Shapes: `amplitudes` (P, N_b).
    """
    best, place, height = None, -1, 0.0
    for expected, first, blade in _expected_maxima(points, amplitudes, output):
        if expected < (1.0 - UNCERTAIN) * height:
            break

        def slope(point: SolutionPoint, blade: int = blade) -> float:
            return float(amplitude_slopes(point, output)[blade])

        found = locate_zero(continuation, points[first], points[first + 1], slope)
        if found is None:
            continue
        reached = float(vibration_amplitudes(ring_output(found, output))[blade])
        if reached > height:
            best, place, height = found, first + 1, reached
    if best is None or height < amplitudes.max():
        return list(points), None
    return [*points[:place], best, *points[place:]], place


def _expected_maxima(points: Sequence[SolutionPoint], amplitudes: Array, output: str) -> list[tuple[float, int, int]]:
    """(height, index of the point before, blade) of maxima that may be the highest, the highest first.

    The height is that of the cubic with the amplitudes and slopes of the points on both sides.
    """
    slopes: dict[int, Array] = {}

    def slope(index: int, blade: int) -> float:
        if index not in slopes:
            slopes[index] = amplitude_slopes(points[index], output)
        return float(slopes[index][blade])

    found = []
    for index, blade in _candidates(amplitudes):
        first = index if slope(index, blade) > 0.0 else index - 1
        if not 0 <= first < len(points) - 1:
            continue
        length = points[first + 1].arc - points[first].arc
        rates = length * slope(first, blade), length * slope(first + 1, blade)
        at = np.linspace(0.0, 1.0, 101)
        rise = amplitudes[first + 1, blade] - amplitudes[first, blade]
        cubic = rates[0] * at * (1.0 - at) ** 2 - rates[1] * at**2 * (1.0 - at) + rise * at**2 * (3.0 - 2.0 * at)
        found.append((float(amplitudes[first, blade] + cubic.max()), first, blade))
    return sorted(found, reverse=True)


def _candidates(amplitudes: Array) -> list[tuple[int, int]]:
    """(index, blade) of the samples that may be next to the highest maximum: local maxima of one blade."""
    padded = np.pad(amplitudes, ((1, 1), (0, 0)), constant_values=-np.inf)
    local = (amplitudes >= padded[:-2]) & (amplitudes >= padded[2:])
    high = amplitudes >= NEARLY_HIGHEST * amplitudes.max()
    return [(int(index), int(blade)) for index, blade in np.argwhere(local & high)]

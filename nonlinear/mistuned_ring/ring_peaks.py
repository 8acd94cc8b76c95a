"""Amplitudes of all blades along a curve of a ring, and their highest maximum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nonlinear.branches.special_point_location import locate_zero
from nonlinear.contact.fourier import ComplexArray, to_complex
from nonlinear.contact.parameters import Array
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import largest_amplitude
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.mistuned_ring.ring_balance import RingBalance

NEARLY_HIGHEST = 0.97  # of the largest sample: a maximum whose largest sample is lower is not the highest one


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
    coordinates, _ = balance.ring.coordinates(point.omega, balance.pair_forces(point.contact))
    found: ComplexArray = (coordinates @ balance.ring.blade.outputs[output]).T
    return found


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


def amplitude_slope(point: SolutionPoint, output: str, blade: int) -> float:
    """Derivative of the amplitude of one blade with respect to the arc length, m.

    With the coefficients x_h of the output and the angle theta at which its vibration is largest, dA/ds =
    sign(x(theta)) Re sum_h dx_h/ds exp(i h theta).
    """
    balance = ring_of(point)
    jacobian = balance.forces(point.unknown).jacobian  # that of a recorded point is not kept
    dx_ds = balance.displacement(point.tangent[0])
    dforce = to_complex(np.einsum("kabij,jkb->ika", jacobian, dx_ds).reshape(dx_ds.shape[0], -1))
    ring, shape = balance.ring, balance.ring.blade.outputs[output]
    force = balance.pair_forces(point.contact)
    value, by_omega = ring.coordinates(point.omega, force)
    by_force = ring.increments(point.omega, dforce.reshape(force.shape))
    harmonics, change = value[:, blade] @ shape, (by_force + by_omega * point.tangent[1])[:, blade] @ shape
    harmonics[0] = change[0] = 0.0
    amplitude = largest_amplitude(harmonics)
    order = np.arange(change.size)
    return float(amplitude.sign * (change * np.exp(1j * order * amplitude.angle)).sum().real)


def with_peak(
    continuation: Continuation, points: Sequence[SolutionPoint], amplitudes: Array, output: str
) -> tuple[list[SolutionPoint], int | None]:
    """The points with the highest maximum of any blade located and inserted; its index, None if it lies at an end.

    Parameters
    ----------
    continuation : Continuation
        The continuation of the ring.
    points : sequence of SolutionPoint
        The P points of the curve.
    amplitudes : (P, N_b) array
        Amplitudes of all blades, m.
    output : str
        Name of the output.
    """
    best, place, height = None, -1, 0.0
    for index, blade in _candidates(amplitudes):

        def slope(point: SolutionPoint, blade: int = blade) -> float:
            return amplitude_slope(point, output, blade)

        first = index if slope(points[index]) > 0.0 else index - 1
        if not 0 <= first < len(points) - 1:
            continue
        found = locate_zero(continuation, points[first], points[first + 1], slope)
        if found is None:
            continue
        reached = float(vibration_amplitudes(ring_output(found, output))[blade])
        if reached > height:
            best, place, height = found, first + 1, reached
    if best is None or height < amplitudes.max():
        return list(points), None
    return [*points[:place], best, *points[place:]], place


def _candidates(amplitudes: Array) -> list[tuple[int, int]]:
    """(index, blade) of the samples that may be next to the highest maximum: local maxima of one blade."""
    padded = np.pad(amplitudes, ((1, 1), (0, 0)), constant_values=-np.inf)
    local = (amplitudes >= padded[:-2]) & (amplitudes >= padded[2:])
    high = amplitudes >= NEARLY_HIGHEST * amplitudes.max()
    return [(int(index), int(blade)) for index, blade in np.argwhere(local & high)]

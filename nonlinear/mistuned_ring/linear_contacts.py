"""Contacts of a ring in one linear state: springs, stiffness of a wave with them, highest amplitude of any blade."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.options import OptionsError
from rom import ModalModel, contact_springs, relative_contact_motion, spring_stiffness

PER_BANDWIDTH, LEAST, MOST = 4.0, 64, 20000  # frequencies of the search: in a half-power bandwidth, and in all
ZOOMS, ZOOM_POINTS = 5, 17
NEARLY_HIGHEST = 0.97  # of the largest sample

Vibration = Callable[[Array], ComplexArray]  # (F,) Hz to amplitudes (F, N_b), m


@dataclass(frozen=True)
class LinearPeak:
    """The highest amplitude of any blade of a linear ring.

    Attributes
    ----------
    frequency_hz : float
        Frequency, Hz.
    amplitude_m : float
        Amplitude of the output in the harmonic of the excitation, m.
    blade : int
        Number of the blade, 0 ... N_b - 1.

    Examples
    --------
    With the names of the example of `forced_response`; a softer blade, stuck, vibrates with F / (c w):

    >>> from nonlinear import LinearRing, Mistuning
    >>> softer = Mistuning.of(12, frequency=[0.0, 0.0, -0.02] + 9 * [0.0])
    >>> ring = LinearRing.of(modal, contact, excitation, softer, highest_hz=0.4)
    >>> peak = ring.peak((0.3, 0.33))
    >>> print(f"blade {peak.blade}: {peak.amplitude_m:.2f} m at {peak.frequency_hz:.4f} Hz")
    blade 2: 25.12 m at 0.3167 Hz
    """

    frequency_hz: float
    amplitude_m: float
    blade: int


def highest_peak(vibration: Vibration, bandwidth_hz: float, frequency_hz: tuple[float, float]) -> LinearPeak:
    """The highest amplitude of any blade between two frequencies."""
    low, high = frequency_hz
    wanted = PER_BANDWIDTH * (high - low) / max(bandwidth_hz, 1e-300)
    grid = np.linspace(low, high, int(min(max(wanted, LEAST), MOST)) + 1)
    top = np.abs(vibration(grid)).max(axis=1)
    padded = np.pad(top, 1, constant_values=-np.inf)
    local = (top >= padded[:-2]) & (top >= padded[2:]) & (top >= NEARLY_HIGHEST * top.max())
    starts = np.flatnonzero(local).tolist()
    found = [_zoomed(vibration, float(grid[max(i - 1, 0)]), float(grid[min(i + 1, grid.size - 1)])) for i in starts]
    return max(found, key=lambda peak: peak.amplitude_m)


def _zoomed(vibration: Vibration, low: float, high: float) -> LinearPeak:
    """The highest amplitude between two samples, by ever finer samples."""
    for _ in range(ZOOMS):
        grid = np.linspace(low, high, ZOOM_POINTS)
        amplitude = np.abs(vibration(grid))
        best, blade = divmod(int(np.argmax(amplitude)), amplitude.shape[1])
        low, high = float(grid[max(best - 1, 0)]), float(grid[min(best + 1, ZOOM_POINTS - 1)])
    return LinearPeak(float(grid[best]), float(amplitude[best, blade]), blade)


def springs_in_state(contact: ContactParameters, state: str) -> Array:
    """Springs of stuck, sliding or free contacts, (3 n_c,), N/m."""
    if state not in ("stuck", "sliding", "free"):
        raise OptionsError(f'state: {state!r}, allowed: "stuck", "sliding" or "free"')
    normal = contact.normal_stiffness * (state != "free")
    return contact_springs(contact.n_contacts, normal, contact.tangential_stiffness * (state == "stuck")).reshape(-1)


def supported_stiffness(modes: ModalModel, phase: float, springs: Array) -> ComplexArray:
    """Stiffness in the modes of the wave of a phase (rad) with contact springs (3 n_c,), (m, m)."""
    found: ComplexArray = spring_stiffness(relative_contact_motion(modes.right, modes.left, phase), springs)
    found[np.diag_indices_from(found)] += modes.angular_frequency**2
    return found

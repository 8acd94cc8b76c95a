"""A ring of blades while its excitation frequency rises or falls at a given rate: the envelope of its response.

The frequency is constant over one or a few periods and changes between them, with the phase of the excitation
continuous: over T seconds at the rate f' the phase is off by pi f' T^2 / 4 at most, 2e-4 rad for rates at which a
resonance is passed in some ten periods. The state is carried, so that what the ring remembers (its free vibration,
the sliders, closed gaps) is that of the sweep.

References
----------
F. M. Lewis, Vibration during acceleration through a critical speed, Trans. ASME 54 (1932) 253.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.parameters import Array
from nonlinear.time_integration.ring import RetainedModes, Ring, RingState
from nonlinear.time_integration.ring_integrator import RingIntegrator

BANDS = 0.05  # of the half bandwidth of a mode, by which the frequency changes between two parts at most
MOST_PERIODS = 40  # in one part
PHASE = 1e-3  # rad, by which the excitation is off in a part of several periods at most
SETTLED = 8.0  # half bandwidths that pass, as exp(-t delta), before a start from rest counts
PLACES = 60  # in a sweep, where the states of the contacts are looked at
STUCK = 1.0 - 1e-6  # of the friction limit, from which a contact slips


@dataclass(frozen=True)
class RunUp:
    """Envelope of the response in a sweep of the excitation frequency."""

    rate_hz_per_s: float  # above 0: upwards
    time_s: Array  # (P,), at the middle of each period
    frequency_hz: Array  # (P,), excitation frequency there
    envelope_m: Array  # (P,), largest displacement of the output of any blade over the period, m
    # (K,), some frequencies, and shares of contacts and time of a period there that are open, and that slip
    place_hz: Array
    open_share: Array
    slip_share: Array
    n_blades: int  # of the ring that was integrated

    @property
    def peak(self) -> int:
        """The period with the largest displacement."""
        return int(np.argmax(self.envelope_m))


def half_bandwidth(ring: Ring) -> float:
    """The smallest decay rate of the modes of the excited wave over 2 pi, Hz; 0 where none decays."""
    damping = np.asarray(ring.modal.at_phase(ring.phase).damping)
    moving = damping[damping > 0.0]
    return float(moving.min()) / (4.0 * np.pi) if moving.size else 0.0


def run_up(
    ring: Ring,
    frequency_hz: tuple[float, float],
    rate_hz_per_s: float,
    displacement: Array | None = None,
    progress: Callable[[float], None] = lambda share: None,
    observe: Callable[[float, float, Array], None] = lambda time, omega, output: None,
) -> RunUp:
    """Sweep the excitation frequency from one value to another, which may be the lower one.

    `rate_hz_per_s`: its size; `displacement` (2H+1, n_c, 3): the steady motion at the beginning, m; None: the ring
    starts at rest and settles there; `progress`: called with the share of the range that is done; `observe`: with the
    beginning of each part, s, its frequency, rad/s, and the output (P, n, q) at the n steps of its P periods.
    Raises ContactIterationError where the contact forces of a step are not found.
    """
    first, last = frequency_hz
    rate = abs(rate_hz_per_s) if last > first else -abs(rate_hz_per_s)
    band = half_bandwidth(ring)
    modes = RetainedModes.of(ring, 2.0 * np.pi * max(first, last))
    steps = modes.steps(2.0 * np.pi * min(first, last), 1.0)

    def at(hertz: float) -> RingIntegrator:
        """With the same modes and steps at all frequencies."""
        return RingIntegrator(ring, 2.0 * np.pi * hertz, ring.blades(0), steps, modes)

    if displacement is None:
        state = at(first).march(at(first).at_rest(), _settling(first, band)).final
    else:
        state = at(first).on_wave(displacement)
    here, time = first, 0.0
    times: list[NDArray[np.floating[Any]]] = []
    heights: list[Array] = []
    places: list[Array] = []
    while (last - here) * rate > 0.0:
        periods = _periods(here, abs(rate), band)
        integrator = at(here + 0.5 * rate * periods / here)
        if (here - first) / (last - first) * PLACES >= len(places):
            states, _ = integrator.history(state)
            places.append(np.array([here, *np.mean([contact_shares(ring, each) for each in states], axis=0)]))
        record = integrator.march(state, periods)
        state = record.final
        observe(time, integrator.omega, record.output_m)
        times.append(time + (np.arange(periods) + 0.5) * integrator.period)
        heights.append(record.envelope_m.max(axis=1))
        time += periods * integrator.period
        here = first + rate * time
        progress(min((here - first) / (last - first), 1.0))
    middles = np.concatenate(times).astype(np.float64)
    place, opened, slipping = np.transpose(places)
    envelope = np.concatenate(heights)
    return RunUp(rate, middles, first + rate * middles, envelope, place, opened, slipping, ring.blades(0))


def _settling(frequency_hz: float, band: float) -> int:
    """Periods until a free vibration has decayed."""
    return max(int(np.ceil(SETTLED * frequency_hz / (2.0 * np.pi * band))), 1) if band > 0.0 else 1


def _periods(frequency_hz: float, rate: float, band: float) -> int:
    """Periods of a part: as many as change neither the frequency nor the phase much."""
    by_band = BANDS * band * frequency_hz / rate if band > 0.0 else 1.0
    by_phase = frequency_hz * np.sqrt(4.0 * PHASE / (np.pi * rate))
    return int(np.clip(min(by_band, by_phase), 1, MOST_PERIODS))


def contact_shares(ring: Ring, state: RingState) -> Array:
    """Shares of the contacts that are open and that slip, (2,)."""
    contact, nodes = ring.contact, ring.modal.n_contacts
    pair = np.arange(len(state.force)) % (contact.n_contacts // nodes)
    friction, preload = (values.reshape(-1, nodes)[pair] for values in (contact.friction, contact.preload))
    normal = np.maximum(preload - state.force[:, :, 2], 0.0)
    slips = (normal > 0.0) & (np.abs(state.force[:, :, :2]).max(axis=2) >= STUCK * friction * normal)
    return np.array([np.mean(normal <= 0.0), np.mean(slips)])

"""What becomes of a periodic motion in a ring of blades: it stays, or where it goes and how high.

The states at the ends of the periods tell whether a motion repeats itself, whether it has settled, and the growth
rate of a small departure: successive differences obey the linearised map over a period, delta_(p+1) = M delta_p,
whose leading multipliers are found from the few directions that the differences span (dynamic mode decomposition).

References
----------
P. J. Schmid, Dynamic mode decomposition of numerical and experimental data, Journal of Fluid Mechanics 656
(2010) 5-28.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.time_integration.ring import RETENTION, Ring, RingState
from nonlinear.time_integration.ring_integrator import HARMONICS, RingIntegrator, RingRecord, with_more_harmonics

DIFFERENCES = 22  # of successive states that an estimate rests on
SMALLEST_DIRECTION = 1e-3  # singular value, relative to the largest, of a direction that counts
MOST_DIRECTIONS = 8
SHARE = 0.05  # of the departure that a multiplier must carry
AGREEMENT = 0.1  # relative difference of two estimates, from the earlier and the later differences
STRAIGHT = 0.02  # largest distance from a straight line, relative to its rise
RESOLUTION = 1e-3  # difference of two exponents times the period that is none


def growth_rate(states: Array, period: float) -> float:
    """Largest growth rate that the states show.

    Shapes: `states` (P, ...).
    """
    flat = states.reshape(len(states), -1)[-DIFFERENCES - 1 :]
    differences = np.diff(flat, axis=0)
    if len(differences) < DIFFERENCES or not np.all(np.linalg.norm(differences, axis=1) > 0.0):
        return float("nan")
    third = DIFFERENCES // 3
    exponents = [_leading_exponent(part) for part in (differences[:-third], differences[third:])]
    change = abs(exponents[1] - exponents[0])
    if change <= max(AGREEMENT * abs(exponents[1]), RESOLUTION):
        return exponents[1] / period
    return _straight_growth(differences) / period


def _straight_growth(differences: Array) -> float:
    """Slope of the logarithm of the size of the differences, where it is a straight line; else NaN."""
    time, size = np.arange(len(differences)), np.log(np.linalg.norm(differences, axis=1))
    slope, start = np.polyfit(time, size, 1)
    off = np.abs(size - start - slope * time).max()
    return float(slope) if off < STRAIGHT * abs(slope) * len(time) else float("nan")


def _leading_exponent(differences: Array) -> float:
    """Largest log(abs(multiplier)) of the map that takes each difference to the next."""
    before, after = differences[:-1].T, differences[1:].T
    directions, sizes, times = np.linalg.svd(before, full_matrices=False)
    rank = min(int(np.count_nonzero(sizes > SMALLEST_DIRECTION * sizes[0])), MOST_DIRECTIONS)
    directions, sizes, times = directions[:, :rank], sizes[:rank], times[:rank]
    reduced = directions.T @ after @ times.T / sizes
    multipliers, vectors = np.linalg.eig(reduced)
    share = np.abs(np.linalg.lstsq(vectors, (directions.T @ after[:, -1]).astype(complex), rcond=None)[0])
    carried = np.abs(multipliers[share >= SHARE * share.max()])
    return float(np.log(max(carried.max(), 1e-300)))


MOST_PERIODS = 8  # after which a motion that repeats itself still counts as periodic
REPEATS = 5e-3  # difference of two states, relative to the vibration, that is none
LOCKED = 0.1  # of the difference of successive periods, that of every second or further one of a subharmonic motion
SAME_AMPLITUDE = 0.01  # relative change of the largest amplitude from window to window in a settled motion
SAME_SCATTER = 0.1  # the same of the scatter
SAME_MEAN = 0.05  # the same of the mean over periods and blades, which shows a slow change that the largest hides
NO_SCATTER = 5e-3  # scatter, relative to the amplitude, that is none


def repeats_after(ends: Array, vibration: float = 0.0) -> int:
    """Number of periods after which a motion repeats itself over the whole window; 0: it does not.

    1 as well where the difference of successive periods is small and decays. Shapes: `ends` (P, ...).
    """
    flat = ends.reshape(len(ends), -1)
    scale = max(float(np.linalg.norm(flat, axis=1).max()), vibration)
    if scale == 0.0:
        return 1
    spreads = list[float]()
    for periods in range(1, min(MOST_PERIODS, len(flat) // 4) + 1):
        apart = (np.linalg.norm(flat[first::periods] - flat[first], axis=1).max() for first in range(periods))
        spreads.append(float(max(apart)))
        if spreads[-1] <= REPEATS * scale:
            return periods if spreads[-1] <= LOCKED * spreads[0] else 1
    return 0


def same_statistics(before: Array, after: Array) -> bool:
    """Whether two windows of a motion have the same largest amplitude and the same scatter.

    Shapes: `before` (P, q), `after` (P, q).
    """
    largest = after.max()
    scatter = [float(window.max() - window.min()) for window in (before, after)]
    same = abs(scatter[1] - scatter[0]) <= SAME_SCATTER * scatter[1] or max(scatter) <= NO_SCATTER * largest
    return bool(abs(largest - before.max()) <= SAME_AMPLITUDE * largest and same)


def same_mean(before: Array, after: Array) -> bool:
    """Whether two windows of a motion have the same mean amplitude.

    Shapes: `before` (P, q), `after` (P, q).
    """
    return bool(abs(after.mean() - before.mean()) <= SAME_MEAN * after.mean())


LEFT = 0.05  # distance from a motion, relative to its vibration, at which a ring has left it
OTHER = 0.25  # the same while the harmonics settle that a periodic motion with few neglects
SAME_RATE = 0.1  # relative difference of two successive growth rates that agree
BACK = 0.2  # of its largest distance, to which a ring that stays has come back
VISIBLE = 0.02  # distance to which a departure is enlarged that would need more than `PATIENCE` periods to it
PATIENCE = 100
FIRST_PERIODS = 2  # after the disturbance, in which what decays fast decays
GROWS = 2e-3  # growth per period above which a departure grows
CHUNK = 12  # periods between two judgements
FLAT = 1.1  # ratio of the largest and the smallest distance in the last windows of a departure that grows no more
FLAT_WINDOWS = 3  # their number
MISSING = 0.5  # growth (of the logarithm) that the growth rate measured before would have made in these windows
CALM = 0.01  # change from period to period, relative to the disturbance, of a motion that has settled
IRREGULAR = 3  # windows of the same largest amplitude and scatter, after which the mean may differ; or joined
SAME_LARGEST = 0.03  # relative change of the largest amplitude of so many windows in an irregular motion
KEEPS = 0.7  # ratio of the largest displacements of two windows of a motion that keeps its height
GROWING_PARTS = 6  # of two windows, from one to the next of which a motion that grows without bound grows
SMALLER = 1e-3  # factor on the disturbance where a ring leaves before its growth rate is measured


@dataclass(frozen=True)
class RingLimits:
    """How far a ring is integrated, and how finely."""

    most_periods: int = 1000  # periods in all
    window: int = 60  # periods of the final window, and of the one before it
    settling: int = 240  # most periods before the disturbance, in which neglected harmonics and sliders settle
    disturbance: float = 1e-4  # size of the disturbance, relative to the vibration
    # harmonics with which the periodic motion is solved again, so that it is the one of the ring
    harmonics: int = HARMONICS
    # highest natural frequency that is integrated, in multiples of the excitation frequency
    retention: float = RETENTION
    finer: float = 1.0  # factor on the number of steps a period
    # amplitude below which a motion of two windows is not followed any further, m; it then counts as not settled
    floor_m: float = 0.0


@dataclass(frozen=True)
class RingMotion:
    """Motion of a ring of blades in time."""

    stays: bool  # whether the ring stays on the periodic motion that it started from
    growth_rate: float  # growth rate of a small departure from it, 1/s; NaN where it was not measured
    # largest abs(x(t)) of the periodic motion that the ring started from, m; NaN from a state or from rest
    started_m: float
    amplitude_m: float  # largest abs(x(t)) of the output in the final window, over all blades, m
    lowest_m: float  # smallest of the largest abs(x) of the periods and blades in the final window, m
    periodic: bool  # whether the motion of the final window repeats itself, every period or after few
    repeats_after: int  # number of periods after which it does; 0: it does not
    # whether the final window agrees with the one before; where not, the motion was still changing at the end
    settled: bool
    n_blades: int  # number q of blades integrated
    nodal_diameter: int  # k of the disturbance
    periods: int  # number of periods integrated
    envelope_m: Array  # (P, q) largest abs(x) of each period and blade, m
    final: RingState  # state at the end
    # number of periods at the end over which the motion kept its height, since it left that of the start: the largest
    # displacements of all windows differ from that of the final one by 30 % at most
    persistence: int
    # whether it grows for ever, fed by a flow: it grew to the end, and was so large there that gaps, preloads and the
    # excitation hardly mattered. `amplitude_m` is what it had grown to
    unbounded: bool = False
    # relative change of `amplitude_m` by the last halving of the step; 0 where the step was not halved
    height_error: float = 0.0
    # half the range of the output of a blade in the last periods, the largest of all blades, m; NaN: not known
    vibration_m: float = float("nan")


def keeps_height_for(envelope: Array, window: int) -> int:
    """Number of periods at the end over which a motion keeps its height.

    Shapes: `envelope` (P, q).
    """
    periods = len(envelope) // window * window
    largest = envelope[len(envelope) - periods :].reshape(-1, window * envelope.shape[1]).max(axis=1)[::-1]
    kept = np.minimum(largest, largest[:1]) >= KEEPS * np.maximum(largest, largest[:1])
    return window * int(np.argmin(np.append(kept, False)))


class _March:
    """A ring as it is integrated: its state, envelope and the states at the ends of its periods."""

    def __init__(self, integrator: RingIntegrator, state: RingState) -> None:
        self.integrator, self.state = integrator, state
        self.envelopes: list[Array] = []
        self.ends: list[Array] = []
        self.vibration_m = float("nan")

    @property
    def periods(self) -> int:
        return sum(map(len, self.envelopes))

    @property
    def envelope(self) -> Array:
        return np.concatenate(self.envelopes)

    def go(self, periods: int) -> RingRecord:
        """Integrate further."""
        record = self.integrator.march(self.state, periods)
        self.state = record.final
        self.envelopes.append(record.envelope_m)
        self.ends.append(record.ends)
        self.vibration_m = record.vibration_m
        return record

    def last_ends(self, periods: int) -> Array:
        """States at the ends of the last periods."""
        return np.concatenate(self.ends)[-periods:]

    def grows_without_bound(self, window: int) -> bool:
        """Whether it grew all through the last two windows, and is beyond what contacts can hold."""
        return grows_without_bound(self.integrator, self.state, self.envelope, window)


def integrate_ring(
    ring: Ring,
    omega: float,
    start: Array | RingState | None,
    *,
    nodal_diameter: int = 0,
    limits: RingLimits | None = None,
) -> RingMotion:
    """Integrate the smallest ring that carries the wave and a perturbation, and judge its motion.

    From a periodic motion: some periods for the neglected harmonics to settle, then a small disturbance in the
    pattern of the nodal diameter, with a tenth of it different on every blade. The integration ends when the ring
    has come back to the motion. A ring that leaves is followed until its new motion has settled.

    `start` (2H+1, n_c, 3): real Fourier coefficients of the relative displacement of a periodic solution, m; or a
    state; None: from rest. From a state or from rest there is no motion to stay on: `stays` is False.
    """
    limits = limits or RingLimits()
    integrator = RingIntegrator.of(
        ring, omega, nodal_diameter=nodal_diameter, retention=limits.retention, finer=limits.finer
    )
    state, wave = _start(integrator, start, limits)
    march, rate, stays, amplitude = _March(integrator, state), float("nan"), False, float("nan")
    if wave is not None:
        amplitude = float(np.abs(integrator.wave_output(wave)).max())
        stays, rate = _stays(march, wave, nodal_diameter, limits)
    left, settled = (0, True) if stays else (march.periods, _settle(march, limits))
    return RingMotion(
        stays=stays,
        growth_rate=rate,
        started_m=amplitude,
        settled=settled,
        n_blades=integrator.n_blades,
        nodal_diameter=nodal_diameter,
        periods=march.periods,
        final=march.state,
        **_final_window(march, stays, limits, left),
    )


def _final_window(march: _March, stays: bool, limits: RingLimits, left: int) -> dict[str, Any]:
    """What `RingMotion` tells about the final window, those before since the ring has left, and the envelope."""
    window, envelope = min(limits.window, march.periods), march.envelope
    vibration = march.integrator.vibration(march.state)
    repeats = 1 if stays else repeats_after(march.last_ends(window), vibration)
    return {
        "amplitude_m": float(envelope[-window:].max()),
        "lowest_m": float(envelope[-window:].min()),
        "periodic": repeats > 0,
        "repeats_after": repeats,
        "envelope_m": envelope,
        "vibration_m": march.vibration_m,
        "persistence": keeps_height_for(envelope[left:], min(limits.window, march.periods - left)),
        "unbounded": not stays and march.grows_without_bound(limits.window),
    }


def _start(
    integrator: RingIntegrator, start: Array | RingState | None, limits: RingLimits
) -> tuple[RingState, Array | None]:
    """State to start from, and the periodic motion with more harmonics if there is one."""
    if isinstance(start, RingState):
        return start.repeated(integrator.n_blades), None
    if start is None:
        return integrator.at_rest(), None
    wave = with_more_harmonics(integrator.ring, integrator.omega, start, limits.harmonics)
    return integrator.on_wave(wave), wave


def _stays(march: _March, displacement: Array, nodal_diameter: int, limits: RingLimits) -> tuple[bool, float]:
    """Whether a ring stays on a periodic motion, and the growth rate of a small departure from it.

    A ring that leaves before that is measured is disturbed by less, unless the departure is to be visible.
    """
    settled, rate = _settle_wave(march, displacement, limits)
    home = march.state
    scale = march.integrator.vibration(home)
    if settled is None:
        march.state = march.integrator.disturbed(home, nodal_diameter, limits.disturbance * scale)
        return False, rate
    sizes = limits.disturbance, limits.disturbance * SMALLER
    for size in sizes[:1] if limits.disturbance >= VISIBLE else sizes:
        march.state = march.integrator.disturbed(home, nodal_diameter, size * scale)
        stays, found = _depart(march, home, settled, limits)
        if stays or found > 0.0:
            return stays, found
    return False, float("nan")


def _settle_wave(march: _March, displacement: Array, limits: RingLimits) -> tuple[Array | None, float]:
    """Let the neglected harmonics settle, on the smallest ring that carries the wave.

    Returns the output (n, q) of the last period; None where the ring has left the motion. And the growth rate.
    """
    whole, blades = march.integrator, march.integrator.ring.wave_blades
    small = replace(whole, n_blades=blades)
    wave = small.wave_output(displacement)
    vibration = 0.5 * float(np.ptp(wave))
    alone, rate = _March(small, small.on_wave(displacement)), float("nan")
    far = LEFT if len(displacement) > 2 * limits.harmonics else OTHER
    left, before = False, float("nan")
    while alone.periods < limits.settling and not left:
        output = alone.go(CHUNK).output_m[-1]
        ends = alone.last_ends(DIFFERENCES + 1)
        found = growth_rate(ends, small.period)
        if found * small.period > GROWS and abs(found - before) < SAME_RATE * found:
            rate = found
        before = found
        left = bool(np.abs(output - wave).max() > far * vibration)
        change = float(np.linalg.norm(ends[-1] - ends[-2]) / max(float(np.linalg.norm(ends[-1])), 1e-300))
        if change < CALM * limits.disturbance:
            break
    times = whole.n_blades // blades
    output = np.tile(output, times)
    march.state = alone.state.repeated(whole.n_blades)
    march.envelopes = [np.tile(envelope, times) for envelope in alone.envelopes]
    march.ends = [np.tile(ends, (1, times, 1)) for ends in alone.ends]
    return None if left else output, rate


def _depart(march: _March, home: RingState, reference: Array, limits: RingLimits) -> tuple[bool, float]:
    """Whether a disturbed ring comes back to the output `reference` (n, q) of `home`, and the growth rate."""
    vibration = 0.5 * float(np.ptp(reference)) or 1.0
    march.go(FIRST_PERIODS)
    first, rate, largest, change = march.periods, float("nan"), 0.0, 0.0
    grows = enlarged = False
    distances: list[float] = []
    fastest = 0.0
    while march.periods < limits.most_periods:
        record = march.go(CHUNK)
        distance = np.abs(record.output_m - reference).max(axis=(1, 2)) / vibration
        distances += distance.tolist()
        if distance.max() > LEFT or _grows_no_more(distances, fastest * march.integrator.period, limits.window):
            return False, rate
        changes = np.linalg.norm(np.diff(record.ends, axis=0), axis=(1, 2))
        largest, change = max(largest, float(distance[0])), max(change, float(changes[0]))
        found = growth_rate(march.last_ends(march.periods - first), march.integrator.period)
        if np.isfinite(found) and not enlarged:  # the last one: with time the fastest of many patterns prevails
            rate, grows = found, found * march.integrator.period > GROWS
            fastest = max(fastest, found)
        if found < 0.0 and (distance[-1] < BACK * largest or changes[-1] < BACK**2 * change):
            return True, rate
        slow = rate * march.integrator.period * PATIENCE < math.log(VISIBLE / max(float(distance[-1]), 1e-300))
        if grows and slow and not enlarged:
            march.state, enlarged = _enlarged(home, march.state, VISIBLE / float(distance[-1])), True
            first, distances = march.periods, []
    return not grows, rate


def _grows_no_more(distances: list[float], rate: float, window: int) -> bool:
    """Whether a departure that grew at a rate (per period) has become another motion, close to the first one.

    `distances`: of the periods from the first motion.
    """
    if len(distances) < FLAT_WINDOWS * window or rate * window * (FLAT_WINDOWS - 1) < MISSING:
        return False
    largest = np.reshape(distances[-FLAT_WINDOWS * window :], (FLAT_WINDOWS, window)).max(axis=1)
    return bool(largest.max() <= FLAT * largest.min())


def _enlarged(home: RingState, state: RingState, factor: float) -> RingState:
    """A state farther from `home` in the same direction."""
    parts = {}
    for name in ("coordinates", "rates", "slider", "force"):
        origin = getattr(home, name)
        parts[name] = origin + factor * (getattr(state, name) - origin)
    return replace(state, **parts)


def grows_without_bound(integrator: RingIntegrator, state: RingState, envelope: Array, window: int) -> bool:
    """Whether a motion in a flow grew all through the last two windows, and is beyond what contacts can hold.

    Shapes: `envelope` (P, q), m.
    """
    if not integrator.ring.modal.influence or len(envelope) < 2 * window:
        return False
    parts = np.array_split(envelope[-2 * window :], GROWING_PARTS)
    largest = np.array([part.max() for part in parts])
    rises = largest[1:] > (1.0 + GROWS * len(parts[0])) * largest[:-1]
    return bool(rises.all()) and integrator.is_beyond_contacts(state, float(largest[-1]))


def _settle(march: _March, limits: RingLimits) -> bool:
    """Follow a ring until a window of its motion agrees with the one before; False: the periods did not suffice.

    A mean that still changes tells of a motion that relaxes; where it goes on changing the motion is irregular. So is
    one whose largest amplitude differs from window to window: it has settled where that of several windows does not.
    """
    march.go(limits.window)
    agreed, in_flow = 0, bool(march.integrator.ring.modal.influence)
    while march.periods + limits.window <= limits.most_periods:
        march.go(limits.window)
        before, after = march.envelope[-2 * limits.window :].reshape(2, limits.window, -1)
        same = same_statistics(before, after)
        agreed += same
        if same and (same_mean(before, after) or agreed >= IRREGULAR):
            return True
        fed = in_flow and after.max() > before.max()  # it may grow to any height
        if max(before.max(), after.max()) < limits.floor_m and not fed:
            return False
        if in_flow and march.grows_without_bound(limits.window):
            return False
    several = IRREGULAR * limits.window
    if march.periods < 2 * several:
        return False
    before, after = march.envelope[-2 * several :].reshape(2, several, -1)
    return same_mean(before, after) and abs(after.max() / before.max() - 1.0) <= SAME_LARGEST

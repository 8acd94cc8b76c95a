"""Measured peaks and points of response curves, computed at any values of parameters of contact, load and damping.

A measured peak is compared with the highest peak that persists, a measured point of a curve with the highest
solution at its frequency that does. Either is found on a response that is solved, and carried over the parameters by
Newton's method, in steps that are halved where it fails.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from nonlinear.contact.fourier import largest_lengths
from nonlinear.contact.parameters import Array, ContactError
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import output_amplitude
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.options import Measure, OptionsError
from nonlinear.peak_curves.parameter_family import ParameterFamily
from nonlinear.peak_curves.peak_curve import carried_along, stationary_near
from nonlinear.peak_curves.peak_search import stored_point
from nonlinear.response_curve import ResponseCurve

VIBRATION: Measure = 0.0  # what is measured: the largest displacement about the mean
APART = 0.05  # relative difference of the frequencies of peaks of different modes
NEAR = 0.15  # relative difference of the frequencies of a measured peak and that of the same mode


@dataclass(frozen=True)
class Measured:
    """A measured peak, or a measured point of a response curve."""

    output: str  # what was measured
    amplitude: float  # of the vibration, m
    frequency_hz: float
    amplitude_deviation: float  # standard deviation relative to the amplitude
    frequency_deviation: float  # of a peak, Hz
    is_peak: bool = True
    rate_hz_per_s: float = 0.0  # of the sweep that has the peak; 0: steady
    # of a peak that a sweep of the frequency has, over those of the steady response: amplitude, and difference, Hz
    sweep_factor: float = 1.0
    sweep_shift_hz: float = 0.0

    @property
    def residuals(self) -> int:
        """Numbers that are compared: amplitude, and frequency of a peak."""
        return 2 if self.is_peak else 1

    def misfit(self, amplitude: float, frequency_hz: float) -> list[float]:
        """Differences of a computed motion in standard deviations."""
        ratio = amplitude * self.sweep_factor / self.amplitude
        found = [float(np.log(ratio)) / self.amplitude_deviation]
        if self.is_peak:
            found.append((frequency_hz + self.sweep_shift_hz - self.frequency_hz) / self.frequency_deviation)
        return found


@dataclass(frozen=True)
class Computed:
    """The motion of the model that stands for a measured one."""

    amplitude: float  # m
    frequency_hz: float
    point: SolutionPoint


def highest_motion(
    measured: Measured, curve: ResponseCurve, continuation: Continuation, mode: tuple[int, int] = (0, 1)
) -> Computed | None:
    """The motion on a solved response that a measured one is compared with; None where there is none.

    `mode`: which of how many peaks of the response it is, in the order of their frequencies.
    """
    branches = (curve, *curve.detached)
    if measured.is_peak:
        places = [
            (float(vibration(branch, measured.output)[peak.index]), branch, peak.index)
            for branch in branches
            for peak in branch.peaks
            if peak.located and bool(branch.stable[peak.index])
        ]
    else:
        places = [place for branch in branches for place in _at_frequency(branch, measured)]
    wanted: list[Computed] = []
    alone = measured.is_peak and mode[1] == 1

    def rank(place: tuple[float, ResponseCurve, int]) -> tuple[bool, float]:
        """A single peak is that of the mode near it, where there is one; then the highest counts."""
        near = abs(place[1].frequency_hz[place[2]] / measured.frequency_hz - 1.0) <= NEAR
        return alone and not near, -place[0]

    for _, branch, index in sorted(places, key=rank):
        motion = solved_motion(measured, continuation, stored_point(continuation, branch, index))
        if motion is not None:
            wanted.append(motion)
        if len(wanted) == mode[1]:
            return sorted(wanted, key=lambda motion: motion.frequency_hz)[mode[0]]
    return None


def modes_of(measured: Sequence[Measured]) -> list[tuple[int, int]]:
    """Which of how many peaks each motion under the same conditions is.

    Peaks of one output further apart than `APART` are those of several modes, nearer ones the same peak again; those
    of sweeps up, of sweeps down and steady ones each by themselves, as they may lie far apart.
    """
    found = []
    for item in measured:
        same = [other for other in measured if other.is_peak and other.output == item.output]
        peaks = sorted(
            other.frequency_hz for other in same if np.sign(other.rate_hz_per_s) == np.sign(item.rate_hz_per_s)
        )
        starts = [f for k, f in enumerate(peaks) if k == 0 or f > peaks[k - 1] * (1.0 + APART)]
        found.append((sum(f <= item.frequency_hz for f in starts) - 1, len(starts)) if item.is_peak else (0, 1))
    return found


def vibration(branch: ResponseCurve, output: str) -> Array:
    """Largest displacement of an output about its mean at the points of a branch, m."""
    harmonics = branch.outputs[output] if output in branch.outputs else branch.output[:, :, None]
    about = harmonics.copy()
    about[:, 0] = 0.0
    return largest_lengths(about)


def _at_frequency(branch: ResponseCurve, measured: Measured) -> list[tuple[float, ResponseCurve, int]]:
    """Heights and nearest stable points of a branch where it crosses a frequency."""
    f, heights = branch.frequency_hz, vibration(branch, measured.output)
    crossed = np.flatnonzero((f[:-1] - measured.frequency_hz) * (f[1:] - measured.frequency_hz) <= 0.0)
    found = []
    for k in crossed.tolist():
        near = k if abs(f[k] - measured.frequency_hz) <= abs(f[k + 1] - measured.frequency_hz) else k + 1
        if branch.stable[near]:
            found.append((float(heights[near]), branch, near))
    return found


def solved_motion(measured: Measured, continuation: Continuation, start: SolutionPoint) -> Computed | None:
    """The motion near a solution: its peak, or the solution at the frequency; None where it is not found."""
    if measured.is_peak:
        peak = stationary_near(continuation, start, (measured.output, VIBRATION))
        if peak is None or not peak.is_maximum:
            return None
        return Computed(peak.amplitude, float(peak.point.omega) / (2.0 * np.pi), peak.point)
    omega = 2.0 * np.pi * measured.frequency_hz
    point = continuation.solver.solution_at(omega, start.with_balance(continuation.balance).unknown)
    if point is None:
        return None
    return Computed(output_amplitude(point, measured.output, VIBRATION), measured.frequency_hz, point)


@dataclass
class CarriedMotion:
    """One measured motion over a box of parameters, known at some places."""

    box: ParameterFamily
    measured: Measured
    mode: tuple[int, int] = (0, 1)  # which of how many peaks under its conditions
    known: list[tuple[Array, Computed]] = field(default_factory=list)

    def at(self, place: Array) -> Computed | None:
        """The motion at a place, carried from the nearest one where it is known; None where it was lost."""
        if not self.known:
            return None
        start, motion = min(self.known, key=lambda item: float(np.abs(item[0] - place).max()))
        if np.array_equal(start, place):
            return motion
        line = self.box.line(start, place)

        found = carried_along(motion, lambda before, share: self._moved(line, share, before), growth=2.0)
        if found is not None:
            self.known.append((place.copy(), found))
        return found

    def _moved(self, line: ParameterFamily, share: float, before: Computed) -> Computed | None:
        try:
            continuation = line.continuation(share)
            start = before.point.changed(balance=continuation.balance)
            return solved_motion(self.measured, continuation, start)
        except (ContactError, OptionsError):
            return None

    def derivatives(self, place: Array, steps: Array) -> Array | None:
        """Derivatives of log amplitude and frequency over the shares of the ranges, (n, 2); None where lost."""
        base = self.at(place)
        if base is None:
            return None
        rows = []
        for k in range(place.size):
            moved = place.copy()
            moved[k] += steps[k] if place[k] < 0.5 else -steps[k]
            near = self._moved(self.box.line(place, moved), 1.0, base)
            if near is None:
                return None
            step = moved[k] - place[k]
            change = np.log(near.amplitude / base.amplitude), near.frequency_hz - base.frequency_hz
            rows.append([change[0] / step, change[1] / step])
        return np.array(rows)


def misfits(measured: Sequence[Measured], motions: Sequence[Computed]) -> Array:
    """All differences in standard deviations, (m,)."""
    pairs = zip(measured, motions, strict=True)
    return np.array([value for item, motion in pairs for value in item.misfit(motion.amplitude, motion.frequency_hz)])

"""Peaks as functions of several parameters: carried along straight lines, with gradients by the adjoint."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.peak_curves.parameter_family import LineFamily, Problem, with_parameters
from nonlinear.peak_curves.peak_curve import PeakContinuation, PeakPoint
from nonlinear.peak_curves.peak_sensitivity import peak_derivatives

SMALLEST_SHARE = 1.0 / 64.0  # of a line, by which a peak is carried at least
LARGEST_CHANGE = 0.3  # relative change of the amplitude in one step of that way, beyond which it may be another peak
SAME_PLACE = 1e-12


@dataclass(frozen=True)
class Box:
    """Ranges of several parameters; places in it are shares of the ranges, (n,) from 0 to 1."""

    problem: Problem  # modes, contact, excitation and options with a fixed number of harmonics
    names: tuple[str, ...]  # the parameters, see `with_parameter`
    low: Array  # (n,), their ranges, SI units
    high: Array  # (n,), their ranges, SI units

    def values(self, place: Array) -> Array:
        """The parameters at a place, SI units."""
        return np.asarray(self.low + place * (self.high - self.low))

    def at(self, place: Array) -> Problem:
        """The problem at a place."""
        return with_parameters(self.problem, self.names, self.values(place).tolist())

    def derivatives(self, place: Array, peak: PeakPoint) -> dict[str, float]:
        """Derivatives of a peak at a place with respect to the parameters, m per unit."""
        found = peak_derivatives(self.at(place), peak.point, self.names)
        factors = dict(zip(self.names, self.values(place).tolist(), strict=True))
        # the derivative with respect to the damping is that by a factor on the damping at the place
        units = {name: factors[name] if name == "damping" else 1.0 for name in self.names}
        return {name: found.get(name, 0.0) / units[name] for name in self.names}

    def line(self, first: Array, last: Array) -> LineFamily:
        """The problems between two places."""
        ends = (tuple(float(value) for value in self.values(place)) for place in (first, last))
        return LineFamily(self.problem, self.names, *ends)


@dataclass
class CarriedPeak:
    """One peak over the box, known at some places."""

    box: Box  # the parameters
    origin: str  # branch of the response that it was found on
    known: list[tuple[Array, PeakPoint]] = field(default_factory=list)  # where it was solved for

    def at(self, place: Array) -> PeakPoint | None:
        """The peak at a place, carried from the nearest one where it is known; None where it was lost on the way."""
        start, peak = min(self.known, key=lambda item: float(np.abs(item[0] - place).max()))
        if np.abs(start - place).max() < SAME_PLACE:
            return peak
        follower = PeakContinuation(self.box.line(start, place))
        share, step = 0.0, 1.0
        while share < 1.0:
            ahead = min(share + step, 1.0)
            found = follower.moved(peak, ahead)
            same = found is not None and found.is_maximum
            if found is None or not same or abs(found.amplitude / peak.amplitude - 1.0) > LARGEST_CHANGE:
                step *= 0.5
                if step < SMALLEST_SHARE:
                    return None
                continue
            share, peak = ahead, found
        self.known.append((place.copy(), peak))
        return peak

    def gradient(self, place: Array) -> Array:
        """Derivatives of the amplitude with respect to the place, m, (n,); zero where the peak was lost."""
        peak = self.at(place)
        if peak is None:
            return np.zeros(place.size)
        found = self.box.derivatives(place, peak)
        return np.array([found[name] for name in self.box.names]) * (self.box.high - self.box.low)

    def amplitude(self, place: Array) -> float:
        """Amplitude at a place, m; 0 where the peak was lost."""
        peak = self.at(place)
        return 0.0 if peak is None else peak.amplitude


def lowest_of_peaks(peaks: list[CarriedPeak], centre: Array, radius: float) -> tuple[Array, float]:
    """The place in a cube at which the highest of some peaks is lowest, and its height, m.

    Minimise t with A_k(place) <= t for all peaks, by sequential quadratic programming (SLSQP).
    Shapes: `centre` (n,).
    """
    from scipy.optimize import minimize

    unit = max(peak.amplitude(centre) for peak in peaks)

    def room(x: Array) -> Array:
        return np.array([x[-1] - peak.amplitude(x[:-1]) / unit for peak in peaks])

    def room_slopes(x: Array) -> Array:
        return np.array([np.append(-peak.gradient(x[:-1]) / unit, 1.0) for peak in peaks])

    slope = np.append(np.zeros(centre.size), 1.0)
    bounds = [(max(0.0, c - radius), min(1.0, c + radius)) for c in centre]
    found = minimize(
        lambda x: float(x[-1]),
        np.append(centre, 1.0),
        jac=lambda x: slope,
        bounds=[*bounds, (0.0, 10.0)],
        constraints={"type": "ineq", "fun": room, "jac": room_slopes},
        method="SLSQP",
        options={"ftol": 1e-12, "maxiter": 40},
    )
    place = np.clip(found.x[:-1], [low for low, _ in bounds], [high for _, high in bounds])
    return place, max(peak.amplitude(place) for peak in peaks)


def multipliers(gradients: Array, low_end: Array, high_end: Array) -> Array:
    """Shares of the active peaks in the condition of the optimum, (k,), by non-negative least squares.

    They sum to 1; multipliers of the ends of the ranges balance what the gradients (k, n) leave.
    Shapes: `gradients` (k, n), `low_end` (n,), `high_end` (n,).
    """
    from scipy.optimize import nnls

    count, n = gradients.shape
    scale = np.abs(gradients).max() or 1.0
    columns = [row / scale for row in gradients]
    columns += [-unit for unit, at_end in zip(np.eye(n), low_end, strict=True) if at_end]
    columns += [unit for unit, at_end in zip(np.eye(n), high_end, strict=True) if at_end]
    sums = np.array([1.0] * count + [0.0] * (len(columns) - count))
    matrix = np.vstack([np.array(columns).T, 1e3 * sums])
    found, _ = nnls(matrix, np.append(np.zeros(n), 1e3))
    shares = found[:count]
    return np.asarray(shares / shares.sum()) if shares.sum() > 0.0 else np.full(count, 1.0 / count)

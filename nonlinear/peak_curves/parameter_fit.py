"""Parameters of contact, load and damping from measured motions, by least squares, with what the data tell of them.

The sum of squares of all differences in standard deviations is made least by the Gauss-Newton method in a trust
region (`scipy.optimize.least_squares`), from several starts. Places are the unit cube: shares of the ranges, of their
logarithms where a range spans more than a factor of `WIDE`. Before the data every place is as likely as any other; at
the best place the posterior is normal (Laplace's method),

    C = (J^T J + 12 I)^-1,

12 the inverse of the variance over a range, so that of what the data do not tell the range remains.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.parameters import Array
from nonlinear.peak_curves.measured_motion import CarriedMotion, Computed, Measured, highest_motion, misfits, modes_of
from nonlinear.peak_curves.parameter_family import ParameterFamily
from nonlinear.peak_curves.peak_search import quasi_random
from nonlinear.problem import Problem
from nonlinear.response_curve import ResponseCurve

WIDE = 4.0  # ratio of the ends of a range, above 0, from which on its logarithm counts
PRIOR = 12.0  # inverse variance of a share that may be anywhere
TOLERANCE = 1e-5  # of a step, in shares
STEP = 1e-4  # of derivatives, in shares
LOST = 1e3  # standard deviations in place of a motion that was not found
MOST_EVALUATIONS = 60  # of a fit
SAME_PLACE = 0.02  # in shares

Solve = Callable[[Array], Sequence[ResponseCurve | None]]  # the response of each condition at a place


@dataclass(frozen=True)
class Ranges:
    """The parameters with their ranges, in the units of the solver."""

    names: tuple[str, ...]
    low: Array  # (n,)
    high: Array  # (n,)

    @property
    def logarithmic(self) -> NDArray[np.bool_]:
        """Which ranges count by their logarithms, (n,)."""
        return (self.low > 0.0) & (self.high > WIDE * self.low)

    def values(self, place: Array) -> Array:
        """Values (n,) at a place, or (k, n) at places."""
        safe = np.where(self.logarithmic, self.low, 1.0), np.where(self.logarithmic, self.high, 1.0)
        straight = self.low + place * (self.high - self.low)
        return np.where(self.logarithmic, safe[0] * (safe[1] / safe[0]) ** place, straight)

    def place(self, values: Array) -> Array:
        """The place of values within the ranges, (n,)."""
        inside = np.clip(values, self.low, self.high)
        with np.errstate(divide="ignore", invalid="ignore"):
            bent = np.log(inside / self.low) / np.log(self.high / self.low)
        return np.where(self.logarithmic, bent, (inside - self.low) / (self.high - self.low))

    def share(self, place: Array) -> Array:
        """The place in a box that is straight in the values."""
        return (self.values(place) - self.low) / (self.high - self.low)

    def slopes(self, place: Array) -> Array:
        """Derivatives of the values with respect to the place, (n,)."""
        bent = self.values(place) * np.log(np.where(self.logarithmic, self.high / np.maximum(self.low, 1e-300), 1.0))
        return np.where(self.logarithmic, bent, self.high - self.low)


@dataclass(frozen=True)
class Fit:
    """A place where the sum of squares is least."""

    place: Array  # (n,)
    motions: tuple[Computed, ...]  # one for each measured motion
    residuals: Array  # (m,), in standard deviations
    jacobian: Array  # (m, n), over the place

    @property
    def misfit(self) -> float:
        """Sum of the squares."""
        return float(self.residuals @ self.residuals)

    def covariance(self, factor: float = 1.0) -> Array:
        """Of the posterior of the place, (n, n), with all standard deviations times a factor."""
        information = self.jacobian.T @ self.jacobian / factor**2
        return np.asarray(np.linalg.inv(information + PRIOR * np.eye(len(self.place))))


@dataclass
class ParameterFit:
    """Measured motions under some conditions, and the motions of the model that stand for them."""

    ranges: Ranges
    problems: Sequence[Problem]  # of each condition
    measured: Sequence[tuple[Measured, ...]]  # under each condition
    solver: Solve
    motions: list[list[CarriedMotion]] = field(default_factory=list)

    @property
    def all_measured(self) -> list[Measured]:
        """The measured motions of all conditions in one list."""
        return [item for items in self.measured for item in items]

    def start(self, place: Array, curves: Sequence[ResponseCurve | None]) -> bool:
        """Take the motions from solved responses at a place; whether all are there."""
        if any(curve is None or not curve.points for curve in curves):
            return False
        known = [curve for curve in curves if curve is not None]
        if not self.motions:
            self._begin(known)
        share, complete = self.ranges.share(place), True
        for row, curve in zip(self.motions, known, strict=True):
            continuation = row[0].box.continuation(share)
            for motion in row:
                solved = highest_motion(motion.measured, curve, continuation, motion.mode)
                complete &= solved is not None
                if solved is not None:
                    motion.known.append((share.copy(), solved))
        return complete

    def _begin(self, curves: Sequence[ResponseCurve]) -> None:
        ends = tuple(self.ranges.low.tolist()), tuple(self.ranges.high.tolist())
        for problem, items, curve in zip(self.problems, self.measured, curves, strict=True):
            harmonics = max(branch.harmonics for branch in (curve, *curve.detached))
            box = ParameterFamily(problem.with_harmonics(harmonics), self.ranges.names, *ends)
            modes = modes_of(items)
            self.motions.append([CarriedMotion(box, *pair) for pair in zip(items, modes, strict=True)])

    def at(self, place: Array) -> list[Computed] | None:
        """The motions at a place; where one is lost on the way, from responses that are solved there."""
        share = self.ranges.share(place)
        motions = [motion.at(share) for row in self.motions for motion in row]
        if any(motion is None for motion in motions):
            self.start(place, self.solver(place))
            motions = [motion.at(share) for row in self.motions for motion in row]
        found = [motion for motion in motions if motion is not None]
        return found if len(found) == len(motions) else None

    def jacobian(self, place: Array) -> Array:
        """Derivatives of the residuals over the place, (m, n); 0 where a motion was lost."""
        share, slopes = self.ranges.share(place), self.ranges.slopes(place) / (self.ranges.high - self.ranges.low)
        rows = []
        for motion in (motion for row in self.motions for motion in row):
            found = motion.derivatives(share, STEP * slopes)
            change = np.zeros((place.size, 2)) if found is None else found * slopes[:, None]
            rows.append(change[:, 0] / motion.measured.amplitude_deviation)
            if motion.measured.is_peak:
                rows.append(change[:, 1] / motion.measured.frequency_deviation)
        return np.array(rows)

    def score(self, place: Array) -> float:
        """How badly a place fits where all motions are known; single bad motions count little."""
        motions = self.at(place)
        if motions is None:
            return float("inf")
        return float(np.log1p(misfits(self.all_measured, motions) ** 2).sum())

    def amplitude_ratio(self, place: Array) -> float:
        """Geometric mean of computed over measured amplitudes at a place."""
        motions = self.at(place) or []
        ratios = [motion.amplitude / item.amplitude for item, motion in zip(self.all_measured, motions, strict=True)]
        return float(np.exp(np.mean(np.log(ratios))))

    def fit(self, place: Array) -> Fit | None:
        """The place of the least sum of squares near another one; None where not all motions are known there."""
        from scipy.optimize import least_squares

        measured = self.all_measured
        lost = np.full(sum(item.residuals for item in measured), LOST)

        def residuals(x: Array) -> Array:
            motions = self.at(x)
            return lost if motions is None else misfits(measured, motions)

        if self.at(place) is None:
            return None
        inside = np.clip(place, 1e-6, 1.0 - 1e-6)
        solution = least_squares(
            residuals, inside, self.jacobian, (0.0, 1.0), xtol=TOLERANCE, ftol=1e-6, max_nfev=MOST_EVALUATIONS
        )
        return self.fit_at(np.asarray(solution.x))

    def fit_at(self, place: Array) -> Fit | None:
        """The misfit at a place; None where a motion is not found."""
        motions = self.at(place)
        if motions is None:
            return None
        return Fit(place, tuple(motions), misfits(self.all_measured, motions), self.jacobian(place))

    def with_measured(self, measured: Sequence[tuple[Measured, ...]]) -> ParameterFit:
        """The same motions beside other measured numbers."""
        rows = [
            [replace(motion, measured=item) for motion, item in zip(row, items, strict=True)]
            for row, items in zip(self.motions, measured, strict=True)
        ]
        return replace(self, measured=measured, motions=rows)


def starting_places(own: Array, count: int) -> list[Array]:
    """Places from which fits start: the scene's own, and others spread evenly."""
    return [own, *quasi_random(own.size, count - 1)][:count]


def distinct(fits: Sequence[Fit]) -> list[Fit]:
    """The fits at different places, the best one first."""
    kept: list[Fit] = []
    for fit in sorted(fits, key=lambda fit: fit.misfit):
        if all(np.abs(fit.place - other.place).max() > SAME_PLACE for other in kept):
            kept.append(fit)
    return kept

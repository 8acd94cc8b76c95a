"""The motion of an operating point, followed while its interference wears off.

A peak is carried to another interference in the plane normal to the response curve and made stationary there again;
a motion at a given frequency is corrected at that frequency. Where a motion cannot be followed (a fold), the response
is traced again, but without time integration.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from nonlinear.branches.parameter_continuation import Homotopy, carry_solution
from nonlinear.contact.fourier import to_complex
from nonlinear.contact.parameters import SLIP, Array
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import friction_work, output_amplitude
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.options import OptionsError
from nonlinear.peak_curves.peak_curve import Stationary, stationary_near
from nonlinear.peak_curves.peak_search import stored_point
from nonlinear.problem import Problem
from nonlinear.response_curve import ResponseCurve
from nonlinear.response_solver import build_harmonic_balance, forced_response


@dataclass(frozen=True)
class OperatingPoint:
    """An operating point of a duty.

    Attributes
    ----------
    problem : tuple
        Modes, contact with the interference before any wear, excitation and options, as for `forced_response`.
    share : float
        Share of the time, relative to the sum of all shares.
    frequency_hz : float or None
        Excitation frequency, Hz. None: that of the followed peak.
    curve : ResponseCurve or None
        Its response before any wear, where it is known.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import OperatingPoint
    >>> OperatingPoint((modal, contact, excitation, options), curve=curve).share
    1.0
    """

    problem: Problem
    share: float = 1.0
    frequency_hz: float | None = None
    curve: ResponseCurve | None = None

    def __post_init__(self) -> None:
        """Check the share and the method."""
        object.__setattr__(self, "problem", Problem(*self.problem))
        if not 0.0 <= self.share < float("inf"):
            raise OptionsError(f"share: {self.share!r}, allowed: 0 or more")
        if self.problem.options.method != "coupled":
            raise OptionsError(f'method: {self.problem.options.method!r}, allowed with wear: "coupled"')
        low, high = self.problem.options.frequency_hz
        if self.frequency_hz is not None and not low <= self.frequency_hz <= high:
            raise OptionsError(f"frequency_hz: {self.frequency_hz!r}, allowed: {low:g} to {high:g}, the range")


@dataclass(frozen=True)
class WornMotion:
    """A motion at some state of wear."""

    point: SolutionPoint  # the solution
    amplitude: float  # amplitude of the output, m

    @property
    def frequency_hz(self) -> float:
        """Excitation frequency, Hz."""
        return float(self.point.omega / (2.0 * np.pi))

    @cached_property
    def work(self) -> Array:
        """Friction work of each node per cycle, (n_c,), J."""
        real = self.point.displacement, self.point.contact.force
        displacement, force = (to_complex(each.reshape(len(each), -1)) for each in real)
        shape = len(force), -1, 3
        found = friction_work(displacement.reshape(shape), force.reshape(shape))
        return np.where(self.state >= SLIP, np.maximum(found, 0.0), 0.0)  # round-off would wear a face that sticks

    @property
    def state(self) -> NDArray[np.int64]:
        """Worst state of each node in the cycle, (n_c,): STICK, SLIP or LIFT_OFF."""
        return self.point.contact.state

    def load(self, preload: Array) -> Array:
        """Mean normal load of each node over the cycle, (n_c,), N."""
        return np.asarray(preload - self.point.contact.force[0, :, 2])


class MotionLostError(ArithmeticError):
    """A motion cannot be followed to an interference; the message says which.

    Examples
    --------
    >>> from nonlinear import MotionLostError
    >>> issubclass(MotionLostError, ArithmeticError)
    True
    """


class RangeLeftError(MotionLostError):
    """The followed peak leaves the frequency range: what the range still holds is another, lower peak."""


AT_END = 1e-3  # relative distance from an end of the range, within which a peak that is lost has left it


@dataclass
class MotionFollower:
    """Follows the motion of an operating point over the interference."""

    at: OperatingPoint  # the operating point, with the interference before any wear
    # number of harmonics of `at`, fixed
    problem: Problem = field(init=False)
    traces: int = field(default=0, init=False)  # responses that were traced

    def __post_init__(self) -> None:
        self.problem, self.curve = self.at.problem, self.at.curve
        if self.problem.options.harmonics == "auto":
            if self.curve is None:
                self.curve = forced_response(*self.problem)
                self.traces += 1
            self.problem = self.problem.with_harmonics(max(1, self.curve.harmonics))

    def worn(self, depth: Array) -> Problem:
        """The problem with a worn depth (n_c,), m."""
        contact = self.problem.contact
        return self.problem._replace(contact=contact.with_interference(contact.interference - depth))

    def first(self) -> WornMotion:
        """The motion before any wear: the worst motion where it is a solution of a branch, else the highest peak."""
        return self.traced(np.zeros(self.problem.contact.n_contacts), self.curve)

    def traced(self, depth: Array, curve: ResponseCurve | None = None) -> WornMotion:
        """The motion of a response traced anew at a worn depth (n_c,), m: the worst one, else the highest peak."""
        problem = self.worn(depth)
        if curve is None:
            quick = replace(problem.options, search="off", truncation=False, residual_tractions="projected")
            curve, self.traces = forced_response(*problem._replace(options=quick)), self.traces + 1
        continuation = Continuation(build_harmonic_balance(*problem), problem.options, contact=problem.contact)
        if self.at.frequency_hz is None:
            found, said = list(_peaks(continuation, curve)), "peak inside the frequency range"
        else:
            found, said = list(self._at_frequency(continuation, curve)), f"motion at {self.at.frequency_hz:g} Hz"
        if not found:
            raise MotionLostError(f"the response has no {said}")
        return max(found, key=lambda each: (each[0], each[1].amplitude))[1]

    def _at_frequency(self, continuation: Continuation, curve: ResponseCurve) -> Iterator[tuple[bool, WornMotion]]:
        """Solutions of all branches at the frequency, with whether they are stable."""
        assert self.at.frequency_hz is not None
        for branch in (curve, *curve.detached):
            away = branch.frequency_hz - self.at.frequency_hz
            for (k, before), after in pairwise(enumerate(away.tolist())):
                if before * after[1] > 0.0:
                    continue
                near = k if abs(before) < abs(after[1]) else k + 1
                guess = stored_point(continuation, branch, near).unknown
                point = continuation.solver.solution_at(2.0 * np.pi * self.at.frequency_hz, guess)
                if point is not None:
                    yield bool(branch.stable[near]), self._motion(point)

    def _motion(self, point: SolutionPoint) -> WornMotion:
        return WornMotion(point, output_amplitude(point, self.problem.options.output))

    def followed(self, motion: WornMotion, before: Array, depth: Array) -> WornMotion:
        """The motion carried from the worn depth `before` to another one, (n_c,), m."""
        contacts, point = (self.worn(before).contact, self.worn(depth).contact), motion.point
        force = self.problem.excitation.force
        homotopy = Homotopy(point.balance, contacts, (force, force), self.problem.options)
        continuation = Continuation(homotopy.balance(1.0), self.problem.options, contact=contacts[1])
        if self.at.frequency_hz is not None:
            at = continuation.solver.solution_at(point.omega, point.unknown)
            if at is None or at.jacobian_sign != point.jacobian_sign:  # beyond a fold
                raise MotionLostError(f"the motion at {self.at.frequency_hz:g} Hz ends in a fold")
            return self._motion(at)
        carried = carry_solution(homotopy, point.unknown, point.omega, thorough=False, fixed_frequency=False)
        peak = stationary_near(continuation, carried.points[0]) if carried.points else None
        if peak is not None and peak.is_maximum and _inside(peak, self.problem):
            return WornMotion(peak.point, peak.amplitude)
        end = _end_near(point.omega, self.problem)
        if end is not None:
            raise RangeLeftError(
                f"the peak leaves the frequency range at {end / (2.0 * np.pi):.5g} Hz: extend the range"
            )
        raise MotionLostError(f"the peak near {motion.frequency_hz:.5g} Hz could not be followed")


def _inside(peak: Stationary, problem: Problem) -> bool:
    low, high = problem.options.omega_range
    return low <= peak.point.omega <= high


def _end_near(omega: float, problem: Problem) -> float | None:
    """The end of the frequency range that a peak is at, rad/s."""
    return next((end for end in problem.options.omega_range if abs(omega / end - 1.0) < AT_END), None)


def _peaks(continuation: Continuation, curve: ResponseCurve) -> Iterator[tuple[bool, WornMotion]]:
    """Peaks of all branches, with whether they are the worst motion."""
    worst = curve.worst
    for number, branch in enumerate((curve, *curve.detached)):
        places = {peak.index: False for peak in branch.peaks if peak.located}
        if worst is not None and worst.branch == number and not worst.at_end:
            places[worst.index] = True
        for index, is_worst in places.items():
            found = stationary_near(continuation, stored_point(continuation, branch, index))
            if found is not None and found.is_maximum:
                yield is_worst, WornMotion(found.point, found.amplitude)

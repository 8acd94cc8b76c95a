"""The values of two or three parameters at which the worst motion is lowest.

Responses at places spread over the ranges give the first estimate. Around the best one, the highest of its peaks is
minimised by sequential quadratic programming with their derivatives, within a trust region. A response solved at the
result decides: the step is taken if the worst motion there is lower; else the peaks that were not expected join the
others and the region shrinks. Peaks are carried along straight lines, with gradients by the adjoint.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.options import NO_PEAK, OptionsError
from nonlinear.peak_curves.optimum import elasticities, motion_said
from nonlinear.peak_curves.optimum_result import ActivePeak, JointOptimum, SolvedResponse
from nonlinear.peak_curves.parameter_family import ParameterFamily, check_range
from nonlinear.peak_curves.peak_branch import PeakStability
from nonlinear.peak_curves.peak_curve import PeakContinuation, PeakPoint, carried_along
from nonlinear.peak_curves.peak_search import (
    Solve,
    ends_said,
    listed,
    most_harmonics,
    peaks_of,
    quasi_random,
    solve_in_turn,
    solved_response,
    with_enough_harmonics,
)
from nonlinear.peak_curves.peak_sensitivity import peak_derivatives
from nonlinear.peak_curves.worst_envelope import AT_END
from nonlinear.problem import Problem, ProblemTuple
from nonlinear.residual_tractions.extreme_amplitude import minimax
from nonlinear.response_curve import ResponseCurve
from rom.linear_algebra.threads import one_blas_thread

SAME_PLACE = 1e-12
MOST_RESPONSES = 60
SPREAD = {2: 9, 3: 15}  # responses over the ranges, by the number of parameters
FIRST_RADIUS, LEAST_RADIUS = 0.25, 1e-4  # of the trust region, in shares of the ranges
GAIN = 1e-5  # relative reduction of the worst motion that is worth a response
MATTERS = 0.3  # of the worst motion: lower peaks are not carried
ACTIVE = 1e-3  # relative difference from the highest peak up to which a peak is active
FEWEST_RESPONSES = 20
STARTS = 2  # places from which the search descends


def derivatives_at(box: ParameterFamily, place: Array, peak: PeakPoint) -> dict[str, float]:
    """Derivatives of a peak at a place with respect to the parameters, m per unit."""
    found = peak_derivatives(box.at(place), peak.point, box.names)
    # the derivative with respect to the damping is that by a factor on the damping at the place
    units = {
        name: value if name == "damping" else 1.0 for name, value in zip(box.names, box.values(place), strict=True)
    }
    return {name: found.get(name, 0.0) / unit for name, unit in units.items()}


@dataclass
class CarriedPeak:
    """One peak over the box, known at some places."""

    box: ParameterFamily  # the parameters
    origin: str  # branch of the response that it was found on
    known: list[tuple[Array, PeakPoint]] = field(default_factory=list)  # where it was solved for

    def at(self, place: Array) -> PeakPoint | None:
        """The peak at a place, carried from the nearest one where it is known; None where it was lost on the way."""
        start, peak = min(self.known, key=lambda item: float(np.abs(item[0] - place).max()))
        if np.abs(start - place).max() < SAME_PLACE:
            return peak
        follower = PeakContinuation(self.box.line(start, place))

        def moved(before: PeakPoint, share: float) -> PeakPoint | None:
            found = follower.moved(before, share)
            return found if found is not None and found.is_maximum else None

        found = carried_along(peak, moved)
        if found is not None:
            self.known.append((place.copy(), found))
        return found

    def gradient(self, place: Array) -> Array:
        """Derivatives of the amplitude with respect to the place, m, (n,); zero where the peak was lost."""
        peak = self.at(place)
        if peak is None:
            return np.zeros(place.size)
        found = derivatives_at(self.box, place, peak)
        return np.array([found[name] for name in self.box.names]) * self.box.spans

    def amplitude(self, place: Array) -> float:
        """Amplitude at a place, m; 0 where the peak was lost."""
        peak = self.at(place)
        return 0.0 if peak is None else peak.amplitude


def lowest_of_peaks(peaks: list[CarriedPeak], centre: Array, radius: float) -> tuple[Array, float]:
    """The place in a cube at which the highest of some peaks is lowest, and its height, m.

    Shapes: `centre` (n,).
    """
    unit = max(peak.amplitude(centre) for peak in peaks)
    low, high = np.maximum(0.0, centre - radius), np.minimum(1.0, centre + radius)
    place = minimax(
        lambda x: np.array([peak.amplitude(x) / unit for peak in peaks]),
        lambda x: np.array([peak.gradient(x) / unit for peak in peaks]),
        centre,
        list(zip(low.tolist(), high.tolist(), strict=True)),
        1e-12,
        40,
    )
    place = np.clip(place, low, high)
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


@dataclass(frozen=True)
class _Sample:
    """A response at a place, with its peaks that matter."""

    place: Array
    curve: ResponseCurve
    solved: SolvedResponse
    peaks: tuple[CarriedPeak, ...]

    @property
    def height(self) -> float:
        """The worst motion, m; infinite where none is known."""
        return self.solved.height


@dataclass
class _Descent:
    """Responses over the box, as they are added."""

    box: ParameterFamily
    progress: Callable[[str], None]
    solver: Solve
    most: int
    samples: list[_Sample] = field(default_factory=list)

    @property
    def best(self) -> _Sample:
        """The lowest response."""
        return min(self.samples, key=lambda sample: sample.height)

    def solve(self, places: list[Array], reason: str) -> list[_Sample]:
        """Responses at some places, as far as the limit allows."""
        places = places[: max(self.most - len(self.samples), 0)]
        for place in places:
            self.progress(f"response at {listed(self.box.names, self.box.values(place))} ({reason})")
        curves = self.solver([self.box.at(place) for place in places])
        found: list[_Sample] = []
        for place, curve in zip(places, curves, strict=True):
            solved = solved_response(float(len(self.samples) + len(found)), curve, reason, self.box.problem.options)
            found.append(_Sample(place, curve, solved, self._peaks(place, curve, solved)))
        self.samples += found
        return found

    def spread(self) -> None:
        """Responses at the centre, the corners of the inner half, and a quasi-random sequence."""
        n = len(self.box.names)
        places = [np.full(n, 0.5), *(np.array(corner) for corner in product((0.15, 0.85), repeat=n))]
        places += quasi_random(n, SPREAD[n] - len(places))
        self.solve(places, "first")

    def descend(self, start: _Sample) -> None:
        """Lower the worst motion from a response."""
        current, radius = start, FIRST_RADIUS
        extra: list[CarriedPeak] = []
        while radius > LEAST_RADIUS and len(self.samples) < self.most - 1:
            peaks = [*current.peaks, *extra]
            if not peaks:
                return
            place, expected = lowest_of_peaks(peaks, current.place, radius)
            if not expected < current.height * (1.0 - GAIN):
                return
            found = self.solve([place], "search")[0]
            if found.height < current.height * (1.0 - 0.1 * GAIN):
                reached = current.height - found.height > 0.5 * (current.height - expected)
                radius = min(2.0 * radius, 0.5) if reached else radius
                current, extra = found, []
            else:
                radius *= 0.3
                extra += found.peaks

    def _peaks(self, place: Array, curve: ResponseCurve, solved: SolvedResponse) -> tuple[CarriedPeak, ...]:
        """The peaks of a response that persist, or that count as they do; none lower than `MATTERS`."""
        if not np.isfinite(solved.height):
            return ()
        follower = PeakContinuation(self.box.line(place, np.clip(1.0 - place, 0.1, 0.9)))
        stability = PeakStability(follower)

        def matters(height: float, frequency_hz: float) -> bool:
            return MATTERS * solved.bound_m <= height <= 1.001 * solved.bound_m

        found: list[CarriedPeak] = []
        for origin, start in peaks_of(follower, 0.0, curve, matters):
            open_end = bool(solved.unresolved) and start.amplitude > solved.amplitude_m
            if open_end or stability.judged(start).persists:
                found.append(CarriedPeak(self.box, origin, [(place.copy(), start)]))
        return tuple(found)


def find_joint_optimum(
    problem: ProblemTuple,
    ranges: Mapping[str, tuple[float, float]],
    progress: Callable[[str], None] = lambda line: None,
    solver: Solve = solve_in_turn,
    most_responses: int = MOST_RESPONSES,
) -> JointOptimum:
    """The values of two or three parameters at which the worst motion is lowest.

    Parameters
    ----------
    problem : tuple
        Modes, contact, excitation and options, as the arguments of `forced_response`. With harmonics "auto" the
        largest number that is chosen at the centre and at the optimum holds everywhere.
    ranges : mapping of str to (float, float)
        Range of each parameter, SI units; see `find_optimum`.
    progress : callable
        Called with a line on what is done.
    solver : callable
        Takes a list of problems and returns their responses.
    most_responses : int
        Largest number of responses that are solved, 20 or more.

    Returns
    -------
    JointOptimum
        The optimum, a response solved with all options.

    Raises
    ------
    ArithmeticError
        No response has a motion that persists.
    ContactError
        A range holds values that the contact does not allow.
    OptionsError
        There are not two or three parameters, there is no such parameter, or a range is empty.

    Examples
    --------
    With the names of the example of `forced_response`: a stiff slider, with its best preload.

    >>> from nonlinear import find_joint_optimum
    >>> ranges = {"tangential_stiffness": (1.0, 3.0), "preload": (0.5, 4.0)}
    >>> optimum = find_joint_optimum((modal, contact, excitation, options), ranges)
    >>> optimum.at_end, round(optimum.values["preload"], 3)
    ({'tangential_stiffness': 'high', 'preload': ''}, 3.06)
    """
    if len(ranges) not in SPREAD:
        raise OptionsError(f"parameters: {', '.join(ranges) or 'none'}, allowed: two or three")
    if most_responses < FEWEST_RESPONSES:
        raise OptionsError(f"most_responses: {most_responses}, allowed: {FEWEST_RESPONSES} or more")
    for name, (low, high) in ranges.items():
        check_range(problem, name, low, high)
    started = time.perf_counter()
    box = ParameterFamily(Problem(*problem), tuple(ranges), *zip(*ranges.values(), strict=True))
    with one_blas_thread():
        found = _in_box(box, progress, solver, most_responses)
    return replace(found, seconds=max(0.0, time.perf_counter() - started))


def _in_box(box: ParameterFamily, progress: Callable[[str], None], solver: Solve, most: int) -> JointOptimum:
    """The optimum, with a number of harmonics that suffices at the centre and there."""

    def asked_at(place: Array) -> int:
        return most_harmonics(solver([box.at(place)])[0])

    def asked(found: JointOptimum) -> int:
        values = np.array([found.values[name] for name in box.names])
        return asked_at((values - box.first) / box.spans)

    return with_enough_harmonics(
        box.problem,
        lambda: asked_at(np.full(len(box.names), 0.5)),
        lambda fixed: _with_fixed_harmonics(replace(box, problem=fixed), progress, solver, most),
        asked,
        progress,
    )


def _with_fixed_harmonics(
    box: ParameterFamily, progress: Callable[[str], None], solver: Solve, most: int
) -> JointOptimum:
    descent = _Descent(box, progress, solver, most)
    descent.spread()
    if not np.isfinite(descent.best.height):
        message = descent.samples[0].curve.termination.message
        message = NO_PEAK if all(sample.solved.at_end for sample in descent.samples) else message
        raise ArithmeticError(f"no motion that persists is known over {', '.join(box.names)}: {message}")
    for start in sorted(descent.samples, key=lambda sample: sample.height)[:STARTS]:
        descent.descend(start)
    return _described(descent)


def _described(descent: _Descent) -> JointOptimum:
    """The lowest response as plain data."""
    box, best = descent.box, descent.best
    values = dict(zip(box.names, box.values(best.place), strict=True))
    at_end = {
        name: "low" if share <= AT_END else "high" if share >= 1.0 - AT_END else ""
        for name, share in zip(box.names, best.place, strict=True)
    }
    exact = [(peak.known[0][1], peak) for peak in best.peaks]
    active = sorted(
        (p for p in exact if p[0].amplitude >= best.height * (1.0 - ACTIVE)), key=lambda p: -p[0].amplitude
    )
    derivatives = peak_derivatives(box.at(best.place), active[0][0].point) if active else {}
    amplitude = max(best.height, active[0][0].amplitude) if active else best.height
    frequency = active[0][0].frequency_hz if active else best.solved.frequency_hz
    remarks = [
        f"{len(descent.samples)} places searched; a lower place between them may be missed",
        *([] if active else ["the worst motion there is no followed peak: the lowest of single responses"]),
        *([f"at the optimum: {best.solved.unresolved}"] if best.solved.unresolved else []),
        *ends_said([sample.solved for sample in descent.samples]),
        *([f"limit of {descent.most} responses reached"] if len(descent.samples) >= descent.most - 1 else []),
    ]
    return JointOptimum(
        values=values,
        ranges=dict(zip(box.names, zip(box.first, box.last, strict=True), strict=True)),
        at_end=at_end,
        amplitude_m=amplitude,
        frequency_hz=frequency,
        motion="periodic" if active else best.solved.motion,
        peaks=_active(box, best.place, [peak for peak, _ in active], at_end),
        derivatives=derivatives,
        elasticities=elasticities(box.at(best.place), derivatives, amplitude),
        worst=best.curve.worst,
        path=tuple(
            (dict(zip(box.names, box.values(each.place), strict=True)), each.solved.bound_m)
            for each in descent.samples
        ),
        responses=tuple(each.solved for each in descent.samples),
        harmonics=box.problem.options.fixed_harmonics,
        seconds=0.0,
        message=f"{listed(box.names, [*values.values()])}: {motion_said(box.problem.options, amplitude, frequency)}",
        remarks=tuple(remarks),
        objective=box.problem.options.objective,
        truncation_error=best.solved.truncation_error,
    )


def _active(
    box: ParameterFamily, place: Array, peaks: list[PeakPoint], at_end: Mapping[str, str]
) -> tuple[ActivePeak, ...]:
    """The active peaks with their multipliers and gradients."""
    if not peaks:
        return ()
    found = [derivatives_at(box, place, peak) for peak in peaks]
    rows = np.array([[each[name] for name in box.names] for each in found]) * box.spans
    low = np.array([at_end[name] == "low" for name in box.names])
    high = np.array([at_end[name] == "high" for name in box.names])
    shares = multipliers(rows, low, high)
    return tuple(
        ActivePeak(peak.amplitude, peak.frequency_hz, float(share), gradient)
        for peak, share, gradient in zip(peaks, shares, found, strict=True)
    )

"""Bounds of a peak over the residual tractions that friction leaves undetermined."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from nonlinear.branches.branch import Branch
from nonlinear.branches.range_continuation import continue_over_range
from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.parameters import Array, ContactElement, ContactParameters
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import output_amplitude, output_harmonics
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.residual_tractions.extreme_amplitude import (
    TractionElement,
    TractionLevels,
    TractionOrigins,
    TractionSearch,
    TractionState,
    farthest_position,
    free_tractions,
    lowest_of_peaks,
)
from nonlinear.response_curve import ResidualBounds, ResidualExtreme

RANDOM_STARTS = 2
MOST_PEAKS = 3  # local maxima of the curve from which the highest peak is sought
BAND_POINTS = 16
MOST_CURVES = 3  # solved to find the lowest highest peak
_ONE_PEAK = 0.02  # relative difference of frequencies within which two peaks count as one
SAME = 1e-6  # relative difference of two amplitudes that count as one
Begun = tuple[TractionSearch, TractionState]


WIDER = 2.0  # than the admissible places at the start of a search: normal loads change with the tractions


def _without_mean(displacement: Array) -> Array:
    """The displacement (2H+1, n_c, 3) without its mean along the face."""
    vibration = displacement.copy()
    vibration[0, :, :2] = 0.0
    return vibration


_Found = tuple[float, ResidualExtreme]  # the amplitude that is meant, and all of its motion


@dataclass(frozen=True)
class _Problem:
    """A curve with projected tractions: its continuation, contact and static displacement (n_c, 3).

    `mean`: displacement in place of harmonic 0 in the amplitude meant, m. 0: the vibration, None: all displacement.
    """

    continuation: Continuation
    contact: ContactParameters
    static: Array
    mean: float | None

    @property
    def output(self) -> str:
        """Name of the output whose amplitude is meant."""
        return self.continuation.options.output

    @cached_property
    def at_zero(self) -> ContactParameters:
        """The contact with sliders that start at 0."""
        return replace(self.contact, slider_origin=np.zeros((self.contact.n_contacts, 2)))

    def element(self, n_harmonics: int) -> ContactElement:
        """The contact element with sliders that start at 0."""
        return contact_element(self.at_zero, n_harmonics, self.continuation.options)

    def free(self, point: SolutionPoint) -> NDArray[np.bool_]:
        """Which tractions are free at a point, (n_c, 2)."""
        return free_tractions(self.contact, self.element(point.balance.n_harmonics), point.displacement)

    def amplitude(self, point: SolutionPoint) -> float:
        """The amplitude meant at a point, m."""
        return output_amplitude(point, self.output, self.mean)

    def radius(self, displacement: Array) -> Array:
        """Bound of the places from which a slider is not moved in a motion, (n_c, 2), m."""
        return np.maximum(farthest_position(self.at_zero, displacement), self.continuation.balance.tiny)

    def search(self, point: SolutionPoint, fixed_frequency: bool, radius: Array | None = None) -> Begun | None:
        """A search over the tractions, begun at a solution with its own tractions; None if it is not found again.

        Over the places where the sliders start, with a friction cone or in a given `radius` (n_c, 2), m.
        """
        continuation = replace(
            self.continuation.with_balance(point.balance), adapt=None, stability=None, contact=None
        )
        element, displacement = self.element(point.balance.n_harmonics), point.displacement
        tractions: TractionElement
        with_mean = bool(self.contact.cone.any()) and radius is None
        if with_mean:
            radius = WIDER * self.radius(_without_mean(displacement))
        if radius is not None:
            position = self._position(point) - (displacement[0, :, :2] if with_mean else 0.0)
            variables = np.clip(position / radius, -1.0, 1.0)
            tractions = TractionOrigins(element, np.zeros_like(radius), radius, variables, with_mean)
        else:
            levels = TractionLevels(self.at_zero, element, np.zeros((self.contact.n_contacts, 2)))
            variables = levels.level_of(point.contact.force, displacement)
            tractions = levels
        search = TractionSearch(continuation, tractions, self.mean, fixed_frequency)
        start = search.start(variables, point)
        return None if start is None else (search, start)

    def _position(self, point: SolutionPoint) -> Array:
        """Where the sliders stand whose traction is free, u - T / kt, (n_c, 2) m; elsewhere where they started."""
        kt = np.where(self.contact.tangential_stiffness > 0.0, self.contact.tangential_stiffness, 1.0)
        position = point.displacement[0, :, :2] + point.contact.force[0, :, :2] / kt[:, None]
        return np.where(self.free(point), position, self.contact.slider_origin)

    def slider_origin(self, search: TractionSearch, state: TractionState) -> Array:
        """Start of the sliders that leads to a state, (n_c, 2) m; as given where the traction is not free."""
        displacement = state.point.displacement
        origin = search.element.at(state.variables).origin(displacement, state.point.contact)
        return np.where(self.free(state.point), origin, self.contact.slider_origin)

    def curve(self, slider_origin: Array, balance: HarmonicBalance) -> Branch:
        """The main branch with sliders that start there, and with the harmonics of a balance."""
        contact, continuation = replace(self.contact, slider_origin=slider_origin), self.continuation
        element = contact_element(contact, balance.n_harmonics, continuation.options)
        moved = replace(balance, element=element)
        fresh = replace(continuation, balance=moved, contact=contact, adapt=None, stability=None)
        return continue_over_range(fresh, self.static)[0]

    def extreme(self, point: SolutionPoint, slider_origin: Array, branch: Branch) -> _Found:
        """A peak with the curve that its tractions lead to."""
        extreme = ResidualExtreme(
            frequency_hz=point.omega / (2.0 * np.pi),
            amplitude_m=output_amplitude(point, self.output),
            vibration_m=output_amplitude(point, self.output, mean=0.0),
            static_m=float(output_harmonics(point, self.output)[0].real),
            slider_origin=slider_origin,
            traction=-point.contact.force[0, :, :2],
            curve_frequency_hz=np.array([item.omega for item in branch.points]) / (2.0 * np.pi),
            curve_amplitude_m=np.array([output_amplitude(item, self.output) for item in branch.points]),
        )
        return self.amplitude(point), extreme


def residual_bounds(
    continuation: Continuation, contact: ContactParameters, branch: Branch, peak_index: int, static: Array
) -> ResidualBounds | None:
    """Bounds of the peak of a main branch over all admissible residual tractions; None where the search fails.

    Shapes: `static` (n_c, 3).
    """
    moved, fixed = continuation.with_balance(branch.points[peak_index].balance), peak_index not in branch.peak_indices
    whole, vibration = (_Problem(moved, contact, static, mean) for mean in (None, 0.0))
    pairs = [_extremes(problem, branch, peak_index, fixed) for problem in (whole, vibration)]
    if pairs[0] is None or pairs[1] is None:
        return None
    (lowest, highest), most = pairs[0], pairs[1][1]
    if most.amplitude_m > (1.0 + SAME) * highest.amplitude_m:
        highest = most
    index = _band_indices(branch)
    band = np.array([_band_point(whole, branch.points[i]) for i in index]).reshape(-1, 2)
    return ResidualBounds(lowest, highest, *pairs[1], np.array(index), band[:, 0], band[:, 1])


def _extremes(
    problem: _Problem, branch: Branch, peak_index: int, fixed: bool
) -> tuple[ResidualExtreme, ResidualExtreme] | None:
    """The lowest and the highest peak of the amplitude meant; None where the search fails."""
    indices = [peak_index] if fixed else _highest_peaks(problem, branch)
    begun = [problem.search(branch.points[index], fixed) for index in indices]
    if begun[0] is None:
        return None
    # the peak of the vibration is located anew: it is not quite where that of the displacement is
    first = branch.points[indices[0]] if problem.mean is None else begun[0][1].point
    lowest = highest = problem.extreme(first, problem.contact.slider_origin, branch)
    if any(problem.free(branch.points[index]).any() for index in indices):
        found = [_highest(problem, *each) for each in begun if each is not None]
        highest = max([highest, *found], key=itemgetter(0))
        lowest = _lowest(problem, lowest, begun[0])
    return lowest[1], highest[1]


def _highest_peaks(problem: _Problem, branch: Branch) -> list[int]:
    """Indices of the highest peaks, by the amplitude meant."""
    return sorted(branch.peak_indices, key=lambda index: -problem.amplitude(branch.points[index]))[:MOST_PEAKS]


def _starts(search: TractionSearch, start: TractionState) -> Iterator[Array]:
    """Variables from which an extreme is sought, beside those of the start.

    Where every node sticks the vibration is that of a linear structure, the same for all tractions nearby, and its
    gradient is zero: then also the corners that unload one node after the other, so that it begins to slip.
    """
    shape = start.variables.shape
    yield np.zeros(shape)
    rng = np.random.default_rng(1)
    for _ in range(RANDOM_STARTS):
        yield rng.choice([-0.9, 0.9], size=shape)
    if np.abs(start.gradient).max() <= SAME * start.amplitude or not start.point.contact.state.any():
        yield from search.unloading_corners(start)


def _extreme(search: TractionSearch, start: TractionState, sign: float) -> TractionState:
    """The highest (`sign` 1) or lowest (-1) state from several starts."""
    search.extreme(start, sign)
    for variables in _starts(search, start):
        state = search.move(variables)
        if state is not None:
            search.extreme(state, sign)
    return max(search.states, key=lambda state: sign * state.amplitude)


def _highest(problem: _Problem, search: TractionSearch, start: TractionState) -> _Found:
    """The highest peak from a start."""
    state = _extreme(search, start, 1.0)
    origin = problem.slider_origin(search, state)
    return problem.extreme(state.point, origin, problem.curve(origin, state.point.balance))


def _lowest(problem: _Problem, projected: _Found, begun: Begun) -> _Found:
    """The lowest highest peak of a curve: where one peak is low, another of the same curve may rise above it."""
    found, peaks = [projected], [begun[1].point]
    for _ in range(MOST_CURVES):
        search, start = begun
        state = _extreme(search, start, -1.0)
        origin = problem.slider_origin(search, state)
        branch = problem.curve(origin, state.point.balance)
        tops = [] if search.fixed_frequency else _highest_peaks(problem, branch)
        top = branch.points[tops[0]] if tops else state.point
        higher = problem.amplitude(top) > (1.0 + SAME) * state.amplitude
        found.append(problem.extreme(top if higher else state.point, origin, branch))
        following = problem.search(top, False) if higher else None
        if following is None:
            break
        begun = following
        if all(abs(top.omega / peak.omega - 1.0) > _ONE_PEAK for peak in peaks):
            peaks.append(top)
    if len(peaks) > 1:
        found += _lowest_of_peaks(problem, peaks, min(found, key=itemgetter(0))[1].slider_origin)
    return min(found, key=itemgetter(0))


def _lowest_of_peaks(problem: _Problem, peaks: Sequence[SolutionPoint], origin: Array) -> Iterator[_Found]:
    """Curves whose highest peak is low, over where their sliders start: all peaks are minimised at once.

    From given starts (n_c, 2), m, and from 0: beyond the admissible places the gradient is zero.
    """
    radius = np.max([problem.radius(peak.displacement) for peak in peaks], axis=0)
    begun = [problem.search(peak, False, radius) for peak in peaks]
    searches = [each[0] for each in begun if each is not None]
    for start in (np.clip(origin / radius, -1.0, 1.0), np.zeros_like(radius)):
        moved = radius * lowest_of_peaks(searches, start)
        branch = problem.curve(moved, peaks[0].balance)
        tops = _highest_peaks(problem, branch)
        if tops:
            yield problem.extreme(branch.points[tops[0]], moved, branch)


def _band_indices(branch: Branch) -> list[int]:
    """Indices of points of a branch at about equal distances along it, and of its peaks."""
    arcs = np.array([point.arc for point in branch.points])
    places = np.searchsorted(arcs, np.linspace(arcs[0], arcs[-1], BAND_POINTS))
    return sorted({*places.clip(0, arcs.size - 1).tolist(), *branch.peak_indices})


def _band_point(problem: _Problem, point: SolutionPoint) -> tuple[float, float]:
    """The lowest and the highest amplitude at the frequency of a point, m."""
    amplitude = output_amplitude(point, problem.output)
    begun = problem.search(point, True) if problem.free(point).any() else None
    if begun is None:
        return amplitude, amplitude
    search, start = begun
    for sign in (-1.0, 1.0):
        search.through_corners(start, sign)
    reached = [state.amplitude for state in search.states]
    return min(amplitude, *reached), max(amplitude, *reached)

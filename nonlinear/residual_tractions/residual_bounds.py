"""Bounds of a peak over the residual tractions that friction leaves undetermined."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

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
from nonlinear.residual_tractions.extreme_amplitude import TractionSearch, TractionState
from nonlinear.residual_tractions.traction_levels import (
    TractionElement,
    TractionLevels,
    TractionOrigins,
    farthest_position,
    free_tractions,
)

RANDOM_STARTS = 2
MOST_PEAKS = 3  # local maxima of the curve from which the highest peak is sought
BAND_POINTS = 16
MOST_CURVES = 3  # solved to find the lowest highest peak
SAME = 1e-6  # relative difference of two amplitudes that count as one


@dataclass(frozen=True)
class ResidualExtreme:
    """The lowest or the highest peak over all admissible residual tractions.

    Attributes
    ----------
    frequency_hz : float
        Frequency of the peak, Hz.
    amplitude_m : float
        Amplitude of the output there, m, with the mean displacement of the projected tractions: of the vibration.
    static_m : float
        Harmonic 0 of the output there, m: the residual tractions deflect the blade as well.
    slider_origin : (n_c, 2) float
        Slider positions that lead to these tractions, m: `ContactParameters.slider_origin` of the same problem.
    traction : (n_c, 2) float
        Mean traction (T1, T2) of the nodes over the period at the peak, N.
    curve_frequency_hz, curve_amplitude_m : (P,) float
        The response curve with sliders that start there, Hz and m; amplitudes with the same mean displacement.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from dataclasses import replace
    >>> from nonlinear import forced_response
    >>> bounds = replace(options, residual_tractions="bounds")
    >>> stuck = replace(contact, preload=np.array([600.0]))
    >>> found = forced_response(modal, stuck, excitation, bounds).residual_bounds
    >>> bool(abs(found.highest.traction[0, 0]) <= 0.5 * 600.0)  # Coulomb's limit
    True
    """

    frequency_hz: float
    amplitude_m: float
    static_m: float
    slider_origin: Array
    traction: Array
    curve_frequency_hz: Array
    curve_amplitude_m: Array


@dataclass(frozen=True)
class ResidualBounds:
    """Lowest and highest peak of the main branch, and the band of its amplitudes at some frequencies.

    Amplitudes are those of the vibration about the mean displacement with projected tractions: a residual traction
    also deflects the blade (`ResidualExtreme.static_m`), which is no vibration.

    Attributes
    ----------
    lowest, highest : ResidualExtreme
        The extreme peaks: the lowest and the highest of all that the main branch can have.
    band_index : (F,) int
        Indices of some points of the main branch.
    band_lowest_m, band_highest_m : (F,) float
        Lowest and highest amplitude at the frequencies of these points that the response reaches from the main branch
        when the residual tractions change, m.

    Examples
    --------
    With the names of the example of `forced_response`.

    A contact that can always stick has the resonance of its spring, sqrt(1 + 3) / (2 pi) Hz, whatever its traction.

    >>> from dataclasses import replace
    >>> from nonlinear import forced_response
    >>> bounds = replace(options, residual_tractions="bounds")
    >>> stuck = replace(contact, preload=np.array([600.0]))
    >>> found = forced_response(modal, stuck, excitation, bounds).residual_bounds
    >>> print(f"{found.lowest.frequency_hz:.3f} to {found.highest.frequency_hz:.3f} Hz")
    0.318 to 0.318 Hz
    """

    lowest: ResidualExtreme
    highest: ResidualExtreme
    band_index: NDArray[np.int64]
    band_lowest_m: Array
    band_highest_m: Array


Begun = tuple[TractionSearch, TractionState]


@dataclass(frozen=True)
class _Problem:
    """A curve with projected tractions: its continuation, contact and static displacement (n_c, 3)."""

    continuation: Continuation
    contact: ContactParameters
    static: Array

    @property
    def output(self) -> str:
        """Name of the output whose amplitude is meant."""
        return self.continuation.options.output

    def element(self, n_harmonics: int) -> ContactElement:
        """The contact element with sliders that start at 0."""
        at_zero = replace(self.contact, slider_origin=np.zeros((self.contact.n_contacts, 2)))
        return contact_element(at_zero, n_harmonics, self.continuation.options)

    def free(self, point: SolutionPoint) -> NDArray[np.bool_]:
        """Which tractions are free at a point, (n_c, 2)."""
        return free_tractions(self.contact, self.element(point.balance.n_harmonics), point.displacement)

    def mean(self, point: SolutionPoint) -> float:
        """Harmonic 0 of the output at a point, m."""
        return float(output_harmonics(point, self.output)[0].real)

    def search(self, point: SolutionPoint, mean: float, fixed_frequency: bool) -> Begun | None:
        """A search over the tractions, begun at a solution with its own tractions; None if it is not found again."""
        continuation = replace(
            self.continuation.with_balance(point.balance), adapt=None, stability=None, contact=None
        )
        element, displacement = self.element(point.balance.n_harmonics), point.displacement
        at_zero = replace(self.contact, slider_origin=np.zeros((self.contact.n_contacts, 2)))
        radius = np.maximum(farthest_position(at_zero, displacement), continuation.balance.tiny)
        tractions: TractionElement
        if self.contact.law == "cone":
            variables = np.clip(self._position(point) / radius, -1.0, 1.0)
            tractions = TractionOrigins(element, np.zeros_like(radius), radius, variables)
        else:
            levels = TractionLevels(at_zero, element, np.zeros_like(radius))
            variables = levels.level_of(point.contact.force, displacement)
            tractions = levels
        search = TractionSearch(continuation, tractions, mean, fixed_frequency)
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

    def extreme(self, point: SolutionPoint, mean: float, slider_origin: Array, branch: Branch) -> ResidualExtreme:
        """A peak with the curve that its tractions lead to; `mean`: displacement in place of harmonic 0, m."""
        return ResidualExtreme(
            frequency_hz=point.omega / (2.0 * np.pi),
            amplitude_m=output_amplitude(point, self.output, mean),
            static_m=self.mean(point),
            slider_origin=slider_origin,
            traction=-point.contact.force[0, :, :2],
            curve_frequency_hz=np.array([item.omega for item in branch.points]) / (2.0 * np.pi),
            curve_amplitude_m=np.array([output_amplitude(item, self.output, mean) for item in branch.points]),
        )


def residual_bounds(
    continuation: Continuation, contact: ContactParameters, branch: Branch, peak_index: int, static: Array
) -> ResidualBounds | None:
    """Bounds of the peak of a main branch over all admissible residual tractions; None where the search fails.

    Parameters
    ----------
    continuation : Continuation
        The continuation of the branch.
    contact : ContactParameters
        Parameters of the contact nodes.
    branch : Branch
        The main branch, solved with projected tractions.
    peak_index : int
        Index of its highest point. If that is no located peak (an end of the range), amplitudes at its frequency are
        bounded.
    static : (n_c, 3) float
        Static displacement, m.

    Returns
    -------
    ResidualBounds or None
        Both bounds are solutions of the balance: a true bound may be farther out, never nearer.
    """
    peak, output = branch.points[peak_index], continuation.options.output
    problem = _Problem(continuation.with_balance(peak.balance), contact, static)
    fixed = peak_index not in branch.peak_indices
    mean = problem.mean(peak)
    begun = problem.search(peak, mean, fixed)
    if begun is None:
        return None
    lowest = highest = problem.extreme(peak, mean, contact.slider_origin, branch)
    others = [] if fixed else _other_peaks(branch, peak_index, output)
    if any(problem.free(branch.points[index]).any() for index in (peak_index, *others)):
        found = [_highest(problem, *begun)]
        for point in (branch.points[index] for index in others):
            other = problem.search(point, problem.mean(point), False)
            found += [] if other is None else [_highest(problem, *other)]
        highest = max([highest, *found], key=lambda item: item.amplitude_m)
        lowest = _lowest(problem, lowest, begun)
    index = _band_indices(branch)
    band = np.array([_band_point(problem, branch.points[i]) for i in index]).reshape(-1, 2)
    return ResidualBounds(lowest, highest, np.array(index), band[:, 0], band[:, 1])


def _other_peaks(branch: Branch, peak_index: int, output: str) -> list[int]:
    """Indices of the next highest peaks."""
    others = [index for index in branch.peak_indices if index != peak_index]
    return sorted(others, key=lambda index: -output_amplitude(branch.points[index], output))[: MOST_PEAKS - 1]


def _starts(search: TractionSearch, start: TractionState) -> Iterator[Array]:
    """Variables from which an extreme is sought, beside those of the start.

    Where every node sticks the vibration is that of a linear structure, the same for all tractions nearby, and the
    gradient is zero: then also the corners that unload one node after the other, so that it begins to slip.
    """
    shape = start.variables.shape
    yield np.zeros(shape)
    rng = np.random.default_rng(1)
    for _ in range(RANDOM_STARTS):
        yield rng.choice([-0.9, 0.9], size=shape)
    if np.abs(start.gradient).max() <= SAME * start.amplitude:
        yield from search.unloading_corners(start)


def _extreme(search: TractionSearch, start: TractionState, sign: float) -> TractionState:
    """The highest (`sign` 1) or lowest (-1) state from several starts."""
    search.extreme(start, sign)
    for variables in _starts(search, start):
        state = search.move(variables)
        if state is not None:
            search.extreme(state, sign)
    return max(search.states, key=lambda state: sign * state.amplitude)


def _highest(problem: _Problem, search: TractionSearch, start: TractionState) -> ResidualExtreme:
    """The highest peak from a start."""
    state = _extreme(search, start, 1.0)
    origin = problem.slider_origin(search, state)
    return problem.extreme(state.point, _mean(search), origin, problem.curve(origin, state.point.balance))


def _mean(search: TractionSearch) -> float:
    """The displacement that a search holds in place of harmonic 0, m."""
    assert search.mean is not None
    return search.mean


def _lowest(problem: _Problem, projected: ResidualExtreme, begun: Begun) -> ResidualExtreme:
    """The lowest highest peak of a curve: where one peak is low, another of the same curve may rise above it."""
    best = projected
    for _ in range(MOST_CURVES):
        search, start = begun
        state = _extreme(search, start, -1.0)
        origin = problem.slider_origin(search, state)
        branch = problem.curve(origin, state.point.balance)
        mean = _mean(search)
        found = problem.extreme(state.point, mean, origin, branch)
        tops = [] if search.fixed_frequency else sorted(branch.peak_indices, key=lambda i: found.curve_amplitude_m[i])
        higher = bool(tops) and found.curve_amplitude_m[tops[-1]] > (1.0 + SAME) * state.amplitude
        if higher:
            found = problem.extreme(branch.points[tops[-1]], mean, origin, branch)
        if found.amplitude_m < best.amplitude_m:
            best = found
        following = problem.search(branch.points[tops[-1]], mean, False) if higher else None
        if following is None:
            break
        begun = following
    return best


def _band_indices(branch: Branch) -> list[int]:
    """Indices of points of a branch at about equal distances along it, and of its peaks."""
    arcs = np.array([point.arc for point in branch.points])
    places = np.searchsorted(arcs, np.linspace(arcs[0], arcs[-1], BAND_POINTS))
    return sorted({*places.clip(0, arcs.size - 1).tolist(), *branch.peak_indices})


def _band_point(problem: _Problem, point: SolutionPoint) -> tuple[float, float]:
    """The lowest and the highest amplitude at the frequency of a point, m."""
    amplitude = output_amplitude(point, problem.output)
    begun = problem.search(point, problem.mean(point), True) if problem.free(point).any() else None
    if begun is None:
        return amplitude, amplitude
    search, start = begun
    for sign in (-1.0, 1.0):
        search.through_corners(start, sign)
    reached = [state.amplitude for state in search.states]
    return min(amplitude, *reached), max(amplitude, *reached)

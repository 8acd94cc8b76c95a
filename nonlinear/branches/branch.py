"""A branch of a response curve: its points, peaks and bifurcations, why it ended, and its quantities as arrays."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from nonlinear.branches.growth_along_branch import locate_pattern_change, with_patterns, with_wave_exponents
from nonlinear.branches.special_points import locate_bifurcations, locate_peak
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import evaluate_responses, largest_amplitude, output_components
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.options import SolverOptions
from nonlinear.response_curve import (
    Bifurcation,
    BifurcationKind,
    Peak,
    ResponseCurve,
    TerminationReason,
    at_range_end,
)


class BranchBifurcation(NamedTuple):
    """A bifurcation of a branch: its kind, its place among the points, and the nodal diameter of the perturbation."""

    kind: BifurcationKind
    place: int
    nodal_diameter: int = 0


class Branch(NamedTuple):
    """Points of a branch."""

    points: list[SolutionPoint]  # in the order of growing arc length
    peak_indices: list[int]  # indices of the peaks among the points
    bifurcations: list[BranchBifurcation]  # bifurcations, in the order of the points
    termination: TerminationReason  # why the continuation ended

    def reversed(self) -> "Branch":
        """The same branch in the opposite direction."""
        last = len(self.points) - 1
        peaks = [last - index for index in reversed(self.peak_indices)]
        bifurcations = [item._replace(place=last - item.place) for item in reversed(self.bifurcations)]
        return Branch(reverse(self.points), peaks, bifurcations, self.termination)


def with_special_points(
    continuation: Continuation, points: list[SolutionPoint], termination: TerminationReason
) -> Branch:
    """The branch of these points, with its peaks and bifurcations located and inserted."""
    points = with_wave_exponents(continuation.recorder, points)
    branch = Branch(points[:1], [], [], termination)
    for before, after in pairwise(points):
        peak = locate_peak(continuation, before, after)
        found: list[tuple[BifurcationKind | None, SolutionPoint]] = [] if peak is None else [(None, peak)]
        found += locate_bifurcations(continuation, before, after)
        for kind, point in sorted(found, key=lambda special: special[1].arc):
            index = _insert(branch.points, point, before, after)
            if kind is None:
                branch.peak_indices.append(index)
            else:
                branch.bifurcations.append(BranchBifurcation(kind, index))
        branch.points.append(after)
    return _with_growth_in_ring(continuation, branch)


def with_stability(continuation: Continuation, branch: Branch) -> Branch:
    """A branch solved without exponents, with the exponents of its points and the bifurcations that follow from them.

    Folds, known without exponents, are located again, so that all bifurcations are in order.
    """
    folds, peaks = {item.place for item in branch.bifurcations}, set(branch.peak_indices)
    folds -= {*peaks, 0, len(branch.points) - 1}
    kept = [index for index in range(len(branch.points)) if index not in folds]
    points = [branch.points[index] for index in kept]
    exact = [place for place, index in enumerate(kept) if index in peaks]
    points = with_wave_exponents(continuation.recorder, points, exact)
    result = Branch([], [], [], branch.termination)
    for index, after in zip(kept, points, strict=True):
        if result.points:
            before, current = result.points[-1], continuation.with_balance(after.balance)
            for kind, special in sorted(locate_bifurcations(current, before, after), key=lambda item: item[1].arc):
                place = _insert(result.points, special, before, after)
                result.bifurcations.append(BranchBifurcation(kind, place))
        if index in peaks:
            result.peak_indices.append(len(result.points))
        result.points.append(after)
    return _with_growth_in_ring(continuation, result)


def _with_growth_in_ring(continuation: Continuation, branch: Branch) -> Branch:
    """The branch with the exponents of all nodal diameters, and the bifurcations that follow from them inserted."""
    stability = continuation.stability
    if stability is None or not branch.points or not stability.has_patterns(branch.points[0]):
        return branch
    result, known = branch._replace(points=[], peak_indices=[], bifurcations=[]), list(branch.bifurcations)
    for index, after in enumerate(with_patterns(stability, branch.points, branch.peak_indices)):
        if result.points:
            before = result.points[-1]
            change = locate_pattern_change(continuation.with_balance(after.balance), before, after)
            if change is not None:
                kind, nodal_diameter, special = change
                place = _insert(result.points, special, before, after)
                result.bifurcations.append(BranchBifurcation(kind, place, nodal_diameter))
        if index in branch.peak_indices:
            result.peak_indices.append(len(result.points))
        while known and known[0].place == index:
            result.bifurcations.append(known.pop(0)._replace(place=len(result.points)))
        result.points.append(after)
    return result


def _insert(points: list[SolutionPoint], point: SolutionPoint, before: SolutionPoint, after: SolutionPoint) -> int:
    """Append a special point unless it is one of its neighbours; its index, or theirs.

    Between two points that have an exponent of the ring before any is computed (`HarmonicSelection`) it gets one too.
    """
    if point is after:
        return len(points)
    if point is not before and point is not points[-1]:
        marked = point.pattern is None and before.pattern is not None and after.pattern is not None
        points.append(point.changed(pattern=before.pattern) if marked else point)
    return len(points) - 1


def reverse(points: list[SolutionPoint]) -> list[SolutionPoint]:
    """The same points in the opposite direction."""
    length = points[-1].arc
    return [replace(point.reversed(), arc=length - point.arc) for point in reversed(points)]


def join(backward: list[SolutionPoint], forward: list[SolutionPoint]) -> list[SolutionPoint]:
    """One curve from two that leave the same point in opposite directions."""
    first = reverse(backward)
    return [*first, *(replace(point, arc=first[-1].arc + point.arc) for point in forward[1:])]


MAX_BATCH = 500  # points whose modal coordinates are in memory at a time


AMPLITUDE_JUMP = 0.02  # largest relative jump of the amplitude where the number of harmonics changes


SAME_AMPLITUDE = 1e-9  # relative difference of two amplitudes that count as one


def assemble_curve(
    balance: HarmonicBalance, branch: Branch, options: SolverOptions, origin: str = ""
) -> ResponseCurve:
    """The quantities of all points of a branch as arrays; `balance` gives the sizes of a branch without points."""
    points = branch.points
    n_contacts = balance.n_contacts
    n_harmonics = max((point.balance.n_harmonics for point in points), default=balance.n_harmonics)

    response = np.zeros((len(points), n_harmonics + 1), dtype=complex)
    displacement, force = np.zeros((2, len(points), n_harmonics + 1, n_contacts, 3), dtype=complex)
    components = {name: output_components(balance.receptance.modal.output_names, name) for name in options.outputs}
    others = {
        name: np.zeros((len(points), n_harmonics + 1, len(parts)), dtype=complex)
        for name, parts in components.items()
    }
    friction, energy_error = np.zeros((2, len(points)))
    for batch in _batches(points):
        found = evaluate_responses(points[batch], options.output, options.outputs)
        for name, values in found.outputs.items():
            others[name][batch, : values.shape[1]] = values
        known = found.output.shape[1]  # harmonics of these points; the others are zero
        response[batch, :known] = found.output
        displacement[batch, :known], force[batch, :known] = found.displacement, found.force
        friction[batch], energy_error[batch] = found.friction, found.energy_error
    numbers = {point.balance.n_harmonics for point in points}
    state = np.array([point.contact.state for point in points], dtype=int).reshape(len(points), n_contacts)
    frequency_hz = np.array([point.omega for point in points]) / (2.0 * np.pi)
    amplitude = np.array([largest_amplitude(row).value for row in response])
    peaks = tuple(Peak(float(frequency_hz[i]), float(amplitude[i]), i) for i in branch.peak_indices)
    return ResponseCurve(
        termination=branch.termination,
        frequency_hz=frequency_hz,
        amplitude_m=amplitude,
        harmonic_m=np.abs(response[:, 1:]),
        static_m=response[:, 0].real,
        phase_rad=np.angle(response[:, 1]),
        stable=np.array([point.stable for point in points], dtype=bool),
        growth_rate=np.array([point.growth_rate for point in points]),
        growth_nodal_diameter=np.array([point.growth_nodal_diameter for point in points], dtype=int),
        sticking=(state == STICK).sum(axis=1),
        slipping=(state == SLIP).sum(axis=1),
        separating=(state == LIFT_OFF).sum(axis=1),
        dissipated_j=friction,
        iterations=np.array([point.iterations for point in points], dtype=int),
        kept_harmonics=np.array([point.balance.n_harmonics for point in points], dtype=int),
        arc=np.array([point.arc for point in points]),
        energy_error=energy_error,
        output=response,
        relative_displacement=displacement,
        contact_force=force,
        peak=_highest(
            peaks,
            frequency_hz,
            amplitude,
            SAME_AMPLITUDE if len(numbers) < 2 else AMPLITUDE_JUMP,
            options.frequency_hz,
        ),
        peaks=peaks,
        bifurcations=tuple(
            Bifurcation(kind, float(frequency_hz[i]), float(amplitude[i]), i, k) for kind, i, k in branch.bifurcations
        ),
        seconds=0.0,
        harmonics=n_harmonics,
        truncation_error=float("nan"),
        origin=origin,
        outputs=others,
    )


def _batches(points: list[SolutionPoint]) -> Iterator[slice]:
    """Runs of successive points that have the same balance."""
    start = 0
    for index in range(1, len(points) + 1):
        last = index == len(points)
        if last or points[index].balance is not points[start].balance or index - start == MAX_BATCH:
            yield slice(start, index)
            start = index


def _highest(
    peaks: tuple[Peak, ...], frequency_hz: Array, amplitude: Array, tolerance: float, limits_hz: tuple[float, float]
) -> Peak | None:
    """The highest located peak; the largest amplitude, if that is higher by more than the relative `tolerance`."""
    if amplitude.size == 0:
        return None
    largest = int(np.argmax(amplitude))
    located = max(peaks, key=lambda peak: peak.amplitude_m, default=None)
    if located is not None and located.amplitude_m >= (1.0 - tolerance) * amplitude[largest]:
        return located
    at, height = float(frequency_hz[largest]), float(amplitude[largest])
    return Peak(at, height, largest, located=False, at_end=height > 0.0 and at_range_end(at, limits_hz))

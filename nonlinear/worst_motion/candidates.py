"""Points of the branches of a curve that the worst motion can come from: stable ones and exposed unstable ones."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.parameters import Array
from nonlinear.response_curve import BifurcationKind, ResponseCurve

CLEARLY_HIGHER = 0.02  # relative distance of the amplitudes of two solutions of one frequency, see UnstableStretch
COULD_MATTER = (
    0.3  # of the highest motion known: lower unstable solutions are left alone; see docs, method, worst motion
)
APART = 1.3  # ratio of the highest and the lowest solution of a frequency from which blades can be on either
LONG = 1000  # periods in which a disturbance of a motion that persists grows by a factor of e at most
Place = tuple[int, int]  # branch (0: main, k: detached branch k) and index of the point


@dataclass(frozen=True)
class UnstableStretch:
    """Successive unstable points of a branch, some of them exposed.

    A point is exposed where no other solution of the same frequency is clearly higher: what the ring does there
    instead of the unstable motion may be higher than every stable solution.
    """

    branch: int  # branch: 0, the main branch; k, detached branch k
    exposed: NDArray[np.int64]  # (k,), indices of the exposed points, in the order of the branch
    height_m: float  # largest amplitude of the exposed points, m


@dataclass(frozen=True)
class Coexistence:
    """A range of frequencies with a high and a low solution."""

    start_hz: float  # the end where the high solution is lower
    end_hz: float  # the other end
    height_m: float  # largest amplitude of the high solution, m

    def at(self, share: float) -> float:
        """Frequency at a share of the way from the start to the end, Hz."""
        return self.start_hz + share * (self.end_hz - self.start_hz)


def height_said(metres: float) -> str:
    """A displacement in three digits, in the unit of the tables as far as blades move."""
    return f"{1e6 * metres:.3g} µm" if metres < 1e-2 else f"{metres:.3g} m"


def branches_of(curve: ResponseCurve) -> tuple[ResponseCurve, ...]:
    """The main branch and the detached ones, in the order of their numbers 0, 1, ..."""
    return curve, *curve.detached


def persists(branch: ResponseCurve) -> NDArray[np.bool_]:
    """Whether the points of a branch are stable, or so nearly that nothing changes within many periods, (P,).

    A fold or a Neimark-Sacker point is located on either side of the stability limit.
    """
    slow = branch.growth_rate * LONG < branch.frequency_hz
    chosen: NDArray[np.bool_] = branch.stable | slow
    return chosen


def highest_persistent(branches: Sequence[ResponseCurve]) -> Place | None:
    """The point with the largest amplitude on any branch whose motion persists."""
    best, height = None, -np.inf
    for number, branch in enumerate(branches):
        heights = np.where(persists(branch), branch.amplitude_m, -np.inf)
        if heights.size and heights.max() > height:
            best, height = (number, int(np.argmax(heights))), heights.max()
    return best


def without_doubtful(
    branches: Sequence[ResponseCurve], tolerance: float
) -> tuple[tuple[ResponseCurve, ...], tuple[int, ...]]:
    """The branches, and the numbers of those that may exist only because harmonics are missing.

    A detached branch that would give the worst motion has to have a truncation error within the tolerance. Otherwise
    its points count as unstable, with unknown growth: time integration tells whether the ring stays there.
    """
    kept, doubtful = list(branches), list[int]()
    while (place := highest_persistent(kept)) is not None and place[0] > 0:
        branch = kept[place[0]]
        if math.isnan(branch.truncation_error) or branch.truncation_error <= tolerance:
            break
        unknown = np.full(branch.points, np.nan)
        kept[place[0]] = replace(branch, stable=np.zeros(branch.points, dtype=bool), growth_rate=unknown)
        doubtful.append(place[0])
    return tuple(kept), tuple(doubtful)


def stable_amplitudes(branches: Sequence[ResponseCurve], frequency_hz: float) -> Array:
    """Amplitudes of all solutions that persist at a frequency, interpolated between neighbouring points, m."""
    return np.concatenate([_at(branch, _stable_parts(branch), frequency_hz) for branch in branches])


def unstable_stretches(branches: Sequence[ResponseCurve]) -> list[UnstableStretch]:
    """The unstable stretches with exposed points, the highest first."""
    found: list[UnstableStretch] = []
    for number, branch in enumerate(branches):
        for stretch in _runs(~persists(branch)):
            exposed = np.array([i for i in stretch if _is_exposed(branches, branch, i)], dtype=np.int64)
            if exposed.size:
                found.append(UnstableStretch(number, exposed, float(branch.amplitude_m[exposed].max())))
    return sorted(found, key=lambda stretch: -stretch.height_m)


def _is_exposed(branches: Sequence[ResponseCurve], branch: ResponseCurve, index: int) -> bool:
    """Whether no stable solution at the frequency of a point is as high, and no other one clearly higher."""
    frequency_hz, height = float(branch.frequency_hz[index]), branch.amplitude_m[index]
    if np.any(stable_amplitudes(branches, frequency_hz) >= height * (1.0 - CLEARLY_HIGHER)):
        return False
    return not np.any(_amplitudes(branches, frequency_hz) >= height * (1.0 + CLEARLY_HIGHER))


def coexistences(branches: Sequence[ResponseCurve]) -> list[Coexistence]:
    """The ranges of frequencies with solutions far apart, that with the highest first."""
    points = np.unique(np.concatenate([branch.frequency_hz for branch in branches]))
    middles = 0.5 * (points[:-1] + points[1:])
    found = [_amplitudes(branches, frequency_hz) for frequency_hz in middles.tolist()]
    high, low = (np.array([pick(each) if each.size else 0.0 for each in found]) for pick in (np.max, np.min))
    ranges = []
    for run in _runs(high > APART * low):
        ends = sorted((run[0], run[-1]), key=lambda index: high[index])
        start, end = (float(middles[index]) for index in ends)
        ranges.append(Coexistence(start, end, float(high[run].max())))
    return sorted(ranges, key=lambda each: -each.height_m)


def high_places(branches: Sequence[ResponseCurve], least_m: float) -> Array:
    """Frequencies of the solutions above a height, ascending, Hz; all where none is."""
    frequency = np.concatenate([branch.frequency_hz for branch in branches])
    high = np.concatenate([branch.amplitude_m for branch in branches]) >= least_m
    return np.sort(frequency[high] if high.any() else frequency)


def highest_beside(branches: Sequence[ResponseCurve], frequency_hz: float) -> Place | None:
    """The point before the highest solution at a frequency, on any branch; None where there is none."""
    found = []
    for number, branch in enumerate(branches):
        for index in np.flatnonzero(_crosses(branch, frequency_hz)).tolist():
            found.append((float(branch.amplitude_m[index]), number, index))
    return max(found)[1:] if found else None


def _amplitudes(branches: Sequence[ResponseCurve], frequency_hz: float) -> Array:
    """Amplitudes of all solutions at a frequency, m."""
    return np.concatenate(
        [_at(each, np.ones(each.points - 1, bool), frequency_hz) for each in branches if each.points]
    )


def _stable_parts(branch: ResponseCurve) -> NDArray[np.bool_]:
    """Whether the parts between neighbouring points persist, (P-1,); a stable part ends with its fold."""
    stable = persists(branch)
    for item in branch.bifurcations:
        if item.kind is BifurcationKind.FOLD:
            stable[item.index] |= bool(np.any(stable[max(item.index - 1, 0) : item.index + 2]))
    parts: NDArray[np.bool_] = stable[:-1] & stable[1:]
    return parts


def _crosses(branch: ResponseCurve, frequency_hz: float) -> NDArray[np.bool_]:
    """Whether a frequency lies between neighbouring points of a branch, (P-1,)."""
    crosses: NDArray[np.bool_] = (branch.frequency_hz[:-1] - frequency_hz) * (
        branch.frequency_hz[1:] - frequency_hz
    ) <= 0.0
    return crosses


def _at(branch: ResponseCurve, parts: NDArray[np.bool_], frequency_hz: float) -> Array:
    """Amplitudes of the chosen parts (P-1,) of a branch at a frequency, m."""
    before, after = branch.frequency_hz[:-1], branch.frequency_hz[1:]
    crosses = parts & _crosses(branch, frequency_hz)
    first, last = before[crosses], after[crosses]
    width = np.where(first == last, 1.0, last - first)
    share = np.where(first == last, 0.0, (frequency_hz - first) / width)
    start, end = branch.amplitude_m[:-1][crosses], branch.amplitude_m[1:][crosses]
    found: Array = start + share * (end - start)
    return found


def _runs(chosen: NDArray[np.bool_]) -> Iterator[range]:
    """Index ranges of successive points that are chosen."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(int)))
    yield from (range(int(start), int(stop)) for start, stop in zip(edges[::2], edges[1::2], strict=True))

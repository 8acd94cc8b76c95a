"""The worst motion over the range of a parameter, from followed peaks and single responses, and its lowest point.

H(s) is the highest followed peak that persists, U(s) the highest of all. Where U = H, and the responses on both
sides agree with H, the envelope is H. Elsewhere what the ring does is known from single responses only: there the
envelope is the larger of H and the straight line between neighbouring nodes. Nodes are the solved responses and the
ends of the parts where U > H.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.peak_curves.optimum_result import Kind, SolvedResponse
from nonlinear.peak_curves.peak_branch import PeakPiece
from nonlinear.peak_curves.peak_curve import PeakContinuation, PeakPoint
from nonlinear.response_curve import ResponseCurve

AGREES = 2e-3  # relative difference of the worst motion of a response and the highest persistent peak
SAMPLES = 2001  # of the range, at which the two highest peaks are compared
JUMP = 5e-3  # relative change at the end of a stable part of a peak that counts as a jump
BESIDE = 2e-6  # of the share, on either side of such an end
NARROW = 1e-3  # of the share: what is not known between two responses so near each other is a jump
UNKNOWN = 1.0  # relative error of a part of which nothing is told
MARGIN = 1e-4  # of the share, kept from a jump
LEVEL, LEVEL_PART = 1e-6, 0.02  # relative variation and smallest part of the range of a plateau
FLAT = 1e-3  # relative variation of the envelope that counts as none
EXACT = 1e-12  # relative difference of the envelope and the peak that it is
AT_END = 1e-6  # of the share
SIDE = 1e-8  # of the share, for one-sided derivatives
APART = 2e-5  # of the share, on either side of an exchange, where one peak is the highest
TURN = 0.2  # change of the derivative at a kink, relative to the larger of the two
SECANT, RESOLUTION, ITERATIONS = 1e-3, 1e-9, 8  # of the share, in the refinement


PLACES, PART = 10, 0.25  # of a gap where its error is looked for; part of the room below a line that is its error


class ResponseAt(NamedTuple):
    """A response solved at a share of the range."""

    share: float  # share of the range
    curve: ResponseCurve  # the response, with detached branches and worst motion
    solved: SolvedResponse  # its summary


class Node(NamedTuple):
    """A share where the worst motion is known."""

    # `share`, `height`: share and amplitude, m; infinite where no motion is known
    share: float
    height: float
    response: int  # index of the response; -1 at the end of a part where the highest peak does not persist
    # whether the worst motion lies at an end of the frequency range, and its height is not known
    at_end: bool = False


class Gap(NamedTuple):
    """Two neighbouring nodes between which the envelope rests on single responses."""

    # `before`, `after`: the nodes
    before: Node
    after: Node

    @property
    def width(self) -> float:
        """Difference of the shares."""
        return self.after.share - self.before.share

    @property
    def change(self) -> float:
        """Relative difference of the heights at both ends."""
        low, high = sorted(node.height for node in self)
        return high / low - 1.0 if np.isfinite(high) and low > 0.0 else np.inf


@dataclass(frozen=True)
class EnvelopeOfPeaks:
    """The worst motion as a function of the share."""

    pieces: Sequence[PeakPiece]  # the followed peaks
    responses: Sequence[ResponseAt]  # the responses solved, by ascending share

    def at(self, shares: Array) -> Array:
        """The envelope at some shares, m; infinite where nothing is known.

        Shapes: `shares` (k,).
        """
        found = np.maximum(self.persistent(shares), self.on_responses(shares))
        return np.where(np.isneginf(found), np.inf, found)

    def persistent(self, shares: Array) -> Array:
        """Highest persistent followed peak H, m; minus infinity where there is none."""
        return _highest([piece.persistent_at(shares) for piece in self.pieces], shares)

    def highest(self, shares: Array) -> Array:
        """Highest followed peak U, m; minus infinity where there is none."""
        return _highest([piece.amplitude_at(shares) for piece in self.pieces], shares)

    def on_responses(self, shares: Array) -> Array:
        """The lines between the nodes of the gaps, m; minus infinity outside the gaps."""
        lines = np.full(np.shape(shares), -np.inf)
        for gap in self.gaps:
            inside = (shares >= gap.before.share) & (shares <= gap.after.share)
            lines = np.where(inside, np.maximum(lines, _line(gap, shares)), lines)
        return lines

    @cached_property
    def shares(self) -> Array:
        """The shares that resolve it: an even grid, the ends of stable parts of the peaks, the nodes."""
        marks = [mark for piece in self.pieces for mark in _ends(piece)]
        near = [mark + side for mark in marks for side in (-BESIDE, BESIDE)]
        every = np.concatenate([np.linspace(0.0, 1.0, SAMPLES), marks, near, [node.share for node in self.nodes]])
        return np.unique(every[(every >= 0.0) & (every <= 1.0)])

    @cached_property
    def doubtful(self) -> list[tuple[float, float]]:
        """Ranges of the share in which the highest followed peak does not persist, or there is none."""
        marks = [mark for piece in self.pieces for mark in _ends(piece)]
        near = [mark + side for mark in marks for side in (-BESIDE, BESIDE)]
        shares = np.unique(np.clip(np.concatenate([np.linspace(0.0, 1.0, SAMPLES), near]), 0.0, 1.0))
        persistent, highest = self.persistent(shares), self.highest(shares)
        missing = ~np.isfinite(highest) | (persistent < highest * (1.0 - AGREES))
        edges = np.flatnonzero(np.diff(np.concatenate([[False], missing, [False]]).astype(int)))
        return [
            (float(shares[max(first - 1, 0)]), float(shares[min(last, shares.size - 1)]))
            for first, last in zip(edges[::2], edges[1::2], strict=True)
        ]

    @cached_property
    def nodes(self) -> list[Node]:
        """Responses and ends of doubtful ranges, by ascending share."""
        found = [self._node(index) for index in range(len(self.responses))]
        known = {node.share for node in found}
        ends = np.array([end for part in self.doubtful for end in part if end not in known])
        heights = self.persistent(ends) if ends.size else ends
        found += [
            Node(float(share), float(height), -1)
            for share, height in zip(ends, heights, strict=True)
            if np.isfinite(height)
        ]
        return sorted(found)

    @cached_property
    def gaps(self) -> list[Gap]:
        """Neighbouring nodes between which the envelope rests on responses."""
        found = []
        for before, after in pairwise(self.nodes):
            middle = 0.5 * (before.share + after.share)
            doubtful = any(low <= middle <= high for low, high in self.doubtful)
            if doubtful or not (self.agrees(before) and self.agrees(after)):
                found.append(Gap(before, after))
        return found

    @cached_property
    def errors(self) -> list[float]:
        """Relative error of the line of each gap, by the secants of what is known beside it."""
        inside = [(self.shares > gap.before.share) & (self.shares < gap.after.share) for gap in self.gaps]
        known = self.shares[~np.any(inside, axis=0)] if inside else self.shares
        known = known[np.isfinite(self.at(known))]
        heights = self.at(known)
        found = []
        for gap in self.gaps:
            places = np.linspace(gap.before.share, gap.after.share, PLACES)[1:-1]
            line = _line(gap, places)
            room = (
                float(np.max(1.0 - bound_between(known, heights, places) / line)) if np.isfinite(line).all() else 1.0
            )
            found.append(PART * room if room < 1.0 else UNKNOWN)
        return found

    @property
    def lowest_height(self) -> float:
        """Lowest height, m; infinite where nothing is known."""
        return float(self.at(self.shares).min())

    @property
    def jumps(self) -> list[float]:
        """Shares where the worst motion jumps: ends of stable parts of the highest peak, and narrow gaps."""
        found = []
        for mark in {mark for piece in self.pieces for mark in _ends(piece) if 0.0 < mark < 1.0}:
            below, above = self.at(np.array([mark - BESIDE, mark + BESIDE]))
            if min(above, below) < np.inf and abs(above - below) > JUMP * min(above, below):
                found.append(float(mark))
        found += [
            0.5 * (gap.before.share + gap.after.share)
            for gap in self.gaps
            if gap.width <= NARROW and gap.change > JUMP
        ]
        return sorted(found)

    def agrees(self, node: Node) -> bool:
        """Whether the worst motion at a node is a followed peak that persists, or lower."""
        if node.response < 0:
            return True
        height = np.inf if node.at_end else self.responses[node.response].solved.bound_m
        return bool(height <= (1.0 + AGREES) * self.persistent(np.array([node.share]))[0])

    def _node(self, index: int) -> Node:
        response = self.responses[index]
        height = response.solved.bound_m
        persistent = float(self.persistent(np.array([response.share]))[0])
        at_end = response.solved.at_end
        height = max(height if np.isfinite(height) else -np.inf, persistent)
        return Node(response.share, height if np.isfinite(height) and not at_end else np.inf, index, at_end)


def bound_between(values: Array, heights: Array, places: Array) -> Array:
    """What a function is at least at some places, by the neighbouring secants, extended, of its values at others."""
    place = np.clip(np.searchsorted(values, places, side="right") - 1, 0, len(values) - 2)
    start, end = values[place], values[place + 1]
    linear = np.interp(places, values, heights)
    slopes = np.r_[-np.inf, np.diff(heights) / np.diff(values), np.inf]
    with np.errstate(invalid="ignore"):
        from_left = heights[place] + slopes[place] * (places - start)
        from_right = heights[place + 1] - slopes[place + 2] * (end - places)
        convex = [np.where(each <= linear, each, np.nan) for each in (from_left, from_right)]
    bound = np.fmax(np.fmax(*convex), 0.0)  # 0 where a secant tells nothing, as beside a jump
    return np.where(np.isnan(convex).all(axis=0), np.minimum(heights[place], heights[place + 1]), bound)


def range_below(values: Array, heights: Array, at: float, limit: float) -> tuple[float, float]:
    """Ends around a value up to which heights, linear between rising values, stay below a limit."""
    ends = []
    for side in (-1, 1):
        beyond = np.flatnonzero(((values - at) * side > 0.0) & ~(heights <= limit))[::side]
        if not beyond.size:
            ends.append(float(values[0 if side < 0 else -1]))
            continue
        outer, inner = beyond[0], beyond[0] - side
        rise = heights[outer] - heights[inner]
        part = np.clip((limit - heights[inner]) / rise, 0.0, 1.0) if np.isfinite(rise) and rise > 0.0 else 0.0
        ends.append(float(values[inner] + part * (values[outer] - values[inner])))
    return ends[0], ends[1]


def _line(gap: Gap, shares: Array) -> Array:
    """The straight line of a gap; the known height where the other is not known."""
    before, after = gap
    if not (np.isfinite(before.height) and np.isfinite(after.height)):
        return np.full(np.shape(shares), np.inf)
    return np.interp(shares, [before.share, after.share], [before.height, after.height])


def _highest(tables: list[Array], shares: Array) -> Array:
    """The largest of some values at each share, without NaN; minus infinity where there is none."""
    found: Array = np.fmax.reduce([np.full(np.shape(shares), -np.inf), *tables])
    return found


def _ends(piece: PeakPiece) -> list[float]:
    """Ends of the piece and of its stable parts."""
    changes = np.flatnonzero(np.diff(piece.persists.astype(int)))
    inner = 0.5 * (piece.share[changes] + piece.share[changes + 1])
    return [float(piece.share[0]), *inner.tolist(), float(piece.share[-1])]


@dataclass(frozen=True)
class Minimum:
    """The lowest point of the envelope."""

    share: float  # where
    height: float  # how high, m
    kind: Kind  # see `Optimum`
    peak: PeakPoint | None  # the peak there; None where the envelope rests on single responses
    second: float  # second derivative by the share at a smooth minimum, m; NaN else
    rates: tuple[float, float]  # one-sided derivatives by the share, m, see `Optimum.slopes`
    plateau: tuple[float, float]  # shares between which the envelope is as low


def lowest_of(envelope: EnvelopeOfPeaks, follower: PeakContinuation) -> Minimum:
    """The lowest point of an envelope, a followed peak solved for anew."""
    jumps = np.array(envelope.jumps)
    beside = np.concatenate([jumps - MARGIN, jumps + MARGIN])
    every = np.unique(np.concatenate([envelope.shares, beside[(beside > 0.0) & (beside < 1.0)]]))
    # no closer to a jump than the margin: which side a share is on must be beyond doubt
    clear = [share for share in every if not jumps.size or np.abs(jumps - share).min() >= 0.99 * MARGIN]
    shares = np.array(clear)
    heights = envelope.at(shares)
    if not np.isfinite(heights).any():
        raise ArithmeticError("no motion that persists is known at any value")
    plateau = _plateau(shares, heights)
    k = int(np.argmin(heights))
    share = (
        0.5 * (plateau[0] + plateau[1])
        if plateau[1] - plateau[0] > LEVEL_PART
        else _local(envelope, shares, k, jumps)
    )
    at_jump = bool(jumps.size) and float(np.abs(jumps - share).min()) < NARROW
    piece = _holder(envelope, share)
    rates = one_sided(envelope, share)
    kind = _kind(envelope, heights, plateau, share, rates, at_jump, piece)
    if piece is None:
        second, height = float("nan"), float(envelope.at(np.array([share]))[0])
        return Minimum(share, height, kind, None, second, _with_jumps(rates, jumps, share), plateau)
    exact = follower.moved(piece.nearest(share), share) or piece.nearest(share)
    second = float("nan")
    if kind == "smooth":
        exact, second = _refined(follower, exact)
        rates = exact.rate, exact.rate
    elif kind == "kink":
        exact = _exchange(envelope, follower, exact) or exact
        rates = one_sided(envelope, exact.share)
    return Minimum(exact.share, exact.amplitude, kind, exact, second, _with_jumps(rates, jumps, exact.share), plateau)


def one_sided(envelope: EnvelopeOfPeaks, share: float) -> tuple[float, float]:
    """Derivatives of the envelope by the share just below and just above, m; NaN beyond the range."""
    rates = []
    for side in (-SIDE, SIDE):
        near = np.array([share + side])
        if not 0.0 <= near[0] <= 1.0:
            rates.append(float("nan"))
            continue
        piece = _holder(envelope, float(near[0]), EXACT)
        heights = envelope.at(near[0] + np.array([0.0, side]))
        if piece is not None:
            rates.append(float(piece.rate_at(near)[0]))
        elif np.isfinite(heights).all():
            rates.append(float((heights[1] - heights[0]) / side))
        else:
            rates.append(float("nan"))
    return rates[0], rates[1]


def _local(envelope: EnvelopeOfPeaks, shares: Array, k: int, jumps: Array) -> float:
    """The minimum near a share of the grid, no nearer to a jump than the margin."""
    from scipy.optimize import minimize_scalar

    if k in (0, shares.size - 1):
        return float(shares[k])

    def at(share: float) -> float:
        return float(envelope.at(np.array([share]))[0])

    low, high = float(shares[k - 1]), float(shares[k + 1])
    low = max([low, *(jumps[jumps < shares[k]] + MARGIN).tolist()])
    high = min([high, *(jumps[jumps > shares[k]] - MARGIN).tolist()])
    if not low < high:
        return float(shares[k])
    found = minimize_scalar(at, bounds=(low, high), method="bounded", options={"xatol": 1e-10})
    return float(found.x) if found.fun < at(float(shares[k])) else float(shares[k])


def _holder(envelope: EnvelopeOfPeaks, share: float, tolerance: float = AGREES) -> PeakPiece | None:
    """The piece whose persistent peak is the envelope at a share, within a tolerance; None where a response is."""
    place = np.array([share])
    height = float(envelope.at(place)[0])
    heights = [float(piece.persistent_at(place)[0]) for piece in envelope.pieces]
    known = [(value, k) for k, value in enumerate(heights) if np.isfinite(value)]
    if not known or max(known)[0] < height * (1.0 - tolerance):
        return None
    return envelope.pieces[max(known)[1]]


def _plateau(shares: Array, heights: Array) -> tuple[float, float]:
    """The shares around the lowest one between which the envelope is as low."""
    high = ~(heights <= (1.0 + LEVEL) * heights.min())
    k = int(np.argmin(heights))
    first = int(np.flatnonzero(high[:k])[-1]) + 1 if high[:k].any() else 0
    last = k + int(np.flatnonzero(high[k:])[0]) - 1 if high[k:].any() else shares.size - 1
    return float(shares[first]), float(shares[last])


def _kind(
    envelope: EnvelopeOfPeaks,
    heights: Array,
    plateau: tuple[float, float],
    share: float,
    rates: tuple[float, float],
    at_jump: bool,
    piece: PeakPiece | None,
) -> Kind:
    lowest = float(heights.min())
    if heights.max() <= (1.0 + FLAT) * lowest:
        return "flat"
    if plateau[1] - plateau[0] > LEVEL_PART:
        return "plateau"
    if share <= AT_END or share >= 1.0 - AT_END:
        return "edge"
    if at_jump:
        return "jump"
    if piece is None:
        return "sampled"
    if _holder(envelope, share - SIDE, EXACT) is None or _holder(envelope, share + SIDE, EXACT) is None:
        return "sampled"  # on one side the envelope rests on responses
    below, above = rates
    least = FLAT * lowest  # over the whole range
    turns = below < -least and above > least and above - below > TURN * max(abs(below), abs(above))
    return "kink" if turns else "smooth"


def _with_jumps(rates: tuple[float, float], jumps: Array, share: float) -> tuple[float, float]:
    """One-sided derivatives, infinite towards a jump."""
    below, above = rates
    if np.any((jumps < share) & (jumps > share - NARROW)):
        below = -np.inf
    if np.any((jumps > share) & (jumps < share + NARROW)):
        above = np.inf
    return below, above


def _refined(follower: PeakContinuation, peak: PeakPoint) -> tuple[PeakPoint, float]:
    """The peak at which the derivative by the share vanishes, near a peak, and the second derivative; by secants."""
    second, last, step = float("nan"), peak, SECANT
    for _ in range(ITERATIONS):
        share = peak.share + step
        found = follower.moved(peak, share)
        if found is None or found.rate == peak.rate:
            break
        last, peak = peak, found
        second = (peak.rate - last.rate) / (peak.share - last.share) if abs(step) > RESOLUTION else second
        step = -peak.rate / second
        if abs(step) < RESOLUTION or not abs(step) < 10.0 * SECANT:
            break
    sides = [follower.moved(peak, peak.share + at) for at in (SECANT, -SECANT)]
    if sides[0] is not None and sides[1] is not None:
        second = (sides[0].rate - sides[1].rate) / (2.0 * SECANT)
    return peak, second


def _exchange(envelope: EnvelopeOfPeaks, follower: PeakContinuation, near: PeakPoint) -> PeakPoint | None:
    """The peak where two exchange, by secants on the difference of their amplitudes; None: no two peaks."""
    below, above = (_holder(envelope, near.share + side) for side in (-APART, APART))
    if below is None or above is None or below is above:
        return None
    first, second = below.nearest(near.share), above.nearest(near.share)
    share, step = near.share, 0.0
    for _ in range(ITERATIONS):
        one, other = follower.moved(first, share), follower.moved(second, share)
        if one is None or other is None or one.rate == other.rate:
            return None
        first, second = one, other
        step = (other.amplitude - one.amplitude) / (one.rate - other.rate)
        if abs(step) < RESOLUTION:
            return replace(one, persists=True)
        if abs(step) > 10.0 * SECANT:
            return None
        share += step
    return None

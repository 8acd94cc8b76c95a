"""The lowest point of the worst motion over a parameter: where, and of what kind."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.peak_curves.optimum_result import Kind
from nonlinear.peak_curves.peak_branch import PeakPiece
from nonlinear.peak_curves.peak_curve import PeakContinuation, PeakPoint
from nonlinear.peak_curves.worst_envelope import AGREES, NARROW, EnvelopeOfPeaks

MARGIN = 1e-4  # of the share, kept from a jump
LEVEL, LEVEL_PART = 1e-6, 0.02  # relative variation and smallest part of the range of a plateau
FLAT = 1e-3  # relative variation of the envelope that counts as none
EXACT = 1e-12  # relative difference of the envelope and the peak that it is
AT_END = 1e-6  # of the share
SIDE = 1e-8  # of the share, for one-sided derivatives
APART = 2e-5  # of the share, on either side of an exchange, where one peak is the highest
TURN = 0.2  # change of the derivative at a kink, relative to the larger of the two
SECANT, RESOLUTION, ITERATIONS = 1e-3, 1e-9, 8  # of the share, in the refinement


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

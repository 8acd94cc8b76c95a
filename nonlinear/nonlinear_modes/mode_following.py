"""A nonlinear mode from its smallest to its largest amplitude, across internal resonances.

In an internal resonance 1:h a higher harmonic h resonates with another mode. The curve makes a tongue there: it turns
back in amplitude, and may pass over to a motion in harmonic h alone, which is another mode at h times the frequency.
The mode is then sought again at a larger amplitude, and followed from there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.nonlinear_modes.extended_motion import MotionState
from nonlinear.nonlinear_modes.mode_curve import MOST_POINTS, ModeContinuation, MotionPoint

LOWEST = 0.9  # of the amplitude of the start: a curve that comes back to it is ended
OTHER_MODE = 3.0  # share of a higher harmonic, relative to harmonic 1, at which the motion is another mode
OWN_MODE = 0.12  # share of all higher harmonics below which a motion belongs to the mode
JUMPS = (0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.1)  # in ln of the amplitude, across an internal resonance
MOST_PIECES = 4
Size = Callable[[MotionPoint], float]  # amplitude of a motion
REACHED = "the largest amplitude was reached"


@dataclass(frozen=True)
class ModePoint:
    """What is kept of a solution: all but the derivatives."""

    state: MotionState  # the unknowns
    coordinates: ComplexArray  # (H+1, m), modal coordinates
    nodes: NDArray[np.int64]  # (n_c,), worst state of each contact node

    @classmethod
    def of(cls, point: MotionPoint) -> ModePoint:
        """Of a solution with its derivatives."""
        return cls(point.state, point.linearised.coordinates, np.asarray(point.linearised.contact.state))


@dataclass(frozen=True)
class ModePath:
    """The points of a mode in the order of the arc length, in one piece or more."""

    # between two pieces there is an internal resonance that was passed over
    pieces: tuple[tuple[ModePoint, ...], ...]
    complete: bool  # whether the largest amplitude was reached
    message: str  # why the path ends, and where it was interrupted


def harmonic_shares(coordinates: ComplexArray) -> Array:
    """Sizes of the harmonics 2 .. H relative to that of harmonic 1, (..., H-1).

    Parameters
    ----------
    coordinates : (..., H+1, m) complex array
        Mass-normalised modal coordinates.

    Examples
    --------
    >>> from nonlinear import harmonic_shares
    >>> harmonic_shares(np.array([[0.0], [2.0], [0.5j]])).tolist()
    [0.25]
    """
    size = np.linalg.norm(coordinates, axis=-1)
    return np.asarray(size[..., 2:] / np.maximum(size[..., 1:2], 1e-300))


def follow_mode(
    continuation: ModeContinuation, start: MotionPoint, size: Size, largest: float, linear: tuple[float, ...] = ()
) -> ModePath:
    """Follow a mode up to the largest amplitude."""
    before, last = _linear_points(continuation, start, linear)
    pieces: list[tuple[ModePoint, ...]] = []
    interruptions: list[str] = []
    point: MotionPoint | None = last
    smallest, reason = LOWEST * size(start), ""
    while point is not None and len(pieces) < MOST_PIECES:
        piece, reason = _piece(continuation, point, size, (smallest, largest))
        pieces.append(piece if pieces else (*before, *piece))
        if reason == REACHED:
            break
        interruptions.append(reason)
        point = _beyond(continuation, [each for piece in pieces for each in piece])
    complete = reason == REACHED
    message = "; ".join([*interruptions, "followed on above it", REACHED] if complete and interruptions else [reason])
    return ModePath(tuple(pieces), complete, message)


def _linear_points(
    continuation: ModeContinuation, start: MotionPoint, levels: tuple[float, ...]
) -> tuple[list[ModePoint], MotionPoint]:
    """Points of a linear mode, the last of them apart: there the continuation goes on."""
    points, last = [], start
    for level in levels:
        found = continuation.solve_at_level(_scaled(last.state, level))
        if found is None:
            break
        points.append(ModePoint.of(last))
        last = found
    return points, last


def _piece(
    continuation: ModeContinuation, start: MotionPoint, size: Size, limits: tuple[float, float]
) -> tuple[tuple[ModePoint, ...], str]:
    """Points from one on, and why they end; those of a curve that goes back the way it came are left out."""
    points = [ModePoint.of(start)]
    if size(start) > limits[1]:
        return tuple(points), REACHED
    for point in continuation.points(start):
        points.append(ModePoint.of(point))
        amplitude, shares = size(point), harmonic_shares(point.linearised.coordinates)
        if amplitude > limits[1]:
            return tuple(points), REACHED
        if np.max(shares, initial=0.0) > OTHER_MODE:
            return tuple(points), _where(points[-1])
        if amplitude < limits[0]:
            top = int(np.argmax([each.state.level for each in points]))
            return tuple(points[: top + 1]), _where(points[top])
    many = len(points) > MOST_POINTS
    why = f"{MOST_POINTS} points were computed" if many else "no next motion was found"
    return tuple(points), f"{why}, {_where(points[-1])}"


def _where(point: ModePoint) -> str:
    """Frequency of a motion at which a piece ends, and its largest higher harmonic."""
    frequency = point.state.omega / (2.0 * np.pi)
    shares = harmonic_shares(point.coordinates)
    if np.max(shares, initial=0.0) < OWN_MODE:
        return f"at {frequency:.6g} Hz"
    h = int(np.argmax(shares)) + 2
    return f"internal resonance 1:{h} at {frequency:.6g} Hz (harmonic {h} at {h * frequency:.6g} Hz)"


def _beyond(continuation: ModeContinuation, points: list[ModePoint]) -> MotionPoint | None:
    """The mode at an amplitude above all `points`, from the highest of them that belongs to it; None if not found."""
    own = [each for each in points if np.max(harmonic_shares(each.coordinates), initial=0.0) < OWN_MODE]
    if not own:
        return None
    highest, base = max(each.state.level for each in points), max(own, key=lambda each: each.state.level)
    for jump in JUMPS:
        for harmonics in (len(base.coordinates) - 1, 1):
            found = continuation.solve_at_level(_scaled(base.state, highest + jump, harmonics))
            if found is not None and np.max(harmonic_shares(found.linearised.coordinates), initial=0.0) < OWN_MODE:
                return found
    return None


def _scaled(state: MotionState, level: float, harmonics: int | None = None) -> MotionState:
    """A motion with its vibration scaled to another level, of all harmonics or up to one; the mean stays."""
    factor = float(np.exp(level - state.level))
    displacement = state.displacement.copy()
    displacement[1:] *= factor
    if harmonics is not None:
        displacement[2 * harmonics + 1 :] = 0.0
    return replace(state, displacement=displacement, carrier=state.carrier * factor, level=level)

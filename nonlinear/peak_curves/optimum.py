"""The value of a parameter at which the highest peak is lowest.

Peaks are followed over the parameter from the responses at a few values; the highest of them at each value is the
envelope. Its minimum is smooth, where one peak has its minimum, or a kink, where two peaks exchange. The response at
the optimum is solved again with the search for isolated branches: a peak that was not followed is followed too, until
the search finds no higher one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from nonlinear.branches.worst_motion import WorstMotion
from nonlinear.contact.fourier import to_real
from nonlinear.contact.parameters import Array
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.peak_curves.parameter_family import ParameterFamily, Problem
from nonlinear.peak_curves.peak_branch import PeakPiece, follow_peak
from nonlinear.peak_curves.peak_curve import PeakContinuation, PeakPoint
from nonlinear.peak_curves.peak_derivatives import peak_derivatives
from nonlinear.response_curve import ResponseCurve
from nonlinear.response_solver import forced_response

FIRST_SHARES = (0.0, 0.5, 1.0)  # of the range, at which the response is solved
SAMPLES = 2001  # of the envelope
ROUNDS = 4
SAME = 1e-3  # relative difference of amplitude and frequency of two peaks that count as one
SECANT, RESOLUTION, ITERATIONS = 1e-3, 1e-9, 8  # of the share, in the refinement of a smooth minimum
WITHIN = 1.1  # factor on the lowest amplitude that bounds the range told of
FLAT = 1e-3  # relative variation of the envelope that counts as none

Kind = Literal["smooth", "kink", "edge", "flat"]


@dataclass(frozen=True)
class Optimum:
    """Where the highest peak over a parameter is lowest.

    Attributes
    ----------
    value : float
        The parameter, SI units.
    frequency_hz, amplitude_m : float
        The peak there.
    kind : {"smooth", "kink", "edge", "flat"}
        A minimum of one peak; an exchange of two; an end of the range; the parameter hardly does anything.
    curvature : float
        Second derivative of the amplitude by the parameter at a smooth minimum; NaN else.
    within : (float, float)
        Range of the parameter around it in which the highest peak is at most 10 % higher.
    derivatives : dict of str to float
        Derivatives of the peak amplitude with respect to the parameters of contact, load and damping, m per unit.
    worst : WorstMotion or None
        The worst motion at the optimum, from a response solved with all options.
    pieces : tuple of PeakPiece
        The peaks followed.
    family : ParameterFamily
        Problems and range.
    message : str
        One line that says what was found.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import find_optimum
    >>> optimum = find_optimum((modal, contact, excitation, options), "preload", 0.5, 4.0)
    >>> print(optimum.message)
    preload: smooth minimum at 3.06004, 1.014 m at 0.251939 Hz
    >>> bool(optimum.within[0] < optimum.value < optimum.within[1]), abs(optimum.derivatives["preload"]) < 1e-6
    (True, True)
    """

    value: float
    frequency_hz: float
    amplitude_m: float
    kind: Kind
    curvature: float
    within: tuple[float, float]
    derivatives: dict[str, float]
    worst: WorstMotion | None
    pieces: tuple[PeakPiece, ...]
    family: ParameterFamily
    message: str

    def envelope(self, values: Array) -> Array:
        """Highest followed peak at some values of the parameter, m; NaN where none is known.

        Parameters
        ----------
        values : (k,) array
            The parameter, SI units.
        """
        family = self.family
        return _envelope(self.pieces, (np.asarray(values) - family.low) / (family.high - family.low))


@dataclass
class _Search:
    """Followed peaks, as they are added."""

    family: ParameterFamily
    progress: Callable[[str], None]
    follower: PeakContinuation = field(init=False)
    pieces: list[PeakPiece] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.follower = PeakContinuation(self.family)

    def solve(self, share: float) -> ResponseCurve:
        """The response at a share; its peaks that are not known are followed."""
        value = self.family.value(share)
        self.progress(f"response at {self.family.name} = {value:.6g}")
        modal, contact, excitation, options = self.family.at(share)
        curve = forced_response(modal, contact, excitation, options)
        continuation = self.follower.continuation(share)
        for number, branch in enumerate((curve, *curve.detached)):
            origin = "main branch" if number == 0 else branch.origin
            for peak in branch.peaks:
                if peak.located and not self._known(share, peak.amplitude_m, peak.frequency_hz):
                    self._follow(share, _point(continuation, branch, peak.index), origin)
        return curve

    def _follow(self, share: float, point: SolutionPoint | None, origin: str) -> None:
        start = None if point is None else self.follower.peak_near(share, point)
        if start is not None and start.is_maximum:
            self.progress(f"peak {start.amplitude:.4g} m followed over {self.family.name}")
            self.pieces += follow_peak(self.follower, start, origin)

    def _known(self, share: float, amplitude: float, frequency_hz: float) -> bool:
        for piece in self.pieces:
            if piece.holds(share):
                near = piece.nearest(share).point.omega / (2.0 * np.pi)
                same = abs(float(piece.amplitude_at(np.array([share]))[0]) / amplitude - 1.0) < SAME
                if same and abs(near / frequency_hz - 1.0) < 30.0 * SAME:
                    return True
        return False


def find_optimum(
    problem: Problem, name: str, low: float, high: float, progress: Callable[[str], None] = lambda line: None
) -> Optimum:
    """The value of a parameter in a range at which the highest peak is lowest.

    Parameters
    ----------
    problem : tuple
        Modes, contact, excitation and options, as the arguments of `forced_response`; the number of harmonics is
        fixed.
    name : str
        The parameter: "interference", "friction", "normal_stiffness", "tangential_stiffness", "preload", "force" or
        "damping"; see `with_parameter`.
    low, high : float
        Its range, SI units.
    progress : callable
        Called with a line on what is done.

    Returns
    -------
    Optimum
        The optimum, confirmed by a response with all options.

    Raises
    ------
    ArithmeticError
        No response in the range has a peak that could be followed.
    OptionsError
        There is no such parameter, or the number of harmonics is "auto".

    Examples
    --------
    With the names of the example of `forced_response`: the stiffer the slider, the lower the peak.

    >>> from nonlinear import find_optimum
    >>> optimum = find_optimum((modal, contact, excitation, options), "tangential_stiffness", 1.0, 3.0)
    >>> optimum.kind, optimum.value
    ('edge', 3.0)
    """
    search = _Search(ParameterFamily(problem, name, low, high), progress)
    for share in FIRST_SHARES:
        search.solve(share)
    if not search.pieces:
        raise ArithmeticError(f"no peak to follow over {name} from {low:.6g} to {high:.6g}")
    curve, share = None, 0.0
    for _ in range(ROUNDS):
        before = len(search.pieces)
        share = _lowest(search.pieces)
        curve = search.solve(share)
        if len(search.pieces) == before:
            break
    return _described(search, share, curve)


def _envelope(pieces: list[PeakPiece] | tuple[PeakPiece, ...], shares: Array) -> Array:
    """Highest followed peak at each share; NaN where there is none."""
    table = np.array([piece.amplitude_at(shares) for piece in pieces])
    highest = np.where(np.isnan(table), -np.inf, table).max(axis=0)
    return np.where(np.isfinite(highest), highest, np.nan)


def _lowest(pieces: list[PeakPiece]) -> float:
    """Share at which the envelope is lowest."""
    from scipy.optimize import minimize_scalar

    shares = np.linspace(0.0, 1.0, SAMPLES)
    values = _envelope(pieces, shares)
    k = int(np.nanargmin(values))
    if k in (0, SAMPLES - 1):
        return float(shares[k])

    def at(share: float) -> float:
        return float(_envelope(pieces, np.array([share]))[0])

    found = minimize_scalar(at, bounds=(shares[k - 1], shares[k + 1]), method="bounded", options={"xatol": 1e-10})
    return float(found.x) if found.fun <= values[k] else float(shares[k])


def _described(search: _Search, share: float, curve: ResponseCurve | None) -> Optimum:
    """The optimum with its kind, its curvature and its surroundings."""
    family, every = search.family, search.pieces
    here = [piece for piece in every if piece.holds(share)]
    amplitudes = [float(piece.amplitude_at(np.array([share]))[0]) for piece in here]
    top = here[int(np.argmax(amplitudes))]
    shares = np.linspace(0.0, 1.0, SAMPLES)
    envelope = _envelope(every, shares)
    kind = _kind(every, share, envelope)
    exact = search.follower.peak_near(share, _moved(search.follower, top.nearest(share), share)) or top.nearest(share)
    second = float("nan")
    if kind == "smooth":
        exact, second = _refined(search.follower, exact)
        share = exact.share
    near = _range(shares, envelope, share, WITHIN * exact.amplitude)
    span = family.high - family.low
    value, frequency = family.value(share), exact.point.omega / (2.0 * np.pi)
    within = family.value(near[0]), family.value(near[1])
    said = {
        "smooth": f"smooth minimum at {value:.6g}",
        "kink": f"two peaks exchange at {value:.6g}",
        "edge": f"no minimum inside the range: lowest at its end, {value:.6g}",
        "flat": f"the peak changes by less than {100 * FLAT:g} % over the range",
    }[kind]
    message = f"{family.name}: {said}, {exact.amplitude:.4g} m at {frequency:.6g} Hz"
    derivatives = peak_derivatives(family.at(share), exact.point)
    worst = None if curve is None else curve.worst
    return Optimum(
        value,
        frequency,
        exact.amplitude,
        kind,
        second / span**2,
        within,
        derivatives,
        worst,
        tuple(every),
        family,
        message,
    )


def _kind(every: list[PeakPiece], share: float, envelope: Array) -> Kind:
    lowest, highest = float(np.nanmin(envelope)), float(np.nanmax(envelope))
    if highest <= (1.0 + FLAT) * lowest:
        return "flat"
    if share <= 1e-6 or share >= 1.0 - 1e-6:
        return "edge"
    step = 1e-4
    values = _envelope(every, share + step * np.array([-1.0, -0.5, 0.5, 1.0]))
    left, right = (values[1] - values[0]) / (0.5 * step), (values[3] - values[2]) / (0.5 * step)
    jump, smooth = right - left, 1.5 * step * (highest - lowest)
    turns = left < -100.0 * smooth and right > 100.0 * smooth and jump > 0.2 * max(abs(left), abs(right))
    return "kink" if turns else "smooth"


def _range(shares: Array, envelope: Array, share: float, limit: float) -> tuple[float, float]:
    """Shares around the optimum up to which the envelope stays below a limit."""
    above = ~(envelope <= limit)
    left = shares[above & (shares < share)].max(initial=0.0)
    right = shares[above & (shares > share)].min(initial=1.0)
    return float(left), float(right)


def _refined(follower: PeakContinuation, peak: PeakPoint) -> tuple[PeakPoint, float]:
    """The peak at which the derivative by the share vanishes, near a peak, and the second derivative; by secants."""
    second, last, step = float("nan"), peak, SECANT
    for _ in range(ITERATIONS):
        share = peak.share + step
        found = follower.peak_near(share, _moved(follower, peak, share))
        if found is None or found.rate == peak.rate:
            break
        last, peak = peak, found
        second = (peak.rate - last.rate) / (peak.share - last.share) if abs(step) > RESOLUTION else second
        step = -peak.rate / second
        if abs(step) < RESOLUTION or not abs(step) < 10.0 * SECANT:
            break
    sides = [follower.peak_near(peak.share + at, _moved(follower, peak, peak.share + at)) for at in (SECANT, -SECANT)]
    if sides[0] is not None and sides[1] is not None:
        second = (sides[0].rate - sides[1].rate) / (2.0 * SECANT)
    return peak, second


def _moved(follower: PeakContinuation, peak: PeakPoint, share: float) -> SolutionPoint:
    """A followed peak with the equations of another share."""
    return replace(peak.point, balance=follower.continuation(share).balance)


def _point(continuation: Continuation, branch: ResponseCurve, index: int) -> SolutionPoint | None:
    """A stored solution of a curve with the harmonics of a continuation."""
    rows = np.zeros((2 * continuation.balance.n_harmonics + 1, continuation.balance.n_contacts, 3))
    stored = to_real(branch.relative_displacement[index])
    count = min(len(rows), len(stored))
    rows[:count] = stored[:count].reshape(count, -1, 3)
    unknown, omega = continuation.balance.unknown(rows), 2.0 * np.pi * float(branch.frequency_hz[index])
    return continuation.solver.point(unknown, omega, (0.0 * unknown, 1.0), 0, 0.0, continuation.options.step)

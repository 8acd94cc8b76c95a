"""What a response curve tells of: its peaks and bifurcations, why it ended, and its worst motion; plain data."""

from dataclasses import dataclass
from enum import Enum
from typing import Literal

Kind = Literal["complete", "start failed", "step too small", "too many points", "turned back"]
Motion = Literal["periodic", "quasi-periodic"]
END_TOLERANCE = 1e-9  # relative distance of a frequency from a limit of the range that counts as reached


@dataclass(frozen=True)
class WorstMotion:
    """The highest motion that can persist.

    Attributes
    ----------
    amplitude_m : float
        Largest abs(x(t)) of the output, over all blades, m; NaN where no motion is known to persist.
    frequency_hz : float
        Excitation frequency, Hz.
    branch : int
        Branch of the motion: 0, the main branch; k, detached branch k; -1, a periodic motion on no branch found. A
        quasi-periodic motion belongs to the branch of the unstable solution that time integration started from.
    index : int
        Index of that solution among the points of its branch.
    motion : str
        "periodic", or "quasi-periodic": every motion that does not repeat.
    scatter : float
        How far the largest displacements of single periods and blades lie below the amplitude, at most, relative to
        it. 0 for a periodic motion that all blades share.
    nodal_diameter : int
        Nodal diameter of the perturbation by which the ring left the unstable solution; 0 without time integration.
    ring_blades : int
        Blades of the ring integrated in time; 0 without time integration.
    searched : str
        What was searched and what was not, in a sentence.
    unresolved : str
        What the search left open, so that the worst motion may be higher; "" where nothing.
    at_end : bool
        Whether it lies at an end of the frequency range, from where the response rises further: a lower bound.
    not_counted : str
        Higher motions on detached branches whose truncation error is above the tolerance, where time integration did
        not confirm them; "" where there are none.
    truncation_error : float
        Estimated relative error of the amplitude by neglected harmonics, that of its branch; 0 for a motion of time
        integration, NaN without an estimate.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> curve.worst.motion, curve.worst.branch, curve.worst.amplitude_m == curve.peak.amplitude_m
    ('periodic', 0, True)
    """

    amplitude_m: float
    frequency_hz: float
    branch: int
    index: int
    motion: Motion = "periodic"
    scatter: float = 0.0
    nodal_diameter: int = 0
    ring_blades: int = 0
    searched: str = ""
    unresolved: str = ""
    at_end: bool = False
    not_counted: str = ""
    truncation_error: float = float("nan")


@dataclass(frozen=True)
class TerminationReason:
    """Why a continuation ended, and where.

    Attributes
    ----------
    kind : str
        "complete": the frequency range is covered, or the branch is closed. "start failed": no solution at its start.
        "step too small": no next point was found with the smallest step. "too many points": `max_points` of the
        options was reached. "turned back": the branch left the range at the end where it began.
    frequency_hz : float
        Frequency of the last point, Hz.
    message : str
        The reason in a sentence.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> curve.termination.kind, curve.termination.complete, curve.termination.frequency_hz
    ('complete', True, 0.4)
    """

    kind: Kind
    frequency_hz: float
    message: str

    @property
    def complete(self) -> bool:
        """Whether the frequency range was covered, or the branch is closed."""
        return self.kind == "complete"


@dataclass(frozen=True)
class Peak:
    """A local maximum of the amplitude along a response curve.

    Attributes
    ----------
    frequency_hz : float
        Frequency, Hz.
    amplitude_m : float
        Amplitude of the output, m.
    index : int
        Index among the points of the curve.
    located : bool
        Whether the maximum was solved for, to the peak tolerance. False where the largest amplitude lies at an end of
        the curve.
    at_end : bool
        Whether it is the amplitude at an end of the frequency range, from where the response rises further: no peak.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> peak = curve.peak
    >>> bool(peak.located), bool(peak.amplitude_m == curve.amplitude_m[peak.index])
    (True, True)
    """

    frequency_hz: float
    amplitude_m: float
    index: int
    located: bool = True
    at_end: bool = False


def at_range_end(frequency_hz: float, limits_hz: tuple[float, float]) -> bool:
    """Whether a frequency is a limit of the frequency range: the largest amplitude of a curve there is no peak.

    Parameters
    ----------
    frequency_hz : float
        Frequency, Hz.
    limits_hz : (float, float)
        The frequency range, Hz.

    Examples
    --------
    >>> from nonlinear import at_range_end
    >>> at_range_end(600.0, (150.0, 600.0)), at_range_end(599.9, (150.0, 600.0))
    (True, False)
    """
    return any(abs(frequency_hz - limit) <= END_TOLERANCE * limit for limit in limits_hz)


class BifurcationKind(Enum):
    """Kind of a bifurcation. The value is its name in text and files.

    Examples
    --------
    >>> from nonlinear import BifurcationKind
    >>> BifurcationKind("fold") is BifurcationKind.FOLD
    True
    """

    FOLD = "fold"
    BRANCH_POINT = "branch point"
    NEIMARK_SACKER = "Neimark-Sacker"
    PERIOD_DOUBLING = "period doubling"


@dataclass(frozen=True)
class Bifurcation:
    """A bifurcation of a response curve.

    At a fold the curve turns back in frequency. At a branch point another branch crosses it. Beyond a Neimark-Sacker
    bifurcation the motion is quasi-periodic, beyond a period doubling it repeats after two periods.

    Attributes
    ----------
    kind : BifurcationKind
        Kind of the bifurcation.
    frequency_hz : float
        Frequency, Hz.
    amplitude_m : float
        Amplitude of the output, m.
    index : int
        Index among the points of the curve.
    nodal_diameter : int
        k of the perturbation that begins or ceases to grow: beside that of the wave, its phase shift from blade to
        blade is 2 pi k / N_b. 0: it has the symmetry of the wave. k > 0: the blades stop moving alike, in another
        periodic motion beyond a branch point, in a quasi-periodic one beyond a Neimark-Sacker bifurcation.

    Examples
    --------
    Of a `ResponseCurve` they are `curve.bifurcations`.

    >>> from nonlinear import Bifurcation, BifurcationKind
    >>> fold = Bifurcation(BifurcationKind.FOLD, frequency_hz=201.5, amplitude_m=3e-4, index=17, nodal_diameter=0)
    >>> print(f"{fold.kind.value} at {fold.frequency_hz} Hz")
    fold at 201.5 Hz
    """

    kind: BifurcationKind
    frequency_hz: float
    amplitude_m: float
    index: int
    nodal_diameter: int = 0

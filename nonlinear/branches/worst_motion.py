"""The worst motion of a response: the highest that can persist on any branch, and what the search for it covered."""

from dataclasses import dataclass
from typing import Literal

Motion = Literal["periodic", "quasi-periodic"]


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

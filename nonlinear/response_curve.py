"""The record of a response curve: arrays over its points, peaks, bifurcations, termination, worst motion.

Plain data from the solver to the reader: nothing here solves, so that a file is read without the solver.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray, largest_lengths
from nonlinear.contact.parameters import Array, ContactParameters

Kind = Literal["complete", "start failed", "step too small", "too many points", "turned back", "too large"]
OpenKind = Literal["effort", "grows", "end", "incomplete", "undecided", "not searched"]
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
        motion that does not repeat belongs to the branch of the unstable solution that time integration started from.
    index : int
        Index of that solution among the points of its branch.
    motion : str
        "periodic"; "subharmonic 1:2": it repeats after two periods, or after as many as are named; "quasi-periodic":
        it does not repeat, but its height and scatter are constant in time; "irregular": they are not, and it was
        seen to persist.
    scatter : float
        How far the largest displacements of single periods and blades lie below the amplitude, at most, relative to
        it. 0 for a periodic motion that all blades share.
    nodal_diameter : int
        Nodal diameter of the perturbation by which the ring left the unstable solution; 0 without time integration.
        Of an `unstable` motion that of the perturbation that grows.
    ring_blades : int
        Blades of the ring integrated in time; 0 without time integration.
    periods : int
        Periods of time integration over which the motion kept its height; 0 without time integration.
    recurrence : float
        Periods of 1000 in which a blade comes within 5 % of the amplitude.
    followed_hz, followed_m : tuple of float
        Frequencies, Hz, and heights, m, over which a motion of time integration was followed; empty where it was not.
    searched : str
        What was searched and what was not, in a sentence.
    unresolved : str
        What the search left open, so that the worst motion may be higher; "" where nothing.
    open_kinds : tuple of str
        Kinds of what was left open, in the order of `unresolved`. "effort": a longer search may settle it. "grows": a
        motion without bound. "end": it lies at an end of the frequency range. "incomplete": branches were not
        followed to their ends. "undecided": the sign of a growth rate is not known. "not searched": all else.
    at_end : bool
        Whether it lies at an end of the frequency range, from where the response rises further: a lower bound.
    not_counted : str
        Higher motions on detached branches whose truncation error is above the tolerance, where time integration did
        not confirm them; "" where there are none.
    truncation_error : float
        Estimated relative error of the amplitude by neglected harmonics, that of its branch or of the ring's; for a
        motion of time integration its change by the last halving of the step; NaN without an estimate.
    unstable : bool
        Whether a perturbation of some nodal diameter grows on it: the highest solution, which the ring leaves for a
        motion that may be lower or higher. With `SolverOptions.stability` "ring" only where the sign of its growth
        rate is within its error, and the ring left it in time for a lower one.

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
    motion: str = "periodic"
    scatter: float = 0.0
    nodal_diameter: int = 0
    ring_blades: int = 0
    periods: int = 0
    recurrence: float = 1000.0
    followed_hz: tuple[float, ...] = ()
    followed_m: tuple[float, ...] = ()
    searched: str = ""
    unresolved: str = ""
    open_kinds: tuple[OpenKind, ...] = ()
    at_end: bool = False
    not_counted: str = ""
    truncation_error: float = float("nan")
    unstable: bool = False


@dataclass(frozen=True)
class TerminationReason:
    """Why a continuation ended, and where.

    Attributes
    ----------
    kind : str
        "complete": the frequency range is covered, or the branch is closed. "start failed": no solution at its start.
        "step too small": no next point was found with the smallest step. "too many points": `max_points` of the
        options was reached, or the work of `effort` done. "turned back": the branch left the range where it began, or
        came back to points of its own. "too large": contact nodes move further than `largest_motion` of the options.
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
    """Whether a frequency is a limit of the frequency range: the largest amplitude of a curve there is no peak."""
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


@dataclass(frozen=True)
class StaticContact:
    """Contact nodes in static equilibrium at speed, before the excitation acts: those of one interface, or all.

    Attributes
    ----------
    force_n : float
        Normal force, the sum over the nodes, N.
    open_share : float
        Share of the contact that is open: nodes by normal stiffness, which is shared by area; by number without any.
    lowest_m, highest_m : float
        Smallest and largest v = v0 + d_n of the nodes, m: above 0 pressed together, below 0 a gap.
    opened : bool
        Whether nodes that interference or preload presses together at rest are open.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> curve.static_contact.force_n, curve.static_contact.open_share
    (2.0, 0.0)
    """

    force_n: float
    open_share: float
    lowest_m: float
    highest_m: float
    opened: bool

    @classmethod
    def of(cls, contact: ContactParameters, displacement: Array) -> "StaticContact":
        """The contact under a static relative displacement.

        Parameters
        ----------
        contact : ContactParameters
            Parameters of the nodes.
        displacement : (n_c, 3) float
            Static relative displacement in (t1, t2, n), m.
        """
        normal = displacement[:, 2]
        is_open = contact.unclipped_load(normal) <= 0.0
        weights = contact.normal_stiffness if contact.normal_stiffness.any() else np.ones(contact.n_contacts)
        v = contact.interference + normal
        return cls(
            force_n=float(contact.normal_load(normal).sum()),
            open_share=float(weights[is_open].sum() / weights.sum()),
            lowest_m=float(v.min()),
            highest_m=float(v.max()),
            opened=bool(np.any(is_open & (contact.initial_load > 0.0))),
        )

    @classmethod
    def by_interface(
        cls, contact: ContactParameters, displacement: Array, interfaces: Mapping[str, int]
    ) -> "dict[str, StaticContact]":
        """The contact of each interface: forces of different joints are no sum, nor are their gaps.

        Parameters
        ----------
        contact, displacement
            Of all nodes, as for `of`.
        interfaces : mapping of str to int
            Contact interfaces by name in the order of their nodes, with their numbers of nodes.
        """
        nodes = np.split(np.arange(contact.n_contacts), np.cumsum([*interfaces.values()])[:-1])
        return {name: cls.of(contact.at(own), displacement[own]) for name, own in zip(interfaces, nodes, strict=True)}


@dataclass(frozen=True)
class ResidualExtreme:
    """A motion with extreme residual tractions; all its numbers are of this one motion."""

    frequency_hz: float  # frequency of the peak, Hz
    amplitude_m: float  # largest displacement of the output over a period as a whole, static part included, m
    vibration_m: float  # largest displacement about the mean, m
    static_m: float  # mean (harmonic 0) of the output, m: the residual tractions deflect the blade as well
    # (n_c, 2) slider positions that lead to these tractions, m: `ContactParameters.slider_origin` of the same problem
    slider_origin: Array
    traction: Array  # (n_c, 2) mean traction (T1, T2) of the nodes over the period at the peak, N
    # curve_frequency_hz, curve_amplitude_m (P,): the response curve with sliders that start there, Hz and m: largest
    # displacements as a whole
    curve_frequency_hz: Array
    curve_amplitude_m: Array


@dataclass(frozen=True)
class ResidualBounds:
    """Lowest and highest peak of the main branch, and the band of its amplitudes at some frequencies.

    A residual traction changes the vibration and deflects the blade as well, so there are two pairs of bounds.
    """

    # lowest, highest: the lowest and the highest peak of the displacement as a whole (`ResidualExtreme.amplitude_m`)
    # that the main branch can have
    lowest: ResidualExtreme
    highest: ResidualExtreme
    # least_vibration, most_vibration: the lowest and the highest peak of the vibration alone
    # (`ResidualExtreme.vibration_m`)
    least_vibration: ResidualExtreme
    most_vibration: ResidualExtreme
    band_index: NDArray[np.int64]  # (F,) indices of some points of the main branch
    # band_lowest_m, band_highest_m (F,): lowest and highest displacement as a whole at the frequencies of these
    # points that the response reaches from the main branch when the residual tractions change, m
    band_lowest_m: Array
    band_highest_m: Array


@dataclass(frozen=True)
class ResponseCurve:
    """A nonlinear forced response: P solved points in the order of the arc length, H harmonics.

    Attributes
    ----------
    termination : TerminationReason
        Why the continuation ended.
    frequency_hz : (P,) float
        Frequency, Hz.
    amplitude_m : (P,) float
        Largest abs(x(t)) of the output over a period, m.
    harmonic_m : (P, H) float
        Amplitudes of the harmonics of the output, abs(x^(h)), m.
    static_m : (P,) float
        Harmonic 0 of the output, m.
    phase_rad : (P,) float
        Phase of harmonic 1 of the output, rad.
    stable : (P,) bool
        Whether no Floquet exponent grows, Re lambda <= 1e-6 omega, in perturbations of all nodal diameters that the
        ring allows; with `stability="wave"` of that of the wave. Without exponents: False only where an odd number
        of real exponents is positive, between two folds.
    growth_rate : (P,) float
        Largest real part of the Floquet exponents over all perturbations looked at, 1/s; on linear segments that of
        the poles of the ring with its contact springs. NaN without exponents. Between points where they are computed
        rates of decay are interpolated, and where the wave itself is unstable those of other nodal diameters, to
        some 20 %; where other nodal diameters grow, the rate is that of one that does, followed and interpolated.
    growth_nodal_diameter : (P,) int
        k of that perturbation: its phase shift from blade to blade is 2 pi k / N_b beside that of the wave,
        0 <= k <= N_b / 2 (-k has the complex conjugate exponents); -1 where not known.
    sticking, slipping, separating : (P,) int
        Number of contact nodes that stick all the time, that slip at some time without opening, that open at some
        time.
    dissipated_j : (P,) float
        Friction work per cycle of one blade, the sum over all contact nodes, J.
    iterations : (P,) int
        Newton iterations.
    kept_harmonics : (P,) int
        Harmonics balanced at the point, H or fewer.
    arc : (P,) float
        Arc length along the curve, in relative measure.
    energy_error : (P,) float
        Difference of work input and dissipated work per cycle, relative to the larger of the two.
    output : (P, H+1) complex
        Fourier coefficients x^(h) of the output, m.
    relative_displacement : (P, H+1, n_c, 3) complex
        Fourier coefficients d^(h) in (t1, t2, n), m.
    contact_force : (P, H+1, n_c, 3) complex
        Fourier coefficients f_R^(h) in (t1, t2, n), N.
    peak : Peak or None
        The highest local maximum; an end of the curve if that is higher (`Peak.at_end`: no peak).
    peaks : tuple of Peak
        All local maxima.
    bifurcations : tuple of Bifurcation
        Folds and other bifurcations.
    seconds : float
        Time of the solution, s.
    harmonics : int
        Number of harmonics H.
    truncation_error : float
        Estimated relative error of the highest amplitude of the branch by neglected harmonics; NaN without an
        estimate.
    sampling_error, sampling_frequency_error : float
        Estimated relative errors of the amplitude and of the frequency of the peak by time sampling; 0 with
        event-driven integration, NaN without an estimate, inf where the peak is lost without samples.
    detached : tuple of ResponseCurve
        Isolated branches, and the far part of an incomplete curve.
    branches_left_out : int
        Solutions found on further detached branches that were not followed, as there were too many branches; -1 where
        the search was not finished with the work of `effort`.
    origin : str
        How a detached branch was found; empty for the main branch.
    free_nodes : int
        Contact nodes at which friction leaves the static traction undetermined at the peak, as they stick all the
        time along t1 or t2; -1 where it is not known.
    residual_bounds : ResidualBounds or None
        Lowest and highest peak over the admissible residual tractions; None unless asked for.
    worst : WorstMotion or None
        The highest motion that can persist on any branch; None on a detached branch and without points.
    truncation_branch : str
        Where the peak lies with more harmonics. "kept": on the branch. "detached": on a detached branch; the branch
        itself is lower, and `truncation_error` compares with its highest amplitude. "lost": not known, and the error
        may be larger than estimated. "": no estimate.
    truncation_frequency_hz : float
        Frequency of the highest amplitude of the branch with more harmonics, Hz.
    motion_truncation_error : float
        Estimated relative error of the motion at the peak, on whatever branch it lies with more harmonics. Smaller
        than `truncation_error` where the peak detaches.
    outputs : mapping of str to (P, H+1, c) complex
        Fourier coefficients of the further outputs that `SolverOptions.outputs` names; c = 3 for a vector x, y, z.
    static_contact : StaticContact or None
        All contact nodes in static equilibrium at speed; None on a detached branch and without a solution. Of several
        interfaces, each: `StaticContact.by_interface`.
    static_displacement : (n_c, 3) float or None
        Relative displacement (t1, t2, n) of that equilibrium, m.

    Examples
    --------
    With the names of the example of `forced_response`.

    A slider that slips at mu N0 = 1 N behind a spring of 3 N/m dissipates 4 mu N0 (X - mu N0 / kt) a cycle:

    >>> amplitude, work = curve.harmonic_m[:, 0].max(), curve.dissipated_j.max()
    >>> bool(np.isclose(work, 4.0 * 1.0 * (amplitude - 1.0 / 3.0)))
    True
    """

    termination: TerminationReason
    frequency_hz: Array
    amplitude_m: Array
    harmonic_m: Array
    static_m: Array
    phase_rad: Array
    stable: NDArray[np.bool_]
    growth_rate: Array
    growth_nodal_diameter: NDArray[np.int64]
    sticking: NDArray[np.int64]
    slipping: NDArray[np.int64]
    separating: NDArray[np.int64]
    dissipated_j: Array
    iterations: NDArray[np.int64]
    kept_harmonics: NDArray[np.int64]
    arc: Array
    energy_error: Array
    output: ComplexArray
    relative_displacement: ComplexArray
    contact_force: ComplexArray
    peak: Peak | None
    peaks: tuple[Peak, ...]
    bifurcations: tuple[Bifurcation, ...]
    seconds: float
    harmonics: int
    truncation_error: float
    sampling_error: float = float("nan")
    sampling_frequency_error: float = float("nan")
    detached: tuple["ResponseCurve", ...] = ()
    origin: str = ""
    branches_left_out: int = 0
    free_nodes: int = -1
    residual_bounds: ResidualBounds | None = None
    worst: WorstMotion | None = None
    truncation_branch: str = ""
    truncation_frequency_hz: float = float("nan")
    motion_truncation_error: float = float("nan")
    outputs: Mapping[str, ComplexArray] = field(default_factory=dict)
    static_contact: StaticContact | None = None
    static_displacement: Array | None = None

    def amplitude_of(self, name: str) -> Array:
        """Largest abs(x(t)) of a further output over a period at each point, (P,); of a vector its largest length.

        Parameters
        ----------
        name : str
            One of `outputs`.
        """
        return largest_lengths(self.outputs[name])

    @property
    def points(self) -> int:
        """Number of solved points."""
        return self.frequency_hz.size

    @property
    def turning_points(self) -> NDArray[np.int64]:
        """Indices of the points at which the frequency turns back (folds)."""
        direction = np.sign(np.diff(self.frequency_hz))
        return np.flatnonzero(direction[1:] * direction[:-1] < 0) + 1


def by_height(branches: Iterable[ResponseCurve]) -> tuple[ResponseCurve, ...]:
    """Detached branches by falling highest amplitude: their order everywhere."""
    return tuple(sorted(branches, key=lambda branch: -float(np.max(branch.amplitude_m, initial=0.0))))

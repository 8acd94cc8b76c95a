"""A response curve as arrays over its points, with the highest motion that can persist on any of its branches."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from nonlinear.branches.branch import Branch
from nonlinear.branches.records import Bifurcation, Peak, TerminationReason, WorstMotion, at_range_end
from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array
from nonlinear.continuation.response_quantities import (
    evaluate_responses,
    largest_amplitude,
    largest_lengths,
    output_components,
)
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.initial_solution import StaticContact
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.options import SolverOptions
from nonlinear.residual_tractions.residual_bounds import ResidualBounds

MAX_BATCH = 500  # points whose modal coordinates are in memory at a time
AMPLITUDE_JUMP = 0.02  # largest relative jump of the amplitude where the number of harmonics changes
SAME_AMPLITUDE = 1e-9  # relative difference of two amplitudes that count as one


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
        some 20 %; where perturbations grow, the rate is that of one that does, followed from point to point.
    growth_nodal_diameter : (P,) int
        k of that perturbation: its phase shift from blade to blade is 2 pi k / N_b beside that of the wave,
        0 <= k <= N_b / 2 (-k has the complex conjugate exponents); -1 where not known.
    sticking, slipping, separating : (P,) int
        Number of contact nodes that stick all the time, that slip at some time without opening, that open at some
        time.
    dissipated_j : (P,) float
        Friction work per cycle on one contact face, J. Each blade has one pair of faces.
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
        Solutions found on further detached branches that were not followed, as there were too many branches.
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
        Contact in static equilibrium at speed; None on a detached branch and without a solution.

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


def by_height(branches: Iterable[ResponseCurve]) -> tuple[ResponseCurve, ...]:
    """Detached branches by falling highest amplitude: their order everywhere."""
    return tuple(sorted(branches, key=lambda branch: -float(np.max(branch.amplitude_m, initial=0.0))))


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

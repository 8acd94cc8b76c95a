"""A response curve as arrays over its points."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nonlinear.branches.bifurcations import Bifurcation
from nonlinear.branches.branch import Branch
from nonlinear.branches.peaks import Peak
from nonlinear.branches.termination import TerminationReason
from nonlinear.contact.fourier import ComplexArray, to_complex
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array
from nonlinear.continuation.response_quantities import largest_amplitude, responses
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.residual import HarmonicBalance

LONGEST_PIECE = 500
JUMP = 0.02  # the amplitude may jump by less than this where the number of harmonics changes


@dataclass(frozen=True)
class ResponseCurve:
    """A nonlinear forced response: P solved points in the order of the arc, H harmonics.

    Attributes
    ----------
    termination : how the curve ended.
    frequency_hz, amplitude_m, static_m, phase_rad, arc : (P,); amplitude is the largest |x(t)| of the output over a
        period, static harmonic 0, phase that of harmonic 1, arc the length along the curve (relative measure).
    harmonic_m : (P, H), |x^(h)|. output : (P, H+1) complex, x^(h).
    stable : (P,) bool; whether all Floquet exponents have negative real parts, for perturbations with the symmetry of
        the travelling wave. growth_rate : (P,), the largest of these real parts, 1/s; NaN where not asked for: then
        `stable` is False only where an odd number of real exponents is positive, between two folds.
    sticking, slipping, separating : (P,) nodes whose worst state in the cycle is that.
    dissipated_j : (P,) friction work a cycle on one contact face, J (one blade owns one face pair).
    energy_error : (P,) relative mismatch of the work put in and dissipated.
    iterations : (P,) Newton iterations. kept_harmonics : (P,) harmonics balanced at the point, H or fewer.
    relative_displacement, contact_force : (P, H+1, n_c, 3) complex, d^(h) and f_R^(h) in (t1, t2, n).
    bifurcations : folds and other changes of stability, located.
    peak, peaks : the highest local maximum (an end of the curve if there is none higher), and all of them.
    seconds : time of the solution. truncation_error : estimated relative error of the peak amplitude by the
        harmonics left out.
    detached : curves of the branches that were found beside this one, and of the far side of an incomplete curve.
    """

    termination: TerminationReason
    frequency_hz: Array
    amplitude_m: Array
    harmonic_m: Array
    static_m: Array
    phase_rad: Array
    stable: NDArray[np.bool_]
    growth_rate: Array
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
    detached: tuple["ResponseCurve", ...] = ()

    @property
    def points(self) -> int:
        """Number of solved points."""
        return self.frequency_hz.size

    @property
    def turning_points(self) -> NDArray[np.int64]:
        """Indices of the points at which the frequency turns around."""
        direction = np.sign(np.diff(self.frequency_hz))
        return np.flatnonzero(direction[1:] * direction[:-1] < 0) + 1


def assemble_curve(
    balance: HarmonicBalance, trace: Branch, output: str, truncation_error: float = float("nan")
) -> ResponseCurve:
    """Evaluate the quantities of every point and arrange them as arrays; `balance` counts where there is no point."""
    points = trace.points
    n_contacts = balance.n_contacts
    n_harmonics = max((point.balance.n_harmonics for point in points), default=balance.n_harmonics)

    def stacked(rows: Iterable[ComplexArray], *shape: int) -> ComplexArray:
        """Coefficients of all points, those that were not kept at a point being zero there."""
        result = np.zeros((len(points), n_harmonics + 1, *shape), dtype=complex)
        for index, row in enumerate(rows):
            result[index, : row.shape[0]] = row
        return result

    response = np.zeros((len(points), n_harmonics + 1), dtype=complex)
    friction, mismatch = np.zeros((2, len(points)))
    for some in _pieces(points):
        found = responses(points[some], output)
        response[some, : found.output.shape[1]] = found.output
        friction[some], mismatch[some] = found.friction, found.mismatch
    kept = {point.balance.n_harmonics for point in points}
    state = np.array([point.contact.state for point in points], dtype=int).reshape(len(points), n_contacts)
    omega = np.array([point.omega for point in points]) / (2.0 * np.pi)
    amplitude = np.array([largest_amplitude(row).value for row in response])
    peaks = tuple(Peak(float(omega[i]), float(amplitude[i]), i) for i in trace.peak_indices)
    return ResponseCurve(
        termination=trace.termination,
        frequency_hz=omega,
        amplitude_m=amplitude,
        harmonic_m=np.abs(response[:, 1:]),
        static_m=response[:, 0].real,
        phase_rad=np.angle(response[:, 1]),
        stable=np.array([point.stable for point in points], dtype=bool),
        growth_rate=np.array([point.growth_rate for point in points]),
        sticking=(state == STICK).sum(axis=1),
        slipping=(state == SLIP).sum(axis=1),
        separating=(state == LIFT_OFF).sum(axis=1),
        dissipated_j=friction,
        iterations=np.array([point.iterations for point in points], dtype=int),
        kept_harmonics=np.array([point.balance.n_harmonics for point in points], dtype=int),
        arc=np.array([point.arc for point in points]),
        energy_error=mismatch,
        output=response,
        relative_displacement=stacked((to_complex(point.displacement) for point in points), n_contacts, 3),
        contact_force=stacked((to_complex(point.contact.force) for point in points), n_contacts, 3),
        peak=_highest(peaks, omega, amplitude, 1e-9 if len(kept) < 2 else JUMP),
        peaks=peaks,
        bifurcations=tuple(
            Bifurcation(kind, float(omega[i]), float(amplitude[i]), i) for kind, i in trace.bifurcations
        ),
        seconds=0.0,
        harmonics=n_harmonics,
        truncation_error=truncation_error,
    )


def _pieces(points: list[SolutionPoint]) -> Iterator[slice]:
    """Runs of neighbours that have the same balance, not too long for their modal coordinates to be kept."""
    start = 0
    for index in range(1, len(points) + 1):
        last = index == len(points)
        if last or points[index].balance is not points[start].balance or index - start == LONGEST_PIECE:
            yield slice(start, index)
            start = index


def _highest(peaks: tuple[Peak, ...], omega: Array, amplitude: Array, slack: float) -> Peak | None:
    """The highest located peak; the largest amplitude, if that is higher by more than the relative `slack`."""
    if amplitude.size == 0:
        return None
    largest = int(np.argmax(amplitude))
    inside = max(peaks, key=lambda peak: peak.amplitude_m, default=None)
    if inside is not None and inside.amplitude_m >= (1.0 - slack) * amplitude[largest]:
        return inside
    return Peak(float(omega[largest]), float(amplitude[largest]), largest, located=False)

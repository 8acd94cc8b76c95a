"""Options of the solver: excitation, frequency range, harmonics, tolerances, and the work that may be done."""

import cmath
import math
from dataclasses import dataclass, field
from typing import Literal

Method = Literal["coupled", "static-first"]
Integration = Literal["exact", "sampled"]
Stability = Literal["ring", "wave", "folds"]
ResidualTractions = Literal["projected", "bounds"]
Search = Literal["off", "quick", "standard", "thorough"]
Objective = Literal["displacement", "harmonic_1"]

Measure = float | Literal["harmonic_1"] | None  # of a motion: with this mean, its first harmonic alone, as it is

HIGHEST_EXCITED = 31  # harmonic of the excitation
# most that the search for the worst motion in time costs, relative to the curve with its branches and their stability
SEARCH_COST: dict[Search, float] = {"off": 0.0, "quick": 0.25, "standard": 1.0, "thorough": 10.0}
TRUNCATION_TOLERATED = 0.05  # truncation error of a peak or of the worst motion above which H is too small
NO_PEAK = "the worst motion lies at an end of the frequency range, which is no peak"
NEARLY_LOWEST = 1.1  # factor on the lowest worst motion that bounds the values told of beside it
MOST_UNKNOWNS = 10_000  # of a harmonic balance; its dense Jacobian then takes 0.8 GB
# work of one curve at effort 1, in millions of operations, about as many milliseconds
MOST_WORK: dict[str, float] = {"branch": 3e4, "stability": 8e4, "detached": 6e4}


def least_samples(n_harmonics: int) -> int:
    """Smallest number of instants per period at which the contact force of H harmonics is sampled: 4 H + 4."""
    return 4 * n_harmonics + 4


class OptionsError(ValueError):
    """A solver option out of its range; the message names it, its value and what is allowed.

    Examples
    --------
    >>> from nonlinear import OptionsError, SolverOptions
    >>> try:
    ...     SolverOptions((150.0, 600.0), harmonics=0)
    ... except OptionsError as error:
    ...     print(error)
    harmonics: 0, allowed: 1 or more, or "auto"
    """


@dataclass(frozen=True)
class ExcitationHarmonic:
    """One harmonic of the excitation: force * amplitude * cos(order w t + phase) on the fundamental blade.

    Attributes
    ----------
    order : int
        Harmonic h of the excitation, engine order h EO.
    amplitude : float
        Amplitude relative to `Excitation.force`.
    phase_deg : float
        Phase, degrees.

    Raises
    ------
    OptionsError
        The order is below 1 or above 31, the amplitude is negative, or a number is not finite.

    Examples
    --------
    >>> from nonlinear import ExcitationHarmonic
    >>> ExcitationHarmonic(order=2, amplitude=0.3, phase_deg=90.0).factor.imag
    0.3
    """

    order: int
    amplitude: float
    phase_deg: float = 0.0

    def __post_init__(self) -> None:
        """Check ranges."""
        if not 1 <= self.order <= HIGHEST_EXCITED:
            raise OptionsError(f"order: {self.order}, allowed: 1 to {HIGHEST_EXCITED}")
        if not 0.0 <= self.amplitude < math.inf:
            raise OptionsError(f"amplitude: {self.amplitude}, allowed: 0 or more, relative to the force")
        if not math.isfinite(self.phase_deg):
            raise OptionsError(f"phase: {self.phase_deg}, allowed: a finite angle (degrees)")

    @property
    def factor(self) -> complex:
        """Complex amplitude relative to the force."""
        return cmath.rect(self.amplitude, math.radians(self.phase_deg))


@dataclass(frozen=True)
class Excitation:
    """Travelling-wave excitation.

    Attributes
    ----------
    engine_order : int
        Engine order.
    force : float
        Amplitude on one blade, N.
    harmonics : tuple of ExcitationHarmonic
        Multiples of the engine order that act as well. An entry of order 1 replaces the amplitude of the engine
        order itself, which is `force` otherwise.

    Raises
    ------
    OptionsError
        Two harmonics have the same order.

    Examples
    --------
    Engine orders 36 and 72:

    >>> from nonlinear import Excitation, ExcitationHarmonic
    >>> excitation = Excitation(engine_order=36, force=0.2, harmonics=(ExcitationHarmonic(2, 0.5),))
    >>> excitation.factors
    ((2, (0.5+0j)),)
    """

    engine_order: int
    force: float
    harmonics: tuple[ExcitationHarmonic, ...] = ()

    def __post_init__(self) -> None:
        """Check that each harmonic is given once."""
        orders = [harmonic.order for harmonic in self.harmonics]
        if len(set(orders)) < len(orders):
            raise OptionsError(f"harmonics: orders {orders}, allowed: each order once")

    @property
    def factors(self) -> tuple[tuple[int, complex], ...]:
        """Orders and complex amplitudes relative to the force, as in `rom.RelativeReceptance`."""
        return tuple((harmonic.order, harmonic.factor) for harmonic in self.harmonics)


@dataclass
class WorkBudget:
    """Work that a part of a solution may take: counted, not timed, so that results are the same on every machine."""

    most: float = math.inf  # millions of operations
    spent: float = field(default=0.0, init=False)

    def spend(self, work: float) -> None:
        """Count work."""
        self.spent += work

    @property
    def is_spent(self) -> bool:
        """Whether nothing is left."""
        return self.spent >= self.most


@dataclass(frozen=True)
class SolverOptions:
    """Frequency range, harmonics, contact integration, method and tolerances of a forced response.

    Attributes
    ----------
    frequency_hz : (low, high) float
        Frequency range, Hz.
    harmonics : int or "auto"
        Number of harmonics H: harmonics 0 .. H are balanced. "auto": as many as `harmonic_tolerance` asks for.
    harmonic_tolerance : float
        Largest estimated truncation error, relative to the peak amplitude, that "auto" accepts.
    integration : str
        How the contact force is integrated over the period. "exact": from event to event, in closed form for the
        two-slider law, with a controlled error for the cone. "sampled": at `samples` instants (AFT).
    samples : int
        Instants per period, at least 4 H + 4.
    method : str
        "coupled": static and dynamic balance together. "static-first": the classical two steps.
    detached : bool
        Whether isolated branches are searched for.
    stability : str
        "ring": Floquet exponents of every point, for perturbations of every nodal diameter that the ring allows.
        "wave": only for perturbations with the symmetry of the travelling wave. "folds": only the sign of det dR/dx,
        which tells the unstable part between two folds.
    truncation : bool
        Whether the truncation error is estimated. This takes about half the time of the curve.
    residual_tractions : str
        "projected": sliders start at `ContactParameters.slider_origin`, and the traction of a node that sticks all
        the time follows. "bounds": the lowest and the highest peak over all its admissible tractions as well.
    search : str
        How far the worst motion is sought by time integration of the ring. "off": not at all; otherwise at most so
        many times the cost of the curve, its branches and their stability: "quick" 0.25, "standard" 1, "thorough" 10.
    seed : int
        Seed of the random states from which the worst motion is sought.
    effort : float
        Factor on the work that each part of a curve may take: branches, their stability, detached branches, time
        integration. What is not finished by then is named in the result.
    output : str
        Name of the output whose peaks are located.
    objective : str
        What a search for an optimum makes low: "displacement", the largest abs(x(t)) over a period; "harmonic_1", the
        amplitude of the first harmonic of x alone. Response curves do not depend on it.
    outputs : tuple of str
        Further outputs whose motion is recorded. "NAME" of a model with outputs NAME_x, NAME_y and NAME_z is the
        vector of these.
    tolerance : float
        Residual, relative to the displacement, at which Newton's method stops.
    round_off : float
        Relative residual below which Newton's method also stops as soon as it stagnates.
    step, max_step, min_step : float
        First, largest and smallest step: arc lengths, relative to the local vibration amplitude.
    max_points : int
        Number of points after which a curve is given up, at effort 1.
    peak_tolerance : float
        Relative error of the frequency of a peak.
    largest_motion : float
        Relative displacement of two contact nodes beyond which a curve ends, m: the size of the body.

    Examples
    --------
    >>> from nonlinear import SolverOptions
    >>> options = SolverOptions((150.0, 600.0), harmonics=3, stability="wave")
    >>> print(options.fixed_harmonics, "harmonics, from", round(options.omega_range[0], 1), "rad/s")
    3 harmonics, from 942.5 rad/s
    """

    frequency_hz: tuple[float, float]
    harmonics: int | Literal["auto"] = 1
    harmonic_tolerance: float = 1e-3
    integration: Integration = "exact"
    samples: int = 1024
    method: Method = "coupled"
    detached: bool = True
    stability: Stability = "ring"
    truncation: bool = True
    residual_tractions: ResidualTractions = "projected"
    search: Search = "standard"
    seed: int = 0
    effort: float = 1.0
    output: str = "tip"
    objective: Objective = "displacement"
    outputs: tuple[str, ...] = ()
    tolerance: float = 1e-13
    round_off: float = 1e-12
    step: float = 0.05
    max_step: float = 0.25
    min_step: float = 1e-6
    max_points: int = 20000
    peak_tolerance: float = 1e-7
    largest_motion: float = math.inf

    def __post_init__(self) -> None:
        """Check ranges."""
        low, high = self.frequency_hz
        if not 0.0 < low < high < float("inf"):
            raise OptionsError(f"frequency: [{low}, {high}], allowed: 0 < low < high (Hz)")
        if self.harmonics != "auto" and (isinstance(self.harmonics, str) or self.harmonics < 1):
            raise OptionsError(f'harmonics: {self.harmonics!r}, allowed: 1 or more, or "auto"')
        if not 0.0 < self.harmonic_tolerance < 1.0:
            raise OptionsError(f"harmonic_tolerance: {self.harmonic_tolerance}, allowed: between 0 and 1")
        least = least_samples(1 if self.harmonics == "auto" else self.harmonics)
        if self.samples < least:
            raise OptionsError(f"samples: {self.samples}, allowed: {least} or more for so many harmonics")
        if self.integration not in ("exact", "sampled"):
            raise OptionsError(f'integration: {self.integration!r}, allowed: "exact" or "sampled"')
        if self.objective not in ("displacement", "harmonic_1"):
            raise OptionsError(f'objective: {self.objective!r}, allowed: "displacement" or "harmonic_1"')
        if self.stability not in ("ring", "wave", "folds"):
            raise OptionsError(f'stability: {self.stability!r}, allowed: "ring", "wave" or "folds"')
        if self.search not in SEARCH_COST:
            raise OptionsError(f'search: "{self.search}", allowed: "off", "quick", "standard" or "thorough"')
        if not 0.0 < self.effort < math.inf:
            raise OptionsError(f"effort: {self.effort}, allowed: a number above 0")
        if self.method not in ("coupled", "static-first"):
            raise OptionsError(f'method: {self.method!r}, allowed: "coupled" or "static-first"')
        if self.residual_tractions not in ("projected", "bounds"):
            raise OptionsError(f'residual_tractions: {self.residual_tractions!r}, allowed: "projected" or "bounds"')
        if self.residual_tractions == "bounds" and self.method != "coupled":
            raise OptionsError(f'method: {self.method!r}, allowed with residual_tractions "bounds": "coupled"')

    @property
    def omega_range(self) -> tuple[float, float]:
        """Frequency range in rad/s."""
        low, high = self.frequency_hz
        return 2.0 * math.pi * low, 2.0 * math.pi * high

    def budget(self, part: str) -> WorkBudget:
        """What a part of a curve may take.

        Parameters
        ----------
        part : str
            "branch", "stability" or "detached".
        """
        return WorkBudget(self.effort * MOST_WORK[part])

    @property
    def most_points(self) -> int:
        """Points after which a branch is given up."""
        return max(round(self.effort * self.max_points), 2)

    @property
    def measure(self) -> Measure:
        """What the objective counts of the motion of the output, as `output_amplitude` takes it."""
        return "harmonic_1" if self.objective == "harmonic_1" else None

    @property
    def fixed_harmonics(self) -> int:
        """Number of harmonics H as an integer.

        Raises
        ------
        OptionsError
            It is "auto", which only `forced_response` resolves.
        """
        if isinstance(self.harmonics, str):
            raise OptionsError('harmonics: "auto", allowed here: a number')
        return self.harmonics

"""Where a curve begins: the static equilibrium, and from it the periodic solution at one frequency.

Both by damped Newton's method (backtracking on the norm of the residual); where that fails, by fewer harmonics first.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.parameters import Array, ContactError, ContactParameters
from nonlinear.harmonic_balance.newton_decisions import SOFT, has_converged, stagnations_after
from nonlinear.harmonic_balance.residual import HarmonicBalance, LinearisedResidual
from nonlinear.options import SolverOptions
from nonlinear.response_curve import StaticContact
from rom.cyclic.contact_springs import contact_springs
from rom.cyclic.receptance import RelativeReceptance, Support
from rom.cyclic.sector_modes import RingModes

MAX_ITERATIONS = 40
SMALLEST_DAMPING = 1.0 / 256.0
FIRST_INCREMENT = 0.1  # of the homotopy parameter, which goes from 0 to 1
SMALLEST_INCREMENT = 1e-5
SOFTEST = 1e-8  # factor on the contact stiffness, in whose logarithm it is raised: stops may be rigid
PASSES = 3  # of the static equilibrium
Homotopy = Callable[[float], HarmonicBalance]  # the balance asked for at parameter 1, an easier one at 0


class Linearised(Protocol):
    """R(x) and, when asked for, a solution with dR/dx."""

    @property
    def residual(self) -> Array:
        """R, (n,)."""
        ...

    def solve(self, right: Array) -> Array:
        """(dR/dx)^-1 b for a right-hand side b, (n,); NaN or infinity if dR/dx is singular."""
        ...


@dataclass(frozen=True)
class NewtonResult:
    """Result of an iteration."""

    solution: Array  # (n,), last iterate
    converged: bool  # whether it solves the equations
    iterations: int  # iterations done
    residual: float  # relative residual of the last iterate


@dataclass
class ConvergenceMonitor:
    """Decides from the relative errors of an iteration whether it has converged.

    The smallest error within reach depends on the stiffness of the contacts relative to that of the structure.
    Therefore an iteration has also converged if it stagnates: once at an error below `round_off`, three times in
    a row at one below 1000 `round_off`, or four times at one below 1e4 `round_off`: a spring `k` on a flexibility
    `G` amplifies round-off by `G k`.
    """

    tolerance: float
    round_off: float
    smallest: float = np.inf
    stagnations: int = 0

    def converged(self, error: float) -> bool:
        """Take the relative error of the next iterate."""
        self.stagnations = stagnations_after(error, self.smallest, self.stagnations)
        self.smallest = min(error, self.smallest)
        return has_converged(error, self.tolerance, self.round_off, self.stagnations)


def newton(
    linearise: Callable[[Array], Linearised],
    guess: Array,
    *,
    error: Callable[[Array, Array], float],
    weighted: Callable[[Array], Array],
    tolerance: float,
    round_off: float,
    max_iterations: int = MAX_ITERATIONS,
) -> NewtonResult:
    """Solve R(x) = 0 by damped Newton steps.

    A step that does not reduce the norm of the `weighted` R is halved, down to 1/256. The shortest step is taken in
    any case: so the iteration can leave a kink of a piecewise smooth residual.
    Shapes: `guess` (n,).
    """
    monitor = ConvergenceMonitor(tolerance, round_off)
    x = guess
    linearised = linearise(x)
    relative = error(linearised.residual, x)
    for iteration in range(max_iterations):
        converged = monitor.converged(relative)
        if converged or not np.isfinite(relative):
            return NewtonResult(x, converged, iteration, relative)
        step = linearised.solve(-linearised.residual)
        if not np.isfinite(step).all():
            return NewtonResult(x, False, iteration, relative)
        norm = np.linalg.norm(weighted(linearised.residual))
        damping = 1.0
        while True:
            trial = x + damping * step
            linearised = linearise(trial)
            left = np.linalg.norm(weighted(linearised.residual))
            if left < (1.0 - 0.25 * damping) * norm or damping <= SMALLEST_DAMPING:
                break
            damping /= 2.0
        x = trial
        relative = error(linearised.residual, x)
    return NewtonResult(x, monitor.converged(relative), max_iterations, relative)


@dataclass(frozen=True)
class TruncatedBalances:
    """The balances of one problem by number of harmonics, each built when it is first asked for."""

    base: HarmonicBalance  # the problem with one number of harmonics
    contact: ContactParameters  # parameters of its contact nodes
    options: SolverOptions  # how the contact force is integrated
    _built: dict[int, HarmonicBalance] = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def highest_excited(self) -> int:
        """The highest harmonic of the excitation: no truncation may have fewer harmonics."""
        return self.base.receptance.excited_harmonics[-1]

    def balance(self, n_harmonics: int) -> HarmonicBalance:
        """The balance of harmonics 0 .. `n_harmonics`."""
        if n_harmonics == self.base.n_harmonics:
            return self.base
        if n_harmonics not in self._built:
            self._built[n_harmonics] = replace(
                self.base,
                receptance=replace(self.base.receptance, harmonics=tuple(range(n_harmonics + 1))),
                element=contact_element(self.contact, n_harmonics, self.options),
            )
        return self._built[n_harmonics]


def pad_or_truncate(unknown: Array, balance: HarmonicBalance) -> Array:
    """An unknown of any number of harmonics in the size of `balance`: zeros added, or the highest harmonics cut."""
    return np.concatenate([unknown[: balance.size], np.zeros(max(balance.size - unknown.size, 0))])


def on_support(
    receptance: RelativeReceptance, contact: ContactParameters, options: SolverOptions
) -> RelativeReceptance:
    """The receptance with bodies that contacts alone hold on soft springs in harmonic 0.

    The springs have `SOFT` of the stiffness of the contacts, and bear nothing in static equilibrium: its position is
    found by the method of multipliers, each pass of which leaves `SOFT` of the load of the springs. A mean position
    of the vibration that differs from it by some of the contacts' deflection d loads them by SOFT d.
    """
    still = replace(receptance, harmonics=(0,), force=0.0)
    if not (floating := still.floating):
        return receptance
    motion = still.relative[0].real[:, :floating]
    springs = contact_springs(contact.n_contacts, contact.normal_stiffness, contact.tangential_stiffness)
    stiffness = SOFT * float(np.sum(motion**2 * springs.reshape(-1, 1))) / floating
    if not stiffness > 0.0:
        raise ContactError("normal_stiffness: 0, allowed: above 0 where contacts alone hold a body")
    support = Support(stiffness, np.zeros(floating))
    for _ in range(PASSES):
        held = replace(still, support=support)
        try:
            displacement = static_displacement(held, contact, options)
        except ArithmeticError:  # said by who asks for the static equilibrium
            break
        force = contact_element(contact, 0, options).evaluate(displacement[None]).force.reshape(1, -1)
        position = held.modal_response(0.0, force.astype(complex))[0][0, :floating].real
        support = Support(stiffness, position)
    return replace(receptance, support=support)


def static_displacement(receptance: RelativeReceptance, contact: ContactParameters, options: SolverOptions) -> Array:
    """Static relative displacement (n_c, 3) with contact and without excitation, from sliders at rest."""
    static = replace(receptance, harmonics=(0,), force=0.0)
    balance = HarmonicBalance(static, contact_element(contact, 0, options))
    result = solve_at(balance, 0.0, np.zeros(balance.size), options)
    if not result.converged:
        # Friction is raised from zero: so the sliders leave the frictionless equilibrium one after another.
        guess = np.zeros(balance.size)
        for factor in (0.0, 0.1, 0.3, 0.6, 1.0):
            softened = replace(contact, friction=factor * contact.friction)
            element = contact_element(softened, 0, options)
            result = solve_at(replace(balance, element=element), 0.0, guess, options)
            guess = result.solution
    if not result.converged:
        raise ArithmeticError(f"no static equilibrium found: relative residual {result.residual:.2g}")
    return balance.displacement(result.solution)[0]


def static_contact(
    modal: RingModes, contact: ContactParameters, options: SolverOptions, nodes: NDArray[np.intp] | None = None
) -> StaticContact:
    """The contact in static equilibrium, before the excitation acts; all blades move alike.

    `nodes` (n,): nodes that are asked for, as those of one of several interfaces; None: all.
    """
    receptance = on_support(RelativeReceptance(modal, 0.0, (0,), 0.0), contact, options)
    displacement = static_displacement(receptance, contact, options)
    own = np.arange(contact.n_contacts) if nodes is None else nodes
    return StaticContact.of(contact.at(own), displacement[own])


def periodic_start(
    balance: HarmonicBalance,
    omega: float,
    static: Array,
    options: SolverOptions,
    contact: ContactParameters | None = None,
) -> NewtonResult:
    """The periodic solution at `omega` (rad/s) from the static displacement (n_c, 3), by homotopy if need be.

    The first homotopy raises the excitation from zero. With the `contact` given, a second one raises the friction
    coefficients, and a third the contact stiffness.
    """
    at_rest = np.zeros((2 * len(balance.receptance.harmonics) - 1, balance.n_contacts, 3))
    at_rest[0] = static
    guess = balance.unknown(at_rest)
    result = solve_at(balance, omega, guess, options)
    iterations = result.iterations
    for homotopy in _homotopies(balance, options, contact):
        if result.converged:
            break
        result = continue_homotopy(homotopy, omega, guess, options)
        iterations += result.iterations
    return replace(result, iterations=iterations)


def _homotopies(
    balance: HarmonicBalance, options: SolverOptions, contact: ContactParameters | None
) -> Iterator[Homotopy]:
    """The homotopies in excitation, friction and contact stiffness."""
    n_harmonics = len(balance.receptance.harmonics) - 1

    def with_contact(changed: ContactParameters) -> HarmonicBalance:
        return replace(balance, element=contact_element(changed, n_harmonics, options))

    yield lambda fraction: balance.with_force(fraction * balance.receptance.force)
    if contact is None:
        return
    yield lambda fraction: with_contact(replace(contact, friction=fraction * contact.friction))
    yield lambda fraction: with_contact(_stiffened(contact, SOFTEST ** (1.0 - fraction)))


def _stiffened(contact: ContactParameters, factor: float) -> ContactParameters:
    """The contact with other stiffnesses."""
    values = {name: factor * getattr(contact, name) for name in ("normal_stiffness", "tangential_stiffness")}
    return replace(contact, **values)


def continue_homotopy(homotopy: Homotopy, omega: float, guess: Array, options: SolverOptions) -> NewtonResult:
    """Natural continuation of a homotopy from 0 to 1 with an adaptive increment."""
    result = solve_at(homotopy(0.0), omega, guess, options)
    iterations, solved, increment = result.iterations, 0.0, FIRST_INCREMENT
    if result.converged:
        guess = result.solution
    while solved < 1.0 and increment > SMALLEST_INCREMENT:
        target = min(solved + increment, 1.0)
        result = solve_at(homotopy(target), omega, guess, options)
        iterations += result.iterations
        if result.converged:
            guess, solved, increment = result.solution, target, 2.0 * increment
        else:
            increment /= 4.0
    return replace(result, iterations=iterations, converged=solved == 1.0)


def solve_at(
    balance: HarmonicBalance,
    omega: float,
    guess: Array,
    options: SolverOptions,
    max_iterations: int = MAX_ITERATIONS,
) -> NewtonResult:
    """Newton's method at the frequency `omega` (rad/s) from the unknown `guess` (n,)."""

    def linearise(unknown: Array) -> LinearisedResidual:
        return balance.evaluate(unknown, omega)

    return newton(
        linearise,
        guess,
        error=balance.relative_error,
        weighted=balance.weighted,
        tolerance=options.tolerance,
        round_off=options.round_off,
        max_iterations=max_iterations,
    )

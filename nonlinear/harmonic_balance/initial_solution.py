"""Where a curve begins: the static equilibrium, and from it the periodic solution at one frequency."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.harmonic_balance.newton import MAX_ITERATIONS, NewtonResult, newton
from nonlinear.harmonic_balance.residual import HarmonicBalance, LinearisedResidual
from nonlinear.options import SolverOptions
from rom import RelativeReceptance

FIRST_INCREMENT = 0.1  # of the homotopy parameter, which goes from 0 to 1
SMALLEST_INCREMENT = 1e-5

Homotopy = Callable[[float], HarmonicBalance]  # the balance asked for at parameter 1, an easier one at 0


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


@dataclass(frozen=True)
class StaticContact:
    """Contact in static equilibrium at speed, before the excitation acts.

    Attributes
    ----------
    force_n : float
        Normal force of a face, N.
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
    yield lambda fraction: with_contact(
        replace(
            contact,
            normal_stiffness=fraction * contact.normal_stiffness,
            tangential_stiffness=fraction * contact.tangential_stiffness,
        )
    )


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
        tolerance=options.tolerance,
        round_off=options.round_off,
        max_iterations=max_iterations,
    )

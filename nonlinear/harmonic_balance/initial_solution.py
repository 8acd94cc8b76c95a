"""Where a curve begins: the static equilibrium, and the periodic solution at one frequency from it."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.harmonic_balance.newton import MAX_ITERATIONS, NewtonResult, newton
from nonlinear.harmonic_balance.residual import BalanceAt, HarmonicBalance
from nonlinear.options import SolverOptions
from rom import RelativeReceptance

FIRST_FRACTION = 0.1
SMALLEST_FRACTION = 1e-5


def static_displacement(receptance: RelativeReceptance, contact: ContactParameters, options: SolverOptions) -> Array:
    """Static relative displacement (n_c, 3) with contact and without excitation, sliders starting at rest.

    Raises
    ------
    ArithmeticError : no equilibrium was found.
    """
    static = replace(receptance, harmonics=(0,), force=0.0)
    balance = HarmonicBalance(static, contact_element(contact, 0, options))
    result = solve_at(balance, 0.0, np.zeros(balance.size), options)
    if not result.converged:
        # Friction off, then on by degrees: the sliders then leave the frictionless equilibrium one after another.
        guess = np.zeros(balance.size)
        for factor in (0.0, 0.1, 0.3, 0.6, 1.0):
            softened = replace(contact, friction=factor * contact.friction)
            element = contact_element(softened, 0, options)
            result = solve_at(replace(balance, element=element), 0.0, guess, options)
            guess = result.solution
    if not result.converged:
        raise ArithmeticError(f"no static equilibrium found: relative residual {result.residual:.2g}")
    return balance.displacement(result.solution)[0]


def periodic_start(
    balance: HarmonicBalance,
    omega: float,
    static: Array,
    options: SolverOptions,
    contact: ContactParameters | None = None,
) -> NewtonResult:
    """Solve the balance at `omega` (rad/s) from the static state; by a homotopy if need be.

    The force grows from nothing; with the `contact` given, then also its friction, and then its stiffness.
    """
    rest = np.zeros((2 * len(balance.receptance.harmonics) - 1, balance.n_contacts, 3))
    rest[0] = static
    guess = balance.unknown(rest)
    result = solve_at(balance, omega, guess, options)
    iterations = result.iterations
    for family in _homotopies(balance, options, contact):
        if result.converged:
            break
        result = _grow(family, omega, guess, options)
        iterations += result.iterations
    return replace(result, iterations=iterations)


def _homotopies(
    balance: HarmonicBalance, options: SolverOptions, contact: ContactParameters | None
) -> Iterator[Callable[[float], HarmonicBalance]]:
    """Families of balances over a fraction from 0 to 1, where they are the one asked for."""
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


def _grow(
    family: Callable[[float], HarmonicBalance], omega: float, guess: Array, options: SolverOptions
) -> NewtonResult:
    """Follow a family from 0 to 1 in steps of adaptive length."""
    result = solve_at(family(0.0), omega, guess, options)
    iterations, reached, step = result.iterations, 0.0, FIRST_FRACTION
    if result.converged:
        guess = result.solution
    while reached < 1.0 and step > SMALLEST_FRACTION:
        target = min(reached + step, 1.0)
        result = solve_at(family(target), omega, guess, options)
        iterations += result.iterations
        if result.converged:
            guess, reached, step = result.solution, target, 2.0 * step
        else:
            step /= 4.0
    return replace(result, iterations=iterations, converged=reached == 1.0)


def solve_at(
    balance: HarmonicBalance,
    omega: float,
    guess: Array,
    options: SolverOptions,
    max_iterations: int = MAX_ITERATIONS,
) -> NewtonResult:
    """Newton's method at w = `omega` (rad/s) from an unknown."""

    def linearise(unknown: Array) -> BalanceAt:
        return balance.evaluate(unknown, omega)

    return newton(
        linearise,
        guess,
        error=balance.relative_error,
        tolerance=options.tolerance,
        round_off=options.round_off,
        max_iterations=max_iterations,
    )

"""Where a curve begins: the static equilibrium, and the periodic solution at one frequency from it."""

from dataclasses import replace

import numpy as np

from nonlinear.balance import HarmonicBalance
from nonlinear.contact import Array, ContactParameters
from nonlinear.elements import contact_element
from nonlinear.newton import NewtonResult, newton
from nonlinear.options import SolverOptions
from rom import RelativeReceptance

SMALLEST_FORCE_STEP = 1e-5


def static_displacement(receptance: RelativeReceptance, contact: ContactParameters, options: SolverOptions) -> Array:
    """Static relative displacement (n_c, 3) with contact and without excitation, sliders starting at rest.

    Raises
    ------
    ArithmeticError : no equilibrium was found.
    """
    static = replace(receptance, harmonics=(0,), force=0.0)
    balance = HarmonicBalance(static, contact_element(contact, 0, options))
    result = _solve(balance, 0.0, np.zeros(balance.size), options)
    if not result.converged:
        # Friction off, then on by degrees: the sliders then leave the frictionless equilibrium one after another.
        guess = np.zeros(balance.size)
        for factor in (0.0, 0.1, 0.3, 0.6, 1.0):
            softened = replace(contact, friction=factor * contact.friction)
            element = contact_element(softened, 0, options)
            result = _solve(replace(balance, element=element), 0.0, guess, options)
            guess = result.solution
    if not result.converged:
        raise ArithmeticError(f"no static equilibrium found: relative residual {result.residual:.2g}")
    return balance.displacement(result.solution)[0]


def periodic_start(balance: HarmonicBalance, frequency: float, static: Array, options: SolverOptions) -> NewtonResult:
    """Solve the balance at `frequency` (rad/s) from the static state; under a growing force if need be."""
    rest = np.zeros((2 * len(balance.receptance.harmonics) - 1, balance.n_contacts, 3))
    rest[0] = static
    guess = balance.unknown(rest)
    result = _solve(balance, frequency, guess, options)
    if result.converged:
        return result
    full = balance.receptance.force
    reached, step, iterations = 0.0, 0.1, result.iterations
    while reached < 1.0 and step > SMALLEST_FORCE_STEP:
        target = min(reached + step, 1.0)
        result = _solve(balance.with_force(target * full), frequency, guess, options)
        iterations += result.iterations
        if result.converged:
            guess, reached, step = result.solution, target, 2.0 * step
        else:
            step /= 4.0
    return replace(result, iterations=iterations, converged=reached == 1.0)


def _solve(balance: HarmonicBalance, frequency: float, guess: Array, options: SolverOptions) -> NewtonResult:
    def linearise(unknown: Array) -> tuple[Array, Array]:
        at = balance.evaluate(unknown, frequency)
        return at.residual, at.jacobian

    return newton(
        linearise, guess, error=balance.relative_error, tolerance=options.tolerance, round_off=options.round_off
    )

"""Newton's method on a balance from a given state."""

from nonlinear.newton import newton


def solve_from(balance, omega, guess, options):
    """Result of Newton's method at `omega` (rad/s) from the unknown `guess`."""

    def linearise(unknown):
        at = balance.evaluate(unknown, omega)
        return at.residual, at.jacobian

    return newton(
        linearise, guess, error=balance.relative_error, tolerance=options.tolerance, round_off=options.round_off
    )

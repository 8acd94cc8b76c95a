"""Decisions of Newton's iterations, written once: the kernels of the corrector compile these very functions."""

MAX_CORRECTIONS = 12
SOFT = 1e-6  # stiffness of the supports of bodies that contacts hold over that of the contacts: a static error
SMALLEST_VIBRATION = 1e-6  # relative to the whole displacement; a smaller one is lost in round-off of the forces
MANY_UNKNOWNS = 120  # a factorisation costs as much as ten evaluations, not as three
SAME_SYSTEM = 1e-3  # contraction of the error by a step, below which its Jacobian also gives the tangent


def chord_steps(unknowns: int) -> int:
    """Number of steps that the factors of a Jacobian may still serve for."""
    return 2 if unknowns < MANY_UNKNOWNS else 4


def needs_factors(error: float, contraction: float, steps: int, tolerance: float) -> bool:
    """Whether the factors in hand do not suffice.

    With an error e and a contraction c of the last step, the next step with the same factors leaves 2 c e or less.
    """
    return error * (2.0 * contraction) ** steps > tolerance


def stagnations_after(error: float, smallest: float, stagnations: int) -> int:
    """Number of successive iterations, the last one included, that did not go notably below the smallest error."""
    return stagnations + 1 if error >= 0.3 * smallest else 0


def has_converged(error: float, tolerance: float, round_off: float, stagnations: int) -> bool:
    """The decision of `ConvergenceMonitor`."""
    if error <= tolerance or (error <= round_off and stagnations >= 1):
        return True
    return (error <= 1e3 * round_off and stagnations >= 3) or (error <= 1e4 * round_off and stagnations >= 4)

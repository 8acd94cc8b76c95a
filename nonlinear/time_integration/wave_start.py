"""The periodic motion that a ring starts from, with more harmonics than it was solved with.

Few harmonics make another motion. Its distance from that of the ring would count as a disturbance.
"""

import numpy as np

from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.parameters import Array
from nonlinear.harmonic_balance.initial_solution import solve_at
from nonlinear.harmonic_balance.residual import HarmonicBalance, has_odd_harmonics_only
from nonlinear.options import SolverOptions
from nonlinear.time_integration.ring import Ring

HARMONICS = 15
SAME_MOTION = 0.2  # largest relative change of the displacement by the harmonics added
MAX_ITERATIONS = 12


def with_more_harmonics(ring: Ring, omega: float, displacement: Array, harmonics: int = HARMONICS) -> Array:
    """The periodic solution with more harmonics near one with few.

    Shapes: `displacement` (2H+1, n_c, 3), returns (2H'+1, n_c, 3).
    """
    few = len(displacement)
    if few >= 2 * harmonics + 1:
        return displacement
    options = SolverOptions((1.0, 2.0), harmonics=harmonics)
    element = contact_element(ring.contact, harmonics, options)
    receptance = ring.receptance(harmonics)
    balance = HarmonicBalance(receptance, element, odd=has_odd_harmonics_only(receptance, ring.contact))
    start = np.zeros((2 * harmonics + 1, *displacement.shape[1:]))
    start[:few] = displacement
    found = solve_at(balance, omega, balance.unknown(start), options, MAX_ITERATIONS)
    solution = balance.displacement(found.solution)
    same = np.linalg.norm(solution - start) <= SAME_MOTION * np.linalg.norm(start)
    return solution if found.converged and same else displacement

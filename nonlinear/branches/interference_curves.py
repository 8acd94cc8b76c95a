"""Solutions that a curve over the interference, at fixed frequency, meets at the interference asked for.

At one frequency the solutions of all interferences form a curve from the stuck response (a large interference) to the
free one (a wide gap). Where it turns back and passes the interference asked for again, there are more solutions than
that of the main branch: also those of isolated branches. Force and interference scaled together scale the response,
so that the curve over the force tells nothing new.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from nonlinear.branches.homotopy import Homotopy
from nonlinear.branches.parameter_continuation import continue_in_parameter, solution_between
from nonlinear.contact.parameters import ContactParameters
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.solution_point import SolutionPoint

FREQUENCIES = 4  # at which there is a curve
MAX_POINTS = 300  # of a curve, in each direction
RANGE = 4.0  # of the interference on both sides, in largest normal displacements of the main branch


def solutions_over_interference(
    continuation: Continuation, main: list[SolutionPoint]
) -> Iterator[tuple[SolutionPoint, str]]:
    """Solutions on curves over the interference through points of the main branch, and how they were found.

    Parameters
    ----------
    continuation : Continuation
        The continuation, with the harmonics of the main branch.
    main : list of SolutionPoint
        The main branch.
    """
    contact = continuation.contact
    if contact is None or contact.odd:
        return
    span = RANGE * max(_normal_motion(point) for point in main)
    below, above = (shifted(contact, side * span) for side in (-1.0, 1.0))
    force = continuation.balance.receptance.force
    homotopy = Homotopy(continuation.balance, (below, above), (force, force), continuation.options)
    omega = np.array([point.omega for point in main])
    for wanted in np.linspace(*continuation.options.omega_range, FREQUENCIES + 2)[1:-1]:
        start = main[int(np.argmin(np.abs(omega - wanted)))]
        origin = f"the curve over the interference at {start.omega / (2.0 * np.pi):.4g} Hz"
        for direction in (1.0, -1.0):
            curve = continue_in_parameter(homotopy, start.omega, start.unknown, 0.5, direction, MAX_POINTS)
            for before, after in pairwise(curve):
                found = solution_between(homotopy, start.omega, before, after, 0.5)
                if found is not None:
                    yield replace(found, balance=continuation.balance), origin


def _normal_motion(point: SolutionPoint) -> float:
    """Bound of the normal vibration of the contacts, m."""
    rows = point.displacement[1:, :, 2]
    return float(np.hypot(rows[::2], rows[1::2]).sum(axis=0).max())


def shifted(contact: ContactParameters, interference: float) -> ContactParameters:
    """The contact with this much interference added at every node.

    Parameters
    ----------
    contact : ContactParameters
        Parameters of the nodes.
    interference : float
        Added to v0, m.
    """
    return contact.with_interference(contact.interference + interference)

"""Floquet exponents of all nodal diameters of one point, each solved for by itself: rings with a disk.

The modes of a sector of a bladed disk belong to one wave, so that nothing can be interpolated between nodal
diameters.
"""

from collections.abc import Mapping

import numpy as np

from nonlinear.stability.hill import HillProblem
from nonlinear.stability.point_contact import PointContact

WIDTH = 1.0 / 3.0  # of the slices of the strip around which the slider memory is linearised, in units of omega
OVERLAP = 0.02  # an eigenvalue this near to a border counts on both sides of it


def every_eigenvalue(problems: Mapping[int, HillProblem], contact: PointContact) -> list[tuple[complex, int]]:
    """Eigenvalues sigma = lambda / omega in the strip and their k, the least stable first.

    Parameters
    ----------
    problems : mapping of int to HillProblem
        The problem of each nodal diameter k.
    contact : PointContact
        The point.
    """
    memory = contact.memory is not None
    half_width = (WIDTH / 2.0 if memory else 0.5) + OVERLAP
    found: list[tuple[complex, int]] = []
    for k, problem in problems.items():
        eigenproblem = problem.eigenproblem(contact.jacobian, contact.omega, contact.memory)
        for centre in (-WIDTH, 0.0, WIDTH) if memory else (0.0,):
            values = eigenproblem.eigenvalues(1j * centre if centre else 0.0)
            found += [(complex(value), k) for value in values[np.abs(values.imag - centre) <= half_width]]
    return sorted(found, key=lambda item: -item[0].real)

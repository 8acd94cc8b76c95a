"""State and friction work of each contact node at a point of a response curve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import to_real
from nonlinear.contact.parameters import Array
from nonlinear.continuation.response_quantities import friction_work
from nonlinear.problem import Problem, ProblemTuple
from nonlinear.response_curve import ResponseCurve
from nonlinear.response_solver import build_harmonic_balance


@dataclass(frozen=True)
class NodalContact:
    """What the contact nodes do in a period."""

    state: NDArray[np.int64]  # (n_c,) worst state of each node: STICK, SLIP or LIFT_OFF
    dissipated_j: Array  # (n_c,) friction work of each node per cycle, J; together that of the curve at the point


def nodal_contact(problem: ProblemTuple, curve: ResponseCurve, index: int) -> NodalContact:
    """State and friction work of each contact node at a point of a curve."""
    displacement, force = curve.relative_displacement[index], curve.contact_force[index]
    balance = build_harmonic_balance(*Problem(*problem).with_harmonics(len(displacement) - 1))
    return NodalContact(balance.forces_of(to_real(displacement)).state, friction_work(displacement, force))

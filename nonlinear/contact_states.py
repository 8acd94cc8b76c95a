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
    """What the contact nodes do in a period.

    Attributes
    ----------
    state : (n_c,) int
        Worst state of each node: STICK, SLIP or LIFT_OFF.
    dissipated_j : (n_c,) float
        Friction work of each node per cycle, J; together that of the curve at the point.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import nodal_contact
    >>> found = nodal_contact((modal, contact, excitation, options), curve, curve.peak.index)
    >>> bool(abs(found.dissipated_j.sum() / curve.dissipated_j[curve.peak.index] - 1.0) < 1e-9)
    True
    """

    state: NDArray[np.int64]
    dissipated_j: Array


def nodal_contact(problem: ProblemTuple, curve: ResponseCurve, index: int) -> NodalContact:
    """State and friction work of each contact node at a point of a curve.

    Parameters
    ----------
    problem : tuple
        Modes, contact, excitation and options of the curve, as for `forced_response`.
    curve : ResponseCurve
        The curve, or a detached branch of one.
    index : int
        Index of the point.

    Returns
    -------
    NodalContact
        States and work of the nodes.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import SLIP, nodal_contact
    >>> nodal_contact((modal, contact, excitation, options), curve, curve.peak.index).state.tolist() == [SLIP]
    True
    """
    displacement, force = curve.relative_displacement[index], curve.contact_force[index]
    balance = build_harmonic_balance(*Problem(*problem).with_harmonics(len(displacement) - 1))
    return NodalContact(balance.forces_of(to_real(displacement)).state, friction_work(displacement, force))

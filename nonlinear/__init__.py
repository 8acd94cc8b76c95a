"""Nonlinear forced response: contact element, harmonic balance and continuation on a modal model.

A name is imported from its file when it is first asked for: options and limits need neither NumPy nor numba.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nonlinear.branches.bifurcations import Bifurcation, BifurcationKind
    from nonlinear.branches.peaks import Peak
    from nonlinear.branches.termination import TerminationReason
    from nonlinear.contact.contact_cycle import ContactCycle, contact_cycle
    from nonlinear.contact.element_choice import contact_element
    from nonlinear.contact.parameters import (
        LIFT_OFF,
        SLIP,
        STICK,
        ContactElement,
        ContactError,
        ContactForces,
        ContactParameters,
        punch_stiffness,
    )
    from nonlinear.harmonic_balance.residual import BalanceAt, HarmonicBalance
    from nonlinear.linear import linear_response
    from nonlinear.options import MOST_UNKNOWNS, Excitation, OptionsError, SolverOptions, least_samples
    from nonlinear.response_curve import ResponseCurve
    from nonlinear.response_solver import build_harmonic_balance, forced_response

__all__ = [
    "LIFT_OFF",
    "MOST_UNKNOWNS",
    "SLIP",
    "STICK",
    "BalanceAt",
    "Bifurcation",
    "BifurcationKind",
    "ContactCycle",
    "ContactElement",
    "ContactError",
    "ContactForces",
    "ContactParameters",
    "Excitation",
    "HarmonicBalance",
    "OptionsError",
    "Peak",
    "ResponseCurve",
    "SolverOptions",
    "TerminationReason",
    "build_harmonic_balance",
    "contact_cycle",
    "contact_element",
    "forced_response",
    "least_samples",
    "linear_response",
    "punch_stiffness",
]

_PLACES = {
    "LIFT_OFF": "nonlinear.contact.parameters",
    "MOST_UNKNOWNS": "nonlinear.options",
    "SLIP": "nonlinear.contact.parameters",
    "STICK": "nonlinear.contact.parameters",
    "BalanceAt": "nonlinear.harmonic_balance.residual",
    "Bifurcation": "nonlinear.branches.bifurcations",
    "BifurcationKind": "nonlinear.branches.bifurcations",
    "ContactCycle": "nonlinear.contact.contact_cycle",
    "ContactElement": "nonlinear.contact.parameters",
    "ContactError": "nonlinear.contact.parameters",
    "ContactForces": "nonlinear.contact.parameters",
    "ContactParameters": "nonlinear.contact.parameters",
    "Excitation": "nonlinear.options",
    "HarmonicBalance": "nonlinear.harmonic_balance.residual",
    "OptionsError": "nonlinear.options",
    "Peak": "nonlinear.branches.peaks",
    "ResponseCurve": "nonlinear.response_curve",
    "SolverOptions": "nonlinear.options",
    "TerminationReason": "nonlinear.branches.termination",
    "contact_cycle": "nonlinear.contact.contact_cycle",
    "contact_element": "nonlinear.contact.element_choice",
    "forced_response": "nonlinear.response_solver",
    "build_harmonic_balance": "nonlinear.response_solver",
    "least_samples": "nonlinear.options",
    "linear_response": "nonlinear.linear",
    "punch_stiffness": "nonlinear.contact.parameters",
}


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'nonlinear' has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])

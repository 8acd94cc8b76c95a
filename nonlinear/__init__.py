"""Nonlinear forced response: contact element, harmonic balance and continuation on a modal model."""

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
from nonlinear.forced_response import forced_response, harmonic_balance
from nonlinear.harmonic_balance.residual import BalanceAt, HarmonicBalance
from nonlinear.linear import linear_response
from nonlinear.options import Excitation, OptionsError, SolverOptions
from nonlinear.response_curve import ResponseCurve

__all__ = [
    "LIFT_OFF",
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
    "contact_cycle",
    "contact_element",
    "forced_response",
    "harmonic_balance",
    "linear_response",
    "punch_stiffness",
]

"""Nonlinear forced response: contact element, harmonic balance and continuation on a modal model."""

from nonlinear.balance import BalanceAt, HarmonicBalance
from nonlinear.bifurcations import Bifurcation, BifurcationKind
from nonlinear.contact import (
    LIFT_OFF,
    SLIP,
    STICK,
    ContactElement,
    ContactError,
    ContactForces,
    ContactParameters,
    punch_stiffness,
)
from nonlinear.curve import ResponseCurve
from nonlinear.cycle import ContactCycle, contact_cycle
from nonlinear.elements import contact_element
from nonlinear.linear import linear_response
from nonlinear.options import Excitation, OptionsError, SolverOptions
from nonlinear.outcome import Ending, Outcome
from nonlinear.peaks import Peak
from nonlinear.solve import forced_response, harmonic_balance

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
    "Ending",
    "Excitation",
    "HarmonicBalance",
    "OptionsError",
    "Outcome",
    "Peak",
    "ResponseCurve",
    "SolverOptions",
    "contact_cycle",
    "contact_element",
    "forced_response",
    "harmonic_balance",
    "linear_response",
    "punch_stiffness",
]

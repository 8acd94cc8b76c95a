"""Problems that differ in one parameter of the contact, of the load or of the damping."""

from __future__ import annotations

from dataclasses import dataclass, replace

from nonlinear.contact.parameters import ContactParameters
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.options import Excitation, OptionsError, SolverOptions
from nonlinear.response_solver import build_harmonic_balance
from rom import ModalModel

CONTACT = ("normal_stiffness", "tangential_stiffness", "friction", "interference", "preload")
PARAMETERS = (*CONTACT, "force", "damping")

Problem = tuple[ModalModel, ContactParameters, Excitation, SolverOptions]


def with_parameter(problem: Problem, name: str, value: float) -> Problem:
    """The problem with another value of a parameter.

    Parameters
    ----------
    problem : tuple
        Modes, contact, excitation and options.
    name : str
        "force" (N); "damping": factor on the damping of all modes; a contact parameter. Of stiffnesses, friction and
        preload the mean over the nodes becomes `value`, and all nodes change by the same factor; the interference
        changes by the same length at all nodes.
    value : float
        The new value, in SI units.

    Raises
    ------
    OptionsError
        There is no such parameter.
    """
    modal, contact, excitation, options = problem
    if name == "force":
        return modal, contact, replace(excitation, force=value), options
    if name == "damping":
        return replace(modal, damping=modal.damping * value), contact, excitation, options
    if name not in CONTACT:
        raise OptionsError(f"parameter: {name!r}, allowed: {', '.join(PARAMETERS)}")
    nodal = getattr(contact, name)
    mean = float(nodal.mean())
    if name == "interference":
        changed = nodal + (value - mean)
    else:
        changed = nodal * (value / mean) if mean != 0.0 else nodal + value
    return modal, replace(contact, **{name: changed}), excitation, options


def parameter_value(problem: Problem, name: str) -> float:
    """Value of a parameter of a problem; 1 for "damping"."""
    _, contact, excitation, _ = problem
    if name in ("force", "damping"):
        return excitation.force if name == "force" else 1.0
    return float(getattr(contact, name).mean())


@dataclass(frozen=True)
class ParameterFamily:
    """The problems over a range of one parameter, by its share s of the range: 0 at `low`, 1 at `high`.

    Attributes
    ----------
    problem : tuple
        Modes, contact, excitation and options with a fixed number of harmonics.
    name : str
        The parameter, see `with_parameter`.
    low, high : float
        Ends of the range.
    """

    problem: Problem
    name: str
    low: float
    high: float

    def check(self) -> None:
        """Refuse a range that is empty, or whose ends the problem does not allow.

        Raises
        ------
        ContactError
            A contact parameter out of its range.
        OptionsError
            There is no such parameter, or the range is empty or reaches a force or a damping of 0.
        """
        if not self.low < self.high:
            raise OptionsError(f"range of {self.name}: [{self.low:g}, {self.high:g}], allowed: low < high")
        if self.name in ("force", "damping") and self.low <= 0.0:
            raise OptionsError(f"{self.name}: {self.low:g}, allowed: above 0")
        for share in (0.0, 1.0):
            self.at(share)

    def value(self, share: float) -> float:
        """The parameter at a share of the range."""
        return self.low + share * (self.high - self.low)

    def at(self, share: float) -> Problem:
        """The problem at a share of the range."""
        return with_parameter(self.problem, self.name, self.value(share))

    def balance(self, share: float) -> HarmonicBalance:
        """The harmonic balance at a share of the range."""
        return build_harmonic_balance(*self.at(share))

    def continuation(self, share: float) -> Continuation:
        """The continuation in the frequency at a share of the range."""
        problem = self.at(share)
        return Continuation(build_harmonic_balance(*problem), problem[3], contact=problem[1])

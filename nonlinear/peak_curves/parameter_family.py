"""Problems that differ in one parameter of the contact, of the load or of the damping."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from nonlinear.contact.parameters import ContactParameters
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.options import Excitation, OptionsError, SolverOptions
from nonlinear.response_solver import build_harmonic_balance
from rom import RingModes

CONTACT = ("normal_stiffness", "tangential_stiffness", "friction", "interference", "preload")
PARAMETERS = (*CONTACT, "force", "damping")

Problem = tuple[RingModes, ContactParameters, Excitation, SolverOptions]


def with_parameter(problem: Problem, name: str, value: float) -> Problem:
    """The problem with another value of a parameter."""
    modal, contact, excitation, options = problem
    if name == "force":
        return modal, contact, replace(excitation, force=value), options
    if name == "damping":
        return modal.with_damping_times(value), contact, excitation, options
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


def with_parameters(problem: Problem, names: Sequence[str], values: Sequence[float]) -> Problem:
    """The problem with other values of several parameters."""
    for name, value in zip(names, values, strict=True):
        problem = with_parameter(problem, name, float(value))
    return problem


def check_range(problem: Problem, name: str, low: float, high: float) -> None:
    """Refuse a range that is empty, or whose ends the problem does not allow."""
    if not low < high:
        raise OptionsError(f"range of {name}: [{low:g}, {high:g}], allowed: low < high")
    if name in ("force", "damping") and low <= 0.0:
        raise OptionsError(f"{name}: {low:g}, allowed: above 0")
    for value in (low, high):
        with_parameter(problem, name, value)


class Family(Protocol):
    """Problems over a share s of the way from one to another."""

    @property
    def problem(self) -> Problem:
        """A problem with the options of all."""
        ...

    def at(self, share: float) -> Problem:
        """The problem at a share."""
        ...

    def continuation(self, share: float) -> Continuation:
        """The continuation in the frequency at a share."""
        ...


@dataclass(frozen=True)
class ParameterFamily:
    """The problems over a range of one parameter, by its share s of the range: 0 at `low`, 1 at `high`."""

    problem: Problem  # modes, contact, excitation and options with a fixed number of harmonics
    name: str  # the parameter, see `with_parameter`
    low: float  # ends of the range
    high: float  # ends of the range

    def value(self, share: float) -> float:
        """The parameter at a share of the range."""
        return self.low + share * (self.high - self.low)

    def at(self, share: float) -> Problem:
        """The problem at a share of the range."""
        return with_parameter(self.problem, self.name, self.value(share))

    def continuation(self, share: float) -> Continuation:
        """The continuation in the frequency at a share of the range."""
        return _continuation(self.at(share))


@dataclass(frozen=True)
class LineFamily:
    """The problems on the straight line between two sets of values of several parameters."""

    problem: Problem  # modes, contact, excitation and options with a fixed number of harmonics
    names: tuple[str, ...]  # the parameters, see `with_parameter`
    first: tuple[float, ...]  # their values at the shares 0 and 1, SI units
    last: tuple[float, ...]  # their values at the shares 0 and 1, SI units

    def at(self, share: float) -> Problem:
        """The problem at a share of the way."""
        values = [a + share * (b - a) for a, b in zip(self.first, self.last, strict=True)]
        return with_parameters(self.problem, self.names, values)

    def continuation(self, share: float) -> Continuation:
        """The continuation in the frequency at a share of the way."""
        return _continuation(self.at(share))


def _continuation(problem: Problem) -> Continuation:
    return Continuation(build_harmonic_balance(*problem), problem[3], contact=problem[1])

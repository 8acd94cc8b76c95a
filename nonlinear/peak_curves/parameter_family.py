"""Problems that differ in one parameter of the contact, of the load or of the damping."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.options import OptionsError
from nonlinear.problem import Problem, ProblemTuple
from nonlinear.response_solver import build_harmonic_balance

CONTACT = ("normal_stiffness", "tangential_stiffness", "friction", "interference", "preload")
PARAMETERS = (*CONTACT, "force", "damping")


def with_parameter(problem: ProblemTuple, name: str, value: float) -> Problem:
    """The problem with another value of a parameter."""
    same = Problem(*problem)
    if name == "force":
        return same._replace(excitation=replace(same.excitation, force=value))
    if name == "damping":
        return same._replace(modal=same.modal.with_damping_times(value))
    if name not in CONTACT:
        raise OptionsError(f"parameter: {name!r}, allowed: {', '.join(PARAMETERS)}")
    nodal = getattr(same.contact, name)
    mean = float(nodal.mean())
    if name == "interference":
        changed = nodal + (value - mean)
    else:
        changed = nodal * (value / mean) if mean != 0.0 else nodal + value
    return same._replace(contact=replace(same.contact, **{name: changed}))


def parameter_value(problem: ProblemTuple, name: str) -> float:
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


def check_range(problem: ProblemTuple, name: str, low: float, high: float) -> None:
    """Refuse a range that is empty, or whose ends the problem does not allow."""
    if not low < high:
        raise OptionsError(f"range of {name}: [{low:g}, {high:g}], allowed: low < high")
    if name in ("force", "damping") and low <= 0.0:
        raise OptionsError(f"{name}: {low:g}, allowed: above 0")
    for value in (low, high):
        with_parameter(problem, name, value)


@dataclass(frozen=True)
class ParameterFamily:
    """Problems in the box between two sets of values of parameters.

    A place in it is the shares (n,) of the ranges of the parameters. One share stands for the same of all: on the
    straight way from the first values to the last.
    """

    problem: Problem  # modes, contact, excitation and options with a fixed number of harmonics
    names: tuple[str, ...]  # the parameters, see `with_parameter`
    first: tuple[float, ...]  # their values at the share 0, SI units
    last: tuple[float, ...]  # their values at the share 1, SI units

    @classmethod
    def over(cls, problem: ProblemTuple, name: str, low: float, high: float) -> ParameterFamily:
        """The problems over a range of one parameter."""
        return cls(Problem(*problem), (name,), (low,), (high,))

    @property
    def name(self) -> str:
        """The parameters by name."""
        return ", ".join(self.names)

    @property
    def low(self) -> float:
        """The one parameter at the share 0."""
        return self.first[0]

    @property
    def high(self) -> float:
        """The one parameter at the share 1."""
        return self.last[0]

    def value(self, share: float) -> float:
        """The one parameter at a share of the way."""
        return self.values(share)[0]

    @property
    def spans(self) -> Array:
        """Widths of the ranges, (n,)."""
        return np.subtract(self.last, self.first)

    def values(self, place: float | Array) -> list[float]:
        """The parameters at a place."""
        found: list[float] = (np.array(self.first) + place * self.spans).tolist()
        return found

    def at(self, place: float | Array) -> Problem:
        """The problem at a place."""
        return with_parameters(self.problem, self.names, self.values(place))

    def line(self, first: Array, last: Array) -> ParameterFamily:
        """The problems on the straight way between two places."""
        return replace(self, first=tuple(self.values(first)), last=tuple(self.values(last)))

    def continuation(self, place: float | Array) -> Continuation:
        """The continuation in the frequency at a place."""
        problem = self.at(place)
        return Continuation(build_harmonic_balance(*problem), problem.options, contact=problem.contact)

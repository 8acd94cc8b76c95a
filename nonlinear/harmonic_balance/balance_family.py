"""One problem with different numbers of harmonics: their balances, and points carried from one to another."""

from dataclasses import dataclass, field, replace

import numpy as np

from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.options import SolverOptions


@dataclass(frozen=True)
class BalanceFamily:
    """The balances of one problem, each made when it is first asked for."""

    base: HarmonicBalance
    contact: ContactParameters
    options: SolverOptions
    made: dict[int, HarmonicBalance] = field(default_factory=dict)

    def balance(self, n_harmonics: int) -> HarmonicBalance:
        """The balance of harmonics 0 .. `n_harmonics`."""
        if n_harmonics == self.base.n_harmonics:
            return self.base
        if n_harmonics not in self.made:
            self.made[n_harmonics] = replace(
                self.base,
                receptance=replace(self.base.receptance, harmonics=tuple(range(n_harmonics + 1))),
                element=contact_element(self.contact, n_harmonics, self.options),
            )
        return self.made[n_harmonics]


def fitted(unknown: Array, balance: HarmonicBalance) -> Array:
    """The unknown of another number of harmonics in the size of `balance`: zeros added, or the highest cut off."""
    return np.concatenate([unknown[: balance.size], np.zeros(max(balance.size - unknown.size, 0))])


def resized(point: SolutionPoint, balance: HarmonicBalance) -> SolutionPoint:
    """The point with as many harmonics as `balance` has. Nothing is solved."""
    tangent = fitted(point.tangent[0], balance), point.tangent[1]
    return replace(point, balance=balance, unknown=fitted(point.unknown, balance), tangent=tangent)

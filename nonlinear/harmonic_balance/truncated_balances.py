"""The harmonic balance of one problem, truncated at different numbers of harmonics H."""

from dataclasses import dataclass, field, replace

import numpy as np

from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.options import SolverOptions


@dataclass(frozen=True)
class TruncatedBalances:
    """The balances of one problem by number of harmonics, each built when it is first asked for."""

    base: HarmonicBalance  # the problem with one number of harmonics
    contact: ContactParameters  # parameters of its contact nodes
    options: SolverOptions  # how the contact force is integrated
    _built: dict[int, HarmonicBalance] = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def highest_excited(self) -> int:
        """The highest harmonic of the excitation: no truncation may have fewer harmonics."""
        return self.base.receptance.excited_harmonics[-1]

    def balance(self, n_harmonics: int) -> HarmonicBalance:
        """The balance of harmonics 0 .. `n_harmonics`."""
        if n_harmonics == self.base.n_harmonics:
            return self.base
        if n_harmonics not in self._built:
            self._built[n_harmonics] = replace(
                self.base,
                receptance=replace(self.base.receptance, harmonics=tuple(range(n_harmonics + 1))),
                element=contact_element(self.contact, n_harmonics, self.options),
            )
        return self._built[n_harmonics]


def pad_or_truncate(unknown: Array, balance: HarmonicBalance) -> Array:
    """An unknown of any number of harmonics in the size of `balance`: zeros added, or the highest harmonics cut."""
    return np.concatenate([unknown[: balance.size], np.zeros(max(balance.size - unknown.size, 0))])

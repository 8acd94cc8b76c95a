"""A nonlinear forced response to solve, as plain data."""

from dataclasses import replace
from typing import NamedTuple

from nonlinear.contact.parameters import ContactParameters
from nonlinear.options import Excitation, SolverOptions
from rom.cyclic.sector_modes import RingModes

ProblemTuple = tuple[RingModes, ContactParameters, Excitation, SolverOptions]


class Problem(NamedTuple):
    """The arguments of `forced_response`."""

    modal: RingModes  # modes of the blade with free contacts
    contact: ContactParameters  # parameters of the contact nodes
    excitation: Excitation  # engine order and force
    options: SolverOptions  # frequency range, harmonics, tolerances

    def with_harmonics(self, number: int) -> "Problem":
        """The problem with a fixed number of harmonics."""
        return self._replace(options=replace(self.options, harmonics=number))

"""Problems between two problems: contact, force and structure change with a homotopy parameter s from 0 to 1."""

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.harmonic_balance.interference_path import InterferenceChange, InterferencePath
from nonlinear.harmonic_balance.residual import HarmonicBalance, LinearisedResidual
from nonlinear.options import SolverOptions

DIFFERENCE = 1e-6  # of s, for dR/ds


@dataclass(frozen=True)
class Homotopy:
    """Balances R(x, omega; s) = (1 - s) defect between a first problem, s = 0, and a last one, s = 1.

    The contact parameters and the force are interpolated linearly. What else differs between the two problems (modes,
    friction law, harmonics) is that of the last one from the start: the first solution then leaves a residual, the
    defect, which is taken away in proportion (Newton homotopy).
    """

    last: HarmonicBalance  # the problem at s = 1
    contacts: tuple[ContactParameters, ContactParameters]  # parameters of the contact nodes at s = 0 and at s = 1
    forces: tuple[float, float]  # amplitudes of the excitation at s = 0 and at s = 1, N
    options: SolverOptions  # how the contact force is integrated
    defect: Array | None = None  # (n,), residual of the first solution at s = 0, m

    def balance(self, s: float) -> HarmonicBalance:
        """The balance at the homotopy parameter s."""
        force = (1.0 - s) * self.forces[0] + s * self.forces[1]
        receptance = self.last.receptance
        if force != receptance.force:
            receptance = replace(receptance, force=force)
        element = contact_element(interpolated(*self.contacts, s), self.last.n_harmonics, self.options)
        defect = None if self.defect is None or s == 1.0 else (1.0 - s) * self.defect
        return replace(self.last, receptance=receptance, element=element, defect=defect)

    @cached_property
    def interference_change(self) -> InterferenceChange | None:
        """How the balance changes with s; None where something else than the interference changes."""
        first, last = (replace(contact, interference=self.contacts[1].interference) for contact in self.contacts)
        if self.forces[0] != self.forces[1] or interpolated(first, last, 0.0) is not last:
            return None
        shift = np.asarray(self.contacts[1].interference - self.contacts[0].interference, dtype=float)
        return InterferenceChange(shift, np.zeros(self.last.size) if self.defect is None else -self.defect)

    def from_solution(self, unknown: Array, omega: float) -> "Homotopy":
        """The homotopy of which a given (x, omega) is the solution at s = 0.

        Shapes: `unknown` (n,).
        """
        first = replace(self, defect=None).balance(0.0)
        residual = first.evaluate(unknown, omega).residual
        if first.relative_error(residual, unknown) <= self.options.tolerance:
            return replace(self, defect=None)
        return replace(self, defect=residual)


def interpolated(first: ContactParameters, last: ContactParameters, s: float) -> ContactParameters:
    """Contact parameters between two sets, linear in s; the friction law is that of the last one."""
    values = {}
    for item in fields(last):
        ends = getattr(first, item.name), getattr(last, item.name)
        if isinstance(ends[1], np.ndarray) and not np.array_equal(*ends):
            values[item.name] = (1.0 - s) * ends[0] + s * ends[1]
    return replace(last, **values) if values else last


@dataclass(frozen=True, kw_only=True)
class FixedFrequencyBalance(HarmonicBalance):
    """The balance at one frequency with the homotopy parameter in the place of the frequency.

    The continuation in the frequency becomes one in the parameter. Its `omega` is 1 + s.
    """

    homotopy: Homotopy  # the problems
    frequency: float  # excitation frequency, rad/s

    @classmethod
    def of(cls, homotopy: Homotopy, frequency: float) -> "FixedFrequencyBalance":
        """The balances of a homotopy at one frequency."""
        last = homotopy.last
        return cls(
            receptance=last.receptance,
            element=last.element,
            frozen_static=last.frozen_static,
            tiny=last.tiny,
            odd=last.odd,
            homotopy=homotopy,
            frequency=frequency,
        )

    @cached_property
    def interference_path(self) -> InterferencePath | None:
        """The interference in the place of the frequency, where nothing else changes with s."""
        change = self.homotopy.interference_change
        return None if change is None else InterferencePath(change, self.frequency, 2.0)

    def evaluate(self, unknown: Array, omega: float) -> LinearisedResidual:
        """Residual and derivatives; `dR_domega` is the derivative with respect to the homotopy parameter.

        Shapes: `unknown` (n,).
        """
        s = omega - 1.0
        linearised = self.homotopy.balance(s).evaluate(unknown, self.frequency)
        shifted = self.homotopy.balance(s + DIFFERENCE).evaluate(unknown, self.frequency)
        return replace(linearised, dR_domega=(shifted.residual - linearised.residual) / DIFFERENCE)

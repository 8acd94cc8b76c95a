"""Problems that differ in the interference only, and the interference in the place of the frequency."""

from dataclasses import dataclass

from nonlinear.contact.parameters import Array


@dataclass(frozen=True)
class InterferenceChange:
    """How a balance changes with a parameter on which only the interference depends, linearly."""

    # (n_c,), change of the interference per unit of the parameter, m. A contact force depends on d_n + v0 only, so
    # that the balance changes with the parameter as with harmonic 0 of the normal displacement that the contacts see
    shift: Array
    defect_rate: Array  # (n,), change of the residual that counts as zero per unit of the parameter, m


@dataclass(frozen=True)
class InterferencePath:
    """The parameter in the place of the frequency, at one frequency."""

    change: InterferenceChange  # what changes with the parameter
    frequency: float  # excitation frequency, rad/s
    # the parameter at which the interference is that of the contact element, and no residual but zero counts as zero
    origin: float

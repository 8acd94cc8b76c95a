"""Solutions on the branches of one problem from which the branches of another one are sought."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from nonlinear.branches.branch_lifting import representative_indices
from nonlinear.contact.fourier import ComplexArray, to_real
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.options import Excitation


@dataclass(frozen=True)
class BranchStart:
    """A solution of a problem, as a start for another problem.

    Attributes
    ----------
    frequency_hz : float
        Frequency, Hz.
    displacement : (2H+1, n_c, 3) float
        Real Fourier coefficients of the relative displacement, m.
    contact : ContactParameters
        Contact of the problem that it solves.
    force : float
        Excitation amplitude of that problem, N.
    label : str
        Name of that problem, such as "contact.interference = -60 um".
    branch : int
        Number of the branch that it is taken from.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import branch_starts
    >>> top = branch_starts(curve, contact, excitation, "contact.preload = 2 N")[0]
    >>> top.label, top.branch, top.displacement.shape  # harmonic 0, Re and Im of harmonic 1
    ('contact.preload = 2 N', 0, (3, 1, 3))
    """

    frequency_hz: float
    displacement: Array
    contact: ContactParameters
    force: float
    label: str
    branch: int = 0


class SolvedBranch(Protocol):
    """What is needed of a branch: a `ResponseCurve`, or arrays read from a file."""

    @property
    def frequency_hz(self) -> Array:
        """Frequency, Hz, (P,)."""
        ...

    @property
    def amplitude_m(self) -> Array:
        """Amplitude of the output, m, (P,)."""
        ...

    @property
    def arc(self) -> Array:
        """Arc length, (P,)."""
        ...

    @property
    def relative_displacement(self) -> ComplexArray:
        """Fourier coefficients d^(h), m, (P, H+1, n_c, 3)."""
        ...


class SolvedCurve(SolvedBranch, Protocol):
    """A branch with its detached branches."""

    @property
    def detached(self) -> Sequence[SolvedBranch]:
        """The detached branches."""
        ...


def branch_starts(
    curve: SolvedCurve, contact: ContactParameters, excitation: Excitation, label: str
) -> list[BranchStart]:
    """Starts from every branch of a curve: its top, its ends, its folds, and some points evenly along it.

    Parameters
    ----------
    curve : ResponseCurve
        The curve, or an object with the same arrays read from a file.
    contact : ContactParameters
        Its contact.
    excitation : Excitation
        Its excitation.
    label : str
        Name of the problem, such as "contact.interference = -60 um".

    Returns
    -------
    list of BranchStart
        The starts, branch by branch, the top of a branch first.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import branch_starts
    >>> starts = branch_starts(curve, contact, excitation, "contact.preload = 2 N")
    >>> starts[0].frequency_hz == curve.peak.frequency_hz
    True
    """
    starts = []
    for number, branch in enumerate((*curve.detached, curve)):
        frequency = np.asarray(branch.frequency_hz)
        for index in representative_indices(branch.amplitude_m, frequency, branch.arc):
            displacement = to_real(branch.relative_displacement[index])
            starts.append(
                BranchStart(float(frequency[index]), displacement, contact, excitation.force, label, number)
            )
    return starts

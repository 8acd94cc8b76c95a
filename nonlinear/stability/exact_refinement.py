"""One exponent with all poles and nothing linearised: successive linear problems, each around the last eigenvalue.

Poles that are condensed to a flexibility linear in sigma around 0 come in pairs whose flexibilities nearly cancel.
Where contacts are much stiffer than the structure what is left of their error moves an exponent by some 0.01 omega.

References
----------
A. Ruhe, Algorithms for the nonlinear eigenvalue problem, SIAM Journal on Numerical Analysis 10(4), 1973.
"""

from dataclasses import dataclass

import numpy as np

from nonlinear.stability.contact_feedback import ContactFeedback
from nonlinear.stability.eigenproblem import CONVERGED, ROUND_OFF, Near, Pencil, Refined
from nonlinear.stability.hill import HillProblem, LinearHillProblem, touching_nodes
from nonlinear.stability.point_contact import PointContact


@dataclass(frozen=True)
class ExactEigenproblem:
    """Hill's method at one point, without its condensation."""

    problem: HillProblem
    contact: PointContact

    @property
    def conjugate_pairs(self) -> bool:
        """Whether the eigenvalues come in conjugate pairs."""
        return self.problem.conjugate_pairs

    def around(self, value: complex) -> LinearHillProblem:
        """The problem linearised next to an approximate eigenvalue: structure and contact."""
        problem, contact, shift = self.problem, self.contact, value * (1.0 + ROUND_OFF) + ROUND_OFF
        touching = touching_nodes(contact.jacobian)
        model = problem.contact_free_in_amplitudes.around(shift, contact.omega, np.repeat(touching, 3))
        pencil = Pencil(model.state_matrix, np.eye(len(model.state_matrix)))
        if touching.any():
            stiffness, change = contact.at(shift)
            loop = ContactFeedback.closed(model, problem.in_amplitudes(stiffness[touching]))
            pencil = loop.pencil(None if change is None else np.asarray(problem.in_amplitudes(change[touching])))
        return LinearHillProblem(shift, Pencil(pencil.matrix + shift * pencil.descriptor, pencil.descriptor))

    def refined(self, linear: LinearHillProblem, value: complex, near: Near) -> Refined | None:
        """Where the eigenvalue changes no more, nothing is linearised."""
        return Refined(value) if abs(near.change) < CONVERGED else None

    def undecided(self, linear: LinearHillProblem, near: Near) -> Near | None:
        """The nearest of all eigenvalues; None where no pole is near."""
        return Near(linear.nearest_of_all(), None) if linear.size else None

"""Approximate Floquet exponents of all nodal diameters of one point.

Analytic in the phase shift kappa, and 2 pi-periodic, the matrices of the eigenvalue problem are formed at a few
kappas and interpolated by a trigonometric polynomial at all others. In modal coordinates of both contact faces the
contact Jacobian is the same for all kappas but for factors e^(+-i kappa).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.stability.condensed_loop import CondensedLoop
from nonlinear.stability.face_contact import face_contact
from nonlinear.stability.kappa_interpolation import KappaInterpolation
from nonlinear.stability.pattern_matrices import WIDTH, ScannedSlices, SliceMatrices
from nonlinear.stability.point_contact import PointContact
from nonlinear.stability.reduced_problem import ReducedProblem, ReducedProblems

NODES = 4  # kappas between 0 and pi at which the matrices are formed


@dataclass(frozen=True)
class PatternScan:
    """Eigenvalues of the perturbations of all nodal diameters k = 1 .. N_b / 2, from few modes.

    The strip is cut into slices, and around the middle of each the slider memory is linearised, and the poles are
    retained that may come there.
    """

    reduced: ReducedProblems  # perturbations of the wave in few modes
    contact: ContactParameters  # parameters of the contact nodes
    n_blades: int  # n_b
    # J, number of kappas between 0 and pi at which the matrices are formed; those of -kappa follow from them
    nodes: int = NODES

    @cached_property
    def _interpolation(self) -> KappaInterpolation:
        return KappaInterpolation(self.nodes, self.n_blades)

    def applies(self, omega: float) -> bool:
        """Whether few modes have nearly all the flexibility of the contact faces."""
        return self.reduced.at(omega).omitted <= self.reduced.negligible

    def scanned(self, contact: PointContact) -> ScannedSlices:
        """The slices of the strip."""
        reduced, static = self.reduced.at(contact.omega), self.reduced.problem.static
        half = _slice(reduced, contact, 0.0, self._interpolation.kappas[: self.nodes], self.contact)
        upper = _slice(reduced, contact, WIDTH, self._interpolation.kappas, self.contact)
        lower = upper.opposite(static, self.nodes)
        return ScannedSlices(
            ((0.0, half.with_mirrored(static)), (WIDTH, upper), (-WIDTH, lower)), self._interpolation.weights
        )


def _slice(
    reduced: ReducedProblem, contact: PointContact, centre: float, kappas: Array, parameters: ContactParameters
) -> SliceMatrices:
    """The matrices around sigma = i `centre`."""
    omega = contact.omega
    retained = reduced.near(parameters, omega, centre)
    condensed = reduced.condensed_around(centre, retained, omega)
    faces = face_contact(reduced, contact)
    loops = [
        CondensedLoop.closed(condensed, *faces.linearised(1j * centre if centre else 0.0, kappa))
        for kappa in kappas.tolist()
    ]
    return SliceMatrices(
        retained, np.stack([loop.matrix for loop in loops]), np.stack([loop.descriptor for loop in loops])
    )

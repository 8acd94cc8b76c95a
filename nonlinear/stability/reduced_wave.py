"""Floquet exponents of the perturbations with the symmetry of the wave, in few modes."""

from dataclasses import dataclass
from functools import cached_property

from nonlinear.contact.fourier import ComplexArray
from nonlinear.stability.condensed_loop import CondensedLoop
from nonlinear.stability.modal_contact import ModalContact, modal_contact
from nonlinear.stability.point_contact import PointContact
from nonlinear.stability.reduced_problem import ReducedProblem
from nonlinear.stability.reduced_refinement import ReducedRefinement


@dataclass(frozen=True)
class ReducedWave:
    """The eigenvalue problem of kappa = 0 at one point, around several sigma.

    As in the scan of all nodal diameters only the poles that may come near are states.
    """

    reduced: ReducedProblem  # the modes of the approximate eigenvalues
    refinement: ReducedRefinement  # refines them
    contact: PointContact  # the point
    conjugate_pairs: bool = True

    def eigenvalues(self, shift: complex) -> ComplexArray:
        """All eigenvalues sigma of the problem linearised around `shift`; those near it are approximate exponents."""
        reduced, omega = self.reduced, self.contact.omega
        centre = complex(shift).imag
        retained = reduced.near(self.refinement.contact, omega, centre)
        poles = reduced.condensed_around(centre, retained, omega)
        loop = CondensedLoop.closed(poles, self._modal.matrix(shift), self._modal.derivative(shift))
        return loop.eigenvalues() + 1j * centre

    def converged(self, value: complex) -> tuple[complex, bool] | None:
        """The eigenvalue that an approximate one leads to, and whether it is exact: `ReducedRefinement.converged`."""
        return self.refinement.converged(self.contact, 0.0, value)

    @cached_property
    def _modal(self) -> ModalContact:
        return modal_contact(self.reduced, self.contact, 0.0)

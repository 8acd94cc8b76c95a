"""One Floquet exponent from a reduced problem, corrected for the modes that are left out."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import ContactParameters
from nonlinear.stability.condensed_loop import CondensedLoop
from nonlinear.stability.hill import HillProblem
from nonlinear.stability.point_contact import PointContact
from nonlinear.stability.reduced_problem import ReducedProblem, ReducedProblems
from rom import ModalModel

MAX_OMITTED = 2e-3  # flexibility times contact stiffness: the error of an eigenvalue is some square of it
LARGEST_CORRECTION = 5e-5  # of an eigenvalue; the next order is about its square over the distance to the next one
NEGLIGIBLE = 1e-5  # flexibility times contact stiffness that needs no residual mode
UNKNOWNS = 150  # harmonics times modes
LEAST_SIZE = 150  # contact dofs in all harmonics from which the reduced problem is worth its overhead
MAX_ITERATIONS = 8
CONVERGED = 1e-6  # change of an eigenvalue at which the iteration ends, in units of omega


class Eigenpair(NamedTuple):
    """An eigenvalue sigma of the reduced problem at one kappa, with the loop linearised there.

    Attributes
    ----------
    value : complex
        sigma.
    state : (n_z,)
        Right eigenvector.
    loop : CondensedLoop
        The loop.
    contact : (n_c, S, 3, S, 3)
        Contact Jacobian in harmonics.
    """

    value: complex
    state: ComplexArray
    loop: CondensedLoop
    contact: ComplexArray


@dataclass(frozen=True)
class ReducedRefinement:
    """Refines approximate eigenvalues of a `HillProblem` at any kappa.

    Attributes
    ----------
    problem : HillProblem
        The problem; its kappa does not matter.
    contact : ContactParameters
        Parameters of the contact nodes.
    """

    problem: HillProblem
    contact: ContactParameters

    @cached_property
    def _reduced(self) -> ReducedProblems:
        return ReducedProblems(self.problem, self.contact, NEGLIGIBLE, UNKNOWNS)

    def applies(self, omega: float) -> bool:
        """Whether the problem is so large that it pays, and the flexibility left out so small that it is exact.

        Parameters
        ----------
        omega : float
            Excitation frequency, rad/s.
        """
        size = 3 * self.contact.n_contacts * (2 * self.problem.n_harmonics + 1)
        return size >= LEAST_SIZE and self.problem.modal.left is not None and self._at(omega).omitted <= MAX_OMITTED

    def _at(self, omega: float) -> ReducedProblem:
        return self._reduced.at(omega)

    def converged(self, contact: PointContact, kappa: float, value: complex) -> tuple[complex, bool] | None:
        """The eigenvalue that successive linear problems lead to from `value`, and whether it is exact.

        Exact to about 1e-7; None if they lead to none.

        Parameters
        ----------
        contact : PointContact
            The point.
        kappa : float
            Phase shift, rad.
        value : complex
            An approximate eigenvalue sigma.
        """
        reduced, pairs = self._at(contact.omega), abs(np.sin(kappa)) < 1e-12
        poles, relative = reduced.condensed(reduced.modal, contact.omega), reduced.relative(reduced.modal, kappa)
        state: ComplexArray | None = None
        memory: ComplexArray | None = None
        for _ in range(MAX_ITERATIONS):
            before = complex(value.real) if pairs and abs(value.imag) < CONVERGED else value
            jacobian, derivative = contact.at(before)
            if derivative is not None and memory is None:  # good enough for the later ones, which are close
                memory = reduced.projected(reduced.in_harmonics(derivative), relative)
            jacobian = reduced.in_harmonics(jacobian)
            loop = CondensedLoop.closed(poles, reduced.projected(jacobian, relative), memory, before)
            value, state = loop.nearest(before, state)
            if abs(value - before) < CONVERGED:
                change = self._correction(Eigenpair(value, state, loop, jacobian), contact.omega, kappa)
                value += change
                value = complex(value.real) if pairs and abs(value.imag) < CONVERGED else value
                return value, abs(change) <= LARGEST_CORRECTION
        return None

    def _correction(self, pair: Eigenpair, omega: float, kappa: float) -> complex:
        """What the flexibility dG of the modes left out adds to the eigenvalue, to first order.

        With the contact forces f of the right eigenvector z and l of the left one w,

            d sigma = l^T (dG_0 + sigma dG_1) f / (w^T E_c z),

        where f and l have the parts of order sigma that G_1 makes.
        """
        reduced, sigma, loop = self._at(omega), pair.value, pair.loop
        left = loop.left_vector(sigma)
        relative = reduced.relative(reduced.modal, kappa)
        forces, adjoint_forces = _contact_forces(pair, left, relative)
        total = 0.0 + 0.0j
        for modal, sign in ((reduced.problem.modal, 1.0), (reduced.modal, -1.0)):
            poles = loop.poles if modal is reduced.modal else reduced.condensed(modal, omega)
            right = _modal_forces(forces, modal, reduced, kappa)
            other = _modal_forces(adjoint_forces, modal, reduced, kappa, adjoint=True)
            both = (right[0] + sigma * right[1]) * (other[0] + sigma * other[1])
            total += sign * complex(both @ poles.flexibility + sigma * ((right[0] * other[0]) @ poles.derivative))
        return total / complex(left @ (loop.descriptor @ pair.state))


def _contact_forces(pair: Eigenpair, left: ComplexArray, relative: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Contact forces (2, S, 3 n_c) of the two eigenvectors: S C z and S G_1 S C z, and those of w^T B S."""
    from scipy.linalg import lu_solve

    loop, poles = pair.loop, pair.loop.poles
    k, g_0, g_1 = loop.contact, poles.flexibility, poles.derivative
    start, end = np.zeros((2, g_0.size), dtype=complex)
    np.add.at(start, poles.state, pair.state)
    np.add.at(end, poles.state, left * poles.residue)

    def closed(motion: ComplexArray) -> ComplexArray:  # X: displacements from those without contact forces
        return np.asarray(motion + g_0 * lu_solve(loop.factors, k @ motion, trans=1, check_finite=False))

    def closed_adjoint(motion: ComplexArray) -> ComplexArray:  # Y^T
        return np.asarray(lu_solve(loop.factors, motion, check_finite=False))

    motion, adjoint = closed(start), closed_adjoint(end)
    motions = np.stack([motion, closed(g_1 * (k @ motion))])
    adjoints = np.stack([adjoint, closed_adjoint(g_1 * (k.T @ adjoint))])
    nodes, size = pair.contact.shape[:2]
    block = pair.contact.reshape(nodes, 3 * size, 3 * size)

    def forces(values: ComplexArray, shapes: ComplexArray, matrix: ComplexArray) -> ComplexArray:
        moved = shapes @ values.reshape(2, size, -1).transpose(1, 2, 0)  # (S, 3 n_c, 2)
        moved = moved.reshape(size, nodes, 3, 2).transpose(1, 0, 2, 3).reshape(nodes, 3 * size, 2)
        return (matrix @ moved).reshape(nodes, size, 3, 2).transpose(3, 1, 0, 2).reshape(2, size, 3 * nodes)

    return forces(motions, relative, block), forces(adjoints, relative.conj(), block.transpose(0, 2, 1))


def _modal_forces(
    forces: ComplexArray, modal: ModalModel, reduced: ReducedProblem, kappa: float, adjoint: bool = False
) -> ComplexArray:
    """B_h^H f of the modes, or l^T B_h, (2, S q), without forming B_h."""
    assert modal.left is not None
    ahead = np.exp(1j * (reduced.harmonics * reduced.problem.phase + kappa))[:, None]
    product = forces @ modal.right - (ahead if adjoint else ahead.conj()) * (forces @ modal.left)
    return product.reshape(2, -1)

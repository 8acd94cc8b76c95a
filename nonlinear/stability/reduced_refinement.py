"""Floquet exponents in few modes: those of the wave, and any one of them, corrected for the modes that are left out.

References
----------
A. Neumaier, Residual inverse iteration for the nonlinear eigenvalue problem, SIAM Journal on Numerical Analysis
22(5), 1985.
A. Ruhe, Algorithms for the nonlinear eigenvalue problem, SIAM Journal on Numerical Analysis 10(4), 1973.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import ContactParameters
from nonlinear.stability.contact_feedback import ContactFeedback, Factors
from nonlinear.stability.eigenproblem import (
    CONVERGED,
    FASTEST,
    ROUND_OFF,
    Near,
    Refined,
    converged,
    length_of,
    same_direction,
)
from nonlinear.stability.hill import HillProblem
from nonlinear.stability.modal_contact import ModalContact, modal_contact
from nonlinear.stability.point_contact import PointContact
from nonlinear.stability.reduced_problem import CondensedPoles, ReducedProblem, ReducedProblems
from rom.cyclic.modal_model import ModalModel

MAX_OMITTED = 2e-3  # flexibility times contact stiffness: the error of an eigenvalue is some square of it
LARGEST_CORRECTION = 2e-4  # of an eigenvalue; the next order is about its square over the distance to the next one
NEGLIGIBLE = 5e-4  # flexibility times contact stiffness that needs no residual mode
UNKNOWNS = 120  # harmonics times modes
LEAST_SIZE = 150  # contact dofs in all harmonics from which the reduced problem is worth its overhead
LEFT_ITERATIONS = 4
FAR = 0.03  # change of an eigenvalue after which the problem is linearised again at once
MAX_RESIDUALS = 4


@dataclass(frozen=True)
class ModalPencil:
    """T(sigma) x = 0 linearised around one sigma, T = Z - B^H K B, with the dynamic stiffness Z of the modes."""

    poles: CondensedPoles  # poles and residual flexibility of the modes, near sigma = 0
    contact: ModalContact  # B^H K B
    shift: complex  # the sigma
    columns: ClassVar[int] = 1

    @cached_property
    def stiffness(self) -> tuple[ComplexArray, ComplexArray]:
        """Z and its derivative, (D,)."""
        reduced = self.contact.reduced
        return reduced.dynamic_stiffness(reduced.modal, self.shift, self.contact.contact.omega)

    def residual(self, x: ComplexArray) -> ComplexArray:
        """T x."""
        return self.stiffness[0] * x - self.contact.product(self.shift, x)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.poles.flexibility.size

    def change(self, vectors: ComplexArray) -> ComplexArray:
        """-dT times a vector (D,)."""
        inputs, outputs = self._memory
        return np.asarray(inputs @ (outputs @ vectors) - self.stiffness[1] * vectors)

    def nearest_of_all(self) -> complex:
        """The eigenvalue next to the shift of those that the states of the retained poles have, less the shift."""
        loop = ContactFeedback.closed(self.poles.model, self.contact.matrix(self.shift))
        values = loop.pencil(self._memory, self.shift).eigenvalues()
        return complex(values[np.argmin(np.abs(values - self.shift))]) - self.shift

    def left_vector(self, x: ComplexArray) -> tuple[ComplexArray, bool]:
        """The left eigenvector l, l^T (T + mu dT) = 0, and whether it is sharp; from the conjugate of `x`."""
        inputs, outputs = self._memory
        left, sharp = x.conj(), False
        for _ in range(LEFT_ITERATIONS):
            before = left
            left = self._factors.rows_solved(self.stiffness[1] * left - (left @ inputs) @ outputs)
            left = left / length_of(left)
            sharp = same_direction(before, left)
            if sharp:
                break
        return left, sharp

    def refined(self, sigma: complex, x: ComplexArray, left: ComplexArray) -> tuple[complex, ComplexArray] | None:
        """The eigenvalue of T(sigma) and its eigenvector near `sigma` and `x`, by residual inverse iteration.

        The factors stay those of the shift (Neumaier 1985). None where it converges slowly.
        """
        for _ in range(MAX_RESIDUALS):
            residual, change = ModalPencil(self.poles, self.contact, sigma).residual(x), self.change(x)
            step = complex(left @ residual) / complex(left @ change)
            sigma += step
            if abs(step) < CONVERGED:
                return sigma, x
            if not abs(sigma) < FASTEST:  # nor with a NaN
                return None
            x = x - self.solved(residual - step * change)
        return None

    @cached_property
    def _memory(self) -> tuple[ComplexArray, ComplexArray]:
        return self.contact.derivative(self.shift)

    def solved(self, right: ComplexArray) -> ComplexArray:
        """T^-1 times a vector (D,)."""
        return self._factors.solved(right)

    @cached_property
    def _factors(self) -> Factors:
        matrix = -self.contact.matrix(self.shift)
        diagonal = np.einsum("ii->i", matrix)  # a view
        diagonal += self.stiffness[0]
        return Factors.of(matrix)


@dataclass(frozen=True)
class ReducedRefinement:
    """Refines approximate eigenvalues of a `HillProblem` at any kappa."""

    problem: HillProblem  # the problem; its kappa does not matter
    contact: ContactParameters  # parameters of the contact nodes

    @cached_property
    def _reduced(self) -> ReducedProblems:
        return ReducedProblems(self.problem, self.contact, NEGLIGIBLE, UNKNOWNS)

    def applies(self, omega: float) -> bool:
        """Whether the problem is so large that it pays, and the flexibility left out so small that it is exact."""
        modal = self.problem.modal
        possible = modal.neighbours_coupled and not modal.waves_differ and not self.small
        return possible and self._at(omega).omitted <= MAX_OMITTED

    @property
    def small(self) -> bool:
        """Whether the problem has so few contact dofs that all modes are the least work."""
        return 3 * self.contact.n_contacts * (2 * self.problem.n_harmonics + 1) < LEAST_SIZE

    def _at(self, omega: float) -> ReducedProblem:
        return self._reduced.at(omega)

    def converged(self, contact: PointContact, kappa: float, value: complex) -> Refined | None:
        """The eigenvalue that an approximate one leads to, exact to about 1e-7; None if it leads to none."""
        reduced = self._at(contact.omega)
        poles = reduced.condensed(contact.omega)
        problem = ModalEigenproblem(poles, modal_contact(reduced, contact, kappa), abs(np.sin(kappa)) < 1e-12)
        return converged(problem, value)


@dataclass(frozen=True)
class ModalEigenproblem:
    """T in few modes, for one kappa; its eigenvalues are corrected for the modes that are left out."""

    poles: CondensedPoles  # of the modes
    contact: ModalContact  # B^H K B
    conjugate_pairs: bool  # whether the eigenvalues come in conjugate pairs

    def around(self, value: complex) -> ModalPencil:
        """The problem linearised next to an approximate eigenvalue."""
        return ModalPencil(self.poles, self.contact, value * (1.0 + ROUND_OFF) + ROUND_OFF)

    def undecided(self, linear: ModalPencil, near: Near) -> Near:
        """The nearest of all eigenvalues."""
        return Near(linear.nearest_of_all(), None)

    def refined(self, linear: ModalPencil, value: complex, near: Near) -> Refined | None:
        """The eigenvalue of all modes; None where the vectors are not sharp, or the iteration is slow."""
        if near.vector is None or abs(near.change) > FAR or not (near.sharp or abs(near.change) < CONVERGED):
            return None
        left, sharp = linear.left_vector(near.vector)
        found = linear.refined(value, near.vector, left) if sharp else None
        if found is None:
            return None
        value, x = found
        correction = -self._correction((x, left), value) / complex(left @ linear.change(x))
        return Refined(value + correction, abs(correction) <= LARGEST_CORRECTION)

    def _correction(self, vectors: tuple[ComplexArray, ComplexArray], sigma: complex) -> complex:
        """l^T dG f of the flexibility dG of the modes left out: what it adds to the eigenvalue, to first order.

        With the contact forces f of the right eigenvector x and l of the left one,

            d sigma = l^T dG f / (l^T dT x).
        """
        modal, kappa = self.contact, self.contact.kappa
        reduced, omega, relative = modal.reduced, modal.contact.omega, modal.relative
        size = len(relative)
        x, left = (vector.reshape(size, -1, 1) for vector in vectors)
        forces = modal.forces(sigma, (relative @ x)[:, :, 0])
        adjoint = modal.forces(sigma, (relative.conj() @ left)[:, :, 0], adjoint=True)
        total, every = 0.0 + 0.0j, reduced.problem.modal.at(0)
        for modes, sign in ((every, 1.0), (reduced.modal, -1.0)):
            both = _modal_forces(forces, modes, reduced, kappa) * _modal_forces(adjoint, modes, reduced, kappa, True)
            stiffness = reduced.dynamic_stiffness(modes, sigma, omega)[0]
            moved = np.abs(stiffness) > 0.0  # at the pole of a mode that no contact moves there is no correction
            total += sign * complex(np.sum(both[moved] / stiffness[moved]))
        return total


def _modal_forces(
    forces: ComplexArray, modes: ModalModel, reduced: ReducedProblem, kappa: float, adjoint: bool = False
) -> ComplexArray:
    """B_h^H f of the modes, or l^T B_h, (S q,), without forming B_h."""
    assert modes.left is not None
    ahead = np.exp(1j * (reduced.harmonics * reduced.problem.phase + kappa))[:, None]
    return (forces @ modes.right - (ahead if adjoint else ahead.conj()) * (forces @ modes.left)).ravel()


@dataclass(frozen=True)
class ReducedWave:
    """The eigenvalue problem of kappa = 0 at one point, around several sigma.

    As in the scan of all nodal diameters only the poles that may come near are states.
    """

    reduced: ReducedProblem  # the modes
    parameters: ContactParameters  # parameters of the contact nodes
    contact: PointContact  # the point

    def eigenvalues(self, shift: complex) -> ComplexArray:
        """All eigenvalues sigma of the problem linearised around `shift`; those near it are approximate exponents."""
        reduced, omega = self.reduced, self.contact.omega
        retained = reduced.near(self.parameters, omega, complex(shift).imag)
        poles = reduced.condensed_around(shift, retained, omega)
        inputs, outputs = self._modal.derivative(shift)
        pencils = poles.pencils(self._modal.matrix(shift)[None], np.ones((1, 1)), (inputs[None], outputs[None]))
        return pencils.eigenvalues()[0] + shift

    @cached_property
    def _modal(self) -> ModalContact:
        return modal_contact(self.reduced, self.contact, 0.0)

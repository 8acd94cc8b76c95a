"""The contact Jacobian K(sigma) of one point and one kappa in modal coordinates, B^H K(sigma) B.

The sliders change it by a matrix of low rank, as many as there are stick intervals: P(sigma) Q^T.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.stability.block_matrices import Matrix
from nonlinear.stability.cone_slider_memory import ConeSliderMemory
from nonlinear.stability.face_contact import face_contact
from nonlinear.stability.point_contact import PointContact
from nonlinear.stability.reduced_problem import ReducedProblem
from nonlinear.stability.slider_memory import SliderMemory

SAME_SIGMA = 1e-4  # distance over which K(sigma) is linear to 1e-7


def modal_contact(
    reduced: ReducedProblem, contact: PointContact, kappa: float
) -> "LowRankMemoryContact | FullMemoryContact":
    """The contact Jacobian of a point."""
    kind = FullMemoryContact if isinstance(contact.memory, ConeSliderMemory) else LowRankMemoryContact
    return kind(reduced, contact, kappa)


@dataclass(frozen=True)
class _ContactInModes:
    """The contact of a point in few modes."""

    reduced: ReducedProblem  # the modes
    contact: PointContact  # the point
    kappa: float  # phase shift, rad

    @cached_property
    def relative(self) -> ComplexArray:
        """B_h of the modes, (S, 3 n_c, q)."""
        return self.reduced.relative(self.reduced.modal, self.kappa)


class LowRankMemoryContact(_ContactInModes):
    """Two Jenkins sliders a node, or no memory: B^H K(0) B + (B^H P(sigma)) (Q^T B)."""

    def matrix(self, sigma: complex) -> ComplexArray:
        """B^H K(sigma) B, (D, D)."""
        return self._periodic if self._memory is None else self._periodic + self._inputs(sigma)[0] @ self._outputs

    def product(self, sigma: complex, x: ComplexArray) -> ComplexArray:
        """The same times `x` (D,)."""
        force = self._periodic @ x
        return force if self._memory is None else force + self._inputs(sigma)[0] @ (self._outputs @ x)

    def derivative(self, sigma: complex) -> tuple[ComplexArray, ComplexArray]:
        """(D, M) and (M, D), the derivative in sigma is their product."""
        if self._memory is None:
            return np.zeros((len(self._periodic), 0), dtype=complex), np.zeros(
                (0, len(self._periodic)), dtype=complex
            )
        return self._inputs(sigma)[1], self._outputs

    def forces(self, sigma: complex, motion: ComplexArray, adjoint: bool = False) -> ComplexArray:
        """K(sigma) d, or K(sigma)^T d, for a motion (S, 3 n_c)."""
        return self.contact.forces(sigma, motion, self.reduced.problem.static, adjoint)

    @property
    def _memory(self) -> SliderMemory | None:
        memory = self.contact.memory
        assert not isinstance(memory, ConeSliderMemory)
        return memory

    @cached_property
    def _periodic(self) -> ComplexArray:
        return face_contact(self.reduced, self.contact).periodic(self.kappa)

    @property
    def _first(self) -> int:
        """Column of the first harmonic."""
        return 0 if self.reduced.problem.static else 1

    @cached_property
    def _basis(self) -> ComplexArray:
        """Q without the slopes, (M, S)."""
        return self.contact.slider_basis[:, self._first :]

    @cached_property
    def _slider_motion(self) -> ComplexArray:
        """B_h of the sliders, (S, M, q)."""
        assert self._memory is not None
        return self.relative[:, 3 * self._memory.node + self._memory.direction]

    @cached_property
    def _outputs(self) -> ComplexArray:
        """Q^T B, (M, D)."""
        memory = self._memory
        assert memory is not None
        motion = self._slider_motion + memory.dw_dn[:, None] * self.relative[:, 3 * memory.node + 2]
        return np.asarray((motion * self._basis.T[:, :, None]).transpose(1, 0, 2).reshape(memory.node.size, -1))

    def _inputs(self, sigma: complex) -> tuple[ComplexArray, ComplexArray]:
        """B^H P(sigma) and its derivative, (D, M)."""
        if sigma not in self._known:
            memory, adjoint = self._memory, self._slider_motion.conj().transpose(0, 2, 1)
            assert memory is not None
            value, derivative = (
                (adjoint * part[:, self._first :].T[:, None, :]).reshape(-1, memory.node.size)
                for part in memory.force_in_harmonics(sigma)
            )
            self._known.clear()
            self._known[sigma] = value, derivative
        return self._known[sigma]

    @cached_property
    def _known(self) -> dict[complex, tuple[ComplexArray, ComplexArray]]:
        return {}


class FullMemoryContact(_ContactInModes):
    """The friction cone: its memory changes the Jacobian of each node as a whole."""

    def matrix(self, sigma: complex) -> ComplexArray:
        """B^H K(sigma) B, (D, D)."""
        return self._linearised(sigma).matrix

    def product(self, sigma: complex, x: ComplexArray) -> ComplexArray:
        """The same times `x` (D,)."""
        near = self._linearised(sigma)
        return near.matrix @ x + (sigma - near.sigma) * (near.derivative @ x)

    def derivative(self, sigma: complex) -> tuple[ComplexArray, ComplexArray]:
        """(D, D) each, the derivative in sigma is their product."""
        derivative = self._linearised(sigma).derivative
        return derivative, np.eye(len(derivative), dtype=complex)

    def forces(self, sigma: complex, motion: ComplexArray, adjoint: bool = False) -> ComplexArray:
        """K(sigma) d, or K(sigma)^T d, for a motion (S, 3 n_c)."""
        frozen = PointContact(self._linearised(sigma).jacobian, self.contact.omega, None)
        return frozen.forces(sigma, motion, self.reduced.problem.static, adjoint)

    def _linearised(self, sigma: complex) -> "LinearisedMemory":
        """K near sigma: a new one where the last one is too far."""
        if not self._known or abs(self._known[0].sigma - sigma) > SAME_SIGMA:
            jacobian, derivative = self.contact.at(sigma)
            assert derivative is not None
            matrix, change = (
                self.reduced.projected(self.reduced.in_harmonics(part), self.relative)
                for part in (jacobian, derivative)
            )
            self._known[:] = [LinearisedMemory(sigma, jacobian, matrix, change)]
        return self._known[0]

    @cached_property
    def _known(self) -> "list[LinearisedMemory]":
        return []


class LinearisedMemory(NamedTuple):
    """K around one sigma: itself (n_c, 3, 3, 2H+1, 2H+1), in modal coordinates (D, D), and its derivative there."""

    sigma: complex
    jacobian: Matrix
    matrix: ComplexArray
    derivative: ComplexArray


ModalContact = LowRankMemoryContact | FullMemoryContact

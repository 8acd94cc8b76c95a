"""The contact Jacobian of one point in modal coordinates, B^H K(sigma) B: for all phase shifts kappa, and for one.

The relative motion is that of the right face less that of the left one, times e^(i (h psi + kappa)): what is formed
of both faces apart (`FaceContact`) gives B^H K(sigma) B of any kappa by a few sums. The sliders change it by a matrix
of low rank, as many as there are stick intervals: P(sigma) Q^T.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.stability.contact_kernels import relative_motion_parts
from nonlinear.stability.modal_condensation import Matrix
from nonlinear.stability.point_contact import PointContact, columns_in_harmonics
from nonlinear.stability.reduced_problem import ReducedProblem, weighted_sums
from nonlinear.stability.slider_memory import SliderMemory

MemoryFactors = tuple[ComplexArray, ComplexArray]


@dataclass(frozen=True)
class FaceJacobian:
    """A contact Jacobian in modal coordinates of the relative motion, B^H K B, for all kappas."""

    parts: (
        ComplexArray  # (3, D, D), what does not depend on kappa, what goes with cos(kappa), and what with sin(kappa)
    )

    @classmethod
    def of(cls, reduced: ReducedProblem, values: Matrix) -> "FaceJacobian":
        """From the Jacobian (n_c, 3, 3, 2H+1, 2H+1) of real coefficients."""
        if np.iscomplexobj(values):
            return cls(cls.of(reduced, values.real).parts + 1j * cls.of(reduced, values.imag).parts)
        modal = reduced.modal
        assert modal.left is not None
        faces, q = np.stack([modal.right, modal.left], axis=1), modal.damping.size
        nodes, rows = values.shape[0], values.shape[-1]
        shapes = faces.reshape(nodes, 3, 2 * q)
        # the modes first, as everything is real still; then the harmonics
        left = shapes.transpose(0, 2, 1) @ values.reshape(nodes, 3, 3 * rows**2)
        left = left.reshape(nodes, 2 * q, 3, rows**2).transpose(1, 0, 2, 3).reshape(2 * q, 3 * nodes, rows**2)
        product = (shapes.reshape(3 * nodes, 2 * q).T @ left).reshape(2, q, 2, q, rows, rows)
        first = 0 if reduced.problem.static else 1
        order = (np.arange(rows) + 1) // 2 * np.where(np.arange(rows) % 2, 1, -1)  # 0, 1, -1, 2, -2, ...
        size = rows - first
        parts = np.empty((3, size, q, size, q), dtype=complex)
        relative_motion_parts(product, np.exp(1j * order * reduced.problem.phase), first, parts)
        return cls(parts.reshape(3, size * q, size * q))

    def at(self, kappas: Array) -> ComplexArray:
        """B^H K B at some kappas (k,), (k, D, D)."""
        return weighted_sums(self.parts, part_weights(kappas))


def part_weights(kappas: Array) -> Array:
    """Weights of the parts of a `FaceJacobian` at some kappas (k,), (k, 3)."""
    return np.stack([np.ones_like(kappas), np.cos(kappas), np.sin(kappas)], axis=1)


@dataclass(frozen=True)
class FaceMemory:
    """Two Jenkins sliders a node: the memory adds P(sigma) Q^T, of as low a rank as there are stick intervals M."""

    reduced: ReducedProblem  # the modes
    memory: SliderMemory  # the memory

    def linearised(self, sigma: complex, kappas: Array) -> tuple[FaceJacobian | None, MemoryFactors]:
        """B^H P(sigma) Q^T B, None for 0, and factors of its derivative at some kappas, (k, D, M) and (k, M, D)."""
        columns = (part[:, self._first :] for part in self.memory.force_in_harmonics(sigma))
        (right, left), (right_change, left_change) = (
            self._pair(self._motion(0.0), part, conjugate=True) for part in columns
        )
        right_out, left_out = self._outputs
        ahead = np.exp(1j * kappas)[:, None, None]
        inputs = (right_change - ahead.conj() * left_change).transpose(0, 2, 1)
        factors = inputs, right_out - ahead * left_out
        if not sigma:
            return None, factors
        one, other = -right.T @ left_out, -left.T @ right_out
        parts = np.stack([right.T @ right_out + left.T @ left_out, one + other, 1j * (one - other)])
        return FaceJacobian(parts), factors

    def _motion(self, dw_dn: Array | float) -> tuple[Array, Array]:
        """Motion of the sliders and `dw_dn` times that along the normal, of both faces, (M, q)."""
        memory, modal = self.memory, self.reduced.modal
        assert modal.left is not None
        slider, normal = 3 * memory.node + memory.direction, 3 * memory.node + 2
        slope = np.broadcast_to(dw_dn, memory.node.shape)[:, None]
        right, left = (face[slider] + slope * face[normal] for face in (modal.right, modal.left))
        return right, left

    def _pair(
        self, faces: tuple[Array, Array], coefficients: ComplexArray, conjugate: bool
    ) -> tuple[ComplexArray, ComplexArray]:
        """Both faces times coefficients (M, S), the left one with its phase: (M, D) each."""
        ahead = np.exp((-1j if conjugate else 1j) * self.reduced.harmonics * self.reduced.problem.phase)
        factors = coefficients, coefficients * ahead
        right, left = (
            (factor[:, :, None] * face[:, None, :]).reshape(len(factor), -1)
            for factor, face in zip(factors, faces, strict=True)
        )
        return right, left

    @property
    def _first(self) -> int:
        """Column of the first harmonic."""
        return 0 if self.reduced.problem.static else 1

    @cached_property
    def _outputs(self) -> tuple[ComplexArray, ComplexArray]:
        """Q^T of both faces, (M, D)."""
        basis = columns_in_harmonics(self.memory.basis)[:, self._first :]
        return self._pair(self._motion(self.memory.dw_dn), basis, conjugate=False)


@dataclass(frozen=True)
class FaceContact:
    """The contact of one point in few modes."""

    reduced: ReducedProblem  # the modes
    contact: PointContact  # the point

    def periodic(self, kappa: float) -> ComplexArray:
        """B^H K(0) B, (D, D)."""
        return np.asarray(self._periodic.at(np.array([kappa]))[0])

    def linearised(self, sigma: complex, kappas: Array) -> tuple[FaceJacobian, MemoryFactors | ComplexArray | None]:
        """B^H K(sigma) B, and its derivative at some kappas: two factors for two sliders, the whole with a cone."""
        if not isinstance(self.contact.memory, SliderMemory | None):
            whole, derivative = self._whole(sigma)
            return whole, derivative.at(kappas)
        value, sliders = self._periodic, self.sliders
        if sliders is None:
            return value, None
        of_memory, change = sliders.linearised(sigma, kappas)
        return value if of_memory is None else FaceJacobian(value.parts + of_memory.parts), change

    @cached_property
    def sliders(self) -> FaceMemory | None:
        """The memory of two Jenkins sliders a node; None where there is none."""
        memory = self.contact.memory
        return FaceMemory(self.reduced, memory) if isinstance(memory, SliderMemory) else None

    @cached_property
    def _periodic(self) -> FaceJacobian:
        return FaceJacobian.of(self.reduced, self.contact.jacobian)

    def _whole(self, sigma: complex) -> tuple[FaceJacobian, FaceJacobian]:
        value, derivative = self.contact.at(sigma)
        assert derivative is not None
        return FaceJacobian.of(self.reduced, value), FaceJacobian.of(self.reduced, derivative)


def face_contact(reduced: ReducedProblem, contact: PointContact) -> FaceContact:
    """The contact of a point in few modes; the same object if it is asked for again."""
    known = contact.in_few_modes
    if id(reduced) not in known:
        # of a copy of the point, without what is kept with it: with a reference back, neither is freed at once
        known[id(reduced)] = FaceContact(reduced, replace(contact))
    return known[id(reduced)]


SAME_SIGMA = 1e-4  # distance over which K(sigma) is linear to 1e-7


def modal_contact(
    reduced: ReducedProblem, contact: PointContact, kappa: float
) -> "LowRankMemoryContact | FullMemoryContact":
    """The contact Jacobian of a point."""
    kind = LowRankMemoryContact if isinstance(contact.memory, SliderMemory | None) else FullMemoryContact
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
        if self._memory is None:
            return force
        columns = self._memory.force_in_harmonics(sigma)[0][:, self._first :] * (self._outputs @ x)[:, None]
        return force + (self._adjoint @ columns.T[:, :, None]).ravel()

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
        assert isinstance(memory, SliderMemory | None)
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
    def _adjoint(self) -> ComplexArray:
        """B_h^H of the sliders, (S, q, M)."""
        return self._slider_motion.conj().transpose(0, 2, 1)

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
            memory = self._memory
            assert memory is not None
            value, derivative = (
                (self._adjoint * part[:, self._first :].T[:, None, :]).reshape(-1, memory.node.size)
                for part in memory.force_in_harmonics(sigma)
            )
            self._known.clear()
            self._known[sigma] = value, derivative
        return self._known[sigma]

    @cached_property
    def _known(self) -> dict[complex, tuple[ComplexArray, ComplexArray]]:
        return {}


class FullMemoryContact(_ContactInModes):
    """With a friction cone: the memory changes the Jacobian of each node as a whole."""

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

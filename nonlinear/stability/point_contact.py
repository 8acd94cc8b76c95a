"""The contact of a solved point as growing perturbations see it: its Jacobian and the memory of its sliders."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.stability.contact_kernels import all_in_harmonics
from nonlinear.stability.modal_condensation import Matrix
from nonlinear.stability.slider_memory import JoinedMemory, Memory, NodeMemory, SliderMemory, last_two


@dataclass(frozen=True)
class PointContact:
    """The contact Jacobian K(sigma) of perturbations e^(sigma theta) p(theta), sigma = lambda / omega."""

    jacobian: Array  # (n_c, 3, 3, 2H+1, 2H+1), K(0) as in `ContactForces`
    omega: float  # excitation frequency, rad/s
    memory: Memory | None  # slider memory; None: there is none

    def at(self, sigma: complex) -> tuple[Matrix, Matrix | None]:
        """K(sigma) and its derivative, each as `jacobian`; None without a memory."""
        memory = self.memory
        if memory is None:
            return self.jacobian, None
        whole = JoinedMemory(memory) if isinstance(memory, SliderMemory) else memory
        change, derivative = (self._of_nodes(whole, values) for values in whole.jacobian(sigma))
        return self.jacobian + change, derivative

    def in_harmonics(self, static: bool) -> ComplexArray:
        """K(0) in the harmonics, (n_c, S, 3, S, 3), without harmonic 0 unless `static`."""
        if static not in self._in_harmonics:
            first = 0 if static else 1
            values = in_harmonics(self.jacobian).transpose(0, 3, 1, 4, 2)[:, first:, :, first:]
            self._in_harmonics[static] = np.ascontiguousarray(values)
        return self._in_harmonics[static]

    def forces(self, sigma: complex, motion: ComplexArray, static: bool, adjoint: bool = False) -> ComplexArray:
        """K(sigma) d, or K(sigma)^T d, in the harmonics.

        Shapes: `motion` (S, 3 n_c).
        """
        memory = self.memory
        if not isinstance(memory, SliderMemory | None):
            return self._frozen(sigma).forces(0.0, motion, static, adjoint)
        jacobian = self.in_harmonics(static)
        nodes, size = jacobian.shape[:2]
        block = jacobian.reshape(nodes, 3 * size, 3 * size)
        parts = motion.reshape(size, nodes, 3).transpose(1, 0, 2).reshape(nodes, 3 * size, 1)
        product = (block.transpose(0, 2, 1) if adjoint else block) @ parts
        result = product.reshape(nodes, size, 3).transpose(1, 0, 2).reshape(size, 3 * nodes)
        if memory is None:
            return result
        first = 0 if static else 1
        force, basis = memory.force_in_harmonics(sigma)[0][:, first:], self.slider_basis[:, first:]  # (M, S)
        slider, normal = 3 * memory.node + memory.direction, 3 * memory.node + 2
        if adjoint:
            set_by = np.sum(motion.T[slider] * force, axis=1)[:, None] * basis
            np.add.at(result.T, slider, set_by)
            np.add.at(result.T, normal, memory.dw_dn[:, None] * set_by)
        else:
            motion_then = motion.T[slider] + memory.dw_dn[:, None] * motion.T[normal]
            np.add.at(result.T, slider, np.sum(motion_then * basis, axis=1)[:, None] * force)
        return result

    @cached_property
    def slider_basis(self) -> ComplexArray:
        """Q without the slopes, (M, 2H+1)."""
        assert isinstance(self.memory, SliderMemory)
        return columns_in_harmonics(self.memory.basis)

    def _frozen(self, sigma: complex) -> "PointContact":
        """The contact with the Jacobian K(sigma) and without a memory."""
        return last_two(self._kept, sigma, lambda: PointContact(self.at(sigma)[0].astype(complex), self.omega, None))

    @cached_property
    def _kept(self) -> "dict[complex, PointContact]":
        return {}

    @cached_property
    def _in_harmonics(self) -> dict[bool, ComplexArray]:
        return {}

    @cached_property
    def in_few_modes(self) -> dict[int, Any]:
        """What has been formed of this point, by the identity of the reduced problem or of the shared motions."""
        return {}

    def _of_nodes(self, memory: NodeMemory, values: Matrix) -> Matrix:
        result = np.zeros(self.jacobian.shape, dtype=values.dtype)
        result[memory.node, :2] = values
        return result


def in_harmonics(values: Matrix) -> ComplexArray:
    """A contact Jacobian of real coefficients as that of the amplitudes of the harmonics 0, 1, -1, 2, -2, ...

    With Re_h = p_h + p_-h and Im_h = -i (p_h - p_-h).
    Shapes: `values` (..., 2H+1, 2H+1), also complex.
    """
    if np.iscomplexobj(values):
        return np.asarray(in_harmonics(values.real) + 1j * in_harmonics(values.imag))
    result = np.empty(values.shape, dtype=complex)
    rows = -1, *values.shape[-2:]
    all_in_harmonics(np.ascontiguousarray(values).reshape(rows), result.reshape(rows))
    return result


def columns_in_harmonics(values: Matrix) -> ComplexArray:
    """What is multiplied by real coefficients, as what is multiplied by the amplitudes: (..., 2H+1)."""
    result = values.astype(complex)
    turned = 1j * values[..., 2::2]
    result[..., 1::2] -= turned
    result[..., 2::2] = values[..., 1::2] + turned
    return result

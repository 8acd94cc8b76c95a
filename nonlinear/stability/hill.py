"""Hill's method: small perturbations of a travelling wave as a condensed linear eigenvalue problem.

References
----------
M. Krack, J. Gross, Harmonic Balance for Nonlinear Vibration Problems, Springer, 2019.
G. von Groll, D. J. Ewins, The harmonic balance method with arc-length continuation in rotor/stator contact problems,
Journal of Sound and Vibration 241(2), 2001.
A. Lazarus, O. Thomas, A harmonic-based method for computing the stability of periodic solutions of dynamical systems,
Comptes Rendus Mecanique 338(9), 2010.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.stability.contact_feedback import (
    ContactFeedback,
    ContactRows,
    Factors,
    MotionRows,
    NodeMemoryFeedback,
    SliderMemoryFeedback,
    in_motions,
)
from nonlinear.stability.eigenproblem import CONVERGED, ROUND_OFF, Near, Pencil, Refined
from nonlinear.stability.modal_condensation import CondensedModes, ContactFreeModel, Matrix, NodeBlocks
from nonlinear.stability.point_contact import in_harmonics
from nonlinear.stability.slider_memory import Memory, SliderMemory
from rom.cyclic.sector_modes import RingModes

RETENTION_RADIUS = 2.0
RETENTION_HARMONIC = 5
FEW_STATES = 24  # up to which all eigenvalues take less time than the inverse iteration for one


@dataclass(frozen=True)
class HillProblem:
    """Small perturbations of the wave q_j(t) = q(t + j psi / omega) on blade j, for one phase shift kappa.

        dq_j = e^(lambda t) e^(i j kappa) sum_h p_h e^(i h (omega t + j psi)),    h = -H .. H,

    relative displacement (right - left e^(i (h psi + kappa))) p_h = B_h p_h, and in modal coordinates with
    s = lambda + i h omega:

        (s^2 + c_m s + omega_m^2) p_h,m = phi_m^T B_h^H sum_g K_hg B_g p_g,

    K the Jacobian of the contact forces. kappa = 0 are the perturbations with the symmetry of the wave. The exponents
    of a ring of N_b blades are those of kappa = 2 pi k / N_b, k = 0 .. N_b - 1, with abs(Im lambda) <= omega / 2:
    others are copies of these, lambda + i omega for kappa + psi. -kappa has the complex conjugates.

    Most poles of the contact-free model are condensed to a flexibility, linear in lambda (`ContactFreeModel`). At
    lambda = 0 nothing is neglected: an exponent is zero exactly where det dR/dx is. Elsewhere the error grows with
    the square of abs(lambda) / (rho omega).
    """

    modal: RingModes  # the contact-free modes, with a disk those of each harmonic's own wave
    phase: float  # inter-blade phase angle psi, rad
    n_harmonics: int  # H of the perturbation, that of the contact Jacobian
    kappa: float = 0.0  # phase shift of the perturbation from blade to blade, beside that of the wave, rad
    static: bool = True  # whether the perturbation has a harmonic 0 (False with a frozen static displacement)
    # rho, distance of the condensed poles from lambda = 0 in units of omega; np.inf: none is condensed
    retention_radius: float = RETENTION_RADIUS
    # h_r: harmonics above it retain the poles near lambda = 0 only, and none of modes above (h_r + rho) omega
    retention_harmonic: int = RETENTION_HARMONIC

    @property
    def conjugate_pairs(self) -> bool:
        """Whether the exponents come in complex conjugate pairs: B_-h is the complex conjugate of B_h."""
        return not self.modal.neighbours_coupled or abs(np.sin(self.kappa)) < 1e-12

    @property
    def harmonics(self) -> Array:
        """0, 1, -1, 2, -2, ...; (S,)."""
        order = np.arange(1.0, self.n_harmonics + 1.0)
        pairs = np.stack([order, -order], axis=1).ravel()
        return np.append(0.0, pairs) if self.static else pairs

    @property
    def highest_pole(self) -> float:
        """Distance of retained poles from 0 in units of omega."""
        return self.retention_harmonic + self.retention_radius

    @cached_property
    def contact_free(self) -> ContactFreeModel:
        """The contact-free model.

        In real motions of the harmonics 0, 1, 2, ... where the exponents come in conjugate pairs, else in the
        harmonics 0, 1, -1, 2, -2, ...
        """
        harmonics = self.harmonics
        if self.conjugate_pairs:
            harmonics = harmonics[harmonics >= 0.0]
        phases = harmonics * self.phase + self.kappa
        return ContactFreeModel(
            self.modal.in_motion(self.modal.waves(phases), phases, [True] * phases.size),
            harmonics,
            self.retention_radius,
            self.retention_harmonic,
            self.conjugate_pairs,
        )

    @cached_property
    def contact_free_in_amplitudes(self) -> ContactFreeModel:
        """The contact-free model in the harmonics 0, 1, -1, 2, -2, ..."""
        phases = self.harmonics * self.phase + self.kappa
        modes = self.modal.in_motion(self.modal.waves(phases), phases, [True] * phases.size)
        return ContactFreeModel(modes, self.harmonics, self.retention_radius, self.retention_harmonic, False)

    def in_amplitudes(self, values: Matrix) -> NodeBlocks:
        """A contact Jacobian (k, 3, 3, 2H+1, 2H+1) of some nodes in the harmonics 0, 1, -1, 2, -2, ..."""
        first, found = 0 if self.static else 1, in_harmonics(values)
        return NodeBlocks(found.transpose(0, 3, 1, 4, 2)[:, first:, :, first:])

    @cached_property
    def _to_real(self) -> Matrix | None:
        """Real coefficients from the amplitudes p_0, p_1, p_-1, ...: Re_h = p_h + p_-h, Im_h = -i (p_h - p_-h)."""
        if self.conjugate_pairs:
            return None
        size = 2 * self.n_harmonics + 1
        matrix = np.eye(size, dtype=complex)
        for h in range(1, size, 2):
            matrix[h : h + 2, h : h + 2] = [[1.0, 1.0], [-1j, 1j]]
        return matrix

    @cached_property
    def _to_amplitudes(self) -> Matrix:
        """The inverse of `_to_real`."""
        assert self._to_real is not None
        return np.linalg.inv(self._to_real)

    def eigenproblem(self, jacobian: Array, omega: float, memory: Memory | None = None) -> "HillEigenproblem":
        """The eigenvalue problem at one solved point, in the states z of the retained poles.

        Shapes: `jacobian` (n_c, 3, 3, 2H+1, 2H+1).
        """
        touching = touching_nodes(jacobian)
        model = self.contact_free.condensed(omega, np.repeat(touching, 3))
        return self.closed(model, jacobian, memory)

    def closed(self, model: CondensedModes, jacobian: Array, memory: Memory | None) -> "HillEigenproblem":
        """Close the contact around a model of the structure.

        Shapes: `jacobian` (n_c, 3, 3, 2H+1, 2H+1).
        """
        touching = touching_nodes(jacobian)
        if not np.any(touching):
            return self._open(model)
        values: Matrix = jacobian[touching]
        if self._to_real is not None:
            values = self._to_amplitudes @ values @ self._to_real
        first = 0 if self.static else 1
        contact = NodeBlocks(values.transpose(0, 3, 1, 4, 2)[:, first:, :, first:])
        rows = None
        if memory is not None:
            node = np.cumsum(touching) - 1
            rows = ContactRows(node[memory.node], int(touching.sum()), self._to_real, first, values.shape[-1])
        return self._closed(model, contact, memory, rows)

    def closed_in_motions(
        self, model: CondensedModes, motions: Array, jacobian: Array, memory: Memory | None
    ) -> "HillEigenproblem":
        """Close the contact around a model of a few contact motions d = D v, in real coefficients.

        Shapes: `motions` (n, r), `jacobian` (n_c, 3, 3, 2H+1, 2H+1).
        """
        first, touching = 0 if self.static else 1, touching_nodes(jacobian)
        if not np.any(touching):
            return self._open(model)
        of_node = motions.reshape(-1, 3, motions.shape[1])
        contact = in_motions(jacobian[touching], of_node, of_node, first)
        rows = None if memory is None else MotionRows((np.cumsum(touching) - 1)[memory.node], motions, first)
        return self._closed(model, contact, memory, rows)

    def _open(self, model: CondensedModes) -> "HillEigenproblem":
        return HillEigenproblem(self.conjugate_pairs, model.state_matrix, np.zeros_like(model.state_matrix))

    def _closed(
        self,
        model: CondensedModes,
        contact: NodeBlocks | Matrix,
        memory: Memory | None,
        rows: ContactRows | MotionRows | None,
    ) -> "HillEigenproblem":
        loop = ContactFeedback.closed(model, contact)
        feedback: SliderMemoryFeedback | NodeMemoryFeedback | None = None
        if memory is not None:
            assert rows is not None
            if isinstance(memory, SliderMemory):
                feedback = SliderMemoryFeedback.closed(memory, rows, loop)
            else:
                feedback = NodeMemoryFeedback(memory, rows, loop)
        closed = model.state_matrix + loop.b_s @ model.output_matrix
        return HillEigenproblem(
            self.conjugate_pairs, closed, loop.b_s_derivative @ model.output_matrix, feedback, loop
        )


def touching_nodes(jacobian: Array) -> NDArray[np.bool_]:
    """The nodes (n_c,) that a contact Jacobian (n_c, 3, 3, 2H+1, 2H+1) is not zero at."""
    return np.asarray(np.any(jacobian != 0.0, axis=(1, 2, 3, 4)))


@dataclass(frozen=True)
class HillEigenproblem:
    """sigma z = (A + B S(sigma) C + sigma B S(sigma) G_1 S(sigma) C) z in the states z; sigma = lambda / omega."""

    conjugate_pairs: bool  # whether the eigenvalues come in conjugate pairs; the matrices are then real
    state_matrix: Matrix  # (n_z, n_z), A + B S C, S = S(0) without the memory
    flexibility_matrix: Matrix  # (n_z, n_z), B S G_1 S C
    # feedback of the slider memory, which makes S depend on sigma; None: there is none
    memory: SliderMemoryFeedback | NodeMemoryFeedback | None = None
    loop: ContactFeedback | None = None  # the contact Jacobian closed around the model; None where no node touches

    def eigenvalues(self, shift: complex = 0.0) -> ComplexArray:
        """All eigenvalues sigma; the slider memory is linearised around sigma = `shift`."""
        return self.linearised(shift).eigenvalues()

    def around(self, value: complex) -> "LinearHillProblem":
        """The problem linearised next to an approximate eigenvalue."""
        return LinearHillProblem(value * (1.0 + ROUND_OFF) + ROUND_OFF, self.linearised(value))

    def refined(self, linear: "LinearHillProblem", value: complex, near: Near) -> Refined | None:
        """Where the eigenvalue changes no more, nothing is linearised."""
        return Refined(value) if abs(near.change) < CONVERGED else None

    def undecided(self, linear: "LinearHillProblem", near: Near) -> Near | None:
        """The nearest of all eigenvalues; None where no pole is retained."""
        return Near(linear.nearest_of_all(), None) if linear.size else None

    def x_times(self, sigma: complex, column: Matrix) -> Matrix:
        """Displacement under the contact forces K(sigma) d of one without them, (I - G_0 K(sigma))^-1 d.

        Shapes: `column` (n,).
        """
        if self.memory is not None:
            return self.memory.x_times(sigma, column)
        return column if self.loop is None else self.loop.x_times(column)

    def linearised(self, shift: complex) -> Pencil:
        """The problem with the memory linearised around sigma = `shift`."""
        matrix, derivative = self.state_matrix, self.flexibility_matrix
        if self.memory is not None:
            terms = self.memory.terms(shift)
            matrix = matrix + terms.state - shift * terms.derivative
            derivative = derivative + terms.derivative + terms.flexibility
        return Pencil(matrix, np.eye(len(derivative)) - derivative)


@dataclass(frozen=True)
class LinearHillProblem:
    """sigma E_c z = A_c z, the memory linearised around `shift`."""

    shift: complex
    pencil: Pencil  # A_c and E_c

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.pencil.matrix)

    @property
    def columns(self) -> int:
        """One, but none for few states."""
        return int(self.size > FEW_STATES)

    def change(self, vectors: ComplexArray) -> ComplexArray:
        """E_c times a vector (n_z,)."""
        return np.asarray(self.pencil.descriptor @ vectors)

    def solved(self, right: ComplexArray) -> ComplexArray:
        """(A_c - shift E_c)^-1 times a vector (n_z,)."""
        return self._factors.solved(right)

    def nearest_of_all(self) -> complex:
        """The eigenvalue next to the shift, less the shift."""
        values = self.pencil.eigenvalues() - self.shift
        return complex(values[np.argmin(np.abs(values))])

    @cached_property
    def _factors(self) -> Factors:
        return Factors.of(self.pencil.matrix - self.shift * self.pencil.descriptor)

"""One exponent of a point with stiff contacts, exact: all modes, and nothing linearised in sigma.

The contact of the point is closed around the mean flexibility of all waves (`ClosedContact`). An eigenvalue of the
small problem that is left in their shared motions (`SharedMotions`) is the start of residual inverse iteration with
the whole problem, T(sigma) d = d - G(sigma) K(sigma) d = 0; the small problem serves as an approximate inverse of T.

References
----------
A. Neumaier, Residual inverse iteration for the nonlinear eigenvalue problem, SIAM Journal on Numerical Analysis
22(5), 1985.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.stability.contact_feedback import Factors, SliderMemoryFeedback
from nonlinear.stability.eigenproblem import Near, Refined, converged
from nonlinear.stability.hill import HillEigenproblem, HillProblem, touching_nodes
from nonlinear.stability.modal_condensation import Matrix
from nonlinear.stability.perturbation_pencils import ClosingMotions, PerturbationPencils, SharedMotions, series
from nonlinear.stability.point_contact import PointContact, in_harmonics
from rom.cyclic.modal_model import WaveModes


@dataclass(frozen=True)
class ClosedContact:
    """Forces on the shared motions y under motions y, K_U(sigma) = U^T K (I - M K)^-1 U, M the mean flexibility.

    M is linear in sigma, the slider memory in K is not linearised. The contact is closed in few motions, d = D v.
    """

    closed: HillEigenproblem  # the contact around the mean flexibility, in real motions
    harmonics: int  # S, those of the perturbation: 0, 1, -1,
    motions: ClosingMotions  # the motions v
    mean: ComplexArray  # (S, r, r), M at sigma = 0, in these motions

    @property
    def static(self) -> bool:
        """Whether there is a harmonic 0."""
        return self.harmonics % 2 == 1

    @classmethod
    def of(cls, problem: HillProblem, motions: SharedMotions, contact: PointContact) -> "ClosedContact":
        """Close the contact of a point."""
        chosen = motions.closing(np.repeat(touching_nodes(contact.jacobian), 3))
        structure = chosen.structure(problem.n_harmonics, contact.omega, problem.static)
        closed = problem.closed_in_motions(structure, chosen.motions, contact.jacobian, contact.memory)
        s = np.asarray(1j * contact.omega * problem.harmonics, dtype=complex)
        return cls(closed, problem.harmonics.size, chosen, series(chosen.mean, s, contact.omega)[0])

    def at(self, sigma: complex) -> tuple[ComplexArray, ComplexArray]:
        """K_U and its derivative in sigma, in the amplitudes of the harmonics, (S p, S p) each."""
        if sigma not in self._known:
            (state, linear), memory = self._without_memory, self.closed.memory
            value, change = state + sigma * linear, linear
            if isinstance(memory, SliderMemoryFeedback):
                of_memory = self._of_sliders(memory, sigma)
                value, change = value + of_memory[0], change + of_memory[1]
            elif memory is not None:
                terms = memory.terms(sigma)
                value = value + self._in_amplitudes(terms.state + sigma * terms.flexibility)
                change = change + self._in_amplitudes(terms.flexibility + terms.derivative)
            self._known[sigma] = value, change
        return self._known[sigma]

    def _of_sliders(self, memory: SliderMemoryFeedback, sigma: complex) -> tuple[ComplexArray, ComplexArray]:
        """What the memory adds to K_U and to its derivative; its factors, of low rank, are brought to amplitudes."""
        parts = memory.factors(sigma)
        right = self._columns_in_amplitudes(np.concatenate([parts.dw, memory.output_derivative]))
        value = np.concatenate([parts.state + sigma * parts.flexibility, sigma * parts.inputs], axis=1)
        change = np.concatenate([parts.flexibility + parts.derivative, parts.inputs], axis=1)
        return self._rows_in_amplitudes(value) @ right, self._rows_in_amplitudes(change) @ right

    @cached_property
    def _without_memory(self) -> tuple[ComplexArray, ComplexArray]:
        """K_U at sigma = 0 and its derivative without the memory of the sliders."""
        return self._in_amplitudes(self.closed.state_matrix), self._in_amplitudes(self.closed.flexibility_matrix)

    def motion(self, sigma: complex, free: ComplexArray) -> ComplexArray:
        """(I - M K(sigma))^-1 v: the motion under contact forces of one without them, (S, r).

        Shapes: `free` (S, r).
        """
        first = int(self.static)
        real = free.copy()
        one, other = free[first::2], free[first + 1 :: 2]
        real[first::2], real[first + 1 :: 2] = one + other, -1j * (one - other)
        moved = self.closed.x_times(sigma, real.ravel())
        return self._rows_in_amplitudes(moved[:, None]).reshape(free.shape)

    @cached_property
    def _known(self) -> dict[complex, tuple[ComplexArray, ComplexArray]]:
        return {}

    def _rows_in_amplitudes(self, rows: Matrix) -> ComplexArray:
        """Forces or motions (S n, k) of real coefficients as amplitudes of the harmonics 0, 1, -1, ..."""
        first, real = int(self.static), rows.reshape(self.harmonics, -1)
        result = real.astype(complex)
        one, other = real[first::2], 1j * real[first + 1 :: 2]
        result[first::2], result[first + 1 :: 2] = 0.5 * (one + other), 0.5 * (one - other)
        return result.reshape(rows.shape)

    def _columns_in_amplitudes(self, columns: Matrix) -> ComplexArray:
        """What is multiplied by real coefficients (k, S p), as what is multiplied by the amplitudes."""
        first, real = int(self.static), columns.reshape(len(columns), self.harmonics, -1)
        result = real.astype(complex)
        one, other = real[:, first::2], 1j * real[:, first + 1 :: 2]
        result[:, first::2], result[:, first + 1 :: 2] = one - other, one + other
        return result.reshape(columns.shape)

    def _in_amplitudes(self, matrix: Matrix) -> ComplexArray:
        size, rows = self.harmonics, len(matrix) // max(self.harmonics, 1)
        missing = int(not self.static)  # harmonic 0
        values = np.zeros((rows, rows, size + missing, size + missing), dtype=matrix.dtype)
        values[:, :, missing:, missing:] = matrix.reshape(size, rows, size, rows).transpose(1, 3, 0, 2)
        result = in_harmonics(values)[:, :, missing:, missing:]
        return np.ascontiguousarray(result.transpose(2, 0, 3, 1)).reshape(matrix.shape)


MAX_RESIDUALS = 15
OFFSET = 1e-3  # of a shift from the eigenvalue sought, in units of omega, as all below
CONVERGED = 1e-7  # change of an eigenvalue at which its residual iteration ends
FAR = 0.003  # change of an eigenvalue after which the small problem is linearised again
SPURIOUS = 0.05  # distance of the nearest eigenvalues, several as near, of a start that is none
AWAY = 0.02  # of an eigenvalue from its start, where that may have been another one
AT_POLE = 5e-3  # of a start from a pole without contact
CONVERGED_VECTOR = 1e-4  # relative change of its vector
SLOW = 1.5  # times a change of the vector that the next one may be


@dataclass(frozen=True)
class PerturbationStructure:
    """The structure as perturbations of one kappa see it."""

    motions: SharedMotions  # shared motions and mean flexibility
    pencils: PerturbationPencils  # the problem in the shared motions; of one perturbation
    modes: WaveModes  # all modes in the waves of the harmonics


@dataclass(frozen=True)
class ClosedRefinement:
    """Refines eigenvalues of the perturbations of one point and one kappa."""

    structure: PerturbationStructure  # the structure
    contact: PointContact  # the point
    closed: ClosedContact  # its contact, closed around the mean flexibility
    conjugate_pairs: bool = False  # whether the eigenvalues come in conjugate pairs

    def converged(self, value: complex) -> Refined | None:
        """The eigenvalue that an approximate one leads to; None if it leads to none."""
        found = converged(self, value)
        if found is None or abs(found.value - value) > AWAY:
            # a mode that hardly moves the contacts is not in the small problem
            poles = self.structure.pencils.poles[0] / self.contact.omega
            distance = np.abs(poles - 1j * self.structure.pencils.harmonics[:, None, None] - value)
            if distance.size and distance.min() < AT_POLE:
                return Refined(value, False)
        return found

    def around(self, value: complex) -> "SmallProblem":
        """The small problem linearised beside an approximate eigenvalue."""
        shift = value + OFFSET
        flexibility, change = (part[0] for part in self.structure.pencils.flexibility(shift, self.contact.omega))
        return SmallProblem(shift, flexibility, change, *self.closed.at(shift))

    def undecided(self, linear: "SmallProblem", near: Near) -> Refined | None:
        """Where several are as near there is none, unless they are at hand."""
        return Refined(linear.shift - OFFSET, False) if abs(near.change) <= SPURIOUS else None

    def refined(self, linear: "SmallProblem", value: complex, near: Near) -> Refined | None:
        """The eigenvalue of the whole problem, where that of the small one is near enough."""
        if near.vector is None or not abs(near.change) < FAR:
            return None
        exact = self._exact(linear, value, near.vector)
        return Refined(value, False) if exact is None else Refined(exact)

    def _exact(self, small: "SmallProblem", sigma: complex, y: ComplexArray) -> complex | None:
        """The eigenvalue of the whole problem near that of the small one, `sigma` with the vector `y`."""
        offset, chosen = sigma - small.shift, self.closed.motions
        d = self.closed.motion(small.shift, y.reshape(self.closed.harmonics, -1) @ chosen.shared.T) @ chosen.motions.T
        along = d.conj() / np.vdot(d, d)
        last = np.inf
        for _ in range(MAX_RESIDUALS):
            change = self._approximately_solved(small, self._residual(sigma, d))
            part = complex(np.sum(along * change))
            step = offset * part
            sigma += step
            turned = change - part * d
            error = float(np.linalg.norm(turned) / np.linalg.norm(d))
            if not error < max(SLOW * last, CONVERGED_VECTOR):  # nor with a NaN
                return None
            if abs(step) < CONVERGED and error < CONVERGED_VECTOR:
                return sigma
            d -= turned
            last = error
        return None

    def _residual(self, sigma: complex, d: ComplexArray) -> ComplexArray:
        """T(sigma) d, (S, n)."""
        modes = self.structure.modes
        s = self.contact.omega * (sigma + 1j * self.structure.pencils.harmonics)[:, None]
        receptance = 1.0 / (modes.inertia * s**2 + modes.total_damping * s + modes.total_stiffness)
        force = self._forces(sigma, d)
        amplitude = receptance[:, :, None] * (self._adjoint @ force[:, :, None])
        return np.asarray(d - (self._relative @ amplitude)[:, :, 0])

    def _approximately_solved(self, small: "SmallProblem", right: ComplexArray) -> ComplexArray:
        """T(shift)^-1 times (S, n), with the flexibility of the small problem.

        X = (I - R K)^-1 = I + D (I - M D^T K D)^-1 M D^T K with the mean flexibility R = D M D^T in the motions v.
        """
        shift, (_, motions, shared, _) = small.shift, self.closed.motions
        force = self._forces(shift, right) @ motions
        moved = self.closed.motion(shift, (self.closed.mean @ force[:, :, None])[:, :, 0])
        force = self._forces(shift, right + moved @ motions.T) @ motions @ shared
        added = small.solved((small.flexibility @ force[:, :, None]).ravel()).reshape(force.shape)
        return right + (moved + self.closed.motion(shift, added @ shared.T)) @ motions.T

    def _forces(self, sigma: complex, d: ComplexArray) -> ComplexArray:
        """K(sigma) d, (S, n)."""
        active = self.closed.motions.active
        every = np.zeros((len(d), active.size), dtype=complex)
        every[:, active] = d
        return self.contact.forces(sigma, every, self.closed.static)[:, active]

    @cached_property
    def _relative(self) -> ComplexArray:
        return self.structure.modes.relative[:, self.closed.motions.active]

    @cached_property
    def _adjoint(self) -> ComplexArray:
        return np.ascontiguousarray(self.structure.modes.adjoint[:, :, self.closed.motions.active])


@dataclass(frozen=True)
class SmallProblem:
    """N(sigma) y = (I - D(sigma) K_U(sigma)) y = 0 around a shift."""

    shift: complex  # sigma around which it is linearised
    # `flexibility`, `flexibility_change`: (S, p, p), D, flexibility of the waves less the mean, and its derivative
    flexibility: ComplexArray
    flexibility_change: ComplexArray
    # `contact`, `contact_change`: (S p, S p), K_U and its derivative
    contact: ComplexArray
    contact_change: ComplexArray
    columns: ClassVar[int] = 3

    @property
    def size(self) -> int:
        """Number of unknowns, S p."""
        return len(self.contact)

    def solved(self, right: ComplexArray) -> ComplexArray:
        """N^-1 times columns (S p, ...)."""
        return self._factors.solved(right)

    def change(self, vectors: ComplexArray) -> ComplexArray:
        """-dN / dsigma times columns (S p, m)."""
        parts = ((self.flexibility_change, self.contact), (self.flexibility, self.contact_change))
        shape = *self.flexibility.shape[:2], -1
        return np.asarray(
            sum((one @ (other @ vectors).reshape(shape)).reshape(vectors.shape) for one, other in parts)
        )

    @cached_property
    def _factors(self) -> Factors:
        size, p, _ = self.flexibility.shape
        matrix = -(self.flexibility @ self.contact.reshape(size, p, -1)).reshape(self.contact.shape)
        matrix[np.diag_indices_from(matrix)] += 1.0
        return Factors.of(matrix)

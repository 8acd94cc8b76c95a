"""Eigenvalue problems of many perturbations at once, in few contact motions that all waves share.

The lowest modes of each wave stay what they are. All others are a flexibility without resonance, a series in s:

    1 / (s^2 + c_m s + omega_m^2) = 1 / omega_m^2 - (s^2 + c_m s) / omega_m^4 + s^4 / omega_m^6 - ...

Most of it, the local flexibility of the contact faces, is the same in all waves. The contact motions of the lowest
modes, and what the flexibility of a wave differs by from the mean of all waves, span few dimensions.

Of large problems only the eigenvalues next to zero are solved for, in Krylov subspaces of their inverses.

References
----------
Y. Saad, Numerical Methods for Large Eigenvalue Problems, SIAM, 2011, chapters 6 and 8.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.stability.contact_feedback import ContactFeedback
from nonlinear.stability.eigenproblem import WIDTH, Pencil
from nonlinear.stability.hessenberg_qr import qr_eigenvalues
from nonlinear.stability.modal_condensation import CondensedModes, HarmonicBlocks, Matrix, real_form
from nonlinear.stability.reduced_problem import ABOVE, MARGIN, NEAREST, condensed_flexibility, near_poles
from rom.cyclic.modal_model import ModalModel

TERMS = 4  # of the series: 1, -s^2, -s, s^4
NEGLIGIBLE_MEAN = 0.03  # of the mean flexibility, times the contact stiffness, where contacts are closed around it


@dataclass(frozen=True)
class SharedMotions:
    """Shared motions of the contacts, and the mean flexibility.

    Contact displacements times the square root of the contact stiffness have the p shared motions U, orthonormal
    columns: d = W^-1 U y. Few more have nearly all of the mean flexibility: Q = (U, V), orthonormal too.
    """

    shared: Array  # (3 n_c, p), W^-1 U
    mean: Array  # (4, 3 n_c, 3 n_c), terms of the flexibility of the modes above the lowest ones, mean of all waves
    flexible: Array  # (3 n_c, r), W^-1 Q
    mean_of_flexible: Array  # (4, r, r), terms of the mean flexibility in Q

    def closing(self, active: NDArray[np.bool_]) -> "ClosingMotions":
        """The motions in which a contact is closed: Q, or the dofs that touch where these are fewer.

        Shapes: `active` (3 n_c,).
        """
        p, r = self.shared.shape[1], self.flexible.shape[1]
        touching = int(np.count_nonzero(active))
        if touching <= r:
            return ClosingMotions(active, np.eye(touching), self.shared[active], self.mean[:, active][:, :, active])
        return ClosingMotions(active, self.flexible[active], np.eye(r, p), self.mean_of_flexible)


class ClosingMotions(NamedTuple):
    """Few contact motions in which a contact is closed around the mean flexibility."""

    active: NDArray[np.bool_]  # (3 n_c,), the dofs of the nodes that touch, n of them
    motions: Array  # (n, r), D, d = D v
    shared: Array  # (r, p), E, the shared motions among them: v = E y
    mean: Array  # (4, r, r), terms of the mean flexibility in v

    def structure(self, n_harmonics: int, omega: float, static: bool) -> CondensedModes:
        """The mean flexibility, with y as outputs and the forces on these as inputs; no states.

        In real motions, rows (0, Re 1, Im 1, ...), near sigma = 0.
        """
        harmonics = np.arange(0 if static else 1, n_harmonics + 1)
        s = np.asarray(1j * omega * harmonics, dtype=complex)
        first, size = int(static), len(self.shared)
        blocks, changes = (
            HarmonicBlocks(
                part[0].real if static else np.zeros((0, 0)),
                real_form(part[first:]).reshape(n_harmonics, 2 * size, 2 * size),
            )
            for part in series(self.mean, s, omega)
        )
        shared = np.kron(np.eye(first + 2 * n_harmonics), self.shared)
        return CondensedModes(np.zeros((shared.shape[1],) * 2), shared.T, shared, blocks, changes)


def series(terms: Matrix, s: ComplexArray, omega: float) -> tuple[ComplexArray, ComplexArray]:
    """A flexibility from the `terms` of its series, (..., 4, n, n), and its derivative in sigma = s / omega.

    Shapes: `terms` (4, n, n), `s` (S,), returns (..., S, n, n).
    """
    powers = np.stack([np.ones_like(s), -(s**2), -s, s**4], axis=-1)
    changes = omega * np.stack([np.zeros_like(s), -2.0 * s, -np.ones_like(s), 4.0 * s**3], axis=-1)
    flat = terms.reshape(*terms.shape[:-2], -1)
    shape = (*(terms.shape[:-3] or s.shape), *terms.shape[-2:])
    value, change = ((factors[..., None, :] @ flat).reshape(shape) for factors in (powers, changes))
    return value, change


class WeightedModes(NamedTuple):
    """Some modes: natural frequency, stiffness and damping (m,) and weighted motion (n, m), of contacts or a face.

    With Coriolis forces they are poles, each by itself, and `adjoint` (m, n) is what they take of forces.
    """

    frequency: Array
    stiffness: Matrix
    damping: Matrix
    motion: Matrix
    adjoint: Matrix
    inertia: float = 1.0

    @classmethod
    def of(cls, own: ModalModel, motion: Matrix) -> "WeightedModes":
        """The modes of a wave or of a blade.

        Shapes: `motion` (n, m).
        """
        if own.coriolis is None:
            motions = motion, motion.conj().T
            return cls(own.angular_frequency, own.total_stiffness, own.total_damping, *motions)
        poles, motions = own.turning.poles, (motion @ own.turning.shapes, own.turning.dual @ motion.conj().T)
        return cls(np.abs(poles), np.abs(poles) ** 2, -poles.conj(), *motions, 0.0)

    def chosen(self, some: NDArray[np.bool_]) -> "WeightedModes":
        """Some of them, (m,)."""
        rows = self.frequency[some], self.stiffness[some], self.damping[some]
        return WeightedModes(*rows, self.motion[:, some], self.adjoint[some], self.inertia)

    def in_motions(self, vectors: Array) -> "WeightedModes":
        """The same in the motions that are the columns of `vectors` (n, p)."""
        return self._replace(motion=vectors.T @ self.motion, adjoint=self.adjoint @ vectors)

    def term(self, number: int, other: "WeightedModes | None" = None) -> Matrix:
        """A factor of the series (`series`), (n, n); with the motion of the same modes of an `other` face, across."""
        squared, c = self.stiffness, self.damping
        if self.inertia:
            factor = (1.0 / squared, 1.0 / squared**2, c / squared**2, 1.0 / squared**3)[number]
        else:  # of 1 / (k + c s)
            factor = (1.0 / squared, -(c**2) / squared**3, c / squared**2, c**4 / squared**5)[number]
        return np.asarray((self.motion * factor) @ (self if other is None else other).adjoint)

    def terms(self, other: "WeightedModes | None" = None) -> Matrix:
        """All factors, (4, n, n)."""
        return np.stack([self.term(number, other) for number in range(TERMS)])


def unweighted(mean: Array, vectors: Array, weight: Array) -> tuple[Array, Array, Array, Array]:
    """The attributes of `SharedMotions` from U `vectors` and the terms of the mean flexibility, with weights."""
    inverse = np.divide(1.0, weight, out=np.zeros_like(weight), where=weight > 0.0)
    across = vectors.T @ mean[0]
    rest = mean[0] - vectors @ across
    rest -= (rest @ vectors) @ vectors.T
    sizes, others = np.linalg.eigh(rest)
    flexible = np.concatenate([vectors, others[:, sizes > NEGLIGIBLE_MEAN]], axis=1)
    in_flexible = flexible.T @ mean @ flexible
    return inverse[:, None] * vectors, mean * (inverse[:, None] * inverse), inverse[:, None] * flexible, in_flexible


DIMENSION = 30  # of a subspace; 24 had all of 19 600 eigenvalues sought in matrices of 42 to 78 rows to 0.002
OFF_SHIFT = 0.01 + 0.01j  # of the shift from zero: an eigenvalue at the shift itself would spoil all others
LARGE = 45  # rows from which the subspaces take less time than all eigenvalues


def nearest_eigenvalues(pencil: Pencil) -> ComplexArray:
    """Eigenvalues of many problems (K, n, n), those next to zero if there are many.

    Of matrices with `LARGE` or more rows as many as the subspace has dimensions. Those nearest to zero are accurate,
    the last few are not eigenvalues yet.
    Shapes: returns (n, m).
    """
    matrix, descriptor = pencil
    if matrix.shape[-1] >= LARGE:
        try:
            return OFF_SHIFT + _of_subspaces(np.asarray(np.linalg.solve(matrix - OFF_SHIFT * descriptor, descriptor)))
        except np.linalg.LinAlgError:  # the shift is an eigenvalue, or a subspace is invariant
            pass
    return pencil.eigenvalues()


def _of_subspaces(inverse: ComplexArray) -> ComplexArray:
    """Inverses of the eigenvalues of (K, n, n) in Krylov subspaces, (K, m): Arnoldi's method, orthogonal twice."""
    count, size, _ = inverse.shape
    basis = np.zeros((count, DIMENSION + 1, size), dtype=complex)  # rows
    projected = np.zeros((count, DIMENSION, DIMENSION), dtype=complex)
    basis[:, 0] = np.exp(1j * np.arange(size) ** 2) / np.sqrt(size)
    for step in range(DIMENSION):
        known = basis[:, : step + 1]
        vector = inverse @ basis[:, step, :, None]
        for _ in range(2):
            part = known.conj() @ vector
            vector -= known.transpose(0, 2, 1) @ part
            projected[:, : step + 1, step] += part[:, :, 0]
        length = np.linalg.norm(vector[:, :, 0], axis=1)
        if step + 1 < DIMENSION:
            projected[:, step + 1, step] = length
            basis[:, step + 1] = vector[:, :, 0] / length[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(1.0 / qr_eigenvalues(projected))


FARTHEST = 4.0  # of a pole that contacts may move near, in units of omega: stiff contacts move it far
BESIDE = 1.3  # distance of poles that are states too where their error as a flexibility is not negligible
NEGLIGIBLE_ERROR = 3e-3  # times the contact stiffness
OUTSIDE = 10.0j  # pole of a state that is none
NO_BLOCK = np.zeros((0, 0), dtype=complex)  # of harmonic 0, where it is as large as the others


@dataclass(frozen=True)
class PerturbationPencils:
    """The eigenvalue problems of K perturbations, in the shared motions of all waves (`SharedMotions`)."""

    harmonics: Array  # (S,), h
    # `poles`, `residues`: (K, S, 2, q), of the lowest modes in the wave of each harmonic; (K, S, 1, q) of poles that
    # each have a motion of their own
    poles: ComplexArray
    residues: ComplexArray
    motion: ComplexArray  # (K, S, p, q), contact motions of these modes
    adjoint: ComplexArray  # (K, S, q, p), what they take of contact forces
    rise: Array  # (K, S, 1, q), how far contacts raise the natural frequencies at most, rad/s
    # (K, S, 1, q), what contact springs add at most to the squares of the natural frequencies, (rad/s)^2
    stiffening: Array
    deviation: ComplexArray  # (K, S, 4, p, p), terms of the flexibility of the other modes less the mean

    def eigenvalues(
        self, contact: tuple[Matrix, Matrix], shift: ComplexArray, omega: float, highest_pole: float
    ) -> ComplexArray:
        """Eigenvalues sigma - `shift` of each perturbation, (K, n_z) or fewer; few of them are true far from 0.

        The parameters are those of `closed`.
        """
        return nearest_eigenvalues(self.closed(contact, shift, omega, highest_pole)[1])

    def closed(
        self,
        contact: tuple[Matrix, Matrix],
        shift: ComplexArray,
        omega: float,
        highest_pole: float,
        above: float = ABOVE,
    ) -> tuple[NDArray[np.bool_], Pencil]:
        """The poles retained, (K, S, 2, q), and the problems in sigma - `shift`, (K, n_z, n_z).

        Shapes: `contact` (S p, S p), K_U and its derivative, or one for each perturbation; `shift` (K,).
        """
        state = self._states(shift, omega, highest_pole, above)
        blocks = (HarmonicBlocks(NO_BLOCK, part) for part in self._flexibilities(state, shift, omega))
        inputs = state.residue[:, :, None] * state.input
        poles = state.pole[:, :, None] * np.eye(state.pole.shape[1])
        loop = ContactFeedback.closed(CondensedModes(poles, inputs, state.output, *blocks), contact[0])
        return state.retained, loop.pencil(contact[1])

    def flexibility(self, sigma: complex, omega: float) -> tuple[ComplexArray, ComplexArray]:
        """Flexibility of each wave less the mean and its derivative in sigma, all modes, (K, S, p, p) each."""
        s = np.asarray(omega * (sigma + 1j * self.harmonics), dtype=complex)
        resonance = 1.0 / (s[:, None, None] - self.poles)
        modes = np.sum(self.residues * resonance, axis=2), -omega * np.sum(self.residues * resonance**2, axis=2)
        others = series(self.deviation, np.broadcast_to(s, self.poles.shape[:2]), omega)
        value, change = (
            (self.motion * one[:, :, None]) @ self.adjoint + other for one, other in zip(modes, others, strict=True)
        )
        return value, change

    def _states(self, shift: ComplexArray, omega: float, highest_pole: float, above: float) -> "_States":
        """The poles retained."""
        poles, residues = self.poles / omega, self.residues / omega
        own_shift = shift[:, None, None, None]
        middle = self.harmonics[:, None, None] + own_shift.imag
        distance = poles - 1j * self.harmonics[:, None, None] - own_shift
        retained = near_poles(poles, middle, above, self.rise / omega + MARGIN, highest_pole, FARTHEST)
        error = np.abs(residues) * self.stiffening * (WIDTH / 2.0) ** 2
        beside = near_poles(poles, middle, BESIDE, BESIDE + self.rise / omega, highest_pole)
        retained |= beside & (error > NEGLIGIBLE_ERROR * np.abs(distance) ** 3)
        count, (slots, q) = len(retained), retained.shape[-2:]
        flat = retained.reshape(count, -1)
        order = np.argsort(~flat, axis=1, kind="stable")[:, : flat.sum(axis=1).max()]
        own = np.arange(count)[:, None]
        true = flat[own, order]
        harmonic, mode = order // (slots * q), order % q
        output = np.zeros((count, *self.motion.shape[1:3], order.shape[1]), dtype=complex)
        column = np.arange(order.shape[1])
        output[own, harmonic, :, column] = np.where(true[:, :, None], self.motion[own, harmonic, :, mode], 0.0)
        inputs = np.zeros((count, order.shape[1], *self.motion.shape[1:3]), dtype=complex)
        inputs[own, column, harmonic] = np.where(true[:, :, None], self.adjoint[own, harmonic, mode], 0.0)
        return _States(
            retained,
            distance,
            np.where(true, distance.reshape(count, -1)[own, order], OUTSIDE),
            np.where(true, residues.reshape(count, -1)[own, order], 0.0),
            output.reshape(count, output.shape[1] * output.shape[2], order.shape[1]),
            inputs.reshape(count, order.shape[1], output.shape[1] * output.shape[2]),
        )

    def _flexibilities(
        self, state: "_States", shift: ComplexArray, omega: float
    ) -> tuple[ComplexArray, ComplexArray]:
        """G_0 and G_1 less the mean, of what is no state, (K, S, p, p)."""
        s = np.asarray(omega * (1j * self.harmonics + shift[:, None]), dtype=complex)
        modes = condensed_flexibility(state.distance, self.residues / omega, state.retained, NEAREST)
        others = series(self.deviation, s, omega)
        g_0, g_1 = (
            (self.motion * one[:, :, None]) @ self.adjoint + other for one, other in zip(modes, others, strict=True)
        )
        return g_0, g_1


class _States(NamedTuple):
    """The retained poles of some perturbations, filled up to n_z."""

    retained: NDArray[np.bool_]  # (K, S, 2, q), which they are
    distance: ComplexArray  # (K, S, 2, q), all poles from the shift, in units of omega
    # `pole`, `residue`: (K, n_z), of the states
    pole: ComplexArray
    residue: ComplexArray
    output: ComplexArray  # (K, S p, n_z), contact motion of the states
    input: ComplexArray  # (K, n_z, S p), what they take of contact forces

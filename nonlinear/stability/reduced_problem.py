"""The perturbations of the wave in few modes, the lowest and residual ones: Hill's method in modal coordinates.

A harmonic has as many unknowns as there are modes, not three a contact node, and each unknown its own poles.

References
----------
S. Rubin, Improved component-mode representation for structural dynamic analysis, AIAA Journal 13(8), 1975.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.stability.contact_feedback import ContactFeedback, Factors, add_identity
from nonlinear.stability.eigenproblem import Pencil
from nonlinear.stability.hill import HillProblem
from nonlinear.stability.modal_condensation import (
    SLOW,
    Chosen,
    CondensedModes,
    ContactFreeModel,
    Diagonal,
    Matrix,
    Placed,
    poles_and_residues,
)
from nonlinear.stability.point_contact import in_harmonics
from rom.cyclic.contact_springs import contact_springs
from rom.cyclic.cyclic_symmetry import relative_contact_motion
from rom.cyclic.modal_model import ModalModel, WaveModes

LEAST = 4  # residual modes


def contact_weights(contact: ContactParameters) -> Array:
    """Square roots of the contact stiffnesses, (3 n_c,)."""
    springs = contact_springs(contact.n_contacts, contact.normal_stiffness, contact.tangential_stiffness)
    return np.asarray(np.sqrt(springs.ravel()))


def reduced_modes(
    modal: ModalModel, contact: ContactParameters, kept: int, negligible: float, most: int, least: int = LEAST
) -> tuple[ModalModel, float]:
    """The lowest modes, and the static motions of all others that give most of the flexibility of the contact faces.

    The motions of both faces by the other modes, phi_m / omega_m, weighted by the square root of the contact
    stiffness, have the singular vectors V. V / omega are static motions of unit strain energy; their Ritz modes, with
    the mean damping of the modes in them, are the residual modes.
    """
    if kept + least >= modal.damping.size:
        return modal, 0.0
    assert modal.left is not None
    weight = contact_weights(contact)[:, None]
    frequency = modal.angular_frequency[kept:]
    faces = np.concatenate([weight * modal.right[:, kept:], weight * modal.left[:, kept:]])
    _, sizes, shapes = np.linalg.svd(faces / frequency, full_matrices=False)
    count = min(max(int(np.count_nonzero(sizes**2 > negligible)), least), max(most, least))
    static = shapes[:count].T / frequency[:, None]
    mass, vectors = np.linalg.eigh(static.T @ static)  # their stiffness is 1
    residual = (static @ vectors / np.sqrt(mass))[:, ::-1]

    def joined(face: Array) -> Array:
        return np.concatenate([face[:, :kept], face[:, kept:] @ residual], axis=1)

    reduced = replace(
        modal,
        angular_frequency=np.append(modal.angular_frequency[:kept], 1.0 / np.sqrt(mass[::-1])),
        damping=np.append(modal.damping[:kept], modal.damping[kept:] @ residual**2),
        right=joined(modal.right),
        left=joined(modal.left),
    )
    return reduced, float(sizes[count] ** 2) if count < sizes.size else 0.0


@dataclass(frozen=True)
class CondensedPoles:
    """Poles retained as states, and the flexibility of the others, g_0 + sigma g_1, around sigma = 0."""

    state: NDArray[np.int64]  # (n_z,), unknown (harmonic and mode) of each state
    # `pole`, `residue`: (n_z,), p and a of each state, in units of omega
    pole: ComplexArray
    residue: ComplexArray
    # `flexibility`, `derivative`: (D,), g_0 and g_1 of each unknown
    flexibility: ComplexArray
    derivative: ComplexArray

    @classmethod
    def of(
        cls, poles: ComplexArray, residues: ComplexArray, retained: NDArray[np.bool_], nearest: float
    ) -> "CondensedPoles":
        """Retain some of the poles.

        Shapes: `poles` (S, 2, q), `residues` (S, 2, q), `retained` (S, 2, q).
        """
        g_0, g_1 = condensed_flexibility(poles, residues, retained, nearest)
        row, _, mode = np.nonzero(retained)
        state = row * poles.shape[2] + mode
        return cls(state, poles[retained], residues[retained], g_0.ravel(), g_1.ravel())

    def pencils(self, parts: ComplexArray, weights: Array, change: tuple[Matrix, Matrix] | Matrix | None) -> Pencil:
        """The problems of some contacts K + sigma dK closed around the poles, (k, n_z, n_z).

        K: sums of the same parts. The unknowns c without a state are eliminated first: the others, u, see the contact

            S = K_uu + K_uc (1 - g_c K_cc)^-1 g_c K_cu,

        g = g_0 + sigma g_1, and its derivative in sigma.
        Shapes: `parts` (m, D, D), `weights` (k, m), `change` (k, D, D), dK; or (k, D, M) and (k, M, D), its factors.
        """
        moves = np.zeros(self.flexibility.size, dtype=bool)
        moves[self.state] = True
        u, c, place = np.flatnonzero(moves), np.flatnonzero(~moves), np.cumsum(moves)[self.state] - 1
        if not (u.size and c.size):
            return ContactFeedback.closed(self.model, weighted_sums(parts, weights)).pencil(change)
        # of the parts, which are fewer: the sums are then written once, in the order in which they are solved with
        k_uu, k_uc, k_cu, k_cc = (parts[:, rows[:, None], columns] for rows in (u, c) for columns in (u, c))
        g_0, slope = self.flexibility[c, None], self.derivative[c] / self.flexibility[c]
        factors = Factors.of(add_identity(weighted_sums(-g_0 * k_cc, weights)))
        motion = factors.solved(weighted_sums(g_0 * k_cu, weights))  # d_c = motion d_u
        from_c = weighted_sums(k_uc, weights)
        force = factors.rows_solved(from_c)  # times g_0: as much of f_c as acts on u
        derivative = (force * slope) @ motion
        if change is not None:
            inputs, outputs = change if isinstance(change, tuple) else (change, None)
            inputs = inputs[:, u] + force @ (g_0 * inputs[:, c])
            last = inputs if outputs is None else outputs
            seen = last[..., u] + last[..., c] @ motion
            derivative += seen if outputs is None else inputs @ seen
        left = CondensedPoles(place, self.pole, self.residue, self.flexibility[u], self.derivative[u])
        return ContactFeedback.closed(left.model, weighted_sums(k_uu, weights) + from_c @ motion).pencil(derivative)

    @property
    def model(self) -> CondensedModes:
        """The same as a model of the structure in modal coordinates, which the contact is closed around."""
        return CondensedModes(
            np.diag(self.pole),
            Placed(self.state, self.residue),
            Chosen(self.state),
            Diagonal(self.flexibility),
            Diagonal(self.derivative),
        )


def weighted_sums(parts: ComplexArray, weights: Array) -> ComplexArray:
    """Sums of `parts` (m, n, l) times `weights` (k, m), (k, n, l)."""
    rows = np.ascontiguousarray(parts).reshape(len(parts), -1)
    sums = weights @ rows.view(float)  # a product of real matrices is faster
    return np.asarray(sums.view(complex).reshape(len(weights), *parts.shape[1:]))


def condensed_flexibility(
    poles: ComplexArray, residues: ComplexArray, retained: NDArray[np.bool_], nearest: float
) -> tuple[ComplexArray, ComplexArray]:
    """Flexibility of the poles that are no states, g_0 + sigma g_1 around sigma = 0, (..., q) each.

    Shapes: `poles` (..., 2, q), `residues` (..., 2, q), `retained` (..., 2, q).
    """
    distance = np.where(retained, 1.0, -poles)
    g_0 = np.where(retained, 0.0, residues / distance)
    g_1 = np.where(np.abs(distance) < nearest, 0.0, -g_0 / distance)
    return g_0.sum(axis=-2), g_1.sum(axis=-2)


# of the approximate exponents
FEW_NEGLIGIBLE = 6e-3  # flexibility times contact stiffness that is left out
FEW_UNKNOWNS = 120  # harmonics times modes
FEW_LEAST = 2  # residual modes
# distances in units of omega, of the poles retained around the middle of a slice of the strip
ABOVE = 0.8  # poles that far above it are condensed, as contacts move them farther
MARGIN = 0.3  # the same below it, beyond the largest rise of a natural frequency by the contacts
FARTHEST = 2.0
NEAREST = 0.5  # a condensed pole nearer than that has a flexibility without derivative


@dataclass(frozen=True)
class ReducedProblem:
    """A `HillProblem` in few modes, for any kappa."""

    problem: HillProblem  # the problem; its kappa does not matter
    modal: ModalModel  # the modes that are left: its lowest ones and residual modes (`reduced_modes`)
    omitted: float  # largest flexibility of the contact faces, times their stiffness, that is left out
    _condensed: dict[float, CondensedPoles] = field(default_factory=dict, init=False, repr=False, compare=False)

    @cached_property
    def harmonics(self) -> Array:
        """0, 1, -1, 2, -2, ...; (S,)."""
        return self.problem.harmonics

    @cached_property
    def poles(self) -> tuple[ComplexArray, ComplexArray]:
        """Poles and residues, (S, 2, q)."""
        return poles_and_residues(self.modal.total_stiffness, self.modal.total_damping, self.harmonics)

    def dynamic_stiffness(self, modal: ModalModel, sigma: complex, omega: float) -> tuple[ComplexArray, ComplexArray]:
        """s^2 + c s + k of modes in all harmonics, s = omega (sigma + i h), and its derivative in sigma, (S q,)."""
        s = omega * (sigma + 1j * self.harmonics)[:, None]
        stiffness = s**2 + modal.total_damping * s + modal.total_stiffness
        return stiffness.ravel(), (omega * (2.0 * s + modal.total_damping)).ravel()

    def condensed(self, omega: float) -> CondensedPoles:
        """The poles at `omega`, condensed as in `HillProblem`."""
        if omega not in self._condensed:
            self._condensed.clear()  # only those of one point are asked for again
            retained, (poles, residues) = self._model.retained(omega), self._model.poles
            distance = poles / omega - 1j * self.harmonics[:, None, None]
            parts = distance, residues / omega, retained, self._model.retention_radius
            self._condensed[omega] = CondensedPoles.of(*parts)
        return self._condensed[omega]

    @cached_property
    def _model(self) -> ContactFreeModel:
        """The modes without their motions."""
        rho, h_r = self.problem.retention_radius, self.problem.retention_harmonic
        no_motion = np.zeros((self.harmonics.size, 0, self.modal.damping.size), dtype=complex)
        waves = WaveModes(self.modal.angular_frequency, self.modal.damping, no_motion)
        return ContactFreeModel(waves, self.harmonics, rho, h_r, False)

    def near(self, contact: ContactParameters, omega: float, centre: float) -> NDArray[np.bool_]:
        """The poles that may come near sigma = i `centre`, (S, 2, q).

        A contact raises a natural frequency omega_m at most to sqrt(omega_m^2 + phi_m^T k phi_m): it moves the poles
        above the real axis up, those below down.
        """
        modal = self.modal
        assert modal.left is not None
        kt, kn = contact.tangential_stiffness, contact.normal_stiffness
        springs = np.stack([kt, kt, kn], axis=1).ravel()
        stiffness = springs @ (np.abs(modal.right) + np.abs(modal.left)) ** 2
        rise = (np.sqrt(modal.angular_frequency**2 + stiffness) - modal.angular_frequency) / omega
        poles = self.poles[0] / omega
        middle = self.harmonics[:, None, None] + centre
        return near_poles(poles, middle, ABOVE, rise + MARGIN, self.problem.highest_pole)

    def condensed_around(self, shift: complex, retained: NDArray[np.bool_], omega: float) -> CondensedPoles:
        """The poles in sigma - `shift`, those `retained` (S, 2, q) as states, at `omega` (rad/s)."""
        poles, residues = self.poles
        distance = poles / omega - (1j * self.harmonics[:, None, None] + shift)
        return CondensedPoles.of(distance, residues / omega, retained, NEAREST)

    def relative(self, modal: ModalModel, kappa: float) -> ComplexArray:
        """B_h of the modes, (S, 3 n_c, q)."""
        return relative_contact_motion(modal.right, modal.left, self.harmonics * self.problem.phase + kappa)

    def in_harmonics(self, values: Matrix) -> ComplexArray:
        """A contact Jacobian (n_c, 3, 3, 2H+1, 2H+1) in the harmonics, (n_c, S, 3, S, 3).

        Shapes: `values` (n_c, 3, 3, 2H+1, 2H+1).
        """
        first = 0 if self.problem.static else 1
        return np.ascontiguousarray(in_harmonics(values).transpose(0, 3, 1, 4, 2)[:, first:, :, first:])

    def projected(self, jacobian: ComplexArray, relative: ComplexArray) -> ComplexArray:
        """B^H K B, (D, D), D = S q.

        Shapes: `jacobian` (n_c, S, 3, S, 3), `relative` (S, 3 n_c, q).
        """
        nodes, size = jacobian.shape[:2]
        modes = relative.shape[2]
        shapes = relative.reshape(size, nodes, 3, modes).transpose(1, 0, 2, 3)
        right = jacobian.reshape(nodes, 3 * size, size, 3).transpose(0, 2, 1, 3) @ shapes  # (n_c, g, h d, q)
        right = right.reshape(nodes, size, size, 3, modes).transpose(2, 0, 3, 1, 4)  # (h, n_c, d, g, q)
        product = relative.conj().transpose(0, 2, 1) @ right.reshape(size, 3 * nodes, size * modes)
        return product.reshape(size * modes, size * modes)


def near_poles(
    poles: ComplexArray, middle: Array, above: float, below: Array, highest: float, farthest: float = FARTHEST
) -> NDArray[np.bool_]:
    """Which poles (..., 2, q) may come near the `middle` of a slice, all in units of omega.

    Contacts move the poles above the real axis up, those below down.
    Shapes: `poles` (..., S, 2, q), `middle` (S, 1, 1), `below` (..., q).
    """
    distance = poles.imag - middle
    distance = np.where(poles.imag >= 0.0, distance, -distance)
    size = np.abs(poles)
    slow = size < SLOW
    reach = np.where(slow, below, np.minimum(below, farthest))
    near = (distance <= above) & (distance >= -reach) & (size <= highest)
    if poles.shape[-2] == 1:  # the other one of a pair is elsewhere in the row
        return np.asarray(near | (slow & (-distance <= above) & (-distance >= -reach)))
    return np.asarray(near | (slow & near[..., ::-1, :]))


@dataclass(frozen=True)
class ReducedProblems:
    """The reduced problems of a `HillProblem`, by the number of modes that stay as they are at a frequency.

    These are all that may be resonant in a harmonic of a perturbation, up to (H + rho) omega.
    """

    problem: HillProblem  # the problem
    contact: ContactParameters  # parameters of the contact nodes
    negligible: float  # flexibility of the contact faces times their stiffness that may be left out
    unknowns: int  # number of unknowns, harmonics times modes, that is not passed for that
    least: int = LEAST  # least number of residual modes
    _known: dict[int, ReducedProblem] = field(default_factory=dict, init=False, repr=False, compare=False)

    @classmethod
    def few(cls, problem: HillProblem, contact: ContactParameters) -> "ReducedProblems":
        """Those for approximate exponents."""
        return cls(problem, contact, FEW_NEGLIGIBLE, FEW_UNKNOWNS, FEW_LEAST)

    def suffice(self, omega: float) -> bool:
        """Whether these modes have nearly all the flexibility of the contact faces."""
        return self.at(omega).omitted <= self.negligible

    def at(self, omega: float) -> ReducedProblem:
        """The reduced problem at a frequency."""
        p = self.problem
        assert not p.modal.waves_differ  # with one there are no modes that serve every wave
        modal = p.modal.at(0)
        highest = (p.n_harmonics + p.retention_radius) * omega
        kept = int(np.count_nonzero(modal.angular_frequency <= highest))
        if kept not in self._known:
            most = self.unknowns // (2 * p.n_harmonics + 1) - kept
            reduced = reduced_modes(modal, self.contact, kept, self.negligible, most, self.least)
            self._known[kept] = ReducedProblem(p, *reduced)
        return self._known[kept]

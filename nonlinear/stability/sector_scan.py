"""Approximate Floquet exponents of all nodal diameters of one point, for a ring with a disk.

The modes of a sector belong to one wave, so that nothing can be interpolated between nodal diameters. But the contact
sees few motions of them (`WaveFlexibility`): the contact Jacobian is closed once around the mean flexibility of all
waves, and what is left of it are few unknowns a harmonic, the same for all nodal diameters.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.stability.block_matrices import Matrix
from nonlinear.stability.condensed_loop import condensed_flexibility
from nonlinear.stability.hill import HillProblem, touching_nodes
from nonlinear.stability.pattern_scan import OVERLAP, WIDTH
from nonlinear.stability.point_contact import PointContact
from nonlinear.stability.reduced_problem import ABOVE, MARGIN, NEAREST, near_poles
from nonlinear.stability.wave_flexibility import WaveFlexibility, series
from rom import SectorModes

HIGHEST = 1.5  # of the lowest modes, over the highest frequency of a perturbation
RATIO = 1.25  # from one such frequency to the next
AT_ONCE = 8e6  # bytes of the matrices of the nodal diameters that are solved for at once
MATRICES = 6  # of them a nodal diameter has
BESIDE = 1.3  # distance of poles that are states too where their error as a flexibility is not negligible
NEGLIGIBLE_ERROR = 3e-3  # times the contact stiffness
OUTSIDE = 10.0j  # pole of a state that is none


@dataclass(frozen=True)
class SectorScan:
    """Eigenvalues of the perturbations of the nodal diameters k = 1 .. N_b / 2.

    The strip is cut into slices as in `PatternScan`.

    Attributes
    ----------
    problem : HillProblem
        Perturbations of the wave; the modes are `SectorModes`.
    contact : ContactParameters
        Parameters of the contact nodes.
    n_blades : int
        N_b.
    """

    problem: HillProblem
    contact: ContactParameters
    n_blades: int
    _known: dict[int, WaveFlexibility] = field(default_factory=dict, init=False, repr=False, compare=False)

    def eigenvalues(self, contact: PointContact) -> list[tuple[complex, int]]:
        """Eigenvalues sigma = lambda / omega in the strip and their k, those of all k, the least stable first.

        Parameters
        ----------
        contact : PointContact
            The point.
        """
        flexibility = self._at(contact.omega)
        middle, above = (self._closed(flexibility, contact, centre) for centre in (0.0, WIDTH))
        slices = (0.0, middle), (WIDTH, above), (-WIDTH, self._mirrored(above))
        found: list[tuple[complex, int]] = []
        at_once = max(1, int(AT_ONCE // (16 * MATRICES * (len(middle[0]) + 1) ** 2)))
        last = self.n_blades // 2
        for first in range(1, last + 1, at_once):
            diameters = np.arange(first, min(first + at_once, last + 1))
            waves = _Waves(flexibility, (self._orders + diameters[:, None]) % self.n_blades, self._harmonics)
            for centre, closed in slices:
                values = waves.eigenvalues(closed, centre, contact.omega, self._highest_pole)
                row, column = np.nonzero(np.abs(values.imag) <= WIDTH / 2.0 + OVERLAP)
                chosen = (values[row, column] + 1j * centre).tolist()
                found += zip(chosen, diameters[row].tolist(), strict=True)
        return sorted(found, key=lambda item: -item[0].real)

    @cached_property
    def _harmonics(self) -> Array:
        """0, 1, -1, 2, -2, ...; (S,)."""
        order = np.arange(1.0, self.problem.n_harmonics + 1.0)
        pairs = np.stack([order, -order], axis=1).ravel()
        return np.append(0.0, pairs) if self.problem.static else pairs

    @cached_property
    def _orders(self) -> NDArray[np.int64]:
        """Nodal diameters of the harmonics of the wave, h EO, (S,)."""
        engine_order = self.problem.phase * self.n_blades / (2.0 * np.pi)
        return np.rint(self._harmonics * engine_order).astype(np.int64)

    @property
    def _highest_pole(self) -> float:
        """Distance of retained poles from 0 in units of omega."""
        return self.problem.retention_harmonic + self.problem.retention_radius

    def _at(self, omega: float) -> WaveFlexibility:
        """The flexibility of the waves, with lowest modes that suffice at `omega` (rad/s)."""
        highest = HIGHEST * (self.problem.n_harmonics + 0.5) * omega
        number = int(np.ceil(np.log(highest) / np.log(RATIO)))
        if number not in self._known:
            modal = self.problem.modal
            assert isinstance(modal, SectorModes)
            self._known[number] = WaveFlexibility.of(modal, self.contact, RATIO**number)
        return self._known[number]

    def _closed(self, flexibility: WaveFlexibility, contact: PointContact, centre: float) -> tuple[Matrix, Matrix]:
        """The contact Jacobian closed around the mean flexibility at sigma = i `centre`, and its derivative in sigma.

        Both in the shared motions y of all harmonics, (S p, S p).
        """
        omega, active = contact.omega, np.repeat(touching_nodes(contact.jacobian), 3)
        s = np.asarray(1j * omega * (self._harmonics + centre), dtype=complex)
        structure = flexibility.structure(active, s, omega, self.problem.static)
        # in the amplitudes of h and -h, as at every kappa
        eigenproblem = replace(self.problem, kappa=1.0).closed(structure, contact.jacobian, contact.memory)
        matrix, change = eigenproblem.state_matrix, eigenproblem.flexibility_matrix
        if eigenproblem.memory is not None:
            terms = eigenproblem.memory.terms(1j * centre if centre else 0.0)
            matrix, change = matrix + terms.state, change + terms.derivative + terms.flexibility
        return matrix, change

    def _mirrored(self, closed: tuple[Matrix, Matrix]) -> tuple[Matrix, Matrix]:
        """The same at the complex conjugate sigma: the conjugate with h and -h exchanged."""
        harmonics = self._harmonics
        opposite = np.argmax(harmonics[:, None] == -harmonics, axis=0)
        places = np.arange(len(closed[0])).reshape(harmonics.size, -1)[opposite].ravel()
        matrix, change = (part.conj()[places][:, places] for part in closed)
        return matrix, change


@dataclass(frozen=True)
class _Waves:
    """The waves of the harmonics of the perturbations of some nodal diameters.

    Attributes
    ----------
    flexibility : WaveFlexibility
        All waves.
    number : (K, S) int
        Wave of each harmonic.
    harmonics : (S,)
        h.
    """

    flexibility: WaveFlexibility
    number: NDArray[np.int64]
    harmonics: Array

    @cached_property
    def poles(self) -> tuple[ComplexArray, ComplexArray]:
        """Poles and residues, (K, S, 2, q)."""
        backward = (self.harmonics < 0.0)[:, None, None]
        poles, residues = (part[self.number] for part in self.flexibility.poles)
        return np.where(backward, poles.conj(), poles), np.where(backward, residues.conj(), residues)

    @cached_property
    def motion(self) -> ComplexArray:
        """Contact motions of the modes, (K, S, p, q)."""
        return self.flexibility.motion[self.number]

    @cached_property
    def rise(self) -> Array:
        """How far contacts raise the natural frequencies at most, (K, S, 1, q) rad/s."""
        rise = self.flexibility.stiffened - self.flexibility.angular_frequency
        return rise[self.number][:, :, None]

    @cached_property
    def stiffening(self) -> Array:
        """What contact springs add at most to the squares of the natural frequencies, (K, S, 1, q) (rad/s)^2."""
        return self.flexibility.stiffening[self.number][:, :, None]

    @cached_property
    def deviation(self) -> ComplexArray:
        """Terms of the flexibility of the other modes less the mean, (K, S, 4, p, p)."""
        return self.flexibility.deviation[self.number]

    def eigenvalues(
        self, contact: tuple[Matrix, Matrix], centre: float, omega: float, highest_pole: float
    ) -> ComplexArray:
        """Eigenvalues sigma - i `centre` of each nodal diameter, (K, n_z); few of them are true far from 0.

        The formulas are those of `ContactFeedback`.

        Parameters
        ----------
        contact : (S p, S p) twice
            K at sigma = i `centre` and its derivative.
        centre : float
            Middle of the slice, in units of omega.
        omega : float
            Excitation frequency, rad/s.
        highest_pole : float
            Distance of retained poles from 0 in units of omega.
        """
        stiffness, change = contact
        state = self._states(centre, omega, highest_pole)
        g_0, g_1 = self._flexibilities(state, centre, omega)
        difference = self._return_difference(g_0, stiffness)
        motion = np.linalg.solve(difference, state.output)
        force, inner = stiffness @ motion, change @ motion
        rest = inner + stiffness @ np.linalg.solve(difference, self._product(g_1, force) + self._product(g_0, inner))
        adjoint = state.residue[:, :, None] * state.output.conj().transpose(0, 2, 1)
        every = np.arange(state.pole.shape[1])
        matrix, descriptor = adjoint @ force, -(adjoint @ rest)
        matrix[:, every, every] += state.pole
        descriptor[:, every, every] += 1.0
        return np.asarray(np.linalg.eigvals(np.linalg.solve(descriptor, matrix)), dtype=complex)

    def _states(self, centre: float, omega: float, highest_pole: float) -> "_States":
        """The poles retained."""
        poles, residues = (part / omega for part in self.poles)
        middle = self.harmonics[:, None, None] + centre
        distance = poles - 1j * middle
        retained = near_poles(poles, middle, ABOVE, self.rise / omega + MARGIN, highest_pole)
        error = np.abs(residues) * self.stiffening * (WIDTH / 2.0) ** 2
        beside = near_poles(poles, middle, BESIDE, BESIDE + self.rise / omega, highest_pole)
        retained |= beside & (error > NEGLIGIBLE_ERROR * np.abs(distance) ** 3)
        count, q = len(retained), retained.shape[-1]
        flat = retained.reshape(count, -1)
        order = np.argsort(~flat, axis=1, kind="stable")[:, : flat.sum(axis=1).max()]
        own = np.arange(count)[:, None]
        true = flat[own, order]
        harmonic, mode = order // (2 * q), order % q
        output = np.zeros((count, *self.motion.shape[1:3], order.shape[1]), dtype=complex)
        column = np.arange(order.shape[1])
        output[own, harmonic, :, column] = np.where(true[:, :, None], self.motion[own, harmonic, :, mode], 0.0)
        return _States(
            retained,
            distance,
            np.where(true, distance.reshape(count, -1)[own, order], OUTSIDE),
            np.where(true, residues.reshape(count, -1)[own, order], 0.0),
            output.reshape(count, output.shape[1] * output.shape[2], order.shape[1]),
        )

    def _flexibilities(self, state: "_States", centre: float, omega: float) -> tuple[ComplexArray, ComplexArray]:
        """G_0 and G_1 less the mean, of what is no state, (K, S, p, p)."""
        adjoint = self.motion.conj().transpose(0, 1, 3, 2)
        s = np.asarray(1j * omega * (self.harmonics + centre), dtype=complex)
        modes = condensed_flexibility(state.distance, self.poles[1] / omega, state.retained, NEAREST)
        others = series(self.deviation, s, omega)
        g_0, g_1 = (
            (self.motion * one[:, :, None]) @ adjoint + other for one, other in zip(modes, others, strict=True)
        )
        return g_0, g_1

    @staticmethod
    def _return_difference(flexibility: ComplexArray, stiffness: Matrix) -> ComplexArray:
        """I - G K, (K, S p, S p)."""
        count, harmonics, p, _ = flexibility.shape
        size = harmonics * p
        result = (flexibility @ -stiffness.reshape(harmonics, p, size)).reshape(count, size, size)
        every = np.arange(size)
        result[:, every, every] += 1.0
        return result

    @staticmethod
    def _product(flexibility: ComplexArray, force: ComplexArray) -> ComplexArray:
        """G f, (K, S p, n)."""
        count, harmonics, p, _ = flexibility.shape
        return (flexibility @ force.reshape(count, harmonics, p, force.shape[2])).reshape(force.shape)


class _States(NamedTuple):
    """The retained poles of some nodal diameters, filled up to n_z.

    Attributes
    ----------
    retained : (K, S, 2, q) bool
        Which they are.
    distance : (K, S, 2, q)
        All poles from the middle of the slice, in units of omega.
    pole, residue : (K, n_z)
        Of the states.
    output : (K, S p, n_z)
        Contact motion of the states.
    """

    retained: NDArray[np.bool_]
    distance: ComplexArray
    pole: ComplexArray
    residue: ComplexArray
    output: ComplexArray

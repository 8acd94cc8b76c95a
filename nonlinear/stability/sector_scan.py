"""Approximate Floquet exponents of all nodal diameters of one point, for a ring with a disk.

The modes of a sector belong to one wave, so that nothing can be interpolated between nodal diameters. But the contact
sees few motions of them (`WaveFlexibility`): the contact Jacobian is closed once around the mean flexibility of all
waves, and what is left of it are few unknowns a harmonic, the same for all nodal diameters.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.stability.axis_interpolation import AxisInterpolation
from nonlinear.stability.block_matrices import Matrix
from nonlinear.stability.hill import HillProblem, touching_nodes
from nonlinear.stability.pattern_scan import OVERLAP, WIDTH
from nonlinear.stability.point_contact import PointContact
from nonlinear.stability.sector_pencils import SectorPencils
from nonlinear.stability.wave_flexibility import WaveFlexibility
from rom import SectorModes

HIGHEST = 1.5  # of the lowest modes, over the highest frequency of a perturbation
RATIO = 1.25  # from one such frequency to the next
AT_ONCE = 8e6  # bytes of the matrices of the nodal diameters that are solved for at once
MATRICES = 6  # of them a nodal diameter has
GROWING = 5e-3  # growth in the scan from which nothing is in doubt; as all below in units of omega
ERROR = 0.2  # of an eigenvalue, over the square of its distance from the middle of its slice
FAMILY = 0.05  # distance of an eigenvalue of a slice from the same one, linearised where it lies


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
        slices = {0.0: middle, WIDTH: above, -WIDTH: self._mirrored(above)}
        every = np.arange(1, self.n_blades // 2 + 1)
        values, diameters = np.zeros(0, dtype=complex), np.zeros(0, dtype=np.int64)
        for some, pencils in self._pencils(flexibility, every):
            for centre, closed in slices.items():
                found = pencils.eigenvalues(closed, np.full(some.size, centre), contact.omega, self._highest_pole)
                row, column = np.nonzero(np.abs(found.imag) <= WIDTH / 2.0 + OVERLAP)
                values = np.append(values, found[row, column] + 1j * centre)
                diameters = np.append(diameters, some[row])
        if values.size and values.real.max() < GROWING:
            values = self._linearised_again(flexibility, AxisInterpolation(slices), values, diameters, contact.omega)
        order = np.argsort(-values.real, kind="stable")
        return list(zip(values[order].tolist(), diameters[order].tolist(), strict=True))

    def _pencils(
        self, flexibility: WaveFlexibility, diameters: NDArray[np.int64]
    ) -> Iterator[tuple[NDArray[np.int64], SectorPencils]]:
        """The pencils of nodal diameters, as many at once as fit into memory."""
        size = self._harmonics.size * flexibility.shared.shape[1]
        at_once = max(1, int(AT_ONCE // (16 * MATRICES * (size + 1) ** 2)))
        for first in range(0, diameters.size, at_once):
            some = diameters[first : first + at_once]
            waves = (self._orders + some[:, None]) % self.n_blades
            yield some, SectorPencils(flexibility, waves, self._harmonics)

    def _linearised_again(
        self,
        flexibility: WaveFlexibility,
        contact: AxisInterpolation,
        values: ComplexArray,
        diameters: NDArray[np.int64],
        omega: float,
    ) -> ComplexArray:
        """Eigenvalues of the scan, those that may grow for all its error linearised where they lie."""
        distance = values.imag - WIDTH * np.clip(np.rint(values.imag / WIDTH), -1.0, 1.0)
        doubtful = np.flatnonzero(values.real > -ERROR * distance**2)
        result, done = values.copy(), 0
        for some, pencils in self._pencils(flexibility, diameters[doubtful]):
            places = doubtful[done : done + some.size]
            done += some.size
            centre = values[places].imag
            found = pencils.eigenvalues(contact.at(centre), centre, omega, self._highest_pole) + 1j * centre[:, None]
            away = np.abs(found - values[places, None])
            if away.shape[1]:
                nearest = np.argmin(away, axis=1)[:, None]
                same = np.take_along_axis(away, nearest, axis=1)[:, 0] < FAMILY
                result[places[same]] = np.take_along_axis(found, nearest, axis=1)[same, 0]
        return result

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

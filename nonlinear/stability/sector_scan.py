"""Approximate Floquet exponents of all nodal diameters of one point, for a ring with a disk.

The modes of a sector belong to one wave, so that nothing can be interpolated between nodal diameters. But the contact
sees few motions of them (`WaveFlexibility`): the contact Jacobian is closed once around the mean flexibility of all
waves, and what is left of it are few unknowns a harmonic, the same for all nodal diameters.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.stability.axis_interpolation import AxisInterpolation
from nonlinear.stability.pattern_matrices import OVERLAP, WIDTH
from nonlinear.stability.perturbation_pencils import PerturbationPencils
from nonlinear.stability.point_contact import PointContact
from nonlinear.stability.ring_structure import RingStructure

AT_ONCE = 8e6  # bytes of the matrices of the nodal diameters that are solved for at once
MATRICES = 6  # of them a nodal diameter has
GROWING = 5e-3  # growth in the scan from which nothing is in doubt; as all below in units of omega
ERROR = 0.2  # of an eigenvalue, over the square of its distance from the middle of its slice
FAMILY = 0.05  # distance of an eigenvalue of a slice from the same one, linearised where it lies


@dataclass(frozen=True)
class SectorScan:
    """Eigenvalues of the perturbations of the nodal diameters k = 1 .. N_b / 2.

    The strip is cut into slices as in `PatternScan`.
    """

    structure: RingStructure  # the structure, with a disk

    def eigenvalues(self, contact: PointContact) -> list[tuple[complex, int]]:
        """Eigenvalues sigma = lambda / omega in the strip and their k, those of all k, the least stable first."""
        structure, omega = self.structure, contact.omega
        closed = structure.closed(contact)
        slices = {centre: closed.at(1j * centre) for centre in (0.0, WIDTH, -WIDTH)}
        every = np.arange(1, structure.n_blades // 2 + 1)
        values, diameters = np.zeros(0, dtype=complex), np.zeros(0, dtype=np.int64)
        for some, pencils in self._pencils(every, omega):
            for centre, matrices in slices.items():
                found = pencils.eigenvalues(
                    matrices, np.full(some.size, centre), omega, structure.problem.highest_pole
                )
                row, column = np.nonzero(np.abs(found.imag) <= WIDTH / 2.0 + OVERLAP)
                values = np.append(values, found[row, column] + 1j * centre)
                diameters = np.append(diameters, some[row])
        if values.size and values.real.max() < GROWING:
            values = self._linearised_again(AxisInterpolation(slices), values, diameters, omega)
        order = np.argsort(-values.real, kind="stable")
        return list(zip(values[order].tolist(), diameters[order].tolist(), strict=True))

    def _pencils(
        self, diameters: NDArray[np.int64], omega: float
    ) -> Iterator[tuple[NDArray[np.int64], PerturbationPencils]]:
        """The pencils of nodal diameters, as many at once as fit into memory."""
        structure = self.structure
        size = structure.harmonics.size * structure.motions(omega).shared.shape[1]
        at_once = max(1, int(AT_ONCE // (16 * MATRICES * (size + 1) ** 2)))
        for first in range(0, diameters.size, at_once):
            some = diameters[first : first + at_once]
            yield some, structure.pencils(some, omega)

    def _linearised_again(
        self, contact: AxisInterpolation, values: ComplexArray, diameters: NDArray[np.int64], omega: float
    ) -> ComplexArray:
        """Eigenvalues of the scan, those that may grow for all its error linearised where they lie."""
        distance = values.imag - WIDTH * np.clip(np.rint(values.imag / WIDTH), -1.0, 1.0)
        doubtful = np.flatnonzero(values.real > -ERROR * distance**2)
        result, done = values.copy(), 0
        for some, pencils in self._pencils(diameters[doubtful], omega):
            places = doubtful[done : done + some.size]
            done += some.size
            centre = values[places].imag
            highest = self.structure.problem.highest_pole
            found = pencils.eigenvalues(contact.at(centre), centre, omega, highest) + 1j * centre[:, None]
            away = np.abs(found - values[places, None])
            if away.shape[1]:
                nearest = np.argmin(away, axis=1)[:, None]
                same = np.take_along_axis(away, nearest, axis=1)[:, 0] < FAMILY
                result[places[same]] = np.take_along_axis(found, nearest, axis=1)[same, 0]
        return result

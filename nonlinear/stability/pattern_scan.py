"""Approximate Floquet exponents of all nodal diameters of one point.

Analytic in the phase shift kappa, and 2 pi-periodic, the matrices of the eigenvalue problem are formed at a few
kappas and interpolated by a trigonometric polynomial at all others. In modal coordinates of both contact faces the
contact Jacobian is the same for all kappas but for factors e^(+-i kappa).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.stability.condensed_loop import CondensedLoop
from nonlinear.stability.face_contact import face_contact
from nonlinear.stability.kappa_interpolation import KappaInterpolation
from nonlinear.stability.point_contact import PointContact
from nonlinear.stability.reduced_problem import ReducedProblem, ReducedProblems

NODES = 4  # kappas between 0 and pi at which the matrices are formed
# distances in units of omega
WIDTH = 1.0 / 3.0  # of the slices of the strip
OVERLAP = 0.02  # an eigenvalue this near to a border counts on both sides of it


@dataclass(frozen=True)
class SliceMatrices:
    """A_c and E_c around the middle of a slice of the strip, at some kappas.

    Attributes
    ----------
    retained : (S, 2, q) bool
        The poles that are states.
    matrix, descriptor : (n_kappa, n_z, n_z)
        A_c and E_c.
    """

    retained: NDArray[np.bool_]
    matrix: ComplexArray
    descriptor: ComplexArray

    def mirrored(self, static: bool) -> "SliceMatrices":
        """Those at -kappa around the complex conjugate middle: the conjugate ones with h and -h exchanged."""
        count = len(self.retained) - int(static)
        rows = np.arange(count) ^ 1
        place = np.full(self.retained.shape, -1)
        place[self.retained] = np.arange(np.count_nonzero(self.retained))
        # the conjugate of a pole of harmonic 0 is the other pole of the mode
        place = np.concatenate([place[:1, ::-1], place[1:][rows]]) if static else place[rows]
        order = place[place >= 0]
        matrix, descriptor = (part.conj()[:, order][:, :, order] for part in (self.matrix, self.descriptor))
        return SliceMatrices(place >= 0, matrix, descriptor)

    def interpolated(self, weights: Array) -> ComplexArray:
        """E_c^-1 A_c at other kappas, by their weights (n, n_kappa): (n, n_z, n_z)."""
        count, size, _ = self.matrix.shape
        shape = len(weights), size, size  # no pole may be retained: -1 would not tell the size
        parts = (self.matrix.reshape(count, size**2), self.descriptor.reshape(count, size**2))
        matrix, descriptor = ((weights @ part).reshape(shape) for part in parts)
        return np.asarray(np.linalg.solve(descriptor, matrix), dtype=complex)


@dataclass(frozen=True)
class PatternScan:
    """Eigenvalues of the perturbations of all nodal diameters k = 1 .. N_b / 2, from few modes.

    The strip is cut into slices, and around the middle of each the slider memory is linearised, and the poles are
    retained that may come there.

    Attributes
    ----------
    reduced : ReducedProblems
        Perturbations of the wave in few modes.
    contact : ContactParameters
        Parameters of the contact nodes.
    n_blades : int
        N_b.
    nodes : int
        J, number of kappas between 0 and pi at which the matrices are formed; those of -kappa follow from them.
    """

    reduced: ReducedProblems
    contact: ContactParameters
    n_blades: int
    nodes: int = NODES

    @cached_property
    def _interpolation(self) -> KappaInterpolation:
        return KappaInterpolation(self.nodes, self.n_blades)

    def applies(self, omega: float) -> bool:
        """Whether few modes have nearly all the flexibility of the contact faces.

        Parameters
        ----------
        omega : float
            Excitation frequency, rad/s.
        """
        return self.reduced.at(omega).omitted <= self.reduced.negligible

    def eigenvalues(self, contact: PointContact) -> list[tuple[complex, int]]:
        """Eigenvalues sigma = lambda / omega in the strip and their k, those of all k, the least stable first.

        Parameters
        ----------
        contact : PointContact
            The point.
        """
        found: list[tuple[complex, int]] = []
        for centre, matrices in self._slices(contact):
            values = np.linalg.eigvals(matrices.interpolated(self._interpolation.weights))
            row, column = np.nonzero(np.abs(values.imag) <= WIDTH / 2.0 + OVERLAP)
            found += zip((values[row, column] + 1j * centre).tolist(), (row + 1).tolist(), strict=True)
        return sorted(found, key=lambda item: -item[0].real)

    def _slices(self, contact: PointContact) -> list[tuple[float, SliceMatrices]]:
        """Middle and matrices of the slices, at all nodes."""
        reduced, static = self.reduced.at(contact.omega), self.reduced.problem.static
        half = _slice(reduced, contact, 0.0, self._interpolation.kappas[: self.nodes], self.contact)
        other = half.mirrored(static)
        whole = SliceMatrices(
            half.retained,
            np.concatenate([half.matrix, other.matrix]),
            np.concatenate([half.descriptor, other.descriptor]),
        )
        upper = _slice(reduced, contact, WIDTH, self._interpolation.kappas, self.contact)
        lower = upper.mirrored(static)  # at -kappa: the nodes of the two signs change places
        matrix, descriptor = (np.roll(part, self.nodes, axis=0) for part in (lower.matrix, lower.descriptor))
        return [(0.0, whole), (WIDTH, upper), (-WIDTH, SliceMatrices(lower.retained, matrix, descriptor))]


def _slice(
    reduced: ReducedProblem, contact: PointContact, centre: float, kappas: Array, parameters: ContactParameters
) -> SliceMatrices:
    """The matrices around sigma = i `centre`."""
    omega = contact.omega
    retained = reduced.near(parameters, omega, centre)
    condensed = reduced.condensed_around(centre, retained, omega)
    faces = face_contact(reduced, contact)
    loops = [
        CondensedLoop.closed(condensed, *faces.linearised(1j * centre if centre else 0.0, kappa))
        for kappa in kappas.tolist()
    ]
    return SliceMatrices(
        retained, np.stack([loop.matrix for loop in loops]), np.stack([loop.descriptor for loop in loops])
    )

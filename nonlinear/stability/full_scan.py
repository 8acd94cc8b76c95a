"""Approximate Floquet exponents of all nodal diameters of one point, where few modes do not do: stiff contacts.

The matrices of the eigenvalue problem, analytic and 2 pi-periodic in the phase shift kappa, are formed with all modes
at a few kappas and interpolated.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from nonlinear.stability.block_matrices import Matrix
from nonlinear.stability.hill import HillProblem
from nonlinear.stability.kappa_interpolation import KappaInterpolation
from nonlinear.stability.point_contact import PointContact

NODES = 3  # kappas between 0 and pi at which the matrices are formed
WIDTH = 1.0 / 3.0  # of the slices of the strip, in units of omega
OVERLAP = 0.02  # an eigenvalue this near to a border counts on both sides of it


@dataclass(frozen=True)
class FullScan:
    """Eigenvalues of the perturbations of all nodal diameters k = 1 .. N_b / 2.

    Attributes
    ----------
    problem : HillProblem
        Perturbations of the wave.
    n_blades : int
        N_b.
    """

    problem: HillProblem
    n_blades: int

    @cached_property
    def _interpolation(self) -> KappaInterpolation:
        return KappaInterpolation(NODES, self.n_blades)

    @cached_property
    def _problems(self) -> list[HillProblem]:
        """The problems at the nodes: none of them is written in real motions."""
        return [replace(self.problem, kappa=float(kappa)) for kappa in self._interpolation.kappas[:NODES]]

    def eigenvalues(self, contact: PointContact) -> list[tuple[complex, int]]:
        """Eigenvalues sigma = lambda / omega in the strip and their k, those of all k, the least stable first.

        Parameters
        ----------
        contact : PointContact
            The point.
        """
        problems = [item.eigenproblem(contact.jacobian, contact.omega, contact.memory) for item in self._problems]
        mirror = self._problems[0].contact_free.mirror(contact.omega)
        centres = (0.0,) if contact.memory is None else (-WIDTH, 0.0, WIDTH)
        half_width = (0.5 if contact.memory is None else WIDTH / 2.0) + OVERLAP
        linearised = {centre: [problem.linearised(1j * centre) for problem in problems] for centre in centres}
        found: list[tuple[complex, int]] = []
        for centre in centres:
            conjugates = [tuple(part.conj()[mirror][:, mirror] for part in pair) for pair in linearised[-centre]]
            matrix, descriptor = (
                self._interpolated([pair[part] for pair in (*linearised[centre], *conjugates)]) for part in (0, 1)
            )
            values = np.linalg.eigvals(np.linalg.solve(descriptor, matrix))
            row, column = np.nonzero(np.abs(values.imag - centre) <= half_width)
            found += zip(values[row, column].tolist(), (row + 1).tolist(), strict=True)
        return sorted(found, key=lambda item: -item[0].real)

    def _interpolated(self, nodes: list[Matrix]) -> Matrix:
        """A matrix at all k, (N_b / 2, n_z, n_z), from those of the 2 J nodes."""
        size = len(nodes[0])
        weights = self._interpolation.weights
        found = weights @ np.stack([node.ravel() for node in nodes])
        return np.asarray(found.reshape(len(weights), size, size))  # no pole may be retained: -1 would not tell

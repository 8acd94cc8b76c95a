"""The eigenvalue problems of the slices of the strip, at some phase shifts kappa and at all nodal diameters."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.stability.nearest_eigenvalues import nearest_eigenvalues

# distances in units of omega
WIDTH = 1.0 / 3.0  # of the slices of the strip
OVERLAP = 0.02  # an eigenvalue this near to a border counts on both sides of it
MISPLACED = 0.5  # the same, over a growth, which moves it away from where the slice is linearised


@dataclass(frozen=True)
class SliceMatrices:
    """A_c and E_c around the middle of a slice of the strip, at some kappas."""

    retained: NDArray[np.bool_]  # (S, 2, q), the poles that are states
    matrix: ComplexArray  # (n_kappa, n_z, n_z), a_c and E_c
    descriptor: ComplexArray  # (n_kappa, n_z, n_z), a_c and E_c

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

    def with_mirrored(self, static: bool) -> "SliceMatrices":
        """Those around 0 at some kappas, followed by those at the kappas with the other sign."""
        other = self.mirrored(static)
        parts = ((self.matrix, other.matrix), (self.descriptor, other.descriptor))
        return SliceMatrices(self.retained, *(np.concatenate(part) for part in parts))

    def opposite(self, static: bool, nodes: int) -> "SliceMatrices":
        """Those around the complex conjugate middle, at the same kappas."""
        mirrored = self.mirrored(static)  # at -kappa: the nodes of the two signs change places
        matrix, descriptor = (np.roll(part, nodes, axis=0) for part in (mirrored.matrix, mirrored.descriptor))
        return SliceMatrices(mirrored.retained, matrix, descriptor)

    def interpolated(self, weights: Array) -> tuple[ComplexArray, ComplexArray]:
        """A_c and E_c at other kappas, by their weights (n, n_kappa): (n, n_z, n_z) each."""
        count, size, _ = self.matrix.shape
        shape = len(weights), size, size  # no pole may be retained: -1 would not tell the size
        parts = (self.matrix.reshape(count, size**2), self.descriptor.reshape(count, size**2))
        matrix, descriptor = ((weights @ part).reshape(shape) for part in parts)
        return matrix, descriptor


@dataclass(frozen=True)
class ScannedSlices:
    """The slices of the strip, which have the eigenvalues of all nodal diameters of one point."""

    slices: tuple[tuple[float, SliceMatrices], ...]  # middle and matrices of each
    weights: Array  # (N_b / 2, n_kappa), of the matrices in the nodal diameters k = 1 .. N_b / 2

    def eigenvalues(self, diameters: NDArray[np.int64] | None = None) -> list[tuple[complex, int]]:
        """Eigenvalues sigma = lambda / omega in the strip and their k, the least stable first.

        Shapes: `diameters` (n,).
        """
        k = np.arange(1, len(self.weights) + 1) if diameters is None else diameters
        found: list[tuple[complex, int]] = []
        if not k.size:
            return found
        for centre, matrices in self.slices:
            values = nearest_eigenvalues(*matrices.interpolated(self.weights[k - 1]))
            margin = OVERLAP + MISPLACED * np.clip(values.real, 0.0, WIDTH)
            row, column = np.nonzero(np.abs(values.imag) <= WIDTH / 2.0 + margin)
            found += zip((values[row, column] + 1j * centre).tolist(), k[row].tolist(), strict=True)
        return sorted(found, key=lambda item: -item[0].real)

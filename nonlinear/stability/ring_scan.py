"""Approximate Floquet exponents of all nodal diameters of one point.

Without a disk the matrices of the eigenvalue problem are analytic in the phase shift kappa, and 2 pi-periodic: they
are formed at a few kappas and interpolated by a trigonometric polynomial at all others, in few modes (`PatternScan`)
or, for stiff contacts, which need the local flexibility of the contact faces, with the contact closed around it
(`FaceScan`).

With a disk the modes of a sector belong to one wave, so that nothing can be interpolated between nodal diameters. But
the contact sees few motions of them: it is closed once around the mean flexibility of all waves, and what is left are
few unknowns a harmonic, the same for all nodal diameters (`SectorScan`).
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.stability.eigenproblem import OVERLAP, WIDTH, Pencil
from nonlinear.stability.modal_condensation import Matrix
from nonlinear.stability.modal_contact import face_contact, part_weights
from nonlinear.stability.perturbation_pencils import PerturbationPencils, nearest_eigenvalues
from nonlinear.stability.point_contact import PointContact
from nonlinear.stability.reduced_problem import ABOVE, ReducedProblems
from nonlinear.stability.ring_structure import RingStructure


@dataclass(frozen=True)
class KappaInterpolation:
    """From 2 J equidistant kappas to the nodal diameters k = 1 .. N_b / 2 of a ring, kappa = 2 pi k / N_b."""

    nodes: int  # J, number of kappas between 0 and pi
    n_blades: int  # n_b

    @cached_property
    def kappas(self) -> Array:
        """(j + 1/2) pi / J, j = 0 .. J - 1, and then the same with the other sign, (2 J,)."""
        positive = (np.arange(self.nodes) + 0.5) * np.pi / self.nodes
        return np.concatenate([positive, -positive])

    @cached_property
    def weights(self) -> Array:
        """sin(J (kappa - kappa_j)) / (2 J tan((kappa - kappa_j) / 2)), (N_b / 2, 2 J)."""
        kappas = 2.0 * np.pi / self.n_blades * np.arange(1, self.n_blades // 2 + 1)
        half = (kappas[:, None] - self.kappas) / 2.0
        with np.errstate(divide="ignore", invalid="ignore"):
            weights = np.sin(2 * self.nodes * half) / (2 * self.nodes * np.tan(half))
        return np.where(np.abs(np.sin(half)) < 1e-12, 1.0, weights)


@dataclass(frozen=True)
class AxisInterpolation:
    """A matrix and its derivative in sigma at any sigma = i c, from those at J values of c; a polynomial in c."""

    # (matrix, derivative), by c, the matrix (n, n) at sigma = i c and its derivative in sigma
    known: Mapping[float, tuple[Matrix, Matrix]]

    @cached_property
    def _coefficients(self) -> ComplexArray:
        """Of the powers of c, (2 J, n^2)."""
        centres, powers = np.array([*self.known]), np.arange(2 * len(self.known))
        values = centres[:, None] ** powers
        slopes = powers * centres[:, None] ** np.maximum(powers - 1, 0)
        matrices = [part[0].ravel() for part in self.known.values()]
        changes = [1j * part[1].ravel() for part in self.known.values()]  # d / dc = i d / dsigma
        return np.linalg.solve(np.concatenate([values, slopes]), np.stack(matrices + changes).astype(complex))

    def at(self, centres: Array) -> tuple[ComplexArray, ComplexArray]:
        """The matrix and its derivative in sigma at sigma = i c, (m, n, n) each.

        Shapes: `centres` (m,).
        """
        size = len(next(iter(self.known.values()))[0])
        powers = np.arange(len(self._coefficients))
        values = centres[:, None] ** powers
        slopes = powers * centres[:, None] ** np.maximum(powers - 1, 0)
        matrix, change = ((part @ self._coefficients).reshape(-1, size, size) for part in (values, -1j * slopes))
        return matrix, change


# distances in units of omega
MISPLACED = 0.5  # the same, over a growth, which moves it away from where the slice is linearised


@dataclass(frozen=True)
class SliceMatrices:
    """A_c and E_c around the middle of a slice of the strip, at some kappas."""

    retained: NDArray[np.bool_]  # (S, 2, q), the poles that are states
    pencil: Pencil  # (n_kappa, n_z, n_z), A_c and E_c

    def mirrored(self, static: bool) -> "SliceMatrices":
        """Those at -kappa around the complex conjugate middle: the conjugate ones with h and -h exchanged."""
        count = len(self.retained) - int(static)
        rows = np.arange(count) ^ 1
        place = np.full(self.retained.shape, -1)
        place[self.retained] = np.arange(np.count_nonzero(self.retained))
        # the conjugate of a pole of harmonic 0 is the other pole of the mode
        place = np.concatenate([place[:1, ::-1], place[1:][rows]]) if static else place[rows]
        order = place[place >= 0]
        return SliceMatrices(place >= 0, Pencil(*(part.conj()[:, order][:, :, order] for part in self.pencil)))

    def with_mirrored(self, static: bool) -> "SliceMatrices":
        """Those around 0 at some kappas, followed by those at the kappas with the other sign."""
        pairs = zip(self.pencil, self.mirrored(static).pencil, strict=True)
        return SliceMatrices(self.retained, Pencil(*(np.concatenate(pair) for pair in pairs)))

    def opposite(self, static: bool, nodes: int) -> "SliceMatrices":
        """Those around the complex conjugate middle, at the same kappas."""
        mirrored = self.mirrored(static)  # at -kappa: the nodes of the two signs change places
        return SliceMatrices(mirrored.retained, Pencil(*(np.roll(part, nodes, axis=0) for part in mirrored.pencil)))

    def interpolated(self, weights: Array) -> Pencil:
        """The problems at other kappas, by their weights (n, n_kappa): (n, n_z, n_z)."""
        count, size, _ = self.pencil.matrix.shape
        shape = len(weights), size, size  # no pole may be retained: -1 would not tell the size
        return Pencil(*((weights @ part.reshape(count, size**2)).reshape(shape) for part in self.pencil))


# sigma in the middles of the slices around the imaginary axis, and of all slices
ON_AXIS = np.array([0j, 1j * WIDTH, -1j * WIDTH])
MIDDLES = np.add.outer([0.0, 0.3, 0.9], 1j * WIDTH / 2.0 * np.arange(-2, 3)).ravel()


@dataclass(frozen=True)
class ScannedSlices:
    """The slices of the strip, which have the eigenvalues of all nodal diameters of one point.

    Three slices lie around the imaginary axis. What grows there and is nearer to the middle of another slice, between
    two of them or in the growing half plane, is looked for in that one: the slider memory is linear in each.
    """

    form: Callable[[complex, Array], SliceMatrices]  # the matrices around a shift at some kappas
    interpolation: KappaInterpolation  # from these to the nodal diameters
    static: bool  # whether there is a harmonic 0
    _known: dict[complex, SliceMatrices] = field(default_factory=dict, init=False, repr=False, compare=False)

    def eigenvalues(self, diameters: NDArray[np.int64] | None = None) -> list[tuple[complex, int]]:
        """Eigenvalues sigma = lambda / omega in the strip and their k, the least stable first.

        Shapes: `diameters` (n,).
        """
        every = np.arange(1, len(self.interpolation.weights) + 1) if diameters is None else diameters
        values, numbers = np.zeros(0, dtype=complex), np.zeros(0, dtype=np.int64)
        if not every.size:
            return []
        for shift in ON_AXIS:
            found, k = self._around(complex(shift), every)
            margin = OVERLAP + MISPLACED * np.clip(found.real, 0.0, WIDTH)
            near = np.abs(found.imag - shift.imag) <= WIDTH / 2.0 + margin
            values, numbers = np.append(values, found[near]), np.append(numbers, k[near])
        middle = _nearest(values, MIDDLES)
        elsewhere = (values.real > 0.0) & (np.abs(values - middle) < np.abs(values - _nearest(values, ON_AXIS)))
        if np.any((values.real > 0.0) & ~elsewhere):  # it grows for certain: what is between two slices can wait
            elsewhere &= middle.real > 0.0
        left = ~elsewhere
        parts = [(values[left], numbers[left])]
        for shift in np.unique(middle[elsewhere]):
            found, k = self._around(complex(shift), np.unique(numbers[elsewhere & (middle == shift)]))
            own = _nearest(found - OVERLAP * np.sign(found - shift), MIDDLES) == shift  # or nearly so
            parts.append((found[own], k[own]))
        values, numbers = (np.concatenate(part) for part in zip(*parts, strict=True))
        order = np.argsort(-values.real, kind="stable")
        return list(zip(values[order].tolist(), numbers[order].tolist(), strict=True))

    def _around(self, shift: complex, k: NDArray[np.int64]) -> tuple[ComplexArray, NDArray[np.int64]]:
        """Eigenvalues of the slice around a shift, of some nodal diameters, and these, (n,) each."""
        found = nearest_eigenvalues(self._matrices(shift).interpolated(self.interpolation.weights[k - 1]))
        return (found + shift).ravel(), np.repeat(k, found.shape[1])

    def _matrices(self, shift: complex) -> SliceMatrices:
        """The matrices around a shift at all kappas; those at the other sign or shift follow where they can."""
        if shift not in self._known:
            nodes, kappas = self.interpolation.nodes, self.interpolation.kappas
            if shift.imag < 0.0:
                self._known[shift] = self._matrices(shift.conjugate()).opposite(self.static, nodes)
            elif shift.imag == 0.0:
                self._known[shift] = self.form(shift, kappas[:nodes]).with_mirrored(self.static)
            else:
                self._known[shift] = self.form(shift, kappas)
        return self._known[shift]


def _nearest(values: ComplexArray, middles: ComplexArray) -> ComplexArray:
    """The nearest of some middles, (n,)."""
    return np.asarray(middles[np.argmin(np.abs(values[:, None] - middles), axis=1)])


NODES = 4  # kappas between 0 and pi at which the matrices are formed


@dataclass(frozen=True)
class PatternScan:
    """Eigenvalues of the perturbations of all nodal diameters k = 1 .. N_b / 2, from few modes.

    The strip is cut into slices, and around the middle of each the slider memory is linearised, and the poles are
    retained that may come there.
    """

    reduced: ReducedProblems  # perturbations of the wave in few modes
    contact: ContactParameters  # parameters of the contact nodes
    n_blades: int  # n_b
    # J, number of kappas between 0 and pi at which the matrices are formed; those of -kappa follow from them
    nodes: int = NODES

    @cached_property
    def _interpolation(self) -> KappaInterpolation:
        return KappaInterpolation(self.nodes, self.n_blades)

    def scanned(self, contact: PointContact) -> ScannedSlices:
        """The slices of the strip."""
        reduced = self.reduced.at(contact.omega)

        def formed(shift: complex, kappas: Array) -> SliceMatrices:
            retained = reduced.near(self.contact, contact.omega, shift.imag)
            condensed = reduced.condensed_around(shift, retained, contact.omega)
            closed, change = face_contact(reduced, contact).linearised(shift, kappas)
            return SliceMatrices(retained, condensed.pencils(closed.parts, part_weights(kappas), change))

        return ScannedSlices(formed, self._interpolation, reduced.problem.static)


STIFF_NODES = 8  # kappas between 0 and pi at which the matrices are formed


@dataclass(frozen=True)
class FaceScan:
    """Eigenvalues of the perturbations of the nodal diameters k = 1 .. N_b / 2."""

    structure: RingStructure  # the structure, without a disk

    def scanned(self, contact: PointContact, above: float = ABOVE) -> ScannedSlices:
        """The slices of the strip."""
        structure, omega = self.structure, contact.omega
        motions, closed = structure.motions(omega), structure.closed(contact)

        def formed(shift: complex, kappas: Array) -> SliceMatrices:
            pencils = motions.pencils(structure.phases(kappas), structure.harmonics)
            shifts = np.full(kappas.size, shift)
            highest = structure.problem.highest_pole
            retained, pencil = pencils.closed(closed.at(shift), shifts, omega, highest, above)
            return SliceMatrices(retained[0], pencil)

        return ScannedSlices(formed, self._interpolation, structure.problem.static)

    @cached_property
    def _interpolation(self) -> KappaInterpolation:
        return KappaInterpolation(STIFF_NODES, self.structure.n_blades)


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
                    matrices, np.full(some.size, 1j * centre), omega, structure.problem.highest_pole
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
            shift = np.asarray(1j * centre, dtype=complex)
            found = pencils.eigenvalues(contact.at(centre), shift, omega, highest) + shift[:, None]
            away = np.abs(found - values[places, None])
            if away.shape[1]:
                nearest = np.argmin(away, axis=1)[:, None]
                same = np.take_along_axis(away, nearest, axis=1)[:, 0] < FAMILY
                result[places[same]] = np.take_along_axis(found, nearest, axis=1)[same, 0]
        return result

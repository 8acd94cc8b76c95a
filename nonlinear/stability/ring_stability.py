"""Perturbations of all nodal diameters of the ring: the least stable Floquet exponent of one point.

All nodal diameters are scanned with few modes (`PatternScan`), with a disk each with modes of its own (`SectorScan`).
What leads there is refined with the matrices of its own kappa.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.stability.eigenproblem import OVERLAP
from nonlinear.stability.floquet import NEUTRAL, FloquetAnalysis
from nonlinear.stability.perturbation_pencils import FARTHEST
from nonlinear.stability.point_contact import PointContact
from nonlinear.stability.ring_scan import FaceScan, PatternScan, ScannedSlices, SectorScan
from rom.cyclic.sector_modes import RingModes

SCAN_ERROR = 0.005  # of an eigenvalue that leads a scan, in units of omega, before it is refined
SAME_RATE = 0.1  # relative difference of two rates that is left where it does not matter to the stability
FAMILY = 0.05  # distance of two eigenvalues of one family of neighbouring nodal diameters
LIKELY = 0.3  # growth, in units of omega, beyond which few eigenvalues of a scan lead to any
FAST = 1.0  # growth, in units of omega, beyond which a scan, linear in sigma, has spurious eigenvalues
MOST_FAST = 4  # of these that are tried all the same, where the largest real part is asked for
COARSE = 3  # nodal diameters from one looked at to the next, where perturbations of one of these grow
CLEAR_GROWTH = 0.01  # of an exponent, in units of omega, that leaves no doubt
CLEARLY_GROWING = 0.02  # growth in the scan, in units of omega, that is likely to be one
HALF_STRIP = 0.5 + OVERLAP + SCAN_ERROR  # beyond it are the eigenvalues of other nodal diameters
SAME_PAIR = 1e-9  # difference of two rates, in units of omega, that may be round-off: the one with Im > 0 goes first
MAX_REFINED = 12  # eigenvalues of one point, or more: all those that grow in the scan, until one grows


class PatternExponent(NamedTuple):
    """A Floquet exponent of the perturbations of one nodal diameter."""

    exponent: complex  # lambda, 1/s
    # k: the phase shift from blade to blade, beside that of the wave, is 2 pi k / N_b; 0 <= k <= N_b / 2
    nodal_diameter: int

    def grows(self, omega: float) -> bool:
        """Whether it grows, Re lambda > 1e-6 omega."""
        return bool(self.exponent.real > NEUTRAL * omega)

    def grows_clearly(self, omega: float) -> bool:
        """Whether the ring leaves the motion for certain, Re lambda > 0.01 omega: 6 % a period."""
        return bool(self.exponent.real > CLEAR_GROWTH * omega)


# what eigenvalues of a scan and their nodal diameters were found to lead to
Known: TypeAlias = dict[tuple[complex, int], PatternExponent | None]


class LinearisedContact(NamedTuple):
    """A solved point as its perturbations see it."""

    displacement: Array  # (2H+1, n_c, 3), real Fourier coefficients of d, m
    jacobian: Array  # (n_c, 3, 3, 2H+1, 2H+1), contact Jacobian there
    omega: float  # excitation frequency, rad/s


@dataclass(frozen=True)
class ScanErrors:
    """Errors of the scan where an eigenvalue was refined: those of its family are alike."""

    _known: list[tuple[complex, int, float]] = field(default_factory=list)

    def add(self, sigma: complex, k: int, refined: complex) -> None:
        """Note that `sigma` of nodal diameter k was refined."""
        if abs(refined - sigma) < FAMILY:
            self._known.append((sigma, k, refined.real - sigma.real))

    def corrected(self, sigma: ComplexArray, k: NDArray[np.int64]) -> Array:
        """The real parts of eigenvalues of the scan (n,), corrected by the error of the nearest one refined."""
        result, nearest = sigma.real.copy(), np.full(sigma.size, FAMILY)
        for other, n, error in self._known:
            distance = np.abs(np.abs(sigma.imag) - abs(other.imag)) + 0.01 * np.abs(k - n)
            distance += np.abs(sigma.real - other.real)
            nearer = distance < nearest
            result[nearer], nearest[nearer] = sigma.real[nearer] + error, distance[nearer]
        return result


@dataclass(frozen=True)
class RingStability:
    """Perturbations of the nodal diameters k = 1 .. N_b / 2, kappa = 2 pi k / N_b; -k has the complex conjugates."""

    wave: FloquetAnalysis  # perturbations with the symmetry of the wave (kappa = 0)
    n_blades: int  # n_b, at least 2

    def leading(self, contact: LinearisedContact, any_growing: bool = False) -> PatternExponent | None:
        """The exponent with the largest real part over all k; None if none lies in the strip.

        The eigenvalues of the interpolated problems are refined, the least stable first, until no other one can lead
        or can turn a stable motion into an unstable one. `any_growing`: the first one that grows suffices.
        """
        point = self.wave.point(*contact)
        if self._waves_differ:
            best = self._least_stable(point, self._sector_scan.eigenvalues(point), any_growing, {})
        else:
            leading = (self._leading_of(point, slices, any_growing) for slices in self._scanned(point))
            best = next((found for found in leading if found is not None), None)
        return best if best is None or any_growing else self._climbed(point, best)

    def leading_of(self, contact: LinearisedContact, k: int) -> PatternExponent | None:
        """The exponent of one nodal diameter k with the largest real part; None if none lies in the strip."""
        point, own = self.wave.point(*contact), min(k % self.n_blades, -k % self.n_blades)
        return self._least_stable(point, [item for item in self._approximate(point) if item[1] == own], False, {})

    def _leading_of(self, point: PointContact, slices: ScannedSlices, any_growing: bool) -> PatternExponent | None:
        """The least stable exponent; where any that grows suffices, some nodal diameters are looked at first."""
        every = np.arange(1, self.n_blades // 2 + 1)
        if not any_growing:
            return self._least_stable(point, slices.eigenvalues(every), False, {})
        coarse = every % COARSE == 1
        known: Known = {}
        scanned = slices.eigenvalues(every[coarse])
        if scanned and scanned[0][0].real > CLEARLY_GROWING:
            best = self._least_stable(point, scanned, True, known)
            if best is not None and best.grows(point.omega):
                return best
        scanned += slices.eigenvalues(every[~coarse])
        return self._least_stable(point, sorted(scanned, key=lambda item: -item[0].real), True, known)

    def _least_stable(
        self, point: PointContact, scanned: list[tuple[complex, int]], any_growing: bool, known: Known
    ) -> PatternExponent | None:
        """The least stable exponent that eigenvalues of a scan lead to, or the first that grows."""
        best, errors = None, ScanErrors()
        left = _plausible(scanned, 0 if any_growing else MOST_FAST)
        values, diameters = (np.array([item[part] for item in left]) for part in (0, 1))
        for number in range(len(left)):
            rates = errors.corrected(values, diameters)
            if self._waves_differ:  # errors of neighbouring nodal diameters, with other modes, differ
                rates = np.maximum(rates, values.real)
            likely = np.where(rates > LIKELY, 0.0, rates) if any_growing else rates
            index = int(np.argmax(likely + SAME_PAIR * (values.imag > 0.0)))
            may_grow = values[index].real > NEUTRAL
            if best is not None:
                highest = best.exponent.real / point.omega
                may_grow = may_grow and highest <= NEUTRAL
                in_doubt = highest <= NEUTRAL and values[index].real > -SCAN_ERROR
                if rates[index] <= highest + (0.0 if in_doubt else SAME_RATE * abs(highest)):
                    break
            if number >= MAX_REFINED and not may_grow:
                break
            sigma, k = complex(values[index]), int(diameters[index])
            values, diameters = np.delete(values, index), np.delete(diameters, index)
            if (sigma, k) not in known:
                known[sigma, k] = self._refined(point, sigma, k)
            found = known[sigma, k]
            if found is not None:
                if any_growing and found.grows(point.omega):
                    return found
                errors.add(sigma, k, found.exponent / point.omega)
                if best is None or found.exponent.real > best.exponent.real:
                    best = found
        return best

    def followed(self, contact: LinearisedContact, start: PatternExponent) -> PatternExponent | None:
        """The exponent that the one of a neighbouring point leads to; None if it leads to none."""
        return self._refined(self.wave.point(*contact), start.exponent / contact.omega, start.nodal_diameter)

    def _climbed(self, contact: PointContact, best: PatternExponent) -> PatternExponent:
        """From an exponent that grows, that of the neighbouring nodal diameters that grows most."""
        if not best.grows(contact.omega):
            return best
        for direction in (-1, 1):
            k = best.nodal_diameter + direction
            while 1 <= k <= self.n_blades // 2:
                found = self._refined(contact, best.exponent / contact.omega, k)
                if found is None or found.exponent.real <= best.exponent.real:
                    break
                best, k = found, k + direction
        return best

    def approximate(self, contact: LinearisedContact) -> list[tuple[complex, int]]:
        """Eigenvalues sigma = lambda / omega in the strip and their k, those of all k, the least stable first."""
        return self._approximate(self.wave.point(*contact))

    def _approximate(self, point: PointContact) -> list[tuple[complex, int]]:
        if self._waves_differ:
            return self._sector_scan.eigenvalues(point)
        found = (slices.eigenvalues() for slices in self._scanned(point))
        return next((values for values in found if values), [])

    def _scanned(self, point: PointContact) -> Iterator[ScannedSlices]:
        """The slices of the strip without a disk; those with more poles are for points that have nothing else."""
        if self.wave.few_modes.suffice(point.omega):
            yield self._scan.scanned(point)
        yield self._face_scan.scanned(point)
        yield self._face_scan.scanned(point, above=FARTHEST)

    @property
    def _waves_differ(self) -> bool:
        return self.wave.problem.modal.waves_differ

    @cached_property
    def _scan(self) -> PatternScan:
        return PatternScan(self.wave.few_modes, self.wave.sampler.parameters, self.n_blades)

    @cached_property
    def _sector_scan(self) -> SectorScan:
        return SectorScan(self.wave.structure)

    @cached_property
    def _face_scan(self) -> FaceScan:
        return FaceScan(self.wave.structure)

    def _refined(self, contact: PointContact, sigma: complex, k: int) -> PatternExponent | None:
        """The exponent of k that successive linear problems lead to from `sigma`; None if they lead to none."""
        found = self.wave.refined(contact, sigma, k)
        return None if found is None else PatternExponent(contact.omega * found, k)


def _plausible(scanned: list[tuple[complex, int]], most_fast: int) -> list[tuple[complex, int]]:
    """Eigenvalues of a scan in the strip, few of those that grow very fast: with stiff contacts many are none."""
    inside = [item for item in scanned if abs(item[0].imag) <= HALF_STRIP]
    fast = sorted((item for item in inside if item[0].real > FAST), key=lambda item: item[0].real)
    return [*reversed(fast[:most_fast]), *(item for item in inside if not item[0].real > FAST)]


def largest_nodal_diameter(modal: RingModes) -> int:
    """Largest k of a perturbation, N_b / 2; 0 where blades do not move each other or their number is not known."""
    return 0 if not modal.neighbours_coupled or modal.n_blades is None else modal.n_blades // 2

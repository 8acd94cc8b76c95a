"""All periodic solutions at one frequency, on all branches of a curve."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.fourier import ComplexArray, to_real
from nonlinear.contact.parameters import Array
from nonlinear.continuation.response_quantities import largest_amplitude, output_under_forces
from nonlinear.harmonic_balance.initial_solution import solve_at
from nonlinear.harmonic_balance.residual import HarmonicBalance, has_odd_harmonics_only
from nonlinear.options import SolverOptions
from nonlinear.time_integration.ring import Ring
from nonlinear.worst_motion.ring_integration import RingPatterns, Solution

SAME_SOLUTION = 1e-6  # relative difference of two solutions that count as one


class BranchPoints(Protocol):
    """The points of a branch: frequencies (P,), coefficients (P, H+1, n_c, 3), harmonics balanced (P,)."""

    @property
    def frequency_hz(self) -> Array: ...
    @property
    def relative_displacement(self) -> ComplexArray: ...
    @property
    def kept_harmonics(self) -> NDArray[np.int64]: ...


def interpolated(branch: BranchPoints, frequency_hz: float) -> Iterator[Array]:
    """Real coefficients (2H+1, n_c, 3) at a frequency, between the points of a branch on either side of it."""
    frequency = branch.frequency_hz
    crossed = (frequency[:-1] - frequency_hz) * (frequency[1:] - frequency_hz) <= 0.0
    for before in np.flatnonzero(crossed).tolist():
        width = frequency[before + 1] - frequency[before]
        share = (frequency_hz - frequency[before]) / width if width else 0.5
        kept = int(branch.kept_harmonics[before : before + 2].max()) + 1
        first, last = branch.relative_displacement[before : before + 2, :kept]
        yield to_real((1.0 - share) * first + share * last)


@dataclass(frozen=True)
class FoundSolution:
    """A periodic solution at one frequency."""

    branch: int  # 0, the main branch; k, detached branch k
    amplitude_m: float  # largest abs(x(t)) of the output, m
    solution: Solution  # the solution and its worst perturbation


@dataclass(frozen=True)
class SolutionSearch:
    """Solutions at one frequency, between neighbouring points of the branches."""

    ring: Ring
    options: SolverOptions  # contact integration, tolerances and output
    frequency_hz: float

    @property
    def omega(self) -> float:
        """The frequency, rad/s."""
        return 2.0 * np.pi * self.frequency_hz

    def solutions(self, branches: Sequence[BranchPoints]) -> list[FoundSolution]:
        """The solutions on these branches, the highest first."""
        found = [each for number, branch in enumerate(branches) for each in self._on(number, branch)]
        return sorted(found, key=lambda each: -each.amplitude_m)

    def _on(self, number: int, branch: BranchPoints) -> Iterator[FoundSolution]:
        """The solutions on one branch, each once."""
        seen: list[Array] = []
        for displacement in self.crossings(branch):
            alike = [one for one in seen if one.shape == displacement.shape]
            if all(np.abs(one - displacement).max() > SAME_SOLUTION * np.abs(one).max() for one in alike):
                seen.append(displacement)
                yield self._found(number, displacement)

    def crossings(self, branch: BranchPoints) -> Iterator[Array]:
        """Real coefficients of the solutions between neighbouring points, (2H+1, n_c, 3)."""
        for between in interpolated(branch, self.frequency_hz):
            balance = self._balance(len(between) // 2)
            solved = solve_at(balance, self.omega, balance.unknown(between), self.options)
            if solved.converged:
                yield balance.displacement(solved.solution)

    def _balance(self, n_harmonics: int) -> HarmonicBalance:
        element = contact_element(self.ring.contact, n_harmonics, self.options)
        receptance = self.ring.receptance(n_harmonics)
        return HarmonicBalance(receptance, element, odd=has_odd_harmonics_only(receptance, self.ring.contact))

    def _found(self, number: int, displacement: Array) -> FoundSolution:
        balance = self._balance(len(displacement) // 2)
        forces = balance.element.evaluate(displacement)
        output = output_under_forces(balance.receptance, self.omega, forces, self.options.output)
        worst = RingPatterns(self.ring, self.options, self.omega, displacement).worst()
        solution = Solution(self.omega, displacement, float(worst.exponent.real), worst.nodal_diameter)
        return FoundSolution(number, largest_amplitude(output).value, solution)

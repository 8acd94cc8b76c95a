"""Perturbations of all nodal diameters of the ring: the least stable Floquet exponent of one point.

The matrices of the eigenvalue problem are analytic and 2 pi-periodic in the phase shift kappa of the perturbation.
They are formed at a few kappas and interpolated by a trigonometric polynomial at all others. What leads there is
refined with the matrices of its own kappa.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.stability.floquet import NEUTRAL, OVERLAP, FloquetAnalysis, converged
from nonlinear.stability.hill import HillProblem, Memory
from rom import ModalModel

NODES = 3  # kappas between 0 and pi at which the matrices are formed
WIDTH = 1.0 / 3.0  # of the slices of the strip, in units of omega
SCAN_ERROR = 0.005  # of an eigenvalue that leads a scan, in units of omega, before it is refined
SAME_RATE = 0.1  # relative difference of two rates that is left where it does not matter to the stability
MAX_REFINED = 12  # eigenvalues of one point


class PatternExponent(NamedTuple):
    """A Floquet exponent of the perturbations of one nodal diameter.

    Attributes
    ----------
    exponent : complex
        lambda, 1/s.
    nodal_diameter : int
        k: the phase shift from blade to blade, beside that of the wave, is 2 pi k / N_b; 0 <= k <= N_b / 2.
    """

    exponent: complex
    nodal_diameter: int

    def grows(self, omega: float) -> bool:
        """Whether it grows, Re lambda > 1e-6 omega.

        Parameters
        ----------
        omega : float
            Excitation frequency, rad/s.
        """
        return bool(self.exponent.real > NEUTRAL * omega)


class LinearisedContact(NamedTuple):
    """A solved point as its perturbations see it.

    Attributes
    ----------
    displacement : (2H+1, n_c, 3)
        Real Fourier coefficients of d, m.
    jacobian : (n_c, 3, 3, 2H+1, 2H+1)
        Contact Jacobian there.
    omega : float
        Excitation frequency, rad/s.
    """

    displacement: Array
    jacobian: Array
    omega: float


@dataclass(frozen=True)
class RingStability:
    """Perturbations of the nodal diameters k = 1 .. N_b / 2, kappa = 2 pi k / N_b; -k has the complex conjugates.

    Attributes
    ----------
    wave : FloquetAnalysis
        Perturbations with the symmetry of the wave (kappa = 0).
    n_blades : int
        N_b, at least 2.
    nodes : int
        J, number of kappas between 0 and pi at which the matrices are formed; those of -kappa follow from them.
    """

    wave: FloquetAnalysis
    n_blades: int
    nodes: int = NODES
    _problems: dict[int, HillProblem] = field(default_factory=dict, init=False, repr=False, compare=False)

    def leading(self, contact: LinearisedContact) -> PatternExponent | None:
        """The exponent with the largest real part over all k; None if none lies in the strip.

        The eigenvalues of the interpolated problems are refined, the least stable first, until no other one can lead
        or can turn a stable motion into an unstable one.

        Parameters
        ----------
        contact : LinearisedContact
            The point.
        """
        memory = self.wave.sampler.memory(contact.displacement)
        best: PatternExponent | None = None
        for count, (sigma, k) in enumerate(self.approximate(contact, memory)):
            if best is not None:
                rate = best.exponent.real / contact.omega
                in_doubt = rate <= NEUTRAL and sigma.real > -SCAN_ERROR
                tolerance = 0.0 if in_doubt else SAME_RATE * abs(rate)
                if sigma.real <= rate + tolerance or count >= MAX_REFINED:
                    break
            found = self._refined(contact, memory, sigma, k)
            if found is not None and (best is None or found.exponent.real > best.exponent.real):
                best = found
        return best

    def followed(
        self, contact: LinearisedContact, start: PatternExponent, climb: bool = True
    ) -> PatternExponent | None:
        """The exponent that the one of a neighbouring point leads to; None if it leads to none.

        Parameters
        ----------
        contact : LinearisedContact
            The point.
        start : PatternExponent
            Exponent of the neighbour.
        climb : bool
            Whether, from one that grows, the neighbouring nodal diameters are followed to the one that grows most.
        """
        memory = self.wave.sampler.memory(contact.displacement)
        best = self._refined(contact, memory, start.exponent / contact.omega, start.nodal_diameter)
        if best is None or not climb or not best.grows(contact.omega):
            return best
        for direction in (-1, 1):
            k = best.nodal_diameter + direction
            while 1 <= k <= self.n_blades // 2:
                found = self._refined(contact, memory, best.exponent / contact.omega, k)
                if found is None or found.exponent.real <= best.exponent.real:
                    break
                best, k = found, k + direction
        return best

    def approximate(self, contact: LinearisedContact, memory: Memory | None) -> list[tuple[complex, int]]:
        """Eigenvalues sigma = lambda / omega in the strip and their k, those of all k, the least stable first.

        From interpolated matrices, the slider memory linearised in the middles of slices of the strip.

        Parameters
        ----------
        contact : LinearisedContact
            The point.
        memory
            Its slider memory; None: none.
        """
        problems = [problem.eigenproblem(contact.jacobian, contact.omega, memory) for problem in self._nodes]
        mirror = self._nodes[0].contact_free.mirror(contact.omega)
        centres = (0.0,) if memory is None else (-WIDTH, 0.0, WIDTH)
        half_width = (0.5 if memory is None else WIDTH / 2.0) + OVERLAP
        linearised = {centre: [problem.linearised(1j * centre) for problem in problems] for centre in centres}
        found: list[tuple[complex, int]] = []
        for centre in centres:
            conjugates = [tuple(part.conj()[mirror][:, mirror] for part in pair) for pair in linearised[-centre]]
            values = self._interpolated_eigenvalues([*linearised[centre], *conjugates])
            row, column = np.nonzero(np.abs(values.imag - centre) <= half_width)
            found += zip(values[row, column].tolist(), (row + 1).tolist(), strict=True)
        return sorted(found, key=lambda item: -item[0].real)

    @cached_property
    def _nodes(self) -> list[HillProblem]:
        """The problems at kappa = (j + 1/2) pi / J, j = 0 .. J - 1: none of them is written in real motions."""
        kappas = (np.arange(self.nodes) + 0.5) * np.pi / self.nodes
        return [replace(self.wave.problem, kappa=float(kappa)) for kappa in kappas]

    @cached_property
    def _weights(self) -> Array:
        """Weights of the nodes kappa_0, .., kappa_(J-1), -kappa_0, .. at each k, (N_b / 2, 2 J)."""
        positive = np.array([problem.kappa for problem in self._nodes])
        kappas = 2.0 * np.pi / self.n_blades * np.arange(1, self.n_blades // 2 + 1)
        half = (kappas[:, None] - np.concatenate([positive, -positive])) / 2.0
        with np.errstate(divide="ignore", invalid="ignore"):
            weights = np.sin(2 * self.nodes * half) / (2 * self.nodes * np.tan(half))
        return np.where(np.abs(np.sin(half)) < 1e-12, 1.0, weights)

    def _interpolated_eigenvalues(self, nodes: list[tuple[ComplexArray, ...]]) -> ComplexArray:
        """Eigenvalues (N_b / 2, n_z) of all k from the matrices A_c and E_c of the 2 J nodes."""
        size = nodes[0][0].shape[0]
        matrix, descriptor = (
            (self._weights @ np.stack([node[part].ravel() for node in nodes])).reshape(-1, size, size)
            for part in (0, 1)
        )
        return np.linalg.eigvals(np.linalg.solve(descriptor, matrix))

    def _refined(
        self, contact: LinearisedContact, memory: Memory | None, sigma: complex, k: int
    ) -> PatternExponent | None:
        """The exponent of k that successive linear problems lead to from `sigma`; None if they lead to none."""
        if k not in self._problems:
            self._problems[k] = replace(self.wave.problem, kappa=2.0 * np.pi * k / self.n_blades)
        value = converged(self._problems[k].eigenproblem(contact.jacobian, contact.omega, memory), sigma)
        if value is None or abs(value.imag) > 0.5 + OVERLAP:
            return None
        return PatternExponent(contact.omega * value, k)


def largest_nodal_diameter(modal: ModalModel) -> int:
    """Largest k of a perturbation, N_b / 2; 0 where blades do not touch each other or their number is not known.

    Parameters
    ----------
    modal : ModalModel
        The modes of a blade.
    """
    return 0 if modal.left is None or modal.n_blades is None else modal.n_blades // 2

"""The structure as perturbations of all nodal diameters see it, in few contact motions that all waves share."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.stability.closed_contact import ClosedContact
from nonlinear.stability.closed_refinement import ClosedRefinement, PerturbationStructure
from nonlinear.stability.face_flexibility import FaceFlexibility
from nonlinear.stability.hill import HillProblem
from nonlinear.stability.perturbation_pencils import PerturbationPencils
from nonlinear.stability.point_contact import PointContact
from nonlinear.stability.wave_flexibility import WaveFlexibility
from rom import SectorModes, WaveModes

HIGHEST = 1.5  # of the lowest modes, over the highest frequency of a perturbation
RATIO = 1.25  # from one such frequency to the next
KEPT = 16  # nodal diameters whose modes are kept


@dataclass(frozen=True)
class RingStructure:
    """The structure in the perturbations of a wave."""

    problem: HillProblem  # perturbations of the wave, kappa = 0
    contact: ContactParameters  # parameters of the contact nodes
    n_blades: int  # n_b
    _motions: dict[int, WaveFlexibility | FaceFlexibility] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    _modes: dict[int, WaveModes] = field(default_factory=dict, init=False, repr=False, compare=False)

    @cached_property
    def harmonics(self) -> Array:
        """0, 1, -1, 2, -2, ...; (S,)."""
        return self.problem.harmonics

    def motions(self, omega: float) -> WaveFlexibility | FaceFlexibility:
        """The flexibility of the waves, with lowest modes that suffice."""
        highest = HIGHEST * (self.problem.n_harmonics + 0.5) * omega
        number = int(np.ceil(np.log(highest) / np.log(RATIO)))
        if number not in self._motions:
            modal, frequency = self.problem.modal, RATIO**number
            self._motions[number] = (
                WaveFlexibility.of(modal, self.contact, frequency)
                if isinstance(modal, SectorModes)
                else FaceFlexibility.of(modal, self.contact, frequency)
            )
        return self._motions[number]

    def closed(self, contact: PointContact) -> ClosedContact:
        """The contact of a point closed around the mean flexibility; the same object if it is asked for again."""
        motions, known = self.motions(contact.omega), contact.in_few_modes
        if id(motions) not in known:
            known[id(motions)] = ClosedContact.of(self.problem, motions, contact)
        closed = known[id(motions)]
        assert isinstance(closed, ClosedContact)
        return closed

    def pencils(self, diameters: NDArray[np.int64], omega: float) -> PerturbationPencils:
        """The eigenvalue problems of some nodal diameters.

        Shapes: `diameters` (K,).
        """
        motions = self.motions(omega)
        if isinstance(motions, WaveFlexibility):
            return motions.pencils((self._orders + diameters[:, None]) % self.n_blades, self.harmonics)
        return motions.pencils(self.phases(2.0 * np.pi * diameters / self.n_blades), self.harmonics)

    def phases(self, kappas: Array) -> Array:
        """Phase from blade to blade in each harmonic of some perturbations, (K, S) rad.

        Shapes: `kappas` (K,).
        """
        return np.asarray(self.harmonics * self.problem.phase + kappas[:, None])

    def refinement(self, contact: PointContact, k: int) -> ClosedRefinement:
        """What refines the eigenvalues of a nodal diameter."""
        omega = contact.omega
        if k not in self._modes:
            if len(self._modes) >= KEPT:
                self._modes.clear()
            self._modes[k] = self.problem.modal.waves(self.phases(np.array([2.0 * np.pi * k / self.n_blades]))[0])
        structure = PerturbationStructure(self.motions(omega), self.pencils(np.array([k]), omega), self._modes[k])
        real = 2 * k % self.n_blades == 0
        return ClosedRefinement(structure, contact, self.closed(contact), real)

    @cached_property
    def _orders(self) -> NDArray[np.int64]:
        """Nodal diameters of the harmonics of the wave, h EO, (S,)."""
        engine_order = self.problem.phase * self.n_blades / (2.0 * np.pi)
        return np.rint(self.harmonics * engine_order).astype(np.int64)

"""Approximate Floquet exponents of all nodal diameters of one point, for stiff contacts of blades without a disk.

Few modes do not have the local flexibility of the contact faces, which stiff contacts need (`PatternScan`). But it is
the same at all nodal diameters (`FaceFlexibility`): the contact is closed around it once. The small problems that are
left are formed at a few kappas and interpolated as in `PatternScan`.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.stability.face_flexibility import FaceFlexibility
from nonlinear.stability.kappa_interpolation import KappaInterpolation
from nonlinear.stability.pattern_matrices import WIDTH, ScannedSlices, SliceMatrices
from nonlinear.stability.point_contact import PointContact
from nonlinear.stability.reduced_problem import ABOVE
from nonlinear.stability.ring_structure import RingStructure

NODES = 8  # kappas between 0 and pi at which the matrices are formed


@dataclass(frozen=True)
class FaceScan:
    """Eigenvalues of the perturbations of the nodal diameters k = 1 .. N_b / 2."""

    structure: RingStructure  # the structure, without a disk

    def scanned(self, contact: PointContact, above: float = ABOVE) -> ScannedSlices:
        """The slices of the strip."""
        structure, omega = self.structure, contact.omega
        motions, closed = structure.motions(omega), structure.closed(contact)
        assert isinstance(motions, FaceFlexibility)
        static, kappas = structure.problem.static, self._interpolation.kappas

        def formed(centre: float, kappas: Array) -> SliceMatrices:
            pencils = motions.pencils(structure.phases(kappas), structure.harmonics)
            centres = np.full(kappas.size, centre)
            parts = pencils.matrices(closed.at(1j * centre), centres, omega, structure.problem.highest_pole, above)
            return SliceMatrices(parts.retained[0], parts.matrix, parts.descriptor)

        half, upper = formed(0.0, kappas[:NODES]), formed(WIDTH, kappas)
        slices = (0.0, half.with_mirrored(static)), (WIDTH, upper), (-WIDTH, upper.opposite(static, NODES))
        return ScannedSlices(slices, self._interpolation.weights)

    @cached_property
    def _interpolation(self) -> KappaInterpolation:
        return KappaInterpolation(NODES, self.structure.n_blades)

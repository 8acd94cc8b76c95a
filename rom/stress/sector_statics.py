"""Static response of the mesh of a blade that is clamped, or of a sector that is joined to its neighbours."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rom.cyclic_sector.condensed_sector import CondensedSector
from rom.cyclic_sector.cyclic_faces import CyclicFaces
from rom.cyclic_sector.cyclic_modes import WaveProblem
from rom.errors import FactorisationError
from rom.finite_elements.full_model import FullModel
from rom.linear_algebra.factorisation import Factor, factorise

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class SectorStatics:
    """Solutions of K u = f in a wave."""

    full: FullModel  # the full model
    # cut faces of a sector of a bladed disk; None: a blade alone, the same in every wave
    faces: CyclicFaces | None = None
    _waves: dict[int, WaveProblem] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Factorise the stiffness; raises FactorisationError where the structure is not held."""
        if self.faces is None:
            assert self._factor is not None
        elif not self.full.fixed.size:
            raise FactorisationError("a disk that nothing holds has no static response; allowed: bore = clamped")

    @cached_property
    def free(self) -> NDArray[np.int64]:
        """Dofs that can move."""
        fixed = self.full.fixed if self.faces is None else np.flatnonzero(self.faces.held(self.full))
        return np.setdiff1d(np.arange(self.full.n_dofs), fixed)

    def solve(self, force: Complex, phase: float) -> Complex:
        """K^-1 f of a force (N,) on the sector, zero on the clamped dofs.

        Shapes: `force` (N,).
        """
        if self.faces is None:
            found = np.zeros(self.full.n_dofs, complex)
            both = self._factor.solve(np.column_stack([force.real[self.free], force.imag[self.free]]))
            found[self.free] = both[:, 0] + 1j * both[:, 1]
            return found
        n = round(phase * self.faces.n_sectors / (2.0 * np.pi)) % self.faces.n_sectors
        mirrored = 2 * n > self.faces.n_sectors  # -n has the complex conjugate matrices
        wave = self._wave(self.faces.n_sectors - n if mirrored else n)
        given = force.conj() if mirrored else force
        if wave.is_real:
            both = wave.static_response(np.column_stack([given.real, given.imag]))
            moved = both[:, 0] + 1j * both[:, 1]
        else:
            moved = wave.static_response(given[:, None])[:, 0]
        return moved.conj() if mirrored else moved

    @cached_property
    def _factor(self) -> Factor:
        return factorise(self.full.stiffness[self.free][:, self.free])

    @cached_property
    def _sector(self) -> CondensedSector:
        assert self.faces is not None
        return CondensedSector(self.full, self.faces)

    def _wave(self, nodal_diameter: int) -> WaveProblem:
        if nodal_diameter not in self._waves:
            self._waves[nodal_diameter] = WaveProblem(self._sector, nodal_diameter)
        return self._waves[nodal_diameter]

"""Reference of reduced disk sectors, the whole mesh in the waves of one nodal diameter, and the error against it.

As `full_reference`, with the matrices T_n^H K T_n and T_n^H M T_n of the wave (`cyclic_modes`): free natural modes
far beyond the frequencies of interest, static responses to forces at the boundary dofs, and the quasi-static
responses to the inertia of those. It shares nothing with the motions of the cut faces of a reduced sector.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rom.cyclic.natural_frequencies import natural_frequencies
from rom.cyclic.reduced_model import ReducedModel
from rom.cyclic.wave_superelement import WaveSuperelement, model_of_waves
from rom.cyclic_sector.condensed_sector import CondensedSector
from rom.cyclic_sector.cyclic_faces import cyclic_faces
from rom.cyclic_sector.cyclic_modes import WaveProblem
from rom.errors import RomParameterError
from rom.finite_elements.full_model import FullModel
from rom.linear_algebra.threads import one_blas_thread
from rom.reduction.boundary_dofs import (
    AT_TIP,
    BoundaryChoice,
    InterfaceMotion,
    choose_boundary_dofs,
)
from rom.reduction.contact_dofs import ContactDofs
from rom.reduction.reference_model import (
    FullReference,
    ResponseSpace,
    inner,
    require_at_rest,
    spread_over_face,
)
from rom.reduction.substructure import boundary_selection

if TYPE_CHECKING:
    from geometry.sector import SectorMesh


RIGID = 1e-4  # of the highest frequency: below, a motion is rigid and has no relative error


@dataclass(frozen=True)
class WaveErrors:
    """Relative errors of natural frequencies at several nodal diameters."""

    nodal_diameters: tuple[int, ...]  # the k nodal diameters
    # whether the motions of the cut faces were taken from this nodal diameter, among others
    sampled: tuple[bool, ...]
    errors: NDArray[np.float64]  # (k, m) reduced over exact frequency of each mode, less 1; 0 for rigid motions

    @property
    def largest(self) -> float:
        """Largest modulus of all errors."""
        return float(np.abs(self.errors).max(initial=0.0))

    @property
    def largest_unsampled(self) -> float | None:
        """Largest modulus at the nodal diameters that were not sampled; None where there are none."""
        if all(self.sampled):
            return None
        return float(np.abs(self.errors[~np.array(self.sampled)]).max(initial=0.0))


def wave_errors(model: ReducedModel, interface: InterfaceMotion | None, count: int = 10) -> WaveErrors:
    """Errors of the natural frequencies of a reduced disk sector with free contacts.

    `interface_motion` leaves the frequencies of the whole mesh at the nodal diameters that it sampled and at one that
    it did not, the one farthest from the others. The errors are those of the motions of the cut faces and of the
    fixed-interface modes together, without that of the mesh.
    """
    references = () if interface is None else interface.references
    if not references or model.n_blades is None:
        raise RomParameterError("disk", "nodal_diameters", len(references), "must be a sector of interface_motion")
    kept = min(count, *(len(reference.frequency_hz) for reference in references))
    errors = np.zeros((len(references), kept))
    for row, reference in zip(errors, references, strict=True):
        exact = reference.frequency_hz[:kept]
        phase = 2.0 * np.pi * reference.nodal_diameter / model.n_blades
        found = natural_frequencies(model, phase, count=kept)
        elastic = exact > RIGID * exact[-1]
        row[elastic] = found[elastic] / exact[elastic] - 1.0
    return WaveErrors(
        tuple(reference.nodal_diameter for reference in references),
        tuple(reference.sampled for reference in references),
        errors,
    )


@one_blas_thread()
def wave_reference(
    full: FullModel,
    sector: SectorMesh,
    nodal_diameter: int,
    highest_hz: float,
    boundary: BoundaryChoice = AT_TIP,
    *,
    with_face: bool = False,
) -> FullReference:
    """The reference of a sector of a bladed disk at one nodal diameter, for frequencies up to `highest_hz`.

    `highest_hz`: highest frequency of interest, Hz. Of the reference `flexibility` (6 n_c, 6 n_c) is that of
    the wave, complex but for n = 0 and half the number of sectors, and None where a rigid motion has no static
    response.
    """
    faces = cyclic_faces(full, sector)
    require_at_rest(full, faces.nodes)
    problem = WaveProblem(CondensedSector(full, faces), nodal_diameter)
    dofs = choose_boundary_dofs(full, sector, replace(boundary, interface=None))
    space = ResponseSpace.of(problem, full, dofs, boundary, highest_hz)

    def model(basis: NDArray[Any], contact: ContactDofs) -> ReducedModel:
        given = boundary_selection(dofs, space.motion @ basis)
        selected = given | {"force_excitation": given["force_excitation"].conj()}
        if space.loads is not None:  # a force f is T^H f, an output o u is o T z
            rows = space.loads.selection(selected, lambda vector: vector @ basis)
            selected = space.loads.selection(selected, lambda vector: basis.conj().T @ vector)
            selected["outputs"] = rows["outputs"]
        right, left = contact.relative(np.asarray(contact.motion @ basis))
        mass, stiffness = (
            _hermitian(inner(basis, matrix, basis), problem.is_real) for matrix in (problem.mass, full.stiffness)
        )
        wave = WaveSuperelement(mass, stiffness, right, left, selected["force_excitation"], selected["outputs"])
        waves = {nodal_diameter: wave}
        made = model_of_waves(waves, faces.n_sectors, contact.position, contact.area, vibration_only=True)
        return replace(made, interfaces=contact.interfaces)

    return space.reference(model, spread_over_face(full, sector) if with_face else None)


def _hermitian(matrix: NDArray[Any], real: bool) -> NDArray[Any]:
    found = 0.5 * (matrix + matrix.conj().T)
    return np.real(found) if real else found

"""Reference of reduced disk sectors, the whole mesh in the waves of one nodal diameter, and the error against it.

As `full_reference`, with the matrices T_n^H K T_n and T_n^H M T_n of the wave (`cyclic_modes`): free natural modes
far beyond the frequencies of interest, static responses to forces at the boundary dofs, and the quasi-static
responses to the inertia of those. It shares nothing with the motions of the cut faces of a reduced sector.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rom.cyclic.natural_frequencies import natural_frequencies
from rom.cyclic.reduced_model import ReducedModel
from rom.cyclic.wave_superelement import WaveSuperelement, model_of_waves
from rom.cyclic_sector.condensed_sector import CondensedSector
from rom.cyclic_sector.cyclic_faces import cyclic_faces
from rom.cyclic_sector.cyclic_modes import CyclicModes, WaveProblem
from rom.errors import RomParameterError
from rom.finite_elements.full_model import FullModel
from rom.linear_algebra.block_lanczos import orthonormal_combinations
from rom.linear_algebra.threads import one_blas_thread
from rom.reduction.boundary_dofs import (
    AT_TIP,
    BoundaryChoice,
    BoundaryDofs,
    InterfaceMotion,
    LoadVectors,
    choose_boundary_dofs,
)
from rom.reduction.contact_dofs import ContactDofs
from rom.reduction.reference_model import (
    BEYOND,
    FIRST_GUESS,
    MOST_MODES,
    FullReference,
    require_at_rest,
    spread_over_face,
)
from rom.reduction.substructure import boundary_selection

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

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


COLUMNS = 64  # of motions at once


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
    dofs = choose_boundary_dofs(full, sector, replace(boundary, interface=None))
    loads = None if boundary.loads is None else boundary.loads(full)
    given = dofs, loads if loads is not None and loads.size else None
    condensed = CondensedSector(full, faces)
    wave = _Wave(WaveProblem(condensed, nodal_diameter), *given, highest_hz)
    reference = FullReference(wave.model(wave.basis, dofs.contact), wave.flexibility, len(wave.modes.omega))
    face = spread_over_face(full, sector) if with_face else None
    if face is None:
        return reference
    return replace(reference, face=wave.model(wave.extended(face[0]), face[0]), face_grid=face[1])


@dataclass(frozen=True)
class _Wave:
    """The sector in the waves of one nodal diameter: motions (N, m) of all nodes that the wave has."""

    problem: WaveProblem
    dofs: BoundaryDofs
    loads: LoadVectors | None
    highest_hz: float

    @property
    def _full(self) -> FullModel:
        return self.problem.sector.full

    @cached_property
    def motion(self) -> csr_matrix:
        """Boundary dofs (b, N) of the motions."""
        return self.dofs.motion(len(self._full.positions)).tocsr()

    @cached_property
    def modes(self) -> CyclicModes:
        """The lowest free modes, up to three times the highest frequency of interest at least."""
        count = FIRST_GUESS
        while True:
            modes = self.problem.modes(count)
            if len(modes.omega) < count or modes.omega[-1] > 2.0 * np.pi * BEYOND * self.highest_hz:
                return modes
            if count >= MOST_MODES:
                allowed = f"a range below {count} modes of the sector"
                raise RomParameterError("response", "frequency", self.highest_hz, allowed)
            count *= 2

    @cached_property
    def _static(self) -> NDArray[Any]:
        """Responses (N, k) to forces at the boundary dofs, then to the loads; of K + s M where nothing holds."""
        forces = self.motion.T.toarray()
        if self.loads is not None:
            forces = np.hstack([forces, self.loads.columns()])
        return self.problem.static_response(forces)

    @property
    def flexibility(self) -> NDArray[Any] | None:
        """Motions (6 n_c, 6 n_c) of the contact dofs for unit forces there, m/N; None if nothing holds the disk."""
        if self.problem.sector.shift:
            return None
        contact = self.dofs.contact
        return contact.flexibility(self.motion[: 3 * contact.sides] @ self._static[:, : 3 * contact.sides])

    @cached_property
    def basis(self) -> NDArray[Any]:
        """Modes, the rest of static responses, quasi-static responses to their inertia, orthonormal (N, m)."""
        mass = self.problem.sector.mass
        first = self._without_modes(self._static)
        second = self._without_modes(self.problem.static_response(_product(mass, first)))
        vectors = np.hstack([self.modes.shapes, first, second])
        return np.asarray(vectors @ orthonormal_combinations(_inner(vectors, mass, vectors)))

    def extended(self, contact: ContactDofs) -> NDArray[Any]:
        """The basis, and behind it what the responses to forces at other contact dofs add."""
        mass, basis = self.problem.sector.mass, self.basis
        vectors = self._without_modes(self.problem.static_response(contact.motion.toarray().T))
        before = np.diag(_inner(vectors, mass, vectors)).real
        for _ in range(2):  # little may be left: orthogonal to round-off
            vectors -= basis @ _inner(basis, mass, vectors)
        return np.hstack([basis, vectors @ orthonormal_combinations(_inner(vectors, mass, vectors), before)])

    def _without_modes(self, vectors: NDArray[Any]) -> NDArray[Any]:
        shapes = self.modes.shapes
        return np.asarray(vectors - shapes @ _inner(shapes, self.problem.sector.mass, vectors))

    def model(self, basis: NDArray[Any], contact: ContactDofs) -> ReducedModel:
        """The sector in a basis (N, m), with these contact dofs."""
        given = boundary_selection(self.dofs, self.motion @ basis)
        selected = given | {"force_excitation": given["force_excitation"].conj()}
        if self.loads is not None:  # a force f is T^H f, an output o u is o T z
            rows = self.loads.selection(selected, lambda vector: vector @ basis)
            selected = self.loads.selection(selected, lambda vector: basis.conj().T @ vector)
            selected["outputs"] = rows["outputs"]
        right, left = contact.relative(np.asarray(contact.motion @ basis))
        mass, stiffness = (
            _hermitian(_inner(basis, matrix, basis), self.problem.is_real)
            for matrix in (self.problem.sector.mass, self._full.stiffness)
        )
        wave = WaveSuperelement(
            mass=mass,
            stiffness=stiffness,
            contact_right=right,
            contact_left=left,
            force_excitation=selected["force_excitation"],
            outputs=selected["outputs"],
        )
        n, n_blades = self.problem.nodal_diameter, self.problem.sector.faces.n_sectors
        made = model_of_waves({n: wave}, n_blades, contact.position, contact.area, vibration_only=True)
        return replace(made, interfaces=contact.interfaces)


def _product(matrix: Any, columns: NDArray[Any]) -> NDArray[Any]:
    """A product of a real matrix (N, N) with real or complex columns (N, k)."""
    columns = np.ascontiguousarray(columns)
    return np.asarray(matrix @ columns.view(float)).view(columns.dtype)


def _inner(left: NDArray[Any], matrix: Any, right: NDArray[Any]) -> NDArray[Any]:
    """U^H A V (m, k) of motions U (N, m) and V (N, k) by columns of V: motions take much of the memory."""
    found = np.empty((left.shape[1], right.shape[1]), np.result_type(left, right))
    for first in range(0, right.shape[1], COLUMNS):
        part = slice(first, first + COLUMNS)
        found[:, part] = (left.T @ _product(matrix, right[:, part]).conj()).conj()
    return found


def _hermitian(matrix: NDArray[Any], real: bool) -> NDArray[Any]:
    found = 0.5 * (matrix + matrix.conj().T)
    return np.real(found) if real else found

"""Motion of the whole mesh at a solved point: expanded from the reduced model, statically corrected, or solved anew.

The reduced model gives the coordinates under the external and the contact forces of the point. Its expansion lacks
the static response of the modes left out. One static solution for each harmonic adds it (mode acceleration),

    u = K^-1 (f + (h w)^2 M u_r - i h w (C + W G) u_r),

which for harmonic 0 is the exact static displacement. With a disk K is that of the wave of the harmonic. Where
contacts alone hold a body, K + S and f + S u_r take their place, with springs S at these contacts. The solution of
the full model itself,

    (K - (h w)^2 M + i h w (C + W G)) u = f,    C = M Phi diag(2 zeta_m w_m) Phi^T M,

is found by GMRES with K^-1 as preconditioner. C is the damping of the modes of the reduced model, W G the Coriolis
matrix of the mesh at the speed W where Coriolis forces act in the response.

References
----------
R. R. Craig, A. J. Kurdila, Fundamentals of Structural Dynamics, Wiley (2006), section 11.4 (mode acceleration).
Y. Saad, M. H. Schultz, GMRES, SIAM J. Sci. Stat. Comput. 7 (1986) 856.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rom.cyclic.modal_model import ModalModel
from rom.cyclic.receptance import RelativeReceptance
from rom.cyclic.reduced_model import ReducedModel, expand_to_mesh
from rom.cyclic.sector_modes import RingModes
from rom.cyclic_sector.condensed_sector import CondensedSector
from rom.cyclic_sector.cyclic_faces import CyclicFaces
from rom.cyclic_sector.cyclic_modes import WaveProblem
from rom.errors import FactorisationError
from rom.finite_elements.full_model import FullModel
from rom.finite_elements.rotation import coriolis_acceleration, on_springs
from rom.linear_algebra.factorisation import Factor, factorise
from rom.linear_algebra.threads import one_blas_thread
from rom.reduction.boundary_dofs import BoundaryChoice, LoadVectors, choose_boundary_dofs
from rom.reduction.floating_bodies import stuck_springs
from rom.units import angular_speed

if TYPE_CHECKING:
    from geometry.sector import SectorMesh

Complex = NDArray[np.complex128]
RESIDUAL = 1e-10  # of the full model's solution, relative to the force
_MOST_ITERATIONS = 400
_SAME = 1e-6  # relative difference of modal forces that is round-off


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


@dataclass(frozen=True)
class SolvedPoint:
    """A solved point of a response curve."""

    omega: float  # excitation frequency, rad/s
    phase: float  # inter-blade phase angle psi, rad
    force: float  # amplitude of the excitation, N
    contact_force: Complex  # (H+1, n_c, 3) f^(h) on the right nodes in the contact frame, N
    harmonic_factors: tuple[tuple[int, complex], ...] = ()  # harmonics of the excitation, as in `RelativeReceptance`

    @property
    def harmonics(self) -> tuple[int, ...]:
        """Harmonics 0 to H."""
        return tuple(range(len(self.contact_force)))


def _resistance(modes: ModalModel, omega: float) -> NDArray[Any]:
    """Force of damping and flow on a unit motion of each mode, (m,), (rad/s)^2."""
    damped = 1j * omega * modes.total_damping
    return damped if modes.flow is None else damped + modes.flow[0]


class MeshMotion:
    """Displacements of all nodes of a full model at points solved on its reduced model."""

    def __init__(
        self,
        full: FullModel,
        sector: SectorMesh,
        reduced: tuple[ReducedModel, RingModes],
        boundary: BoundaryChoice,
        faces: CyclicFaces | None = None,
    ) -> None:
        self.full, (self.model, self.modal) = full, reduced
        self.dofs = choose_boundary_dofs(full, sector, boundary)
        self.motion = self.dofs.motion(len(full.positions))
        found = None if boundary.loads is None else boundary.loads(full)
        self.loads = LoadVectors() if found is None else found
        self.springs = stuck_springs(full, sector, boundary.contact_dofs)
        self.statics = SectorStatics(replace(full, stiffness=on_springs(full.stiffness, self.springs)), faces)
        self.free = self.statics.free

    def static_force(self) -> NDArray[np.float64]:
        """External static force (N,) on the mesh: the centrifugal force at the speed of the model, and others, N."""
        found = self.full.centrifugal * angular_speed(self.full.speed_rpm) ** 2
        return found if self.loads.static is None else found + self.loads.static

    def forces(self, point: SolvedPoint) -> Complex:
        """External and contact forces (H+1, N) on the mesh, N."""
        generalised = np.zeros((len(point.harmonics), self.dofs.size), complex)
        right, boundary = point.contact_force.reshape(len(point.harmonics), -1), self.dofs.size
        turns = np.exp(-1j * np.asarray(point.harmonics) * point.phase)[:, None]
        generalised += right @ self.model.contact_right[:, :boundary]
        if self.model.contact_left is not None:
            generalised -= (right * turns) @ self.model.contact_left[:, :boundary]
        found: Complex = generalised @ self.motion
        found[0] += self.static_force()
        factors = dict(point.harmonic_factors)
        for h in self._receptance(point).excited_harmonics:
            if h < len(found):
                found[h] += point.force * factors.get(h, 1.0) * self._unit_excitation(h, point.phase)
        return found

    def _unit_excitation(self, harmonic: int, phase: float) -> NDArray[Any]:
        """Forces (N,) on the mesh of 1 N of excitation in a harmonic.

        What the reduced model has beyond the vectors on the mesh are forces on its modes, f = M Phi a.
        """
        modes = self.modal.at_phase(harmonic * phase)
        asked = modes.harmonic_forces.get(harmonic, modes.force)
        force = self._given_excitation(harmonic)
        rest = asked - self._pushed(modes, force)
        if np.linalg.norm(rest) <= _SAME * np.linalg.norm(asked):
            return force
        if not self.loads.excitation:  # the force at one node is not the excitation
            force, rest = np.zeros_like(force), asked
        return np.asarray(force + self.full.mass @ self._expand(modes, rest))

    def _given_excitation(self, harmonic: int) -> NDArray[Any]:
        """The vector of the loads for a harmonic; without any the force at the loaded node."""
        own = self.loads.excitation
        if own:
            zero = np.zeros(self.full.n_dofs)
            return own.get(harmonic, zero if harmonic in self.modal.harmonic_forces else own.get(1, zero))
        at_node = self.dofs.direction @ self.dofs.node_displacement(self.dofs.loaded)
        return np.asarray(at_node @ self.motion)

    def _receptance(self, point: SolvedPoint) -> RelativeReceptance:
        return RelativeReceptance(self.modal, point.phase, point.harmonics, point.force, point.harmonic_factors)

    @one_blas_thread()
    def at_speed(self) -> NDArray[np.float64]:
        """Static displacement (N,) of rotation alone, m: of a model at speed that of its equilibrium."""
        force = self.full.centrifugal * angular_speed(self.full.speed_rpm) ** 2
        return np.real(self.statics.solve(force.astype(complex), 0.0))

    @one_blas_thread()
    def expanded(self, point: SolvedPoint) -> Complex:
        """Displacement (H+1, N) expanded from the reduced model alone, m."""
        coordinates = self._receptance(point).reduced_coordinates(self._coordinates(point))
        return expand_to_mesh(self.model, coordinates).reshape(len(point.harmonics), -1)

    @one_blas_thread()
    def corrected(self, point: SolvedPoint) -> Complex:
        """Displacement (H+1, N) with the static correction, m; harmonic 0 is that of the full model."""
        coordinates, reduced, found = self._coordinates(point), self.expanded(point), self.forces(point)
        for row, h in enumerate(point.harmonics):
            modes, x = self.modal.at_phase(h * point.phase), h * point.omega
            if h or modes.flow is not None:
                resisted = _resistance(modes, x) * coordinates[row, : modes.damping.size]
                inertia = self.full.mass @ reduced[row]
                found[row] += x**2 * inertia - self.full.mass @ self._expand(modes, resisted)
                found[row] -= self._coriolis(reduced[row], inertia, x)
            if self.springs is not None:  # the motion of the contacts is that of the reduced model
                found[row] += self.springs @ reduced[row]
            found[row] = self.statics.solve(found[row], h * point.phase)
        return found

    @one_blas_thread()
    def solved(self, point: SolvedPoint, start: Complex) -> tuple[Complex, float]:
        """Displacement (H+1, N) of the full model under the forces of the point, and the largest relative residual.

        `start` (H+1, N): where GMRES begins.
        """
        forces, found, largest = self.forces(point), start.copy(), 0.0
        for row, h in enumerate(point.harmonics):
            if h:
                found[row], residual = self._harmonic(forces[row], start[row], h * point.omega, h * point.phase)
                largest = max(largest, residual)
        return found, largest

    def _harmonic(self, force: Complex, start: Complex, omega: float, phase: float) -> tuple[Complex, float]:
        """Solution of one harmonic and its relative residual."""
        from scipy.sparse.linalg import LinearOperator, gmres

        modes = self.modal.at_phase(phase)
        scale = float(np.linalg.norm(self.statics.solve(force, phase)))
        if scale == 0.0:
            return np.zeros_like(start), 0.0

        def preconditioned(values: Complex) -> Complex:
            moved = np.zeros(self.full.n_dofs, complex)
            moved[self.free] = values
            return self.statics.solve(self._dynamic(modes, moved, omega), phase)[self.free]

        size = len(self.free)
        operator = LinearOperator((size, size), preconditioned, dtype=complex)
        rest = self.statics.solve(force - self._dynamic(modes, start, omega), phase)[self.free]
        options: dict[str, Any] = {"rtol": 0.0, "atol": RESIDUAL * scale, "restart": 60}
        change, _ = gmres(operator, rest, maxiter=_MOST_ITERATIONS // 60, **options)
        found = start.copy()
        found[self.free] += change
        left = self.statics.solve(force - self._dynamic(modes, found, omega), phase)
        return found, float(np.linalg.norm(left)) / scale

    def _dynamic(self, modes: ModalModel, displacement: Complex, omega: float) -> Complex:
        """(K - w^2 M + i w C) u."""
        inertia = self.full.mass @ displacement
        resisted = _resistance(modes, omega) * self._pushed(modes, inertia)
        damped = self.full.mass @ self._expand(modes, resisted)
        found = self.full.stiffness @ displacement - omega**2 * inertia + damped
        return np.asarray(found + self._coriolis(displacement, inertia, omega))

    def _coriolis(self, displacement: Complex, inertia: Complex, omega: float) -> Complex | float:
        """i w W G u, from u and M u, with G = (M A + A M) / 2, A u the Coriolis accelerations at 1 rad/s."""
        if not self.modal.turns:
            return 0.0
        force = (self.full.mass @ coriolis_acceleration(displacement) + coriolis_acceleration(inertia)) / 2.0
        return np.asarray(1j * omega * angular_speed(self.full.speed_rpm) * force)

    def _expand(self, modes: ModalModel, coordinates: NDArray[Any]) -> NDArray[Any]:
        """Displacement (N,) of modal coordinates (m,)."""
        assert self.model.basis is not None
        return np.asarray(self.model.basis @ (modes.shapes @ coordinates))

    def _pushed(self, modes: ModalModel, force: NDArray[Any]) -> NDArray[Any]:
        """Modal forces (m,) of forces (N,) on the mesh."""
        assert self.model.basis is not None
        return np.asarray(modes.shapes.conj().T @ (self.model.basis.T @ force))

    def _coordinates(self, point: SolvedPoint) -> Complex:
        """Modal coordinates (H+1, m) of the reduced model."""
        contact = point.contact_force.reshape(len(point.harmonics), -1)
        return self._receptance(point).modal_response(point.omega, contact)[0]

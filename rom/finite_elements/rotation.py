"""The blade in steady rotation about the engine axis: static displacement, stiffness at speed, Coriolis forces.

Small vibrations about the static displacement u have the stiffness K_T(u) - W^2 M_yz: the tangent stiffness with its
initial-displacement and geometric (stress stiffening) parts, less the spin softening.

The static displacement is that with free contacts. The balance in the rotating frame is f_int(u) = W^2 (f_0 + M_yz
u), with the centrifugal force f_0 of the undeformed body at 1 rad/s and the mass M_yz of the y and z motions: the
force acts at the deformed position. Newton's method with the tangent K_T(u) - W^2 M_yz starts from the linear
solution. A tangent serves as long as the steps with it shrink fast: it costs as much as some ten evaluations of the
forces.

References
----------
K. J. Bathe, Finite Element Procedures, Prentice Hall (1996), sections 6.2 and 8.4.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rom.errors import FactorisationError, RomParameterError, require_between
from rom.finite_elements.assembly import UPPER, ElasticBody, stress_at_quadrature
from rom.finite_elements.discretisation import discretise
from rom.finite_elements.full_model import FullModel
from rom.finite_elements.material import Materials
from rom.linear_algebra.factorisation import Factor, analyse, factorise
from rom.linear_algebra.threads import one_blas_thread
from rom.units import angular_speed

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry.sector import SectorMesh
    from rom.finite_elements.full_model import FullModel

Array = NDArray[np.float64]
# Last step over the displacement, the largest components. Strains are small differences of displacements: an error of
# 1e-6 in the displacement of a thin blade still changes a frequency by 3e-5.
TOLERANCE = 1e-11
LARGEST_STRAIN = 0.1  # no blade and no law of linear elasticity goes so far
_ROUND_OFF = 1e-7  # steps below it that hardly shrink are round-off
_HARDLY = 0.5
_SHRINKS = 0.1
_MOST_TANGENTS = 12
_MOST_STEPS = 20  # with one tangent
_SMALLEST_PART = 1.0 / 64.0  # of the load in one step
EQUILIBRIA = ("nonlinear", "linear")


@dataclass(frozen=True)
class RotatingBody:
    """A clamped body and its inertia in rotation about the x axis."""

    body: ElasticBody  # the body, n nodes
    full: FullModel  # its matrices at rest
    pair_mass: Array  # (p,), mass of the pairs of nodes, kg, in the order of the pattern of the body
    free: NDArray[np.int64]  # (f,), dofs that are not clamped
    # (3n, f), T of the admissible displacements u = T z, in whose coordinates the balance is T^T r = 0; None: those
    # of the free dofs
    motion: csr_matrix | None = None
    springs: csr_matrix | None = None  # (3n, 3n), what holds bodies that contacts alone hold, N/m

    @classmethod
    def of(
        cls, body: ElasticBody, full: FullModel, motion: csr_matrix | None = None, springs: csr_matrix | None = None
    ) -> RotatingBody:
        """The body with its full model at rest."""
        n = len(full.positions)
        pairs = full.mass[::3][:, ::3].tocoo()  # the blocks of the mass are multiples of the identity
        mass = np.zeros(body.pattern.n_pairs)
        mass[np.searchsorted(body.pattern.keys, pairs.row.astype(np.int64) * n + pairs.col)] = pairs.data
        return cls(body, full, mass, np.setdiff1d(np.arange(full.n_dofs), full.fixed), motion, springs)

    def unbalance(self, displacement: Array, squared: float) -> tuple[Array, float]:
        """W^2 (f_0 + M_yz u) - f_int(u) on the coordinates (f,), N, and the largest strain; `squared` is W^2."""
        internal, strain = self.body.internal_force(displacement)
        arm = displacement.reshape(-1, 3) * (0.0, 1.0, 1.0)
        external = squared * (self.full.centrifugal + self.full.mass @ arm.ravel())
        if self.springs is not None:
            internal = internal + self.springs @ displacement
        return self.on_coordinates(external - internal), strain

    def at_rest(self) -> csr_matrix:
        """Stiffness at rest (3n, 3n), N/m, with the sparsity pattern of `stiffness`."""
        stored = self.full.stiffness
        if stored.nnz == 9 * self.body.pattern.n_pairs:
            return stored
        return self.stiffness(np.zeros(self.full.n_dofs), 0.0)

    def stiffness(self, displacement: Array, squared: float, stress: Sequence[Array] | None = None) -> csr_matrix:
        """K_T(u) - W^2 M_yz (3n, 3n), N/m: minus the derivative of the unbalance; `stress` as in `ElasticBody`."""
        blocks = self.body.tangent_blocks(displacement, stress)
        for direction in (1, 2):
            blocks[UPPER.index((direction, direction))] -= squared * self.pair_mass
        return self.body.pattern.symmetric_matrix(blocks)

    def on_coordinates(self, force: Array) -> Array:
        """Generalised forces (f,) of nodal forces (3n,)."""
        return force[self.free] if self.motion is None else np.asarray(self.motion.T @ force)

    def displacement(self, coordinates: Array) -> Array:
        """Displacements (3n,) of coordinates (f,)."""
        if self.motion is not None:
            return np.asarray(self.motion @ coordinates)
        displacement = np.zeros(self.full.n_dofs)
        displacement[self.free] = coordinates
        return displacement

    def projected(self, matrix: csr_matrix) -> csr_matrix:
        """A matrix (3n, 3n), with the springs, on the coordinates, (f, f)."""
        matrix = on_springs(matrix, self.springs)
        if self.motion is not None:
            return (self.motion.T @ matrix @ self.motion).tocsr()
        return matrix[self.free][:, self.free]


def on_springs(stiffness: csr_matrix, springs: csr_matrix | None) -> csr_matrix:
    """A stiffness with that of springs, where there are any."""
    return stiffness if springs is None else (stiffness + springs).tocsr()


class _Tangent:
    """Factors of matrices on the coordinates, analysed once where they have the same pattern."""

    def __init__(self, rotating: RotatingBody) -> None:
        self._rotating = rotating
        self._analysis = analyse(rotating.projected(rotating.at_rest()))

    def factor(self, matrix: csr_matrix | None = None) -> Factor:
        """Factor of a matrix (3n, 3n), that at rest by default. Raises FactorisationError."""
        if matrix is not None:
            projected = self._rotating.projected(matrix)
            if self._rotating.motion is None and self._rotating.springs is None:
                self._analysis.load(projected)
            else:  # a product or a sum of matrices may drop zeros: the pattern may be another
                self._analysis = analyse(projected)
        return self._analysis.factor()


def static_equilibrium(rotating: RotatingBody, squared: float) -> Array | None:
    """Displacement (3n,) in m at W^2 = `squared`; None where no equilibrium was found.

    The load is applied at once, and in smaller parts where that fails. Raises FactorisationError when the structure
    is not held.
    """
    tangent = _Tangent(rotating)
    linear = rotating.displacement(tangent.factor().solve(rotating.on_coordinates(rotating.full.centrifugal)))
    displacement, reached, part = squared * linear, 0.0, 1.0
    while reached < 1.0:
        target = min(reached + part, 1.0)
        start = target * squared * linear if reached == 0.0 else displacement * (target / reached)
        found = _newton(rotating, tangent, start, target * squared)
        if found is not None:
            displacement, reached = found, target
            continue
        part /= 2.0
        if part < _SMALLEST_PART:
            return None
    return displacement


def _newton(rotating: RotatingBody, tangent: _Tangent, start: Array, squared: float) -> Array | None:
    """The equilibrium near a displacement, by Newton's method; None where it does not converge."""
    displacement = start.copy()
    force, strain = rotating.unbalance(displacement, squared)
    for _ in range(_MOST_TANGENTS):
        if not strain < LARGEST_STRAIN:  # NaN too
            return None
        try:
            factor = tangent.factor(rotating.stiffness(displacement, squared))
        except FactorisationError:
            return None
        last = np.inf
        for _ in range(_MOST_STEPS):
            step = rotating.displacement(factor.solve(force))
            displacement += step
            force, strain = rotating.unbalance(displacement, squared)
            size = np.abs(step).max() / np.abs(displacement).max()
            if size < TOLERANCE or _HARDLY * last < size < _ROUND_OFF:
                return displacement
            if not size < _SHRINKS * last or not strain < LARGEST_STRAIN:
                break
            last = size
    return None


@one_blas_thread()
def stiffen_by_rotation(
    full: FullModel,
    sector: SectorMesh,
    material: Materials,
    speed_rpm: float,
    equilibrium: str = "nonlinear",
    motion: csr_matrix | None = None,
    springs: csr_matrix | None = None,
) -> FullModel:
    """The full model of a sector in steady rotation about the x axis, for small vibrations about its equilibrium.

    The contacts are free and the root is clamped; cut faces of a disk move as `motion` lets them. The static
    displacement u solves f_int(u) = W^2 (f_0 + M_yz u), W in rad/s; the stiffness becomes K_T(u) - W^2 M_yz, without
    Coriolis forces. Where `equilibrium` is "linear", u = W^2 K^-1 f_0 with small strains: an error of order W^4.

    Returns the model at speed, `full` itself at speed 0; with the springs its `centrifugal_displacement` is u / W^2.
    """
    _check(full, sector, speed_rpm, equilibrium, cut_faces_move=motion is not None)
    if speed_rpm == 0.0:
        return full
    discretisation, squared = discretise(sector, full.element), angular_speed(speed_rpm) ** 2
    rotating = RotatingBody.of(ElasticBody.of(discretisation, material), full, motion, springs)
    if equilibrium == "linear":
        displacement = squared * centrifugal_displacement(full, motion=motion, springs=springs)
        stress = stress_at_quadrature(discretisation, material, displacement)
        stiffness = rotating.stiffness(displacement, squared, stress)
    else:
        displacement = _found(rotating, speed_rpm)
        stiffness = rotating.stiffness(displacement, squared)
    borne = on_springs(stiffness, springs) @ displacement / squared  # what neighbours exert included
    force = np.where(np.isin(np.arange(full.n_dofs), rotating.free), borne, full.centrifugal)
    return replace(full, stiffness=stiffness, centrifugal=force, speed_rpm=float(speed_rpm))


def _check(full: FullModel, sector: SectorMesh, speed_rpm: float, equilibrium: str, *, cut_faces_move: bool) -> None:
    """Check what `stiffen_by_rotation` is given. Raises RomParameterError."""
    require_between("load", "speed_rpm", speed_rpm, -math.inf, math.inf, "must be a finite number (rev/min)")
    if equilibrium not in EQUILIBRIA:
        raise RomParameterError("load", "equilibrium", equilibrium, f"must be one of {', '.join(EQUILIBRIA)}")
    if speed_rpm == 0.0:
        return
    if full.speed_rpm != 0.0:
        raise RomParameterError("load", "speed_rpm", full.speed_rpm, "only a model at rest can be set in rotation")
    if not cut_faces_move and len(sector.node_sets.get("cyclic_right", ())):
        allowed = "must come with the motion of the cut faces of the disk (motion = static_motion(full, faces))"
        raise RomParameterError("load", "speed_rpm", speed_rpm, allowed)


def _found(rotating: RotatingBody, speed_rpm: float) -> NDArray[np.float64]:
    """Displacement (N,) of the static equilibrium at large displacements, m."""
    found = static_equilibrium(rotating, angular_speed(speed_rpm) ** 2)
    if found is None:
        allowed = f"a lower speed: no static equilibrium with strains below {100 * LARGEST_STRAIN:g} % was found"
        raise RomParameterError("load", "speed_rpm", speed_rpm, allowed)
    return found


def centrifugal_displacement(
    full: FullModel,
    motion: csr_matrix | None = None,
    springs: csr_matrix | None = None,
) -> NDArray[np.float64]:
    """Static displacement of a full model under its centrifugal force at 1 rad/s, with free contacts.

    At rest it is the linear one. At speed, times the speed squared, it is that of the equilibrium.

    Returns (N,): displacement of all dofs, m.
    """
    stiffness = on_springs(full.stiffness, springs)
    if motion is not None:
        factor = factorise((motion.T @ stiffness @ motion).tocsr())
        return np.asarray(motion @ factor.solve(motion.T @ full.centrifugal))
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    # In two steps, between which the matrix is freed: on a large mesh there is little memory beside the factor.
    factor = analyse(stiffness[free][:, free]).factor()
    displacement = np.zeros(full.n_dofs)
    displacement[free] = factor.solve(full.centrifugal[free])
    return displacement


def coriolis_acceleration(velocity: NDArray[Any]) -> NDArray[Any]:
    """2 w x v at 1 rad/s of velocities (3k,) or (3k, m), node-major x, y, z: 2 (0, v_z, -v_y) at each node.

    The ring turns towards +y, w = -e_x: blade j+1 meets a disturbance at rest before blade j, which is the phase
    +EO phi of an engine order.
    """
    nodal = velocity.reshape(len(velocity) // 3, 3, -1)
    acceleration = np.zeros_like(nodal)
    acceleration[:, 1], acceleration[:, 2] = 2.0 * nodal[:, 2], -2.0 * nodal[:, 1]
    return acceleration.reshape(velocity.shape)

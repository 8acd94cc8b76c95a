"""Linear segments of a curve, on which no contact changes its state, followed without iterations.

The contact forces are those of linear springs k, so that the balance is (I + G k) d = d_lin in each harmonic: one
linear system for each frequency. A slider that static traction pulls off its origin stands where the vibration leaves
it, so that it never slips again: the vibration is the same, harmonic 0 alone takes a few iterations.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.aft import AFTContact
from nonlinear.contact.fourier import ComplexArray, smallest_values, to_complex
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array, ContactForces, ContactParameters
from nonlinear.continuation.response_quantities import amplitude_derivative
from nonlinear.continuation.solution_point import LinearState, Metric, SolutionPoint
from nonlinear.continuation.zero_bracket import closed_bracket
from nonlinear.harmonic_balance.newton_decisions import SOFT
from nonlinear.harmonic_balance.residual import HarmonicBalance, counted_at_contacts
from rom.cyclic.contact_springs import SpringSupportedMotion, contact_springs
from rom.cyclic.receptance import RelativeReceptance

if TYPE_CHECKING:
    from nonlinear.continuation.response_kernels import SprungHarmonic


@dataclass(frozen=True)
class LinearMotion:
    """A vibration and its derivative in w."""

    # `displacement`, `derivative`: (2H+1, n_c, 3), relative displacement and its derivative
    displacement: Array
    derivative: Array
    coordinates: ComplexArray  # (m,), modal coordinates of the first excited harmonic and their derivative
    coordinates_derivative: ComplexArray  # (m,), modal coordinates of the first excited harmonic and their derivative
    settled: bool  # whether the sliders have found a place

    def growth(self, output: Array | ComplexArray) -> float:
        """Derivative in w of the amplitude ``|x^(h)|`` of an output, (m,) in modal coordinates."""
        first = output @ self.coordinates
        size = abs(first)
        return float((first.conjugate() * (output @ self.coordinates_derivative)).real / size) if size > 0.0 else 0.0


@dataclass(frozen=True)
class LinearSegmentSystem:
    """The linear equations of a `balance` in one contact state: every node open, or closed and stuck or sliding.

    Quantities that do not depend on the frequency are cached: a frequency costs one small complex system (none if all
    nodes are open), the test of the contact state one matrix product.
    """

    balance: HarmonicBalance
    contact: ContactParameters
    state: LinearState
    at_origin: bool = False  # whether sliders that have left their origin count as slipping

    @cached_property
    def held(self) -> NDArray[np.bool_]:
        """Closed nodes that friction can hold, (n_c,)."""
        return self.state.pressed & self.contact.can_stick

    @cached_property
    def springs(self) -> Array:
        """Contact springs, (n_c, 3), N/m."""
        tangential = np.where(self.held, self.contact.tangential_stiffness, 0.0)
        normal = np.where(self.state.pressed, self.contact.normal_stiffness, 0.0)
        return contact_springs(normal.size, normal, tangential)

    @cached_property
    def static(self) -> Array:
        """Harmonic 0 with the sliders at their origin, (n_c, 3)."""
        if self.balance.frozen_static is not None:
            return self.balance.frozen_static
        weights, flexibility = self._weighted
        system = weights + flexibility * self.springs.reshape(-1)
        return np.asarray(np.linalg.solve(system, self._static_response(self._rest_force))).reshape(-1, 3)

    @cached_property
    def _at_rest(self) -> RelativeReceptance:
        """The receptance of harmonic 0, where nothing moves that Coriolis forces act on."""
        receptance = self.balance.receptance
        return replace(receptance, harmonics=(0,), modal=receptance.modal.without_coriolis)

    @cached_property
    def _weighted(self) -> tuple[Array, Array]:
        """Weights of harmonic 0 (see `HarmonicBalance.weighted`), and these times its flexibility."""
        motions, rest = self.balance.floating_motions, self._at_rest
        weights = counted_at_contacts(np.eye(len(motions)), motions)
        if not rest.floating:
            return weights, rest.matrix(0.0)[0].real
        return weights, (self._weighted_motion / rest.waves.total_stiffness[0].real) @ rest.relative[0].real.T

    @cached_property
    def _weighted_motion(self) -> Array:
        """Weighted relative motion of the modes of harmonic 0, that of soft supports without round-off."""
        motion, motions = self._at_rest.relative[0].real, self.balance.floating_motions
        found = counted_at_contacts(motion, motions)
        found[:, : self._at_rest.floating] = SOFT * motion[:, : self._at_rest.floating]
        return found

    def _static_response(self, force: Array) -> Array:
        """Weighted harmonic 0 under contact forces (n_c, 3)."""
        given = force.reshape(1, -1).astype(complex)
        if not self._at_rest.floating:
            return np.asarray(self._at_rest.response(0.0, given)[0][0].real)
        return self._weighted_motion @ self._at_rest.modal_response(0.0, given)[0][0].real

    def _settle(self, rows: Array) -> bool:
        """Change harmonic 0 of a motion and its derivative (2, 2H+1, n_c, 3) to that with the sliders in their place.

        The place is that of the contact element, which the vibration decides on. Newton's method; False if it fails.
        """
        motion, derivative = rows
        weights, flexibility = self._weighted
        last = math.inf
        for _ in range(MOST_ITERATIONS):
            forces = self.balance.forces_of(motion)
            of_static = forces.jacobian[:, :, :, 0, 0]
            nodes = [flexibility[:, 3 * k : 3 * k + 3] @ block for k, block in enumerate(of_static)]
            matrix = weights - np.concatenate(nodes, axis=1)
            moving = np.einsum("kabj,jkb->ka", forces.jacobian[:, :, :, 0, 1:], derivative[1:]).reshape(-1)
            residual = weights @ motion[0].reshape(-1) - self._static_response(forces.force[0])
            try:
                found = np.linalg.solve(matrix, np.stack([residual, flexibility @ moving], axis=1)).T
            except np.linalg.LinAlgError:
                return False
            correction, derivative[0] = found.reshape(2, *motion[0].shape)
            motion[0] -= correction
            change = float(np.abs(correction).max() / np.abs(motion).max())
            if change <= SETTLED or (last <= ROUND_OFF and change >= STAGNATES * last):
                return True
            last = change
        return False

    @cached_property
    def _rest_force(self) -> Array:
        """The force without displacement, (n_c, 3): kt w0 and N0 - N."""
        force = -self.springs * self.contact.from_slider_origin(np.zeros((1, *self.springs.shape)))[0]
        force[:, 2] = self.contact.preload - np.where(self.state.pressed, self.contact.initial_load, 0.0)
        return force

    @property
    def harmonics(self) -> tuple[int, ...]:
        """Harmonics of the excitation."""
        return self.balance.receptance.excited_harmonics

    @cached_property
    def _receptances(self) -> tuple[RelativeReceptance, ...]:
        """The receptance of each excited harmonic."""
        return tuple(replace(self.balance.receptance, harmonics=(h,)) for h in self.harmonics)

    @cached_property
    def _sprung(self) -> tuple[ComplexArray, ...]:
        """Modal forces of unit displacements through the springs, (m, 3 n_c) for each excited harmonic."""
        return tuple(receptance.adjoint[0] * self.springs.reshape(-1) for receptance in self._receptances)

    @cached_property
    def _structures(self) -> "tuple[SprungHarmonic, ...]":
        """The structure in each excited harmonic, for the kernel.

        Empty for large faces, which have a faster way, and for a receptance that is not the modal sum.
        """
        from nonlinear.continuation.response_kernels import SprungHarmonic

        if self.balance.receptance.large or type(self.balance.receptance) is not RelativeReceptance:
            return ()
        return tuple(
            SprungHarmonic(
                relative=np.ascontiguousarray(receptance.relative[0]),
                adjoint=np.ascontiguousarray(receptance.adjoint[0]),
                springs=np.ascontiguousarray(self.springs.reshape(-1)),
                force=receptance.force_of_waves[0],
                stiffness=np.ascontiguousarray(receptance.waves.total_stiffness[0], dtype=complex),
                damping=np.ascontiguousarray(receptance.waves.total_damping[0], dtype=complex),
                inertia=receptance.waves.inertia,
                harmonic=float(h),
            )
            for h, receptance in zip(self.harmonics, self._receptances, strict=True)
        )

    def motion(self, omega: float, static: Array | None = None) -> LinearMotion:
        """The motion at `omega` (rad/s): (I + G k) d = d_lin in each excited harmonic.

        `static`: harmonic 0 nearby, where the search for the place of the sliders starts.
        """
        found = [self._harmonic(index, omega) for index in range(len(self.harmonics))]
        rows = np.zeros((2, 2 * self.balance.n_harmonics + 1, *self.static.shape))
        rows[0, 0] = self.static
        for h, (motion, change, _, _) in zip(self.harmonics, found, strict=True):
            for row, values in zip(rows, (motion, change), strict=True):
                row[2 * h - 1] = values.real.reshape(self.static.shape)
                row[2 * h] = values.imag.reshape(self.static.shape)
        settled = True
        if self.balance.frozen_static is None and self.moved(rows[0]).any():
            rows[0, 0] = self.static if static is None else static
            settled = self._settle(rows)
        return LinearMotion(rows[0], rows[1], *found[0][2:], settled)

    def _harmonic(self, index: int, omega: float) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
        """Relative motion and modal coordinates of one harmonic, each with its derivative in w behind it."""
        if self._structures:
            from nonlinear.continuation.response_kernels import sprung_motion

            found: tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]
            found = sprung_motion(self._structures[index], float(omega))
            return found
        receptance, sprung = self._receptances[index], self._sprung[index]
        relative, force = receptance.relative[0], receptance.force_of_waves[0]
        value, value_derivative = (row[0] for row in receptance.denominators(omega))
        modal = force / value
        motion = relative @ modal
        if not self.springs.any():
            modal_derivative = -value_derivative * modal / value
            return motion, relative @ modal_derivative, modal, modal_derivative
        system = SpringSupportedMotion(receptance.matrix(omega)[0] * self.springs.reshape(-1))
        motion = system.solve(motion)
        modal = (force - sprung @ motion) / value
        modal_derivative = -value_derivative * modal / value
        change = system.solve(relative @ modal_derivative)
        return motion, change, modal, modal_derivative - sprung @ change / value

    def output_shape(self, name: str) -> Array | ComplexArray:
        """An output (m,) in the modal coordinates of the first excited harmonic."""
        shapes = self.balance.receptance.output_of_waves(name)
        return shapes if shapes.ndim == 1 else shapes[self.harmonics[0]]

    def margin(self, displacement: Array) -> float:
        """Distance (m) of a displacement from the nearest change of state; negative beyond it.

        Sliders are where the vibration leaves them: a node slips if no place between their limits is left.
        """
        normal, sliders = self._distances(displacement)
        in_cone = self._distances_in_cone(displacement, of_static=float(self.at_origin))
        each = sliders if self.at_origin else sliders.mean(axis=0)
        return float(min(normal.min(), each.min(initial=np.inf), in_cone.min(initial=np.inf)))

    def room(self, motion: LinearMotion) -> float:
        """The same of a motion of the system, which has none where the sliders have found no place."""
        return self.margin(motion.displacement) if motion.settled else -1.0

    def moved(self, displacement: Array) -> NDArray[np.bool_]:
        """Which limits of the stuck sliders their origins would exceed, so that they have moved; of any shape."""
        return np.concatenate([self._distances(displacement)[1].ravel() < 0.0, self.moved_in_cone(displacement)])

    def moved_in_cone(self, displacement: Array) -> NDArray[np.bool_]:
        """The same of the stuck nodes under the friction cone."""
        return self._distances_in_cone(self.contact.from_slider_origin(displacement)) < 0.0

    def _distances(self, displacement: Array) -> tuple[Array, Array]:
        """How far nodes are from opening or closing (n_c,), sliders at their origin from their limits (2, .), in m.

        For one harmonic in closed form: c_0 + ``|c_1|`` is the largest value of c_0 + Re c_1 exp(i theta).
        """
        offset, of_static, swings = self._conditions
        displacement = self.contact.from_slider_origin(displacement)
        if self.harmonics != (1,):
            motion = to_complex(displacement.reshape(len(displacement), -1))[: self.harmonics[-1] + 1]
            coefficients = motion @ of_static.T
            coefficients[0] += offset
            least = np.asarray(smallest_values(coefficients))
        else:
            rows = displacement[:3].reshape(3, -1)
            moved = rows[1:] @ swings.T
            least = offset + of_static @ rows[0] - np.hypot(moved[0], moved[1])
        nodes = self.held.size
        return least[:nodes], least[nodes:].reshape(2, -1)

    @cached_property
    def _conditions(self) -> tuple[Array, Array, Array]:
        """Conditions of the contact state, one in each row: offset + of_static d_0 - ``|swings d_1|`` >= 0."""
        sign, stiffness = np.where(self.state.pressed, 1.0, -1.0), self.contact.normal_stiffness
        per_metre = 1.0 / np.where(stiffness > 0.0, stiffness, 1.0)
        at_rest = self.contact.initial_load
        nodes, normal = np.arange(sign.size), 3 * np.arange(sign.size) + 2
        of_static, swings = np.zeros((2, sign.size, 3 * sign.size))
        of_static[nodes, normal], swings[nodes, normal] = sign * stiffness * per_metre, stiffness * per_metre
        offsets, rows, moving = [sign * at_rest * per_metre], [of_static], [swings]
        held = np.flatnonzero(self.held & ~self.contact.cone)
        reach = self.contact.friction[held] / self.contact.tangential_stiffness[held]
        which = np.arange(held.size)
        for axis, way in ((0, 1.0), (1, 1.0), (0, -1.0), (1, -1.0)):
            of_static, swings = np.zeros((2, held.size, 3 * sign.size))
            of_static[which, 3 * held + 2], of_static[which, 3 * held + axis] = reach * stiffness[held], -way
            swings[which, 3 * held + 2], swings[which, 3 * held + axis] = -way * reach * stiffness[held], 1.0
            offsets, rows, moving = [*offsets, reach * at_rest[held]], [*rows, of_static], [*moving, swings]
        return np.concatenate(offsets), np.concatenate(rows), np.concatenate(moving)

    @cached_property
    def _held_in_cone(self) -> NDArray[np.int64]:
        """Stuck nodes under the friction cone."""
        return np.flatnonzero(self.held & self.contact.cone)

    def _distances_in_cone(self, displacement: Array, of_static: float = 1.0) -> Array:
        """Distances of the stuck nodes from slip under the cone law, by bounds of motion and normal load, (.,).

        `of_static`: the part of the static displacement that the sliders have not followed.
        """
        held, contact = self._held_in_cone, self.contact
        if not held.size:
            return np.empty(0)
        harmonic = np.abs(displacement[1, held] + 1j * displacement[2, held])
        for h in range(2, self.harmonics[-1] + 1):
            harmonic = harmonic + np.abs(displacement[2 * h - 1, held] + 1j * displacement[2 * h, held])
        stiffness = contact.normal_stiffness[held]
        mean = contact.unclipped_load(displacement[0, :, 2])[held]
        farthest = np.linalg.norm(of_static * np.abs(displacement[0, held, :2]) + harmonic[:, :2], axis=1)
        reach = contact.friction[held] / contact.tangential_stiffness[held]
        return np.asarray(reach * (mean - stiffness * harmonic[:, 2]) - farthest)

    def forces(self, displacement: Array) -> ContactForces:
        """Contact forces of a motion of the system, the same as those of the contact element."""
        if self.moved(displacement).any():
            return self.balance.forces_of(displacement)
        force = -self.springs * displacement
        force[0] += self._rest_force
        still = not displacement[1:, :, :2].any()
        return ContactForces(force, self._jacobian, self._worst_at_rest if still else self._worst)

    @cached_property
    def _jacobian(self) -> Array:
        rows = np.arange(2 * self.balance.n_harmonics + 1)
        jacobian = np.zeros((self.springs.shape[0], 3, 3, rows.size, rows.size))
        for axis in range(3):
            jacobian[:, axis, axis, rows, rows] = -self.springs[:, axis, None]
        return jacobian

    @cached_property
    def _worst_at_rest(self) -> NDArray[np.int64]:
        return np.where(self.state.pressed, STICK, LIFT_OFF).astype(np.int64)

    @cached_property
    def _worst(self) -> NDArray[np.int64]:
        sliding = (self.contact.tangential_stiffness > 0.0) & (self.contact.friction == 0.0)
        return np.where(self.state.pressed & sliding, SLIP, self._worst_at_rest)


MOST_ITERATIONS = 20  # of harmonic 0
SETTLED = 1e-13  # change of it, as a part of the motion, at which they end
ROUND_OFF, STAGNATES = 1e-9, 0.1  # they also end where one below the first is not followed by one so much smaller
NEGLIGIBLE_HARMONICS = 1e-12  # higher harmonics below this part of the displacement are round-off


@dataclass(frozen=True)
class LinearSegments:
    """The linear solutions of a balance: every node open, or pressed and stuck, its slider where vibration leaves it.

    A node without friction slides. A node with a friction cone counts as stuck where bounds of its tangential motion
    and of its load imply it; these fail a little before the node slips.
    """

    balance: HarmonicBalance  # the equations
    contact: ContactParameters  # parameters of the contact nodes
    # whether only those are meant whose motion is also that of time samples: these know the place of a slider at the
    # samples alone. For a perturbation, in which it stands still, the place does not matter
    as_sampled: bool = True
    _systems: dict[bytes, LinearSegmentSystem] = field(default_factory=dict, init=False, repr=False, compare=False)

    def system(self, state: LinearState) -> LinearSegmentSystem:
        """The equations in one state of the contacts."""
        key = state.pressed.tobytes()
        if key not in self._systems:
            at_origin = self.as_sampled and isinstance(self.balance.element, AFTContact)
            self._systems[key] = LinearSegmentSystem(self.balance, self.contact, state, at_origin)
        return self._systems[key]

    def uniform(self) -> tuple[LinearSegmentSystem, LinearSegmentSystem]:
        """All contacts open, and all pressed together."""
        every = np.ones(self.balance.n_contacts, dtype=bool)
        return self.system(LinearState(~every)), self.system(LinearState(every))

    def state_at(self, point: SolutionPoint) -> LinearState | None:
        """The linear state of a solved point: known, or that of its motion; None where a node slips."""
        if point.linear is not None:
            return point.linear
        if (self.contact.can_stick & (point.contact.state == SLIP)).any():
            return None
        return self.state(point.displacement)

    def state(self, displacement: Array) -> LinearState | None:
        """The linear state of a motion (2H+1, n_c, 3); None if a contact opens, closes or slips in it."""
        highest = self.balance.receptance.excited_harmonics[-1]
        if displacement.shape[0] > 2 * highest + 1:
            scale = float(np.abs(displacement).max())
            if np.abs(displacement[2 * highest + 1 :]).max() > NEGLIGIBLE_HARMONICS * scale:
                return None
        load = self.contact.load_coefficients(displacement)
        if highest > 1:
            return self._state_of_several(displacement, load[0] > 0.0)
        mean, amplitude = load[0], np.hypot(load[1], load[2])
        if (np.abs(mean) < amplitude).any():
            return None
        state = LinearState(mean > 0.0)
        return state if self.system(state).margin(displacement) >= 0.0 else None

    def _state_of_several(self, displacement: Array, pressed: NDArray[np.bool_]) -> LinearState | None:
        """As `state`, for several harmonics; those of them that are not excited must be negligible too."""
        excited = self.balance.receptance.excited_harmonics
        others = [h for h in range(1, excited[-1]) if h not in excited]
        rows = [row for h in others for row in (2 * h - 1, 2 * h)]
        scale = float(np.abs(displacement).max())
        if rows and np.abs(displacement[rows]).max() > NEGLIGIBLE_HARMONICS * scale:
            return None
        state = LinearState(pressed)
        return state if self.system(state).margin(displacement) >= 0.0 else None


SHORTEST_STEP = 1e-10  # relative to the frequency; a shorter step means that the end of the segment is reached
END_TOLERANCE = 1e-14


@dataclass(frozen=True)
class LinearSegmentSteps:
    """Follows linear solutions in the frequency."""

    segments: LinearSegments  # the linear solutions
    metric: Callable[[Array], Metric]  # scales at an unknown (n,)
    output: str  # name of the output whose amplitude is recorded

    def step(self, point: SolutionPoint, step: float) -> SolutionPoint | None:
        """The point about `step` beyond `point` on its linear segment, or the end of the segment if that is nearer.

        None if `point` is on no linear segment, or at its end. The arc length of the new point is its distance along
        the tangent; its own `step` is the one made.
        """
        state = self.segments.state_at(point)
        if state is None:
            return None
        system = self.segments.system(state)
        omega = point.omega + step * point.tangent[1]
        static = point.displacement[0]
        motion = system.motion(omega, static)
        margin = system.room(motion)
        if margin < 0.0:
            omega = _end(system, point, (omega, margin))
            if abs(omega - point.omega) <= SHORTEST_STEP * point.omega:
                return None
            motion = system.motion(omega, static)
        unknown = self.segments.balance.unknown(motion.displacement)
        length = point.metric.product((unknown - point.unknown, omega - point.omega), point.tangent)
        direction = math.copysign(1.0, point.tangent[1])
        return self._point(system, motion, omega, (direction, point.arc + length, length))

    def start(self, omega: float, direction: float, first_step: float) -> SolutionPoint | None:
        """The linear solution at `omega` (rad/s), all contacts open or all stuck; None if neither is a solution.

        `direction`: +1 or -1, the direction of the branch in frequency.
        """
        for system in self.segments.uniform():
            motion = system.motion(omega)
            found = self.segments.state(motion.displacement) if motion.settled else None
            if found is not None and np.array_equal(found.pressed, system.state.pressed):
                return self._point(system, motion, omega, (direction, 0.0, first_step))
        return None

    def _point(
        self, system: LinearSegmentSystem, motion: LinearMotion, omega: float, record: tuple[float, float, float]
    ) -> SolutionPoint:
        """The solved point; `record`: direction, arc and step. A stable linear structure has det dR/dx > 0."""
        direction, arc, step = record
        balance = system.balance
        unknown, dx_domega = balance.unknown(motion.displacement), balance.unknown(motion.derivative)
        metric = self.metric(unknown)
        tangent = metric.unit((direction * dx_domega, direction))
        point = SolutionPoint(
            balance=balance,
            unknown=unknown,
            parameter=omega,
            tangent=tangent,
            metric=metric,
            contact=system.forces(motion.displacement),
            jacobian_sign=1,
            bordered_sign=int(direction),
            iterations=0,
            arc=arc,
            step=step,
            dA_ds=tangent[1] * motion.growth(system.output_shape(self.output)),
            linear=system.state,
        )
        if system.harmonics == (1,):
            return point
        return replace(point, dA_ds=amplitude_derivative(point, self.output))


def _end(system: LinearSegmentSystem, inside: SolutionPoint, outside: tuple[float, float]) -> float:
    """The last frequency (rad/s) inside a segment, to round-off; `outside`: one beyond it and the margin there."""

    def margin(omega: float) -> float:
        return system.room(system.motion(omega, inside.displacement[0]))

    least = margin(inside.omega)
    if least <= 0.0:
        return inside.omega
    return closed_bracket(margin, (inside.omega, least), outside, END_TOLERANCE * inside.omega)[0][0]

"""Slider memory: what a perturbation that grows as e^(lambda t) adds to the contact Jacobian of a periodic one.

These are the hereditary terms of the linearised hysteresis: a sticking slider stands where an earlier instant left
it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray, basis_table
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array, ContactParameters
from nonlinear.contact.return_map import Integers
from nonlinear.stability.contact_kernels import cone_periodic_response, stick_integrals, stick_intervals
from nonlinear.stability.modal_condensation import Matrix

REPEAT_TOLERANCE = 1e-12  # of the largest motion: a cycle that comes back this near is the steady one


T = TypeVar("T")


def last_two(known: dict[complex, T], sigma: complex, made: Callable[[], T]) -> T:
    """What is made at `sigma`, kept with that of the sigma before: a shift and the eigenvalue sought near it."""
    known[sigma] = found = known.pop(sigma) if sigma in known else made()
    if len(known) > 2:
        del known[next(iter(known))]
    return found


class NodeMemory(Protocol):
    """A memory that changes the contact Jacobian of each of its nodes as a whole."""

    @property
    def node(self) -> Integers:
        """The nodes, (M,)."""
        ...

    def jacobian(self, sigma: complex) -> tuple[Matrix, Matrix]:
        """The contact Jacobian at `sigma` beyond that at 0, and its derivative.

        Shapes: returns `change, derivative` (M, 2, 3, 2H+1, 2H+1).
        """
        ...


@dataclass(frozen=True)
class ConeSliderMemory:
    """The sliders of M nodes over N instants of a cycle, linearised.

    Under the perturbation e^(sigma theta) p(theta) of a contact motion, sigma = lambda / omega, its slider moves by
    e^(sigma theta) dw(theta),

        dw_k = e^(-sigma 2 pi / N) Phi_k dw_(k-1) + Gamma_k p_k,

    Phi = 1 in stick, 0 in lift-off and ratio (1 - e e^T) in slip along e, ratio = mu N / kt over the length of the
    trial deflection: the direction of slip forgets slowly.
    """

    node: NDArray[np.int64]  # (M,), the nodes
    transition: Array  # (M, N, 2, 2), phi
    input_matrix: Array  # (M, N, 2, 3), gamma
    stiffness: Array  # (M,), kt, N/m
    table: Array  # (N, 2H+1), basis functions at the instants

    def jacobian(self, sigma: complex) -> tuple[Matrix, Matrix]:
        """See `NodeMemory`."""
        value, derivative = last_two(self._kept, sigma, lambda: self._coefficients(sigma))
        change = value - self._periodic
        return (change, derivative) if isinstance(sigma, complex) else (change.real, derivative.real)

    @cached_property
    def _kept(self) -> dict[complex, tuple[Matrix, Matrix]]:
        return {}

    @cached_property
    def _periodic(self) -> Matrix:
        """The coefficients at sigma = 0."""
        return self._coefficients(0.0)[0]

    def _coefficients(self, sigma: complex) -> tuple[Matrix, Matrix]:
        """Fourier coefficients of kt dw for unit coefficients of p, and their derivative, (M, 2, 3, 2H+1, 2H+1)."""
        count, (n, size) = self.node.size, self.table.shape
        step = 2.0 * np.pi / n
        decay = complex(np.exp(-sigma * step))
        weights = (self.table * np.append(1.0, np.full(size - 1, 2.0)) / n).T
        result = np.empty((count, size, 12 * size), dtype=complex)
        response = np.empty((n, 12 * size), dtype=complex)
        for k in range(count):
            cone_periodic_response(self.transition[k], self.input_matrix[k], self.table, decay, step, response)
            result[k] = (self.stiffness[k] * weights @ response.view(float)).view(complex)
        both = result.reshape(count, size, 2, 2, 3, size).transpose(2, 0, 3, 4, 1, 5)
        return both[0], both[1]


def cone_slider_memory(
    parameters: ContactParameters, table: Array, motion: Array, speed: Array
) -> ConeSliderMemory | None:
    """Memory of the nodes under the cone; None if each of the sliders sticks or is open throughout.

    Shapes: `table` (N, 2H+1), `motion` (n_c, 3, N), `speed` (n_c, 3, N).
    """
    from nonlinear.contact.return_map import MAX_PERIODS, cone_return_map

    p, n = parameters, table.shape[0]
    load = p.normal_load(motion[:, 2].T).T
    found = []
    for k in np.flatnonzero(p.cone & p.can_stick & np.any(load > 0.0, axis=1)):
        limit, kt = p.friction[k] * load[k], float(p.tangential_stiffness[k])
        plane, traction = np.ascontiguousarray(motion[k, :2].T), np.empty((n, 2))
        state = np.empty(n, dtype=np.int64)
        cone_return_map(plane, limit, kt, MAX_PERIODS, REPEAT_TOLERANCE * float(np.abs(plane).max()), state, traction)
        if np.all(state == STICK):
            continue
        limit_dn = p.friction[k] * p.normal_stiffness[k] / kt
        found.append((k, *_linearised(plane, speed[k], limit / kt, limit_dn, state, traction / kt)))
    if not found:
        return None
    node, transition, gamma = zip(*found, strict=True)
    index = np.array(node, dtype=np.int64)
    return ConeSliderMemory(index, np.array(transition), np.array(gamma), p.tangential_stiffness[index], table)


def _linearised(
    plane: Array, speed: Array, limit: Array, limit_dn: float, state: NDArray[np.int64], deflection: Array
) -> tuple[Array, Array]:
    """Phi (N, 2, 2) and Gamma (N, 2, 3) of one slider.

    Where contact begins, the slider starts from dw = du - u' dd_n / d_n'.
    Shapes: `plane` (N, 2), `speed` (3, N), `limit` (N,), `state` (N,), `deflection` (N, 2).
    """
    n = len(plane)
    before = np.roll(plane - deflection, 1, axis=0)
    trial = plane - before
    length = np.linalg.norm(trial, axis=1)
    along = trial / np.where(length > 0.0, length, 1.0)[:, None]
    ratio = np.divide(limit, length, out=np.zeros(n), where=length > 0.0)
    across = np.eye(2) - along[:, :, None] * along[:, None, :]
    slips, sticks = (state == SLIP)[:, None, None], (state == STICK)[:, None, None]
    transition = np.where(slips, ratio[:, None, None] * across, np.where(sticks, np.eye(2), 0.0))
    gamma = np.zeros((n, 2, 3))
    gamma[:, :, :2] = np.eye(2) - transition
    gamma[:, :, 2] = np.where(slips[:, 0], -limit_dn * along, 0.0)
    touches = (state != LIFT_OFF) & (np.roll(state, 1) == LIFT_OFF)
    closing = speed[2, touches]
    start = np.zeros((closing.size, 2, 3))
    start[:, :, :2] = np.eye(2)
    start[:, :, 2] = -(speed[:2, touches] / np.where(closing == 0.0, np.inf, closing)).T
    gamma[touches] += transition[touches] @ start
    transition[touches] = 0.0
    return transition, gamma


SAMPLES = 512


@dataclass(frozen=True)
class SliderMemory:
    """The M stick intervals of a cycle in which an earlier instant theta_s has set the slider.

    There T = kt (u(theta) - w(theta_s)), and a perturbation of it

        dT(theta) = kt (du(theta) - dw(theta_s)),    dw = du + r dd_n,

    r = -+ mu kn / kt where slip ended, r = -u' / d_n' at re-contact. The Jacobian of the contact element is that of a
    periodic perturbation. One that grows as e^(lambda t) was smaller at theta_s, by
    e^(-sigma (theta - theta_s)), sigma = lambda / omega. For nodes of two sliders.
    """

    # `node`, `direction`: (M,), the slider
    node: Integers
    direction: Integers
    # `start`, `length`: (M,), theta_s and the length of the stick interval, rad
    start: Array
    length: Array
    dw_dn: Array  # (M,), r, derivative of the slider position in the normal displacement
    stiffness: Array  # (M,), kt, N/m
    n_harmonics: int  # H

    @cached_property
    def _powers(self) -> Matrix:
        """e^(i h theta_s), h = -H .. H: (M, 2H+1)."""
        return np.exp(1j * self.start[:, None] * np.arange(-self.n_harmonics, self.n_harmonics + 1))

    @cached_property
    def basis(self) -> Array:
        """Basis functions at theta_s, (M, 2H+1): times the real Fourier coefficients of a motion, its value there."""
        return np.asarray(_basis(self._powers).real)

    def force(self, sigma: complex) -> tuple[Matrix, Matrix]:
        """Real Fourier coefficients of the contact force -dT that dw(theta_s) = 1 makes, beyond those at sigma = 0.

        They are those of kt (e^(-sigma (theta - theta_s)) - 1) over the stick interval.
        Shapes: returns `force, derivative` (M, 2H+1).
        """
        force, change = (self._weights * _basis(part) for part in self._moments(sigma))
        return (force, change) if isinstance(sigma, complex) else (force.real, change.real)

    def force_in_harmonics(self, sigma: complex) -> tuple[ComplexArray, ComplexArray]:
        """As `force`, as amplitudes of the harmonics 0, 1, -1, 2, -2, ...: (M, 2H+1).

        That of the harmonic h is kt / (2 pi) times the integral of e^(-i h theta) times the force.
        """
        half = self.stiffness[:, None] / (2.0 * np.pi)
        force, change = (half * part[:, self._opposite] for part in self._moments(sigma))
        return force, change

    def _moments(self, sigma: complex) -> tuple[ComplexArray, ComplexArray]:
        """Integrals of e^(i h theta) times the force of a unit spring, h = -H .. H, and derivatives: (M, 2H+1)."""
        value, derivative = self._integral(sigma)
        return self._powers * (value - self._integral_of_motion), self._powers * -derivative

    @cached_property
    def _opposite(self) -> Integers:
        """Columns of -h among -H .. H, for h = 0, 1, -1, 2, -2, ..."""
        order = np.arange(1, self.n_harmonics + 1)
        return self.n_harmonics - np.append(0, np.stack([order, -order], axis=1).ravel())

    @cached_property
    def _weights(self) -> Array:
        """kt, over pi (2 pi for the mean): (M, 2H+1)."""
        return np.asarray(self.stiffness[:, None] * np.append(0.5, np.ones(2 * self.n_harmonics)) / np.pi)

    @cached_property
    def _turns(self) -> Matrix:
        """e^(i h length), h = -H .. H: (M, 2H+1)."""
        return np.exp(1j * self.length[:, None] * np.arange(-self.n_harmonics, self.n_harmonics + 1))

    @cached_property
    def _integral_of_motion(self) -> Matrix:
        """`_integral` at sigma = 0."""
        return self._integral(0.0)[0]

    def _integral(self, sigma: complex) -> tuple[Matrix, Matrix]:
        """Integral of e^(rate t), rate = i h - sigma, over t = 0 .. length, its derivative in the rate: (M, 2H+1)."""
        value, derivative = np.empty((2, *self._turns.shape), dtype=complex)
        stick_integrals(self._turns, self.length, complex(sigma), value, derivative)
        return value, derivative


def _basis(powers: Matrix) -> Matrix:
    """Values of 1, cos, -sin, cos 2, ... from those of e^(i h theta), h = -H .. H, linear in these: (M, 2H+1)."""
    middle = powers.shape[1] // 2
    result = np.empty_like(powers)
    positive, negative = powers[:, middle + 1 :], powers[:, :middle][:, ::-1]
    result[:, 0] = powers[:, middle]
    result[:, 1::2] = 0.5 * (positive + negative)
    result[:, 2::2] = 0.5j * (positive - negative)
    return result


@dataclass(frozen=True)
class JoinedMemory:
    """The sliders of nodes under both laws, or two sliders a node, as a memory of whole nodes."""

    sliders: SliderMemory
    cone: ConeSliderMemory | None = None

    @cached_property
    def node(self) -> Integers:
        """The nodes, (M,): first those of two sliders."""
        return self._of_sliders if self.cone is None else np.concatenate([self._of_sliders, self.cone.node])

    @cached_property
    def _of_sliders(self) -> Integers:
        return np.unique(self.sliders.node)

    def jacobian(self, sigma: complex) -> tuple[Matrix, Matrix]:
        """See `NodeMemory`: of two sliders P Q^T of each stick interval, dw(theta_s) = du + r dd_n makes P."""
        found = [self._by_node(values) for values in self.sliders.force(sigma)]
        if self.cone is not None:
            found = [np.concatenate(pair) for pair in zip(found, self.cone.jacobian(sigma), strict=True)]
        return found[0], found[1]

    def _by_node(self, force: Matrix) -> Matrix:
        """Sums over the intervals of each node."""
        sliders, size = self.sliders, force.shape[1]
        result = np.zeros((self._of_sliders.size, 2, 3, size, size), dtype=force.dtype)
        place, blocks = np.searchsorted(self._of_sliders, sliders.node), force[:, :, None] * sliders.basis[:, None, :]
        for node, direction, slope, block in zip(place, sliders.direction, sliders.dw_dn, blocks, strict=True):
            result[node, direction, direction] += block
            result[node, direction, 2] += slope * block
        return result


class _Cycle(NamedTuple):
    """A cycle of M sliders at N instants, (M, N) each, speeds per instant."""

    motion: Array
    speed: Array
    limit: Array  # mu N / kt; below 0: open
    limit_speed: Array

    def at(self, sample: Integers) -> "_Cycle":
        """The same at one instant of each slider, (M,)."""
        rows = np.arange(len(sample))
        return _Cycle(*(part[rows, sample % part.shape[1]] for part in self))


def _stick_ends(
    cycle: _Cycle, sample: Integers, length: Integers, sign: Integers, at_once: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Where stick intervals begin and end, in instants: zeros between two of them, where these are of other signs.

    A slider stops where its speed is zero, or sticks from where contact begins; it leaves stick where the limit or
    the end of contact is reached. `sample`: the last instant before an interval of `length` instants; `sign`: of the
    slip there, 0 where contact begins; `at_once`: the first instant of contact, which counts as slip.
    """
    last, first, slipped = cycle.at(sample), cycle.at(sample + 1), sign != 0
    stops = [sign * part.speed - part.limit_speed for part in (last, first)]
    before = sample - at_once
    touches = [cycle.at(before + k).limit for k in (0, 1)]
    start = np.where(slipped, sample + _zero(*stops), before + _zero(*touches))
    at = cycle.at(before)
    slider = np.where(
        slipped,
        last.motion - sign * last.limit + 0.5 * sign * (start - sample) * stops[0],
        at.motion + (start - before) * at.speed,
    )
    end, after = sample + length, cycle.at(sample + length + 1)
    turned = np.sign(after.motion - slider)
    leaves = [turned * (part.motion - slider) - part.limit for part in (cycle.at(end), after)]
    open_ = after.limit <= 0.0
    way = np.where(open_, _zero(cycle.at(end).limit, after.limit), _zero(*leaves))
    return start, np.asarray(end + way, dtype=np.float64)


def _zero(before: Array, after: Array) -> Array:
    """Where a straight line from one instant to the next is zero; in the middle where it is not."""
    crosses = before * after < 0.0
    return np.where(crosses, before / np.where(crosses, before - after, 1.0), 0.5)


Memory = SliderMemory | ConeSliderMemory | JoinedMemory


@dataclass(frozen=True)
class MemorySampler:
    """Linearises the sliders over a cycle, at equidistant instants."""

    parameters: ContactParameters  # of the contact nodes
    n_harmonics: int  # H of the motion
    samples: int = SAMPLES  # instants a period

    @cached_property
    def _tables(self) -> tuple[Array, Array]:
        """Basis functions and their derivatives at the instants, (samples, 2H+1)."""
        table = basis_table(self.n_harmonics, self.samples)
        derivative = np.zeros_like(table)
        order = np.arange(1, self.n_harmonics + 1)
        derivative[:, 1::2] = order * table[:, 2::2]
        derivative[:, 2::2] = -order * table[:, 1::2]
        return table, derivative

    def memory(self, displacement: Array) -> Memory | None:
        """Slider memory under the periodic `displacement` (2H+1, n_c, 3), m; None if no slider slips or touches."""
        p, n = self.parameters, self.samples
        deflection = p.from_slider_origin(displacement)
        motion, speed = (
            np.ascontiguousarray((table @ deflection.reshape(table.shape[1], -1)).T).reshape(-1, 3, n)
            for table in self._tables
        )
        cone = cone_slider_memory(p, self._tables[0], motion, speed) if p.cone.any() else None
        sliders = None if p.cone.all() else self._of_sliders(motion, speed)
        return JoinedMemory(sliders, cone) if sliders is not None and cone is not None else sliders or cone

    def _of_sliders(self, motion: Array, speed: Array) -> SliderMemory | None:
        """The memory of nodes of two sliders; `motion`, `speed`: (n_c, 3, samples)."""
        p, n = self.parameters, self.samples
        state, sign, count = self._return_map(motion)
        found = np.flatnonzero(count)
        row, sample, length = found // n, found % n, count.ravel()[found]
        if row.size == 0:
            return None
        node, direction = row // 2, row % 2
        after = sign[node, direction, (sample + 1) % n]
        kt, kn = p.tangential_stiffness[node], p.normal_stiffness[node]
        closing = speed[node, 2, sample]
        restart = -speed[node, direction, sample] / np.where(closing == 0.0, np.inf, closing)
        slipped = -after * p.friction[node] * kn / kt
        # one instant of slip after re-contact is one of the sampling if the contact can stick at once
        at_once = (state[node, direction, sample - 1] == LIFT_OFF) & (np.abs(restart) <= np.abs(slipped))
        dw_dn = np.where((after == 0) | at_once, restart, slipped)
        cycle = self._cycle(motion, speed, node, direction)
        start, end = _stick_ends(cycle, sample, length, np.where(at_once, 0, after), at_once)
        start, extent = (np.asarray(2.0 * np.pi / n * part, dtype=np.float64) for part in (start, end - start))
        return SliderMemory(node, direction, start, extent, dw_dn, kt, self.n_harmonics)

    def _cycle(self, motion: Array, speed: Array, node: Integers, direction: Integers) -> "_Cycle":
        """Displacements of sliders in units of the angle between two instants."""
        p = self.parameters
        slope = p.friction[node] * p.normal_stiffness[node] / p.tangential_stiffness[node]
        step = 2.0 * np.pi / self.samples
        return _Cycle(
            motion=motion[node, direction],
            speed=step * speed[node, direction],
            limit=p.friction[node, None]
            * p.unclipped_load(motion[:, 2].T).T[node]
            / p.tangential_stiffness[node, None],
            limit_speed=step * slope[:, None] * speed[node, 2],
        )

    def _return_map(self, motion: Array) -> tuple[Integers, Integers, Integers]:
        """State, sign and number of samples of stick, see `stick_intervals`, of all sliders: (n_c, 2, samples)."""
        p = self.parameters
        load = p.normal_load(motion[:, 2].T).T
        state, sign = (np.full((len(motion), 2, self.samples), -1, dtype=np.int64) for _ in range(2))
        count = np.zeros((len(motion), 2, self.samples), dtype=np.int64)
        slides = ~p.cone & (p.tangential_stiffness > 0.0) & np.any(load > 0.0, axis=1)
        limit = np.ascontiguousarray(p.friction[:, None] * load)
        stiffness = np.ascontiguousarray(p.tangential_stiffness, dtype=float)
        stick_intervals(motion, limit, stiffness, slides, (state, sign, count))
        return state, sign, count

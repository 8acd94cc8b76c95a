"""Contact forces at the end of a time step, one pair of faces after the other (compiled); its arrays.

A pair of faces sees the motion d = d^ + G f: d^ is what the state of the ring and the forces on the other pairs make
of it, G its own flexibility over the step. The law f = F(d) with the tangent F' = -K is solved by Newton's method,

    r = F(d) - f,    change of d = E r,    change of f = r - K E r,    E = (G^-1 + K)^-1.

E is kept from step to step and brought to K where a node opens, closes, sticks or slips, by updates of rank one: the
cost of a step does not depend on the stiffness. Which branch of the law a node is on is told by its motion without
the force on itself (primal-dual active set). The pairs follow one another until no force changes (Gauss-Seidel).
Where Newton's method cycles, and with a friction cone, the nodes are visited one by one: each is solved in closed
form with its own flexibility g, component by component (projected Gauss-Seidel).

Law of the node, with the load p = N0 + kn (v0 + d_n), N = max(p, 0), the limit mu N and the slider position w:

    stick  T = kt (u - w)        slip  abs(T) = mu N, w = u - T / kt        lift-off  T = 0

Where the contact closes in the step it begins with T = 0 at the instant of re-contact, p = 0 by linear interpolation:
w = u at that instant.

Under the friction cone a slider that slips over the whole step follows the trapezoidal rule: it moves along the mean
of the slip directions n_0 and n_1 at both ends,

    w_1 - w_0 = s (n_0 + n_1),    u_1 - w_1 = r n_1,    r = mu N / kt,

which is second order in the step. In the step in which slip begins it moves along n_1 (radial return).

The motion is the response to the excitation without contact, in closed form, plus the response to the contact forces,
which is integrated: the excitation has no error of integration.

Sectors joined at a disk have arrays wave by wave. The q real waves are the wave 0, the cosine and the sine of the
waves 1, 2, ..., and the wave q / 2. With the cosine a and the sine b of a wave l, z = (a - i b) / 2^(1/2), a matrix M
of the wave takes a to Re M a + Im M b and b to Re M b - Im M a. Matrices are kept transposed, real and imaginary part
by themselves. So are the coefficients of a step of z, complex in a flow and with Coriolis forces.

References
----------
M. Ortiz, E. P. Popov, Accuracy and stability of integration algorithms for elastoplastic constitutive relations,
International Journal for Numerical Methods in Engineering 21 (1985) 1561-1576.
P. Alart, A. Curnier, A mixed formulation for frictional contact problems prone to Newton like solution methods,
Computer Methods in Applied Mechanics and Engineering 92 (1991) 353-375.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.numba_cache import inlined
from nonlinear.contact.parameters import Array, ContactParameters


class NodeLaw(NamedTuple):
    """Contact parameters (s, n_c) of the nodes, see `RingSystem`; `initial_load` is N0 + kn v0."""

    normal_stiffness: Array
    tangential_stiffness: Array
    friction: Array
    initial_load: Array
    preload: Array
    cone: NDArray[np.bool_]


class RingSystem(NamedTuple):
    """What a step needs, for m retained modes and r = 3 n_c contact displacements of a pair of faces.

    What is said of modes otherwise is in `BladeSystem` or, with a disk, in `DiskSystem`.

    `own`, `previous` and `following` hold the motion of a pair of faces under a unit force at the end of the step, on
    the pair itself, on the one before it and on the one after it. The row belongs to the force. One blade is its
    own neighbour: `own` holds the whole.

    Arrays have a first axis of s = 1 where all blades are alike. Where they differ it is q, and `each` is 1: what
    belongs to blade j, or to the pair of faces after it, stands at j * each.
    """

    each: int  # 0: all blades are alike
    position: Array  # (s, 4, m): modal coordinates over a step, see `propagation`
    rate: Array  # (s, 4, m): their rates
    own: Array  # (s, r, r), m/N
    previous: Array  # (s, r, r)
    following: Array  # (s, r, r)
    free_motion: Array  # (s, 2H+1, r): relative displacement without contact: static, cosine, sine of harmonic 1, ...
    free_output: Array  # (s, 2H+1): the same of the output
    waves: Array  # (q, 2): cosine and sine of j psi
    contact: NodeLaw


class BladeSystem(NamedTuple):
    """What a step of blades that only their contacts join needs besides `RingSystem`.

    One blade is its own neighbour: `right` holds the whole, the left faces are left out.
    """

    right: Array  # (r, m)
    left: Array  # (r, m)
    right_modes: Array  # (m, r): the transposes
    left_modes: Array  # (m, r)
    output_modes: Array  # (m,)
    output_forces: Array  # (s, 2, r): residual flexibility of the output to forces on its right and its left pair
    push: Array  # (m,): static modal force on bodies that contacts alone hold


class RingWork(NamedTuple):
    """State of the ring and scratch arrays of the kernels."""

    coordinates: Array  # (q, m): contact-driven part of the retained modal coordinates
    rates: Array  # (q, m)
    modal_force: Array  # (q, m): of the contacts, at the end of the last step
    slider: Array  # (q, n_c, 2)
    keeps: NDArray[np.bool_]  # (q, n_c, 2): whether a slider stays where it is in the step that is being solved
    motion: Array  # (q, r): relative displacement at the end of the last step
    guess: Array  # (q, r): at the end of the step that is being solved
    force: Array  # (q, r): contact force on the right nodes
    last_force: Array  # (q, r): at the end of the last step
    earlier_force: Array  # (q, r): one step before
    change: Array  # (r,): of the forces on one pair of faces in an iteration
    residual: Array  # (r,): forces of the law at the motion of a pair of faces, less the forces
    load: Array  # (q, n_c): N0 + kn (v0 + d_n) at the beginning of the step
    slip: Array  # (q, n_c, 2): slip direction of the cone there; 0: none
    tangent: Array  # (n_c, 3, 3): K of the nodes of one pair, the slope of the force of the law is -K
    tangents: Array  # (q, n_c, 3, 3): K that the flexibilities below belong to
    closed: Array  # (q, r, r): own flexibility with closed contacts, (G^-1 + K)^-1; (q, 0, 0): pairs are too large
    kept: Array  # (2, q, r): forces and motion before iterations that may not settle
    updates: NDArray[np.int64]  # (q,): of E since it was that with open contacts
    moved: Array  # (r,): E times the residual
    moves: NDArray[np.int64]  # (1,): changes of the forces of a node since the state was loaded


def node_law(contact: ContactParameters, n_nodes: int) -> NodeLaw:
    """Contact parameters of the nodes of one pair of faces that all are alike, or of all q pairs, pair after pair."""

    def by_pair(values: NDArray[Any]) -> NDArray[Any]:
        return np.array(values, order="C").reshape(-1, n_nodes)

    return NodeLaw(
        by_pair(contact.normal_stiffness),
        by_pair(contact.tangential_stiffness),
        by_pair(contact.friction),
        by_pair(contact.initial_load),
        by_pair(contact.preload),
        by_pair(contact.cone),
    )


def cosine_rows(coefficients: np.ndarray) -> Array:
    """x_0 + Re sum_h x_h e^(i h theta) as the static part and the factors of cosine and sine, (2H+1, ...)."""
    rows = [part for harmonic in coefficients[1:] for part in (harmonic.real, -harmonic.imag)]
    return np.stack([coefficients[0].real, *rows])


class WaveMatrices(NamedTuple):
    """Matrices of the J = q // 2 + 1 waves, from n values to p."""

    # `real`, `imaginary`: (J, n, p)
    real: Array
    imaginary: Array


class DiskSystem(NamedTuple):
    """What a step of joined sectors needs besides `RingSystem`, for k retained modes in a wave.

    `RingSystem` has the flexibility of a pair of faces under the forces on itself and on both neighbours; `far` is
    that under the forces on all others.
    """

    turn: Array  # (q, q): real waves from values of the sectors
    turn_back: Array  # (q, q): its transpose
    motion: WaveMatrices  # k to r: relative displacement of the modes
    force: WaveMatrices  # r to k: modal forces of contact forces
    far: WaveMatrices  # r to r, m/N
    output: WaveMatrices  # k to 1: output of the modes
    residual_output: WaveMatrices  # r to 1: residual flexibility of the output, m/N
    push: Array  # (k,): static modal force on bodies that contacts alone hold, in the wave 0
    is_far: bool  # whether any pair of faces is no neighbour: q > 3


class TurningWaves(NamedTuple):
    """How cosine and sine of the waves turn into each other over a step, for k modes or poles in a wave.

    A real wave, 0 or q / 2, has poles in pairs: real and imaginary part stand half of k apart and turn so too.
    """

    imaginary: Array  # (2, 4, q k): imaginary parts of `position` and `rate`; (2, 4, 0) where there are none
    before: Array  # (2, q k): scratch, coordinates and rates at the beginning of the step
    half: int  # half of k, 0 for modes


class DiskWork(NamedTuple):
    """Scratch arrays, by real waves but for the last one; the first two are those of `RingWork`, seen by waves."""

    coordinates: Array  # (q, k)
    modal_force: Array  # (q, k)
    motion: Array  # (q, r)
    force: Array  # (q, r)
    output: Array  # (q, 1)
    change: Array  # (q, r): of the forces on the pairs of faces in a visit


def wave_matrices(values: NDArray[Any]) -> WaveMatrices:
    """From matrices (J, p, n) of the waves; copies, as kernels are compiled anew for arrays that are read only."""
    transposed = padded(values.transpose(0, 2, 1), 1)
    return WaveMatrices(np.array(transposed.real, order="C"), np.array(transposed.imag, order="C"))


ON_LIMIT = 1.0 - 1e-6  # share of the slip limit from which a slider is taken to slip at the beginning of the step
OTHER_TANGENT = 1e-5  # change of a row of K times the flexibility of the node, up to which the old one serves
MOST_UPDATES = 100  # of E, after which it is formed anew, for their rounding
NEGLIGIBLE = 3e-11  # residual of a pair of faces, relative to the largest force so far, that is none
SMALLEST_DIVISOR = 1e-6  # of an update of an inverse
LANES = 8  # columns that matrices of the kernels have a multiple of, the rest zero; rows: of a half of it
TINY = 1e-300


def padded(values: NDArray[Any], axes: int) -> NDArray[Any]:
    """Values with zeros to a multiple of `LANES` columns, with `axes` = 2 and to a multiple of a half of it rows."""
    multiples = (LANES // 2, LANES)[-axes:]
    missing = [(0, -length % each) for length, each in zip(values.shape[-axes:], multiples, strict=True)]
    return np.pad(np.ascontiguousarray(values), [(0, 0)] * (values.ndim - axes) + missing)


@inlined
def begin_step(j: int, node: int, system: RingSystem, work: RingWork) -> None:
    """Keep what the law needs of the beginning of a step: normal load and slip direction times the limit."""
    first, contact, k = 3 * node, system.contact, j * system.each
    load = contact.initial_load[k, node] + contact.normal_stiffness[k, node] * work.motion[j, first + 2]
    work.load[j, node] = load
    for a in range(2):
        work.slip[j, node, a] = 0.0
    stiffness = contact.tangential_stiffness[k, node]
    if not contact.cone[k, node] or load <= 0.0 or stiffness == 0.0:
        return
    x = work.motion[j, first] - work.slider[j, node, 0]
    y = work.motion[j, first + 1] - work.slider[j, node, 1]
    size = math.sqrt(x * x + y * y)
    if size > 0.0 and stiffness * size >= ON_LIMIT * contact.friction[k, node] * load:
        work.slip[j, node, 0], work.slip[j, node, 1] = x / size, y / size


@inlined
def evaluate_law(j: int, node: int, system: RingSystem, work: RingWork) -> bool:
    """Write residual and tangent of one node at the motion `guess`; returns whether the node is closed.

    Which branch of the law holds is told by the motion without the force on the node, behind its own flexibility g.
    """
    contact, row, k, tangent = system.contact, 3 * node, j * system.each, work.tangent[node]
    stiffness, preload = contact.normal_stiffness[k, node], contact.preload[k, node]
    own, motion, force = system.own[k], work.guess[j, row + 2], work.force[j, row + 2]
    for a in range(3):
        for b in range(3):
            tangent[a, b] = 0.0
    flexibility = own[row + 2, row + 2]
    pressed = contact.initial_load[k, node] + stiffness * (motion + flexibility * (preload - force))
    if pressed <= 0.0:
        for a in range(2):
            work.residual[row + a] = -work.force[j, row + a]
            work.keeps[j, node, a] = False
        work.residual[row + 2] = preload - force
        return False
    tangent[2, 2] = stiffness
    load = contact.initial_load[k, node] + stiffness * motion
    work.residual[row + 2] = preload - load - force
    if contact.tangential_stiffness[k, node] > 0.0:
        _evaluate_tangents(j, node, (load, pressed / (1.0 + stiffness * flexibility)), system, work)
    return True


@inlined
def _evaluate_tangents(j: int, node: int, loads: tuple[float, float], system: RingSystem, work: RingWork) -> None:
    """The same of both tangential forces; `loads`: normal load at the motion, and behind the flexibility of the node.

    The second one is above 0.
    """
    contact, row, k, tangent, (load, pressed) = system.contact, 3 * node, j * system.each, work.tangent[node], loads
    own, stick, rise, before = system.own[k], contact.tangential_stiffness[k, node], 0.0, work.load[j, node]
    friction, stiffness = contact.friction[k, node], tangent[2, 2]
    x, y = work.guess[j, row] - work.slider[j, node, 0], work.guess[j, row + 1] - work.slider[j, node, 1]
    if before < 0.0:  # re-contact: the share of the step after it
        x, y = work.guess[j, row] - work.motion[j, row], work.guess[j, row + 1] - work.motion[j, row + 1]
        rise = -before * stick / (pressed - before) ** 2
        stick *= pressed / (pressed - before)
    for a in range(2):
        moved, g = x if a == 0 else y, own[row + a, row + a]
        traction = stick * (moved - g * work.force[j, row + a])
        sticks = abs(traction) <= friction * pressed * (1.0 + g * stick)
        work.keeps[j, node, a] = sticks and before >= 0.0
        if sticks:
            tangent[a, a] = stick
            tangent[a, 2] = min(max(rise * moved, -friction), friction) * stiffness  # as on the slip limit at most
            work.residual[row + a] = -stick * moved - work.force[j, row + a]
        else:
            sign = 1.0 if traction > 0.0 else -1.0
            tangent[a, 2] = sign * friction * stiffness
            work.residual[row + a] = -sign * friction * load - work.force[j, row + a]


@inlined
def solve_pair(j: int, scale: float, system: RingSystem, work: RingWork) -> float:
    """A Newton step of the forces on one pair of faces; returns the largest change, 0 if it is negligible.

    `scale` is the largest force so far. The pair of faces moves; what its neighbours feel is in `work.change` (see
    `pass_on`).
    """
    n_nodes, largest, closed = work.load.shape[1], 0.0, False
    for node in range(n_nodes):
        closed |= evaluate_law(j, node, system, work)
    for row in range(3 * n_nodes):
        largest = max(largest, abs(work.residual[row]))
    if largest <= NEGLIGIBLE * scale:
        return 0.0
    moved, change = work.moved, work.change
    if not closed or work.updates[j] > MOST_UPDATES:
        _open_flexibility(j, system, work)
    if closed:
        for node in range(n_nodes):
            _update_flexibility(j, node, work)
    for row in range(moved.size):
        moved[row], change[row] = 0.0, work.residual[row]
    if closed:
        add_rows(1.0, work.residual, work.closed[j], moved)
        for node in range(n_nodes):
            row, tangent = 3 * node, work.tangents[j, node]
            x, y, z = moved[row], moved[row + 1], moved[row + 2]
            for a in range(3):
                change[row + a] -= tangent[a, 0] * x + tangent[a, 1] * y + tangent[a, 2] * z
    largest = 0.0
    for row in range(change.size):
        largest = max(largest, abs(change[row]))
        work.force[j, row] += change[row]
    add_rows(1.0, change, system.own[j * system.each], work.guess[j])  # E r but for the rounding
    return largest


@inlined
def _open_flexibility(j: int, system: RingSystem, work: RingWork) -> None:
    """Make E of a pair of faces that with open contacts."""
    if work.updates[j] == 0:
        return
    work.updates[j] = 0
    flexibility, own, tangents = work.closed[j], system.own[j * system.each], work.tangents[j]
    copy(own, flexibility)
    for node in range(len(tangents)):
        for a in range(3):
            for b in range(3):
                tangents[node, a, b] = 0.0


@inlined
def _update_flexibility(j: int, node: int, work: RingWork) -> None:
    """Bring E = (G^-1 + K)^-1 of a pair of faces to the tangent of a node, row by row of K.

    With a row a of K that changes by d, E becomes E - E e_a d^T E / (1 + d^T E e_a) (Sherman and Morrison).
    """
    flexibility, row = work.closed[j], 3 * node
    for a in range(3):
        old, new = work.tangents[j, node, a], work.tangent[node, a]
        x, y, z = new[0] - old[0], new[1] - old[1], new[2] - old[2]
        matters = abs(x) * flexibility[row, row] + abs(y) * flexibility[row + 1, row + 1]
        if matters + abs(z) * flexibility[row + 2, row + 2] <= OTHER_TANGENT:
            continue
        force = flexibility[row + a]
        divisor = 1.0 + x * force[row] + y * force[row + 1] + z * force[row + 2]
        if abs(divisor) < SMALLEST_DIVISOR:
            continue
        column = work.moved
        for i in range(len(flexibility)):
            line = flexibility[i]
            column[i] = (x * line[row] + y * line[row + 1] + z * line[row + 2]) / divisor
        for i in range(force.size):
            work.change[i] = force[i]
        for i in range(len(flexibility)):
            line, factor = flexibility[i], column[i]
            for b in range(line.size):
                line[b] -= factor * work.change[b]
        old[0], old[1], old[2] = new[0], new[1], new[2]
        work.updates[j] += 1


@inlined
def solve_node(j: int, node: int, system: RingSystem, work: RingWork) -> float:
    """Solve the law of one node of the pair of faces after blade j; returns the largest change of a force.

    The pair of faces moves; what its neighbours feel is in `work.change` (see `pass_on`).
    """
    contact, row, normal, k = system.contact, 3 * node, 3 * node + 2, j * system.each
    own, stiffness = system.own[k], contact.normal_stiffness[k, node]
    flexibility, before = own[normal, normal], work.force[j, normal]
    free = work.guess[j, normal] - flexibility * before
    preload, initial = contact.preload[k, node], contact.initial_load[k, node]
    pressed = initial + stiffness * (free + flexibility * preload)
    load = pressed / (1.0 + stiffness * flexibility) if pressed > 0.0 else 0.0
    change = preload - load - before
    x = work.guess[j, row] + change * own[normal, row]
    y = work.guess[j, row + 1] + change * own[normal, row + 1]
    change_x, change_y = 0.0, 0.0
    if contact.tangential_stiffness[k, node] > 0.0:
        change_x, change_y = _solve_tangents(j, node, (load, x, y), system, work)
    if change == 0.0 and change_x == 0.0 and change_y == 0.0:
        for a in range(3):
            work.change[row + a] = 0.0
        return 0.0
    work.force[j, row] += change_x
    work.force[j, row + 1] += change_y
    work.force[j, normal] = preload - load
    work.change[row], work.change[row + 1], work.change[normal] = change_x, change_y, change
    add_node(row, work.change, own, work.guess[j])
    return max(abs(change), abs(change_x), abs(change_y))


@inlined
def _solve_tangents(
    j: int, node: int, pressed: tuple[float, float, float], system: RingSystem, work: RingWork
) -> tuple[float, float]:
    """Changes of both tangential forces; `pressed`: normal load, displacements. Marks sliders that stay."""
    contact, row, (load, x, y), k = system.contact, 3 * node, pressed, j * system.each
    own = system.own[k]
    work.keeps[j, node, 0], work.keeps[j, node, 1] = False, False
    if load == 0.0:
        return -work.force[j, row], -work.force[j, row + 1]
    stick = contact.tangential_stiffness[k, node]
    anchor_x, anchor_y = work.slider[j, node, 0], work.slider[j, node, 1]
    before = work.load[j, node]
    if before < 0.0:  # re-contact: the share of the step after it
        stick *= load / (load - before)
        anchor_x, anchor_y = work.motion[j, row], work.motion[j, row + 1]
    limit = contact.friction[k, node] * load
    if contact.cone[k, node]:
        change_x, change_y, sticks = _solve_plane(j, node, (x - anchor_x, y - anchor_y, stick, limit), system, work)
        sticks_x, sticks_y = sticks, sticks
    else:
        change_x, sticks_x = _solve_slider(x - anchor_x, work.force[j, row], (own[row, row], stick, limit))
        across = y - anchor_y + change_x * own[row, row + 1]
        change_y, sticks_y = _solve_slider(across, work.force[j, row + 1], (own[row + 1, row + 1], stick, limit))
    work.keeps[j, node, 0], work.keeps[j, node, 1] = sticks_x and before >= 0.0, sticks_y and before >= 0.0
    return change_x, change_y


@inlined
def _solve_slider(offset: float, force: float, law: tuple[float, float, float]) -> tuple[float, bool]:
    """Change of the force of one slider of the two, and whether it sticks.

    `offset`: its displacement from the slider position; `law`: flexibility, stiffness in stick and slip limit.
    """
    flexibility, stick, limit = law
    traction = stick * (offset - flexibility * force) / (1.0 + flexibility * stick)
    sticks = abs(traction) <= limit
    return -min(max(traction, -limit), limit) - force, sticks


@inlined
def _solve_plane(
    j: int, node: int, law: tuple[float, float, float, float], system: RingSystem, work: RingWork
) -> tuple[float, float, bool]:
    """Changes of both forces under the friction cone, and whether the slider sticks.

    `law`: displacement from the slider position (2), stiffness in stick and slip limit. Both components get the
    larger of the two flexibilities: the iteration still ends at the solution.
    """
    x, y, stick, limit = law
    row, k = 3 * node, j * system.each
    own, stiffness = system.own[k], system.contact.tangential_stiffness[k, node]
    flexibility = max(own[row, row], own[row + 1, row + 1]) + abs(own[row, row + 1])
    x -= flexibility * work.force[j, row]
    y -= flexibility * work.force[j, row + 1]
    size = math.sqrt(x * x + y * y)
    sticks = stick * size <= limit * (1.0 + flexibility * stick)
    if sticks:
        ratio = stick / (1.0 + flexibility * stick)
    else:
        slip_x, slip_y = work.slip[j, node, 0], work.slip[j, node, 1]
        if slip_x * slip_x + slip_y * slip_y > 0.5 and work.load[j, node] > 0.0:
            reach = limit * (1.0 / stiffness + flexibility)
            half = 0.5 * (size * size - reach * reach) / max(reach + x * slip_x + y * slip_y, TINY)
            if half < size:
                x, y = x - half * slip_x, y - half * slip_y
                size = math.sqrt(x * x + y * y)
        ratio = limit / max(size, TINY)
    return -ratio * x - work.force[j, row], -ratio * y - work.force[j, row + 1], sticks


@inlined
def pass_on(j: int, changes: Array, system: RingSystem, work: RingWork) -> None:
    """Move both neighbouring pairs of faces by changes (r,) of the forces on the pair after blade j."""
    last, k = len(work.guess) - 1, j * system.each
    after, before = j + 1 if j < last else 0, j - 1 if j > 0 else last
    for row in range(0, 3 * work.load.shape[1], 3):
        if changes[row] != 0.0 or changes[row + 1] != 0.0 or changes[row + 2] != 0.0:
            work.moves[0] += 1
            if last == 0:
                continue
            add_node(row, changes, system.previous[k], work.guess[after])
            add_node(row, changes, system.following[k], work.guess[before])


@inlined
def copy(values: Array, total: Array) -> None:
    """Write values (n, p) over others."""
    for i in range(len(values)):
        for column in range(values.shape[1]):
            total[i, column] = values[i, column]


@inlined
def is_loaded(force: Array) -> bool:
    """Whether any force (r,) on a pair of faces is not zero."""
    loaded = False
    for row in range(force.size):
        loaded |= force[row] != 0.0
    return loaded


@inlined
def add_node(row: int, factors: Array, matrix: Array, total: Array) -> None:
    """Add the three rows of a matrix that belong to a node, times their factors, to a total (n,)."""
    x, y, z = factors[row], factors[row + 1], factors[row + 2]
    for i in range(total.size):
        total[i] += x * matrix[row, i] + y * matrix[row + 1, i] + z * matrix[row + 2, i]


@inlined
def add_rows(sign: float, factors: Array, matrix: Array, total: Array) -> None:
    """Add all rows of a matrix, times sign and their factors, to a total (n,): four at once, not those beyond."""
    rows = len(matrix)
    last = rows - rows % 4
    for row in range(0, last, 4):
        a, b, c, d = sign * factors[row], sign * factors[row + 1], sign * factors[row + 2], sign * factors[row + 3]
        for i in range(total.size):
            total[i] += (a * matrix[row, i] + b * matrix[row + 1, i]) + (
                c * matrix[row + 2, i] + d * matrix[row + 3, i]
            )
    for row in range(last, rows):
        a = sign * factors[row]
        for i in range(total.size):
            total[i] += a * matrix[row, i]

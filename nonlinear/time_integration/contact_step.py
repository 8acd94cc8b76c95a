"""Contact forces at the end of a time step, node by node with the exact local flexibility (compiled).

A node sees the motion d = d^ + g f: d^ is what the state of the ring and the other nodes make of it, g its own
flexibility over the step. With the contact laws this is solved in closed form, component by component. All nodes are
visited in turn until no force changes (projected Gauss-Seidel).

Law of the node, with the load p = N0 + kn (v0 + d_n), N = max(p, 0), the limit mu N and the slider position w:

    stick  T = kt (u - w)        slip  abs(T) = mu N, w = u - T / kt        lift-off  T = 0

Where the contact closes in the step it begins with T = 0 at the instant of re-contact, p = 0 by linear interpolation:
w = u at that instant.

Under the friction cone a slider that slips over the whole step follows the trapezoidal rule: it moves along the mean
of the slip directions n_0 and n_1 at both ends,

    w_1 - w_0 = s (n_0 + n_1),    u_1 - w_1 = r n_1,    r = mu N / kt,

which is second order in the step. In the step in which slip begins it moves along n_1 (radial return).

References
----------
M. Ortiz, E. P. Popov, Accuracy and stability of integration algorithms for elastoplastic constitutive relations,
International Journal for Numerical Methods in Engineering 21 (1985) 1561-1576.
"""

import math

from nonlinear.contact.numba_cache import inlined
from nonlinear.contact.parameters import Array
from nonlinear.time_integration.ring_system import RingSystem, RingWork

ON_LIMIT = 1.0 - 1e-9  # share of the slip limit from which a slider is taken to slip at the beginning of the step
TINY = 1e-300


@inlined
def begin_step(j: int, node: int, system: RingSystem, work: RingWork) -> None:
    """Keep what the law needs of the beginning of a step: normal load and slip direction times the limit."""
    first, contact = 3 * node, system.contact
    load = contact.initial_load[node] + contact.normal_stiffness[node] * work.motion[j, first + 2]
    work.load[j, node] = load
    for a in range(2):
        work.slip[j, node, a] = 0.0
    stiffness = contact.tangential_stiffness[node]
    if not contact.cone or load <= 0.0 or stiffness == 0.0:
        return
    x = work.motion[j, first] - work.slider[j, node, 0]
    y = work.motion[j, first + 1] - work.slider[j, node, 1]
    size = math.sqrt(x * x + y * y)
    if size > 0.0 and stiffness * size >= ON_LIMIT * contact.friction[node] * load:
        work.slip[j, node, 0], work.slip[j, node, 1] = x / size, y / size


@inlined
def solve_node(j: int, node: int, system: RingSystem, work: RingWork, guess: Array) -> float:
    """Solve the law of one node of the pair of faces after blade j; returns the largest change of a force."""
    contact, first = system.contact, 3 * node
    normal, row = contact.normal_stiffness[node], first + 2
    flexibility = system.own[row, row]
    free = guess[j, row] - flexibility * work.force[j, row]
    preload, initial = contact.preload[node], contact.initial_load[node]
    pressed = (initial + normal * (free + flexibility * preload)) / (1.0 + normal * flexibility)
    load = max(pressed, 0.0)
    change = _change_force(j, row, preload - load, system, work, guess)
    stiffness = contact.tangential_stiffness[node]
    if stiffness == 0.0:
        return change
    if load == 0.0:
        for a in range(2):
            change = max(change, _change_force(j, first + a, 0.0, system, work, guess))
            work.placed[j, node, a] = guess[j, first + a]
        return change
    stick = stiffness
    anchor_x, anchor_y = work.slider[j, node, 0], work.slider[j, node, 1]
    before = work.load[j, node]
    if before < 0.0:  # re-contact: the share of the step after it
        stick *= load / (load - before)
        anchor_x, anchor_y = work.motion[j, first], work.motion[j, first + 1]
    limit = contact.friction[node] * load
    if contact.cone:
        return max(change, _solve_plane(j, node, (anchor_x, anchor_y, stick, limit), system, work, guess))
    change = max(change, _solve_slider(j, node, 0, (anchor_x, stick, limit), system, work, guess))
    return max(change, _solve_slider(j, node, 1, (anchor_y, stick, limit), system, work, guess))


@inlined
def _change_force(j: int, row: int, value: float, system: RingSystem, work: RingWork, guess: Array) -> float:
    """Set a contact force and move all nodes that its modal forces reach; returns the change."""
    change = value - work.force[j, row]
    if change == 0.0:
        return 0.0
    work.force[j, row] = value
    last = len(guess) - 1
    add(change, system.own[row], guess[j])
    if last > 0:
        add(change, system.previous[row], guess[j + 1 if j < last else 0])
        add(change, system.following[row], guess[j - 1 if j > 0 else last])
    return abs(change)


@inlined
def add(factor: float, values: Array, total: Array) -> None:
    """Add values times a factor to a total, both (n,)."""
    for i in range(total.size):
        total[i] += factor * values[i]


@inlined
def _solve_slider(
    j: int, node: int, a: int, law: tuple[float, float, float], system: RingSystem, work: RingWork, guess: Array
) -> float:
    """One slider of the two; `law`: position, stiffness in stick and slip limit."""
    anchor, stick, limit = law
    row = 3 * node + a
    flexibility = system.own[row, row]
    free = guess[j, row] - flexibility * work.force[j, row]
    traction = stick * (free - anchor) / (1.0 + flexibility * stick)
    sticks = abs(traction) <= limit and work.load[j, node] >= 0.0
    traction = min(max(traction, -limit), limit)
    change = _change_force(j, row, -traction, system, work, guess)
    moved = guess[j, row] - traction / system.contact.tangential_stiffness[node]
    work.placed[j, node, a] = anchor if sticks else moved
    return change


@inlined
def _solve_plane(
    j: int, node: int, law: tuple[float, float, float, float], system: RingSystem, work: RingWork, guess: Array
) -> float:
    """The slider under the friction cone; `law`: position (2), stiffness in stick and slip limit.

    Both components get the larger of the two flexibilities: the iteration still ends at the solution.
    """
    anchor_x, anchor_y, stick, limit = law
    row, stiffness = 3 * node, system.contact.tangential_stiffness[node]
    flexibility = max(system.own[row, row], system.own[row + 1, row + 1]) + abs(system.own[row, row + 1])
    x = guess[j, row] - flexibility * work.force[j, row] - anchor_x
    y = guess[j, row + 1] - flexibility * work.force[j, row + 1] - anchor_y
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
    change = _change_force(j, row, -ratio * x, system, work, guess)
    change = max(change, _change_force(j, row + 1, -ratio * y, system, work, guess))
    if sticks and work.load[j, node] >= 0.0:
        work.placed[j, node, 0], work.placed[j, node, 1] = anchor_x, anchor_y
        return change
    for a in range(2):
        work.placed[j, node, a] = guess[j, row + a] + work.force[j, row + a] / stiffness
    return change

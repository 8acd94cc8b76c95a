"""Periods of a ring, step by step (compiled).

A step: the retained modes under the forces so far, the contact forces at its end (`contact_step`), the modes under
these. The forces vary linearly over the step, so that the error is of second order.

Of sectors joined at a disk, modes and forces meet in waves. The contact forces of a step are solved with the
flexibility between neighbouring pairs of faces, as those of blades alone; what their changes do to all other pairs,
through the disk, follows after each iteration.

All functions are copied into the one that is called from Python: a call passes some 250 numbers of arrays, which
takes as long as a step of two blades.
"""

import math

from nonlinear.contact.numba_cache import inlined, inner, lean
from nonlinear.contact.parameters import Array
from nonlinear.time_integration.contact_step import (
    MOST_UPDATES,
    BladeSystem,
    DiskSystem,
    DiskWork,
    RingSystem,
    RingWork,
    TurningWaves,
    WaveMatrices,
    add_rows,
    begin_step,
    copy,
    is_loaded,
    pass_on,
    solve_node,
    solve_pair,
)

MOST_SWEEPS = 420
BY_PAIRS, BY_NODES = 12, 30  # iterations pair by pair, and then node by node where those cycle, in turn
FAST = 0.05  # ratio of two successive changes up to which it is taken to hold for the next one
TOLERANCE = 3e-10  # change of a force, relative to the largest force so far, at which a step is solved


@inlined
def advance_modes(system: RingSystem, work: RingWork) -> None:
    """Write coordinates and rates at the end of the step but for the forces there."""
    for j in range(len(work.coordinates)):
        position, rate = system.position[j * system.each], system.rate[j * system.each]
        for m in range(position.shape[1]):
            before, speed, force = work.coordinates[j, m], work.rates[j, m], work.modal_force[j, m]
            work.coordinates[j, m] = position[0, m] * before + position[1, m] * speed + position[2, m] * force
            work.rates[j, m] = rate[0, m] * before + rate[1, m] * speed + rate[2, m] * force


@inlined
def advance_poles(system: RingSystem, turning: TurningWaves, work: RingWork) -> None:
    """As `advance_modes` for poles, which have no rates: a pair p = (a - i b) / 2^(1/2) turns."""
    real, imaginary, half = system.position[0], turning.imaginary[0], turning.half
    for j in range(len(work.coordinates)):
        pole, force = work.coordinates[j], work.modal_force[j]
        for a in range(half):
            b = a + half
            x, y, f, g = pole[a], pole[b], force[a], force[b]
            pole[a] = real[0, a] * x + imaginary[0, a] * y + (real[2, a] * f + imaginary[2, a] * g)
            pole[b] = real[0, b] * y - imaginary[0, a] * x + (real[2, b] * g - imaginary[2, a] * f)


@inlined
def begin_all(system: RingSystem, work: RingWork) -> None:
    """Keep the beginning of the step, and extrapolate the contact forces to its end."""
    for j in range(len(work.force)):
        for node in range(work.load.shape[1]):
            begin_step(j, node, system, work)
        for row in range(work.force.shape[1]):
            force, last = work.force[j, row], work.last_force[j, row]
            predicted = 3.0 * (force - last) + work.earlier_force[j, row]
            work.force[j, row] = predicted if force != 0.0 else 0.0
            work.last_force[j, row], work.earlier_force[j, row] = force, last


@inlined
def write_free_motion(theta: float, system: RingSystem, work: RingWork) -> None:
    """Write the relative displacement without contact."""
    cosine, sine, rows = math.cos(theta), math.sin(theta), work.force.shape[1]
    for j in range(len(work.guess)):
        free = system.free_motion[j * system.each]
        real = cosine * system.waves[j, 0] - sine * system.waves[j, 1]
        imaginary = sine * system.waves[j, 0] + cosine * system.waves[j, 1]
        for row in range(rows):
            work.guess[j, row] = free[0, row] + real * free[1, row] + imaginary * free[2, row]
        higher_real, higher_imaginary = real, imaginary
        for h in range(2, len(free) // 2 + 1):
            higher_real, higher_imaginary = (
                higher_real * real - higher_imaginary * imaginary,
                higher_real * imaginary + higher_imaginary * real,
            )
            for row in range(rows):
                work.guess[j, row] += higher_real * free[2 * h - 1, row] + higher_imaginary * free[2 * h, row]


@inlined
def add_modes(blades: BladeSystem, work: RingWork) -> None:
    """Add the relative displacement of the retained modes."""
    n_blades = len(work.guess)
    for j in range(n_blades):
        add_rows(1.0, work.coordinates[j], blades.right_modes, work.guess[j])
        if n_blades > 1:
            add_rows(-1.0, work.coordinates[(j + 1) % n_blades], blades.left_modes, work.guess[j])


@inlined
def add_forces(system: RingSystem, work: RingWork) -> None:
    """Add the relative displacement at the end of the step under the contact forces as they are in `work`."""
    for j in range(len(work.guess)):
        if is_loaded(work.force[j]):
            add_rows(1.0, work.force[j], system.own[j * system.each], work.guess[j])
            pass_on(j, work.force[j], system, work)


@inlined
def solve_pairs(scale: float, system: RingSystem, work: RingWork) -> float:
    """A Newton step of each pair of faces after the other; returns the largest change of a force."""
    change = 0.0
    for j in range(len(work.guess)):
        largest = solve_pair(j, scale, system, work)
        if largest > 0.0:
            pass_on(j, work.change, system, work)
        change = max(change, largest)
    return change


@inlined
def visit_nodes(system: RingSystem, work: RingWork) -> float:
    """Visit all nodes once; returns the largest change of a force."""
    change = 0.0
    for j in range(len(work.guess)):
        work.updates[j] += MOST_UPDATES  # E is formed anew
        for node in range(work.load.shape[1]):
            change = max(change, solve_node(j, node, system, work))
        pass_on(j, work.change, system, work)
    return change


@inlined
def iterate(iteration: int, scale: float, system: RingSystem, work: RingWork) -> float:
    """An iteration of the contact forces: pair by pair; node by node where pairs go round in a cycle.

    Nodes begin where the pairs began.
    """
    turn = iteration % (BY_PAIRS + BY_NODES)
    if work.closed.shape[1] == 0:
        return visit_nodes(system, work)
    if turn >= BY_PAIRS:
        if turn == BY_PAIRS:
            copy(work.kept[0], work.force)
            copy(work.kept[1], work.guess)
        return visit_nodes(system, work)
    if turn == 0:
        copy(work.force, work.kept[0])
        copy(work.guess, work.kept[1])
    return solve_pairs(scale, system, work)


@inlined
def known_change(iteration: int, before: float) -> float:
    """Change of a force in the iteration before; 0 where that went the other way, and tells nothing of this one."""
    turn = iteration % (BY_PAIRS + BY_NODES)
    return 0.0 if turn == 0 or turn == BY_PAIRS else before


@inlined
def largest_force(scale: float, work: RingWork) -> float:
    """The largest contact force, or `scale` where that is larger."""
    largest = scale
    for j in range(len(work.force)):
        for row in range(work.force.shape[1]):
            largest = max(largest, abs(work.force[j, row]))
    return largest


@inlined
def has_settled(change: float, before: float, largest: float) -> bool:
    """Whether no force changes any more; the changes of two visits tell what the next one would change."""
    settled = TOLERANCE * largest
    return change <= settled or (change <= FAST * before and change * change <= settled * before)


@inlined
def solve_contacts(scale: float, system: RingSystem, work: RingWork) -> float:
    """Iterate until no force changes; returns the largest force, or -1 where they do not settle."""
    before = 0.0
    for sweep in range(MOST_SWEEPS):
        before = known_change(sweep, before)
        change = iterate(sweep, scale, system, work)
        largest = largest_force(scale, work)
        if has_settled(change, before, largest):
            return largest
        before = change
    return -1.0


@inlined
def apply_forces(system: RingSystem, blades: BladeSystem, turning: TurningWaves, work: RingWork) -> None:
    """Add the forces at the end of the step to coordinates and rates."""
    n_blades = len(work.force)
    for j in range(n_blades):
        modal = work.modal_force[j]
        position, rate = system.position[j * system.each], system.rate[j * system.each]
        for m in range(modal.size):
            modal[m] = blades.push[m]
        if is_loaded(work.force[j]):
            add_rows(1.0, work.force[j], blades.right, modal)
        behind = (j - 1) % n_blades
        if n_blades > 1 and is_loaded(work.force[behind]):
            add_rows(-1.0, work.force[behind], blades.left, modal)
        for m in range(modal.size):
            work.coordinates[j, m] += position[3, m] * modal[m]
            work.rates[j, m] += rate[3, m] * modal[m]
        for a in range(turning.half):
            b = a + turning.half
            work.coordinates[j, a] += turning.imaginary[0, 3, a] * modal[b]
            work.coordinates[j, b] -= turning.imaginary[0, 3, a] * modal[a]


@inlined
def free_output(j: int, theta: float, system: RingSystem) -> float:
    """Output of a blade without contact."""
    cosine, sine = math.cos(theta), math.sin(theta)
    real = cosine * system.waves[j, 0] - sine * system.waves[j, 1]
    imaginary = sine * system.waves[j, 0] + cosine * system.waves[j, 1]
    free = system.free_output[j * system.each]
    total = free[0] + real * free[1] + imaginary * free[2]
    higher_real, higher_imaginary = real, imaginary
    for h in range(2, len(free) // 2 + 1):
        higher_real, higher_imaginary = (
            higher_real * real - higher_imaginary * imaginary,
            higher_real * imaginary + higher_imaginary * real,
        )
        total += higher_real * free[2 * h - 1] + higher_imaginary * free[2 * h]
    return total


@inlined
def write_output(theta: float, system: RingSystem, blades: BladeSystem, work: RingWork, output: Array) -> None:
    """Write the output of all blades (q,)."""
    n_blades, rows = work.force.shape
    for j in range(n_blades):
        total, forces = free_output(j, theta, system), blades.output_forces[j * system.each]
        for m in range(work.coordinates.shape[1]):
            total += blades.output_modes[m] * work.coordinates[j, m]
        for row in range(rows):
            total += forces[0, row] * work.force[j, row]
            total += forces[1, row] * work.force[(j - 1) % n_blades, row]
        output[j] = total


@inlined
def end_all(system: RingSystem, work: RingWork) -> None:
    """Take the end of the step for the beginning of the next one."""
    for j in range(len(work.force)):
        for row in range(work.force.shape[1]):
            work.motion[j, row] = work.guess[j, row]
        for node in range(work.load.shape[1]):
            stiffness = system.contact.tangential_stiffness[j * system.each, node]
            for a in range(2):
                row = 3 * node + a
                if stiffness > 0.0 and not work.keeps[j, node, a]:
                    work.slider[j, node, a] = work.motion[j, row] + work.force[j, row] / stiffness


@lean
def march_steps(
    system: RingSystem,
    blades: BladeSystem,
    turning: TurningWaves,
    work: RingWork,
    part: tuple[int, int],
    scale: float,
    output: Array,
) -> float:
    """March a part of a period, from its first step to before its last, and write the output of each, (steps, q).

    `scale` is the largest contact force so far; returned with what comes, or -1 where the contact forces of a step do
    not settle.
    """
    steps = len(output)
    for step in range(part[0], part[1]):
        theta = 2.0 * math.pi * (step + 1) / steps
        if turning.half > 0:
            advance_poles(system, turning, work)
        else:
            advance_modes(system, work)
        begin_all(system, work)
        write_free_motion(theta, system, work)
        add_modes(blades, work)
        add_forces(system, work)
        largest = solve_contacts(scale, system, work)
        if largest < 0.0:
            return -1.0
        scale = largest
        apply_forces(system, blades, turning, work)
        write_output(theta, system, blades, work, output[step])
        end_all(system, work)
    return scale


@inner
def transform(turn: Array, values: Array, total: Array) -> None:
    """Write the real waves (q, n) of values (q, n) of the sectors."""
    for i in range(len(turn)):
        for column in range(total.shape[1]):
            total[i, column] = 0.0
        add_rows(1.0, turn[i], values, total[i])


@inner
def add_waves(matrices: WaveMatrices, values: Array, total: Array) -> None:
    """Add the products of the matrices of the waves with values (q, n) of the real waves to a total (q, p)."""
    real, imaginary = matrices.real, matrices.imaginary
    last = len(values) - 1
    add_rows(1.0, values[0], real[0], total[0])
    for wave in range(1, len(values) - len(values) // 2):
        a, b = 2 * wave - 1, 2 * wave
        add_rows(1.0, values[a], real[wave], total[a])
        add_rows(1.0, values[b], imaginary[wave], total[a])
        add_rows(1.0, values[b], real[wave], total[b])
        add_rows(-1.0, values[a], imaginary[wave], total[b])
    if last % 2 == 1:
        add_rows(1.0, values[last], real[len(real) - 1], total[last])


@inner
def clear(values: Array) -> None:
    """Set values (q, n) to zero."""
    for i in range(len(values)):
        for column in range(values.shape[1]):
            values[i, column] = 0.0


@inner
def add_in_time(disk: DiskSystem, scratch: DiskWork, guess: Array) -> None:
    """Add the motion of the waves to that of the pairs of faces (q, r)."""
    for j in range(len(guess)):
        add_rows(1.0, disk.turn_back[j], scratch.motion, guess[j])


@inner
def pass_far(disk: DiskSystem, work: RingWork, scratch: DiskWork) -> None:
    """Move all pairs of faces that are no neighbours by the changes of the forces since `scratch.change` was kept."""
    for j in range(len(work.force)):
        for row in range(work.force.shape[1]):
            scratch.change[j, row] = work.force[j, row] - scratch.change[j, row]
    transform(disk.turn, scratch.change, scratch.force)
    clear(scratch.motion)
    add_waves(disk.far, scratch.force, scratch.motion)
    add_in_time(disk, scratch, work.guess)


@inlined
def turn_pairs(
    position: Array, rate: Array, values: Array, work: RingWork, slots: tuple[int, int], apart: int
) -> None:
    """Add values times the imaginary parts of their coefficients, between slots (from, to) and others `apart`."""
    for a in range(slots[0], slots[1]):
        b = a + apart
        work.coordinates[0, a] += position[a] * values[b]
        work.coordinates[0, b] -= position[b] * values[a]
        work.rates[0, a] += rate[a] * values[b]
        work.rates[0, b] -= rate[b] * values[a]


@inner
def add_turned(position: Array, rate: Array, values: Array, work: RingWork, size: int, half: int) -> None:
    """Cosine and sine of a wave turn into each other: see `TurningWaves`; `size`: number k of a wave."""
    sectors = values.size // size
    for wave in range(1, sectors - sectors // 2):
        first = (2 * wave - 1) * size
        turn_pairs(position, rate, values, work, (first, first + size), size)
    if half > 0:
        turn_pairs(position, rate, values, work, (0, half), half)
        if sectors % 2 == 0:
            last = values.size - size
            turn_pairs(position, rate, values, work, (last, last + half), half)


@inner
def advance_turning(system: RingSystem, turning: TurningWaves, work: RingWork, size: int) -> None:
    """As `advance_modes` where waves turn; `size`: number k of a wave."""
    position, rate, before = turning.imaginary[0], turning.imaginary[1], turning.before
    for m in range(before.shape[1]):
        before[0, m], before[1, m] = work.coordinates[0, m], work.rates[0, m]
    advance_modes(system, work)
    for part in range(2):
        add_turned(position[part], rate[part], before[part], work, size, turning.half)
    add_turned(position[2], rate[2], work.modal_force[0], work, size, turning.half)


@inner
def solve_all(scale: float, system: RingSystem, disk: DiskSystem, work: RingWork, scratch: DiskWork) -> float:
    """As `solve_contacts`, with the pairs of faces that are no neighbours."""
    before = 0.0
    for sweep in range(MOST_SWEEPS):
        before = known_change(sweep, before)
        if disk.is_far:
            for j in range(len(work.force)):
                for row in range(work.force.shape[1]):
                    scratch.change[j, row] = work.force[j, row]
        change = iterate(sweep, scale, system, work)
        if disk.is_far:
            pass_far(disk, work, scratch)
        largest = largest_force(scale, work)
        if has_settled(change, before, largest):
            return largest
        before = change
    return -1.0


@inner
def apply_in_waves(system: RingSystem, disk: DiskSystem, work: RingWork, scratch: DiskWork) -> None:
    """Add the forces at the end of the step to coordinates and rates."""
    transform(disk.turn, work.force, scratch.force)
    clear(scratch.modal_force)
    for m in range(disk.push.size):
        scratch.modal_force[0, m] = disk.push[m]
    add_waves(disk.force, scratch.force, scratch.modal_force)
    for m in range(work.modal_force.shape[1]):
        work.coordinates[0, m] += system.position[0, 3, m] * work.modal_force[0, m]
        work.rates[0, m] += system.rate[0, 3, m] * work.modal_force[0, m]


@inner
def output_in_waves(disk: DiskSystem, scratch: DiskWork) -> None:
    """Write the contact-driven output by waves; the forces stand there by waves."""
    clear(scratch.output)
    add_waves(disk.output, scratch.coordinates, scratch.output)
    add_waves(disk.residual_output, scratch.force, scratch.output)


@lean
def march_sectors(
    system: RingSystem,
    disk: DiskSystem,
    work: RingWork,
    scratch: DiskWork,
    turning: TurningWaves,
    part: tuple[int, int],
    scale: float,
    output: Array,
) -> float:
    """March a part of a period, from its first step to before its last, as `march_steps`.

    Coordinates, rates and modal forces in `work` are rows (1, q k).
    """
    steps, size, turns = len(output), scratch.coordinates.shape[1], turning.imaginary.size > 0
    for step in range(part[0], part[1]):
        theta = 2.0 * math.pi * (step + 1) / steps
        if turns:
            advance_turning(system, turning, work, size)
        else:
            advance_modes(system, work)
        begin_all(system, work)
        write_free_motion(theta, system, work)
        clear(scratch.motion)
        add_waves(disk.motion, scratch.coordinates, scratch.motion)
        if disk.is_far:
            transform(disk.turn, work.force, scratch.force)
            add_waves(disk.far, scratch.force, scratch.motion)
        add_in_time(disk, scratch, work.guess)
        add_forces(system, work)
        largest = solve_all(scale, system, disk, work, scratch)
        if largest < 0.0:
            return -1.0
        scale = largest
        apply_in_waves(system, disk, work, scratch)
        if turns:
            at_end = turning.imaginary[0, 3], turning.imaginary[1, 3]
            add_turned(at_end[0], at_end[1], work.modal_force[0], work, size, turning.half)
        output_in_waves(disk, scratch)
        for j in range(len(work.force)):
            total = free_output(j, theta, system)
            for i in range(len(work.force)):
                total += disk.turn_back[j, i] * scratch.output[i, 0]
            output[step, j] = total
        end_all(system, work)
    return scale

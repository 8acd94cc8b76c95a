"""Periods of a ring of sectors joined at a disk, step by step (compiled).

As `ring_period`, but modes and forces meet in waves. The contact forces of a step are solved node by node with the
flexibility between neighbouring pairs of faces, as those of blades alone; what their changes do to all other pairs,
through the disk, follows after each visit of the nodes.
"""

import math

from nonlinear.contact.numba_cache import inner, lean
from nonlinear.contact.parameters import Array
from nonlinear.time_integration.contact_step import add_rows
from nonlinear.time_integration.disk_system import DiskSystem, DiskWork, WaveMatrices
from nonlinear.time_integration.ring_period import (
    MOST_SWEEPS,
    add_forces,
    advance_modes,
    begin_all,
    end_all,
    free_output,
    has_settled,
    largest_force,
    visit_nodes,
    write_free_motion,
)
from nonlinear.time_integration.ring_system import RingSystem, RingWork


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


@inner
def solve_all(scale: float, system: RingSystem, disk: DiskSystem, work: RingWork, scratch: DiskWork) -> float:
    """As `solve_contacts`, with the pairs of faces that are no neighbours."""
    before, largest = 0.0, scale
    for sweep in range(MOST_SWEEPS):
        if disk.is_far:
            for j in range(len(work.force)):
                for row in range(work.force.shape[1]):
                    scratch.change[j, row] = work.force[j, row]
        change = visit_nodes(system, work)
        if disk.is_far:
            pass_far(disk, work, scratch)
        if sweep == 0:
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
    add_waves(disk.force, scratch.force, scratch.modal_force)
    for m in range(work.modal_force.shape[1]):
        work.coordinates[0, m] += system.position[3, m] * work.modal_force[0, m]
        work.rates[0, m] += system.rate[3, m] * work.modal_force[0, m]


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
    first: int,
    last: int,
    scale: float,
    output: Array,
) -> float:
    """March steps of a period as `march_steps`; coordinates, rates and modal forces in `work` are rows (1, q k)."""
    steps = len(output)
    for step in range(first, last):
        theta = 2.0 * math.pi * (step + 1) / steps
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
        output_in_waves(disk, scratch)
        for j in range(len(work.force)):
            total = free_output(j, theta, system)
            for i in range(len(work.force)):
                total += disk.turn_back[j, i] * scratch.output[i, 0]
            output[step, j] = total
        end_all(work)
    return scale

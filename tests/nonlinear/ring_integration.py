"""Time integration of a whole ring of blades: an independent check of the balance under cyclic symmetry.

Every blade in its own modal coordinates, every contact with its own sliders. The linear part is advanced exactly
under forces that vary linearly over a step, so the error is of second order in the step. A slider that touches again
starts at the instant of contact inside the step, so that the map over one period can be differentiated (`ring_map`).
"""

from typing import NamedTuple

import numpy as np
from numba import njit


class Ring(NamedTuple):
    """What a step needs: `transition` (m, 2, 4), faces (3 n_c, m), contact parameters (n_c,) and the law."""

    transition: np.ndarray
    right: np.ndarray
    left: np.ndarray
    normal_stiffness: np.ndarray
    tangential_stiffness: np.ndarray
    friction: np.ndarray
    interference: np.ndarray
    cone: bool


class RingState(NamedTuple):
    """Modal coordinates eta and their rates, (blades, m), and slider positions, (blades, n_c, 2)."""

    eta: np.ndarray
    rate: np.ndarray
    slider: np.ndarray


def ring_of(modal, contact, omega, steps):
    """The ring of a modal model with `steps` a period."""
    return Ring(
        transition(modal.angular_frequency, modal.damping, 2.0 * np.pi / omega / steps),
        np.ascontiguousarray(modal.right),
        np.ascontiguousarray(np.zeros_like(modal.right) if modal.left is None else modal.left),
        contact.normal_stiffness,
        contact.tangential_stiffness,
        contact.friction,
        contact.interference,
        contact.law == "cone",
    )


def transition(frequency, damping, step):
    """Coefficients of eta'' + c eta' + omega_m^2 eta = a + b t over one step: state' = A state + B f0 + C f1."""
    from scipy.linalg import expm

    size = frequency.size
    matrices = np.empty((size, 2, 4))
    for mode in range(size):
        generator = np.zeros((4, 4))  # state eta, eta', force, derivative of the force
        generator[0, 1] = generator[1, 2] = generator[2, 3] = 1.0
        generator[1, 0], generator[1, 1] = -(frequency[mode] ** 2), -damping[mode]
        full = expm(generator * step)
        matrices[mode, :, :2] = full[:2, :2]
        matrices[mode, :, 3] = full[:2, 3] / step  # coefficient of f1
        matrices[mode, :, 2] = full[:2, 2] - full[:2, 3] / step  # coefficient of f0
    return matrices


def travelling_wave(modal, phase, force, n_blades, steps):
    """Modal forces of the excitation over a period, (steps, blades, m)."""
    theta = 2.0 * np.pi * np.arange(steps) / steps
    wave = np.cos(theta[:, None] + phase * np.arange(n_blades))
    return wave[:, :, None] * (force * modal.force) + modal.static_force


def state_of_wave(modal, contact, phase, omega, wave, n_blades):
    """State of the ring in a travelling wave, from `wave`: modal coefficients (H+1, m) and d^(h) (H+1, n_c, 3)."""
    from nonlinear import contact_cycle

    coordinates, displacement = wave
    order = np.arange(len(coordinates))
    phases = np.exp(1j * phase * np.outer(np.arange(n_blades), order))  # blade j: e^(i h j psi)
    eta = np.einsum("jh,hm->jm", phases, coordinates).real
    rate = np.einsum("jh,h,hm->jm", phases, 1j * order * omega, coordinates).real
    slider = np.zeros((n_blades, contact.n_contacts, 2))
    kt = np.where(contact.tangential_stiffness > 0.0, contact.tangential_stiffness, 1.0)
    for blade in range(n_blades):
        cycle = contact_cycle(displacement * phases[blade][:, None, None], contact, samples=4096)
        slider[blade] = cycle.displacement[0, :, :2] - cycle.force[0, :, :2] / kt[:, None]
    return RingState(eta, rate, slider)


@njit(cache=True)
def relative_motion(ring, eta, motion):
    """Write d = right eta_j - left eta_(j+1) of all pairs of faces, (blades, 3 n_c)."""
    n_blades = len(eta)
    for j in range(n_blades):
        following = (j + 1) % n_blades
        for row in range(len(ring.right)):
            total = 0.0
            for m in range(eta.shape[1]):
                total += ring.right[row, m] * eta[j, m] - ring.left[row, m] * eta[following, m]
            motion[j, row] = total


@njit(cache=True)
def friction(ring, node, limit, u, slider, force):
    """Move one slider (2,) to its place under the motion u (2,) and write its force; limit: mu N / kt."""
    if ring.cone:
        far = np.sqrt((u[0] - slider[0]) ** 2 + (u[1] - slider[1]) ** 2)
        if far > limit:
            slider[0] = u[0] - limit / far * (u[0] - slider[0])
            slider[1] = u[1] - limit / far * (u[1] - slider[1])
    else:
        for a in range(2):
            slider[a] = min(max(slider[a], u[a] - limit), u[a] + limit)
    for a in range(2):
        force[a] = -ring.tangential_stiffness[node] * (u[a] - slider[a])


@njit(cache=True)
def contact_forces(ring, motion, before, slider, placed, force):
    """Write slider positions and contact forces at `motion`, after `before` with the sliders at `slider`."""
    for j in range(len(motion)):
        for node in range(ring.friction.size):
            first, v0 = 3 * node, ring.interference[node]
            now, then = v0 + motion[j, first + 2], v0 + before[j, first + 2]
            load = ring.normal_stiffness[node] * max(now, 0.0)
            force[j, first + 2] = -load
            if ring.tangential_stiffness[node] == 0.0:
                continue
            placed[j, node] = slider[j, node]
            if then < 0.0 < now:  # re-contact: the share of the step after it
                share = now / (now - then)
                for a in range(2):
                    placed[j, node, a] = motion[j, first + a] - share * (motion[j, first + a] - before[j, first + a])
            limit = ring.friction[node] * load / ring.tangential_stiffness[node]
            u = motion[j, first : first + 2]
            friction(ring, node, limit, u, placed[j, node], force[j, first : first + 2])


@njit(cache=True)
def modal_forces(ring, external, force, total):
    """Write the modal forces of excitation and contacts to `total`, (blades, m); their largest change and size."""
    change, size = 0.0, 0.0
    for j in range(len(total)):
        for m in range(total.shape[1]):
            value = external[j, m]
            for row in range(len(ring.right)):
                value += ring.right[row, m] * force[j, row] - ring.left[row, m] * force[j - 1, row]
            change, size = max(change, abs(value - total[j, m])), max(size, abs(value))
            total[j, m] = value
    return change, size


@njit(cache=True)
def advanced(ring, row, eta, rate, last, total, result):
    """Write eta (row 0) or its rate (row 1) after a step under forces from `last` to `total`."""
    for j in range(len(eta)):
        for m in range(eta.shape[1]):
            a = ring.transition[m, row]
            result[j, m] = a[0] * eta[j, m] + a[1] * rate[j, m] + a[2] * last[j, m] + a[3] * total[j, m]


@njit(cache=True)
def integrate_period(ring, external, state, tip, tip_motion):
    """Advance the state in place by one period of `external` (steps, blades, m); write the motion of blade 0's tip.

    tip (m,); tip_motion (steps,): at the end of each step.
    """
    eta, rate, slider = state
    motion = np.zeros((len(eta), len(ring.right)))
    before, force, placed = motion.copy(), motion.copy(), slider.copy()
    trial, trial_rate, total, last = eta.copy(), rate.copy(), np.zeros_like(eta), np.zeros_like(eta)
    steps = len(external)
    relative_motion(ring, eta, before)
    for step in range(steps + 1):
        for _iteration in range(40):
            relative_motion(ring, trial, motion)
            contact_forces(ring, motion, before, slider, placed, force)
            change, size = modal_forces(ring, external[step % steps], force, total)
            if step == 0:
                break
            advanced(ring, 0, eta, rate, last, total, trial)
            if change < 1e-13 * size:
                break
        if step > 0:
            advanced(ring, 1, eta, rate, last, total, trial_rate)
            eta[:], rate[:] = trial, trial_rate
            tip_motion[step - 1] = np.sum(tip * eta[0])
        last[:], slider[:], before[:] = total, placed, motion


def integrate_ring(modal, contact, point, *, engine_order, force, periods, steps_per_period):
    """Tip motion of blade 0 at the ends of the steps of the last period, started from a harmonic balance solution.

    `point`: (omega, modal coefficients (H+1, m), d^(h) (H+1, n_c, 3)) of that solution.
    """
    omega, *wave = point
    n_blades, phase = modal.n_blades, modal.phase(engine_order)
    ring = ring_of(modal, contact, omega, steps_per_period)
    external = travelling_wave(modal, phase, force, n_blades, steps_per_period)
    state = state_of_wave(modal, contact, phase, omega, wave, n_blades)
    motion = np.empty(steps_per_period)
    for _ in range(periods):
        integrate_period(ring, external, state, modal.outputs["tip"], motion)
    return motion

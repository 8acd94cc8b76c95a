"""Motions at the resonances of the nonlinear modes, from which branches of the forced response start.

A nonlinear mode passes every resonance of its family, also those on isolated branches: these are where the force
that its damping asks for falls again while the amplitude grows. Modes are followed from the end of linear motion,
where the first node slips, lifts off or touches, up to where the damping of the structure alone takes up the
excitation.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from nonlinear.contact.fourier import ComplexArray, to_complex, to_real
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.nonlinear_modes.extended_motion import (
    ExtendedMotion,
    MotionState,
    end_of_linear_motion,
    first_state,
    linear_mode,
)
from nonlinear.nonlinear_modes.mode_curve import STEPS, ModeContinuation, MotionPoint
from rom.cyclic.natural_frequencies import coupled_frequencies
from rom.cyclic.receptance import RelativeReceptance

STEPS_TO_STARTS, TOLERANCE, COSINE = (
    replace(STEPS, largest=0.4),
    1e-6,
    0.5,
)  # the motions only have to lead to solutions
BEFORE = 0.05  # ln of the amplitude below the end of linear motion at which a mode starts
MOST_POINTS = 150


def resonance_motions(
    balance: HarmonicBalance, contact: ContactParameters, static: Array, omega_range: tuple[float, float]
) -> Iterator[tuple[Array, float, int]]:
    """Unknown (n,) of `balance`, frequency (rad/s) and number of the mode of each resonance in the range.

    Shapes: `static` (n_c, 3).
    """
    receptance = balance.receptance
    if balance.frozen_static is not None or not np.any(receptance.modal_force[1]):
        return
    holds = (contact.normal_load(static[:, 2]) > 0.0).astype(float)
    for number in _numbers(receptance, contact, holds, omega_range):
        mode = linear_mode(receptance, contact, holds, number)
        if mode[0] == 0.0:
            continue
        limit = end_of_linear_motion(contact, static, (receptance.modes.relative[1] @ mode[2]).reshape(-1, 3))
        if not 0.0 < limit < np.inf:
            continue
        carrier, state = first_state(receptance, mode, static, np.log(limit) - BEFORE)
        motion = ExtendedMotion(replace(receptance, force=0.0), balance.element, carrier)
        continuation = ModeContinuation(motion, state.displacement.shape, STEPS_TO_STARTS, TOLERANCE, COSINE)
        for found in _passing(continuation, state, receptance.modal_force[1]):
            if omega_range[0] <= found.omega <= omega_range[1]:
                yield found.displacement.reshape(-1), found.omega, number


def _numbers(
    receptance: RelativeReceptance, contact: ContactParameters, holds: Array, omega_range: tuple[float, float]
) -> list[int]:
    """Modes whose frequencies, free, stuck and at small amplitudes, are on both sides of a limit or in the range."""
    kn, kt = contact.normal_stiffness, contact.tangential_stiffness
    springs = ((0.0, 0.0), (kn, kt), (holds * kn, holds * kt))
    every = [coupled_frequencies(receptance.modal, receptance.phase, normal=n, tangential=t) for n, t in springs]
    count = min(len(each) for each in every)
    table = np.array([each[:count] for each in every])
    low, high = omega_range
    return [int(k) + 1 for k in np.flatnonzero((table.min(axis=0) <= high) & (table.max(axis=0) >= low))]


def _passing(continuation: ModeContinuation, state: MotionState, force: ComplexArray) -> Iterator[MotionState]:
    """States at the resonances under a modal force (m,), in phase quadrature with it."""
    start = continuation.solve_at_level(state)
    if start is None:
        return
    damping = continuation.motion.receptance.modes.damping[1]

    def excess(point: MotionPoint, structure_only: bool = False) -> float:
        q, omega = point.linearised.coordinates[1], point.state.omega
        lost = omega * (damping @ np.abs(q) ** 2)
        if not structure_only:
            lost = 2.0 * point.state.damping * omega**2 * np.exp(2.0 * point.state.level)
        return float(np.log(max(lost, 1e-300)) - np.log(max(abs(np.vdot(q, force)), 1e-300)))

    points = [start]
    for count, point in enumerate(continuation.points(start)):
        points.append(point)
        if count > MOST_POINTS or excess(point, structure_only=True) > 0.0:
            break
    for before, after in pairwise(points):
        first, last = excess(before), excess(after)
        if (first > 0.0) != (last > 0.0):
            part = first / (first - last)
            values = before.state.packed() + part * (after.state.packed() - before.state.packed())
            near = before if part < 0.5 else after
            angle = float(np.angle(np.vdot(near.linearised.coordinates[1], force))) - 0.5 * np.pi
            yield _turned(MotionState.unpacked(values, continuation.shape), angle)


def _turned(state: MotionState, angle: float) -> MotionState:
    """The motion ahead by an angle of harmonic 1."""
    motion = to_complex(state.displacement)
    order = np.arange(len(motion))[:, None, None]
    return replace(state, displacement=to_real(motion * np.exp(1j * angle * order)))

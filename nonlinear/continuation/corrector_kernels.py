"""The corrector of small problems, compiled whole: residual, contact forces, bordered system, Newton's method.

The equations are those of `HarmonicBalance` and of `correct` in `corrector`, which solves the problems that are not
small. There a step spends its time in LAPACK; here it would in Python.
"""

import math

import numpy as np

from nonlinear.contact.event_driven import NodeLaws, Scratch, evaluate_nodes
from nonlinear.contact.numba_cache import compiled, inner, inner_counted
from nonlinear.contact.parameters import Array
from nonlinear.continuation.bordered_kernels import NO_FACTORS, UNSOLVED, is_even, solution, subtract, write_rate
from nonlinear.continuation.corrector_state import Iterate, Plane, Structure, Workspace
from nonlinear.harmonic_balance.newton_decisions import (
    MAX_CORRECTIONS,
    SMALLEST_VIBRATION,
    SOFT,
    has_converged,
    stagnations_after,
)

FAILED = -1
SOLUTION, EXACT, RATE = 0, 1, 2  # what is wanted of `correct_in_plane`
TANGENT_ERROR, EXACT_TANGENT = 1e-7, 1e-13  # relative errors of the tangent; where new factors are wanted
PART = 0.1  # relative error of a step: this part of the error of the iterate, which it squares, or of what is wanted
_has_converged, _stagnations_after = inner(has_converged), inner(stagnations_after)


@compiled
def correct_in_plane(
    structure: Structure,
    laws: NodeLaws,
    plane: Plane,
    at: Iterate,
    work: Workspace,
    scratch: Scratch,
    wanted: int,
) -> tuple[int, int]:
    """Solve R(x, p) = 0 in the plane from the iterate on; returns the iterations, or FAILED, and the sign of det.

    Afterwards the iterate holds the solution and the tangent: the last solution of the bordered system, whose right
    side is 1 in the constraint only. `UNSOLVED` in place of the iterations: dense factors were needed, and there are
    none.

    `wanted`: the `SOLUTION`; with the `EXACT` tangent, from factors of the very solution; or in place of the tangent
    the `RATE` of change of the iterate, which is a solution, in the plane with the other parameter in `work`.
    """
    smallest, stagnations, factors = np.inf, 0, (NO_FACTORS, 0)
    for iteration in range(MAX_CORRECTIONS + 1):
        _write_residual(structure, laws, at, work, scratch)
        error = _relative_error(at.residual, at.unknown, structure, work.shares)
        stagnations = _stagnations_after(error, smallest, stagnations)
        converged = wanted == RATE or _has_converged(error, plane.tolerance, plane.round_off, stagnations)
        if not converged and (iteration == MAX_CORRECTIONS or not np.isfinite(error)):
            return FAILED, 0
        last, left = 0.0, PART * max(error, plane.tolerance / error)
        if converged:
            last, left = 1.0, EXACT_TANGENT if wanted == EXACT else TANGENT_ERROR
            for i in range(at.residual.shape[0]):
                at.residual[i] = 0.0
        if wanted == RATE:
            last = 0.0
            write_rate(structure, at, work, work.other_shift, work.other_defect_rate, at.residual)
        factors = solution(structure, plane, at, work, factors, (last, left, converged and wanted == EXACT))
        if factors[0] == UNSOLVED:
            return UNSOLVED, 0
        if converged:
            return iteration, factors[1]
        smallest = min(error, smallest)
        if not _take_step(plane, at):
            return FAILED, 0
    return FAILED, 0


@inner
def _take_step(plane: Plane, at: Iterate) -> bool:
    """Add the solution of the bordered system to the iterate; whether that is near enough to the predicted point."""
    square = 0.0
    for i in range(at.unknown.shape[0]):
        at.unknown[i] += plane.length * at.tangent[i]
        change = at.unknown[i] - plane.unknown[i]
        square += change * change
    at.parameter[0] += plane.parameter_scale * at.change[0]
    shift = (at.parameter[0] - plane.parameter) / plane.parameter_scale
    distance = math.sqrt(square / (plane.length * plane.length) + shift * shift)
    return at.parameter[0] > plane.lowest and distance <= plane.max_distance  # a NaN fails this comparison too


@inner
def _relative_error(residual: Array, unknown: Array, structure: Structure, shares: Array) -> float:
    """`HarmonicBalance.relative_error`."""
    static_residual, static, dynamic_residual, dynamic = 0.0, 0.0, 0.0, 0.0
    floating, bodies = structure.floating, structure.floating.shape[0]
    for k in range(bodies):
        shares[k] = 0.0
        for i in range(floating.shape[1]):
            shares[k] += (1.0 - SOFT) * floating[k, i] * residual[i]
    for i in range(floating.shape[1]):
        value = residual[i]
        for k in range(bodies):
            value -= shares[k] * floating[k, i]
        static_residual += value * value
        static += unknown[i] * unknown[i]
    for i in range(floating.shape[1], unknown.shape[0]):
        dynamic_residual += residual[i] * residual[i]
        dynamic += unknown[i] * unknown[i]
    total = math.sqrt(static + dynamic) + structure.floor
    vibration = max(math.sqrt(dynamic), SMALLEST_VIBRATION * total)
    return max(math.sqrt(dynamic_residual) / vibration, math.sqrt(static_residual + dynamic_residual) / total)


@inner_counted
def _write_residual(structure: Structure, laws: NodeLaws, at: Iterate, work: Workspace, scratch: Scratch) -> None:
    """Contact forces, R and the modal coordinates of the iterate."""
    size, n_contacts, omega, path = at.motion.shape[0], at.motion.shape[1], at.parameter[0], structure.path
    if not path.of_frequency:
        omega = path.omega
        for k in range(n_contacts):
            change = laws.normal_stiffness[k] * path.shift[k] * (at.parameter[0] - path.origin)
            laws.offset[k, 2] = path.load[k] + change
    evaluate_nodes(at.motion, laws, scratch, at.force, at.jacobian, at.state)
    if structure.odd:
        for i in range(3, size):
            if is_even(i):  # round-off, which stiff contacts would amplify
                for k in range(n_contacts):
                    at.force[i, k, 0], at.force[i, k, 1], at.force[i, k, 2] = 0.0, 0.0, 0.0
    for k in range(n_contacts):
        for a in range(3):
            work.contact_force[0, 3 * k + a] = at.force[0, k, a]
            for h in range(1, work.contact_force.shape[0]):
                work.contact_force[h, 3 * k + a] = complex(at.force[2 * h - 1, k, a], at.force[2 * h, k, a])
    for h in range(work.contact_force.shape[0]):
        value, rate, coordinates = work.denominators[h], work.rates[h], work.coordinates[h]
        for m in range(value.shape[0]):
            rotated = 1j * h * structure.damping[h, m]
            value[m] = structure.stiffness[h, m] - structure.inertia * (h * omega) ** 2 + rotated * omega
            rate[m] = rotated - 2.0 * structure.inertia * omega * h * h
        np.dot(structure.adjoint[h], work.contact_force[h], coordinates)
        for m in range(value.shape[0]):
            coordinates[m] = (coordinates[m] + structure.force[h, m]) / value[m]
        np.dot(structure.relative[h], coordinates, work.response[h])
    subtract(at.unknown, work.response, at.residual)
    for i in range(at.residual.shape[0]):
        at.residual[i] -= structure.defect[i]
    if not path.of_frequency:
        for i in range(at.residual.shape[0]):
            at.residual[i] -= (at.parameter[0] - path.origin) * path.defect_rate[i]

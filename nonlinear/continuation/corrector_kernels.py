"""The corrector of small problems, compiled whole: residual, contact forces, Newton's method in the normal plane.

The equations and the decisions are those of `HarmonicBalance` and of `correct` in `corrector`, which solve the
problems that are not small. There a step spends its time in LAPACK; here it would in Python.
"""

import math

import numpy as np

from nonlinear.contact.event_driven import NodeLaws, Scratch, evaluate_nodes
from nonlinear.contact.numba_cache import compiled, inner, inner_counted
from nonlinear.contact.parameters import Array
from nonlinear.continuation.bordered_kernels import (
    Iterate,
    Plane,
    Structure,
    Workspace,
    factorise,
    solve,
    subtract,
    write_rate,
)
from nonlinear.continuation.corrector import (
    CHORD_STEPS,
    MANY_CHORD_STEPS,
    MANY_UNKNOWNS,
    MAX_CORRECTIONS,
    SAME_SYSTEM,
)
from nonlinear.harmonic_balance.residual import SMALLEST_VIBRATION

FAILED = -1
LARGEST_CONTRACTION = 0.25  # of the error of the tangent by a refinement with old factors
TANGENT_ERROR = 1e-5  # relative change of the tangent by the last refinement
MAX_REFINEMENTS = 5


@compiled
def correct_in_plane(
    structure: Structure,
    laws: NodeLaws,
    plane: Plane,
    at: Iterate,
    work: Workspace,
    scratch: Scratch,
    refactorise: bool,
) -> int:
    """Solve R(x, omega) = 0 in the plane from the iterate on; returns the iterations, or FAILED.

    Afterwards the iterate holds the solution and the tangent: the last solution of the bordered system, whose right
    side is 1 in the constraint only.
    """
    chord_steps = CHORD_STEPS if at.unknown.shape[0] < MANY_UNKNOWNS else MANY_CHORD_STEPS
    previous, first, stagnations, factorised = np.inf, np.inf, 0, False
    for iteration in range(MAX_CORRECTIONS + 1):
        _write_residual(structure, laws, at, work, scratch)
        error = _relative_error(at.residual, at.unknown, structure.floor, at.motion.shape[1])
        contraction = error / previous
        if first == np.inf:
            first = contraction
        stagnations = stagnations + 1 if error >= 0.3 * previous else 0
        stagnates = (error <= plane.round_off and stagnations >= 1) or (
            error <= 1e3 * plane.round_off and stagnations >= 3
        )
        if error <= plane.tolerance or stagnates:
            if refactorise or not factorised or not _write_tangent(structure, plane, at, work, first > SAME_SYSTEM):
                factorise(structure, plane, at, work)
                _write_tangent(structure, plane, at, work, False)
            return iteration
        if iteration == MAX_CORRECTIONS or not np.isfinite(error):
            return FAILED
        if not factorised or error * (2.0 * contraction) ** chord_steps > plane.tolerance:
            factorise(structure, plane, at, work)
            first, factorised = np.inf, True
        solve(plane, at, work, 0.0)
        previous = error
        if not _take_step(plane, at):
            return FAILED
    return FAILED


@compiled
def rate_in_plane(
    structure: Structure,
    laws: NodeLaws,
    plane: Plane,
    at: Iterate,
    work: Workspace,
    scratch: Scratch,
    change: tuple[Array, Array],
) -> None:
    """Write the change of a solution in the plane with a parameter of the interference to the tangent, scaled.

    `change`: `shift` and `defect_rate` of the `InterferenceChange`.
    """
    _write_residual(structure, laws, at, work, scratch)
    factorise(structure, plane, at, work)
    write_rate(change[0], change[1], at, work, at.residual)
    solve(plane, at, work, 0.0)


@inner
def _take_step(plane: Plane, at: Iterate) -> bool:
    """Add the solution of the bordered system to the iterate; whether that is near enough to the predicted point."""
    square = 0.0
    for i in range(at.unknown.shape[0]):
        at.unknown[i] += plane.length * at.tangent[i]
        change = at.unknown[i] - plane.unknown[i]
        square += change * change
    at.omega[0] += plane.omega_scale * at.omega[1]
    shift = (at.omega[0] - plane.omega) / plane.omega_scale
    distance = math.sqrt(square / (plane.length * plane.length) + shift * shift)
    return at.omega[0] > 0.0 and distance <= plane.max_distance  # a NaN fails this comparison too


@inner
def _relative_error(residual: Array, unknown: Array, floor: float, n_contacts: int) -> float:
    """`HarmonicBalance.relative_error`."""
    static_residual, static, dynamic_residual, dynamic = 0.0, 0.0, 0.0, 0.0
    for i in range(3 * n_contacts):
        static_residual += residual[i] * residual[i]
        static += unknown[i] * unknown[i]
    for i in range(3 * n_contacts, unknown.shape[0]):
        dynamic_residual += residual[i] * residual[i]
        dynamic += unknown[i] * unknown[i]
    total = math.sqrt(static + dynamic) + floor
    vibration = max(math.sqrt(dynamic), SMALLEST_VIBRATION * total)
    return max(math.sqrt(dynamic_residual) / vibration, math.sqrt(static_residual + dynamic_residual) / total)


@inner_counted
def _write_residual(structure: Structure, laws: NodeLaws, at: Iterate, work: Workspace, scratch: Scratch) -> None:
    """Contact forces, R and the modal coordinates of the iterate."""
    size, n_contacts, omega, path = at.motion.shape[0], at.motion.shape[1], at.omega[0], structure.path
    if path.frequency > 0.0:
        omega = path.frequency
        for k in range(n_contacts):
            change = laws.normal_stiffness[k] * path.shift[k] * (at.omega[0] - path.origin)
            laws.offset[k, 2] = path.load[k] + change
    evaluate_nodes(at.motion, laws, scratch, at.force, at.jacobian, at.state)
    if structure.odd:
        for i in range(3, size):
            if i % 4 == 3 or i % 4 == 0:  # round-off, which stiff contacts would amplify
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
            damping = structure.damping[h, m]
            value[m] = complex(structure.stiffness[h, m] - (h * omega) ** 2, damping * h * omega)
            rate[m] = complex(-2.0 * omega * h * h, damping * h)
        np.dot(structure.adjoint[h], work.contact_force[h], coordinates)
        for m in range(value.shape[0]):
            coordinates[m] = (coordinates[m] + structure.modal_force[h, m]) / value[m]
        np.dot(structure.relative[h], coordinates, work.response[h])
    subtract(at.unknown, work.response, at.residual)
    for i in range(at.residual.shape[0]):
        at.residual[i] -= structure.defect[i]
    if path.frequency > 0.0:
        for i in range(at.residual.shape[0]):
            at.residual[i] -= (at.omega[0] - path.origin) * path.defect_rate[i]


@inner_counted
def _write_tangent(structure: Structure, plane: Plane, at: Iterate, work: Workspace, refine: bool) -> bool:
    """Write the tangent from the last factors; whether its refinement with the Jacobian at the iterate converges.

    Iterative refinement, z - B_0^-1 (B z - e): factors B_0 that solve nearly for B need few products with B.
    """
    for i in range(at.residual.shape[0]):
        at.residual[i] = 0.0
    solve(plane, at, work, 1.0)
    if not refine:
        return True
    previous = np.inf
    for _ in range(MAX_REFINEMENTS):
        tangent, omega = work.tangent, at.omega[1]
        total = omega * omega
        for i in range(tangent.shape[0]):
            tangent[i] = at.tangent[i]
            total += tangent[i] * tangent[i]
        solve(plane, at, work, _write_defect(structure, plane, at, work))
        change = at.omega[1] * at.omega[1]
        at.omega[1] += omega
        for i in range(tangent.shape[0]):
            change += at.tangent[i] * at.tangent[i]
            at.tangent[i] += tangent[i]
        relative = math.sqrt(change / total)
        if not relative <= LARGEST_CONTRACTION * min(previous, 1.0):
            return False
        if relative <= TANGENT_ERROR:
            return True
        previous = relative
    return False


@inner_counted
def _write_defect(structure: Structure, plane: Plane, at: Iterate, work: Workspace) -> float:
    """Write what the tangent leaves of the equations into the residual; returns what it leaves of the constraint."""
    size, n_contacts, path = at.motion.shape[0], at.motion.shape[1], structure.path
    rate = at.omega[1] * plane.omega_scale / plane.length
    fixed = path.frequency > 0.0
    for k in range(n_contacts):
        for a in range(3):
            for i in range(size):
                value = _times_motion(at.jacobian[k, a, :, i], work.tangent, k)
                if fixed:
                    value += at.jacobian[k, a, 2, i, 0] * path.shift[k] * rate
                if i == 0 or i % 2 == 1:
                    work.contact_force[(i + 1) // 2, 3 * k + a] = value
                else:
                    work.contact_force[i // 2, 3 * k + a] += 1j * value
    of_frequency = 0.0 if fixed else rate
    for h in range(work.contact_force.shape[0]):
        coordinates = work.weighted_force[h]
        np.dot(structure.adjoint[h], work.contact_force[h], coordinates)
        for m in range(coordinates.shape[0]):
            moved = coordinates[m] - of_frequency * work.rates[h, m] * work.coordinates[h, m]
            coordinates[m] = moved / work.denominators[h, m]
        np.dot(structure.relative[h], coordinates, work.response[h])
    subtract(work.tangent, work.response, at.residual)
    if fixed:
        for i in range(at.residual.shape[0]):
            at.residual[i] -= rate * path.defect_rate[i]
    last = 1.0 - at.omega[1] * plane.direction_omega / plane.omega_scale
    for i in range(at.residual.shape[0]):
        at.residual[i] *= plane.length
        last -= work.tangent[i] * plane.direction[i] / plane.length
    return last


@inner
def _times_motion(derivative: Array, tangent: Array, node: int) -> float:
    """Product of the derivative (3, 2H+1) of one force with the tangent, (n,), at a node."""
    total, row = 0.0, tangent.shape[0] // derivative.shape[1]
    for b in range(3):
        for j in range(derivative.shape[1]):
            total += derivative[b, j] * tangent[j * row + 3 * node + b]
    return total

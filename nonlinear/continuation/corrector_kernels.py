"""The corrector of small problems, compiled whole: residual, contact forces, bordered system, Newton's method.

The equations and the decisions are those of `HarmonicBalance`, of `BorderedSystem` and of `correct` in `corrector`,
which solve the problems that are not small. There a step spends its time in LAPACK; here it would in Python.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.event_driven import NodeLaws, Scratch, evaluate_nodes
from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.numba_cache import compiled, inner, inner_counted, lapack_lu
from nonlinear.contact.parameters import Array
from nonlinear.contact.return_map import Integers
from nonlinear.harmonic_balance.newton_decisions import (
    MAX_CORRECTIONS,
    SAME_SYSTEM,
    SMALLEST_VIBRATION,
    chord_steps,
    has_converged,
    needs_factors,
    stagnations_after,
)

FAILED = -1
LARGEST_CONTRACTION = 0.25  # of the error of the tangent by a refinement with old factors
TANGENT_ERROR = 1e-5  # relative change of the tangent by the last refinement
MAX_REFINEMENTS = 5
_lu = lapack_lu()
_DOUBLE = ord("d")
_chord_steps, _needs_factors = inner(chord_steps), inner(needs_factors)
_has_converged, _stagnations_after = inner(has_converged), inner(stagnations_after)


class Path(NamedTuple):
    """What the parameter is (see `Parameter`): the frequency, or the interference."""

    of_frequency: bool  # the parameter is the frequency
    omega: float  # else the excitation frequency, rad/s
    origin: float  # the parameter at which the loads at rest are those given
    load: Array  # (n_c,), unclipped loads at rest, N
    # `shift`, `defect_rate`: (n_c,), see `InterferenceChange`
    shift: Array
    defect_rate: Array


class Structure(NamedTuple):
    """The structure as the kernels take it."""

    relative: ComplexArray  # (H+1, 3 n_c, m), relative contact motion of the modes
    adjoint: ComplexArray  # (H+1, m, 3 n_c), its adjoint
    modal_force: ComplexArray  # (H+1, m), external modal force
    stiffness: Array  # (H+1, m), w_m^2 of the modes of each harmonic
    damping: Array  # (H+1, m), 2 zeta_m w_m
    odd: bool  # no even harmonics (see `HarmonicBalance`)
    floor: float  # added to the norm of the displacement in the relative error, m
    defect: Array  # (n,), residual that counts as zero, m
    path: Path  # what the parameter is


class Plane(NamedTuple):
    """The arc-length constraint (see `corrector.NormalPlane`) and the tolerances of the iteration."""

    unknown: Array  # (n,), x of the predicted point
    direction: Array  # (n,), x part of the normal
    parameter: float  # p of the predicted point
    direction_parameter: float  # p part of the normal
    length: float  # scale of displacements in the metric
    parameter_scale: float  # scale of the parameter in the metric
    max_distance: float  # from the predicted point
    lowest: float  # what the parameter must exceed
    # `tolerance`, `round_off`: see `ConvergenceMonitor`
    tolerance: float
    round_off: float


class Iterate(NamedTuple):
    """State (x, p) and all that belongs to it; all arrays are written."""

    unknown: Array  # (n,), x
    residual: Array  # (n,), R
    motion: Array  # (2H+1, n_c, 3), another view of `unknown`
    parameter: Array  # (1,), p
    change: Array  # (1,), p part of the last solution of the bordered system, scaled
    # `force`, `jacobian`, `state`: see `ContactForces`
    force: Array
    jacobian: Array
    state: Integers
    tangent: Array  # (n,), x part of the last solution of the bordered system, scaled


class Workspace(NamedTuple):
    """Scratch of the kernels."""

    denominators: ComplexArray  # (H+1, m), of the modal sum
    rates: ComplexArray  # (H+1, m), their derivatives in w
    coordinates: ComplexArray  # (H+1, m), modal coordinates
    weighted_force: ComplexArray  # (H+1, m), modal forces
    contact_force: ComplexArray  # (H+1, 3 n_c), f
    response: ComplexArray  # (H+1, 3 n_c), d
    # (H+1, 3 n_c, 3 n_c), G; that of a fixed frequency, and G^(0), which does not depend on it, are given
    receptance: ComplexArray
    weighted: ComplexArray  # (3 n_c, m), the modes divided by their denominators
    # df/dx in rows: force coefficient, node, force component; columns: displacement component, coefficient
    by_row: Array
    coupling: Array  # (n, n), G df/dx; columns in the order node, component, coefficient
    # `dR_dp`, `tangent`: (n,), scaled
    dR_dp: Array
    tangent: Array
    columns: Integers  # (n,), columns of `coupling` that are active
    active: Integers  # (n,), unknowns that are active
    passive: Integers  # (n,), unknowns that are passive
    # bordered system, rows of the active unknowns and the constraint; used as far as their number needs
    matrix: Array
    pivots: NDArray[np.int32]
    right: Array


@inner
def subtract(unknown: Array, response: ComplexArray, residual: Array) -> None:
    """Write the unknown minus the response in real coefficients."""
    count = response.shape[1]
    for i in range(count):
        residual[i] = unknown[i] - response[0, i].real
    for h in range(1, response.shape[0]):
        first = (2 * h - 1) * count
        for i in range(count):
            residual[first + i] = unknown[first + i] - response[h, i].real
            residual[first + count + i] = unknown[first + count + i] - response[h, i].imag


@inner_counted
def factorise(structure: Structure, plane: Plane, at: Iterate, work: Workspace) -> tuple[int, int]:
    """Factorise the bordered system at the iterate (see `BorderedSystem`): number of active unknowns, sign of det."""
    if structure.path.of_frequency:
        _write_receptance(structure, work)
    n_active = _list_active(at.jacobian, structure.odd, work)
    _write_coupling(at.jacobian, work)
    if not structure.path.of_frequency:
        write_rate(structure.path.shift, structure.path.defect_rate, at, work, work.dR_dp)
    else:
        for h in range(work.rates.shape[0]):
            for m in range(work.rates.shape[1]):
                work.weighted_force[h, m] = -work.rates[h, m] * work.coordinates[h, m] / work.denominators[h, m]
            np.dot(structure.relative[h], work.weighted_force[h], work.response[h])
        for i in range(work.dR_dp.shape[0]):
            at.tangent[i] = 0.0
        subtract(at.tangent, work.response, work.dR_dp)
    for i in range(work.dR_dp.shape[0]):
        work.dR_dp[i] *= plane.parameter_scale / plane.length
    count = n_active + 1
    matrix = work.matrix[: count * count].reshape(count, count)
    _write_bordered(plane, matrix, work)
    _lu(_DOUBLE, count, count, matrix.ctypes, count, work.pivots.ctypes)
    sign = 1
    for i in range(count):
        if matrix[i, i] < 0.0:
            sign = -sign
        elif not matrix[i, i] > 0.0:
            sign = 0
        if work.pivots[i] != i + 1:
            sign = -sign
    return n_active, sign


@inner_counted
def _write_receptance(structure: Structure, work: Workspace) -> None:
    """Write G at the frequency of the denominators."""
    for h in range(1, work.rates.shape[0]):
        for m in range(work.rates.shape[1]):
            work.weighted_force[h, m] = 1.0 / work.denominators[h, m]
        for i in range(work.weighted.shape[0]):
            for m in range(work.weighted.shape[1]):
                work.weighted[i, m] = structure.relative[h, i, m] * work.weighted_force[h, m]
        np.dot(work.weighted, structure.adjoint[h], work.receptance[h])


@inner
def write_rate(shift: Array, defect_rate: Array, at: Iterate, work: Workspace, rate: Array) -> None:
    """Write dR/dp of a parameter p of the interference (see `InterferenceChange`) from G df/dx, which is written."""
    size = at.jacobian.shape[3]
    for i in range(rate.shape[0]):
        total, source = -defect_rate[i], work.coupling[i]
        for k in range(shift.shape[0]):
            total -= shift[k] * source[(3 * k + 2) * size]
        rate[i] = total


@inner
def _list_active(jacobian: Array, odd: bool, work: Workspace) -> int:
    """List the active unknowns, those on which a contact force depends; returns their number."""
    n_contacts, size = jacobian.shape[0], jacobian.shape[3]
    n_active, n_passive = 0, 0
    for k in range(n_contacts):
        for b in range(3):
            depends = _any(jacobian[k, 0, b]) or _any(jacobian[k, 1, b]) or _any(jacobian[k, 2, b])
            for j in range(size):
                unknown = (j * n_contacts + k) * 3 + b
                if depends and not (odd and j > 2 and (j % 4 == 3 or j % 4 == 0)):
                    work.columns[n_active], work.active[n_active] = (3 * k + b) * size + j, unknown
                    n_active += 1
                else:
                    work.passive[n_passive] = unknown
                    n_passive += 1
    return n_active


@inner
def _any(matrix: Array) -> bool:
    """Whether a matrix has an entry that is not zero."""
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            if matrix[i, j] != 0.0:
                return True
    return False


@inner
def _write_coupling(jacobian: Array, work: Workspace) -> None:
    """Write G df/dx."""
    n_contacts, size = jacobian.shape[0], jacobian.shape[3]
    for k in range(n_contacts):
        for a in range(3):
            for b in range(3):
                _copy_rows(jacobian[k, a, b], work.by_row[:, k, a, b * size : (b + 1) * size])
    for t in range(3 * n_contacts):
        for k in range(n_contacts):
            columns = slice(k * 3 * size, (k + 1) * 3 * size)
            for h in range(work.receptance.shape[0]):
                receptance = work.receptance[h, t, 3 * k : 3 * k + 3]
                if h == 0:
                    _multiply_static(receptance, work.by_row[0, k], work.coupling[t, columns])
                    continue
                row = (2 * h - 1) * 3 * n_contacts + t
                real, imag = work.coupling[row, columns], work.coupling[row + 3 * n_contacts, columns]
                _multiply(receptance, work.by_row[2 * h - 1, k], work.by_row[2 * h, k], real, imag)


@inner
def _copy_rows(source: Array, target: Array) -> None:
    """Copy a matrix; a loop, since array expressions take long to compile."""
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            target[i, j] = source[i, j]


@inner
def _multiply_static(receptance: ComplexArray, force: Array, product: Array) -> None:
    """Write the product of three numbers with the three rows of `force`, real parts."""
    r0, r1, r2 = receptance[0].real, receptance[1].real, receptance[2].real
    f0, f1, f2 = force[0], force[1], force[2]
    for c in range(product.shape[0]):
        product[c] = r0 * f0[c] + r1 * f1[c] + r2 * f2[c]


@inner
def _multiply(receptance: ComplexArray, force: Array, force_imag: Array, product: Array, product_imag: Array) -> None:
    """The same for a harmonic, real and imaginary parts."""
    r0, r1, r2 = receptance[0].real, receptance[1].real, receptance[2].real
    i0, i1, i2 = receptance[0].imag, receptance[1].imag, receptance[2].imag
    f0, f1, f2 = force[0], force[1], force[2]
    g0, g1, g2 = force_imag[0], force_imag[1], force_imag[2]
    for c in range(product.shape[0]):
        product[c] = r0 * f0[c] - i0 * g0[c] + r1 * f1[c] - i1 * g1[c] + r2 * f2[c] - i2 * g2[c]
        product_imag[c] = r0 * g0[c] + i0 * f0[c] + r1 * g1[c] + i1 * f1[c] + r2 * g2[c] + i2 * f2[c]


@inner
def _write_bordered(plane: Plane, matrix: Array, work: Workspace) -> None:
    """Write the bordered matrix of the active unknowns."""
    count, length = matrix.shape[0] - 1, plane.length
    border = matrix[count]
    for c in range(count):
        border[c] = plane.direction[work.active[c]] / length
    border[count] = plane.direction_parameter / plane.parameter_scale
    for r in range(count):
        row, source = matrix[r], work.coupling[work.active[r]]
        for c in range(count):
            row[c] = -source[work.columns[c]]
        row[r] += 1.0
        row[count] = work.dR_dp[work.active[r]]
    for p in range(work.active.shape[0] - count):
        unknown = work.passive[p]
        factor, source = plane.direction[unknown] / length, work.coupling[unknown]
        for c in range(count):
            border[c] += factor * source[work.columns[c]]
        border[count] -= factor * work.dR_dp[unknown]


@inner
def solve(plane: Plane, at: Iterate, work: Workspace, n_active: int, last: float) -> None:
    """Solve the factorised system for the residual of the iterate and the right side `last` of the constraint."""
    count, right = n_active + 1, work.right
    for r in range(count - 1):
        right[r] = -at.residual[work.active[r]] / plane.length
    right[count - 1] = last
    n_passive = work.active.shape[0] - count + 1
    for p in range(n_passive):
        unknown = work.passive[p]
        right[count - 1] += plane.direction[unknown] * at.residual[unknown] / (plane.length * plane.length)
    solve_factorised(work.matrix, work.pivots, right, count)
    for r in range(count - 1):
        at.tangent[work.active[r]] = right[r]
    at.change[0] = right[count - 1]
    for p in range(n_passive):
        unknown, source = work.passive[p], work.coupling[work.passive[p]]
        value = -at.residual[unknown] / plane.length - work.dR_dp[unknown] * right[count - 1]
        for c in range(count - 1):
            value += source[work.columns[c]] * right[c]
        at.tangent[unknown] = value


@inner
def solve_factorised(
    factors: Array | ComplexArray, pivots: NDArray[np.int32], right: Array | ComplexArray, count: int
) -> None:
    """Solve A x = b, real or complex.

    `factors`: LAPACK's of A transposed, so that row i holds U^T up to the diagonal, then L^T.
    """
    for i in range(count):
        row = factors[i * count : (i + 1) * count]
        right[i] = (right[i] - _dot(row, right, 0, i)) / row[i]
    for i in range(count - 2, -1, -1):
        row = factors[i * count : (i + 1) * count]
        right[i] -= _dot(row, right, i + 1, count)
    for i in range(count - 1, -1, -1):
        other = pivots[i] - 1
        right[i], right[other] = right[other], right[i]


@inner
def _dot(one: Array | ComplexArray, other: Array | ComplexArray, first: int, last: int) -> Any:
    """Sum of the products of the entries from `first` up to `last`, in four parts, added at once."""
    s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0
    k = first
    while k + 4 <= last:
        s0 += one[k] * other[k]
        s1 += one[k + 1] * other[k + 1]
        s2 += one[k + 2] * other[k + 2]
        s3 += one[k + 3] * other[k + 3]
        k += 4
    while k < last:
        s0 += one[k] * other[k]
        k += 1
    return (s0 + s1) + (s2 + s3)


@compiled
def correct_in_plane(
    structure: Structure,
    laws: NodeLaws,
    plane: Plane,
    at: Iterate,
    work: Workspace,
    scratch: Scratch,
    refactorise: bool,
) -> tuple[int, int]:
    """Solve R(x, p) = 0 in the plane from the iterate on; returns the iterations, or FAILED, and the sign of det.

    Afterwards the iterate holds the solution and the tangent: the last solution of the bordered system, whose right
    side is 1 in the constraint only.
    """
    steps, n_active, sign = _chord_steps(at.unknown.shape[0]), 0, 0
    previous, first, stagnations, factorised = np.inf, np.inf, 0, False
    for iteration in range(MAX_CORRECTIONS + 1):
        _write_residual(structure, laws, at, work, scratch)
        error = _relative_error(at.residual, at.unknown, structure.floor, at.motion.shape[1])
        contraction = error / previous
        if first == np.inf:
            first = contraction
        stagnations = _stagnations_after(error, previous, stagnations)
        if _has_converged(error, plane.tolerance, plane.round_off, stagnations):
            if (
                refactorise
                or not factorised
                or not _write_tangent(structure, plane, at, work, n_active, first > SAME_SYSTEM)
            ):
                n_active, sign = factorise(structure, plane, at, work)
                _write_tangent(structure, plane, at, work, n_active, False)
            return iteration, sign
        if iteration == MAX_CORRECTIONS or not np.isfinite(error):
            return FAILED, 0
        if not factorised or _needs_factors(error, contraction, steps, plane.tolerance):
            n_active, sign = factorise(structure, plane, at, work)
            first, factorised = np.inf, True
        solve(plane, at, work, n_active, 0.0)
        previous = error
        if not _take_step(plane, at):
            return FAILED, 0
    return FAILED, 0


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
    """Write the change of a solution in the plane with another parameter, of the interference, to the tangent.

    `change`: `shift` and `defect_rate` of the `InterferenceChange`.
    """
    _write_residual(structure, laws, at, work, scratch)
    n_active, _ = factorise(structure, plane, at, work)
    write_rate(change[0], change[1], at, work, at.residual)
    solve(plane, at, work, n_active, 0.0)


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
    size, n_contacts, omega, path = at.motion.shape[0], at.motion.shape[1], at.parameter[0], structure.path
    if not path.of_frequency:
        omega = path.omega
        for k in range(n_contacts):
            change = laws.normal_stiffness[k] * path.shift[k] * (at.parameter[0] - path.origin)
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
    if not path.of_frequency:
        for i in range(at.residual.shape[0]):
            at.residual[i] -= (at.parameter[0] - path.origin) * path.defect_rate[i]


@inner_counted
def _write_tangent(
    structure: Structure, plane: Plane, at: Iterate, work: Workspace, n_active: int, refine: bool
) -> bool:
    """Write the tangent from the last factors; whether its refinement with the Jacobian at the iterate converges.

    Iterative refinement, z - B_0^-1 (B z - e): factors B_0 that solve nearly for B need few products with B.
    """
    for i in range(at.residual.shape[0]):
        at.residual[i] = 0.0
    solve(plane, at, work, n_active, 1.0)
    if not refine:
        return True
    previous = np.inf
    for _ in range(MAX_REFINEMENTS):
        tangent, parameter = work.tangent, at.change[0]
        total = parameter * parameter
        for i in range(tangent.shape[0]):
            tangent[i] = at.tangent[i]
            total += tangent[i] * tangent[i]
        solve(plane, at, work, n_active, _write_defect(structure, plane, at, work))
        change = at.change[0] * at.change[0]
        at.change[0] += parameter
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
    rate = at.change[0] * plane.parameter_scale / plane.length
    fixed = not path.of_frequency
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
    last = 1.0 - at.change[0] * plane.direction_parameter / plane.parameter_scale
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

"""The bordered linear system of the compiled corrector: its factors, dense or condensed, and its solution.

With G the receptance of each harmonic, K = df/dx, c = dR/dp and the border (t, e),

    [ I - G K   c ] [ x ]   [ b   ]
    [ t         e ] [ z ] = [ b_e ].

Dense factors are those of this matrix B without the passive unknowns. Condensed factors have Q G^ Q^T, G^ = Q^T G Q,
in place of G, where Q are a few real motions of the contact face, the same for all harmonics and frequencies. Then,
with u = G^ Q^T K x,

    [ I - G^ Q^T K Q   G^ Q^T K c ] [ u ]   [ G^ Q^T K b ]
    [ t Q              e - t c    ] [ z ] = [ b_e - t b  ],      x = b + Q u - c z,

and the determinants are equal. What a solution leaves of the equations is formed with B of the iterate itself: near
factors, condensed ones or those of another iterate, give the solution by iterative refinement.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.numba_cache import inner, inner_counted, lapack_lu, woven
from nonlinear.contact.parameters import Array
from nonlinear.continuation.corrector_state import (
    FORCES,
    MOTIONS,
    PAIRS,
    Condensation,
    Iterate,
    Plane,
    Structure,
    Workspace,
)

# what is in the place of the number of active unknowns of dense factors
CONDENSED, NO_FACTORS, UNSOLVED = -1, -2, -3
LARGEST_CONTRACTION = 0.1  # of the error of a solution by a refinement
FIRST_CONTRACTION = 0.1  # least estimate from the first refinement
MAX_REFINEMENTS = 10
BOUND = 1e3  # factor on the norms of products of the iteration matrix with the probes: it fails with probability 1e-9
_lu = lapack_lu()
_DOUBLE = ord("d")


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


@woven
def factorise(structure: Structure, plane: Plane, at: Iterate, work: Workspace, condensed: bool) -> tuple[int, int]:
    """Factorise the bordered system at the iterate: number of active unknowns or `CONDENSED`, sign of det."""
    path, found = structure.path, CONDENSED
    if path.of_frequency:
        for i in range(work.dR_dp.shape[0]):
            work.dR_dp[i] = 0.0
        _write_response(structure, work, False, 1.0)
        subtract(work.dR_dp, work.response, work.dR_dp)
    else:
        write_rate(structure, at, work, path.shift, path.defect_rate, work.dR_dp)
    for i in range(work.dR_dp.shape[0]):
        work.dR_dp[i] *= plane.parameter_scale / plane.length
    if not condensed:
        found = _list_active(at.jacobian, structure.odd, work)
    count = 1 + (work.condensed.reduced.size if condensed else found)
    matrix = work.matrix[: count * count].reshape(count, count)
    if condensed:
        _write_condensed(structure, plane, at, work, matrix)
    else:
        if path.of_frequency:
            _write_receptance(structure, work)
        _write_coupling(at.jacobian, work)
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
    return found, sign


@inner_counted
def _write_response(structure: Structure, work: Workspace, forced: bool, of_frequency: float) -> None:
    """Write the response to the contact forces, if there are any, and to a change of the frequency."""
    for h in range(work.response.shape[0]):
        coordinates = work.weighted_force[h]
        if forced:
            np.dot(structure.adjoint[h], work.contact_force[h], coordinates)
        else:
            for m in range(coordinates.shape[0]):
                coordinates[m] = 0.0
        for m in range(coordinates.shape[0]):
            moved = coordinates[m] - of_frequency * work.rates[h, m] * work.coordinates[h, m]
            coordinates[m] = moved / work.denominators[h, m]
        np.dot(structure.relative[h], coordinates, work.response[h])


@inner_counted
def write_rate(
    structure: Structure, at: Iterate, work: Workspace, shift: Array, defect_rate: Array, rate: Array
) -> None:
    """Write dR/dp of a parameter p of the interference (see `InterferenceChange`)."""
    for i in range(rate.shape[0]):
        work.tangent[i] = 0.0
    for k in range(shift.shape[0]):
        work.tangent[3 * k + 2] = shift[k]
    _write_forces(structure, at, work)
    _write_response(structure, work, True, 0.0)
    for i in range(rate.shape[0]):
        rate[i] = -defect_rate[i]
    subtract(rate, work.response, rate)


@inner
def _write_forces(structure: Structure, at: Iterate, work: Workspace) -> None:
    """Write the contact forces K x of the motion x in `work.tangent`."""
    rows, n_contacts = at.motion.shape[0], at.motion.shape[1]
    for k in range(n_contacts):
        for a in range(3):
            for h in range(work.contact_force.shape[0]):
                work.contact_force[h, 3 * k + a] = 0.0
        for pair in range(PAIRS):
            a, derivative = 3 * k + FORCES[pair], at.jacobian[k, FORCES[pair], MOTIONS[pair]]
            for j in range(rows):
                work.of_dof[j] = work.tangent[3 * (j * n_contacts + k) + MOTIONS[pair]]
            for i in range(rows):
                if structure.odd and is_even(i):  # round-off, which stiff contacts would amplify
                    continue
                value = _dot(derivative[i], work.of_dof, 0, rows)
                if i == 0 or i % 2 == 1:
                    work.contact_force[(i + 1) // 2, a] += value
                else:
                    work.contact_force[i // 2, a] += 1j * value


@inner
def is_even(coefficient: int) -> bool:
    """Whether a coefficient is one of an even harmonic above 0."""
    return coefficient > 2 and (coefficient % 4 == 3 or coefficient % 4 == 0)


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
def _list_active(jacobian: Array, odd: bool, work: Workspace) -> int:
    """List the active unknowns, those on which a contact force depends; returns their number."""
    n_contacts, size = jacobian.shape[0], jacobian.shape[3]
    n_active, n_passive = 0, 0
    for k in range(n_contacts):
        for b in range(3):
            depends = _any(jacobian[k, 0, b]) or _any(jacobian[k, 1, b]) or _any(jacobian[k, 2, b])
            for j in range(size):
                unknown = (j * n_contacts + k) * 3 + b
                if depends and not (odd and is_even(j)):
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


@woven
def _write_condensed(structure: Structure, plane: Plane, at: Iterate, work: Workspace, matrix: Array) -> None:
    """Write the condensed bordered matrix, see the head of the file."""
    c, rows, r = work.condensed, at.motion.shape[0], work.condensed.motions.shape[1]
    size = rows * r
    _copy_stiffness(at.jacobian, structure.odd, c.stiffness)
    np.dot(c.products, c.stiffness, c.coupling)
    for p in range(r):
        for q in range(r):
            source = c.coupling[p * r + q]
            for i in range(rows):
                for j in range(rows):
                    c.projected[i * r + p, j * r + q] = source[i * rows + j]
    np.dot(c.static, c.projected[:r], c.moved[:r])
    for h in range(1, work.rates.shape[0]):
        _write_flexibility(c, work.denominators[h], h)
        first = (2 * h - 1) * r
        np.dot(c.flexibility[h - 1], c.projected[first : first + 2 * r], c.moved[first : first + 2 * r])
    for i in range(size):
        for j in range(size):
            matrix[i, j] = -c.moved[i, j]
        matrix[i, i] += 1.0
    _reduce(work, work.dR_dp, work.right)
    np.dot(plane.direction.reshape(rows, c.motions.shape[0]), c.motions, c.reduced)
    border, corner = c.reduced.reshape(size), plane.direction_parameter / plane.parameter_scale
    for i in range(size):
        matrix[i, size] = work.right[i]
        matrix[size, i] = border[i] / plane.length
    for i in range(work.dR_dp.shape[0]):
        corner -= plane.direction[i] * work.dR_dp[i] / plane.length
    matrix[size, size] = corner


@inner
def _copy_stiffness(jacobian: Array, odd: bool, stiffness: Array) -> None:
    """Copy the matrices of K, without even harmonics in an odd balance."""
    size = jacobian.shape[3]
    for k in range(jacobian.shape[0]):
        for pair in range(PAIRS):
            source, target = jacobian[k, FORCES[pair], MOTIONS[pair]], stiffness[PAIRS * k + pair]
            for i in range(size):
                for j in range(size):
                    target[i * size + j] = 0.0 if odd and (is_even(i) or is_even(j)) else source[i, j]


@inner_counted
def _write_flexibility(c: Condensation, denominators: ComplexArray, h: int) -> None:
    """Write G^ of harmonic h for real and imaginary parts."""
    r = c.weighted.shape[0]
    for m in range(denominators.shape[0]):
        inverse = 1.0 / denominators[m]
        for p in range(r):
            c.weighted[p, m] = c.relative[h, p, m] * inverse
    np.dot(c.weighted, c.adjoint[h], c.receptance)
    target = c.flexibility[h - 1]
    for p in range(r):
        for q in range(r):
            value = c.receptance[p, q]
            target[p, q], target[p, r + q] = value.real, -value.imag
            target[r + p, q], target[r + p, r + q] = value.imag, value.real


@inner_counted
def _reduce(work: Workspace, motion: Array, reduced: Array) -> None:
    """Write G^ Q^T K x of a motion x, (n,)."""
    c = work.condensed
    rows, r = c.reduced.shape
    _multiply_stiffness(c.stiffness, motion, work.of_dof, c.force)
    np.dot(c.force, c.motions, c.reduced)
    for p in range(r):
        reduced[p] = _dot(c.static[p], c.reduced[0], 0, r)
    forces = c.reduced.reshape(rows * r)
    for h in range(1, (rows + 1) // 2):
        first = (2 * h - 1) * r
        pair = forces[first : first + 2 * r]
        for p in range(2 * r):
            reduced[first + p] = _dot(c.flexibility[h - 1, p], pair, 0, 2 * r)


@inner
def _multiply_stiffness(stiffness: Array, motion: Array, of_dof: Array, force: Array) -> None:
    """Write K x, (2H+1, 3 n_c), of a motion x, (n,); `of_dof` is scratch."""
    rows, width = force.shape
    for i in range(rows):
        for t in range(width):
            force[i, t] = 0.0
    for k in range(width // 3):
        for pair in range(PAIRS):
            matrix, a = stiffness[PAIRS * k + pair], 3 * k + FORCES[pair]
            for j in range(rows):
                of_dof[j] = motion[j * width + 3 * k + MOTIONS[pair]]
            for i in range(rows):
                force[i, a] += _dot(matrix[i * rows : (i + 1) * rows], of_dof, 0, rows)


@woven
def _solve(plane: Plane, at: Iterate, work: Workspace, factors: int, last: float) -> None:
    """Solve with the factors for the residual of the iterate and the right side `last` of the constraint."""
    if factors == CONDENSED:
        _solve_condensed(plane, at, work, last)
    else:
        _solve_dense(plane, at, work, factors, last)


@woven
def _solve_condensed(plane: Plane, at: Iterate, work: Workspace, last: float) -> None:
    """Solve with condensed factors, see the head of the file."""
    c, right, motion = work.condensed, work.right, at.tangent
    size, n = c.reduced.size, motion.shape[0]
    for i in range(n):
        motion[i] = -at.residual[i] / plane.length
        last -= plane.direction[i] * motion[i] / plane.length
    _reduce(work, motion, right)
    right[size] = last
    solve_factorised(work.matrix, work.pivots, right, size + 1)
    np.dot(right[:size].reshape(c.reduced.shape), c.transposed, c.force)
    moved = c.force.reshape(n)
    at.change[0] = right[size]
    for i in range(n):
        motion[i] += moved[i] - work.dR_dp[i] * right[size]


@woven
def _solve_dense(plane: Plane, at: Iterate, work: Workspace, n_active: int, last: float) -> None:
    """Solve with dense factors, those of the active unknowns."""
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


@woven
def solution(
    structure: Structure,
    plane: Plane,
    at: Iterate,
    work: Workspace,
    factors: tuple[int, int],
    right: tuple[float, float, bool],
) -> tuple[int, int]:
    """Solve the bordered system of the iterate for its residual; returns the factors and the sign of det.

    With the factors in hand where the refinement converges; else with new ones, dense where condensed ones do not
    serve; `UNSOLVED` where there are no dense ones.

    `right`: the right side of the constraint, the relative error that may be left, and whether the sign is to be that
    of the very iterate, whose residual is zero then.

    With the matrix P of condensed factors det B = det P det(I - M), M = I - P^-1 B. Where all eigenvalues of M are
    below 1, the sign is that of det P: the norm of a power of M is bounded by its products with random vectors, see
    `CondensedFactors`.
    """
    kind, sign, last, left, exact, new = factors[0], factors[1], right[0], right[1], right[2], False
    if exact:
        kind = NO_FACTORS
    for i in range(at.residual.shape[0]):
        work.unsolved[i] = at.residual[i]
    while True:
        dense, serves = kind >= 0, kind != NO_FACTORS
        probe = work.condensed.probes.shape[0] - 1 if exact and not dense else -1
        while serves and probe >= -1:
            serves = _refined(structure, plane, at, work, (kind, probe), (last, np.inf if new and dense else left))
            probe -= 1
        condensed = not dense and not new and work.condensed.motions.shape[1] > 0
        if not serves and not condensed and work.coupling.shape[0] == 0:
            kind, sign, serves = UNSOLVED, 0, True
        if serves:
            break
        kind, sign = factorise(structure, plane, at, work, condensed)
        new = True
    return kind, sign


@woven
def _refined(
    structure: Structure,
    plane: Plane,
    at: Iterate,
    work: Workspace,
    start: tuple[int, int],
    right: tuple[float, float],
) -> bool:
    """Solve the bordered system of the iterate by iterative refinement; whether that leaves so small an error.

    With the factors B_0 and the contraction c of the last change of z by z - B_0^-1 (B z - b) the next one is c times
    as large. The first change of a tangent tells little of c, as it may be small for its right side alone. Without
    refinement where the error may be infinite.

    `start`: the factors, and the number of the random vector that is multiplied by M, see `solution`, -1: none.
    `right`: the right side of the constraint, the relative error that may be left.
    """
    (kind, probe), (last, left), n = start, right, work.tangent.shape[0]
    parameter, total, previous, defect = 0.0, 0.0, 1.0, last
    for i in range(n):
        at.residual[i], work.tangent[i] = work.unsolved[i], 0.0
    if probe >= 0:
        parameter = work.condensed.probes[probe, n]
        for i in range(n):
            work.tangent[i] = work.condensed.probes[probe, i]
    for refinements in range(MAX_REFINEMENTS + 1):
        if refinements > 0 or probe >= 0:
            at.change[0] = parameter
            defect = _write_defect(structure, plane, at, work, 0.0 if probe >= 0 else last)
        _solve(plane, at, work, kind, defect)
        if left == np.inf:
            return True
        change, before = at.change[0] * at.change[0], total
        parameter += at.change[0]
        total = parameter * parameter
        for i in range(n):
            change += at.tangent[i] * at.tangent[i]
            at.tangent[i] += work.tangent[i]
            work.tangent[i] = at.tangent[i]
            total += at.tangent[i] * at.tangent[i]
        at.change[0] = parameter
        if probe >= 0:
            if BOUND * math.sqrt(2.0 / math.pi * total) < 1.0:
                return True
        elif refinements > 0:
            relative = math.sqrt(change / before)
            contraction = relative / previous
            if not contraction <= LARGEST_CONTRACTION:
                return False
            if refinements == 1 and last != 0.0:
                contraction = max(contraction, FIRST_CONTRACTION)
            if contraction * relative <= left:
                return True
            previous = relative
    return False


@woven
def _write_defect(structure: Structure, plane: Plane, at: Iterate, work: Workspace, last: float) -> float:
    """Write what `work.tangent` leaves of the equations to the residual; returns what it leaves of the constraint."""
    path = structure.path
    rate = at.change[0] * plane.parameter_scale / plane.length
    if path.of_frequency:
        _write_forces(structure, at, work)
        _write_response(structure, work, True, rate)
    else:
        for k in range(path.shift.shape[0]):
            work.tangent[3 * k + 2] += path.shift[k] * rate
        _write_forces(structure, at, work)
        for k in range(path.shift.shape[0]):
            work.tangent[3 * k + 2] = at.tangent[3 * k + 2]
        _write_response(structure, work, True, 0.0)
    subtract(work.tangent, work.response, at.residual)
    if not path.of_frequency:
        for i in range(at.residual.shape[0]):
            at.residual[i] -= rate * path.defect_rate[i]
    last -= at.change[0] * plane.direction_parameter / plane.parameter_scale
    for i in range(at.residual.shape[0]):
        at.residual[i] = work.unsolved[i] + plane.length * at.residual[i]
        last -= work.tangent[i] * plane.direction[i] / plane.length
    return last

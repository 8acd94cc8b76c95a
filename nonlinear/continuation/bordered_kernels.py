"""The bordered system of small problems, compiled: the same as `BorderedSystem`, and the arrays of the corrector."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.numba_cache import inner, inner_counted, lapack_lu
from nonlinear.contact.parameters import Array
from nonlinear.contact.return_map import Integers

_lu = lapack_lu()
_DOUBLE = ord("d")


class Path(NamedTuple):
    """How the balance changes with a parameter in the place of the frequency (see `InterferencePath`)."""

    frequency: float  # excitation frequency, rad/s; 0: it is the parameter itself
    origin: float  # the parameter at which the loads at rest are those given
    load: Array  # (n_c,), unclipped loads at rest, N
    shift: Array  # (n_c,), see `InterferenceChange`
    defect_rate: Array  # (n_c,), see `InterferenceChange`


class Structure(NamedTuple):
    """The structure as the kernels take it."""

    relative: ComplexArray  # (H+1, 3 n_c, m), relative contact motion of the modes, and its adjoint
    adjoint: ComplexArray  # (H+1, 3 n_c, m), relative contact motion of the modes, and its adjoint
    modal_force: ComplexArray  # (H+1, m), external modal force
    stiffness: Array  # (H+1, m), w_m^2 and 2 zeta_m w_m of the modes of each harmonic
    damping: Array  # (H+1, m), w_m^2 and 2 zeta_m w_m of the modes of each harmonic
    odd: bool  # no even harmonics (see `HarmonicBalance`)
    floor: float  # added to the norm of the displacement in the relative error, m
    defect: Array  # (n,), residual that counts as zero, m
    path: Path  # what takes the place of the frequency


class Plane(NamedTuple):
    """The arc-length constraint (see `corrector.NormalPlane`) and the tolerances of the iteration."""

    unknown: Array  # (n,), predicted point and normal of the plane, x part
    direction: Array  # (n,), predicted point and normal of the plane, x part
    omega: float  # the same, frequency part
    direction_omega: float  # the same, frequency part
    length: float  # scales of the metric
    omega_scale: float  # scales of the metric
    max_distance: float  # from the predicted point
    tolerance: float  # see `ConvergenceMonitor`
    round_off: float  # see `ConvergenceMonitor`


class Iterate(NamedTuple):
    """State (x, omega) and all that belongs to it; all arrays are written."""

    unknown: Array  # (n,), x and R
    residual: Array  # (n,), x and R
    motion: Array  # (2H+1, n_c, 3), another view of `unknown`
    # (2,), frequency, or what takes its place; its change in the last solution of the bordered system, scaled
    omega: Array
    force: Array  # see `ContactForces`
    jacobian: Array  # see `ContactForces`
    state: Integers  # see `ContactForces`
    tangent: Array  # (n,), x part of the last solution of the bordered system, scaled


class Workspace(NamedTuple):
    """Scratch of the kernels."""

    # (H+1, m), denominators of the modal sum, their derivatives in w, modal coordinates, forces
    denominators: ComplexArray
    rates: ComplexArray  # (H+1, m), denominators of the modal sum, their derivatives in w, modal coordinates, forces
    # (H+1, m), denominators of the modal sum, their derivatives in w, modal coordinates, forces
    coordinates: ComplexArray
    # (H+1, m), denominators of the modal sum, their derivatives in w, modal coordinates, forces
    weighted_force: ComplexArray
    contact_force: ComplexArray  # (H+1, 3 n_c), f and d
    response: ComplexArray  # (H+1, 3 n_c), f and d
    # (H+1, 3 n_c, 3 n_c), G, and the modes divided by their denominators. G^(0), which does not depend on the
    # frequency, is given
    receptance: ComplexArray
    # (H+1, 3 n_c, 3 n_c), G, and the modes divided by their denominators. G^(0), which does not depend on the
    # frequency, is given
    weighted: ComplexArray
    # df/dx in rows: force coefficient, node, force component; columns: displacement component, coefficient
    by_row: Array
    coupling: Array  # (n, n), G df/dx; columns in the order node, component, coefficient
    dR_domega: Array  # (n,), scaled
    tangent: Array  # (n,), scaled
    columns: Integers  # (n,), columns of `coupling` and unknowns that are active, and unknowns that are passive
    active: Integers  # (n,), columns of `coupling` and unknowns that are active, and unknowns that are passive
    passive: Integers  # (n,), columns of `coupling` and unknowns that are active, and unknowns that are passive
    # bordered system, rows of the active unknowns and the constraint; used as far as their number needs
    matrix: Array
    # bordered system, rows of the active unknowns and the constraint; used as far as their number needs
    pivots: NDArray[np.int32]
    right: Array  # bordered system, rows of the active unknowns and the constraint; used as far as their number needs
    # (3,), number of active unknowns, sign of the determinant, 1 where G is that of a fixed frequency
    sizes: Integers


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
def factorise(structure: Structure, plane: Plane, at: Iterate, work: Workspace) -> None:
    """Factorise the bordered system at the iterate (see `BorderedSystem`)."""
    _write_receptance(structure, work)
    _list_active(at.jacobian, structure.odd, work)
    _write_coupling(at.jacobian, work)
    if structure.path.frequency > 0.0:
        write_rate(structure.path.shift, structure.path.defect_rate, at, work, work.dR_domega)
    else:
        for h in range(work.rates.shape[0]):
            for m in range(work.rates.shape[1]):
                work.weighted_force[h, m] = -work.rates[h, m] * work.coordinates[h, m] / work.denominators[h, m]
            np.dot(structure.relative[h], work.weighted_force[h], work.response[h])
        for i in range(work.dR_domega.shape[0]):
            at.tangent[i] = 0.0
        subtract(at.tangent, work.response, work.dR_domega)
    for i in range(work.dR_domega.shape[0]):
        work.dR_domega[i] *= plane.omega_scale / plane.length
    count = work.sizes[0] + 1
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
    work.sizes[1] = sign


@inner_counted
def _write_receptance(structure: Structure, work: Workspace) -> None:
    """Write G at the frequency of the denominators; at a fixed frequency once."""
    if work.sizes[2] == 1:
        return
    for h in range(1, work.rates.shape[0]):
        for m in range(work.rates.shape[1]):
            work.weighted_force[h, m] = 1.0 / work.denominators[h, m]
        for i in range(work.weighted.shape[0]):
            for m in range(work.weighted.shape[1]):
                work.weighted[i, m] = structure.relative[h, i, m] * work.weighted_force[h, m]
        np.dot(work.weighted, structure.adjoint[h], work.receptance[h])
    if structure.path.frequency > 0.0:
        work.sizes[2] = 1


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
def _list_active(jacobian: Array, odd: bool, work: Workspace) -> None:
    """List the active unknowns: those on which a contact force depends."""
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
    work.sizes[0] = n_active


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
    border[count] = plane.direction_omega / plane.omega_scale
    for r in range(count):
        row, source = matrix[r], work.coupling[work.active[r]]
        for c in range(count):
            row[c] = -source[work.columns[c]]
        row[r] += 1.0
        row[count] = work.dR_domega[work.active[r]]
    for p in range(work.active.shape[0] - count):
        unknown = work.passive[p]
        factor, source = plane.direction[unknown] / length, work.coupling[unknown]
        for c in range(count):
            border[c] += factor * source[work.columns[c]]
        border[count] -= factor * work.dR_domega[unknown]


@inner
def solve(plane: Plane, at: Iterate, work: Workspace, last: float) -> None:
    """Solve the factorised system for the residual of the iterate and the right side `last` of the constraint."""
    count, right = work.sizes[0] + 1, work.right
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
    at.omega[1] = right[count - 1]
    for p in range(n_passive):
        unknown, source = work.passive[p], work.coupling[work.passive[p]]
        value = -at.residual[unknown] / plane.length - work.dR_domega[unknown] * right[count - 1]
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

"""The eigenvalue problem T(sigma) z = [I - G(sigma) K(sigma)] z = 0 of perturbations, the same for every basis.

T is nonlinear in sigma. Linearised around a shift s, N + mu dN, mu = sigma - s, it has an eigenvalue next to zero,
found by inverse iteration; where that lies T is linearised again (successive linear problems, Ruhe 1973). One strip,
abs(Im sigma) <= 1/2, holds each exponent once: it is cut into slices, T is linearised in the middle of each.

All modes (`HillEigenproblem`), few modes (`ModalEigenproblem`) and few contact motions (`ClosedRefinement`) bring T.

References
----------
A. Ruhe, Algorithms for the nonlinear eigenvalue problem, SIAM Journal on Numerical Analysis 10(4), 1973.
"""

import math
from collections.abc import Callable
from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.stability.general_eigenvalues import general_eigenvalues
from nonlinear.stability.hessenberg_qr import qr_eigenvalues
from nonlinear.stability.modal_condensation import Matrix

# all distances in units of omega
MAX_ITERATIONS = 8
MAX_INVERSE_ITERATIONS = 12
CONVERGED = 1e-6  # change of an eigenvalue at which the iteration ends, and an imaginary part that is round-off
ROUND_OFF = 1e-9  # by which a shift is kept off an eigenvalue
ACCURATE = 1e-3  # relative change of mu at which the inverse iteration ends
SHARP = 1e-6  # 1 - cos of the angle between two iterates of an eigenvector
FASTEST = 100.0  # growth and decay beyond which no eigenvalue is sought: exp(2 pi sigma) nears its overflow
SAME = 1e-5  # distance up to which two converged eigenvalues are one
SLICE_WIDTH = 0.25  # of the slices that the strip is cut into
WIDTH = 1.0 / 3.0  # the same where only the poles are states that may come near a slice
OVERLAP = 0.02  # an eigenvalue this near to a border counts on both sides of it


class Linearisation(Protocol):
    """T around one shift, N + mu dN."""

    @property
    def shift(self) -> complex:
        """The shift."""

    @property
    def size(self) -> int:
        """Number of unknowns."""

    @property
    def columns(self) -> int:
        """Number of vectors of an inverse iteration: several where as many eigenvalues may be nearly as near.

        0: the nearest of all eigenvalues takes less time.
        """

    def change(self, vectors: ComplexArray) -> ComplexArray:
        """-dN times vectors (n,) or (n, columns)."""

    def solved(self, right: ComplexArray) -> ComplexArray:
        """N^-1 times vectors (n,) or (n, columns)."""


class Pencil(NamedTuple):
    """sigma E_c z = A_c z: one eigenvalue problem, or many of one size."""

    # `matrix`, `descriptor`: (..., n_z, n_z), A_c and E_c
    matrix: Matrix
    descriptor: Matrix

    def eigenvalues(self) -> ComplexArray:
        """All of them, (..., n_z)."""
        matrix = np.linalg.solve(self.descriptor, self.matrix)
        if np.iscomplexobj(matrix):
            return qr_eigenvalues(matrix)
        return general_eigenvalues(matrix)  # in conjugate pairs


class Near(NamedTuple):
    """The eigenvalue mu of a linearisation next to zero."""

    change: complex  # mu
    vector: ComplexArray | None  # of length 1; None: inverse iteration does not end, several are as near
    sharp: bool = False  # whether the vector has converged too


class Refined(NamedTuple):
    """An eigenvalue of T, and whether it is exact."""

    value: complex
    exact: bool = True


Around = TypeVar("Around", bound=Linearisation)


class Eigenproblem(Protocol[Around]):
    """T in one basis."""

    @property
    def conjugate_pairs(self) -> bool:
        """Whether the eigenvalues come in complex conjugate pairs."""

    def around(self, value: complex) -> Around:
        """T linearised next to an approximate eigenvalue."""

    def refined(self, linear: Around, value: complex, near: Near) -> Refined | None:
        """The eigenvalue of T near that of a linearisation, `value`; None: it is to be linearised again there."""

    def undecided(self, linear: Around, near: Near) -> Near | Refined | None:
        """What stands in for `near` without a vector; None: the iteration leads to no eigenvalue."""


def converged(problem: Eigenproblem[Around], value: complex) -> Refined | None:
    """The eigenvalue that successive linear problems lead to from `value`; None if they lead to none."""
    vector = None
    for _ in range(MAX_ITERATIONS):
        value = on_axis(value, problem.conjugate_pairs)
        if not abs(value.real) < FASTEST:  # nor with a NaN
            return None
        linear = problem.around(value)
        near: Near | Refined | None = nearest(linear, vector)
        if isinstance(near, Near) and near.vector is None:
            near = problem.undecided(linear, near)
        if not isinstance(near, Near):
            return near
        value, vector = linear.shift + near.change, near.vector
        found = problem.refined(linear, value, near)
        if found is not None:
            return found._replace(value=on_axis(found.value, problem.conjugate_pairs))
    return None


def nearest(linear: Linearisation, vector: ComplexArray | None = None) -> Near:
    """The eigenvalue of a linearisation next to zero, by inverse iteration from `vector`."""
    size, columns = linear.size, min(linear.columns, linear.size)
    if not columns:
        return Near(complex("nan"), None)
    vectors = np.exp(1j * np.outer(np.arange(size), np.arange(columns)))
    if vector is not None and vector.size == size:  # another number of states near another shift
        vectors[:, 0] = vector
    vectors = vectors[:, 0] if columns == 1 else vectors
    mu = complex("nan")
    for _ in range(MAX_INVERSE_ITERATIONS):
        vectors = vectors / length_of(vectors) if columns == 1 else np.linalg.qr(vectors)[0]
        after = linear.solved(linear.change(vectors))
        inverse, z = _leading(vectors, after)
        if inverse == 0.0:  # nothing depends on sigma
            break
        before, mu = mu, 1.0 / inverse
        if abs(mu - before) <= ACCURATE * abs(mu) + ROUND_OFF:
            length = length_of(z)
            return Near(mu, z / length, bool(abs(inverse) >= (1.0 - SHARP) * length))
        vectors = after
    return Near(mu, None)


def _leading(vectors: ComplexArray, after: ComplexArray) -> tuple[complex, ComplexArray]:
    """The leading eigenvalue of N^-1 (-dN) in the span of orthonormal `vectors`, and N^-1 (-dN) times its vector."""
    if vectors.ndim == 1:
        return complex(np.vdot(vectors, after)), after
    values, parts = np.linalg.eig(vectors.conj().T @ after)
    leading = int(np.argmax(np.abs(values)))
    return complex(values[leading]), after @ parts[:, leading]


def same_direction(one: ComplexArray, other: ComplexArray) -> bool:
    """Whether two iterates, the first of unit length, are one vector but for its length and phase."""
    return bool(abs(np.vdot(one, other)) >= (1.0 - SHARP) * length_of(other))


def length_of(vector: ComplexArray) -> float:
    """Euclidean norm; NumPy's takes twice the time for few numbers."""
    return math.sqrt(np.vdot(vector, vector).real)


def on_axis(value: complex, conjugate_pairs: bool) -> complex:
    """The eigenvalue without an imaginary part that is round-off."""
    return complex(value.real) if conjugate_pairs and abs(value.imag) < CONVERGED else value


def in_strip(sigma: ComplexArray) -> ComplexArray:
    """The eigenvalues of the strip, the least stable first."""
    sigma = sigma[np.abs(sigma.imag) <= 0.5 + OVERLAP]
    return sigma[np.argsort(-sigma.real)]


def eigenvalues_by_slices(
    eigenvalues: Callable[[complex], ComplexArray], width: float, conjugate_pairs: bool
) -> ComplexArray:
    """Eigenvalues in the strip, slice by slice; of two that come near each other at a border one is taken.

    `eigenvalues` gives those of T linearised around a shift.
    """
    inside, beside, last = [], [], math.ceil(0.5 / width - 0.51)
    for centre in width * np.arange(0 if conjugate_pairs else -last, last + 1):
        values = eigenvalues(1j * float(centre) if centre else 0.0)
        distance = np.abs(values.imag - centre)
        if conjugate_pairs and centre > 0.0:
            values, distance = np.append(values, values.conj()), np.append(distance, distance)
        near = distance <= width / 2 + OVERLAP
        within = near & ((distance <= width / 2) | (np.abs(values.imag) > 0.5))  # beyond the strip there is no slice
        inside.append(values[within])
        beside.append(values[near & ~within])
    found = np.concatenate(inside)
    for value in np.concatenate(beside):
        if not np.any(np.abs(found - value) < OVERLAP):
            found = np.append(found, value)
    return found


def all_refined(
    refine: Callable[[complex], Refined | None], values: ComplexArray, conjugate_pairs: bool
) -> ComplexArray:
    """The eigenvalues that successive linear problems lead to from `values`; what leads to none is spurious.

    Equal blades far apart have equal eigenvalues: from one value the problem is solved once.
    """
    found, starts = list[complex](), list[complex]()
    if conjugate_pairs:  # the others are the complex conjugates
        values = values[values.imag > -CONVERGED]
    for start in values[np.argsort(np.abs(values))]:  # spurious ones are large and may lead to true ones
        if any(abs(start - other) < CONVERGED for other in starts):
            continue
        starts.append(start)
        refined = refine(complex(start))
        if refined is not None and all(abs(refined.value - other) > SAME for other in found):
            found.append(refined.value)
    mirrored = [value.conjugate() for value in found if conjugate_pairs and abs(value.imag) > SAME]
    return np.array(found + mirrored, dtype=complex)

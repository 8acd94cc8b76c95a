"""The contact as a feedback around the contact-free modal model: its Jacobian, then the memory of its sliders.

The algebra of `SliderMemoryFeedback` is the Sherman-Morrison-Woodbury formula. Motions and forces of the contact
stand in rows of contact dofs (`ContactRows`) or of few motions (`MotionRows`).

References
----------
W. W. Hager, Updating the inverse of a matrix, SIAM Review 31(2), 1989.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.parameters import Array
from nonlinear.stability.eigenproblem import Pencil
from nonlinear.stability.modal_condensation import CondensedModes, Matrix, NodeBlocks
from nonlinear.stability.slider_memory import NodeMemory, SliderMemory, last_two


@dataclass(frozen=True)
class ContactRows:
    """Rows of the contact dofs in the eigenvalue problem: (S, nodes, 3), S Fourier coefficients."""

    node: NDArray[np.int64]  # (M,), node of each slider, or of each stick interval, among the nodes that touch
    n_nodes: int  # number of nodes that touch
    # (S, S), real Fourier coefficients from harmonic amplitudes; None where the rows are real coefficients themselves
    to_real: Matrix | None
    first_row: int  # 1 where harmonic 0 is left out, else 0
    size: int  # number of Fourier coefficients, with that of harmonic 0

    def positions(self, memory: SliderMemory) -> Matrix:
        """Q^T (M, n): the slider positions dw(theta_s) = Q^T d = du + r dd_n."""
        basis: Matrix = memory.basis
        if self.to_real is not None:
            basis = basis @ self.to_real
        return self._spread(basis, memory.direction) + self._spread(basis * memory.dw_dn[:, None], 2)

    def at_sliders(self, memory: SliderMemory, columns: Matrix) -> Matrix:
        """The rows of each slider's own dof among all (n, k): (M, S, k)."""
        result: Matrix = columns[self._places(memory)]
        return result

    def forces(self, memory: SliderMemory, force: Matrix) -> Matrix:
        """Coefficients (M, S) of forces at the sliders, in all rows: (n,)."""
        result = np.zeros(3 * self.n_nodes * force.shape[1], dtype=force.dtype)
        np.add.at(result, self._places(memory), force)
        return result

    def contact(self, values: Matrix) -> NodeBlocks:
        """Jacobians (M, 2, 3, 2H+1, 2H+1) of the friction of nodes."""
        if self.to_real is not None:
            values = np.linalg.inv(self.to_real) @ values @ self.to_real
        size = self.size - self.first_row
        result = np.zeros((self.n_nodes, size, 3, size, 3), dtype=values.dtype)
        result[self.node, :, :2] = values.transpose(0, 3, 1, 4, 2)[:, self.first_row :, :, self.first_row :]
        return NodeBlocks(result)

    def _spread(self, values: Matrix, direction: NDArray[np.int64] | int) -> Matrix:
        """`values` (M, S) in the rows of each node and `direction`: (M, n)."""
        count = self.node.size
        result = np.zeros((count, values.shape[1], self.n_nodes, 3), dtype=values.dtype)
        result[np.arange(count), :, self.node, direction] = values
        return result[:, self.first_row :].reshape(count, -1)

    def _places(self, memory: SliderMemory) -> NDArray[np.int64]:
        """Rows of each slider's own dof, (M, S)."""
        first = 3 * self.node + memory.direction
        return np.asarray(first[:, None] + 3 * self.n_nodes * np.arange(self.size - self.first_row))


@dataclass(frozen=True)
class MotionRows:
    """Rows (S, r) of few contact motions, d = D v, in S real Fourier coefficients."""

    node: NDArray[np.int64]  # (M,), node of each slider, or of each stick interval, among the nodes that touch
    motions: Array  # (n, r), D
    first_row: int  # 1 where harmonic 0 is left out, else 0
    to_real: ClassVar[None] = None

    def positions(self, memory: SliderMemory) -> Matrix:
        """Q^T D (M, n): the slider positions of the motions."""
        slider = self._of_slider(memory) + memory.dw_dn[:, None] * self.motions[3 * self.node + 2]
        basis = memory.basis[:, self.first_row :]
        return np.asarray((basis[:, :, None] * slider[:, None]).reshape(self.node.size, -1))

    def at_sliders(self, memory: SliderMemory, columns: Matrix) -> Matrix:
        """What rows (n, k) of the motions are at each slider's own dof: (M, S, k)."""
        shape = -1, self.motions.shape[1], columns.shape[1]
        return np.asarray(np.einsum("mr,srk->msk", self._of_slider(memory), columns.reshape(shape), optimize=True))

    def forces(self, memory: SliderMemory, force: Matrix) -> Matrix:
        """Coefficients (M, S) of forces at the sliders, on the motions: (n,)."""
        return np.asarray(force.T @ self._of_slider(memory)).ravel()

    def contact(self, values: Matrix) -> Matrix:
        """Jacobians (M, 2, 3, 2H+1, 2H+1) of the friction of nodes, D^T K D."""
        every = self.motions.reshape(-1, 3, self.motions.shape[1])[self.node]
        return in_motions(values, every[:, :2], every, self.first_row)

    def _of_slider(self, memory: SliderMemory) -> Array:
        """The motions at each slider's own dof, (M, r)."""
        return np.asarray(self.motions[3 * self.node + memory.direction])


def in_motions(values: Matrix, rows: Array, columns: Array, first_row: int) -> Matrix:
    """Jacobians of nodes in few motions, the sum of rows^T K columns over the nodes.

    Shapes: `values` (M, a, b, 2H+1, 2H+1), `rows` (M, a, r), `columns` (M, a, r).
    """
    kept = values[..., first_row:, first_row:]
    nodes, a, b, size, _ = kept.shape
    r = rows.shape[2]
    by_column = kept.transpose(0, 1, 3, 4, 2).reshape(nodes, a * size * size, b) @ columns
    result = rows.reshape(nodes * a, r).T @ by_column.reshape(nodes * a, size * size * r)
    return np.asarray(result.reshape(r, size, size, r).transpose(1, 0, 2, 3).reshape(size * r, size * r))


@dataclass(frozen=True)
class Factors:
    """LU factors of a matrix, or of many. LAPACK itself: its wrappers take as long as the solutions of small ones."""

    parts: tuple[tuple[Any, Any], ...]  # of each matrix those of its transpose, whose columns are contiguous
    many: bool

    @classmethod
    def of(cls, matrix: Matrix) -> "Factors":
        """Factorise `matrix` (n, n) or (k, n, n), C-contiguous; it is overwritten."""
        from scipy.linalg.lapack import dgetrf, zgetrf

        factorise, many = zgetrf if np.iscomplexobj(matrix) else dgetrf, matrix.ndim > 2
        if not matrix.size:  # nothing touches
            return cls(tuple((one, None) for one in (matrix if many else [matrix])), many)
        return cls(tuple(factorise(one.T, overwrite_a=True)[:2] for one in (matrix if many else [matrix])), many)

    def solved(self, right: Matrix) -> Matrix:
        """The inverse times columns (n,) or (n, m); (k, n, m) of many matrices."""
        if not self.many:
            return _solved(*self.parts[0], right, 1)
        return np.stack([_solved(*part, one, 1) for part, one in zip(self.parts, right, strict=True)])

    def rows_solved(self, rows: Matrix) -> Matrix:
        """Rows (n,) or (m, n) times the inverse; (k, m, n) of many matrices."""
        if not self.many:
            return _solved(*self.parts[0], rows.T, 0).T
        return np.stack([_solved(*part, one.T, 0).T for part, one in zip(self.parts, rows, strict=True)])


def _solved(upper: Any, pivots: Any, right: Matrix, transposed: int) -> Matrix:
    from scipy.linalg.lapack import dgetrs, zgetrs

    if not upper.size:
        return right
    if upper.dtype != float:
        return np.asarray(zgetrs(upper, pivots, right, trans=transposed)[0])
    if np.iscomplexobj(right):
        return _solved(upper, pivots, right.real, transposed) + 1j * _solved(upper, pivots, right.imag, transposed)
    return np.asarray(dgetrs(upper, pivots, right, trans=transposed)[0])


def add_identity(matrix: Matrix) -> Matrix:
    """`matrix` (..., n, n) with 1 added to its diagonal, in place."""
    diagonal = np.einsum("...ii->...i", matrix)  # a view: to index the entries takes three times as long
    diagonal += 1.0
    return matrix


@dataclass(frozen=True)
class ContactFeedback:
    """The feedback f = K d around sigma z = A z + B f, d = C z + (G_0 + sigma G_1) f.

    With

        X = (I - G_0 K)^-1,    Y = (I - K G_0)^-1 = I + S G_0,    S = K X = Y K

    the forces are f = (S + sigma S') C z to first order in sigma, S' = S G_1 S, and so

        sigma z = (A + B S C + sigma B S' C) z.

    The products with B have n_z rows; X, Y and S are never formed. All matrices may be those of many problems.
    """

    model: CondensedModes  # A, B, C, G_0 and G_1
    contact: NodeBlocks | Matrix  # K, the Jacobian of the contact forces
    factors: Factors  # of I - G_0 K, the return difference

    @classmethod
    def closed(cls, model: CondensedModes, contact: NodeBlocks | Matrix) -> "ContactFeedback":
        """Close K around the model."""
        return cls(model, contact, Factors.of(add_identity(model.flexibility @ -np.asarray(contact))))

    def times_x(self, rows: Matrix) -> Matrix:
        """`rows` X, (k, n): rows of d as rows of the displacement C z without contact forces."""
        return self.factors.rows_solved(rows)

    def x_times(self, column: Matrix) -> Matrix:
        """X times a column (n,): the displacement of one without contact forces."""
        return self.factors.solved(column)

    def times_s(self, rows: Matrix) -> Matrix:
        """`rows` S, (k, n): rows of f as rows of C z."""
        return self.times_x(rows @ self.contact)

    def times_y(self, rows: Matrix, rows_s: Matrix) -> Matrix:
        """`rows` Y, (k, n), from `rows_s` = `rows` S: rows of all forces as rows of external ones."""
        return rows + rows_s @ self.model.flexibility

    @cached_property
    def b_s(self) -> Matrix:
        """B S, (n_z, n)."""
        return self.times_x(self.model.input_matrix @ self.contact)

    @cached_property
    def b_y(self) -> Matrix:
        """B Y, (n_z, n)."""
        return self.model.input_matrix + self.b_s @ self.model.flexibility

    @cached_property
    def b_s_g1(self) -> Matrix:
        """B S G_1, (n_z, n)."""
        return self.b_s @ self.model.flexibility_derivative

    @cached_property
    def b_s_derivative(self) -> Matrix:
        """B S' = B S G_1 S, (n_z, n)."""
        return self.times_s(self.b_s_g1)

    def pencil(self, change: "tuple[Matrix, Matrix] | Matrix | None" = None, shift: complex = 0.0) -> Pencil:
        """The problem with K + (sigma - shift) dK, K this one: S changes by Y dK X.

        Shapes: `change` (n, n), dK; or (n, k) and (k, n), its factors.
        """
        model = self.model
        state, derivative = self.b_s, self.b_s_g1 @ self.contact
        if change is not None:
            inputs, outputs = change if isinstance(change, tuple) else (change, None)
            of_change = self.b_y @ inputs if outputs is None else (self.b_y @ inputs) @ outputs
            if shift:
                state = state - shift * self.times_x(of_change)
            derivative = derivative + of_change
        matrix = model.state_matrix + state @ model.output_matrix
        return Pencil(matrix, add_identity(-(self.times_x(derivative) @ model.output_matrix)))


class MemoryTerms(NamedTuple):
    """What the slider memory adds to sigma z = (A + B S C + sigma B S' C) z at one sigma, each (n_z, n_z)."""

    state: Matrix  # B (S(sigma) - S) C
    derivative: Matrix  # its derivative in sigma
    flexibility: Matrix  # B (S(sigma) G_1 S(sigma) - S') C


class MemoryFactors(NamedTuple):
    """`MemoryTerms` at one sigma as products of low rank; C_m' as in `SliderMemoryFeedback`."""

    dw: Matrix  # (M, n_z), slider positions X_m C_m
    # `state`, `derivative`, `flexibility`: (n_z, M), factors that `dw` is multiplied by
    state: Matrix
    derivative: Matrix
    flexibility: Matrix
    inputs: Matrix  # (n_z, M), b_m P X_m, the factor of C_m' in the term `flexibility`


@dataclass(frozen=True)
class SliderMemoryFeedback:
    """The forces P(sigma) Q^T d of M stick intervals, beside f = K d.

    With dw = Q^T d = C_m z + V P dw and X_m = (I - V P)^-1 the memory changes B S C by B_m P X_m C_m. A prime is the
    derivative in sigma that the flexibility derivative G_1 makes:

        B_m = B Y,          B_m' = B S G_1 Y
        C_m = Q^T X C,      C_m' = Q^T X G_1 S C
        V   = Q^T X G_0,    V'   = Q^T X G_1 Y
    """

    # `memory`, `rows`: the stick intervals, and the rows of their nodes
    memory: SliderMemory
    rows: ContactRows | MotionRows
    # `input_matrix`, `input_derivative`: (n_z, n), b_m and B_m'
    input_matrix: Matrix
    input_derivative: Matrix
    # `output_matrix`, `output_derivative`: (M, n_z), c_m and C_m'
    output_matrix: Matrix
    output_derivative: Matrix
    # `feedthrough`, `feedthrough_derivative`: (M, n), V and V'
    feedthrough: Matrix
    feedthrough_derivative: Matrix
    slider_rows: Matrix  # (M, n), Q^T X
    loop: ContactFeedback  # the loop of the contact Jacobian

    @classmethod
    def closed(
        cls, memory: SliderMemory, rows: ContactRows | MotionRows, loop: ContactFeedback
    ) -> "SliderMemoryFeedback":
        """Close the memory around the `loop` of the contact Jacobian."""
        model = loop.model
        q_x = loop.times_x(rows.positions(memory))
        q_x_g1 = q_x @ model.flexibility_derivative
        q_x_g1_s = loop.times_s(q_x_g1)
        return cls(
            memory,
            rows,
            input_matrix=loop.b_y,
            input_derivative=loop.times_y(loop.b_s_g1, loop.b_s_derivative),
            output_matrix=q_x @ model.output_matrix,
            output_derivative=q_x_g1_s @ model.output_matrix,
            feedthrough=q_x @ model.flexibility,
            feedthrough_derivative=loop.times_y(q_x_g1, q_x_g1_s),
            slider_rows=q_x,
            loop=loop,
        )

    def x_times(self, sigma: complex, column: Matrix) -> Matrix:
        """X(sigma) = X + X G_0 P X_m Q^T X times a column (n,): the displacement of one without contact forces."""
        force = _memory_forces(self.memory, self.rows, sigma)[0]
        difference = -np.sum(self._feedthrough_at_sliders * force, axis=2)
        difference[np.diag_indices_from(difference)] += 1.0
        motion = np.linalg.solve(difference, self.slider_rows @ column)
        added = self.rows.forces(self.memory, motion[:, None] * force)
        return self.loop.x_times(column + (self.loop.model.flexibility @ added[:, None])[:, 0])

    def terms(self, sigma: complex) -> MemoryTerms:
        """The terms of the memory at `sigma`."""
        factors = self.factors(sigma)
        flexibility = factors.flexibility @ factors.dw + factors.inputs @ self.output_derivative
        return MemoryTerms(factors.state @ factors.dw, factors.derivative @ factors.dw, flexibility)

    def factors(self, sigma: complex) -> MemoryFactors:
        """The terms of the memory at `sigma` as products with M rows."""
        values, derivatives = self._times_forces(sigma)
        n_z, size = len(self.input_matrix), len(self.feedthrough)
        last = 2 * n_z + size
        b_p, b_p_g1, v_p, v_p_g1 = values[:n_z], values[n_z : 2 * n_z], values[2 * n_z : last], values[last:]
        b_dp, v_dp = derivatives[:n_z], derivatives[2 * n_z : last]
        x_m = np.linalg.inv(add_identity(-v_p))
        b_p_x = b_p @ x_m
        return MemoryFactors(
            dw=x_m @ self.output_matrix,
            state=b_p,
            derivative=b_dp + b_p_x @ v_dp,
            flexibility=b_p_g1 + b_p_x @ v_p_g1,
            inputs=b_p_x,
        )

    @cached_property
    def _at_sliders(self) -> Matrix:
        """Rows of B_m, B_m', V and V' at the contact dof of each stick interval: (M, 2 n_z + 2 M, coefficients)."""
        parts = self.input_matrix, self.input_derivative, self.feedthrough, self.feedthrough_derivative
        columns = self.rows.at_sliders(self.memory, np.concatenate(parts).T)
        return np.ascontiguousarray(columns.transpose(0, 2, 1))

    @cached_property
    def _feedthrough_at_sliders(self) -> Matrix:
        """Columns of V at the contact dof of each stick interval, (M, M, coefficients)."""
        return np.ascontiguousarray(self.rows.at_sliders(self.memory, self.feedthrough.T).transpose(2, 0, 1))

    def _times_forces(self, sigma: complex) -> tuple[Matrix, Matrix]:
        """B_m, B_m', V and V', one below the other, times P(sigma), and times its derivative: (2 n_z + 2 M, M)."""
        values = np.stack(_memory_forces(self.memory, self.rows, sigma), axis=2)
        at_sliders = self._at_sliders
        if np.iscomplexobj(values) and not np.iscomplexobj(at_sliders):  # a product of real matrices is faster
            product = (at_sliders @ values.view(float)).view(complex)
        else:
            product = at_sliders @ values
        return product[:, :, 0].T, product[:, :, 1].T


def _memory_forces(memory: SliderMemory, rows: ContactRows | MotionRows, sigma: complex) -> tuple[Matrix, Matrix]:
    """P(sigma), f = P dw(theta_s), and its derivative: coefficients (M, S) at the slider of each interval."""
    force, derivative = memory.force(sigma) if rows.to_real is None else memory.force_in_harmonics(sigma)
    return force[:, rows.first_row :], derivative[:, rows.first_row :]


@dataclass(frozen=True)
class NodeMemoryFeedback:
    """The contact Jacobian K(sigma) in place of K where a friction cone changes those of nodes as a whole.

    S(sigma) = K(sigma) (I - G_0 K(sigma))^-1 is solved for at each sigma; dS = Y dK X.
    """

    # `memory`, `rows`: the sliders, and the rows of their nodes
    memory: NodeMemory
    rows: ContactRows | MotionRows
    loop: ContactFeedback  # the loop at sigma = 0

    def terms(self, sigma: complex) -> MemoryTerms:
        """The terms of the memory at `sigma`."""
        derivative = self.rows.contact(self.memory.jacobian(sigma)[1])
        loop = self._closed(sigma)
        output_matrix = self.loop.model.output_matrix
        return MemoryTerms(
            (loop.b_s - self.loop.b_s) @ output_matrix,
            loop.times_x(loop.b_y @ derivative) @ output_matrix,
            (loop.b_s_derivative - self.loop.b_s_derivative) @ output_matrix,
        )

    def x_times(self, sigma: complex, column: Matrix) -> Matrix:
        """X(sigma) times a column (n,): the displacement of one without contact forces."""
        return self._closed(sigma).x_times(column)

    def _closed(self, sigma: complex) -> ContactFeedback:
        """The loop of K(sigma)."""

        def made() -> ContactFeedback:
            change = self.rows.contact(self.memory.jacobian(sigma)[0])
            return ContactFeedback.closed(self.loop.model, self.loop.contact + change)

        return self.loop if sigma == 0.0 else last_two(self._kept, sigma, made)

    @cached_property
    def _kept(self) -> dict[complex, ContactFeedback]:
        return {}

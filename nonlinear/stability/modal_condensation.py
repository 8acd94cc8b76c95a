"""The contact-free modal model under a growing perturbation: poles kept as states, the others as a flexibility.

The residual flexibility of the condensed poles is that of component mode synthesis, carried to first order in the
exponent. Flexibilities and contact Jacobians are block diagonal, in the harmonics and in the nodes: a product with a
full matrix is written `blocks @ matrix` or `matrix @ blocks`.

References
----------
R. H. MacNeal, A hybrid method of component mode synthesis, Computers & Structures 1(4), 1971.
S. Rubin, Improved component-mode representation for structural dynamic analysis, AIAA Journal 13(8), 1975.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from rom.cyclic.modal_model import WaveModes

Matrix = NDArray[Any]  # real or complex


@dataclass(frozen=True)
class HarmonicBlocks:
    """Block diagonal matrix with one block a harmonic; or many of them, as NumPy multiplies many matrices."""

    static: Matrix  # (k_0, k_0), block of harmonic 0; of size 0 without that harmonic
    dynamic: Matrix  # (..., b, k, k), blocks of the other harmonics, all of one size
    __array_ufunc__: ClassVar[None] = None  # `array @ blocks` calls `__rmatmul__`

    def __matmul__(self, matrix: Matrix) -> Matrix:
        size, (blocks, rows, _), columns = len(self.static), self.dynamic.shape[-3:], matrix.shape[-1]
        below = matrix[..., size:, :]
        dynamic: Matrix = self.dynamic @ below.reshape(*below.shape[:-2], blocks, rows, columns)
        dynamic = dynamic.reshape(*dynamic.shape[:-3], blocks * rows, columns)
        return np.concatenate([self.static @ matrix[:size], dynamic]) if size else dynamic

    def __rmatmul__(self, matrix: Matrix) -> Matrix:
        size, (blocks, columns, _), rows = len(self.static), self.dynamic.shape[-3:], matrix.shape[-2]
        beside = matrix[..., size:].reshape(*matrix.shape[:-1], blocks, columns).swapaxes(-2, -3)
        dynamic: Matrix = (beside @ self.dynamic).swapaxes(-2, -3)
        dynamic = dynamic.reshape(*dynamic.shape[:-3], rows, blocks * columns)
        return np.concatenate([matrix[:, :size] @ self.static, dynamic], axis=1) if size else dynamic


@dataclass(frozen=True)
class NodeBlocks:
    """Matrix that couples the S coefficients and 3 directions of each contact node; rows and columns (S, n_c, 3)."""

    values: Matrix  # (n_c, S, 3, S, 3), block of each node
    __array_ufunc__: ClassVar[None] = None

    def __matmul__(self, matrix: Matrix) -> Matrix:
        nodes, size = self.values.shape[:2]
        columns = matrix.shape[1]
        parts = matrix.reshape(size, nodes, 3, columns).transpose(1, 0, 2, 3).reshape(nodes, 3 * size, columns)
        product = self.values.reshape(nodes, 3 * size, 3 * size) @ parts
        return product.reshape(nodes, size, 3, columns).transpose(1, 0, 2, 3).reshape(matrix.shape)

    def __rmatmul__(self, matrix: Matrix) -> Matrix:
        transposed: Matrix = NodeBlocks(self.values.transpose(0, 3, 4, 1, 2)) @ matrix.T
        return transposed.T

    def __add__(self, other: "NodeBlocks") -> "NodeBlocks":
        return NodeBlocks(self.values + other.values)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Matrix:
        nodes, size = self.values.shape[:2]
        full = np.zeros((size, nodes, 3, size, nodes, 3), dtype=self.values.dtype)
        for node, values in enumerate(self.values):
            full[:, node, :, :, node] = values
        return full.reshape(3 * nodes * size, -1)


@dataclass(frozen=True)
class Diagonal:
    """Diagonal matrix."""

    values: Matrix  # (n,)
    __array_ufunc__: ClassVar[None] = None

    def __matmul__(self, matrix: Matrix) -> Matrix:
        result: Matrix = self.values[:, None] * matrix
        return result

    def __rmatmul__(self, matrix: Matrix) -> Matrix:
        result: Matrix = matrix * self.values
        return result


@dataclass(frozen=True)
class Placed:
    """Matrix (n_z, n) with one entry in each row."""

    place: NDArray[np.int64]  # (n_z,), column of each entry
    values: Matrix  # (n_z,), the entries
    __array_ufunc__: ClassVar[None] = None

    def __matmul__(self, matrix: "Matrix | NodeBlocks") -> Matrix:
        result: Matrix = self.values[:, None] * np.asarray(matrix)[..., self.place, :]
        return result

    def __add__(self, matrix: Matrix) -> Matrix:
        result: Matrix = matrix.copy()
        result[..., np.arange(self.place.size), self.place] += self.values
        return result


@dataclass(frozen=True)
class Chosen:
    """Matrix (n, n_z) that takes some of the columns of the one before it."""

    place: NDArray[np.int64]  # (n_z,), the columns
    __array_ufunc__: ClassVar[None] = None

    def __rmatmul__(self, matrix: Matrix) -> Matrix:
        result: Matrix = matrix[..., self.place]
        return result


# poles that near to s = 0, in units of omega, are states wherever contacts may move them: those of a body that only
# contacts hold rise by its frequency on these. One of a pair alone has a large residue
SLOW = 0.5
CRITICAL = 1e-8  # least abs(1 - (c_m / (2 omega_m))^2): a double pole is split by that much


@dataclass(frozen=True)
class CondensedModes:
    """Contact motion d under contact forces f: sigma z = A z + B f, d = C z + (G_0 + sigma G_1) f."""

    state_matrix: Matrix  # (n_z, n_z), A, with the retained poles as eigenvalues, in units of omega
    input_matrix: Matrix | Placed  # (n_z, n), B
    output_matrix: Matrix | Chosen  # (n, n_z), C
    # (n, n), G_0 and G_1, the residual flexibility of the condensed poles and its derivative in sigma
    flexibility: HarmonicBlocks | Diagonal
    flexibility_derivative: HarmonicBlocks | Diagonal


@dataclass(frozen=True)
class ContactFreeModel:
    """Modes of a blade without contact that move as e^(s t), s = lambda + i h omega, in the harmonics h.

    Each mode, 1 / (s^2 + c_m s + omega_m^2), has two poles: one rotates in the sense of h, one in the opposite sense.
    With Coriolis forces each pole has a motion of its own: there are q = 2 m of them, in one row in place of two.
    The first is retained as a state where its abs(s) is below (abs(h) + rho) omega, the second where it is below
    (rho - abs(h)) omega. A condensed pole is more than rho omega away from lambda = 0, and a contact, which stiffens,
    moves it farther away. Slow ones, abs(s) < omega / 2, are always retained: contacts move them past any harmonic.
    """

    modes: WaveModes  # the modes in the wave of each harmonic, with their relative contact motion B_h phi
    harmonics: Array  # (n_h,), h; 0, if it is there, comes first
    retention_radius: float  # rho, in units of omega
    # h_r. Harmonics above it retain the poles within rho omega of lambda = 0 only, and none of modes above (h_r +
    # rho) omega: where such a mode is near resonance its flexibility has no derivative
    retention_harmonic: int
    real_form: bool  # whether the harmonics 0, 1, 2, ... stand for real motions, in rows (0, Re 1, Im 1, ...)

    @property
    def _first(self) -> int:
        """Row of the first harmonic other than 0."""
        return int(self.harmonics[0] == 0.0)

    @cached_property
    def poles(self) -> tuple[ComplexArray, ComplexArray]:
        """Poles s and their residues, first those that rotate as h does (or decay slower): (n_h, 2, m) each."""
        modes = self.modes
        return poles_and_residues(modes.total_stiffness, modes.total_damping, self.harmonics, modes.inertia)

    def retained(self, omega: float) -> NDArray[np.bool_]:
        """Which poles are states, (n_h, 2, m)."""
        h, size = np.abs(self.harmonics)[:, None], np.abs(self.poles[0]) / omega
        rho = self.retention_radius
        if size.shape[1] == 1:
            same = np.where(self.harmonics < 0.0, -1.0, 1.0)[:, None] * self.poles[0][:, 0].imag >= 0.0
            retained = np.where(same, self._same_sense(size[:, 0], h), size[:, 0] <= rho - h)[:, None]
        else:
            retained = np.stack([self._same_sense(size[:, 0], h), size[:, 1] <= rho - h], axis=1)
        retained[: self._first] = size[: self._first, :1] <= rho  # both or none
        return retained | (size < SLOW)

    def _same_sense(self, size: Array, h: Array) -> NDArray[np.bool_]:
        """Which poles of that `size`, in units of omega, are states where they rotate as h does."""
        rho, h_r = self.retention_radius, self.retention_harmonic
        return np.asarray((size <= np.minimum(h, h_r) + rho) & ((h <= h_r) | (size >= h - rho)))

    def condensed(self, omega: float, active: NDArray[np.bool_]) -> CondensedModes:
        """The model near lambda = 0.

        Shapes: `active` (3 n_c,).
        """
        retained = self.retained(omega)
        poles = self.poles[0] / omega - 1j * self.harmonics[:, None, None]
        # a condensed pole p with residue r: r / (sigma - p) = -r / p - sigma r / p^2 + ...
        distance = np.where(retained, 1.0, -poles)
        g_0 = np.where(retained, 0.0, self.poles[1] / omega / distance)
        g_1 = np.where(np.abs(distance) < self.retention_radius, 0.0j, -g_0 / distance)
        return self._with_states(omega, active, retained, g_0, g_1)

    def around(self, shift: complex, omega: float, active: NDArray[np.bool_]) -> CondensedModes:
        """The model near sigma = `shift`, in sigma - shift: poles near it are states, all others are linearised.

        Shapes: `active` (3 n_c,).
        """
        distance = shift - self.poles[0] / omega + 1j * self.harmonics[:, None, None]
        near = np.abs(distance) <= self.retention_radius
        near[: self._first] = near[: self._first].any(axis=1, keepdims=True)
        g_0 = np.where(near, 0.0, self.poles[1] / omega / np.where(near, 1.0, distance))
        model = self._with_states(omega, active, near, g_0, -g_0 / np.where(near, 1.0, distance))
        return replace(model, state_matrix=model.state_matrix - shift * np.eye(len(model.state_matrix)))

    def _with_states(
        self,
        omega: float,
        active: NDArray[np.bool_],
        retained: NDArray[np.bool_],
        g_0: Matrix,
        g_1: Matrix,
    ) -> CondensedModes:
        """The `retained` poles as states; flexibilities of the others and their derivatives, (n_h, 2, m) each."""
        poles = self.poles[0] / omega - 1j * self.harmonics[:, None, None]
        residues = self.poles[1] / omega
        relative = np.ascontiguousarray(self.modes.relative[:, active])
        adjoint = np.ascontiguousarray(self.modes.adjoint[:, :, active])
        first = self._first
        row, pole, mode = np.nonzero(retained[first:])
        dynamic = self._dynamic(
            poles[first:][row, pole, mode],
            residues[first:][row, pole, mode],
            relative[first:].transpose(0, 2, 1)[row, mode],
            adjoint[first:][row, mode],
            row,
        )
        static: tuple[Matrix, Matrix, Matrix] = (np.zeros((0, 0)),) * 3
        if first and self.modes.inertia:
            static = self._static(omega, retained[0, 0], relative[0])
        elif first:
            chosen = np.flatnonzero(retained[0, 0])
            static = self._static_of_poles(
                poles[0, 0, chosen], residues[0, 0, chosen, None] * adjoint[0, chosen], relative[0][:, chosen]
            )
        a, b, c = (_block_diagonal(one, other) for one, other in zip(static, dynamic, strict=True))
        return CondensedModes(
            a,
            b,
            c,
            self._blocks((relative * g_0.sum(axis=1)[:, None]) @ adjoint),
            self._blocks((relative * g_1.sum(axis=1)[:, None]) @ adjoint),
        )

    def _static(self, omega: float, retained: NDArray[np.bool_], relative: Matrix) -> tuple[Matrix, Matrix, Matrix]:
        """A, B, C of harmonic 0: displacement and velocity of each mode retained."""
        modes = np.flatnonzero(retained)
        count, motion = modes.size, (relative.real if self.real_form else relative)[:, modes]
        stiffness, damping = self.modes.total_stiffness[0, modes], self.modes.total_damping[0, modes]
        if self.real_form:
            stiffness, damping = stiffness.real, damping.real
        state_matrix = np.zeros((2 * count, 2 * count), dtype=stiffness.dtype)
        upper, lower = np.arange(count), np.arange(count, 2 * count)
        state_matrix[upper, lower] = 1.0
        state_matrix[lower, upper] = -stiffness / omega**2
        state_matrix[lower, lower] = -damping / omega
        input_matrix = np.zeros((2 * count, motion.shape[0]), dtype=motion.dtype)
        input_matrix[count:] = motion.conj().T / omega**2
        return state_matrix, input_matrix, np.concatenate([motion, np.zeros_like(motion)], axis=1)

    def _static_of_poles(
        self, poles: ComplexArray, inputs: ComplexArray, outputs: ComplexArray
    ) -> tuple[Matrix, Matrix, Matrix]:
        """A, B, C of harmonic 0 from poles (k,) each by itself; in real form of pairs, z of one with Im s > 0.

        Shapes: `inputs` (k, n), `outputs` (n, k).
        """
        if not self.real_form:
            return np.diag(poles), inputs, outputs
        alone, pairs = poles.imag == 0.0, poles.imag > 0.0
        a = _block_diagonal(np.diag(poles[alone].real), _folded(real_form(np.diag(poles[pairs]))))
        b = np.concatenate([inputs[alone].real, inputs[pairs].real, inputs[pairs].imag])
        c = [outputs[:, alone].real, 2.0 * outputs[:, pairs].real, -2.0 * outputs[:, pairs].imag]
        return a, b, np.concatenate(c, axis=1)

    def _dynamic(
        self,
        poles: ComplexArray,
        residues: ComplexArray,
        motion: ComplexArray,
        adjoint: ComplexArray,
        row: NDArray[np.int64],
    ) -> tuple[Matrix, Matrix, Matrix]:
        """A, B, C of the other harmonics, from pole, residue, motions and harmonic of each state: (k,), (k, n)."""
        count, harmonics, every = poles.size, len(self.harmonics) - self._first, np.arange(poles.size)
        size = harmonics * motion.shape[1]
        input_matrix = np.zeros((count, harmonics, motion.shape[1]), dtype=complex)
        input_matrix[every, row] = residues[:, None] * adjoint
        output_matrix = np.zeros((harmonics, motion.shape[1], count), dtype=complex)
        output_matrix[row, :, every] = motion
        if not self.real_form:
            return np.diag(poles), input_matrix.reshape(count, size), output_matrix.reshape(size, count)
        return (
            _folded(real_form(np.diag(poles))),
            real_form(input_matrix.transpose(1, 0, 2)).transpose(1, 2, 0, 3, 4).reshape(2 * count, 2 * size),
            real_form(output_matrix).reshape(2 * size, 2 * count),
        )

    def _blocks(self, values: ComplexArray) -> HarmonicBlocks:
        """Block diagonal matrix of the values (n_h, n, n)."""
        count, size, _ = values.shape
        first = self._first
        static = values[0] if first else np.zeros((0, 0), dtype=complex)
        if not self.real_form:
            return HarmonicBlocks(static, values[first:])
        return HarmonicBlocks(static.real, real_form(values[first:]).reshape(count - first, 2 * size, 2 * size))


def poles_and_residues(
    stiffness: Matrix, damping: Matrix, harmonics: Array, inertia: float = 1.0
) -> tuple[ComplexArray, ComplexArray]:
    """Poles s and residues of 1 / (s^2 + c s + k) in the `harmonics`: (n_h, 2, m) each, as in `ContactFreeModel`.

    Without `inertia` those of 1 / (c s + k), (n_h, 1, m).
    Shapes: `stiffness` k (m,) or (n_h, m), `damping` c alike, `harmonics` (n_h,).
    """
    if not inertia:
        poles, residues = np.asarray(-stiffness / damping), np.asarray(1.0 / damping)
        return poles[..., None, :].astype(complex), residues[..., None, :].astype(complex)
    half = damping / 2.0
    under = stiffness - half**2
    apart = np.where(np.abs(under) < CRITICAL * np.abs(stiffness), CRITICAL * stiffness, under)
    damped = 1j * np.sqrt(apart.astype(complex))
    poles = np.stack([-half + damped, -half - damped], axis=-2)
    residues = np.stack([0.5 / damped, -0.5 / damped], axis=-2)
    sense = np.where(harmonics < 0.0, -1.0, 1.0)[:, None, None]
    apart = poles[..., :1, :] - poles[..., 1:, :]
    turned = np.where(apart.imag == 0.0, apart.real, sense * apart.imag) < 0.0
    return np.where(turned, poles[..., ::-1, :], poles), np.where(turned, residues[..., ::-1, :], residues)


def real_form(matrix: ComplexArray) -> Array:
    """Maps (..., n, m) of complex amplitudes as maps of their real and imaginary parts, (..., 2, n, 2, m)."""
    *many, rows, columns = matrix.shape
    result = np.empty((*many, 2, rows, 2, columns))
    result[..., 0, :, 0, :] = result[..., 1, :, 1, :] = matrix.real
    result[..., 0, :, 1, :] = -matrix.imag
    result[..., 1, :, 0, :] = matrix.imag
    return result


def _folded(blocks: Array) -> Array:
    """A real form (2, n, 2, m) as a matrix, (2 n, 2 m)."""
    return blocks.reshape(2 * blocks.shape[1], 2 * blocks.shape[3])


def _block_diagonal(one: Matrix, other: Matrix) -> Matrix:
    """Block diagonal matrix of two blocks."""
    rows, columns = one.shape
    result = np.zeros((rows + other.shape[0], columns + other.shape[1]), dtype=np.result_type(one, other))
    result[:rows, :columns], result[rows:, columns:] = one, other
    return result

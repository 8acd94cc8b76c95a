"""A matrix as a file of another program holds it, with the dofs of its rows where the file names them.

The name of a matrix tells which of several of a file is meant.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.errors import MatrixFileError

if TYPE_CHECKING:
    from scipy.sparse import coo_matrix, csr_matrix

# of Nastran: a-set, external superelements (EXTSEOUT writes KAAX, MAAX), direct input, g-set, and its other sets
_OF_NASTRAN = ("{}AA", "{}AAX", "{}2GG", "{}GG", "{}LL", "{}XX", "{}TT", "{}NN", "{}JJ")
STIFFNESS = ("K", "stiffness", *(name.format("K") for name in _OF_NASTRAN), "Kred", "K_red", "Kr", "STIFF")
MASS = ("M", "mass", *(name.format("M") for name in _OF_NASTRAN), "Mred", "M_red", "Mr", "MASS")
TRANSFORMATION = ("T", "transformation", "basis", "Phi", "Psi", "GOA")
FORCE = ("f", "force", "centrifugal", "force_centrifugal", "PG", "PAX")
_LISTED = 8
LARGEST = 20_000_000  # rows; a header that claims more is damaged
_ASYMMETRY = 1e-8  # of the largest entry
_LARGEST_NUMBER = 1e100  # squares and products of larger numbers overflow


def chosen_name(
    path: str | os.PathLike[str], wanted: str | None, held: tuple[str, ...], usual: tuple[str, ...]
) -> str:
    """The name of a matrix in a file: the wanted one, the only one, or the first usual one; letter case is free.

    Raises MatrixFileError where there is none, or it is not clear which; the message lists the names of the file.
    """
    listed = ", ".join(held[:_LISTED]) + (", ..." if len(held) > _LISTED else "") if held else "no matrix"
    folded = {name.casefold(): name for name in reversed(held)} | {name: name for name in held}
    for name in usual if wanted is None else (wanted,):
        found = folded.get(name) or folded.get(name.casefold())
        if found is not None:
            return found
    if wanted is not None:
        raise MatrixFileError(path, f"has no matrix {wanted!r}", listed)
    if len(held) == 1:
        return held[0]
    raise MatrixFileError(path, f"holds {listed}: which one is meant is not clear", f"a name, such as {usual[0]}")


@dataclass(frozen=True)
class DofLabels:
    """Node and component of each row of a matrix.

    Attributes
    ----------
    node : (n,) array
        Number of the node; 0 or less for a generalised coordinate.
    component : (n,) array
        1, 2, 3: displacement along x, y, z; 4, 5, 6: rotation about x, y, z; 0: generalised coordinate.

    Examples
    --------
    >>> import numpy as np
    >>> from rom import DofLabels
    >>> DofLabels(np.array([7, 7]), np.array([1, 3])).pairs.tolist()
    [[7, 1], [7, 3]]
    """

    node: NDArray[np.int64]
    component: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.node)

    @property
    def pairs(self) -> NDArray[np.int64]:
        """Node and component of each row, (n, 2)."""
        return np.column_stack([self.node, self.component])


@dataclass(frozen=True)
class LabelledMatrix:
    """A real matrix from a file.

    Attributes
    ----------
    matrix : (n, m) CSR matrix
        Both halves.
    labels : DofLabels or None
        Dofs of the rows, where the file names them.
    notes : tuple of str
        What the reader completed or left out, one line each.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.sparse import identity
    >>> from rom import LabelledMatrix
    >>> LabelledMatrix(identity(3, format="csr")).matrix.shape
    (3, 3)
    """

    matrix: csr_matrix
    labels: DofLabels | None = None
    notes: tuple[str, ...] = ()


def from_entries(
    path: str | os.PathLike[str], entries: coo_matrix, labels: DofLabels | None, *, half: bool = False
) -> LabelledMatrix:
    """A matrix from its entries; `half` says that the file gives each entry off the diagonal once.

    Raises MatrixFileError for entries that are not finite and for halves that contradict each other.
    """
    from scipy.sparse import tril, triu

    matrix = entries.tocsr()
    check_numbers(path, matrix.data)
    if not half:
        return LabelledMatrix(matrix, labels)
    below, above = tril(matrix, -1, format="csr"), triu(matrix, 1, format="csr").T.tocsr()
    both = abs(below).sign().multiply(abs(above).sign())
    if both.nnz:
        if abs((below - above).multiply(both)).max() > _ASYMMETRY * abs(matrix).max():
            allowed = "each entry off the diagonal once, or twice the same"
            raise MatrixFileError(path, "two different values for an entry and its mirror image", allowed)
        above = above - above.multiply(both)
    folded = (tril(matrix, 0, format="csr") + above).tocsr()
    return LabelledMatrix((folded + tril(folded, -1).T).tocsr(), labels)


def with_both_halves(path: str | os.PathLike[str], found: LabelledMatrix) -> LabelledMatrix:
    """The matrix with both halves; one that holds only one of them is completed, with a note.

    Raises MatrixFileError where it is not square or not symmetric.
    """
    from scipy.sparse import tril, triu

    matrix = found.matrix
    if matrix.shape[0] != matrix.shape[1]:
        raise MatrixFileError(path, f"a matrix of {matrix.shape[0]} x {matrix.shape[1]}", "a square matrix")
    if matrix.shape[0] == 0 or matrix.nnz == 0:
        raise MatrixFileError(path, "a matrix without entries", "one entry or more")
    lower, upper = tril(matrix, -1, format="csr"), triu(matrix, 1, format="csr")
    if (lower.count_nonzero() == 0) != (upper.count_nonzero() == 0):
        name = "upper" if lower.count_nonzero() == 0 else "lower"
        note = f"{os.fspath(path)}: holds the {name} half, completed by symmetry"
        return LabelledMatrix((matrix + (lower + upper).T).tocsr(), found.labels, (*found.notes, note))
    largest = abs(matrix).max()
    asymmetry = abs(lower.T - upper).max() if lower.nnz or upper.nnz else 0.0
    if asymmetry > _ASYMMETRY * largest:
        raise MatrixFileError(
            path,
            f"not symmetric, off by {asymmetry / largest:.2g} of the largest entry",
            f"a symmetric matrix to {_ASYMMETRY:g}, or one half of it",
        )
    if asymmetry > 0.0:
        matrix = (0.5 * (matrix + matrix.T)).tocsr()
    return LabelledMatrix(matrix, found.labels, found.notes)


def check_numbers(path: str | os.PathLike[str], values: NDArray[np.generic]) -> None:
    """Raise MatrixFileError for numbers that are complex, not finite or too large."""
    if values.dtype.kind == "c":
        raise MatrixFileError(path, "complex numbers", "real numbers: stiffness and mass without damping")
    if values.dtype.kind not in "iufb":
        raise MatrixFileError(path, f"entries of type {values.dtype}", "real numbers")
    if not np.isfinite(values).all():
        raise MatrixFileError(path, "entries that are not finite (NaN or infinite)", "finite numbers")
    if values.size and np.abs(values).max() > _LARGEST_NUMBER:
        raise MatrixFileError(path, f"an entry of {np.abs(values).max():.3g}", f"numbers up to {_LARGEST_NUMBER:g}")

"""Matrices of Nastran.

DMIG bulk data (.pch, .dmig, .bdf): by grid point and component, in small, large or free field. OP4 files: binary or
text, dense or sparse, of either byte order, through pyYeti.
"""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rom.errors import MatrixFileError
from rom.matrix_files.labelled_matrix import (
    LARGEST,
    DofLabels,
    LabelledMatrix,
    check_numbers,
    chosen_name,
    from_entries,
)

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_OP4_ALLOWED = "a complete OP4 file"
_LONGEST_NAME = 8
SQUARE, SYMMETRIC = 1, 6
_DMIG_ALLOWED = "DMIG entries in small, large or free field"
# parameters of the bulk data, and factors of the case control section, that scale the matrices: M2GG = 0.5*MAAX
_PARAMETER = re.compile(r"\s*PARAM\*?[\s,]+(CK2|CM2)[\s,]+([^\s,]+)", re.IGNORECASE)
_FACTOR = re.compile(r"\s*([KM]2GG)\s*=.*?([0-9.][0-9.+\-ED]*)\s*\*", re.IGNORECASE)
_EXPONENT = re.compile(r"(?<=[0-9.])([+-][0-9]+)$")  # Nastran may leave out the letter of an exponent


def read_op4(path: str | os.PathLike[str], name: str | None, usual: tuple[str, ...]) -> LabelledMatrix:
    """A matrix of an OP4 file: `name`, or the only one, or the first with a usual name.

    Raises MatrixFileError where the file is damaged or does not have the matrix; the message lists those it has.
    """
    from scipy.sparse import csr_matrix

    op4 = _library(path)
    size = Path(path).stat().st_size
    with np.printoptions(), np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            names, shapes, _, _ = op4.dir(os.fspath(path), verbose=False)
        except Exception as error:  # the library raises whatever a damaged record makes of its arithmetic
            raise MatrixFileError(path, f"not readable as OP4: {_reason(error)}", _OP4_ALLOWED) from None
        if not names:
            raise MatrixFileError(path, "no matrix, or cut off in the first one", _OP4_ALLOWED)
        chosen = chosen_name(path, name, tuple(names), usual)
        rows, columns = shapes[list(names).index(chosen)]
        if not min(rows, columns) > 0 or max(rows, columns) > min(LARGEST, 64 * size):
            raise MatrixFileError(path, f"{chosen} claims {rows} x {columns}", "as many rows as the file holds")
        try:
            matrix = op4.load(os.fspath(path), chosen, into="dct", justmatrix=True, sparse=True)[chosen.lower()]
        except Exception as error:
            raise MatrixFileError(path, f"{chosen} is not readable: {_reason(error)}", _OP4_ALLOWED) from None
    if matrix.shape != (rows, columns):
        raise MatrixFileError(path, f"{chosen} is cut off", _OP4_ALLOWED)
    found = csr_matrix(matrix)
    check_numbers(path, found.data)
    return LabelledMatrix(found.astype(np.float64))


def write_op4(path: str | os.PathLike[str], content: Mapping[str, csr_matrix | NDArray[np.float64]]) -> None:
    """Write matrices to a binary OP4 file; names have 8 characters at most, symmetric matrices the form 6."""
    op4 = _library(path)
    names = [name[:_LONGEST_NAME] for name in content]
    matrices = [np.atleast_2d(np.asarray(value)) for value in content.values()]
    forms = [
        6 if m.shape[0] == m.shape[1] and np.array_equal(m, m.T) else 2 - (m.shape[0] == m.shape[1]) for m in matrices
    ]
    with np.printoptions():
        op4.write(os.fspath(path), names, matrices, binary=True, sparse="dense", forms=forms)


def _library(path: str | os.PathLike[str]) -> Any:
    """The module pyyeti.nastran.op4; its import changes how NumPy prints numbers, which is undone."""
    options = np.get_printoptions()
    try:
        from pyyeti.nastran import op4
    except ImportError:
        raise MatrixFileError(
            path, "needs the package pyyeti", "pip install 'shroud[matrices]', or another format"
        ) from None
    finally:
        np.set_printoptions(**options)
    return op4


def _reason(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0] or type(error).__name__


@dataclass
class _Dmig:
    """Entries of one matrix: row (node, component), column (node, component), value."""

    form: int
    kind: int
    entries: list[tuple[int, int, int, int, float]] = field(default_factory=list)


def read_dmig(path: str | os.PathLike[str], name: str | None, usual: tuple[str, ...]) -> LabelledMatrix:
    """A matrix of DMIG entries: `name`, or the only one, or the first with a usual name; form 1 (square) or 6.

    Of form 6 (symmetric) each entry off the diagonal stands once. A component 0 stands for a scalar point.
    Raises MatrixFileError where the file is damaged or does not have the matrix; the message lists those it has.
    """
    from scipy.sparse import coo_matrix

    matrices: dict[str, _Dmig] = {}
    for fields in _cards(path):
        _take(path, matrices, fields)
    chosen = chosen_name(path, name, tuple(matrices), usual)
    found = matrices[chosen]
    if found.form not in (SQUARE, SYMMETRIC):
        raise MatrixFileError(path, f"{chosen} has the form {found.form}", "1 (square) or 6 (symmetric)")
    if found.kind in (3, 4):
        raise MatrixFileError(path, f"{chosen} is complex", "real numbers: stiffness and mass without damping")
    if not found.entries:
        raise MatrixFileError(path, f"{chosen} has no entries", _DMIG_ALLOWED)
    table = np.array([entry[:4] for entry in found.entries], dtype=np.int64)
    values = np.array([entry[4] for entry in found.entries])
    pairs, place = np.unique(np.concatenate([table[:, :2], table[:, 2:]]), axis=0, return_inverse=True)
    row, column = place.reshape(2, -1)
    entries = coo_matrix((values, (row, column)), shape=(len(pairs), len(pairs)))
    if found.form == SQUARE and np.any(row != column) and (np.all(row >= column) or np.all(row <= column)):
        raise MatrixFileError(path, f"{chosen} of form 1 (square) holds one half only", "both halves, or form 6")
    scalar = pairs[:, 1] == 0
    labels = DofLabels(np.where(scalar, -pairs[:, 0], pairs[:, 0]), pairs[:, 1])
    return from_entries(path, entries, labels, half=found.form == SYMMETRIC)


def _take(path: str | os.PathLike[str], matrices: dict[str, _Dmig], fields: list[str]) -> None:
    """Add one DMIG entry, its header or a column, to the matrices."""
    name = fields[1].upper() if len(fields) > 1 else ""
    try:
        if fields[2] == "0":
            matrices[name] = _Dmig(int(fields[3]), int(fields[4]))
            return
        column = int(fields[2]), int(fields[3] or 0)
        for k in range(5, len(fields) - 2, 4):
            if fields[k]:
                row = int(fields[k]), int(fields[k + 1] or 0)
                matrices[name].entries.append((*row, *column, _number(fields[k + 2])))
    except KeyError:
        raise MatrixFileError(
            path, f"a column of {name} before its header (DMIG, {name}, 0, ...)", _DMIG_ALLOWED
        ) from None
    except (ValueError, IndexError):
        shown = ", ".join(fields[:8])
        raise MatrixFileError(path, f"an entry that cannot be read: {shown}", _DMIG_ALLOWED) from None


def _cards(path: str | os.PathLike[str]) -> Iterator[list[str]]:
    """Fields of each DMIG entry with its continuations: the name of the card first, four fields after the column."""
    card: list[str] = []
    try:
        lines = Path(path).read_text(encoding="ascii").splitlines()
    except UnicodeDecodeError:
        raise MatrixFileError(path, "not a text file", _DMIG_ALLOWED) from None
    for line in lines:
        text = line.split("$")[0]
        _refuse_factor(path, text)
        start = text[:8].split(",")[0].strip().rstrip("*").upper()
        if start[:1] in ("", "+", "*"):
            card += _fields(text)[1:] if card and text.strip() else []
        else:
            if card and start[:1] == "=":
                raise MatrixFileError(path, f"a replicated entry: {' '.join(text.split())[:40]}", _DMIG_ALLOWED)
            if card:
                yield card
            card = _fields(text) if start == "DMIG" else []
        if card and any(map(str.strip, text.split(",")[10:])):
            raise MatrixFileError(
                path, f"a line of more than 10 fields: {' '.join(text.split())[:40]}", _DMIG_ALLOWED
            )
    if card:
        yield card


def _refuse_factor(path: str | os.PathLike[str], line: str) -> None:
    """Refuse a line by which Nastran multiplies a matrix of the file."""
    found = _PARAMETER.match(line) or _FACTOR.match(line)
    try:
        factor = 1.0 if found is None else _number(found[2])
    except ValueError:
        factor = 0.0
    if found is not None and factor != 1.0:
        allowed = "matrices that are not scaled: multiply the entries, and take the factor out"
        raise MatrixFileError(path, f"scales its matrices: {' '.join(line.split())[:60]}", allowed)


def _fields(line: str) -> list[str]:
    """Fields 1 to 9 of a line in small field (or 1 to 5 in large field), the continuation mark left out."""
    line = line.expandtabs(8)
    if "," in line:
        large = "*" in line.split(",")[0]
        parts = [part.strip() for part in line.split(",")]
        return (parts + [""] * 9)[: 5 if large else 9]
    if "*" in line[:8]:
        return [line[:8].strip(), *(line[8 + 16 * k : 24 + 16 * k].strip() for k in range(4))]
    return [line[8 * k : 8 * k + 8].strip() for k in range(9)]


def _number(text: str) -> float:
    return float(_EXPONENT.sub(r"E\1", text.upper().replace("D", "E")) if "E" not in text.upper() else text)

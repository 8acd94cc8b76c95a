"""MATLAB files: level 5 through SciPy, 7.3 (HDF5) through h5py, sparse matrices in both."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rom.errors import MatrixFileError
from rom.files.hdf5 import opened, stored_array, why_unreadable
from rom.matrix_files.labelled_matrix import LARGEST, LabelledMatrix, check_numbers, chosen_name

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_ALLOWED = "a MATLAB file, level 5 or 7.3"
_HEADER = b"MATLAB 7.3 MAT-file, Platform: shroud, Created on: Thu Jan 01 00:00:00 1970 HDF5 schema 1.00 ."
_USER_BLOCK = 512
_HIGHEST_COMPRESSION = 2000  # deflate reaches some 1000


def read_matlab(path: str | os.PathLike[str], name: str | None, usual: tuple[str, ...]) -> LabelledMatrix:
    """A matrix of a MATLAB file: `name`, or the only one, or the first with a usual name.

    Raises MatrixFileError where the file is damaged or does not have the variable; the message lists those it has.
    """
    import h5py

    try:
        if h5py.is_hdf5(path):
            return _read_hdf5(path, name, usual)
        return _read_level_5(path, name, usual)
    except MatrixFileError:
        raise
    except Exception as error:  # the libraries raise whatever a damaged record makes of their arithmetic
        raise MatrixFileError(path, f"not readable as MATLAB: {why_unreadable(error)}", _ALLOWED) from None


def _read_level_5(path: str | os.PathLike[str], name: str | None, usual: tuple[str, ...]) -> LabelledMatrix:
    from scipy.io import loadmat, whosmat

    held = {entry[0]: entry for entry in whosmat(path) if len(entry[1]) == 2 and min(entry[1]) > 0}
    chosen = chosen_name(path, name, tuple(held), usual)
    _, (rows, columns), kind = held[chosen]
    size = Path(path).stat().st_size
    claimed = 8 * rows if kind == "sparse" else 8 * rows * columns  # bytes
    if max(rows, columns) > LARGEST or claimed > _HIGHEST_COMPRESSION * size:
        raise MatrixFileError(path, f"{chosen} claims {rows} x {columns}", "as many numbers as the file holds")
    return _matrix(path, chosen, loadmat(path, variable_names=[chosen], spmatrix=True)[chosen])


def _read_hdf5(path: str | os.PathLike[str], name: str | None, usual: tuple[str, ...]) -> LabelledMatrix:
    from scipy.sparse import csc_matrix

    with opened(path) as file:
        names = tuple(key for key in file if not key.startswith("#"))
        chosen = chosen_name(path, name, names, usual)
        node = file[chosen]
        if hasattr(node, "dtype"):
            return _matrix(path, chosen, stored_array(node).T)  # MATLAB stores columns first
        if "MATLAB_sparse" not in node.attrs:
            raise MatrixFileError(path, f"{chosen} is a structure", "a matrix, full or sparse")
        rows = int(node.attrs["MATLAB_sparse"])
        starts = stored_array(node["jc"]).astype(np.int64)
        if not 0 <= rows <= LARGEST or starts[0] != 0 or np.any(np.diff(starts) < 0):
            raise MatrixFileError(path, f"{chosen} is a damaged sparse matrix", "rows, columns and values")
        data, index = (stored_array(node[key]) if key in node else np.zeros(0) for key in ("data", "ir"))
        index = index.astype(np.int64)
        if len(index) != starts[-1] or len(data) != len(index) or (len(index) and not 0 <= index.max() < rows):
            raise MatrixFileError(path, f"{chosen} is a damaged sparse matrix", "rows, columns and values")
        return _matrix(path, chosen, csc_matrix((data, index, starts), shape=(rows, len(starts) - 1)))


def _matrix(path: str | os.PathLike[str], name: str, value: Any) -> LabelledMatrix:
    from scipy.sparse import csr_matrix, issparse

    data = value.data if issparse(value) else np.asarray(value)
    if data.dtype.names is not None or data.dtype.kind not in "biufc":
        raise MatrixFileError(path, f"{name} holds no numbers", "a matrix, full or sparse")
    check_numbers(path, data)
    return LabelledMatrix(csr_matrix(value, dtype=np.float64))


def write_matlab_file(
    path: str | os.PathLike[str], content: Mapping[str, csr_matrix | NDArray[np.float64]], version: str = "5"
) -> None:
    """Write matrices as variables of a MATLAB file; `version` is "5" or "7.3"."""
    if version == "5":
        from scipy.io import savemat

        savemat(path, dict(content), oned_as="column", long_field_names=True, do_compression=True)
        return
    import h5py
    from scipy.sparse import csc_matrix, issparse

    with h5py.File(path, "w", userblock_size=_USER_BLOCK) as file:
        for name, value in content.items():
            if issparse(value):
                _write_sparse(file.create_group(name), csc_matrix(value))
            else:
                _write_full(file, name, np.asarray(value))
    with open(path, "r+b") as raw:
        raw.write(_HEADER.ljust(116) + bytes(8) + b"\x00\x02IM")


def _write_full(file: Any, name: str, array: NDArray[Any]) -> None:
    columns = array.reshape(len(array), 1) if array.ndim == 1 else array
    if columns.dtype.kind == "c":
        columns = np.ascontiguousarray(columns).view([("real", "<f8"), ("imag", "<f8")])
    file[name] = columns.T
    file[name].attrs["MATLAB_class"] = np.bytes_("double")


def _write_sparse(group: Any, matrix: Any) -> None:
    group.attrs["MATLAB_sparse"] = np.uint64(matrix.shape[0])
    group.attrs["MATLAB_class"] = np.bytes_("double")
    group["data"] = matrix.data
    group["ir"] = matrix.indices.astype(np.uint64)
    group["jc"] = matrix.indptr.astype(np.uint64)

"""CSV files of nodal forces and temperatures: a row for each node, found by its number or its position."""

from __future__ import annotations

import csv
import io
import math
from array import array
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.errors import InputError, shown, system_reason
from pipeline.scene.input_files import Contents, read_bytes

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

LARGEST_FILE = 200_000_000
POSITION = ("x", "y", "z")
REAL, PARTS = ("fx", "fy", "fz"), ("fx_re", "fx_im", "fy_re", "fy_im", "fz_re", "fz_im")
TEMPERATURE = ("temperature",)


@dataclass(frozen=True)
class NodalTable:
    """Values on nodes."""

    path: str  # the file
    # (k,), points of the mesh by their numbers in mesh.vtu, from 0; None: by position
    nodes: NDArray[np.int64] | None
    positions: NDArray[np.float64] | None  # (k, 3), positions, m
    # (k, 3), forces, N, complex where the file has parts _re and _im
    values: NDArray[np.float64] | NDArray[np.complex128]


def force_table(file: str, contents: Contents | None = None) -> NodalTable:
    """Forces on nodes from a CSV file; `contents`: hashes of input files, where they are known.

    Columns: `node`, or `x`, `y`, `z`; then `fx`, `fy`, `fz`, or `fx_re`, `fx_im`, ... for complex forces. A component
    that has no column is zero.
    """
    import numpy as np

    columns = _columns(file, (*REAL, *PARTS), contents)
    count = len(next(iter(columns.values())))
    parts = any(name in columns for name in PARTS)
    if parts and any(name in columns for name in REAL):
        raise _refused(file, "columns of real and of complex forces", "fx, fy, fz or fx_re, fx_im, ...")
    zero = np.zeros(count)

    def column(name: str) -> NDArray[np.float64]:
        return columns.get(name, zero)

    if parts:
        forces = [column(f"{name}_re") + 1j * column(f"{name}_im") for name in REAL]
    else:
        forces = [column(name) for name in REAL]
    if not any(name in columns for name in (*REAL, *PARTS)):
        raise _refused(file, "no forces", "columns fx, fy, fz or fx_re, fx_im, ...")
    return _table(file, columns, np.stack(forces, axis=1))


def temperature_table(file: str, contents: Contents | None = None) -> NodalTable:
    """Temperatures of nodes from a CSV file with the columns `node`, or `x`, `y`, `z`, and `temperature`."""
    columns = _columns(file, TEMPERATURE, contents)
    if "temperature" not in columns:
        raise _refused(file, "no temperatures", "a column temperature")
    return _table(file, columns, columns["temperature"])


def check_readable(file: str) -> None:
    """Refuse a file that is not there or too large. Raises InputError."""
    path = Path(file)
    if not path.is_file():
        raise _refused(file, "no such file" if not path.exists() else "not a file", "a readable CSV file")
    if path.stat().st_size > LARGEST_FILE:
        raise _refused(file, f"larger than {LARGEST_FILE} bytes", "a smaller CSV file")


def _table(file: str, columns: dict[str, NDArray[np.float64]], values: NDArray[np.float64]) -> NodalTable:
    import numpy as np

    if "node" in columns:
        numbers = columns["node"]
        if np.any(numbers % 1.0) or np.any(numbers < 0.0):
            raise _refused(file, "a node that is not a whole number", "numbers of points in mesh.vtu, from 0")
        return NodalTable(file, numbers.astype(np.int64), None, values)
    if not all(name in columns for name in POSITION):
        raise _refused(file, "neither node nor x, y, z", "a column node, or columns x, y and z (m)")
    return NodalTable(file, None, np.stack([columns[name] for name in POSITION], axis=1), values)


def _columns(file: str, known: tuple[str, ...], contents: Contents | None) -> dict[str, NDArray[np.float64]]:
    """The columns of a file as numbers."""
    import numpy as np

    check_readable(file)
    try:
        text = read_bytes(file, contents or {}).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise _refused(file, f"not UTF-8 text (byte {error.start})", "a CSV file") from None
    except OSError as error:
        raise _refused(file, f"cannot be read: {system_reason(error)}", "a CSV file") from None
    names: list[str] = []
    numbers = array("d")  # row by row: lists of texts and numbers take 60 times as much memory as the file
    try:
        for number, row in enumerate(csv.reader(io.StringIO(text)), start=1):
            if names and any(row):
                numbers.extend(_numbers(file, number, row, len(names)))
            elif any(row):
                names = _names(file, row, known)
    except csv.Error as error:
        raise _refused(file, f"not CSV: {error}", "a CSV file") from None
    if not numbers:
        raise _refused(file, "no rows", "a line of column names, then a line for each node")
    return dict(zip(names, np.array(numbers).reshape(-1, len(names)).T, strict=True))


def _names(file: str, row: list[str], known: tuple[str, ...]) -> list[str]:
    names = [cell.strip().lower() for cell in row]
    for name in names:
        if name not in ("node", *POSITION, *known):
            raise _refused(file, f"column {shown(name)}", ", ".join(("node", *POSITION, *known)))
    if len(set(names)) < len(names):
        raise _refused(file, "a column twice", "each column once")
    return names


def _numbers(file: str, line: int, row: list[str], count: int) -> list[float]:
    if len(row) != count:
        raise _refused(file, f"line {line}: {len(row)} values", f"{count}, one for each column")
    try:
        numbers = [float(cell) for cell in row]
    except ValueError:
        raise _refused(file, f"line {line}: {shown(','.join(row))}", "numbers") from None
    if not all(math.isfinite(number) and abs(number) <= 1e15 for number in numbers):
        raise _refused(file, f"line {line}: a number that is not finite or too large", "numbers up to 1e15")
    return numbers


def _refused(file: str, found: str, allowed: str) -> InputError:
    return InputError(f"{file}: {found}, allowed: {allowed}")

"""VTU files (VTK's XML format for unstructured grids): nodes, elements of any kind, fields at the nodes.

Arrays are stored in base64, uncompressed, so equal fields give equal files.
"""

from __future__ import annotations

import base64
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

_TYPES = {"f8": "Float64", "i8": "Int64", "u1": "UInt8", "f4": "Float32"}


def write_vtu(
    path: Path,
    points: NDArray[np.float64],
    cells: Sequence[tuple[int, NDArray[np.int64]]],
    fields: Mapping[str, NDArray[Any]],
) -> None:
    """Write a mesh with fields at its nodes.

    Shapes: `points` (n, 3), `cells` (E, b), `fields` (n,).
    """
    connectivity = np.concatenate([nodes.ravel() for _, nodes in cells]).astype("i8")
    sizes = np.concatenate([np.full(len(nodes), nodes.shape[1]) for _, nodes in cells])
    kinds = np.concatenate([np.full(len(nodes), kind, dtype="u1") for kind, nodes in cells])
    order = "LittleEndian" if sys.byteorder == "little" else "BigEndian"
    lines = [
        '<?xml version="1.0"?>',
        f'<VTKFile type="UnstructuredGrid" version="1.0" byte_order="{order}" header_type="UInt64">',
        "<UnstructuredGrid>",
        f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(sizes)}">',
        *_section("Points", [("points", np.asarray(points, dtype="f8"))]),
        *_section(
            "Cells", [("connectivity", connectivity), ("offsets", np.cumsum(sizes).astype("i8")), ("types", kinds)]
        ),
        *_section("PointData", fields.items()),
        "</Piece>",
        "</UnstructuredGrid>",
        "</VTKFile>",
        "",
    ]
    path.write_text("\n".join(lines), encoding="ascii")


def _section(name: str, arrays: Iterable[tuple[str, NDArray[Any]]]) -> list[str]:
    return [f"<{name}>", *(_array(*item) for item in arrays), f"</{name}>"]


def _array(name: str, values: NDArray[Any]) -> str:
    kind = "i8" if values.dtype.kind == "i" else values.dtype.str[1:]
    content = np.ascontiguousarray(values, dtype=kind).tobytes()
    data = base64.b64encode(np.uint64(len(content)).tobytes() + content).decode("ascii")
    size = values.shape[1] if values.ndim == 2 else 1
    return (
        f'<DataArray type="{_TYPES[kind]}" Name={quoteattr(name)} NumberOfComponents="{size}" format="binary">'
        f"{data}</DataArray>"
    )

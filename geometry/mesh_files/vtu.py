"""VTK's unstructured grids (.vtu): any version, compression and encoding; fields become sets.

A point field ``set_NAME`` is a node set: 0 outside, else 1 + place in the set. A cell field ``set_NAME`` marks solids
(an element set) and faces (a surface and its nodes). Any other field of integers gives a set ``FIELD_VALUE`` for each
of its values but 0 at points, and for each of its values in cells.

The arrays are text, base64 or appended, of either byte order, uncompressed or by zlib, LZ4 or LZMA. They are read
here, because VTK ends the program on a damaged block, and other libraries know neither newer versions nor LZ4. The
layout is that of the manual, "VTK XML formats": before binary data stands their size, or else the number of blocks,
the size of a block, that of the last one, and the compressed size of each.
"""

from __future__ import annotations

import base64
import binascii
import lzma
import re
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from geometry.errors import MeshFileError
from geometry.mesh_files.file_mesh import CellBlock, FileMesh, add_cells_to_set, mesh_of_cells
from geometry.sector import IntArray

TYPES = {
    **{
        f"{sign}Int{bits}": f"{letter}{bits // 8}"
        for sign, letter in (("", "i"), ("U", "u"))
        for bits in (8, 16, 32, 64)
    },
    "Float32": "f4",
    "Float64": "f8",
}
_SEGMENT = re.compile(rb"[A-Za-z0-9+/]+=*")
LARGEST = 2**40  # bytes that a header may claim of an array
SET = "set_"
MOST_VALUES = 1000
# names of cells by their number in VTK and the number of their nodes; Lagrange cells of order 2 are numbered as the
# quadratic ones
NAMES = {
    (1, 1): "vertex", (3, 2): "line", (4, 2): "line", (21, 3): "line3", (68, 2): "line", (68, 3): "line3",
    (5, 3): "triangle", (69, 3): "triangle", (22, 6): "triangle6", (69, 6): "triangle6", (34, 7): "triangle7",
    (9, 4): "quad", (8, 4): "quad", (70, 4): "quad", (23, 8): "quad8", (28, 9): "quad9", (70, 9): "quad9",
    (10, 4): "tetra", (71, 4): "tetra", (24, 10): "tetra10", (71, 10): "tetra10",
    (13, 6): "wedge", (73, 6): "wedge", (26, 15): "wedge15", (32, 18): "wedge18", (73, 18): "wedge18",
    (12, 8): "hexahedron", (11, 8): "hexahedron", (72, 8): "hexahedron", (25, 20): "hexahedron20",
    (33, 24): "hexahedron24", (29, 27): "hexahedron27", (72, 27): "hexahedron27",
}  # fmt: skip
PYRAMIDS = (14, 27, 37, 74, 81)
ROWS = {8: [0, 1, 3, 2], 11: [0, 1, 3, 2, 4, 5, 7, 6]}  # pixels and voxels go row by row
SOLIDS = {  # of which those that are not in `NAMES` are refused
    31: "quadratic-linear wedge", 42: "polyhedron",
    71: "Lagrange tetrahedron", 72: "Lagrange hexahedron", 73: "Lagrange wedge",
    78: "Bezier tetrahedron", 79: "Bezier hexahedron", 80: "Bezier wedge",
    10: "tetrahedron", 11: "voxel", 12: "hexahedron", 13: "wedge", 24: "quadratic tetrahedron",
    25: "quadratic hexahedron", 26: "quadratic wedge", 29: "triquadratic hexahedron",
    32: "biquadratic wedge", 33: "biquadratic hexahedron",
}  # fmt: skip
LAGRANGE_HEXAHEDRON, SWAPPED_BEFORE = 72, (2, 1)  # files of earlier versions exchange its nodes 18 and 19


@dataclass
class Grid:
    """An unstructured grid as its file has it."""

    version: tuple[int, int]  # version of the file
    pieces: int  # how many pieces it had
    points: np.ndarray  # (N, 3), points
    # `codes`, `ends`, `connected`: (E,), type of each cell, where its points end in `connected`, and the points
    codes: np.ndarray
    ends: np.ndarray
    connected: np.ndarray
    # `at_points`, `in_cells`: fields of numbers
    at_points: dict[str, np.ndarray] = field(default_factory=dict)
    in_cells: dict[str, np.ndarray] = field(default_factory=dict)


def read_grid(path: str | Path) -> Grid:
    """The unstructured grid in a file; pieces one after the other."""
    try:
        return _grid(path, Path(path).read_bytes())
    except MeshFileError:
        raise
    except ElementTree.ParseError as error:
        raise MeshFileError(path, f"cannot be read: no XML, {error}") from None
    except (ValueError, KeyError, IndexError, OverflowError, OSError, zlib.error, lzma.LZMAError) as error:
        raise MeshFileError(path, f"cannot be read: damaged, {error or type(error).__name__}") from None


def _grid(path: str | Path, content: bytes) -> Grid:
    opened = re.search(rb"<AppendedData[^>]*>", content)
    head = content if opened is None else content[: opened.start()] + b"</VTKFile>"
    if b"<!DOCTYPE" in head or b"<!ENTITY" in head:
        raise MeshFileError(path, "declares a document type: a file as VTK writes it is needed")
    root = ElementTree.fromstring(head)
    if root.tag != "VTKFile" or root.get("type") != "UnstructuredGrid":
        raise MeshFileError(path, f"holds {root.get('type') or root.tag}: an UnstructuredGrid of VTK is needed")
    reader = _reader(path, root)
    if opened is not None:
        reader.take_appended(content[opened.end() :], b"raw" in opened[0])
    version = [int(part) for part in (root.get("version") or "0.1").split(".")[:2]]
    pieces = [reader.piece(piece) for piece in root.iter("Piece")]
    pieces = [piece for piece in pieces if len(piece.points)] or pieces[:1]
    if not pieces:
        raise MeshFileError(path, "holds no piece of a grid")
    first = pieces[0]
    for other in pieces[1:]:
        first.ends = np.concatenate([first.ends, other.ends + len(first.connected)])
        first.connected = np.concatenate([first.connected, other.connected + len(first.points)])
        first.points = np.concatenate([first.points, other.points])
        first.codes = np.concatenate([first.codes, other.codes])
        for mine, its in ((first.at_points, other.at_points), (first.in_cells, other.in_cells)):
            for name in list(mine):
                if name in its and its[name].shape[1:] == mine[name].shape[1:]:
                    mine[name] = np.concatenate([mine[name], its[name]])
                else:
                    del mine[name]
    first.version, first.pieces = (version[0], version[-1]), len(pieces)
    return first


def _reader(path: str | Path, root: ElementTree.Element) -> _ArrayReader:
    compressor = root.get("compressor") or ""
    if compressor not in DECOMPRESS:
        known = ", ".join(name for name in DECOMPRESS if name)
        raise MeshFileError(path, f"is compressed by {compressor}: must be uncompressed, or by {known}")
    order = ">" if root.get("byte_order") == "BigEndian" else "<"
    return _ArrayReader(order, np.dtype(order + TYPES[root.get("header_type") or "UInt32"]), DECOMPRESS[compressor])


@dataclass
class _ArrayReader:
    order: str
    header: np.dtype[np.unsignedinteger]
    decompress: Callable[[bytes, int], bytes] | None
    appended: bytes = b""
    raw: bool = True

    def take_appended(self, rest: bytes, raw: bool) -> None:
        """Keep the data behind the mark _ of the part AppendedData."""
        self.appended, self.raw = rest[rest.index(b"_") + 1 :], raw
        if not raw:
            self.appended = self.appended.partition(b"<")[0]

    def piece(self, piece: ElementTree.Element) -> Grid:
        n_points, n_cells = (int(piece.get(name) or 0) for name in ("NumberOfPoints", "NumberOfCells"))
        places, cells = self._arrays(piece, "Points"), self._arrays(piece, "Cells")
        points = next(iter(places.values())) if places else np.empty((0, 3))
        none = np.empty(0, dtype=np.int64)
        codes, ends, connected = (cells.get(name, none).ravel() for name in ("types", "offsets", "connectivity"))
        ends, connected = ends.astype(np.int64), connected.astype(np.int64)
        if points.shape != (n_points, 3) or len(codes) != n_cells or len(ends) != n_cells:
            raise ValueError(f"says {n_points} points and {n_cells} cells and has others")
        if n_cells and (np.diff(ends, prepend=0).min() < 0 or ends[-1] != len(connected)):
            raise ValueError("the offsets of its cells do not fit their points")
        if len(connected) and not 0 <= connected.min() <= connected.max() < n_points:
            raise ValueError(f"cells name points beyond 0 to {n_points - 1}")
        fields = [
            {name: values for name, values in self._arrays(piece, part).items() if len(values) == count}
            for part, count in (("PointData", n_points), ("CellData", n_cells))
        ]
        return Grid((0, 1), 1, points.astype(np.float64), codes.astype(np.int64), ends, connected, *fields)

    def _arrays(self, piece: ElementTree.Element, part: str) -> dict[str, np.ndarray]:
        found = piece.find(part)
        arrays = [] if found is None else found.findall("DataArray")
        return {array.get("Name") or part: self._values(array) for array in arrays if array.get("type", "") in TYPES}

    def _values(self, array: ElementTree.Element) -> np.ndarray:
        kind = np.dtype(self.order + TYPES[array.get("type", "")])
        text = "".join([array.text or "", *(child.tail or "" for child in array)])
        form = array.get("format") or "ascii"
        if form == "ascii":
            values = np.array(text.split(), dtype=str).astype(np.float64 if kind.kind == "f" else np.int64)
        elif form == "binary":
            values = np.frombuffer(self._plain(_decoded(text.encode("ascii", "replace"))), kind)
        elif form == "appended":
            rest = self.appended[int(array.get("offset", "")) :]
            values = np.frombuffer(self._plain(rest if self.raw else _decoded(rest, self._size_of)), kind)
        else:
            raise ValueError(f"an array of format {form}")
        values = values.astype(kind.newbyteorder("="))
        components = int(array.get("NumberOfComponents") or 1)
        return values if components == 1 else values.reshape(-1, components)

    def _size_of(self, start: bytes) -> int:
        """Bytes of an array with its header, told from its start; more than the start has where it is too short."""
        size = self.header.itemsize
        if self.decompress is None:
            return size + int(np.frombuffer(start[:size], self.header)[0])
        count = int(np.frombuffer(start[:size], self.header)[0])
        sizes = np.frombuffer(start[: (3 + count) * size][: len(start) // size * size], self.header)
        if len(sizes) < 3 + count:
            return (3 + count) * size
        return (3 + count) * size + int(sizes[3:].astype(np.int64).sum())

    def _plain(self, blob: bytes) -> bytes:
        """The data behind their header, uncompressed."""
        size = self.header.itemsize
        if len(blob) < size:
            raise ValueError("an array without data")
        total = self._size_of(blob)
        if not total <= min(len(blob), LARGEST):
            raise ValueError("an array that is cut off")
        if self.decompress is None:
            return blob[size:total]
        count = int(np.frombuffer(blob[:size], self.header)[0])
        block, last, *sizes = np.frombuffer(blob[size : (3 + count) * size], self.header).tolist()
        place, parts = (3 + len(sizes)) * size, []
        for k, length in enumerate(sizes):
            expected = last if last and k == len(sizes) - 1 else block
            parts.append(self.decompress(blob[place : place + length], expected))
            if len(parts[-1]) != expected:
                raise ValueError("a block of an array that is damaged")
            place += length
        return b"".join(parts)


def _decoded(text: bytes, size_of: Callable[[bytes], int] | None = None) -> bytes:
    """The bytes of base64; header and data are encoded apart or together, so each padding ends a segment.

    Of data that go on beyond the array, `size_of` tells from its start how many bytes are needed.
    """
    found = b""
    try:
        for segment in _SEGMENT.finditer(b"".join(text.split())):
            part = segment[0]
            needed = None if size_of is None or len(found) < 8 else size_of(found)
            if needed is not None and len(found) >= needed:
                break
            found += base64.b64decode(part[: len(part) // 4 * 4])
    except binascii.Error as error:
        raise ValueError(f"base64 that is none ({error})") from None
    return found


def _unzipped(data: bytes, size: int) -> bytes:
    return zlib.decompressobj().decompress(data, size + 1)


def _from_lzma(data: bytes, size: int) -> bytes:
    return lzma.LZMADecompressor().decompress(data, size + 1)


def _from_lz4(data: bytes, size: int) -> bytes:
    """A block of LZ4: literals, then a copy of what stands `back` bytes before, again and again."""
    found, place = bytearray(), 0
    while place < len(data):
        token = data[place]
        count, place = _length(data, place + 1, token >> 4)
        found += data[place : place + count]
        place += count
        if place >= len(data):
            break
        back = data[place] | data[place + 1] << 8
        count, place = _length(data, place + 2, token & 15)
        start = len(found) - back
        if back == 0 or start < 0 or len(found) + count + 4 > size:
            raise ValueError("a block of LZ4 that is damaged")
        copied = found[start : start + count + 4]
        found += (copied * ((count + 4) // back + 1))[: count + 4]
    return bytes(found)


def _length(data: bytes, place: int, count: int) -> tuple[int, int]:
    """A length of LZ4, which goes on in further bytes from 15 on, and the place after it."""
    more = 255 if count == 15 else 0
    while more == 255:
        more = data[place]
        count, place = count + more, place + 1
    return count, place


DECOMPRESS: dict[str, Callable[[bytes, int], bytes] | None] = {
    "": None,
    "vtkZLibDataCompressor": _unzipped,
    "vtkLZ4DataCompressor": _from_lz4,
    "vtkLZMADataCompressor": _from_lzma,
}


def read_vtu(path: str | Path) -> FileMesh:
    """Points, cells and sets of an unstructured grid."""
    grid = read_grid(path)
    blocks = _blocks(path, grid)
    mesh = mesh_of_cells(path, grid.points, blocks)
    if grid.pieces > 1:
        mesh.notes.append(f"holds {grid.pieces} pieces: points at their borders are not joined")
    for name, values in grid.at_points.items():
        for set_name, members in _sets_of(mesh, name, values, at_points=True):
            mesh.node_sets[set_name] = members + 1
    for block in blocks:
        for name, values in grid.in_cells.items():
            for set_name, members in _sets_of(mesh, name, values[block.labels - 1], at_points=False):
                add_cells_to_set(mesh, set_name, block, members)
    return mesh


def _blocks(path: str | Path, grid: Grid) -> list[CellBlock]:
    """Cells by their kind; labels are places in the file, from 1."""
    starts = np.concatenate([[0], grid.ends[:-1]])
    sizes = grid.ends - starts
    blocks = []
    for code, size in np.unique(np.column_stack([grid.codes, sizes]), axis=0).tolist():
        rows = np.flatnonzero((grid.codes == code) & (sizes == size))
        name = "pyramid" if code in PYRAMIDS else NAMES.get((code, size))
        if name is None and code in SOLIDS:
            raise MeshFileError(
                path,
                f"cell {rows[0] + 1} is a {SOLIDS[code]} of {size} nodes: must be a tetrahedron, wedge or hexahedron "
                "of order 1 or 2; write the file with such cells",
            )
        data = grid.connected[starts[rows][:, None] + np.arange(size)]
        if (code, size) == (LAGRANGE_HEXAHEDRON, 27) and grid.version < SWAPPED_BEFORE:
            data[:, [18, 19]] = data[:, [19, 18]]
        columns = ROWS.get(code, slice(None))
        blocks.append(CellBlock(name or f"of VTK type {code}", data[:, columns], rows + 1))
    return blocks


def _sets_of(mesh: FileMesh, name: str, field: np.ndarray, at_points: bool) -> list[tuple[str, IntArray]]:
    """Names and members of the sets that a field stands for."""
    if field.ndim == 2 and field.shape[1] == 1:
        field = field[:, 0]
    if field.ndim != 1 or not len(field):
        return []
    if name.startswith(SET):
        inside = np.flatnonzero(field)
        inside = inside[np.argsort(field[inside], kind="stable")] if at_points else inside
        return [(name.removeprefix(SET), inside)]
    if field.dtype.kind not in "iub":
        return []
    values = np.unique(field)
    if len(values) > MOST_VALUES:
        mesh.notes.append(f"field {name} has {len(values)} values and is not taken for sets: at most {MOST_VALUES}")
        return []
    return [(f"{name}_{value}", np.flatnonzero(field == value)) for value in values if value != 0 or not at_points]

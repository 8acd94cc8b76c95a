"""Ansys archives (.cdb, as CDWRITE writes them) and decks of Workbench with the same tables.

A table starts with its command and a Fortran format; its end is a row of -1. An archive of CDWRITE has one table of
nodes and one of elements, a deck of Workbench one of elements for each body, and others for surfaces and contact.
Nodes of SOLID185 and SOLID186 go round as here; their prism and tetrahedral forms repeat nodes. A component of nodes
is a node set, one of elements an element set; the name of a material is its number.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from geometry.errors import MeshFileError
from geometry.mesh_files.ansys_materials import add_materials
from geometry.mesh_files.file_mesh import NO_LABELS, FileElements, FileMesh
from geometry.mesh_files.material_tables import take_material
from geometry.mesh_files.text_files import numbers, text_lines
from geometry.sector import FloatArray, IntArray

HEAD, FIRST, COUNT = 11, 8, 8  # fields before the nodes, nodes on the first line, field with the number of nodes
MOST_NODES, WIDEST = 27, 40
GENERATORS = (
    *("NGEN", "EGEN", "ENGEN", "NSYM", "ESYM", "ENSYM", "FILL", "NMODIF", "NSCALE", "TRANSFER", "VSWEEP"),
    *("CDREAD", "/INPUT", "NDELE", "EDELE", "NUMMRG", "NUMCMP", "UPCOORD", "UPGEOM", "EREFINE", "NREFINE", "NREAD"),
    *("EREAD", "VEXT", "VGEN", "VMESH", "*REPEAT"),
)
# commands that tie nodes or hold them, which are counted
COUNTED = (
    *(
        "CE",
        "CERIG",
        "CEINTF",
        "CP",
        "CPINTF",
        "CYCLIC",
        "CPCYC",
        "CECYC",
        "RBE3",
        "CPNGEN",
        "CPSGEN",
        "CENGEN",
        "CESGEN",
    ),
    *("D", "DK", "DL", "DA", "DSYM", "E", "EN", "CM", "CMGRP"),
)
_FIELD = re.compile(r"(\d*)\s*(?:([ieEfFdDgG])(\d+)(?:\.\d+)?(?:e\d+)?|x)", re.IGNORECASE)
_INTEGERS, _NUMBERS = frozenset(" 0123456789-"), frozenset(" 0123456789.+-EeDd")
_HOW = "as CDWRITE,DB writes"
KINDS = {185: "hex8", 45: "hex8", 186: "hex20", 95: "hex20", 187: "tet10", 92: "tet10", 285: "tet4"}
COUNTS = {"hex8": 8, "hex20": 20, "tet10": 10, "tet4": 4}
MATERIAL, TYPE, SYSTEM, NUMBER, NODES = 0, 1, 4, 10, 11  # columns of an element
# plane elements; those of the effect "surfaces" below are others
SHELLS = (28, 43, 63, 93, 131, 132, 181, 281)
# what elements and commands that are left out do, by the keys of `file_mesh.EFFECTS`; other elements are bodies
ELEMENTS = {
    "surfaces": (*range(151, 157), 200, 201),
    "contacts": (12, 52, *range(169, 179)),
    "ties": (179, 184),
    "springs": (14, 37, 38, 39, 40, 214, 250),
    "masses": (21,),
}
COMMANDS = {
    "ties": ("CE", "CERIG", "CEINTF", "CP", "CPINTF", "RBE3", "CPNGEN", "CPSGEN", "CENGEN", "CESGEN"),
    "cyclic": ("CYCLIC", "CPCYC", "CECYC"),
    "supports": ("D", "DK", "DL", "DA", "DSYM"),
    "bodies": ("E", "EN"),
    "unknown": ("CM", "CMGRP"),
}


@dataclass
class AnsysTables:
    """What the tables of an archive hold."""

    types: dict[int, int] = field(default_factory=dict)  # number of the element (186 of SOLID186) by that of its type
    # `node_labels`, `points`: (n,), nodes, table by table
    node_labels: list[IntArray] = field(default_factory=list)
    points: list[FloatArray] = field(default_factory=list)
    elements: list[list[int]] = field(default_factory=list)  # fields of each element: 11 of its head, then its nodes
    # how many elements are in tables without the key SOLID, by the number of their type; 0: not said
    surfaces: dict[int, int] = field(default_factory=dict)
    # (k,), kind ("NODE" or "ELEM") and integers of each component; a negative one ends a range
    components: dict[str, tuple[str, IntArray]] = field(default_factory=dict)
    commands: dict[str, int] = field(default_factory=dict)  # how often the counted commands stand in the archive


def read_tables(path: object, lines: list[str]) -> AnsysTables:
    """The tables of an archive."""
    found, current_type, place = AnsysTables(), 0, 0
    tables: dict[str, Callable[[object, list[str], int, AnsysTables], int]] = {
        "NBLOCK": _nodes,
        "ETBLOCK": _types,
        "CMBLOCK": _component,
    }
    seen = {"NBLOCK": 0, "EBLOCK": 0}
    solid = 0
    while place < len(lines):
        line = lines[place]
        if not line.strip() or line.lstrip()[:1] in "(!":
            place += 1
            continue
        fields = [part.strip() for part in line.partition("!")[0].split(",")]
        name = fields[0].upper()
        seen[name] = seen.get(name, 0) + 1
        if name in tables:
            place = tables[name](path, lines, place, found)
            continue
        if name == "EBLOCK":
            is_solid = len(fields) > 2 and fields[2].upper() == "SOLID"
            solid += is_solid
            place = (
                _elements(path, lines, place, found)
                if is_solid
                else _surfaces(path, lines, place, found, current_type)
            )
            continue
        if name in GENERATORS and seen["NBLOCK"]:
            raise MeshFileError(
                path,
                f"line {place + 1}, {name}: makes or changes nodes or elements, which is not read: "
                f"let Ansys write the mesh out, {_HOW}",
            )
        if name == "ET" and len(fields) > 2 and fields[1].isdecimal() and (code := re.search(r"(\d+)$", fields[2])):
            found.types[int(fields[1])] = int(code[1])
        elif name == "TYPE" and len(fields) > 1:
            current_type = int(fields[1]) if fields[1].isdecimal() else 0
        elif name in COUNTED and not _is_part(fields):
            found.commands[name] = found.commands.get(name, 0) + 1
        place += 1
    for name in ("NBLOCK", "EBLOCK"):
        if not seen[name]:
            raise MeshFileError(
                path,
                f"holds 0 {name} tables: must hold one, {_HOW}; a deck of commands (APDL) must be run in Ansys and "
                "written with it",
            )
    if not solid:
        line = next(line for line in lines if line[:6].upper() == "EBLOCK")
        raise MeshFileError(path, f"{line.strip()!r}: must be EBLOCK with the key SOLID, {_HOW}")
    return found


def _is_part(fields: list[str]) -> bool:
    """Whether a command ends a table, or goes on with the terms of a constraint equation."""
    coded = fields[0].upper() == "CE" and len(fields) > 2 and fields[1].upper().startswith("R")
    return "-1" in fields[1:4] or (coded and fields[2].upper() != "DEFI")


def _widths(path: object, lines: list[str], start: int, numbers_too: bool) -> list[tuple[str, int, int]]:
    """Letter, first and last column of each field of a Fortran format such as (1i7,2i9,6e21.13)."""
    text = lines[start].strip() if start < len(lines) else ""
    columns: list[tuple[str, int, int]] = []
    column, rest = 0, text[1:-1].replace(" ", "") if text[:1] == "(" and text[-1:] == ")" else ""
    parts = [_FIELD.fullmatch(part) for part in rest.split(",")] if rest else []
    for part in parts:
        repeat = int(part[1] or 1) if part is not None and len(part[1]) < 4 else 0
        width = 0 if part is None else 1 if part[2] is None else int(part[3][:4])
        for _ in range(repeat):
            if part is not None and part[2] is not None:
                columns.append((part[2].lower(), column, column + width))
            column += width
        if not (repeat and 0 < width <= WIDEST):
            columns.clear()
            break
    integers = sum(letter == "i" for letter, _, _ in columns)
    good = columns and columns[0][0] == "i" and (integers == len(columns)) != numbers_too
    if not good or (numbers_too and len(columns) - integers < 3):
        raise MeshFileError(
            path, f"line {start + 1}: {text[:40]!r} must be a format such as (3i9,6e21.13e3) or (19i10)"
        )
    return columns


def _equal_width(path: object, lines: list[str], start: int) -> int:
    columns = _widths(path, lines, start, numbers_too=False)
    return columns[0][2] - columns[0][1]


def _announced(lines: list[str], place: int) -> int:
    """The number of rows that the head of a table says; 0 where it says none."""
    fields = [part.strip() for part in lines[place].split(",")]
    return int(fields[4]) if len(fields) > 4 and fields[4].isdecimal() else 0


def _check_rows(path: object, lines: list[str], place: int, rows: int) -> None:
    said = _announced(lines, place)
    if said not in (0, rows):
        name = lines[place].split(",")[0].strip().upper()
        raise MeshFileError(path, f"{name} says {said} rows and has {rows}: the file must be whole")


def _nodes(path: object, lines: list[str], place: int, found: AnsysTables) -> int:
    columns = _widths(path, lines, place + 1, numbers_too=True)
    first = columns[0][1:]
    reals = [(a, b) for letter, a, b in columns if letter != "i"][:3]
    labels: list[str] = []
    values: list[str] = []
    for number in range(place + 2, len(lines)):
        line = lines[number]
        if line[:1] in ("N", "n", "-") or line.strip() == "-1":
            break
        label = line[first[0] : first[1]].strip()
        if not _NUMBERS.issuperset(line) or not label.isdecimal():
            raise MeshFileError(path, f"line {number + 1}: {line.strip()[:40]!r} must be a row of the NBLOCK table")
        labels.append(label)
        values += [line[a:b].strip() or "0" for a, b in reals]
    else:
        raise MeshFileError(path, "the NBLOCK table has no end: the file must be whole")

    def refusal(text: str) -> MeshFileError:
        return MeshFileError(path, f"{text!r} in the NBLOCK table must be a number")

    if len(lines[place].split(",")) > 2 and lines[place].split(",")[2].strip().upper() == "SOLID":
        _check_rows(path, lines, place, len(labels))
    if any(len(label) > 10 for label in labels):
        raise MeshFileError(path, "a row of the NBLOCK table has a label with more than 10 digits")
    found.node_labels.append(np.array(list(map(int, labels)), dtype=np.int64))
    found.points.append(numbers(values, refusal).reshape(-1, 3))
    return number + 1


def _elements(path: object, lines: list[str], place: int, found: AnsysTables) -> int:
    head, width = place, _equal_width(path, lines, place + 1)
    place, before = place + 2, len(found.elements)
    while place < len(lines) and lines[place].strip() != "-1":
        first = lines[place].rstrip()
        text = first[COUNT * width : (COUNT + 1) * width].strip()
        count = int(text) if text.isdecimal() and len(text) < 9 else 0
        rest = lines[place + 1].rstrip() if count > FIRST and place + 1 < len(lines) else ""
        whole = len(first) == width * (HEAD + min(count, FIRST)) and len(rest) == width * max(count - FIRST, 0)
        if not (0 < count <= MOST_NODES and whole and _INTEGERS.issuperset(first) and _INTEGERS.issuperset(rest)):
            raise MeshFileError(
                path, f"line {place + 1}: {' '.join(first.split())[:40]!r} must be a row of the EBLOCK table"
            )
        try:
            found.elements.append(
                [int(row[k : k + width]) for row in (first, rest) for k in range(0, len(row), width)]
            )
        except ValueError:
            raise MeshFileError(
                path, f"line {place + 1}: {' '.join(first.split())[:40]!r} must be a row of the EBLOCK table"
            ) from None
        place += 2 if count > FIRST else 1
    if place >= len(lines):
        raise MeshFileError(path, "the EBLOCK table has no end: the file must be whole")
    _check_rows(path, lines, head, len(found.elements) - before)
    return place + 1


def _surfaces(path: object, lines: list[str], place: int, found: AnsysTables, current_type: int) -> int:
    """A table of elements without the key SOLID: their number; their type is that of the last command TYPE."""
    _equal_width(path, lines, place + 1)
    end = place + 2
    while end < len(lines) and lines[end].strip() != "-1":
        if not _INTEGERS.issuperset(lines[end]):
            shown = " ".join(lines[end].split())[:40]
            raise MeshFileError(path, f"line {end + 1}: {shown!r} must be a row of the EBLOCK table")
        end += 1
    if end == len(lines):
        raise MeshFileError(path, "the EBLOCK table has no end: the file must be whole")
    rows = _announced(lines, place) or end - place - 2
    found.surfaces[current_type] = found.surfaces.get(current_type, 0) + rows
    return end + 1


def _types(path: object, lines: list[str], place: int, found: AnsysTables) -> int:
    """ETBLOCK: rows of the number of a type and of its element."""
    end = place + 2
    while end < len(lines) and not lines[end].strip().startswith("-1"):
        words = lines[end].split()
        if len(words) < 2 or not (words[0].isdecimal() and words[1].isdecimal()):
            raise MeshFileError(path, f"line {end + 1}: {lines[end].strip()[:40]!r} must be a row of ETBLOCK")
        found.types[int(words[0])] = int(words[1])
        end += 1
    return end + 1


def _component(path: object, lines: list[str], place: int, found: AnsysTables) -> int:
    """A CMBLOCK: its number of items, its format and that many integers."""
    fields = [part.partition("!")[0].strip() for part in lines[place].split(",")]
    count = int(fields[3]) if len(fields) > 3 and fields[3].isdecimal() and len(fields[3]) < 10 else -1
    kind = fields[2].upper() if len(fields) > 2 else ""
    if count < 0 or kind not in ("NODE", "ELEM", "ELEMENT", "NODES"):
        raise MeshFileError(
            path, f"line {place + 1}: {lines[place].strip()[:40]!r} must be CMBLOCK, name, NODE or ELEM, count"
        )
    width = _equal_width(path, lines, place + 1)
    place += 2
    values: list[int] = []
    while len(values) < count:
        line = lines[place].rstrip() if place < len(lines) else ""
        try:
            if not line or len(line) % width or not _INTEGERS.issuperset(line):
                raise ValueError
            values += [int(line[k : k + width]) for k in range(0, len(line), width)]
        except ValueError:
            raise MeshFileError(
                path, f"line {place + 1}: {line.strip()[:40]!r} must be a row of {fields[1]}"
            ) from None
        place += 1
    found.components[fields[1]] = (kind[:4], np.array(values[:count], dtype=np.int64))
    return place


def read_ansys(path: str | Path) -> FileMesh:
    """Nodes, elements, components and materials of an archive."""
    lines = text_lines(path)
    tables = read_tables(path, lines)
    mesh = FileMesh(str(path), np.concatenate(tables.node_labels), np.concatenate(tables.points))
    systems = add_materials(mesh, lines)
    _add_elements(mesh, [np.array(row, dtype=np.int64) for row in tables.elements], tables.types, systems)
    labels = {"NODE": np.unique(mesh.node_labels), "ELEM": np.unique([row[NUMBER] for row in tables.elements])}
    for name, (kind, values) in tables.components.items():
        sets = mesh.node_sets if kind == "NODE" else mesh.element_sets
        sets[name] = _members(mesh, name, values, labels[kind])
    _add_plane_elements(mesh, tables)
    _leave_out(mesh, tables)
    return mesh


def _add_plane_elements(mesh: FileMesh, tables: AnsysTables) -> None:
    """Take plane elements that a component may name; the nodes behind the corners are of no concern."""
    rows: dict[tuple[int, int], list[list[int]]] = {}
    for row in tables.elements:
        code, count = tables.types.get(row[TYPE], 0), len(row) - NODES
        if code in (*SHELLS, *ELEMENTS["surfaces"]) and count > 2:
            corners = 3 if count in (3, 6) else 4
            rows.setdefault((code, corners), []).append([row[NUMBER], *row[NODES : NODES + corners]])
    for (code, _), found in rows.items():
        table = np.array(found, dtype=np.int64)
        mesh.add_plane(f"elements of type {code}" if code in SHELLS else "", table[:, 0], table[:, 1:])


def _members(mesh: FileMesh, name: str, values: IntArray, labels: IntArray) -> IntArray:
    """Labels of a component, ranges (first, -last) filled with those that are there."""
    parts = [NO_LABELS]
    for place in np.flatnonzero(values > 0):
        last = -values[place + 1] if place + 1 < len(values) and values[place + 1] < 0 else values[place]
        start, end = np.searchsorted(labels, values[place]), np.searchsorted(labels, last, side="right")
        parts.append(labels[start:end])
    ends = np.flatnonzero(values <= 0)
    if len(ends) and (ends[0] == 0 or (values[ends - 1] <= 0).any()):
        raise mesh.refuse(f"component {name}: a range must have a first and a last label")
    return np.concatenate(parts)


def _leave_out(mesh: FileMesh, tables: AnsysTables) -> None:
    """Say which elements, constraints and components are left out."""
    found: dict[str, dict[str, int]] = {}
    counts = dict(tables.surfaces)
    for row in tables.elements:
        if tables.types.get(row[TYPE], 0) not in (*KINDS, *SHELLS):
            counts[row[TYPE]] = counts.get(row[TYPE], 0) + 1
    for number, count in counts.items():
        code = tables.types.get(number, 0)
        if number in tables.surfaces and code in KINDS:
            raise mesh.refuse(f"{count} SOLID{code} stand in an EBLOCK without SOLID: write the mesh with CDWRITE,DB")
        effect = next((effect for effect, codes in ELEMENTS.items() if code in codes), "bodies")
        name = f"elements of type {code or 'unknown'}"
        if number in tables.surfaces and not code:  # Workbench writes surfaces and contact in this way
            effect, name = "unknown", "elements of an EBLOCK without SOLID"
        names = found.setdefault(effect, {})
        names[name] = names.get(name, 0) + count
    for effect, commands in COMMANDS.items():
        given = {name: tables.commands[name] for name in commands if name in tables.commands}
        if given:
            found.setdefault(effect, {}).update(given)
    for effect, names in found.items():
        mesh.leave_out(effect, names)


def _add_elements(
    mesh: FileMesh, elements: list[IntArray], types: dict[int, int], systems: dict[int, FloatArray | None]
) -> None:
    if not elements:
        return
    table = np.concatenate(elements)
    lengths = np.array([len(element) for element in elements]) - NODES
    starts = np.cumsum(lengths + NODES) - lengths - NODES
    number = table[starts + TYPE]
    for key in np.unique(number):
        kind = KINDS.get(types.get(int(key), 0))
        rows = np.flatnonzero(number == key)
        if kind is None:
            continue
        count = COUNTS[kind]
        nodes = np.zeros((len(rows), count), dtype=np.int64)
        if (lengths[rows] > count).any():
            label = table[starts[rows] + NUMBER][lengths[rows] > count][0]
            raise mesh.refuse(f"element {label} (SOLID{types[int(key)]}): must have {count} nodes")
        for column in range(count):
            has = lengths[rows] > column
            nodes[has, column] = table[starts[rows[has]] + NODES + column]
        mesh.elements.append(FileElements(kind, table[starts[rows] + NUMBER], np.maximum(nodes, 0)))
    labels = table[starts + NUMBER]
    pairs = np.stack([table[starts + MATERIAL], table[starts + SYSTEM]], axis=1)
    for material, system in np.unique(pairs, axis=0):
        rows = labels[(pairs == (material, system)).all(axis=1)]
        axes = partial(systems.get, int(system))
        take_material(mesh, rows, str(material), f"coordinate system {system}", axes)

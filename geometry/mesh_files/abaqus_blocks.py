"""Keyword blocks of Abaqus and CalculiX input files, and the scopes that they fill.

A scope is the model, or an instance of a part, with labels of its own.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from geometry.elements import ELEMENT_KINDS
from geometry.errors import MeshFileError
from geometry.mesh_files.file_mesh import NO_LABELS, FileElements
from geometry.mesh_files.match_faces import free_sides
from geometry.mesh_files.text_files import MOST_INCLUDED, included_file, labels_of, numbers, text_lines
from geometry.sector import FloatArray, IntArray

_PARAMETER = re.compile(r'([^,=]*)(?:=\s*("[^"]*"|[^,]*)[^,]*)?(?:,|$)')  # matches anywhere: no backtracking
# parameters of the keywords that are read, as the manuals of Abaqus and CalculiX have them
PARAMETERS = {
    "NODE": ("NSET", "SYSTEM", "INPUT"),
    "ELEMENT": ("TYPE", "ELSET", "INPUT", "OFFSET", "SOLID ELEMENT NUMBERING"),
    "NSET": ("NSET", "ELSET", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED"),
    "ELSET": ("ELSET", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED"),
    "SURFACE": (
        *("NAME", "TYPE", "COMBINE", "CROP", "DEFINITION", "FILLET RADIUS", "INTERNAL", "MAX RATIO"),
        *("NO OFFSET", "NO THICK", "PROPERTY", "REGION TYPE", "SCALE THICK", "TRIM"),
    ),
    "SOLID SECTION": (
        *("ELSET", "MATERIAL", "COMPOSITE", "CONTROLS", "LAYUP", "ORDER", "ORIENTATION", "REF NODE"),
        *("STACK DIRECTION", "SYMMETRIC", "NLGEOM"),
    ),
    "PART": ("NAME",),
    "INSTANCE": ("NAME", "PART", "INSTANCE", "LIBRARY"),
    "INCLUDE": ("INPUT", "PASSWORD"),
}
WITH_INPUT = ("INCLUDE", "NODE", "ELEMENT")  # their INPUT= names a file
_LEAST = 3  # letters of an abbreviated parameter
KINDS = {4: "tet4", 10: "tet10", 6: "wedge6", 15: "wedge15", 8: "hex8", 20: "hex20"}
_SOLID = re.compile(r"C3D(\d+)([A-Z]*)$")
_PLANE = re.compile(r"(?:CPE?G?S?|CG?AX|S|STRI|M3D|SFM3D|DS|DC2D|WARP2D)(3|4|6|8|9|65)[A-Z]*\d?$")
_HELD = ("ENCASTRE", "PINNED")  # supports by their names that hold all directions
PYRAMIDS = (5, 13)
HEAT = ("INITIAL CONDITIONS", "TEMPERATURE")
SHELL_SECTIONS = ("SHELL SECTION", "MEMBRANE SECTION", "SHELL GENERAL SECTION")  # give plane elements a thickness
_SetKey = tuple[str, bool, str]  # scope, whether it is a set of nodes, name in upper case


@dataclass(frozen=True)
class KeywordBlock:
    """A keyword line with the data lines that follow it."""

    keyword: str  # in upper case, single spaces
    parameters: dict[str, str]  # names in upper case; "" for one without a value
    data: list[str]  # data lines without comments and empty lines
    line: int  # line of the keyword, from 1
    file: str = field(default="")  # file that holds it

    def refuse(self, found: str) -> MeshFileError:
        """An error that names file, line and keyword."""
        return MeshFileError(self.file, f"line {self.line}, *{self.keyword}: {found}")

    def needs(self, name: str) -> str:
        """Value of a parameter that must be given."""
        if not self.parameters.get(name):
            raise self.refuse(f"{name}= is missing: must be given")
        return self.parameters[name]


def keyword_blocks(path: str | Path) -> list[KeywordBlock]:
    """All blocks of a file and of the files that it includes, in their order."""
    blocks: list[KeywordBlock] = []
    opened = [0]
    _collect(str(path), str(path), (os.path.realpath(path),), blocks, opened)
    return blocks


def _collect(main: str, path: str, chain: tuple[str, ...], blocks: list[KeywordBlock], opened: list[int]) -> None:
    opened[0] += 1
    if opened[0] > MOST_INCLUDED or len(chain) > 50:
        raise MeshFileError(main, f"includes more than {MOST_INCLUDED} files or 50 one within the other: too many")
    for block in _blocks_of(path):
        if block.keyword == "INCLUDE":
            target = included_file(main, path, block.needs("INPUT"), chain)
            _collect(main, target, (*chain, target), blocks, opened)
            continue
        if block.keyword in WITH_INPUT and "INPUT" in block.parameters:
            target = included_file(main, path, block.needs("INPUT"), chain)
            block = replace(block, data=[*_data(text_lines(target)), *block.data])
        blocks.append(block)


def _data(lines: list[str]) -> list[str]:
    return [line for line in lines if line.strip() and line.lstrip()[:2] != "**"]


def _blocks_of(path: str) -> Iterator[KeywordBlock]:
    lines = text_lines(path)
    starts = _keyword_lines(lines)
    if not starts:
        raise MeshFileError(path, "holds no keyword such as *NODE: an Abaqus or CalculiX input file is needed")
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        text, first = _whole_line(lines, start, end)
        keyword, given = _head(text)
        block = KeywordBlock(keyword, given, _data(lines[first:end]), start + 1, path)
        unknown = [name for name in given if keyword in PARAMETERS and name not in PARAMETERS[keyword]]
        if unknown:
            allowed = ", ".join(PARAMETERS[keyword])
            raise block.refuse(f"parameter {unknown[0]} is not known: must be one of {allowed}")
        yield block


def _parameter(keyword: str, word: str) -> str | None:
    """The parameter of a keyword that is read which a word stands for, also abbreviated; None for none."""
    word = " ".join(word.upper().split())
    known = PARAMETERS.get(keyword, ())
    close = [name for name in known if name.startswith(word) and len(word) >= _LEAST]
    return word if word in known else close[0] if len(close) == 1 else None


def abaqus_includes(lines: list[str]) -> list[str]:
    """Files that an input file includes or takes data lines from, as written."""
    starts = _keyword_lines(lines)
    heads = [
        _head(_whole_line(lines, start, end)[0])
        for start, end in zip(starts, [*starts, len(lines)][1:], strict=True)
        if lines[start].lstrip()[1:].lstrip()[:4].upper() in ("INCL", "NODE", "ELEM")
    ]
    return [parameters["INPUT"] for keyword, parameters in heads if keyword in WITH_INPUT and parameters.get("INPUT")]


def _keyword_lines(lines: list[str]) -> list[int]:
    return [k for k, line in enumerate(lines) if line.lstrip()[:1] == "*" and line.lstrip()[:2] != "**"]


def _whole_line(lines: list[str], start: int, end: int) -> tuple[str, int]:
    """A keyword line with those that it goes on in, and the line after it.

    After a comma at its end it goes on where the next line has parameters. Else the comma ends the line, as
    CalculiX takes it, and data follow.
    """
    text, first = lines[start].strip(), start + 1
    keyword = _head(text)[0]
    while text.endswith(","):
        following = next((k for k in range(first, end) if _data(lines[k : k + 1])), end)
        parts = [] if following == end else [part for part in lines[following].split(",") if part.strip()]
        if not parts or not all("=" in part or _parameter(keyword, part) for part in parts):
            break
        text, first = text + lines[following].strip(), following + 1
    return text, first


def _head(text: str) -> tuple[str, dict[str, str]]:
    name, _, rest = text[1:].partition(",")
    keyword = " ".join(name.upper().split())
    words = [
        (found[1], (found[2] or "").strip().strip('"')) for found in _PARAMETER.finditer(rest) if found[1].strip()
    ]
    return keyword, {_parameter(keyword, word) or " ".join(word.upper().split()): value for word, value in words}


@dataclass
class Scope:
    """Nodes, elements and sets of a scope; all labels carry its offset."""

    name: str  # name of the instance; "" for the model and its assembly
    offset: int = 0  # what is added to the labels of the file
    # (3, 3), where the instance stands: x' = rotation @ x + translation
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    # (3, 3), where the instance stands: x' = rotation @ x + translation
    translation: FloatArray = field(default_factory=lambda: np.zeros(3))
    node_labels: list[IntArray] = field(default_factory=list)  # nodes
    points: list[FloatArray] = field(default_factory=list)  # nodes
    elements: list[FileElements] = field(default_factory=list)  # solid elements
    # `node_sets`, `element_sets`: labels, by name in upper case
    node_sets: dict[str, list[IntArray]] = field(default_factory=dict)
    element_sets: dict[str, list[IntArray]] = field(default_factory=dict)
    sides: dict[str, list[IntArray]] = field(default_factory=dict)  # (k, 2), surfaces, by name in upper case
    sections: list[tuple[IntArray, str, str]] = field(default_factory=list)  # (k,), elements, material, orientation
    orientations: dict[str, KeywordBlock] = field(default_factory=dict)  # by name in upper case
    # types of elements that are not read, and how many there are
    left_out: dict[str, int] = field(default_factory=dict)
    plane: list[FileElements] = field(default_factory=list)  # plane elements by their types
    held: dict[int, list[IntArray]] = field(default_factory=dict)  # nodes held in the directions 1, 2, 3
    plane_sections: list[IntArray] = field(default_factory=list)  # (k,), plane elements with a thickness
    temperatures: dict[int, float] = field(default_factory=dict)  # of nodes by their labels
    notes: list[str] = field(default_factory=list)  # what was left out

    @property
    def highest(self) -> int:
        """The highest label, its offset left away."""
        arrays = [*self.node_labels, *(elements.labels for elements in (*self.elements, *self.plane))]
        return max((int(array.max()) - self.offset for array in arrays if len(array)), default=0)


def add_nodes(scope: Scope, block: KeywordBlock) -> None:
    """Take the nodes of a *NODE block."""
    if not block.data:
        return
    table = _node_table(block)
    system = block.parameters.get("SYSTEM", "R").upper()
    points = table[:, 1:4]
    if system == "C":
        angle = np.radians(points[:, 1])
        points = np.column_stack([points[:, 0] * np.cos(angle), points[:, 0] * np.sin(angle), points[:, 2]])
    elif system != "R":
        raise block.refuse(f"SYSTEM={system}: must be R or C")
    labels = labels_of(table[:, 0], lambda field: block.refuse(f"node {field}: must be a positive integer"))
    if (labels == 0).any():
        raise block.refuse("node 0: must be a positive integer")
    scope.node_labels.append(labels + scope.offset)
    if scope.name:
        points = points @ scope.rotation.T + scope.translation
    scope.points.append(points)
    _join_set(scope.node_sets, block.parameters.get("NSET"), labels + scope.offset)


def _node_table(block: KeywordBlock) -> FloatArray:
    """Label and position of each node (N, 4)."""

    def refusal(field: str) -> Exception:
        return block.refuse(f"{field.strip()!r} in the data: must be a number")

    fields = ",".join(block.data).split(",")
    if len(fields) == 4 * len(block.data) and all(line.count(",") == 3 for line in block.data):
        try:
            return np.array(list(map(float, fields))).reshape(-1, 4)
        except ValueError:
            pass
    rows = []
    for line in block.data:
        parts = line.split(",")
        row = [*(part.strip() or "0" for part in parts[:4]), "0", "0", "0"][:4]
        beyond = sum(map(bool, map(str.strip, parts[4:])))  # a normal
        if beyond > 3 or (beyond and not set(line) & set(".eEdD")):
            raise block.refuse(
                f"{line.strip()[:40]!r}: must be a label and 3 coordinates, a normal may follow; numbers have "
                "points, not commas"
            )
        rows.append(numbers(row, refusal))
    return np.array(rows)


def add_elements(scope: Scope, block: KeywordBlock) -> None:
    """Take the elements of an *ELEMENT block, if they are solid."""
    name = block.needs("TYPE").upper()
    solid = _SOLID.match(name)
    if not block.data:
        return
    if solid and int(solid[1]) in PYRAMIDS:
        raise block.refuse(f"TYPE={name} are pyramids: only tetrahedra, wedges and hexahedra are read")
    if plane := _PLANE.match(name):
        table = _element_table(block, name, {"65": 6}.get(plane[1], int(plane[1])))
        table[table > 0] += scope.offset
        scope.plane.append(FileElements("" if name[:3] == "SFM" else name, table[:, 0], table[:, 1:]))
        if name[:3] == "SFM":
            scope.left_out[name] = scope.left_out.get(name, 0) + len(table)
        _join_set(scope.element_sets, block.parameters.get("ELSET"), table[:, 0])
        return
    if not solid or int(solid[1]) not in KINDS:
        scope.left_out[name] = scope.left_out.get(name, 0) + sum(
            not line.rstrip().endswith(",") for line in block.data
        )
        _join_set(scope.element_sets, block.parameters.get("ELSET"), NO_LABELS)
        return
    count = int(solid[1])
    if solid[2]:
        scope.notes.append(f"elements {name} are taken as {KINDS[count]} with full integration")
    table = _element_table(block, name, count)
    table[table > 0] += scope.offset
    scope.elements.append(FileElements(KINDS[count], table[:, 0], table[:, 1:]))
    _join_set(scope.element_sets, block.parameters.get("ELSET"), table[:, 0])


def _element_table(block: KeywordBlock, name: str, count: int) -> IntArray:
    """Label and nodes of each element (E, 1 + count); 0 for a field that is left empty."""

    def refusal(field: str) -> Exception:
        return block.refuse(f"{field.strip()!r} in the data: must be a positive integer")

    width = count + 1
    fields = ",".join(block.data).split(",")
    uneven = any(line.count(",") != count for line in block.data)
    if uneven or not all(map(str.strip, fields)):
        fields = _joined_rows(block, name, width)
    try:
        table = labels_of(fields, refusal).reshape(-1, width)
    except MemoryError:  # pragma: no cover
        raise block.refuse("is too large for the memory") from None
    if (table[:, 0] == 0).any():
        raise block.refuse("element 0: must be a positive integer")
    return table


def _joined_rows(block: KeywordBlock, name: str, width: int) -> list[str]:
    """Fields of elements that may go on over several lines."""
    rows: list[str] = []
    row: list[str] = []
    for line in block.data:
        fields = [part.strip() or "0" for part in line.split(",")]
        row += fields[:-1] if line.rstrip().endswith(",") else fields
        if len(row) > width:
            break
        if len(row) == width:
            rows += row
            row = []
    if row:
        raise block.refuse(f"element {row[0]} ({name}): must have {width - 1} nodes")
    return rows


def _join_set(sets: dict[str, list[IntArray]], name: str | None, labels: IntArray) -> None:
    if name:
        sets.setdefault(name.upper(), []).append(labels)


class SetReader:
    """Reads *NSET, *ELSET, *SURFACE and *SOLID SECTION of scopes, which may name sets of others and of later lines.

    Shapes: `contents` (Scope, list of KeywordBlock).
    """

    def __init__(self, scopes: Mapping[str, Scope], contents: list[tuple[Scope, list[KeywordBlock]]]) -> None:
        self._scopes = scopes
        self._labels: dict[tuple[str, bool], IntArray] = {}
        self._waiting: dict[_SetKey, list[KeywordBlock]] = {}
        self._open: list[_SetKey] = []
        for scope, blocks in contents:
            for block in blocks:
                if block.keyword in ("NSET", "ELSET"):
                    nodes = block.keyword == "NSET"
                    name = block.needs(block.keyword).upper()
                    (scope.node_sets if nodes else scope.element_sets).setdefault(name, [])
                    self._waiting.setdefault((scope.name, nodes, name), []).append(block)
        for scope, blocks in contents:
            for key in [key for key in self._waiting if key[0] == scope.name]:
                self._settle(scope, key)
            for block in blocks:
                if block.keyword == "SURFACE":
                    self._add_surface(scope, block)
                elif block.keyword == "BOUNDARY":
                    with suppress(MeshFileError):  # sets that hold no nodes of the mesh
                        self._add_held(scope, block)
                elif block.keyword in HEAT:
                    self._add_temperatures(scope, block)
                elif block.keyword in SHELL_SECTIONS and block.parameters.get("ELSET"):
                    scope.plane_sections.append(self._members(scope, block, block.parameters["ELSET"], False))
                elif block.keyword == "SOLID SECTION":
                    labels = self._members(scope, block, block.needs("ELSET"), False)
                    scope.sections.append((labels, block.needs("MATERIAL"), block.parameters.get("ORIENTATION", "")))

    def _settle(self, scope: Scope, key: _SetKey) -> None:
        """Take a set, with the blocks that define it."""
        self._open.append(key)
        for block in self._waiting.pop(key, []):
            self._add_set(scope, block, key[1])
        self._open.pop()

    def _add_set(self, scope: Scope, block: KeywordBlock, nodes: bool) -> None:
        sets = scope.node_sets if nodes else scope.element_sets
        members = self._instance(scope, block)
        if "GENERATE" in block.parameters:
            found = [self._generated(members, block, line, nodes) for line in block.data]
        elif nodes and block.parameters.get("ELSET"):
            found = [self._nodes_of(members, self._members(members, block, block.parameters["ELSET"], False))]
        else:
            found = self._listed(members, block, nodes)
        sets[block.needs(block.keyword).upper()].extend(found)

    def _add_surface(self, scope: Scope, block: KeywordBlock) -> None:
        name, kind = block.needs("NAME"), block.parameters.get("TYPE", "ELEMENT").upper()
        rows = [[part.strip() for part in line.split(",")] for line in block.data]
        if kind == "NODE":
            scope.node_sets.setdefault(name.upper(), []).extend(
                self._members(scope, block, row[0], True) for row in rows
            )
            return
        if kind != "ELEMENT" or "COMBINE" in block.parameters:
            scope.notes.append(f"surface {name}: only surfaces of element faces or nodes are read")
            return
        found = scope.sides.setdefault(name.upper(), [])
        for row in rows:
            labels, side = self._members(scope, block, row[0], False), row[1].upper() if len(row) > 1 else ""
            digit = side.removeprefix("S")
            if (not side and np.isin(labels, self._plane(scope)).all()) or side in ("SPOS", "SNEG"):
                scope.element_sets.setdefault(name.upper(), []).append(labels)
            elif not side:
                found.append(self._free_sides(scope, labels))
            elif digit in ("1", "2", "3", "4", "5", "6"):
                found.append(np.column_stack([labels, np.full(len(labels), int(digit) - 1)]))
            else:
                scope.notes.append(f"surface {name}: side {side} is of no solid element")
        if found:
            self._check_sides(np.concatenate(found), block)

    def _add_temperatures(self, scope: Scope, block: KeywordBlock) -> None:
        """Temperatures of nodes or sets: initial ones, and those of a step, which are later."""
        if block.keyword == HEAT[0] and block.parameters.get("TYPE", "").upper() != "TEMPERATURE":
            return
        if "FILE" in block.parameters:
            scope.notes.append(f"*{block.keyword} of a file of results left out")
        for line in block.data:
            fields = line.split(",")
            if len(fields) > 1 and fields[1].strip():
                values = numbers(fields[1:2], lambda field: block.refuse(f"{field.strip()!r}: must be a number"))
                labels = self._members(scope, block, fields[0], True)
                scope.temperatures.update(dict.fromkeys(labels.tolist(), float(values[0])))

    def _add_held(self, scope: Scope, block: KeywordBlock) -> None:
        """Nodes that *BOUNDARY holds at zero, by direction."""
        if block.parameters.get("TYPE", "DISPLACEMENT").upper() != "DISPLACEMENT":
            return
        for line in block.data:
            fields = [*(part.strip().upper() for part in line.split(",")), "", "", ""]
            first, last = ("1", "3") if fields[1] in _HELD else (fields[1], fields[2] or fields[1])
            moved = fields[3].strip("0.-+") not in ("", "E", "D")
            if not (first.isdecimal() and last.isdecimal()) or moved:
                continue
            labels = self._members(scope, block, fields[0], True)
            for direction in range(int(first), min(int(last), 3) + 1):
                scope.held.setdefault(direction, []).append(labels)

    def _instance(self, scope: Scope, block: KeywordBlock) -> Scope:
        name = block.parameters.get("INSTANCE", "")
        if name and name.upper() not in self._scopes:
            raise block.refuse(f"INSTANCE={name} is not defined")
        return self._scopes[name.upper()] if name else scope

    def _generated(self, scope: Scope, block: KeywordBlock, line: str, nodes: bool) -> IntArray:
        fields = [part for part in line.split(",") if part.strip()]
        values = labels_of(fields, lambda field: block.refuse(f"{field.strip()!r}: must be a positive integer"))
        if len(values) not in (2, 3) or (len(values) == 3 and values[2] == 0):
            raise block.refuse(f"{line.strip()!r}: must be first, last and step")
        step = int(values[2]) if len(values) == 3 else 1
        first, last = int(values[0]) + scope.offset, int(values[1]) + scope.offset
        known = self._known(scope, nodes)
        known = known[np.searchsorted(known, first) : np.searchsorted(known, last, side="right")]
        return known[(known - first) % step == 0]

    def _known(self, scope: Scope, nodes: bool) -> IntArray:
        """Sorted labels of all nodes or elements of a scope."""
        key = (scope.name, nodes)
        if key not in self._labels:
            arrays = scope.node_labels if nodes else [e.labels for e in (*scope.elements, *scope.plane)]
            self._labels[key] = np.unique(np.concatenate([NO_LABELS, *arrays]))
        return self._labels[key]

    def _listed(self, scope: Scope, block: KeywordBlock, nodes: bool) -> list[IntArray]:
        fields = [part for part in ",".join(block.data).replace(" ", "").replace("\t", "").split(",") if part]
        try:
            return [labels_of(fields, ValueError) + scope.offset]
        except ValueError:
            names = [part.strip().strip('"') for part in ",".join(block.data).split(",")]
            return [self._members(scope, block, part, nodes) for part in names if part]

    def _members(self, scope: Scope, block: KeywordBlock, token: str, nodes: bool) -> IntArray:
        """Labels that a label or the name of a set stands for."""
        token = token.strip().strip('"')
        if token.isdecimal():
            return labels_of([token], block.refuse) + scope.offset
        for owner, name in ((scope, token), *self._elsewhere(token)):
            sets = owner.node_sets if nodes else owner.element_sets
            key = (owner.name, nodes, name.upper())
            if key in self._open:
                raise block.refuse(f"set {name} is defined by itself")
            if key in self._waiting:
                self._settle(owner, key)
            if name.upper() in sets:
                return np.concatenate([NO_LABELS, *sets[name.upper()]])
            if owner is not scope and name.isdecimal():
                return labels_of([name], block.refuse) + owner.offset
        what = "node set" if nodes else "element set"
        raise block.refuse(f"{token!r} is no {what} of the file: name one, or give labels")

    def _elsewhere(self, token: str) -> list[tuple[Scope, str]]:
        places = [k for k, letter in enumerate(token) if letter == "."]
        found = [
            (self._scopes[token[:k].upper()], token[k + 1 :]) for k in places if token[:k].upper() in self._scopes
        ]
        return [*found, (self._scopes[""], token)]

    def _nodes_of(self, scope: Scope, labels: IntArray) -> IntArray:
        found = [
            elements.nodes[np.isin(elements.labels, labels)].ravel()
            for other in self._all(scope)
            for elements in (*other.elements, *other.plane)
        ]
        nodes = np.unique(np.concatenate([NO_LABELS, *found]))
        return nodes[nodes > 0]

    def _plane(self, scope: Scope) -> IntArray:
        return np.concatenate([NO_LABELS, *(e.labels for other in self._all(scope) for e in other.plane)])

    def _free_sides(self, scope: Scope, labels: IntArray) -> IntArray:
        everything = [elements for other in self._all(scope) for elements in other.elements]
        blocks = [(elements.nodes, ELEMENT_KINDS[elements.kind].sides) for elements in everything]
        sides = free_sides(blocks) if blocks else []
        found = [
            np.column_stack([elements.labels[side[:, 0]], side[:, 1]])
            for elements, side in zip(everything, sides, strict=True)
        ]
        table = np.concatenate([np.empty((0, 2), dtype=np.int64), *found])
        return table[np.isin(table[:, 0], labels)]

    def _check_sides(self, table: IntArray, block: KeywordBlock) -> None:
        """No side (element, place) of a surface beyond those that its element has."""
        for scope in self._scopes.values():
            for elements in scope.elements:
                count = len(ELEMENT_KINDS[elements.kind].sides)
                beyond = table[table[:, 1] >= count]
                wrong = beyond[np.isin(beyond[:, 0], elements.labels)]
                if len(wrong):
                    label, side = wrong[0, 0] - scope.offset, wrong[0, 1] + 1
                    raise block.refuse(f"S{side} of element {label} ({elements.kind}): must be S1 to S{count}")

    def _all(self, scope: Scope) -> list[Scope]:
        others = [other for other in self._scopes.values() if other is not scope]
        return [scope, *others]

"""Ansys archives (.cdb, as CDWRITE writes them) and decks of Workbench with the same tables.

Nodes of SOLID185 and SOLID186 go round as here; their prism and tetrahedral forms repeat nodes. A component of nodes
is a node set, one of elements an element set; the name of a material is its number.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from geometry.mesh_files.ansys_tables import AnsysTables, read_tables
from geometry.mesh_files.file_mesh import NO_LABELS, FileElements, FileMesh
from geometry.mesh_files.text_files import numbers, text_lines
from geometry.sector import IntArray

KINDS = {185: "hex8", 45: "hex8", 186: "hex20", 95: "hex20", 187: "tet10", 92: "tet10", 285: "tet4"}
COUNTS = {"hex8": 8, "hex20": 20, "tet10": 10, "tet4": 4}
PROPERTIES = {
    "EX": "young_modulus",
    "NUXY": "poisson_ratio",
    "PRXY": "poisson_ratio",
    "DENS": "density",
    "ALPX": "expansion",
}
ORTHOTROPIC = {"EY": "EX", "EZ": "EX", "ALPY": "ALPX", "ALPZ": "ALPX"}
MATERIAL, TYPE, NUMBER, NODES = 0, 1, 10, 11  # columns of an element
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


def read_ansys(path: str | Path) -> FileMesh:
    """Nodes, elements, components and materials of an archive.

    Parameters
    ----------
    path : str or path
        The file.

    Raises
    ------
    MeshFileError
        The file cannot be used.
    """
    lines = text_lines(path)
    tables = read_tables(path, lines)
    mesh = FileMesh(str(path), np.concatenate(tables.node_labels), np.concatenate(tables.points))
    _add_elements(mesh, [np.array(row, dtype=np.int64) for row in tables.elements], tables.types)
    labels = {"NODE": np.unique(mesh.node_labels), "ELEM": np.unique([row[NUMBER] for row in tables.elements])}
    for name, (kind, values) in tables.components.items():
        sets = mesh.node_sets if kind == "NODE" else mesh.element_sets
        sets[name] = _members(mesh, name, values, labels[kind])
    _leave_out(mesh, tables)
    mesh.materials = _materials(mesh, lines)
    return mesh


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
        if tables.types.get(row[TYPE], 0) not in KINDS:
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


def _add_elements(mesh: FileMesh, elements: list[IntArray], types: dict[int, int]) -> None:
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
    labels, material = table[starts + NUMBER], table[starts + MATERIAL]
    mesh.element_material = [(labels[material == value], str(value)) for value in np.unique(material)]


def _materials(mesh: FileMesh, lines: list[str]) -> dict[str, dict[str, float]]:
    """Properties by the number of the material, from MP and MPDATA."""
    given: dict[str, dict[str, float]] = {}
    for line in lines:
        if line[:2].upper() != "MP":
            continue
        fields = [field.strip() for field in line.split("!")[0].split(",")]
        command = fields[0].upper()
        if command == "MPDATA":  # MPDATA, [R5.0, length,] label, material, place of the first value, value
            place = 3 if len(fields) > 1 and fields[1].upper().startswith("R") else 1
            label, material, rest = _padded(fields, place), _padded(fields, place + 1), fields[place + 3 :]
        elif command == "MP":  # MP, label, material, constant, linear, ...
            label, material, rest = _padded(fields, 1), _padded(fields, 2), fields[3:]
        else:
            continue
        first = rest[0] if rest else ""
        found = given.setdefault(material, {})
        if first and label.upper() not in found:
            found[label.upper()] = float(numbers([first], _refusal(mesh, line))[0])
        if any(field and field.strip("0.+-Ee") for field in rest[1:]):
            mesh.notes.append(f"material {material}: {label} depends on temperature: the first value is taken")
    return {material: _isotropic(mesh, material, values) for material, values in given.items()}


def _refusal(mesh: FileMesh, line: str) -> Any:
    return lambda field: mesh.refuse(f"{line.strip()!r}: {field!r} must be a number")


def _padded(fields: list[str], place: int) -> str:
    return fields[place] if place < len(fields) else ""


def _isotropic(mesh: FileMesh, material: str, values: dict[str, float]) -> dict[str, float]:
    for label, first in ORTHOTROPIC.items():
        if values.get(label, values.get(first)) != values.get(first):
            mesh.notes.append(f"material {material} is orthotropic and is left out: only isotropic is read")
            return {}
    return {PROPERTIES[label]: value for label, value in values.items() if label in PROPERTIES}

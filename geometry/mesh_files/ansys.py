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
# properties that an isotropic material has too, and those that they must agree with
ORTHOTROPIC = {
    "EY": "EX", "EZ": "EX", "ALPY": "ALPX", "ALPZ": "ALPX", "GXY": "GXY", "GYZ": "GYZ", "GXZ": "GXZ",
    "PRYZ": "PRXY", "PRXZ": "PRXY", "NUYZ": "NUXY", "NUXZ": "NUXY",
}  # fmt: skip
MISFIT = 1e-3
USUAL_RATIO = 0.3  # of a material without one, in Ansys
OTHER_LAWS = ("ELAS", "ANEL", "HYPE", "BB", "AHYP", "USER", "SMA", "CAST", "GASK")
PLASTIC = ("BISO", "MISO", "BKIN", "KINH", "MKIN", "NLIS", "CHAB", "PLAS", "CREE", "PRON", "SDAM", "HILL")
UNITS = {"SI": "m", "MKS": "m", "MPA": "mm", "CGS": "cm-g-s", "BIN": "in", "BFT": "ft-lbf-s"}
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
    """Nodes, elements, components and materials of an archive."""
    lines = text_lines(path)
    tables = read_tables(path, lines)
    mesh = FileMesh(str(path), np.concatenate(tables.node_labels), np.concatenate(tables.points))
    _add_elements(mesh, [np.array(row, dtype=np.int64) for row in tables.elements], tables.types)
    labels = {"NODE": np.unique(mesh.node_labels), "ELEM": np.unique([row[NUMBER] for row in tables.elements])}
    for name, (kind, values) in tables.components.items():
        sets = mesh.node_sets if kind == "NODE" else mesh.element_sets
        sets[name] = _members(mesh, name, values, labels[kind])
    _leave_out(mesh, tables)
    _add_materials(mesh, lines)
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


def _add_materials(mesh: FileMesh, lines: list[str]) -> None:
    """Properties by the number of the material, from MP and MPDATA, and what the archive says of units."""
    given: dict[str, dict[str, float]] = {}
    for line in lines:
        command = line[:8].upper()
        if command.startswith("MASCALE"):
            raise mesh.refuse(f"{line.strip()!r} scales the matrices: remove it and give the densities that it makes")
        if not command.startswith(("MP", "TB,", "/UNITS")):
            continue
        fields = [field.strip() for field in line.split("!")[0].split(",")]
        command = fields[0].upper()
        if command == "MPDATA":  # MPDATA, [R5.0, length,] label, material, place of the first value, value
            place = 3 if len(fields) > 1 and fields[1].upper().startswith("R") else 1
            label, material, rest = _padded(fields, place), _padded(fields, place + 1), fields[place + 3 :]
            table, again = True, _padded(fields, place + 2) in ("", "1")
        elif command == "MP":  # MP, label, material, constant, linear, ...
            label, material, rest = _padded(fields, 1), _padded(fields, 2), fields[3:]
            table, again = False, True
        elif command == "TB":
            _take_table(mesh, _padded(fields, 1).upper(), _padded(fields, 2))
            continue
        elif command == "/UNITS":
            system = UNITS.get(_padded(fields, 1).upper())
            mesh.units = () if system is None else (system,)
            continue
        else:
            continue
        if label.upper() in (*PROPERTIES, *ORTHOTROPIC):
            found = given.setdefault(material, {})
            if again:
                found.pop(label.upper(), None)
            _take_property(mesh, found, (label.upper(), material), rest, line, table)
    for material, values in given.items():
        mesh.materials[material] = _isotropic(mesh, material, values)


def _take_property(
    mesh: FileMesh, found: dict[str, float], of: tuple[str, str], rest: list[str], line: str, table: bool
) -> None:
    """The first value of a property; values beyond it are those of a table, or the terms of a polynomial."""
    values = [float(value) for value in numbers([field for field in rest if field], _refusal(mesh, line))]
    if not values:
        return
    first = found.setdefault(of[0], values[0])
    if any(value != (first if table else 0.0) for value in values[0 if table else 1 :]):
        mesh.remark(of[1], f"material {of[1]}: {of[0]} depends on temperature: the first value is taken, {first:g}")


def _take_table(mesh: FileMesh, name: str, material: str) -> None:
    """A nonlinear or anisotropic law of a material."""
    if name[:4] in OTHER_LAWS:
        mesh.unread_materials[material] = f"TB,{name}"
    elif name[:4] in PLASTIC:
        mesh.remark(material, f"material {material}: TB,{name} left out: linear elastic")


def _refusal(mesh: FileMesh, line: str) -> Any:
    return lambda field: mesh.refuse(f"{line.strip()!r}: {field!r} must be a number")


def _padded(fields: list[str], place: int) -> str:
    return fields[place] if place < len(fields) else ""


def _isotropic(mesh: FileMesh, material: str, values: dict[str, float]) -> dict[str, float]:
    """The numbers of an isotropic material; one that is not goes to those that are not read."""
    ratio = values.get("PRXY", values.get("NUXY"))
    shear = values["EX"] / (2.0 + 2.0 * (USUAL_RATIO if ratio is None else ratio)) if "EX" in values else None
    expected = values | {"GXY": shear, "GYZ": shear, "GXZ": shear}
    for label, first in ORTHOTROPIC.items():
        value, same = values.get(label), expected.get(first)
        if value is not None and (same is None or abs(value - same) > MISFIT * abs(same)):
            mesh.unread_materials[material] = f"orthotropic ({label})"
            return {}
    found = {PROPERTIES[label]: value for label, value in values.items() if label in PROPERTIES}
    if "young_modulus" in found and ratio is None:
        found["poisson_ratio"] = USUAL_RATIO
        said = f"Ansys takes Poisson's ratio {USUAL_RATIO}, so does this program"
        mesh.remark(material, f"material {material}: neither PRXY nor NUXY in the archive: {said}")
    return found

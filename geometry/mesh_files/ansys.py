"""Ansys archives (.cdb, as CDWRITE writes them), by mapdl-archive; materials are read here.

Nodes of SOLID185 and SOLID186 go round as here; their prism and tetrahedral forms repeat nodes. A component of nodes
is a node set, one of elements an element set; the name of a material is its number.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from geometry.errors import MeshFileError
from geometry.mesh_files.ansys_tables import check_tables
from geometry.mesh_files.file_mesh import FileElements, FileMesh
from geometry.mesh_files.libraries import optional_library
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
MATERIAL, TYPE, NUMBER, NODES = 0, 1, 8, 10  # columns of an element


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
    check_tables(path, lines)
    library = optional_library("mapdl_archive", path)
    try:
        archive = library.Archive(str(path))
        nodes = np.asarray(archive.nnum, dtype=np.int64)
        mesh = FileMesh(str(path), nodes, np.array(archive.nodes, dtype=np.float64)[:, :3])
        elements = [np.asarray(element, dtype=np.int64) for element in archive.elem]
        types = {int(number): int(name) for number, name in archive.ekey}
        mesh.node_sets = _components(archive.node_components)
        mesh.element_sets = _components(archive.element_components)
    except MemoryError:
        raise
    except (Exception, SystemExit) as error:  # whatever the library stumbles over
        raise MeshFileError(path, f"cannot be read: {str(error) or type(error).__name__}") from None
    _add_elements(mesh, elements, types)
    mesh.materials = _materials(mesh, lines)
    return mesh


def _components(components: Any) -> dict[str, IntArray]:
    return {str(name).strip(): np.asarray(labels, dtype=np.int64) for name, labels in components.items()}


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
            mesh.notes.append(f"{len(rows)} elements of type {types.get(int(key), 'unknown')} left out: not solid")
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

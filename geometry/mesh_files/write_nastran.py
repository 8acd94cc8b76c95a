"""Writes Nastran bulk data (.bdf) with large fields for the points."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from geometry.mesh_files.nastran import COLUMNS, FAMILIES
from geometry.mesh_files.written_mesh import WrittenMesh, lines_of

WIDTH = 16
CARDS = {kind: card for card, kinds in FAMILIES.items() for kind in kinds}
NODES, ELEMENTS = 1, 2  # what a set holds, in $HMSET


def nastran_lines(mesh: WrittenMesh) -> Iterator[str]:
    """Lines of the file."""
    sets = [(NODES, name, mesh.node_labels[nodes]) for name, nodes in mesh.node_sets.items()]
    sets += [(ELEMENTS, name, mesh.labels_of(places)) for name, places in mesh.element_sets.items()]
    yield "CEND"
    for number, (kind, name, labels) in enumerate(sets, 1):
        yield f'$HMSET {number:8d} {kind:8d} "{name}"'
        yield f"SET {number} = " + ",\n".join(map(", ".join, lines_of(labels, 8)))
    yield "BEGIN BULK"
    for label, point in zip(mesh.node_labels.tolist(), mesh.points.tolist(), strict=True):
        x, y, z = map(nastran_number, point)
        yield f"{'GRID*':8s}{label:16d}{'':16s}{x:>16s}{y:>16s}*\n{'*':8s}{z:>16s}"
    for index, block in enumerate(mesh.blocks):
        nodes = mesh.nodes_of(index)
        back = np.argsort(COLUMNS.get(block.kind, list(range(nodes.shape[1]))))
        for label, row in zip(mesh.element_labels[index].tolist(), nodes[:, back].tolist(), strict=True):
            fields = [label, index + 1, *row]
            parts = ["".join(f"{x:8d}" for x in fields[k : k + 8]) for k in range(0, len(fields), 8)]
            yield f"{CARDS[block.kind]:8s}" + "\n+       ".join(parts)
    numbers = {name: number for number, name in enumerate(mesh.materials, 1)}
    for index in range(len(mesh.blocks)):
        material = numbers.get(mesh.material_of(index))
        yield f"{'PSOLID':8s}{index + 1:8d}" + (f"{material:8d}" if material else "")
    for name, number in numbers.items():
        yield _mat1(number, mesh.materials[name])
    yield "ENDDATA"


def _mat1(number: int, values: dict[str, float]) -> str:
    fields = [
        nastran_number(values[key]) if key in values else ""
        for key in ("young_modulus", "", "poisson_ratio", "density", "expansion")
    ]
    first = "".join(f"{field:>16s}" for field in fields[:3])
    return f"{'MAT1*':8s}{number:16d}{first}*\n{'*':8s}" + "".join(f"{field:>16s}" for field in fields[3:])


def nastran_number(value: float) -> str:
    """The number in at most 16 characters: a relative error of 1e-10 at most, of 1e-12 from 0.01 to 1000."""
    text = repr(value)
    if len(text) <= WIDTH and "e" not in text:
        return text
    room = WIDTH - (value < 0)
    power = math.floor(math.log10(abs(value)))
    for spare in (0, 1):  # rounding up may take one character more
        if -3 <= power < 0:
            text = f"{value:.{room - 1 - spare}f}".replace("0.", ".", 1)
        elif 0 <= power < room - 2:
            text = f"{value:.{room - 2 - power - spare}f}"
        else:
            digits = room - 2 - len(f"{power:+d}") - spare
            mantissa, _, exponent = f"{value:.{digits}e}".partition("e")
            text = f"{mantissa}{int(exponent):+d}"
        if len(text) <= WIDTH:
            break
    return text

"""Writes a mesh for other programs, by the suffix of the file.

Surfaces are written as node sets too. Ansys prisms and linear tetrahedra are SOLID185 and SOLID186 with repeated
nodes. In a file of gmsh each block is an entity of its own: gmsh loses elements where one has linear and quadratic
elements of a shape.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from geometry.elements import ElementBlock, ElementSides, sides_on
from geometry.errors import MeshFileError
from geometry.imported_mesh import ImportedMesh
from geometry.mesh_files.gmsh import columns_from_gmsh
from geometry.mesh_files.nastran import COLUMNS, FAMILIES
from geometry.mesh_files.vtu import SET
from geometry.sector import FloatArray, IntArray, SectorMesh

MATERIAL = "MATERIAL"  # name of the material of blocks without one
FACES = ("face_right", "face_left")
ABAQUS_WIDTH = 20  # CalculiX reads no more characters of a number
ABAQUS_TYPES = {
    "tet4": "C3D4",
    "tet10": "C3D10",
    "wedge6": "C3D6",
    "wedge15": "C3D15",
    "hex8": "C3D8",
    "hex20": "C3D20",
}
ABAQUS_PER_LINE = 11
ANSYS_TYPES = {"tet4": 185, "wedge6": 185, "hex8": 185, "wedge15": 186, "hex20": 186, "tet10": 187}
# place in the element here of each node in the archive
ANSYS_FORMS = {
    "tet4": [0, 1, 2, 2, 3, 3, 3, 3],
    "wedge6": [0, 1, 2, 2, 3, 4, 5, 5],
    "wedge15": [0, 1, 2, 2, 3, 4, 5, 5, 6, 7, 2, 8, 9, 10, 5, 11, 12, 13, 14, 14],
}
ANSYS_LABELS = {"young_modulus": "EX", "poisson_ratio": "NUXY", "density": "DENS", "expansion": "ALPX"}
GMSH_CODES = {"tet4": 4, "hex8": 5, "wedge6": 6, "tet10": 11, "hex20": 17, "wedge15": 18}
GMSH_FACE_CODES = {("tri", 3): 2, ("quad", 4): 3, ("tri", 6): 9, ("quad", 8): 16}
GMSH_POINT = 15
NASTRAN_WIDTH = 16
NASTRAN_CARDS = {kind: card for card, kinds in FAMILIES.items() for kind in kinds}
NODES, ELEMENTS = 1, 2  # what a set holds, in $HMSET
VTU_CELLS = {
    **{"tet4": "tetra", "tet10": "tetra10", "wedge6": "wedge", "wedge15": "wedge15"},
    **{"hex8": "hexahedron", "hex20": "hexahedron20"},
}
VTU_FACES = {("tri", 3): "triangle", ("tri", 6): "triangle6", ("quad", 4): "quad", ("quad", 8): "quad8"}
GRID = ".vtu"


@dataclass(frozen=True)
class WrittenMesh:
    """What is written."""

    # `points`, `node_labels`: (N, 3), nodes
    points: FloatArray
    node_labels: IntArray
    # `blocks`, `element_labels`: (E,), elements
    blocks: tuple[ElementBlock, ...]
    element_labels: tuple[IntArray, ...]
    node_sets: dict[str, IntArray]  # (k,), rows of the points
    element_sets: dict[str, IntArray]  # (k, 2), block and element
    surfaces: dict[str, ElementSides]  # surfaces
    materials: dict[str, dict[str, float]]  # properties by the name of the material of a block

    def nodes_of(self, block: int) -> IntArray:
        """Labels of the nodes of each element of a block (E, b)."""
        return self.node_labels[self.blocks[block].nodes]

    def material_of(self, block: int) -> str:
        """Name of the material of a block in the file."""
        return self.blocks[block].material or MATERIAL

    def labels_of(self, places: IntArray) -> IntArray:
        """Labels of elements (k,).

        Shapes: `places` (k, 2).
        """
        labels = np.empty(len(places), dtype=np.int64)
        for index, own in enumerate(self.element_labels):
            here = places[:, 0] == index
            labels[here] = own[places[here, 1]]
        return labels

    def faces_of(self, surface: ElementSides) -> Iterator[tuple[str, IntArray]]:
        """Kind ("tri" or "quad") and rows of the nodes (k, c) of the faces of a surface, corners first."""
        for index, block in enumerate(self.blocks):
            for side, corners in enumerate(block.topology.sides):
                elements = surface.element[(surface.block == index) & (surface.side == side)]
                if len(elements):
                    nodes = block.nodes[elements][:, list(block.topology.side_nodes(side))]
                    yield ("tri" if len(corners) == 3 else "quad"), nodes


def written_mesh(mesh: SectorMesh | ImportedMesh, materials: Mapping[str, Mapping[str, float]] | None) -> WrittenMesh:
    """The mesh by labels; a sector gets labels from 1."""
    surfaces = dict(mesh.surfaces)
    if isinstance(mesh, ImportedMesh):
        node_labels, element_labels = mesh.node_labels, mesh.element_labels
        everything = np.concatenate(element_labels)
        if len(np.unique(everything)) < len(everything):
            element_labels = _numbered(mesh.blocks)
        element_sets = dict(mesh.element_sets)
        materials = mesh.materials if materials is None else materials
    else:
        node_labels = np.arange(1, len(mesh.points) + 1)
        element_labels = _numbered(mesh.blocks)
        element_sets = {}
        for name in FACES:
            if name not in surfaces and name in mesh.node_sets:
                surfaces[name] = sides_on(mesh.blocks, mesh.node_sets[name])
    node_sets = {name: nodes for name, nodes in mesh.node_sets.items() if len(nodes)}
    for name, surface in surfaces.items():
        node_sets.setdefault(name, surface.nodes(mesh.blocks))
    named = {name or MATERIAL: dict(values) for name, values in (materials or {}).items()}
    return WrittenMesh(
        mesh.points, node_labels, mesh.blocks, element_labels, node_sets, element_sets, surfaces, named
    )


def _numbered(blocks: tuple[ElementBlock, ...]) -> tuple[IntArray, ...]:
    """Labels from 1, block by block."""
    ends = np.cumsum([len(block) for block in blocks])
    return tuple(np.arange(last - len(block) + 1, last + 1) for block, last in zip(blocks, ends, strict=True))


def lines_of(values: IntArray, count: int) -> Iterator[list[str]]:
    """Numbers as text, some to a line.

    Shapes: `values` (k,).
    """
    text = list(map(str, values.tolist()))
    for start in range(0, len(text), count):
        yield text[start : start + count]


def abaqus_lines(mesh: WrittenMesh) -> Iterator[str]:
    """Lines of the file."""
    yield "*NODE"
    for label, point in zip(mesh.node_labels.tolist(), mesh.points.tolist(), strict=True):
        yield f"{label}, " + ", ".join(map(abaqus_number, point))
    for index, block in enumerate(mesh.blocks):
        yield f"*ELEMENT, TYPE={ABAQUS_TYPES[block.kind]}, ELSET=block_{index + 1}"
        rows = np.column_stack([mesh.element_labels[index], mesh.nodes_of(index)])
        for row in rows.tolist():
            yield ",\n".join(
                ", ".join(map(str, row[k : k + ABAQUS_PER_LINE])) for k in range(0, len(row), ABAQUS_PER_LINE)
            )
    for name, nodes in mesh.node_sets.items():
        yield f"*NSET, NSET={name}"
        yield from map(", ".join, lines_of(mesh.node_labels[nodes], ABAQUS_PER_LINE))
    for name, places in mesh.element_sets.items():
        yield f"*ELSET, ELSET={name}"
        yield from map(", ".join, lines_of(mesh.labels_of(places), ABAQUS_PER_LINE))
    for name, surface in mesh.surfaces.items():
        yield f"*SURFACE, NAME={name}, TYPE=ELEMENT"
        labels = mesh.labels_of(np.column_stack([surface.block, surface.element]))
        for label, side in zip(labels.tolist(), surface.side.tolist(), strict=True):
            yield f"{label}, S{side + 1}"
    yield from _abaqus_materials(mesh)


def abaqus_number(value: float) -> str:
    """The number with as many digits as 20 characters hold: a relative error of 1e-14 at most."""
    text = repr(value)
    digits = 17
    while len(text) > ABAQUS_WIDTH:
        digits -= 1
        text = f"{value:.{digits}g}"
    return text


def _abaqus_materials(mesh: WrittenMesh) -> Iterator[str]:
    for name, values in mesh.materials.items():
        yield f"*MATERIAL, NAME={name}"
        if "young_modulus" in values:
            yield f"*ELASTIC\n{abaqus_number(values['young_modulus'])}, {abaqus_number(values['poisson_ratio'])}"
        if "density" in values:
            yield f"*DENSITY\n{abaqus_number(values['density'])}"
        if "expansion" in values:
            yield f"*EXPANSION\n{abaqus_number(values['expansion'])}"
    for index in range(len(mesh.blocks)):
        if mesh.material_of(index) in mesh.materials:
            yield f"*SOLID SECTION, ELSET=block_{index + 1}, MATERIAL={mesh.material_of(index)}"


def ansys_lines(mesh: WrittenMesh) -> Iterator[str]:
    """Lines of the file."""
    yield "/PREP7"
    types = {
        code: number for number, code in enumerate(sorted({ANSYS_TYPES[block.kind] for block in mesh.blocks}), 1)
    }
    for code, number in types.items():
        yield f"ET,{number:9d},{code}"
    count = len(mesh.points)
    yield f"NBLOCK,6,SOLID,{mesh.node_labels.max():10d},{count:10d}"
    yield "(3i9,6e25.16e3)"
    for label, point in zip(mesh.node_labels.tolist(), mesh.points.tolist(), strict=True):
        yield f"{label:9d}{0:9d}{0:9d}" + "".join(f"{x:25.16E}" for x in point)
    yield "N,R5.3,LOC,       -1,"
    highest = max(int(labels.max()) for labels in mesh.element_labels)
    yield f"EBLOCK,19,SOLID,{highest:10d},{sum(map(len, mesh.blocks)):10d}"
    yield "(19i10)"
    materials = {name: number for number, name in enumerate(mesh.materials, 1)}
    spare = len(materials) + 1
    for index, block in enumerate(mesh.blocks):
        nodes = mesh.nodes_of(index)
        nodes = nodes[:, ANSYS_FORMS.get(block.kind, list(range(nodes.shape[1])))]
        material = materials.get(mesh.material_of(index), spare)
        head = [material, types[ANSYS_TYPES[block.kind]], 1, 1, 0, 0, 0, 0, nodes.shape[1], 0]
        yield from _ansys_rows(head, mesh.element_labels[index], nodes)
    yield f"{-1:10d}"
    for name, nodes in mesh.node_sets.items():
        yield from _ansys_component(name, "NODE", mesh.node_labels[nodes])
    for name, places in mesh.element_sets.items():
        yield from _ansys_component(name, "ELEM", mesh.labels_of(places))
    for name, number in materials.items():
        for key, label in ANSYS_LABELS.items():
            if key in mesh.materials[name]:
                yield f"MPDATA,R5.0, 1,{label:4s},{number:8d}, 1,{mesh.materials[name][key]:.16E},"
    yield "FINISH"


def _ansys_rows(head: list[int], labels: IntArray, nodes: IntArray) -> Iterator[str]:
    start = "".join(f"{x:10d}" for x in head)
    for label, row in zip(labels.tolist(), nodes.tolist(), strict=True):
        text = start + f"{label:10d}" + "".join(f"{x:10d}" for x in row[:8])
        yield text + ("\n" + "".join(f"{x:10d}" for x in row[8:]) if len(row) > 8 else "")


def _ansys_component(name: str, kind: str, labels: IntArray) -> Iterator[str]:
    yield f"CMBLOCK,{name:8s},{kind},{len(labels):10d}"
    yield "(8i10)"
    for row in lines_of(np.sort(labels), 8):
        yield "".join(f"{x:>10s}" for x in row)


def gmsh_lines(mesh: WrittenMesh) -> Iterator[str]:
    """Lines of the file."""
    volumes = {name: tag for tag, name in enumerate(dict.fromkeys(map(mesh.material_of, range(len(mesh.blocks)))), 1)}
    surfaces = {name: tag for tag, name in enumerate(mesh.surfaces, len(volumes) + 1)}
    points = {name: tag for tag, name in enumerate(mesh.node_sets, len(volumes) + len(surfaces) + 1)}
    yield "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames"
    groups = [(0, points), (2, surfaces), (3, volumes)]
    yield str(sum(len(names) for _, names in groups))
    for dimension, names in groups:
        for name, tag in names.items():
            yield f'{dimension} {tag} "{name}"'
    yield f"$EndPhysicalNames\n$Nodes\n{len(mesh.points)}"
    for label, point in zip(mesh.node_labels.tolist(), mesh.points.tolist(), strict=True):
        yield f"{label} " + " ".join(map(repr, point))
    rows = list(_gmsh_elements(mesh, volumes, surfaces, points))
    yield f"$EndNodes\n$Elements\n{len(rows)}"
    yield from rows
    yield "$EndElements"


def _gmsh_elements(
    mesh: WrittenMesh, volumes: dict[str, int], surfaces: dict[str, int], points: dict[str, int]
) -> Iterator[str]:
    for index, block in enumerate(mesh.blocks):
        tag = volumes[mesh.material_of(index)]
        columns = np.argsort(columns_from_gmsh(block.kind))
        for label, row in zip(
            mesh.element_labels[index].tolist(), mesh.nodes_of(index)[:, columns].tolist(), strict=True
        ):
            yield f"{label} {GMSH_CODES[block.kind]} 2 {tag} {index + 1} " + " ".join(map(str, row))
    label = max(int(labels.max()) for labels in mesh.element_labels)
    entity = 0
    for name, surface in mesh.surfaces.items():
        for kind, faces in mesh.faces_of(surface):
            entity += 1
            code = GMSH_FACE_CODES[kind, faces.shape[1]]
            for row in mesh.node_labels[faces].tolist():
                label += 1
                yield f"{label} {code} 2 {surfaces[name]} {entity} " + " ".join(map(str, row))
    for name, nodes in mesh.node_sets.items():
        for node in mesh.node_labels[nodes].tolist():
            label += 1
            yield f"{label} {GMSH_POINT} 2 {points[name]} {points[name]} {node}"


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
            yield f"{NASTRAN_CARDS[block.kind]:8s}" + "\n+       ".join(parts)
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
    if len(text) <= NASTRAN_WIDTH and "e" not in text:
        return text
    room = NASTRAN_WIDTH - (value < 0)
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
        if len(text) <= NASTRAN_WIDTH:
            break
    return text


def write_vtu(path: str | Path, mesh: WrittenMesh) -> None:
    """Write the file."""
    # meshlane, or else meshio, which has no 15-node wedges
    library = import_module("meshlane" if find_spec("meshlane") is not None else "meshio")
    fields = {}
    for name, nodes in mesh.node_sets.items():
        fields[SET + name] = np.zeros(len(mesh.points))
        fields[SET + name][nodes] = 1 + np.arange(len(nodes))
    cells = [(VTU_CELLS[block.kind], block.nodes) for block in mesh.blocks]
    marks: dict[str, dict[int, np.ndarray]] = {}
    for name, places in mesh.element_sets.items():
        for index, block in enumerate(mesh.blocks):
            inside = np.zeros(len(block))
            inside[places[places[:, 0] == index, 1]] = 1
            marks.setdefault(SET + name, {})[index] = inside
    for name, surface in mesh.surfaces.items():
        for kind, faces in mesh.faces_of(surface):
            marks.setdefault(SET + name, {})[len(cells)] = np.ones(len(faces))
            cells.append((VTU_FACES[kind, faces.shape[1]], faces))
    cell_fields = {
        name: [own.get(index, np.zeros(len(nodes))) for index, (_, nodes) in enumerate(cells)]
        for name, own in marks.items()
    }
    library.vtu.write(str(path), library.Mesh(mesh.points, cells, fields, cell_fields))


LINES: dict[str, Callable[[WrittenMesh], Iterator[str]]] = {
    ".inp": abaqus_lines,
    ".bdf": nastran_lines,
    ".cdb": ansys_lines,
    ".msh": gmsh_lines,
}


def write_mesh(
    path: str | Path,
    mesh: SectorMesh | ImportedMesh,
    materials: Mapping[str, Mapping[str, float]] | None = None,
) -> None:
    """Write a mesh with its node sets, surfaces and materials for another program; `read_mesh` reads it back.

    Nastran and Ansys have no surfaces: the nodes of each surface are written as a set. Points are exact in .msh,
    .vtu and .cdb. Relative errors: in .inp (20 characters) 1e-14; in .bdf (16 characters) 1e-12 from 0.01 to 1000 and
    1e-10 elsewhere.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (*LINES, GRID):
        raise MeshFileError(path, f"the suffix must be one of {', '.join((*LINES, GRID))}")
    written = written_mesh(mesh, materials)
    try:
        if suffix == GRID:
            write_vtu(path, written)
            return
        with open(path, "w", encoding="ascii", errors="replace") as file:
            file.writelines(line + "\n" for line in LINES[suffix](written))
    except OSError as error:
        raise MeshFileError(path, f"cannot be written: {error.strerror}") from None

"""What a mesh file says, by the labels of the file, before nodes and elements are looked up.

The cells of VTK and MED are taken as elements and faces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from geometry.elements import ELEMENT_KINDS
from geometry.errors import MeshFileError
from geometry.sector import FloatArray, IntArray

MOST_SETS = 20_000
ONLY = "left out, only isotropic is read"
NO_LABELS = np.empty(0, dtype=np.int64)
# what is lost with the definitions of a file that are left out; those of `NO_EFFECT` change no result of the scene
EFFECTS = {
    "ties": "nodes that they tie move freely here: the structure is softer than that of the file",
    "springs": "their stiffness is missing here",
    "masses": "their mass is missing here: frequencies come out too high",
    "bodies": "no solid elements that are read: their stiffness and mass are missing here",
    "moves": "nodes stand where the file puts them first",
    "supports": "supports of the file: the scene says what is held",
    "cyclic": "cyclic symmetry of the file: the scene names its cut faces",
    "contacts": "contact of the file: the scene says what touches, and bonded parts are apart here",
    "surfaces": "no solid elements: without stiffness and mass",
    "unknown": "not known to the reader",
}
NO_EFFECT = ("supports", "cyclic", "contacts", "surfaces", "unknown")
KINDS = {
    **{kind.meshio_name: name for name, kind in ELEMENT_KINDS.items()},
    **{"wedge18": "wedge15", "hexahedron24": "hex20", "hexahedron27": "hex20"},  # without their inner nodes
}
FACE_CORNERS = {"triangle": 3, "triangle6": 3, "triangle7": 3, "quad": 4, "quad8": 4, "quad9": 4}


@dataclass(frozen=True)
class FileElements:
    """Elements of one kind as a file lists them."""

    kind: str  # name in `ELEMENT_KINDS`; the elements may still be collapsed
    labels: IntArray  # (E,), labels of the elements
    nodes: IntArray  # (E, b), labels of the nodes in the node order of VTK; 0 for a node that is not given


@dataclass
class FileMesh:
    """Nodes, elements, sets and materials by label."""

    path: str  # the file
    # `node_labels`, `points`: (N,), nodes
    node_labels: IntArray = field(default_factory=lambda: NO_LABELS)
    points: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    elements: list[FileElements] = field(default_factory=list)  # solid elements
    # plane elements: type in the file, labels, and labels of the corners (k, 4) in turn, of a triangle the last twice
    plane: list[FileElements] = field(default_factory=list)
    sections: list[IntArray] = field(default_factory=list)  # labels of plane elements with a thickness
    # `node_sets`, `element_sets`: (k,), labels
    node_sets: dict[str, IntArray] = field(default_factory=dict)
    element_sets: dict[str, IntArray] = field(default_factory=dict)
    sides: dict[str, IntArray] = field(default_factory=dict)  # (k, 2), surfaces: label of the element and local side
    # (k, c), surfaces: labels of the corners of each face
    faces: dict[str, list[IntArray]] = field(default_factory=dict)
    materials: dict[str, dict[str, Any]] = field(default_factory=dict)  # properties
    # (k,), labels of elements and the name of their material; the last one counts
    element_material: list[tuple[IntArray, str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)  # what was left out
    warnings: list[str] = field(default_factory=list)  # what was left out and changes results
    # what the numbers of a material leave out, defaults that were taken
    material_notes: dict[str, list[str]] = field(default_factory=dict)
    # materials that are not isotropic and elastic, and what they are
    unread_materials: dict[str, str] = field(default_factory=dict)
    temperatures: dict[int, float] = field(default_factory=dict)  # of nodes by their labels
    root: str = ""  # name of the set that the file holds
    contacts: list[tuple[str, str]] = field(default_factory=list)  # pairs of sets that touch in the file
    units: tuple[str, ...] = ()  # systems of `UNIT_SYSTEMS` that the file says it is in

    def remark(self, material: str, line: str) -> None:
        """Note something about a material once."""
        lines = self.material_notes.setdefault(material, [])
        if line not in lines:
            lines.append(line)

    def refuse(self, found: str) -> MeshFileError:
        """An error that names the file."""
        return MeshFileError(self.path, found)

    def add_plane(self, kind: str, labels: IntArray, nodes: IntArray) -> None:
        """Take plane elements (k, m), the corners first and 0 for none; those of kind "" are not spoken of."""
        three = nodes.shape[1] in (3, 6, 7)
        corners = nodes[:, [0, 1, 2, 2]] if three else nodes[:, :4]
        corners = np.where(corners == 0, corners[:, [2]], corners)
        self.plane.append(FileElements(kind, labels, corners))

    def name_held(self, labels: IntArray, made: str) -> None:
        """Remember the nodes that the file holds in all directions: by a set of the file, or by one that is made."""
        held = np.intersect1d(labels, self.node_labels)
        if len(held) < 3:
            return
        same = (name for name, nodes in self.node_sets.items() if np.array_equal(np.unique(nodes), held))
        self.root = next(same, made)
        self.node_sets.setdefault(self.root, held)

    def leave_out(self, effect: str, counts: Mapping[str, int]) -> None:
        """Say which definitions of the file are left out, how many, and what that does."""
        if counts:
            names = listed([f"{count} {name}" for name, count in counts.items()], 8)
            lines = self.notes if effect in NO_EFFECT else self.warnings
            lines.append(f"{names} left out: {EFFECTS[effect]}")


def listed(names: Sequence[object], most: int = 5) -> str:
    """Names or labels in a message: the first few, and how many more."""
    shown = ", ".join(str(name) for name in names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"


def counted(number: int, noun: str) -> str:
    """A number with its noun: "1 node", "2 nodes"."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


@dataclass(frozen=True)
class CellBlock:
    """Cells of one kind."""

    type: str  # name of the cell, as meshio has it
    data: IntArray  # (k, n), points of each cell, from 0, in the order of VTK
    labels: IntArray  # (k,), numbers of the cells in the file


def mesh_of_cells(path: object, points: FloatArray, cells: list[CellBlock]) -> FileMesh:
    """A mesh of points and blocks of cells; labels are places in the file, from 1.

    Shapes: `points` (N, 3).
    """
    mesh = FileMesh(str(path))
    mesh.points = np.ascontiguousarray(points, dtype=np.float64)
    mesh.node_labels = np.arange(1, len(points) + 1)
    for block in cells:
        if block.type.startswith("pyramid"):
            raise mesh.refuse(f"cell {block.labels[0]} is a pyramid: only tetrahedra, wedges and hexahedra are read")
        if block.type in KINDS:
            kind = KINDS[block.type]
            nodes = block.data + 1
            if (nodes < 1).any():
                raise mesh.refuse(f"{block.type} cells name point {nodes.min() - 1}: points are counted from 0")
            if nodes.shape[1] > ELEMENT_KINDS[kind].n_nodes:
                mesh.notes.append(f"{block.type} cells are taken as {kind}: their inner nodes are left out")
                nodes = nodes[:, : ELEMENT_KINDS[kind].n_nodes]
            mesh.elements.append(FileElements(kind, block.labels, nodes))
        elif block.type not in FACE_CORNERS and block.type not in ("vertex", "line", "line3"):
            mesh.leave_out("bodies", {f"cells {block.type}": len(block.data)})
    return mesh


def add_cells_to_set(mesh: FileMesh, name: str, block: CellBlock, inside: IntArray) -> None:
    """Put cells of a block into a set: solids into an element set, faces into a surface, all others into a node set.

    Shapes: `inside` (k,).
    """
    rows = np.asarray(inside, dtype=np.int64)
    if not len(rows):
        return
    if block.type in KINDS:
        before = mesh.element_sets.get(name, np.empty(0, dtype=np.int64))
        mesh.element_sets[name] = np.concatenate([before, block.labels[rows]])
        return
    nodes = block.data[rows] + 1
    if block.type in FACE_CORNERS:
        mesh.faces.setdefault(name, []).append(nodes[:, : FACE_CORNERS[block.type]])
    before = mesh.node_sets.get(name, np.empty(0, dtype=np.int64))
    everything = np.concatenate([before, nodes.ravel()])
    mesh.node_sets[name] = everything[np.sort(np.unique(everything, return_index=True)[1])]

"""What a mesh file says, by the labels of the file, before nodes and elements are looked up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

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
    node_labels: IntArray = field(default_factory=lambda: NO_LABELS)  # (N,), nodes
    points: FloatArray = field(default_factory=lambda: np.empty((0, 3)))  # (N,), nodes
    elements: list[FileElements] = field(default_factory=list)  # solid elements
    node_sets: dict[str, IntArray] = field(default_factory=dict)  # (k,), labels
    element_sets: dict[str, IntArray] = field(default_factory=dict)  # (k,), labels
    sides: dict[str, IntArray] = field(default_factory=dict)  # (k, 2), surfaces: label of the element and local side
    # (k, c), surfaces: labels of the corners of each face
    faces: dict[str, list[IntArray]] = field(default_factory=dict)
    materials: dict[str, dict[str, float]] = field(default_factory=dict)  # properties
    # (k,), labels of elements and the name of their material; the last one counts
    element_material: list[tuple[IntArray, str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)  # what was left out
    warnings: list[str] = field(default_factory=list)  # what was left out and changes results
    # what the numbers of a material leave out, defaults that were taken
    material_notes: dict[str, list[str]] = field(default_factory=dict)
    # materials that are not isotropic and elastic, and what they are
    unread_materials: dict[str, str] = field(default_factory=dict)
    units: tuple[str, ...] = ()  # systems of `UNIT_SYSTEMS` that the file says it is in

    def remark(self, material: str, line: str) -> None:
        """Note something about a material once."""
        lines = self.material_notes.setdefault(material, [])
        if line not in lines:
            lines.append(line)

    def refuse(self, found: str) -> MeshFileError:
        """An error that names the file."""
        return MeshFileError(self.path, found)

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

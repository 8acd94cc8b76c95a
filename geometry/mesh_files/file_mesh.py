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
    """Elements of one kind as a file lists them.

    Attributes
    ----------
    kind : str
        Name in `ELEMENT_KINDS`; the elements may still be collapsed.
    labels : (E,) array
        Labels of the elements.
    nodes : (E, b) array
        Labels of the nodes in the node order of VTK; 0 for a node that is not given.
    """

    kind: str
    labels: IntArray
    nodes: IntArray


@dataclass
class FileMesh:
    """Nodes, elements, sets and materials by label.

    Attributes
    ----------
    path : str
        The file.
    node_labels, points : (N,) array, (N, 3) array
        Nodes.
    elements : list of FileElements
        Solid elements.
    node_sets, element_sets : dict of str to (k,) array
        Labels.
    sides : dict of str to (k, 2) array
        Surfaces: label of the element and local side.
    faces : dict of str to list of (k, c) array
        Surfaces: labels of the corners of each face.
    materials : dict of str to dict of str to float
        Properties.
    element_material : list of ((k,) array, str)
        Labels of elements and the name of their material; the last one counts.
    notes : list of str
        What was left out.
    warnings : list of str
        What was left out and changes results.
    material_notes : dict of str to list of str
        What the numbers of a material leave out, defaults that were taken.
    unread_materials : dict of str to str
        Materials that are not isotropic and elastic, and what they are.
    units : tuple of str
        Systems of `UNIT_SYSTEMS` that the file says it is in.
    """

    path: str
    node_labels: IntArray = field(default_factory=lambda: NO_LABELS)
    points: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    elements: list[FileElements] = field(default_factory=list)
    node_sets: dict[str, IntArray] = field(default_factory=dict)
    element_sets: dict[str, IntArray] = field(default_factory=dict)
    sides: dict[str, IntArray] = field(default_factory=dict)
    faces: dict[str, list[IntArray]] = field(default_factory=dict)
    materials: dict[str, dict[str, float]] = field(default_factory=dict)
    element_material: list[tuple[IntArray, str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    material_notes: dict[str, list[str]] = field(default_factory=dict)
    unread_materials: dict[str, str] = field(default_factory=dict)
    units: tuple[str, ...] = ()

    def remark(self, material: str, line: str) -> None:
        """Note something about a material once."""
        lines = self.material_notes.setdefault(material, [])
        if line not in lines:
            lines.append(line)

    def refuse(self, found: str) -> MeshFileError:
        """An error that names the file.

        Parameters
        ----------
        found : str
            What is wrong and what is allowed.
        """
        return MeshFileError(self.path, found)

    def leave_out(self, effect: str, counts: Mapping[str, int]) -> None:
        """Say which definitions of the file are left out, how many, and what that does.

        Parameters
        ----------
        effect : str
            Key of `EFFECTS`.
        counts : mapping of str to int
            How many of each name.
        """
        if counts:
            names = listed([f"{count} {name}" for name, count in counts.items()], 8)
            lines = self.notes if effect in NO_EFFECT else self.warnings
            lines.append(f"{names} left out: {EFFECTS[effect]}")


def listed(names: Sequence[object], most: int = 5) -> str:
    """Names or labels in a message: the first few, and how many more.

    Parameters
    ----------
    names : sequence
        The names.
    most : int, optional
        How many are written.
    """
    shown = ", ".join(str(name) for name in names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"


def counted(number: int, noun: str) -> str:
    """A number with its noun: "1 node", "2 nodes".

    Parameters
    ----------
    number : int
        How many.
    noun : str
        In the singular.
    """
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"

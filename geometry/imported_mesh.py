"""A mesh as a file of another program holds it, before it is taken for a sector."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from geometry.elements import ElementBlock, ElementSides
from geometry.sector import FloatArray, IntArray


@dataclass(frozen=True)
class ImportedMesh:
    """Points, elements, sets and materials of a mesh file, in the units and axes of the file.

    Attributes
    ----------
    path : str
        The file.
    points : (N, 3) array
        Nodes.
    node_labels : (N,) array
        Numbers of the nodes in the file.
    blocks : tuple of ElementBlock
        Solid elements; the material of a block is a name in `materials`, or "".
    element_labels : tuple of (E,) array
        Numbers of the elements in the file, block by block.
    node_sets : mapping of str to (k,) array
        Rows of `points`.
    element_sets : mapping of str to (k, 2) array
        Block and element.
    surfaces : mapping of str to ElementSides
        Surfaces given by sides of elements.
    materials : mapping of str to mapping
        What the file says by the keys of `[material]` in a scene, in the file's units and axes.
    notes : tuple of str
        What the reader left out or found suspicious, one line each.
    warnings : tuple of str
        What it left out that changes results, one line each.
    material_notes : mapping of str to tuple of str
        By material: what its numbers leave out, and defaults of the program that were taken.
    unread_materials : mapping of str to str
        Materials that are not linear elastic and isotropic or orthotropic, and what they are.
    units : tuple of str
        Systems of `UNIT_SYSTEMS` that the file says it is in; empty where it says none.
    root : str
        Node set that the file holds in all directions; empty where it holds none.
    contacts : tuple of (str, str)
        Pairs of surfaces or node sets that are in contact in the file.
    temperature : (N,) array or None
        Temperatures of the nodes, NaN where the file gives none; None where it gives none at all.

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import ElementBlock, ImportedMesh
    >>> points, labels = np.eye(4, 3), np.arange(1, 5)
    >>> tetrahedron = ElementBlock("tet4", np.array([[0, 1, 2, 3]]))
    >>> mesh = ImportedMesh("tet.inp", points, labels, (tetrahedron,), (labels[:1],))
    >>> mesh.n_elements, mesh.node_sets
    (1, {})
    """

    path: str
    points: FloatArray
    node_labels: IntArray
    blocks: tuple[ElementBlock, ...]
    element_labels: tuple[IntArray, ...]
    node_sets: Mapping[str, IntArray] = field(default_factory=dict)
    element_sets: Mapping[str, IntArray] = field(default_factory=dict)
    surfaces: Mapping[str, ElementSides] = field(default_factory=dict)
    materials: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    material_notes: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    unread_materials: Mapping[str, str] = field(default_factory=dict)
    units: tuple[str, ...] = ()
    root: str = ""
    contacts: tuple[tuple[str, str], ...] = ()
    temperature: FloatArray | None = None

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return sum(len(block) for block in self.blocks)

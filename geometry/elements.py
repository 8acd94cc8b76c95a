"""Finite elements by name: their nodes, corners, edges and sides, all in the node order of VTK.

That order is also the one of Abaqus and CalculiX for the elements here. A wedge has a positive Jacobian where its
fourth to sixth corner lie on the side that the right-hand rule gives for the first three.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

IntArray = NDArray[np.int64]
Sides = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class ElementKind:
    """Topology of an element."""

    name: str  # "tet4", "tet10", "wedge6", "wedge15", "hex8" or "hex20"
    meshio_name: str  # name of the cell in meshio
    cell_type: int  # number of the cell type in VTK
    corners: int  # number of corners; they are the first nodes
    # the two corners of each edge; the mid-side nodes follow the corners in this order
    edges: tuple[tuple[int, int], ...]
    sides: Sides  # corners of each side, anticlockwise seen from outside
    quadratic: bool  # whether the element has mid-side nodes

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return self.corners + (len(self.edges) if self.quadratic else 0)

    def side_nodes(self, side: int) -> tuple[int, ...]:
        """Local nodes of a side: its corners, then the mid-side nodes between each corner and the next."""
        corners = self.sides[side]
        if not self.quadratic:
            return corners
        place = {frozenset(edge): self.corners + k for k, edge in enumerate(self.edges)}
        pairs = zip(corners, corners[1:] + corners[:1], strict=True)
        return corners + tuple(place[frozenset(pair)] for pair in pairs)


_TET_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
_TET_SIDES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))
_WEDGE_EDGES = ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5))
_WEDGE_SIDES = ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))
_HEX_EDGES = (
    *((0, 1), (1, 2), (2, 3), (3, 0)),
    *((4, 5), (5, 6), (6, 7), (7, 4)),
    *((0, 4), (1, 5), (2, 6), (3, 7)),
)
_HEX_SIDES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))

ELEMENT_KINDS: Mapping[str, ElementKind] = MappingProxyType(
    {
        kind.name: kind
        for kind in (
            ElementKind("tet4", "tetra", 10, 4, _TET_EDGES, _TET_SIDES, False),
            ElementKind("tet10", "tetra10", 24, 4, _TET_EDGES, _TET_SIDES, True),
            ElementKind("wedge6", "wedge", 13, 6, _WEDGE_EDGES, _WEDGE_SIDES, False),
            ElementKind("wedge15", "wedge15", 26, 6, _WEDGE_EDGES, _WEDGE_SIDES, True),
            ElementKind("hex8", "hexahedron", 12, 8, _HEX_EDGES, _HEX_SIDES, False),
            ElementKind("hex20", "hexahedron20", 25, 8, _HEX_EDGES, _HEX_SIDES, True),
        )
    }
)


@dataclass(frozen=True)
class ElementBlock:
    """Elements of one kind and one material.

    Attributes
    ----------
    kind : str
        Name in `ELEMENT_KINDS`.
    nodes : (E, b) array
        Rows of the points of each element, in the node order of VTK.
    material : str
        Name of the material; "" for that of the scene.

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import ElementBlock
    >>> block = ElementBlock("tet4", np.array([[0, 1, 2, 3]]))
    >>> len(block), block.topology.n_nodes
    (1, 4)
    """

    kind: str
    nodes: IntArray
    material: str = ""

    def __len__(self) -> int:
        return len(self.nodes)

    @property
    def topology(self) -> ElementKind:
        """Its kind."""
        return ELEMENT_KINDS[self.kind]


@dataclass(frozen=True)
class ElementSides:
    """A surface made of sides of elements.

    Attributes
    ----------
    block, element, side : (s,) array
        Block of the mesh, element in that block and local side of `ElementKind.sides`.

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import ElementBlock, ElementSides
    >>> blocks = (ElementBlock("tet4", np.array([[4, 5, 6, 7]])),)
    >>> ElementSides(np.array([0]), np.array([0]), np.array([2])).nodes(blocks).tolist()
    [5, 6, 7]
    """

    block: IntArray
    element: IntArray
    side: IntArray

    def __len__(self) -> int:
        return len(self.block)

    def nodes(self, blocks: tuple[ElementBlock, ...]) -> IntArray:
        """Sorted nodes of the surface, mid-side nodes included.

        Parameters
        ----------
        blocks : tuple of ElementBlock
            The elements that the surface belongs to.
        """
        found = [np.empty(0, dtype=np.int64)]
        for index, block in enumerate(blocks):
            for side in range(len(block.topology.sides)):
                elements = self.element[(self.block == index) & (self.side == side)]
                found.append(block.nodes[elements][:, list(block.topology.side_nodes(side))].ravel())
        return np.unique(np.concatenate(found))


def sides_on(blocks: tuple[ElementBlock, ...], nodes: IntArray) -> ElementSides:
    """The sides all of whose corners are among some nodes (k,), in the order of blocks and elements."""
    parts = [_sides_of_block(block, nodes) for block in blocks]
    owner = np.repeat(np.arange(len(blocks)), [len(part) for part in parts])
    sides = np.concatenate([np.empty((0, 2), dtype=np.int64), *parts])
    return ElementSides(owner.astype(np.int64), sides[:, 0], sides[:, 1])


def _sides_of_block(block: ElementBlock, nodes: IntArray) -> IntArray:
    """Sides (s, 2), element and local side, all of whose corners are among some nodes (k,)."""
    found = []
    for side, corners in enumerate(block.topology.sides):
        elements = np.flatnonzero(np.isin(block.nodes[:, list(corners)], nodes).all(axis=1))
        found.append(np.column_stack([elements, np.full(len(elements), side)]))
    sides = np.concatenate(found).astype(np.int64)
    return sides[np.lexsort((sides[:, 1], sides[:, 0]))]

"""What makes a mesh a poor model: elements that are far too stiff in bending, and hanging mid-side nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rom.finite_elements.discretisation import ElementMesh

_BETTER = {"tet4": "tet10", "wedge6": "wedge15", "hex8": "hex20"}


def element_warnings(mesh: ElementMesh) -> tuple[str, ...]:
    """Warnings about the elements of a mesh, taken as they are.

    Elements with linear shape functions bend far too stiffly. Elements are not connected along an edge where one has
    a mid-side node and the neighbour none, or another.

    Parameters
    ----------
    mesh : SectorMesh or ImportedMesh
        The mesh.

    Returns
    -------
    tuple of str
        One line for each such kind of element, and one for hanging nodes; empty where there is none.

    Examples
    --------
    >>> from geometry import ElementBlock, ImportedMesh
    >>> from rom import element_warnings
    >>> tetrahedron = ElementBlock("tet4", np.array([[0, 1, 2, 3]]))
    >>> mesh = ImportedMesh("tet.inp", np.eye(4, 3), np.arange(1, 5), (tetrahedron,), (np.array([1]),))
    >>> print(*element_warnings(mesh))
    1 tet4 elements bend far too stiffly (linear shape functions): frequencies come out too high, use tet10
    """
    counts = {kind: sum(len(block) for block in mesh.blocks if block.kind == kind) for kind in _BETTER}
    lines = [
        f"{count} {kind} elements bend far too stiffly (linear shape functions): frequencies come out too high, "
        f"use {_BETTER[kind]}"
        for kind, count in counts.items()
        if count
    ]
    hanging = hanging_edges(mesh)
    if hanging:
        lines.append(
            f"{hanging} edges have a mid-side node in one element and none, or another one, in its neighbour: "
            "the elements are not connected there"
        )
    return tuple(lines)


def hanging_edges(mesh: ElementMesh) -> int:
    """Number of edges between two corners whose elements do not share one mid-side node, or have none."""
    if not any(block.topology.quadratic for block in mesh.blocks):
        return 0
    keys, middles = [], []
    for block in mesh.blocks:
        topology = block.topology
        ends = np.sort(block.nodes[:, np.array(topology.edges)], axis=-1).reshape(-1, 2)
        keys.append(ends[:, 0] * len(mesh.points) + ends[:, 1])
        middle = block.nodes[:, topology.corners :] if topology.quadratic else np.full((len(block), 1), -1)
        middles.append(np.broadcast_to(middle, (len(block), len(topology.edges))).ravel())
    pairs = np.unique(np.column_stack([np.concatenate(keys), np.concatenate(middles)]), axis=0)
    return len(pairs) - len(np.unique(pairs[:, 0]))

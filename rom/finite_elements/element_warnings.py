"""Elements that are far too stiff in bending: those with linear shape functions."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rom.finite_elements.discretisation import ElementMesh

_BETTER = {"tet4": "tet10", "wedge6": "wedge15", "hex8": "hex20"}


def element_warnings(mesh: ElementMesh) -> tuple[str, ...]:
    """Warnings about elements of a mesh, taken as they are, that bend far too stiffly.

    Parameters
    ----------
    mesh : SectorMesh or ImportedMesh
        The mesh.

    Returns
    -------
    tuple of str
        One line for each such kind of element; empty where there is none.

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
    return tuple(
        f"{count} {kind} elements bend far too stiffly (linear shape functions): frequencies come out too high, "
        f"use {_BETTER[kind]}"
        for kind, count in counts.items()
        if count
    )

"""The nodes that a model from elsewhere is held, touched and loaded at, in metres and the axes of the ring."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geometry import UNIT_SYSTEMS, SectorMesh
from rom.errors import MatrixFileError
from rom.matrix_files.contact_pairs import ContactPairs, contact_pairs
from rom.matrix_files.matrix_choice import SETS, MatrixChoice
from rom.matrix_files.node_table import NodeTable, read_nodes
from rom.matrix_files.ring_axes import RingAxes, ring_axes

_LISTED = 8


@dataclass(frozen=True)
class SectorNodes:
    """Nodes of a sector without elements."""

    table: NodeTable  # the nodes as the file has them
    axes: RingAxes  # how they were turned and scaled
    sector: SectorMesh  # points and faces, no elements
    pairs: ContactPairs  # what was found about the faces

    @property
    def notes(self) -> tuple[str, ...]:
        """What was found, one line each."""
        pairs, n = self.pairs, len(self.pairs.right.nodes)
        area = float(pairs.right.area.sum())
        return (
            f"contact: {n} pairs of nodes, {pairs.mismatch:.3g} m apart in the face at most, {pairs.gap:.3g} m along "
            f"the normal; normals from {pairs.normals}; areas from {pairs.areas}, {area:.4g} m^2 a face",
        )


def sector_nodes(choice: MatrixChoice) -> SectorNodes:
    """Nodes, sets and contact faces of a choice.

    Raises MatrixFileError for a damaged table or a set that is not in it, RomParameterError where faces do not match.
    """
    table = read_nodes(choice.nodes)
    sets = {name: _set(table, choice, name) for name in SETS}
    right, left = sets["contact_right"], sets["contact_left"]
    for name, found in (("contact_right", right), ("contact_left", left)):
        if not len(found):
            raise MatrixFileError(table.path, f"no node is in the set {choice.set_name(name)}", _sets_of(table))
    middle = 0.5 * (table.points[right].mean(axis=0) + table.points[left].mean(axis=0))
    axes = ring_axes(choice.axis, choice.axis_point, choice.unit, middle)
    points, metre = axes.points(table.points), UNIT_SYSTEMS[choice.unit].length
    pairs = contact_pairs(
        points,
        (right, left),
        choice.n_blades,
        None if choice.tolerance is None else choice.tolerance * metre,
        None if table.normals is None else axes.directions(table.normals),
        None if table.area is None else table.area * metre**2,
    )
    sets |= {"contact_right": pairs.right.nodes, "contact_left": pairs.left.nodes}
    sets |= {"face_right": np.sort(right), "face_left": np.sort(left)}
    if not len(sets["tip"]):
        sets["tip"] = _outermost(points)
    if len(sets["tip"]) > 1:
        raise MatrixFileError(table.path, f"{len(sets['tip'])} nodes in the set {choice.set_name('tip')}", "one node")
    named = {name: nodes for name, nodes in table.sets.items() if name not in sets}
    sector = SectorMesh(points, (), {**named, **sets}, pairs.right, pairs.left, choice.n_blades)
    return SectorNodes(table, axes, sector, pairs)


def _set(table: NodeTable, choice: MatrixChoice, name: str) -> NDArray[np.int64]:
    found = table.sets.get(choice.set_name(name))
    if found is None and name in choice.sets:
        raise MatrixFileError(table.path, f"no node is in the set {choice.sets[name]}", _sets_of(table))
    return np.zeros(0, dtype=np.int64) if found is None else found


def _sets_of(table: NodeTable) -> str:
    names = sorted(table.sets)
    return ", ".join(names[:_LISTED]) + ", ..." * (len(names) > _LISTED) if names else "names in the column sets"


def _outermost(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """The node farthest from the engine axis, of several at that radius the one nearest to the plane y = 0."""
    radius = np.hypot(points[:, 1], points[:, 2])
    outer = np.flatnonzero(radius > (1.0 - 1e-6) * radius.max())
    return outer[[np.argmin(np.abs(points[outer, 1]))]]

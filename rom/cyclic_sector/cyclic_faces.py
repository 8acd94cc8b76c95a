"""The two cut faces of a sector: their nodes paired under rotation by one pitch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.errors import RomParameterError
from rom.finite_elements.discretisation import discretise
from rom.finite_elements.full_model import FullModel

if TYPE_CHECKING:
    from geometry.sector import SectorMesh

MATCH = 1e-5  # of the size of a face: largest distance of two nodes that are one
ON_AXIS = 1e-7  # of the largest radius


@dataclass(frozen=True)
class CyclicFaces:
    """Cut faces at which a sector is joined to its neighbours; the right face is at the +y side."""

    # right, left (k,): nodes of the full model, paired: left node i turned by one pitch is right node i
    right: NDArray[np.int64]
    left: NDArray[np.int64]
    axis: NDArray[np.int64]  # (a,) nodes on the engine axis, which belong to both faces
    n_sectors: int  # number of sectors of the ring

    @property
    def turn(self) -> NDArray[np.float64]:
        """Rotation (3, 3) by one pitch about the engine axis, towards +y."""
        return turn_about_axis(2.0 * np.pi / self.n_sectors)

    @property
    def nodes(self) -> NDArray[np.int64]:
        """All nodes of the two faces: left, right, axis."""
        return np.concatenate([self.left, self.right, self.axis])

    def held(self, full: FullModel) -> NDArray[np.bool_]:
        """Dofs (N,) that are clamped; what is clamped on one face is clamped on the other."""
        held = np.zeros(full.n_dofs, dtype=bool)
        held[full.fixed] = True
        by_node = held.reshape(-1, 3)
        either = by_node[self.left] | by_node[self.right]
        by_node[self.left], by_node[self.right] = either, either
        return held


def turn_about_axis(angle: float) -> NDArray[np.float64]:
    """Rotation (3, 3) about x that takes z towards y, by an angle in rad."""
    c, s = float(np.cos(angle)), float(np.sin(angle))
    return np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])


def cyclic_faces(
    full: FullModel, sector: SectorMesh, right: str = "cyclic_right", left: str = "cyclic_left"
) -> CyclicFaces:
    """Pair the nodes of the cut faces of a sector."""
    found = discretise(sector, full.element)
    sets = []
    for name in (right, left):
        nodes = np.asarray(sector.node_sets.get(name, ()), dtype=np.int64)
        if not len(nodes):
            raise RomParameterError("mesh", name, len(nodes), "must be a set of the nodes of a cut face")
        sets.append(found.nodes_on(nodes))
    positions = full.positions
    radius = np.hypot(positions[:, 1], positions[:, 2])
    axis = np.intersect1d(sets[0], sets[1])
    axis = axis[radius[axis] <= ON_AXIS * radius.max()]
    first, second = (np.setdiff1d(nodes, axis) for nodes in sets)
    if len(first) != len(second):
        allowed = f"must have as many nodes as {left}, which has {len(second)}"
        raise RomParameterError("mesh", right, len(first), allowed)
    return CyclicFaces(first, second[_paired(positions, first, second, sector.n_blades)], axis, sector.n_blades)


def _paired(
    positions: NDArray[np.float64], right: NDArray[np.int64], left: NDArray[np.int64], n_sectors: int
) -> NDArray[np.int64]:
    """Place in `left` of the partner of each right node."""
    from scipy.spatial import cKDTree

    back = positions[right] @ turn_about_axis(2.0 * np.pi / n_sectors)  # the transpose turns back
    distance, partner = cKDTree(positions[left]).query(back)
    size = float(np.ptp(positions[left], axis=0).max())
    if distance.max() > MATCH * size or len(np.unique(partner)) < len(partner):
        raise RomParameterError(
            "mesh", "cyclic_right", f"{float(distance.max()):.3g} m", _mismatch(positions, right, left)
        )
    return np.asarray(partner, dtype=np.int64)


def _mismatch(positions: NDArray[np.float64], right: NDArray[np.int64], left: NDArray[np.int64]) -> str:
    """What would match: the mean angle between the faces as a number of sectors."""
    angles = []
    for nodes in (right, left):
        y, z = positions[nodes, 1], positions[nodes, 2]
        angles.append(float(np.angle(np.sum(z + 1j * y))))
    between = (angles[0] - angles[1]) % (2.0 * np.pi)
    fits = 2.0 * np.pi / between if between > 0.0 else np.inf
    return (
        "must be 0: the largest distance between a node and its partner on cyclic_left turned by one pitch; "
        f"the faces are {np.degrees(between):.6g} degrees apart, n_blades = {fits:.6g} would fit"
    )

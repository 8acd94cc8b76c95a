"""Bodies that contacts alone hold: a blade in the slot of a disk, an elastic damper under platforms.

With its contact dofs held such a body is held too, so that it needs nothing of its own in a Craig-Bampton reduction;
its rigid motions are motions of the reduced model without stiffness. Let R be these motions and d = D q the relative
displacement at its contacts inside the sector, with the ground or with bodies nearer to a held one. The rigid motion
of the body relative to what it touches is R F q with F = (D R)^+ D, by least squares. The stiffness is that of the
rest of the motion, q - R F q: K' = (I - R F)^T K (I - R F), K' R = 0.

At rest that changes K by round-off. At a speed it makes stress stiffening and spin softening of the body go with the
motion of what it touches; they feel the deflection of the contacts not: a relative error of a frequency w of
(W / w)^2 times the share of this deflection in the mode.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.finite_elements.full_model import FullModel
from rom.reduction.boundary_dofs import BoundaryDofs
from rom.reduction.contact_dofs import averaged_dofs, nodal_dofs

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry.sector import SectorMesh

Array = NDArray[np.float64]
_HELD = 1e-9  # of the largest relative displacement in a rigid motion: a smaller one does not hold it
Motions = tuple[Array, Array]  # R (b, 6) and F (6, b) of a body


def floating_motions(full: FullModel, boundary: BoundaryDofs) -> tuple[Motions, ...]:
    """R and F of each body that contacts alone hold, those that touch a held body last."""
    joined = () if boundary.interface is None else boundary.interface.nodes
    bodies = [nodes for nodes in full.floating if not np.isin(joined, nodes).any()]  # a free disk is joined
    if not bodies:
        return ()
    owner = np.zeros(len(full.positions), dtype=np.int64)
    for k, nodes in enumerate(bodies):
        owner[nodes] = k + 1
    weights = boundary.contact.weights
    of_dof = owner[weights.indices[weights.indptr[:-1]]]
    right, left = _inside(boundary)
    sides = of_dof[right], np.where(left < 0, 0, of_dof[left])
    away = _distance(*sides, len(bodies))
    rows = np.zeros((len(right), 3, boundary.size))  # D
    for sign, dofs in ((1.0, right), (-1.0, left)):
        nodes = np.flatnonzero(dofs >= 0)
        for i in range(3):
            rows[nodes, i, 3 * dofs[nodes] + i] += sign
    found = []
    for k in np.argsort(-away[1:], kind="stable"):
        motions = _rigid(full, boundary, bodies[k])
        nearer = [(one == k + 1) & (away[other] < away[k + 1]) for one, other in (sides, sides[::-1])]
        relative = rows[nearer[0] | nearer[1]].reshape(-1, boundary.size)
        fit = np.linalg.pinv(relative @ motions, rcond=_HELD) @ relative
        own = np.zeros((6, boundary.size))  # what holds it only together with contacts between neighbours
        own[:, : 3 * len(of_dof)] = np.linalg.pinv(motions[: 3 * len(of_dof)])
        found.append((motions, fit + (np.eye(6) - fit @ motions) @ own))
    return tuple(found)


def _inside(boundary: BoundaryDofs) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Right and left contact dof (k,) of each contact node that touches its own sector, or -1 for the ground."""
    contact, right, left = boundary.contact, [], []
    first, at = 0, contact.count
    for name, count in contact.interfaces.items():
        kind, own = contact.kinds[name], np.arange(count)
        if kind != "neighbours":
            right.append(first + own)
            left.append(at + own if kind == "inside" else np.full(count, -1))
        first, at = first + count, at + (0 if kind == "ground" else count)
    none = [np.zeros(0, dtype=np.int64)]
    return np.concatenate(none + right), np.concatenate(none + left)


def _distance(right: NDArray[np.int64], left: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Contacts between each of the bodies 0 to `count` and a held one, 0, by the bodies of both sides of contacts."""
    away = np.full(count + 1, count + 1)
    away[0] = 0
    for _ in range(count):
        np.minimum.at(away, right, away[left] + 1)
        np.minimum.at(away, left, away[right] + 1)
    return away


def _rigid(full: FullModel, boundary: BoundaryDofs, nodes: NDArray[np.int64]) -> Array:
    """Boundary dofs (b, 6) in the rigid motions of a body; averages W u of u(x) = a + w x (x - c) are u(W x)."""
    arm = full.positions[nodes] - full.positions[nodes].mean(axis=0)
    motions = np.zeros((len(full.positions), 3, 6))
    motions[nodes, :, :3] = np.eye(3)
    motions[nodes, :, 3:] = np.cross(np.eye(3)[None], arm[:, None] / np.abs(arm).max()).transpose(0, 2, 1)
    rows = boundary.motion(len(full.positions)) @ motions.reshape(-1, 6)
    return np.pad(rows, [(0, boundary.size - len(rows)), (0, 0)])


def without_rigid_motions(stiffness: Array, floating: Sequence[Motions]) -> Array:
    """K' (b, b) of a stiffness K of the boundary dofs."""
    for motions, fit in floating:
        part = np.eye(len(stiffness)) - motions @ fit
        stiffness = part.T @ stiffness @ part
    return 0.5 * (stiffness + stiffness.T)


def stuck_springs(full: FullModel, sector: SectorMesh, kind: str = "mortar") -> csr_matrix | None:
    """Springs that hold bodies at their contacts inside the sector and with the ground, for static solutions.

    Each pair of faces is as stiff as the layer of elements under it. No part of a model: `stiffen_by_rotation`
    takes them so that bodies that contacts alone hold have a static displacement, that of stuck contacts.

    Returns stiffness, N/m; None where the clamped nodes hold every body.
    """
    from scipy.sparse import diags

    joining = [view for view in sector.views.values() if view.kind != "neighbours"]
    if not joining or not full.floating:
        return None
    diagonal, parts = full.stiffness.diagonal(), []
    for view in joining:
        if kind == "nodal":
            dofs = nodal_dofs(view, full.vertex_node, len(full.positions))
        else:
            dofs = averaged_dofs(view, full.element, kind)
        motion, count = dofs.motion, 3 * dofs.count
        relative = motion[:count] if view.kind == "ground" else motion[:count] - motion[count:]
        used = np.unique(motion[:count].indices)
        stiffness = diagonal[used].sum() / 3.0 * dofs.area / dofs.area.sum()
        parts.append(relative.T @ diags(np.repeat(stiffness, 3)) @ relative)
    return sum(parts[1:], parts[0]).tocsr()

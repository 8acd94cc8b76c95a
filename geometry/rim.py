"""The quadrilaterals of the disk's rim: those of the shroud's planform, moved to where the root stands.

The airfoil has the same nodes at its root as at the shroud. Around them the platform of the shroud becomes that of
the rim: one pitch wide, as wide as the disk along x. Its two sides are cuts through the disk, of any shape as long as
one is the other turned by a pitch.
"""

import numpy as np

from geometry.planform import Planform
from geometry.planform_mesh import PlanformMesh
from geometry.quad_smoothing import Movable, smoothed
from geometry.quality import quadrilateral_scaled_jacobian
from geometry.sector import FloatArray, IntArray

LEAST_QUALITY = 0.1  # scaled Jacobian


def rim_points(
    plan: Planform, flat: PlanformMesh, root: FloatArray, width: float, pitch: float
) -> tuple[FloatArray, IntArray, IntArray]:
    """Points (n, 2) of the rim in the developed plane (x, s), m, and the nodes of its right and left cut, paired.

    `root` (f, 2) holds the points of the airfoil's root, in the order of its nodes; `width` is that of the rim along
    x, `pitch` that along s. Raises ValueError where the root does not fit between its neighbours.
    """
    foot, around = np.unique(flat.quads[flat.airfoil]), flat.quads[~flat.airfoil]
    right, left, ends = _sides(plan, flat)
    scale = np.array([width / plan.width, pitch / plan.pitch])
    points = flat.points * scale
    half_turned = np.array([0.0, pitch]) - points[right[::-1]]
    points[right] = (points[right] + half_turned) / 2  # with this shape, the left one is a pitch away from it
    points[left] = points[right] - [0.0, pitch]
    points[foot] = root
    free = np.ones(points.shape, dtype=bool)
    free[foot] = False
    free[ends, 0] = False
    leader, offset = np.arange(len(points)), np.zeros(points.shape)
    leader[left], offset[left, 1] = right, -pitch
    found = smoothed(points, around, Movable(free, leader, offset))
    if not float(quadrilateral_scaled_jacobian(found, around).min()) > LEAST_QUALITY:
        raise ValueError("the root of the airfoil does not fit on the rim")
    return found, right, left


def _sides(plan: Planform, flat: PlanformMesh) -> tuple[IntArray, IntArray, IntArray]:
    """Nodes of the right and of the left side along +x, and those of the axial ends."""
    edges = np.concatenate([flat.quads[:, [k, (k + 1) % 4]] for k in range(4)])
    count = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    outer = {tuple(edge) for edge, number in zip(*count, strict=True) if number == 1}
    following = {int(a): int(b) for a, b in edges if (min(a, b), max(a, b)) in outer}  # counterclockwise
    right_ends = plan.right_profile()[[0, -1]]
    corners = np.vstack([right_ends, right_ends - [0.0, plan.pitch]])
    low, high, low_left, high_left = (int(np.argmin(np.hypot(*(flat.points - c).T))) for c in corners)
    loop = [high]
    while following[loop[-1]] != high:
        loop.append(following[loop[-1]])
    right = np.array(loop[: loop.index(low) + 1])[::-1]  # the loop runs along it from +x to -x
    left = np.array(loop[loop.index(low_left) : loop.index(high_left) + 1])
    if len(left) != len(right):
        raise ValueError("the sides of the platform have different numbers of nodes")
    on_end = np.abs(np.abs(flat.points[:, 0]) - plan.width / 2) < 1e-9 * plan.width
    return right, left, np.flatnonzero(on_end)

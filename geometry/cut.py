"""The cut of the planform into an upper and a lower half.

The cut follows the camber line of the airfoil. It continues from the trailing edge to the axial edge of the platform
at +x and from the leading edge to the other axial edge: the same cut of the planform rotated by 180 degrees. Without
camber the two halves are images of each other.
"""

from itertools import pairwise
from math import cos, radians, sin, tan

import numpy as np

from geometry.outlines import distance, inside
from geometry.planform import Planform
from geometry.sector import FloatArray

AMPLE_CLEARANCE = 0.1  # distance from the sides of the platform, relative to its breadth
LEAST_CLEARANCE = 0.01
LEAST_COSINE = 0.3  # of the angle between the camber line and the cut where it leaves the airfoil


def cut_beyond_airfoil(plan: Planform) -> FloatArray | None:
    """Corners (2 or 3, 2) of the cut from the trailing edge to the axial edge; None where there is no room.

    Where the clearance from both sides of the platform is ample, the direction of the cut is half-way between the
    camber line and the side edges. Else the cut is the straight line with the largest clearance, or it follows the
    middle line of the platform round its corner.
    """
    edge = plan.place(np.array([plan.section.half_length, 0.0]))
    x, bend = plan.width / 2, np.array(plan.contact_half)
    usual = edge[1] + (x - edge[0]) * tan(radians(_direction_at_edge(plan) + plan.edge_angle) / 2)
    middle, limit = plan.end_offset, (0.5 - AMPLE_CLEARANCE) * plan.pitch
    path = np.array([edge, [x, min(max(usual, middle - limit), middle + limit)]])
    clearance = _clearance(plan, path)
    if clearance > AMPLE_CLEARANCE * plan.breadth:
        return path
    paths = [path, *(np.array([edge, [x, middle + k * limit]]) for k in np.linspace(-1, 1, 13))]
    if edge[0] < bend[0]:
        paths.append(np.array([edge, bend, [x, middle]]))
    clearances = [clearance, *(_clearance(plan, other) for other in paths[1:])]
    best = int(np.argmax(clearances))
    return paths[best] if clearances[best] > LEAST_CLEARANCE * plan.breadth else None


def _direction_at_edge(plan: Planform) -> float:
    """Angle from x to the camber line at the trailing edge, degrees."""
    return plan.stagger - plan.section.camber / 2


def _clearance(plan: Planform, path: FloatArray) -> float:
    """Least distance (m) of a path from the sides of the platform; -1 for a path off it or along the airfoil."""
    start = path[1] - path[0]
    direction = radians(_direction_at_edge(plan))
    along = start[0] * cos(direction) + start[1] * sin(direction)
    if along < LEAST_COSINE * np.hypot(*start):
        return -1.0
    t = np.linspace(0.0, 0.99, 12)[:, None]
    points = np.vstack([a + t * (b - a) for a, b in pairwise(path)])
    if not inside(points, plan.outline()).all():
        return -1.0
    right = plan.right_profile()
    return min(distance(points, right, closed=False), distance(points, -right, closed=False))

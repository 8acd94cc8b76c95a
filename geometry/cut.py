"""Where the planform is cut in two halves that are each other's image under a half turn.

The cut follows the airfoil's chord line and goes on from its trailing edge to the axial edge of the platform at +x
(and turned by 180 degrees, from the leading edge to the other one).
"""

from itertools import pairwise
from math import cos, radians, sin, tan

import numpy as np

from geometry.outlines import distance, inside
from geometry.planform import Planform
from geometry.sector import FloatArray

ROOM = 0.1  # distance from the sides of the platform that is ample, in pitches
LEAST_ROOM = 0.01
LEAST_COSINE = 0.3  # of the angle between the chord and the cut where it leaves the airfoil


def continuation(plan: Planform) -> FloatArray | None:
    """Corners (2 or 3, 2) of the cut from the trailing edge to the axial edge; None where there is no way.

    The cut turns half-way back from the chord to the axis where that stays well clear of both sides of the platform.
    Else it takes the straight line that stays clearest, or follows the platform's middle line round its corner.
    """
    edge = plan.place(np.array([plan.chord / 2, 0.0]))
    x, bend = plan.width / 2, np.array(plan.contact_half)
    usual = edge[1] + (x - edge[0]) * tan(radians(plan.stagger) / 2)
    middle, reach = bend[1], (0.5 - ROOM) * plan.pitch
    ends = [min(max(usual, middle - reach), middle + reach), *(middle + k * reach for k in np.linspace(-1, 1, 13))]
    paths = [np.array([edge, [x, end]]) for end in ends]
    if edge[0] < bend[0]:
        paths.append(np.array([edge, bend, [x, bend[1]]]))
    rooms = [_room(plan, path) for path in paths]
    best = 0 if rooms[0] > ROOM * plan.pitch else int(np.argmax(rooms))
    return paths[best] if rooms[best] > LEAST_ROOM * plan.pitch else None


def _room(plan: Planform, path: FloatArray) -> float:
    """Least distance (m) of a path from the sides of the platform; -1 where it leaves it or grazes the airfoil."""
    start = path[1] - path[0]
    along = start[0] * cos(radians(plan.stagger)) + start[1] * sin(radians(plan.stagger))
    if along < LEAST_COSINE * np.hypot(*start):
        return -1.0
    t = np.linspace(0.0, 0.99, 12)[:, None]
    points = np.vstack([a + t * (b - a) for a, b in pairwise(path)])
    if not inside(points, plan.outline()).all():
        return -1.0
    right = plan.right_profile()
    return min(distance(points, right, closed=False), distance(points, -right, closed=False))

"""Contact faces: contact nodes, their frames and tributary areas."""

from math import cos, pi, radians, sin

import numpy as np

from geometry.sector import ContactFace, FloatArray, IntArray


def contact_frame(angle: float, position: FloatArray) -> FloatArray:
    """Contact frames (n_c, 3, 3), rows t1, t2, n, of the right face at ``position`` (n_c, 3) for a shroud ``angle``.

    In the tangent plane (e_x, e_theta) at the node t1 = (cos alpha, sin alpha), n = (-sin alpha, cos alpha) for
    alpha <= 90 degrees, and both with the opposite sign for alpha > 90; t2 = e_r, outward. So n points out of the +y
    side, t1 towards +x, and (t1, n, t2) is right-handed.
    """
    c, s = cos(radians(angle)), sin(radians(angle))
    if angle == 90.0:
        c = 0.0
    elif angle == 180.0:
        s = 0.0
    if angle > 90.0:
        c, s = -c, -s
    radius = np.hypot(position[:, 1], position[:, 2])
    zero = np.zeros(len(position))
    e_r = np.stack([zero, position[:, 1] / radius, position[:, 2] / radius], axis=-1)
    e_theta = np.stack([zero, e_r[:, 2], -e_r[:, 1]], axis=-1)
    e_x = np.array([1.0, 0.0, 0.0])
    return np.stack([c * e_x + s * e_theta, e_r, -s * e_x + c * e_theta], axis=1)


def rotate_about_axis(vectors: FloatArray, angle: float) -> FloatArray:
    """Vectors (..., 3) rotated about the engine axis by ``angle`` (rad), positive from z to y like the blades."""
    c, s = cos(angle), sin(angle)
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack([x, c * y + s * z, c * z - s * y], axis=-1)


def contact_faces(
    points: FloatArray, right: IntArray, left: IntArray, angle: float, area: float, n_blades: int
) -> tuple[ContactFace, ContactFace]:
    """The two faces from their contact nodes in order; ``area`` (m^2) of the whole face is shared evenly."""
    share = np.full(len(right), area / len(right))
    frame = contact_frame(angle, points[right])
    back = rotate_about_axis(frame, -2 * pi / n_blades)
    return (
        ContactFace(right, points[right], frame, share),
        ContactFace(left, points[left], back, share.copy()),
    )

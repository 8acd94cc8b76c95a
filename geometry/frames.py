"""Frames: axes of the program in those of a file, contact frames, and rotation about the engine axis.

x leads along the engine, z through the contact faces, y along the circumference.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, pi, radians, sin
from types import MappingProxyType

import numpy as np

from geometry.sector import ContactFace, FloatArray, IntArray

_ROUND_OFF = 1e-9
NAMED_AXES: Mapping[str, FloatArray] = MappingProxyType(
    {
        sign + name: factor * row
        for name, row in zip("xyz", np.eye(3), strict=True)
        for sign, factor in (("", 1.0), ("-", -1.0))
    }
)
_STEEP = 0.2  # smallest radial part of a face, sine of its angle to the tangent plane of the ring


def axes_through(direction: FloatArray, at: FloatArray) -> FloatArray:
    """Rotation matrix, rows x, y, z, for an engine axis through the origin and a point off it.

    `direction` (3,): engine axis, of length 1; `at` (3,): point that z leads through. Returns (3, 3): the rotation;
    entries that are 0, 1 or -1 to round-off are exact, so that a mesh in our axes stays as it is.
    """
    radial = at - (at @ direction) * direction
    z = radial / np.linalg.norm(radial)
    rotation = np.stack([direction, np.cross(z, direction), z])
    exact = np.round(rotation)
    return exact + 0.0 if np.abs(rotation - exact).max() < _ROUND_OFF else rotation


def distance_from_axis(direction: FloatArray, at: FloatArray) -> FloatArray:
    """Distances (...,) of points (..., 3) from the axis through the origin."""
    return np.linalg.norm(np.cross(at, direction), axis=-1)


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


def contact_frames(at: FloatArray, normal: FloatArray) -> FloatArray:
    """Contact frames, rows t1, t2, n, of any right face.

    t2 is the radial direction projected in the face, outward; t1 = n x t2. Where the face is nearly tangential to
    the ring, t1 is the axial direction projected in the face and t2 = t1 x n.

    `at` (k, 3): contact points, m; `normal` (k, 3): unit normals out of the body. Returns (k, 3, 3): the frames.
    """
    radial = at * [0.0, 1.0, 1.0]
    radial = radial / np.linalg.norm(radial, axis=1)[:, None]
    t2 = radial - np.sum(radial * normal, axis=1)[:, None] * normal
    length = np.linalg.norm(t2, axis=1)
    if length.min() < _STEEP:
        axial = np.array([1.0, 0.0, 0.0])
        t1 = axial - (normal @ axial)[:, None] * normal
        t1 /= np.linalg.norm(t1, axis=1)[:, None]
        return np.stack([t1, np.cross(t1, normal), normal], axis=1)
    t2 /= length[:, None]
    return np.stack([np.cross(normal, t2), t2, normal], axis=1)


def rotate_about_axis(vectors: FloatArray, angle: float) -> FloatArray:
    """Vectors rotated about the engine axis, in the sense that takes a blade to the next: z towards +y.

    `vectors` (..., 3): vectors or points; `angle`: rad.
    """
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

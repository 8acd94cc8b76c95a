"""Normals and frames of a curved contact face: a polynomial fit of the normals of its sides."""

from __future__ import annotations

import numpy as np

from geometry.own_mesh.side_quadrature import SidePoints
from geometry.sector import FloatArray

_HIGHEST = 4  # degree
_STEEP = 0.2  # smallest radial part of a face, sine of its angle to the tangent plane of the ring


def face_axes(points: SidePoints) -> FloatArray:
    """Coordinates of a face, rows (2, 3): t1 and t2 at its centre."""
    normal = points.mean_normal / np.linalg.norm(points.mean_normal)
    return contact_frames(points.centroid[None], normal[None])[0, :2]


def contact_frames(at: FloatArray, normal: FloatArray) -> FloatArray:
    """Frames (k, 3, 3), rows t1, t2, n, at points (k, 3) with unit normals (k, 3) of the right face.

    t2 is the radial direction projected in the face, outward; t1 = n x t2. Where the face is nearly tangential to
    the ring, t1 is the axial direction projected in the face and t2 = t1 x n.
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


def normals_at(at: FloatArray, points: SidePoints, n_sides: int) -> FloatArray:
    """Unit normals (k, 3) at points (k, 3) of a face, by least squares over its quadrature points.

    The degree of the polynomial in the coordinates of the face grows with the number of its sides.
    """
    degree = min(_HIGHEST, int(np.sqrt(n_sides)))
    axes, centre = face_axes(points), points.centroid
    scale = np.abs((points.position - centre) @ axes.T).max()

    def basis(position: FloatArray) -> FloatArray:
        s, r = ((position - centre) @ axes.T / scale).T
        return np.stack([s**i * r**j for i in range(degree + 1) for j in range(degree + 1 - i)], axis=1)

    root = np.sqrt(points.area / points.area.mean())[:, None]
    mean = points.mean_normal
    fit = np.linalg.lstsq(basis(points.position) * root, (points.normal - mean) * root, rcond=1e-10)[0]
    found = mean + basis(at) @ fit
    return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])

"""Points and closed outlines in a plane."""

import numpy as np
from numpy.typing import NDArray

from geometry.sector import FloatArray


def inside(points: FloatArray, polygon: FloatArray) -> NDArray[np.bool_]:
    """(k,) which of ``points`` (k, 2) lie inside the ``polygon`` (m, 2) (even-odd rule)."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    x, y = points[:, :1], points[:, 1:]
    spans = (a[:, 1] > y) != (b[:, 1] > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = a[:, 0] + (y - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return np.asarray((spans & (x < crossing)).sum(axis=1) % 2 == 1)


def distances(points: FloatArray, line: FloatArray, *, closed: bool = True) -> FloatArray:
    """Least distances (k,) from ``points`` (k, 2) to the sides of a polygon or an open ``line`` (m, 2)."""
    a, b = (line, np.roll(line, -1, axis=0)) if closed else (line[:-1], line[1:])
    side = b - a
    offset = points[:, None, :] - a
    length = np.maximum((side**2).sum(axis=-1), 1e-300)
    t = np.clip((offset * side).sum(axis=-1) / length, 0.0, 1.0)
    return np.asarray(np.linalg.norm(offset - t[..., None] * side, axis=-1).min(axis=1))


def distance(points: FloatArray, line: FloatArray, *, closed: bool = True) -> float:
    """Least distance from any of ``points`` (k, 2) to the sides of a polygon or an open ``line`` (m, 2)."""
    return float(distances(points, line, closed=closed).min())


def cross(one: FloatArray, other: FloatArray) -> bool:
    """True where a side of one polygon crosses a side of the other."""
    a, b = one[:, None], np.roll(one, -1, axis=0)[:, None]
    c, d = other[None], np.roll(other, -1, axis=0)[None]

    def turn(p: FloatArray, q: FloatArray, r: FloatArray) -> FloatArray:
        u, v = q - p, r - p
        return np.sign(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])

    crossing = (turn(a, b, c) * turn(a, b, d) < 0) & (turn(c, d, a) * turn(c, d, b) < 0)
    return bool(crossing.any())

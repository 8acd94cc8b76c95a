"""Names of blade modes by their shape: flap, edge, torsion, radial, counted within each family."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

FAMILIES = "FETR"
SLICES = 12  # sections over the height
FEWEST = 4  # vertices that make a section


def mode_names(points: NDArray[np.float64], shapes: NDArray[Any]) -> list[str]:
    """Names such as 1F, 1E, 1T, 2F of mode shapes of an airfoil.

    Each section over the height moves with its mean (u_x, u_y, u_z) and turns by theta about its centroid. A mode
    belongs to the family with the largest mean square displacement over the sections: flap F across the chord, edge E
    along the chord, torsion T with theta^2 <r^2>, radial R. The chord is the longest principal axis of a section.

    Parameters
    ----------
    points : (N, 3) array
        Vertices of the airfoil without its shroud, x axial, y circumferential, z radial, m.
    shapes : (M, N, 3) array
        Mode shapes there, real or complex, by ascending frequency.

    Returns
    -------
    list of str
        One name a mode; the number counts the modes of its family.

    Examples
    --------
    >>> from rom import mode_names
    >>> z = np.repeat(np.linspace(0.0, 0.1, 25), 4)
    >>> corners = np.tile([[-0.02, -0.002], [0.02, -0.002], [0.02, 0.002], [-0.02, 0.002]], (25, 1))
    >>> bending = np.column_stack([0.0 * z, z**2, 0.0 * z])
    >>> mode_names(np.column_stack([corners, z]), bending[None])
    ['1F']
    """
    motion = section_motion(points, np.asarray(shapes))
    return counted(FAMILIES[k] for k in np.argmax(np.sum(np.abs(motion) ** 2, axis=2), axis=1))


def counted(families: Iterable[str]) -> list[str]:
    """Names of modes of these families by ascending frequency, numbered within each family."""
    counts: Counter[str] = Counter()
    names = []
    for family in families:
        counts[family] += 1
        names.append(f"{counts[family]}{family}")
    return names


def section_motion(points: NDArray[np.float64], shapes: NDArray[Any]) -> NDArray[Any]:
    """Flap, edge, torsion and radial motion (M, 4, sections) of the sections of shapes (M, N, 3), linear in these."""
    height = points[:, 2]
    section = np.digitize(height, np.linspace(height.min(), height.max(), SLICES + 1)[1:-1])
    found = np.zeros((len(shapes), len(FAMILIES), SLICES), dtype=shapes.dtype)
    for number in range(SLICES):
        rows = np.flatnonzero(section == number)
        if len(rows) < FEWEST:
            continue
        arm = points[rows, :2] - points[rows, :2].mean(axis=0)
        chord, normal = np.linalg.svd(arm, full_matrices=False)[2]
        moved = shapes[:, rows]
        mean = moved.mean(axis=1)
        square = np.mean(np.sum(arm**2, axis=1))
        turned = np.mean(arm[:, 0] * moved[:, :, 1] - arm[:, 1] * moved[:, :, 0], axis=1) / square
        parts = (mean[:, :2] @ normal, mean[:, :2] @ chord, turned * np.sqrt(square), mean[:, 2])
        found[:, :, number] = np.stack(parts, axis=1)
    return found

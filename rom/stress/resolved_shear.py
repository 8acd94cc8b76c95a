"""Shear stress on the octahedral slip systems of a cubic crystal: planes {111}, directions <110> (Schmid).

References
----------
E. Schmid, W. Boas, Plasticity of Crystals, Chapman & Hall (1968), chapter 4.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rom.finite_elements.material import AnisotropicMaterial, Materials, MaterialTable, material_of
from rom.stress.stress_recovery import COLUMNS, ROWS

Array = NDArray[np.float64]
INSTANTS = 64  # of a period for each harmonic


def slip_axes(materials: Materials, name: str) -> Array | None:
    """Axes of a material that is a cubic crystal, (3, 3), one a row; None of others."""
    material = material_of(materials, name)
    first = material.states[0] if isinstance(material, MaterialTable) else material
    return np.asarray(first.axes) if isinstance(first, AnisotropicMaterial) and first.is_cubic else None


def slip_systems() -> tuple[Array, Array]:
    """Normals and directions of the twelve octahedral systems in the axes of the crystal, (12, 3) each."""
    planes = [np.array([1.0, *signs]) for signs in product((1.0, -1.0), repeat=2)]
    ways = [
        np.array(way, dtype=float) for way in ((0, 1, 1), (0, 1, -1), (1, 0, 1), (1, 0, -1), (1, 1, 0), (1, -1, 0))
    ]
    pairs = [(plane, way) for plane in planes for way in ways if plane @ way == 0.0]
    normals, directions = (np.array(each) for each in zip(*pairs, strict=True))
    return normals / np.sqrt(3.0), directions / np.sqrt(2.0)


def octahedral_shear(harmonics: NDArray[Any], axes: Array) -> tuple[float, float]:
    """Amplitude and size of the mean of the shear stress on the system where the amplitude is largest, Pa.

    `harmonics` (H+1, 6): components xx, yy, zz, xy, yz, zx at a place, Pa; harmonic 0 real-valued.
    """
    normals, directions = (each @ axes for each in slip_systems())
    weights = normals[:, ROWS] * directions[:, COLUMNS] + normals[:, COLUMNS] * directions[:, ROWS]
    weights[:, :3] /= 2.0
    angle = 2.0 * np.pi * np.arange(INSTANTS * max(len(harmonics) - 1, 1)) / (INSTANTS * max(len(harmonics) - 1, 1))
    waves = np.exp(1j * np.outer(np.arange(len(harmonics)), angle))
    shear = weights @ (harmonics.T @ waves).real  # (12, instants)
    high, low = shear.max(axis=1), shear.min(axis=1)
    worst = int(np.argmax(high - low))
    return float(high[worst] - low[worst]) / 2.0, abs(float(high[worst] + low[worst])) / 2.0

"""Families of modes: names of modes by the motion of the airfoil, and with a disk by the strain energy of the disk.

Both are sums of squares of linear functions of the reduced coordinates: with these rows every mode of the reduced
model, at every nodal diameter, has its name without its shape on the mesh.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.cyclic.natural_frequencies import natural_modes
from rom.cyclic.reduced_model import ReducedModel

if TYPE_CHECKING:
    from geometry.sector import SectorMesh

FAMILIES = "FETR"
_LEAST_AIRFOIL = 0.1  # of the height of a body that a shroud leaves to the airfoil; else all of it is
SLICES = 12  # sections over the height
FEWEST = 4  # vertices that make a section


def mode_names(points: NDArray[np.float64], shapes: NDArray[Any]) -> list[str]:
    """Names such as 1F, 1E, 1T, 2F of mode shapes of an airfoil.

    Each section over the height moves with its mean (u_x, u_y, u_z) and turns by theta about its centroid. A mode
    belongs to the family with the largest mean square displacement over the sections: flap F across the chord, edge E
    along the chord, torsion T with theta^2 <r^2>, radial R. The chord is the longest principal axis of a section.

    `points` (N, 3): vertices of the airfoil without its shroud, x axial, y circumferential, z radial, m; `shapes` (M,
    N, 3): mode shapes there, real or complex, by ascending frequency.
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
    if not len(points):
        return np.zeros((len(shapes), len(FAMILIES), SLICES), dtype=shapes.dtype)
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


DISK = "D"
MOSTLY = 0.5  # share of the strain energy from which a mode is one of the disk
_RIGID = 1e-6  # of the highest frequency asked for: a motion without strain


@dataclass(frozen=True)
class ModeFamilies:
    """Rows that tell the family of a mode from its reduced coordinates."""

    # (4 s, n) flap, edge, torsion and radial motion of s sections of the airfoil for unit coordinates, m
    airfoil: NDArray[np.float64]
    # (d, n) strain of the disk: the sum of squares is the disk's part of q^H K q, N/m; no rows without a disk
    disk: NDArray[np.float64]

    def with_coordinates(self, count: int) -> ModeFamilies:
        """The same rows of a model with further coordinates, which move neither airfoil nor disk."""
        added = [(0, 0), (0, count - self.airfoil.shape[1])]
        return ModeFamilies(np.pad(self.airfoil, added), np.pad(self.disk, added))

    def modes(
        self,
        model: ReducedModel,
        phase: float,
        *,
        normal: ArrayLike = 0.0,
        tangential: ArrayLike = 0.0,
        count: int = 10,
    ) -> tuple[NDArray[np.float64], list[str], NDArray[np.float64]]:
        """Lowest natural frequencies with the names of the modes and the share of the disk in their strain energy.

        Returns `frequencies` (count,): natural frequencies in Hz, ascending; `names`: 1F, 1E, 1T, ... by the motion
        of the airfoil as in `mode_names`; 1D, 2D, ... where the disk has more than half of the strain energy; a
        motion without strain counts as one of the disk; `share` (count,): share of the disk in the strain energy, 0
        to 1.
        """
        frequency, modes = natural_modes(model, phase, normal=normal, tangential=tangential, count=count)
        return frequency, *self.names(frequency, modes)

    def names(self, frequency_hz: NDArray[np.float64], modes: NDArray[Any]) -> tuple[list[str], NDArray[np.float64]]:
        """Names of given modes.

        `frequency_hz` (m,): natural frequencies, Hz, ascending; `modes` (n, m): mass-normalised modes, as of
        `natural_modes`. Returns `names` as of `modes`; `share` (m,): share of the disk in the strain energy.
        """
        omega = 2.0 * np.pi * frequency_hz
        elastic = omega > _RIGID * omega[-1]
        stored = np.sum(np.abs(self.disk @ modes) ** 2, axis=0)
        share = np.where(elastic, stored / np.where(elastic, omega, 1.0) ** 2, 1.0)
        motion = np.abs(self.airfoil @ modes) ** 2
        family = motion.reshape(len(FAMILIES), -1, len(omega)).sum(axis=1).argmax(axis=0)
        names = counted(
            DISK if part > MOSTLY else FAMILIES[number] for part, number in zip(share, family, strict=True)
        )
        return names, share


def shroud_height(sector: SectorMesh) -> float:
    """Least z (m) of the contact nodes of the shroud, below which is the airfoil; infinite where there is none."""
    if sector.main != "shroud":
        return np.inf
    lowest = min(float(sector.points[face.nodes, 2].min()) for face in (sector.right, sector.left))
    height = sector.points[:, 2]
    return lowest if lowest - height.min() > _LEAST_AIRFOIL * np.ptp(height) else np.inf


def wing_vertices(sector: SectorMesh) -> NDArray[np.int64]:
    """Vertices of snubber and platform off the airfoil."""
    sets = [sector.node_sets[name] for name in ("snubber", "platform") if name in sector.node_sets]
    return np.concatenate([np.zeros(0, dtype=np.int64), *sets])


def blade_families(sector: SectorMesh, basis: NDArray[np.float64]) -> ModeFamilies:
    """Rows of a reduced model of a blade without its disk that tell the families of its modes.

    `basis` (N, n): mesh displacements of the reduced coordinates, `ReducedModel.basis`.
    """
    airfoil = np.setdiff1d(np.flatnonzero(sector.points[:, 2] < shroud_height(sector)), wing_vertices(sector))
    displacement = basis.T.reshape(basis.shape[1], -1, 3)[:, airfoil]
    sections = section_motion(sector.points[airfoil], displacement)
    return ModeFamilies(sections.reshape(len(sections), -1).T.copy(), np.zeros((0, basis.shape[1])))

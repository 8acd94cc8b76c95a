"""What a user says about a mesh from elsewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from geometry.errors import OwnMeshError
from geometry.frames import NAMED_AXES
from geometry.sector import KINDS, FloatArray
from geometry.units import UNIT_SYSTEMS

SETS = ("root", "contact_right", "contact_left", "tip", "cyclic_right", "cyclic_left")
BORES = ("clamped", "free")
OTHER_FACES = ("ask", "free", "cut")
MAIN = "shroud"  # interface of the sets contact_right and contact_left
NO_CONTACT = "no_contact"  # in the place of an interface of a sector that touches nothing
_MOST_POINTS = 40  # in a direction of the contact grid


@dataclass(frozen=True)
class InterfaceChoice:
    """Faces of a mesh from elsewhere that touch."""

    right: str  # node set or surface of the file. Between neighbours the face on the side of the next blade
    left: str | None = None  # the one that it touches; None against the ground
    # whether the left face is that of the next blade, belongs to the same sector, or is ground that does not move
    kind: str = "neighbours"
    # contact points along t1 and along t2 of each plane patch; None: as in `SectorChoice`
    contact_grid: tuple[int, int] | None = None


@dataclass(frozen=True)
class SectorChoice:
    """How a mesh from elsewhere becomes a sector."""

    n_blades: int  # number of blades of the ring
    unit: str = "m"  # units of the file, a name in `UNIT_SYSTEMS`: "mm" goes with N, s, t, "in" with lbf, s
    # engine axis in the axes of the file: "x", "-x", "y", "-y", "z", "-z", or a vector
    axis: str | Sequence[float] = "x"
    axis_point: Sequence[float] = (0.0, 0.0, 0.0)  # a point on the engine axis, in the unit of the file
    # names of node sets or surfaces of the file for `root`, `contact_right`, `contact_left` and `tip`; those without
    # a name are found by geometry where that is safe. `cyclic_right` and `cyclic_left` are the cut faces of a disk;
    # without a name they are the sets that the file names so or as other programs name them (`named_cuts`)
    sets: Mapping[str, str] = field(default_factory=dict)
    # contact points on each face along t1 and along t2. None: all corner nodes of faces whose meshes match, but for
    # clamped ones
    contact_grid: tuple[int, int] | None = (3, 3)
    # largest distance between a face and the opposite face of the neighbour, in the unit of the file. None: 5 % of
    # the square root of the area of the face
    tolerance: float | None = None
    # whether the nodes of `root` are held. "free": nothing is; for the sector of a disk, joined at its cut faces
    bore: str = "clamped"
    # what surfaces are that one pitch turns into each other but that `sets` does not name: refused, free surfaces, or
    # cut faces of a disk
    other_faces: str = "ask"
    # contact interfaces by name. `contact_right` and `contact_left` of `sets` are the one named "shroud"; without any
    # the contact faces are found by geometry. Separate patches of a set are paired one by one
    interfaces: Mapping[str, InterfaceChoice] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.unit not in UNIT_SYSTEMS:
            raise OwnMeshError("mesh.unit", self.unit, f"must be one of {', '.join(UNIT_SYSTEMS)}")
        if not isinstance(self.n_blades, int | np.integer) or self.n_blades < 3:
            raise OwnMeshError("mesh.n_blades", self.n_blades, "must be a whole number from 3")
        if isinstance(self.axis, str):
            if self.axis not in NAMED_AXES:
                raise OwnMeshError("mesh.axis", self.axis, f"must be one of {', '.join(NAMED_AXES)}, or a vector")
        elif np.shape(self.axis) != (3,) or not np.isfinite(self.axis).all() or not np.any(self.axis):
            raise OwnMeshError("mesh.axis", self.axis, "must be three finite numbers, not all 0")
        if np.shape(self.axis_point) != (3,) or not np.isfinite(self.axis_point).all():
            raise OwnMeshError("mesh.axis_point", self.axis_point, "must be three finite numbers")
        if self.bore not in BORES:
            raise OwnMeshError("mesh.bore", self.bore, f"must be one of {', '.join(BORES)}")
        if self.other_faces not in OTHER_FACES:
            raise OwnMeshError("mesh.other_faces", self.other_faces, f"must be one of {', '.join(OTHER_FACES)}")
        for name in self.sets:
            if name not in SETS:
                raise OwnMeshError(
                    f"mesh.sets.{name}", self.sets[name], f"the sets of a sector are {', '.join(SETS)}"
                )
        self._check_numbers()
        self._check_interfaces()

    def _check_interfaces(self) -> None:
        for name, each in self.interfaces.items():
            key = f"mesh.interface.{name}"
            if "/" in name or not name:
                raise OwnMeshError("mesh.interface", name, 'must be a name without "/"')
            if name == MAIN and {"contact_right", "contact_left"} & self.sets.keys():
                raise OwnMeshError(key, None, "is named twice: contact_right and contact_left of mesh.sets are it")
            if each.kind not in KINDS:
                raise OwnMeshError(f"{key}.kind", each.kind, f"must be one of {', '.join(KINDS)}")
            if (each.left is None) != (each.kind == "ground"):
                told = "must be left out: the ground has no face" if each.left else f"is needed: of {each.kind}"
                raise OwnMeshError(f"{key}.left", each.left, told)

    def _check_numbers(self) -> None:
        given = {"mesh": self.contact_grid}
        given |= {f"mesh.interface.{name}": each.contact_grid for name, each in self.interfaces.items()}
        for table, grid in given.items():
            if grid is not None and (len(grid) != 2 or not all(1 <= count <= _MOST_POINTS for count in grid)):
                told = f"must be two whole numbers from 1 to {_MOST_POINTS}"
                raise OwnMeshError(f"{table}.contact_grid", grid, told)
        if self.tolerance is not None and not self.tolerance > 0.0:
            raise OwnMeshError("mesh.tolerance", self.tolerance, "must be above 0")

    @property
    def direction(self) -> FloatArray:
        """Engine axis in the axes of the file, (3,), of length 1."""
        vector = NAMED_AXES[self.axis] if isinstance(self.axis, str) else np.asarray(self.axis, dtype=float)
        return np.asarray(vector / np.linalg.norm(vector))

    @property
    def metres(self) -> float:
        """Metres in a unit of the file."""
        return UNIT_SYSTEMS[self.unit].length

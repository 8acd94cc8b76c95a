"""What a user says about matrices from another program."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from rom.errors import RomParameterError

SETS = ("root", "contact_right", "contact_left", "tip")
_MOST_BLADES = 10_000


@dataclass(frozen=True)
class MatrixChoice:
    """Files with stiffness, mass and nodes of one sector, and how they become a model."""

    # stiffness, mass: files with the matrices, see `read_matrix`
    stiffness: str | os.PathLike[str]
    mass: str | os.PathLike[str]
    nodes: str | os.PathLike[str]  # table of the nodes, see `read_nodes`
    n_blades: int  # number of blades of the ring
    # dofs of the rows, see `read_dofs`. None: those that the files of the matrices name, or three a node in the order
    # of the table of nodes
    dofs: str | os.PathLike[str] | None = None
    # stiffness_name, mass_name: names of the matrices in files that hold several
    stiffness_name: str | None = None
    mass_name: str | None = None
    unit: str = "m"  # a name in `UNIT_SYSTEMS`: "mm" goes with N, t, "in" with lbf, lbf s^2/in
    # engine axis in the axes of the nodes: "x", "-x", "y", "-y", "z", "-z", or a vector
    axis: str | Sequence[float] = "x"
    axis_point: Sequence[float] = (0.0, 0.0, 0.0)  # a point on the engine axis, in the unit of the nodes
    # names of the sets `root`, `contact_right`, `contact_left` and `tip` in the table, where they are others
    sets: Mapping[str, str] = field(default_factory=dict)
    # largest distance between the nodes of a pair of contact nodes in the face, in the unit of the nodes. None: a
    # quarter of the distance between contact nodes
    tolerance: float | None = None
    speed_rpm: float = 0.0  # speed about whose static equilibrium the stiffness holds, rev/min
    # file with the centrifugal force at 1 rad/s, one number for each row; None: it is computed from the mass
    centrifugal: str | os.PathLike[str] | None = None
    # of a reduced model: displacements of the nodes (rows as in `dofs`) for unit coordinates (columns)
    transformation: str | os.PathLike[str] | None = None
    reduced: bool = False  # whether the matrices are those of a reduced model

    def __post_init__(self) -> None:
        for name in self.sets:
            if name not in SETS:
                raise RomParameterError("model.sets", name, self.sets[name], f"must be one of {', '.join(SETS)}")
        if not 2 <= self.n_blades <= _MOST_BLADES:
            raise RomParameterError("model", "n_blades", self.n_blades, f"must be 2 to {_MOST_BLADES}")
        if self.transformation is not None and not self.reduced:
            raise RomParameterError(
                "model", "transformation", str(self.transformation), "must go with reduced = true"
            )

    def set_name(self, name: str) -> str:
        """Name in the table of one of the four sets."""
        return self.sets.get(name, name)

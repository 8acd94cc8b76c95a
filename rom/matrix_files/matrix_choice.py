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
    """Files with stiffness, mass and nodes of one sector, and how they become a model.

    Attributes
    ----------
    stiffness, mass : str or path
        Files with the matrices, see `read_matrix`.
    nodes : str or path
        Table of the nodes, see `read_nodes`.
    n_blades : int
        Number of blades of the ring.
    dofs : str or path or None
        Dofs of the rows, see `read_dofs`. None: those that the files of the matrices name, or three a node in the
        order of the table of nodes.
    stiffness_name, mass_name : str or None
        Names of the matrices in files that hold several.
    unit : str
        A name in `UNIT_SYSTEMS`: "mm" goes with N, t, "in" with lbf, lbf s^2/in.
    axis : str or (3,) sequence of float
        Engine axis in the axes of the nodes: "x", "-x", "y", "-y", "z", "-z", or a vector.
    axis_point : (3,) sequence of float
        A point on the engine axis, in the unit of the nodes.
    sets : mapping of str to str
        Names of the sets `root`, `contact_right`, `contact_left` and `tip` in the table, where they are others.
    tolerance : float or None
        Largest distance between the nodes of a pair of contact nodes in the face, in the unit of the nodes. None: a
        quarter of the distance between contact nodes.
    speed_rpm : float
        Speed about whose static equilibrium the stiffness holds, rev/min.
    centrifugal : str or path or None
        File with the centrifugal force at 1 rad/s, one number for each row; None: it is computed from the mass.
    transformation : str or path or None
        Of a reduced model: displacements of the nodes (rows as in `dofs`) for unit coordinates (columns).
    reduced : bool
        Whether the matrices are those of a reduced model.

    Raises
    ------
    RomParameterError
        A value is not one of those allowed.

    Examples
    --------
    >>> from rom import MatrixChoice
    >>> MatrixChoice("blade.sti", "blade.mas", "nodes.csv", n_blades=40, unit="mm").speed_rpm
    0.0
    """

    stiffness: str | os.PathLike[str]
    mass: str | os.PathLike[str]
    nodes: str | os.PathLike[str]
    n_blades: int
    dofs: str | os.PathLike[str] | None = None
    stiffness_name: str | None = None
    mass_name: str | None = None
    unit: str = "m"
    axis: str | Sequence[float] = "x"
    axis_point: Sequence[float] = (0.0, 0.0, 0.0)
    sets: Mapping[str, str] = field(default_factory=dict)
    tolerance: float | None = None
    speed_rpm: float = 0.0
    centrifugal: str | os.PathLike[str] | None = None
    transformation: str | os.PathLike[str] | None = None
    reduced: bool = False

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
        """Name in the table of one of the four sets.

        Parameters
        ----------
        name : str
            "root", "contact_right", "contact_left" or "tip".
        """
        return self.sets.get(name, name)

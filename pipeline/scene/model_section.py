"""[model] of a scene: stiffness and mass from the files of another program, in place of blade and mesh."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

from pydantic import Field

from pipeline.scene.fields import (
    AXIS,
    AXIS_POINT,
    BLADES,
    LENGTH,
    UNIT,
    AxisPoint,
    EngineAxis,
    Length,
    LengthUnit,
    Number,
    Section,
    Truth,
    Whole,
    key,
)

FileName = Annotated[str, Field(min_length=1, max_length=1000)]
MatrixName = Annotated[str, Field(min_length=1, max_length=200)]
MATRIX = "the name of a file .mtx, .sti, .mas, .mat, .op4, .pch, .dmig, .bdf, .dat, .inp or .full"
TABLE = "the name of a CSV file"
SET_NAME = "a name in the column sets of the table of nodes"
FILES = ("stiffness", "mass", "nodes", "dofs", "centrifugal", "transformation")


class ModelSets(Section):
    """[model.sets]: sets of the table of nodes by their names there, where they are others than the keys."""

    root: MatrixName | None = key("clamped nodes", SET_NAME, None)
    contact_right: MatrixName | None = key("contact nodes on the side of the next blade", SET_NAME, None)
    contact_left: MatrixName | None = key("the opposite contact nodes", SET_NAME, None)
    tip: MatrixName | None = key("the loaded and observed node", SET_NAME, None)


class Model(Section):
    """[model]: matrices of one sector from another program."""

    stiffness: FileName = key("file with the stiffness matrix, relative to the scene file", MATRIX)
    mass: FileName = key("file with the mass matrix, relative to the scene file", MATRIX)
    nodes: FileName = key("table of the nodes: node, x, y, z, sets and more", TABLE)
    dofs: FileName | None = key(
        "table of the dofs of the rows: node, component; by default as the files of the matrices say, or three a "
        "node in the order of the nodes",
        f"{TABLE} or a file .dof of CalculiX",
        None,
    )
    stiffness_name: MatrixName | None = key("name of the stiffness in a file with several matrices", "a name", None)
    mass_name: MatrixName | None = key("name of the mass in a file with several matrices", "a name", None)
    n_blades: Whole = key("blades of the ring", BLADES, ge=3, le=10000)
    unit: LengthUnit = key("units of all files, as in [mesh]: mm goes with newtons and tonnes", UNIT, "m")
    axis: EngineAxis = key(
        "engine axis in the axes of the nodes",
        AXIS,
        "x",
    )
    axis_point: AxisPoint = key("a point of the engine axis, in the unit of the files", AXIS_POINT, (0.0, 0.0, 0.0))
    tolerance: Length | None = key(
        "largest distance of a contact node from its partner, in the face and the unit of the files; by default a "
        "quarter of the distance between contact nodes",
        LENGTH,
        None,
    )
    speed_rpm: Number = key(
        "speed that the stiffness holds at, rev/min; 0: at rest", "a number, 0 to 1e6", 0.0, ge=0.0, le=1e6
    )
    centrifugal: FileName | None = key(
        "file with the centrifugal force at 1 rad/s; by default it is computed from the mass", MATRIX, None
    )
    reduced: Truth = key("whether the matrices are those of a reduced model", "true or false", False)
    transformation: FileName | None = key(
        "file with the displacements of the dofs for unit coordinates of a reduced model", MATRIX, None
    )
    sets: ModelSets = key("sets of the table of nodes by what they are", "a table [model.sets]", ModelSets())

    @property
    def files(self) -> dict[str, str]:
        """The files by key."""
        return {name: value for name in FILES if (value := getattr(self, name)) is not None}

    def placed(self, folder: Path) -> Model:
        """The section with full paths of its files, which are relative to a folder."""
        return self.model_copy(update={name: os.path.abspath(folder / value) for name, value in self.files.items()})

"""[model] of a scene: stiffness and mass from the files of another program; what does not go with them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from pipeline.errors import InputError, input_error, shown, shown_file
from pipeline.scene.fields import (
    AxisPoint,
    EngineAxis,
    Length,
    LengthUnit,
    Meaning,
    Number,
    Section,
    Truth,
    Whole,
    allowed_of,
    key,
)
from pipeline.scene.input_files import file_problem

if TYPE_CHECKING:
    from pipeline.scene.reading import Member, SceneFile


TABLE = "the name of a CSV file"
FileName = Annotated[str, Field(min_length=1, max_length=1000)]
MatrixFile = Annotated[
    FileName, "the name of a file .mtx, .sti, .mas, .mat, .op4, .pch, .dmig, .bdf, .dat, .inp or .full"
]
MatrixName = Annotated[str, Field(min_length=1, max_length=200), "a name"]
SetName = Annotated[str, Field(min_length=1, max_length=200), "a name in the column sets of the table of nodes"]
FILES = ("stiffness", "mass", "nodes", "dofs", "centrifugal", "transformation")


class ModelSets(Section):
    """[model.sets]: sets of the table of nodes by their names there, where they are others than the keys."""

    root: SetName | None = key("clamped nodes", None)
    contact_right: SetName | None = key("contact nodes on the side of the next blade", None)
    contact_left: SetName | None = key("the opposite contact nodes", None)
    tip: SetName | None = key("the loaded and observed node", None)


class Model(Section):
    """[model]: matrices of one sector from another program."""

    stiffness: MatrixFile = key("stiffness matrix; one half is enough")
    mass: MatrixFile = key("mass matrix")
    nodes: Annotated[FileName, TABLE] = key("table of the nodes: node, x, y, z, sets and more")
    dofs: FileName | None = key(
        "dofs of the rows: node, component (1, 2, 3 or x, y, z; 4, 5, 6 or rx, ry, rz; 0: a generalised "
        "coordinate), optional row from 1; none: as the matrices say, or three a node",
        None,
        allowed=f"{TABLE} or a file .dof of CalculiX",
    )
    stiffness_name: MatrixName | None = key(
        "name of the stiffness in a file with several matrices; by default K, KAA, KAAX, KGG, stiffness, ...", None
    )
    mass_name: MatrixName | None = key(
        "name of the mass in a file with several matrices; by default M, MAA, MAAX, MGG, mass, ...", None
    )
    n_blades: Whole = key("blades of the ring", ge=3, le=10000)
    unit: LengthUnit = key("units of all files, as in [mesh]: mm goes with newtons and tonnes", "m")
    axis: EngineAxis = key("engine axis in the axes of the nodes", "x")
    axis_point: AxisPoint = key("a point of the engine axis, in the unit of the files", (0.0, 0.0, 0.0))
    tolerance: Length | None = key(
        "largest distance of partners in the face, in the unit of the files; by default a quarter of that between "
        "contact nodes",
        None,
    )
    speed_rpm: Annotated[Number, Meaning("rev/min")] = key(
        "speed that the stiffness holds at, prestressed, with spin softening, rev/min; 0: at rest",
        0.0,
        ge=0.0,
        le=1e6,
    )
    centrifugal: MatrixFile | None = key(
        "centrifugal force at 1 rad/s, a number for each row; none: computed from the mass",
        None,
    )
    reduced: Truth = key("whether the matrices are those of a superelement: nothing is reduced any more", False)
    transformation: MatrixFile | None = key("displacements of the dofs for unit coordinates of a reduced model", None)
    sets: Annotated[ModelSets, Meaning(swept=False)] = key(
        "sets of the table of nodes by what they are", ModelSets(), allowed="a table [model.sets]"
    )

    @property
    def files(self) -> dict[str, str]:
        """The files by key."""
        return {name: value for name in FILES if (value := getattr(self, name)) is not None}

    def placed(self, folder: Path) -> Model:
        """The section with full paths of its files, which are relative to a folder."""
        return self.model_copy(update={name: os.path.abspath(folder / value) for name, value in self.files.items()})


_BESIDE = ("blade", "shroud", "snubber", "platform", "damper", "disk", "materials", "mesh")


def unfit_beside_matrices(file: SceneFile) -> Iterator[InputError]:
    """Sections and keys that do not go with matrices, of the first member."""
    scene = file.first
    for section in _BESIDE:
        if getattr(scene, section):
            yield input_error(file.path, section, "given beside [model]", "one of the two")
    if scene.punch_key and scene.material is None:
        allowed = "numbers (the punch formula needs [material])"
        yield input_error(file.path, scene.punch_key, '"punch"', allowed)
    if "equilibrium" in scene.load.model_fields_set:
        allowed = "nothing with [model]: without elements no static equilibrium is computed"
        yield input_error(file.path, "load.equilibrium", shown(scene.load.equilibrium), allowed)


def unfit_matrix_keys(path: Path, member: Member) -> Iterator[InputError]:
    """Keys of a member that do not fit its matrices, and files that are not there."""
    scene, model = member.scene, member.scene.model
    assert model is not None
    rom = scene.rom
    if "contact_dofs" in rom.model_fields_set and rom.contact_dofs != "nodal":
        allowed = '"nodal" with [model]: averages over a face need its elements'
        yield input_error(path, member.key_in_file("rom.contact_dofs"), shown(rom.contact_dofs), allowed)
    if model.transformation is not None and not model.reduced:
        allowed = "nothing without reduced = true"
        yield input_error(path, member.key_in_file("model.transformation"), shown(model.transformation), allowed)
    if model.reduced:
        yield from _unfit_loads_of_superelement(path, member)
    speed = scene.load.speed_rpm
    if speed != 0.0 and speed != model.speed_rpm:
        other = f" or {model.speed_rpm:g}" if model.speed_rpm else ""
        allowed = f"0{other}, the speed that the stiffness of [model] holds at (model.speed_rpm)"
        yield input_error(path, member.key_in_file("load.speed_rpm"), shown(speed), allowed)
    for name, file in model.files.items():
        if problem := file_problem(Path(file), allowed_of(Model, name)):
            place = member.key_in_file(f"model.{name}")
            yield input_error(path, place, f"{shown_file(file)}: {problem}")


def _unfit_loads_of_superelement(path: Path, member: Member) -> Iterator[InputError]:
    """Loads and outputs on nodes, whose displacements a superelement may not have."""
    scene, allowed = member.scene, "nothing with model.reduced: the force at excitation.at, or forces on modes"
    given = {
        "excitation.load": any(load.mode is None for load in scene.excitation.load),
        "load.force": bool(scene.load.force),
        "load.pressure": bool(scene.load.pressure),
        "load.temperature": scene.load.temperature is not None,
        "output": any(not output.of_model for output in scene.output),
    }
    for place, is_given in given.items():
        if is_given:
            yield input_error(path, place, "loads or outputs on nodes", allowed)

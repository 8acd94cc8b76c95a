"""[mesh] of a scene: hexahedra made here, or a mesh from a file, and whether the file is there."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator

from pipeline.errors import input_error, shown_file, system_reason
from pipeline.scene.fields import (
    AxisPoint,
    EngineAxis,
    Length,
    LengthUnit,
    Meaning,
    Number,
    Section,
    Whole,
    allowed_of,
    key,
)
from pipeline.scene.input_files import file_parts, file_problem

if TYPE_CHECKING:
    from pipeline.scene.reading import Member


SUFFIXES = (".inp", ".bdf", ".dat", ".nas", ".cdb", ".msh", ".vtu", ".med")


def check_mesh_file(path: Path, member: Member) -> None:
    """Refuse a mesh file that is not there or cannot be read, and files it includes that are not there."""
    file = member.scene.mesh_file
    assert file is not None
    place, allowed = member.key_in_file("mesh.file"), f"a readable mesh file ({', '.join(SUFFIXES)})"
    if problem := file_problem(Path(file), allowed, SUFFIXES):
        raise input_error(path, place, f"{shown_file(file)}: {problem}")
    try:
        parts = file_parts(file)
    except OSError as error:
        raise input_error(
            path, place, f"{shown_file(file)}: cannot be read: {system_reason(error)}", allowed
        ) from None
    for part in parts[1:]:
        if problem := file_problem(part, "a file that can be read"):
            raise input_error(path, place, f"{shown_file(file)} includes {part}: {problem}")


MAIN_INTERFACE = "shroud"
SetName = Annotated[str, Field(min_length=1, max_length=200), "the name of a node set or surface of the file"]


class MeshSets(Section):
    """[mesh.sets]: node sets or surfaces of a mesh file by their names there; one without a name is looked for."""

    root: SetName | None = key("the clamped root", None)
    contact_right: SetName | None = key("contact face on the side of the next blade", None)
    contact_left: SetName | None = key("the opposite contact face", None)
    tip: SetName | None = key("the loaded and observed point", None)
    cyclic_right: SetName | None = key(
        "cut face of a disk on the side of the next blade; by default found by its name", None
    )
    cyclic_left: SetName | None = key("the opposite cut face", None)


ContactGrid = Annotated[
    tuple[Annotated[Whole, Field(ge=1, le=15)], Annotated[Whole, Field(ge=1, le=15)]], "two whole numbers, {bounds}"
]


class MeshInterface(Section):
    """[mesh.interface.NAME]: two faces of a mesh file that touch, or one that touches the ground."""

    right: SetName = key("one face; between neighbours that on the side of the next blade")
    left: SetName | None = key("the face that it touches; none against the ground", None)
    kind: Literal["neighbours", "inside", "ground"] = key(
        "whether the left face is that of the next blade, of the same sector, or ground",
        "neighbours",
    )
    contact_grid: ContactGrid | None = key(
        "contact nodes of each plane patch of the faces along t1 and t2; by default as in [mesh]", None
    )


class Mesh(Section):
    """[mesh]: hexahedra made here, or a mesh from a file, and the grid of contact nodes."""

    file: Annotated[
        Annotated[str, Field(min_length=1, max_length=1000)] | None, Meaning(symbol="mesh", role="design")
    ] = key(
        "mesh of one sector from another program, in place of [blade], [shroud], size, element and grading",
        None,
        allowed="the name of a mesh file (.inp, .bdf, .cdb, .msh, .vtu, .med)",
    )
    size: Annotated[Length | None, Meaning("m", "mesh size", words="elementsize meshsize")] = key(
        "element size, m; required without a file", None, validate_default=True
    )
    element: Literal["hex20", "hex8", "hex27"] = key(
        "finite element; hex8 only for quick looks: far too stiff in bending", "hex20"
    )
    contact_grid: Annotated[ContactGrid, Meaning(discrete=True)] = key(
        "contact nodes along the segment and along the radius", (3, 3)
    )
    grading: Annotated[Number, Meaning(symbol="mesh grading")] = key(
        "how many times thinner the airfoil's layers are at root and shroud than at mid span; 1: all alike",
        4.0,
        ge=1.0,
        le=100.0,
    )
    n_blades: Annotated[Annotated[Whole, Field(ge=3, le=10000)] | None, Meaning(role="design")] = key(
        "blades of the ring; required with a file", None, validate_default=True
    )
    unit: LengthUnit = key(
        "system of units of the file, by length, or by length, mass and time",
        "m",
    )
    axis: EngineAxis = key("engine axis in the file; it becomes the axis x of the program", "x")
    axis_point: AxisPoint = key("a point of the engine axis, in the unit of the file", (0.0, 0.0, 0.0))
    tolerance: Length | None = key(
        "largest distance between a contact face and that of the neighbour, in the unit of the file; by default 5 % "
        "of the size of the face",
        None,
    )
    bore: Literal["clamped", "free"] = key(
        "whether the root of a mesh from a file is held; free: of a disk alone", "clamped"
    )
    other_faces: Literal["ask", "free", "cut"] = key(
        "surfaces that one pitch turns into each other and that mesh.sets does not name: an error, free surfaces, "
        "or cut faces of a disk",
        "ask",
    )
    sets: Annotated[MeshSets, Meaning(swept=False)] = key(
        "sets of the file by what they are", MeshSets(), allowed="a table [mesh.sets]"
    )
    interface: Annotated[dict[str, MeshInterface], Meaning(swept=False)] = key(
        "contact interfaces of the file by name, beside that of mesh.sets, shroud",
        {},
        allowed="tables [mesh.interface.NAME]",
    )

    @field_validator("size", "n_blades")
    @classmethod
    def _given_where_needed(cls, value: Any, info: ValidationInfo) -> Any:
        """The element size for a mesh made here, the number of blades for a mesh from a file."""
        if value is None and "file" in info.data:
            if info.field_name == "size" and info.data["file"] is None:
                raise ValueError(allowed_of(cls, "size"))
            if info.field_name == "n_blades" and info.data["file"] is not None:
                raise ValueError(allowed_of(cls, "n_blades"))
        return value

    @field_validator("size", "element", "grading")
    @classmethod
    def _of_a_mesh_made_here(cls, value: Any, info: ValidationInfo) -> Any:
        if value != _default(cls, info) and info.data.get("file") is not None:
            raise ValueError("nothing beside mesh.file, whose elements are used as they are")
        return value

    @field_validator(
        "n_blades", "unit", "axis", "axis_point", "tolerance", "bore", "other_faces", "sets", "interface"
    )
    @classmethod
    def _of_a_file(cls, value: Any, info: ValidationInfo) -> Any:
        if value != _default(cls, info) and "file" in info.data and info.data["file"] is None:
            raise ValueError("nothing without mesh.file")
        return value

    def __hash__(self) -> int:
        """Of all values: the tables by name have none."""
        return hash(self.model_dump_json())

    @property
    def interfaces(self) -> tuple[str, ...] | None:
        """Names of the contact interfaces, where any is named in a table of its own."""
        shroud = self.sets.contact_right is not None or self.sets.contact_left is not None
        return (*((MAIN_INTERFACE,) if shroud else ()), *self.interface) if self.interface else None


def _default(section: type[Section], info: ValidationInfo) -> Any:
    """The default of the key that is validated: a scene that has been written with all its values is read again."""
    return section.model_fields[info.field_name or ""].default

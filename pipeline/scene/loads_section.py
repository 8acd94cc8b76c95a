"""Loads and outputs of a scene as lists of tables: [[excitation.load]], [[load.pressure]], [[output]]; and their CSV
files of nodal forces and temperatures, a row for each node, found by its number or its position.
"""

from __future__ import annotations

import csv
import math
import os
import re
from array import array
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator

from pipeline.errors import InputError, shown, system_reason
from pipeline.scene.fields import (
    Meaning,
    NotNegative,
    Number,
    Positive,
    Section,
    Truth,
    Usual,
    Vector,
    Whole,
    allowed_of,
    key,
)
from pipeline.scene.input_files import Contents, csv_rows, decimal_point, file_problem, read_bytes

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


LARGEST_FILE = 200_000_000
COMMENT = re.compile(r"^[ \t]*#.*$", re.MULTILINE)
NO_WORDS: Mapping[str, str] = {}
POSITION = ("x", "y", "z")
NODE = ("node", *POSITION)
REAL, PARTS = ("fx", "fy", "fz"), ("fx_re", "fx_im", "fy_re", "fy_im", "fz_re", "fz_im")
TEMPERATURE = ("temperature",)


@dataclass(frozen=True)
class NodalTable:
    """Values on nodes."""

    path: str  # the file
    # (k,), points of the mesh by their numbers in mesh.vtu, from 0; None: by position
    nodes: NDArray[np.int64] | None
    positions: NDArray[np.float64] | None  # (k, 3), positions, m
    # (k, 3), forces, N, complex where the file has parts _re and _im
    values: NDArray[np.float64] | NDArray[np.complex128]


def force_table(file: str, contents: Contents | None = None) -> NodalTable:
    """Forces on nodes from a CSV file; `contents`: hashes of input files, where they are known.

    Columns: `node`, or `x`, `y`, `z`; then `fx`, `fy`, `fz`, or `fx_re`, `fx_im`, ... for complex forces. A component
    that has no column is zero.
    """
    import numpy as np

    columns = csv_columns(file, (*NODE, *REAL, *PARTS), contents)
    count = len(next(iter(columns.values())))
    parts = any(name in columns for name in PARTS)
    if parts and any(name in columns for name in REAL):
        raise _refused(file, "columns of real and of complex forces", "fx, fy, fz or fx_re, fx_im, ...")
    zero = np.zeros(count)

    def column(name: str) -> NDArray[np.float64]:
        return columns.get(name, zero)

    if parts:
        forces = [column(f"{name}_re") + 1j * column(f"{name}_im") for name in REAL]
    else:
        forces = [column(name) for name in REAL]
    if not any(name in columns for name in (*REAL, *PARTS)):
        raise _refused(file, "no forces", "columns fx, fy, fz or fx_re, fx_im, ...")
    return _table(file, columns, np.stack(forces, axis=1))


def temperature_table(file: str, contents: Contents | None = None) -> NodalTable:
    """Temperatures of nodes from a CSV file with the columns `node`, or `x`, `y`, `z`, and `temperature`."""
    columns = csv_columns(file, (*NODE, *TEMPERATURE), contents)
    if "temperature" not in columns:
        raise _refused(file, "no temperatures", "a column temperature")
    return _table(file, columns, columns["temperature"])


def check_readable(file: str) -> None:
    """Refuse a file that is not there or too large. Raises InputError."""
    path = Path(file)
    if problem := file_problem(path, "a readable CSV file"):
        raise InputError(f"{file}: {problem}")
    if path.stat().st_size > LARGEST_FILE:
        raise _refused(file, f"larger than {LARGEST_FILE} bytes", "a smaller CSV file")


def _table(file: str, columns: dict[str, NDArray[np.float64]], values: NDArray[np.float64]) -> NodalTable:
    import numpy as np

    if "node" in columns:
        numbers = columns["node"]
        if np.any(numbers % 1.0) or np.any(numbers < 0.0):
            raise _refused(file, "a node that is not a whole number", "numbers of points in mesh.vtu, from 0")
        return NodalTable(file, numbers.astype(np.int64), None, values)
    if not all(name in columns for name in POSITION):
        raise _refused(file, "neither node nor x, y, z", "a column node, or columns x, y and z (m)")
    return NodalTable(file, None, np.stack([columns[name] for name in POSITION], axis=1), values)


def csv_columns(
    file: str, known: tuple[str, ...], contents: Contents | None, words: Mapping[str, str] = NO_WORDS
) -> dict[str, NDArray[np.float64]]:
    """The columns of a file as numbers; `known`: their names, `words` stand for numbers. Raises InputError.

    Lines that begin with # are comments.
    """
    import numpy as np

    check_readable(file)
    try:
        text = read_bytes(file, contents or {}).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise _refused(file, f"not UTF-8 text (byte {error.start})", "a CSV file") from None
    except OSError as error:
        raise _refused(file, f"cannot be read: {system_reason(error)}", "a CSV file") from None
    names: list[str] = []
    numbers = array("d")  # row by row: lists of texts and numbers take 60 times as much memory as the file
    try:
        for number, row in csv_rows(COMMENT.sub("", text)):
            if names and any(row):
                numbers.extend(
                    _numbers(file, number, [words.get(cell.strip().lower(), cell) for cell in row], len(names))
                )
            elif any(row):
                names = _names(file, row, known)
    except csv.Error as error:
        raise _refused(file, f"not CSV: {error}", "a CSV file") from None
    if not numbers:
        raise _refused(file, "no rows", "a line of column names, then lines of numbers")
    return dict(zip(names, np.array(numbers).reshape(-1, len(names)).T, strict=True))


def _names(file: str, row: list[str], known: tuple[str, ...]) -> list[str]:
    names = [cell.strip().lower() for cell in row]
    for name in names:
        if name not in known:
            raise _refused(file, f"column {shown(name)}", ", ".join(known))
    if len(set(names)) < len(names):
        raise _refused(file, "a column twice", "each column once")
    return names


def _numbers(file: str, line: int, row: list[str], count: int) -> list[float]:
    if len(row) != count:
        allowed = f"{count}, one for each column; decimal commas only with semicolons between"
        raise _refused(file, f"line {line}: {len(row)} values", allowed)
    try:
        numbers = [float(decimal_point(cell)) for cell in row]
    except ValueError:
        raise _refused(file, f"line {line}: {shown(','.join(row))}", "numbers") from None
    if not all(math.isfinite(number) and abs(number) <= 1e15 for number in numbers):
        raise _refused(file, f"line {line}: a number that is not finite or too large", "numbers up to 1e15")
    return numbers


def _refused(file: str, found: str, allowed: str) -> InputError:
    return InputError(f"{file}: {found}, allowed: {allowed}")


HIGHEST_HARMONIC = 31
DIRECTION = '"x", "y", "z", "-x", "-y", "-z" or a list of three numbers, {bounds}, not all 0'
NodeSet = Annotated[str, Field(min_length=1, max_length=200), "the name of a node set"]
Surface = Annotated[
    str, Field(min_length=1, max_length=200), "the name of a surface or of a node set that holds whole element faces"
]
File = Annotated[str, Field(min_length=1, max_length=1000), "the name of a CSV file"]
Direction = Annotated[Literal["x", "-x", "y", "-y", "z", "-z"] | Vector, DIRECTION]
Point = Annotated[
    Literal["tip"] | Vector, '"tip" or a list of three numbers, {bounds}: x, y and z of a point of the blade'
]
Value = Annotated[Number, Field(ge=-1e15, le=1e15)]
Angle = Annotated[Number, Field(ge=-1e6, le=1e6)]
Harmonic = Annotated[Whole, Field(ge=1, le=HIGHEST_HARMONIC)]


SETS = {  # node sets and surfaces of a blade made here; those of further sections
    "": (
        *("contact_left", "contact_right", "face_left", "face_right", "leading_edge", "pressure_side", "root"),
        *("suction_side", "tip", "tip_surface", "trailing_edge"),
    ),
    "disk": ("bore", "cyclic_left", "cyclic_right", "rim"),
    "snubber": ("snubber",),
    "platform": ("platform",),
}


def unit_vector(direction: Direction) -> tuple[float, float, float]:
    """A direction as a vector of length 1; three zeros where it is zero."""
    if isinstance(direction, str):
        sign = -1.0 if direction.startswith("-") else 1.0
        x, y, z = (sign if direction[-1] == axis else 0.0 for axis in "xyz")
        return x, y, z
    largest = max(abs(c) for c in direction)
    if largest == 0.0:
        return 0.0, 0.0, 0.0
    scaled = [c / largest for c in direction]  # so that no square over- or underflows
    length = sum(c * c for c in scaled) ** 0.5
    return scaled[0] / length, scaled[1] / length, scaled[2] / length


def _one_of(value: Any, info: ValidationInfo, names: tuple[str, ...]) -> Any:
    """The last of some keys, of which one is to be given."""
    given = [name for name in names if info.data.get(name) is not None]
    given += [str(info.field_name)] if value is not None else []
    if len(given) != 1 and all(name in info.data for name in names):
        said = " and ".join(given) if given else "none"
        raise ValueError(f"one of {', '.join((*names, str(info.field_name)))} (given: {said})")
    return value


def _not_zero(section: type[Section], value: Any) -> Any:
    if isinstance(value, tuple) and not any(value):
        raise ValueError(allowed_of(section, "direction").removesuffix(', or "magnitude"'))
    return value


class ExcitationHarmonic(Section):
    """[[excitation.harmonic]]: a multiple of the engine order."""

    order: Harmonic = key("multiple h of the engine order")
    amplitude: NotNegative = key("amplitude relative to that of excitation.force", 1.0)
    phase: Angle = key("phase, degrees: force amplitude cos(h w t + phase)", 0.0)


class ExcitationOrder(Section):
    """[[excitation.order]]: an engine order of [crossings] with its force."""

    order: Annotated[Whole, Field(ge=1, le=100000)] = key("engine order")
    force: NotNegative | None = key(
        "amplitude in place of excitation.force, N; 0: the order is skipped; none: excitation.force times `scale`",
        None,
    )
    scale: NotNegative | None = key(
        "factor of excitation.force, and so of the pressures and forces of [[excitation.load]]; none: 1",
        None,
        allowed="a number, {bounds} (give this or force)",
    )

    @field_validator("scale")
    @classmethod
    def _one_amplitude(cls, value: Any, info: ValidationInfo) -> Any:
        if value is not None and info.data.get("force") is not None:
            raise ValueError(allowed_of(cls, "scale"))
        return value


class ExcitationLoad(Section):
    """[[excitation.load]]: where the excitation acts, in place of the point excitation.at."""

    at: Point | None = key("a point, m: its nearest mesh vertex", None)
    set: NodeSet | None = key("the nodes of a set", None)
    surface: Surface | None = key("a pressure on a surface", None)
    file: File | None = key("forces on nodes, real or complex; relative to the scene file", None)
    mode: Annotated[Whole, Field(ge=1, le=1000)] | None = key(
        "a modal force on a mode with free contacts; above 0 the largest output is positive",
        None,
        validate_default=True,
    )
    direction: Direction | None = key(
        "direction of the force at a point or on a set; else excitation.direction", None
    )
    amplitude: Value = key(
        "for 1 N of excitation.force: N at a point or on a set, Pa on a surface, N / sqrt(kg) on a "
        "mass-normalised mode, a factor of a file; with force = 1 absolute",
        1.0,
    )
    phase: Angle = key("phase, degrees", 0.0)
    harmonic: Harmonic = key(
        "harmonic of the excitation; those without loads have the pattern of harmonic 1",
        1,
    )
    share: Literal["total", "each"] = key("whether the nodes of a set share the force or each has it", "total")

    @field_validator("mode")
    @classmethod
    def _one_place(cls, value: Any, info: ValidationInfo) -> Any:
        return _one_of(value, info, ("at", "set", "surface", "file"))

    @field_validator("direction")
    @classmethod
    def _some_direction(cls, value: Any) -> Any:
        return _not_zero(cls, value)


class StaticForce(Section):
    """[[load.force]]: a static force."""

    at: Point | None = key("a point, m: its nearest mesh vertex", None)
    set: NodeSet | None = key("the nodes of a set", None)
    file: File | None = key("forces on nodes, N; relative to the scene file", None, validate_default=True)
    force: Value = key("N; a factor of a file", 1.0)
    direction: Direction = key("direction of the force at a point or on a set", "y")
    share: Literal["total", "each"] = key("whether the nodes of a set share the force or each has it", "total")

    @field_validator("file")
    @classmethod
    def _one_place(cls, value: Any, info: ValidationInfo) -> Any:
        return _one_of(value, info, ("at", "set"))

    @field_validator("direction")
    @classmethod
    def _some_direction(cls, value: Any) -> Any:
        return _not_zero(cls, value)


class Pressure(Section):
    """[[load.pressure]]: a static pressure of the gas."""

    surface: Surface = key("the loaded surface")
    pressure: Value = key("Pa, above 0 towards the body")


class Temperature(Section):
    """[load.temperature]: a temperature field; a material has an expansion coefficient, or a table over it."""

    uniform: Angle | None = key("temperature of the whole blade, degrees C or K as `reference`", None)
    linear: tuple[Angle, Angle] | None = key(
        "temperatures at the innermost and the outermost radius, linear between",
        None,
        allowed="two numbers, -1e6 to 1e6, and nothing beside uniform",
    )
    file: File | None = key("temperatures of nodes: a column `temperature`; relative to the scene file", None)
    of_mesh: Truth | None = key(
        "true: the temperatures of the nodes that the mesh file gives", None, validate_default=True
    )
    reference: Angle = key("temperature without thermal stress", 20.0)

    @field_validator("of_mesh")
    @classmethod
    def _one_field(cls, value: Any, info: ValidationInfo) -> Any:
        return _one_of(value or None, info, ("uniform", "linear", "file"))


class Output(Section):
    """[[output]]: a quantity that is recorded at every point of the curves."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,39}$")] = key(
        "name in the result files: columns amplitude_NAME, datasets output_NAME",
        allowed="letters, digits and '_', beginning with a letter, 40 at most",
    )
    at: Point | None = key("a point, m: its nearest mesh vertex; of a strain the point itself", None)
    set: NodeSet | None = key("mean displacement of the nodes of a set", None, validate_default=True)
    direction: Direction | Literal["magnitude"] = key(
        "component of the displacement, or its length; direction of a strain",
        "y",
        allowed=f'{DIRECTION}, or "magnitude"',
    )
    quantity: Literal["displacement", "strain"] = key(
        "displacement (m), or strain of a gauge at the point along the direction, thermal strain included",
        "displacement",
    )

    @field_validator("set")
    @classmethod
    def _one_place(cls, value: Any, info: ValidationInfo) -> Any:
        if value is not None and info.data.get("at") is not None:
            raise ValueError("nothing beside at")
        return value

    @field_validator("direction")
    @classmethod
    def _some_direction(cls, value: Any) -> Any:
        return _not_zero(cls, value)

    @field_validator("quantity")
    @classmethod
    def _strain_at_a_point(cls, value: Any, info: ValidationInfo) -> Any:
        at, direction = info.data.get("at"), info.data.get("direction")
        if value == "strain" and (at is None or at == "tip" or direction == "magnitude"):
            raise ValueError('"displacement"; "strain" with a point at = [x, y, z] and a direction')
        return value

    @property
    def of_model(self) -> bool:
        """Whether it is an output that the reduced model has already, by its name."""
        return self.at is None and self.set is None

    @property
    def unit(self) -> str:
        """Unit of its values."""
        return "m" if self.quantity == "displacement" else "1"

    @property
    def unit_said(self) -> str:
        """That unit as it is printed: a strain is m/m."""
        return "m" if self.quantity == "displacement" else "m/m"


def placed(section: Any, names: tuple[str, ...], folder: Path) -> Any:
    """A section with the full paths of the files of its lists of tables (and tables) `names`."""

    def full(item: Any) -> Any:
        file = getattr(item, "file", None)
        return item if file is None else item.model_copy(update={"file": os.path.abspath(folder / file)})

    changed = {}
    for name in names:
        value = getattr(section, name)
        if value:
            changed[name] = tuple(full(item) for item in value) if isinstance(value, tuple) else full(value)
    return section.model_copy(update=changed) if changed else section


def files_of(*values: Any) -> list[str]:
    """The files of lists of tables, or of a table."""
    items = [item for value in values if value for item in (value if isinstance(value, tuple) else (value,))]
    return [item.file for item in items if getattr(item, "file", None) is not None]


class Load(Section):
    """[load]: static loads."""

    speed_rpm: Annotated[Number, Meaning("rev/min", "speed", words="rpm speed omega rotation rotationalspeed")] = key(
        "rotational speed, rev/min: static displacement under the centrifugal load, stiffness about it; 0: none",
        0.0,
        ge=0.0,
        le=1e6,
    )
    equilibrium: Literal["nonlinear", "linear"] = key(
        "static equilibrium at speed: at large displacements, or linear",
        "nonlinear",
    )
    coriolis: Truth = key(
        "whether Coriolis forces act in the vibration at speed, where the model has their matrix", True
    )
    force: Annotated[tuple[StaticForce, ...], Meaning(swept=False)] = key(
        "static forces", (), allowed="tables [[load.force]]"
    )
    pressure: Annotated[tuple[Pressure, ...], Meaning(swept=False)] = key(
        "static pressures", (), allowed="tables [[load.pressure]]"
    )
    temperature: Annotated[Temperature | None, Meaning(swept=False)] = key(
        "temperature field", None, allowed="a table [load.temperature]"
    )

    temperature_factor: Annotated[Number, Meaning(symbol="temperature factor", uncertain=True)] = key(
        "factor of the temperature field above its reference: 0 is cold, 1 as given", 1.0, ge=0.0, le=10.0
    )

    def placed(self, folder: Path) -> Load:
        """The section with the full paths of its files, which are relative to the folder."""
        found: Load = placed(self, ("force", "temperature"), folder)
        return found


class Excitation(Section):
    """[excitation]: an engine order and its multiples, forces on a point or on loads of the blade."""

    engine_order: Annotated[
        Whole,
        Meaning(
            symbol="engine order",
            usual=Usual(0.0, 1e3, "it is the number of force maxima around the ring"),
            words="eo engineorders",
            short="EO",
            discrete=True,
        ),
    ] = key(
        "engine order: a wave against the rotation, above half the number of blades with it",
        ge=0,
        le=100000,
    )
    force: Annotated[
        Positive,
        Meaning(
            "N",
            "force",
            Usual(1e-6, 1e5, "the key is in N, the force on one blade", most=1e10),
            words="f0 amplitude forceamplitude",
            solver="force",
            searched="decade",
            decades=2.0,
        ),
    ] = key("amplitude on one blade, N")
    direction: Direction = key("direction of the force and of the default output", "y")
    at: Annotated[Point, Meaning("m")] = key("loaded and observed point, m: the nearest mesh node", "tip")

    harmonic: Annotated[tuple[ExcitationHarmonic, ...], Meaning(swept=False)] = key(
        "multiples of the engine order that act as well",
        (),
        allowed="tables [[excitation.harmonic]], each order once",
    )
    load: Annotated[tuple[ExcitationLoad, ...], Meaning(swept=False)] = key(
        "where the force acts, in place of `at`", (), allowed="tables [[excitation.load]]"
    )
    order: Annotated[tuple[ExcitationOrder, ...], Meaning(swept=False)] = key(
        "engine orders of [crossings] with their forces; none: `engine_order` with `force`",
        (),
        allowed="tables [[excitation.order]], each order once (a single one is excitation.engine_order)",
        max_length=100,
        exclude=True,  # a curve has one engine order: it does not depend on those of the table
    )

    @field_validator("harmonic", "order")
    @classmethod
    def _each_order_once(cls, value: Any, info: ValidationInfo) -> Any:
        orders = [item.order for item in value]
        if len(set(orders)) < len(orders):
            raise ValueError(allowed_of(cls, str(info.field_name)))
        return value

    @property
    def forces(self) -> dict[int, float]:
        """Force of each engine order of [crossings], N; those with a force of 0 are left out."""
        if not self.order:
            return {self.engine_order: self.force}
        given = {
            o.order: self.force * (1.0 if o.scale is None else o.scale) if o.force is None else o.force
            for o in self.order
        }
        return {order: force for order, force in given.items() if force > 0.0}

    @property
    def unit_direction(self) -> tuple[float, float, float]:
        """The direction as a vector of length 1 (three zeros where it is zero, which the checks refuse)."""
        return unit_vector(self.direction)

    @property
    def highest_harmonic(self) -> int:
        """The highest harmonic in which the excitation acts."""
        given = {item.order: item.amplitude for item in self.harmonic}
        acting = [h for h in {1, *given, *(item.harmonic for item in self.load)} if given.get(h, 1.0) != 0.0]
        return max(acting, default=1)

    def placed(self, folder: Path) -> Excitation:
        """The section with the full paths of its files, which are relative to the folder."""
        found: Excitation = placed(self, ("load",), folder)
        return found

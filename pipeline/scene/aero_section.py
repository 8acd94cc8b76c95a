"""[aero] of a scene: aerodynamic influence coefficients of mode families."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from pipeline.errors import InputError, input_error, shown
from pipeline.scene.fields import Meaning, Number, Section, Whole, key
from pipeline.scene.input_files import Contents
from pipeline.scene.loads_section import File, csv_columns, placed

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pipeline.scene.schema import Scene

Coefficient = Annotated[Number, Field(ge=-1.0, le=1.0)]
MOST = 10000  # places
Places = Annotated[tuple[Annotated[Whole, Field(ge=-MOST, le=MOST)], ...], Field(min_length=1, max_length=MOST)]
COLUMNS = ("offset", "nodal_diameter", "speed_rpm", "frequency", "real", "imaginary")
PHASE = "phase_angle"  # column in place of nodal_diameter: inter-blade phase angle, degrees, forward waves positive
DAMPING = {"damping_ratio": -2.0, "log_decrement": -1.0 / math.pi}  # columns in place of imaginary: that over these
VALUES_OF = ("real", "imaginary")
AXES = ("speed_rpm", "frequency")  # of a table
VALUES = "a list of numbers, -1 to 1, one for each offset or nodal diameter"
ROWS = "a list of numbers, 0 to 1e6, one for each offset or nodal diameter"
SAME_ANGLE, SAME_VALUE = 0.1, 1e-6  # of the mean angle between two waves; relative
KEYS_OF = {"nodal_diameter", *AXES}
ON_RING = 0.02  # of the angle between two waves: angles are given with a few digits
Numbers = Annotated[tuple[Annotated[Number, Field(ge=0.0, le=1e6)], ...], Field(min_length=1, max_length=MOST)]


class AeroFamily(Section):
    """[[aero.family]]: aerodynamic influence coefficients of one mode family, or their sums for each wave."""

    mode: Whole = key("number of the mode with free contacts in its wave", ge=1, le=100)
    offset: Places | None = key(
        "places from the blade that feels the force to the one that moves, in +y",
        None,
        allowed="a list of whole numbers",
    )
    nodal_diameter: Places | None = key(
        "in place of offset: nodal diameters of the waves, above 0 backward, each one of the ring",
        None,
        allowed="a list of whole numbers (give this or offset)",
    )
    real: tuple[Coefficient, ...] = key(
        "modal force over modal displacement and the square of the natural frequency, in phase with the displacement",
        (),
        allowed=VALUES,
    )
    imaginary: tuple[Coefficient, ...] = key(
        "the same ahead of the displacement by a quarter of a period: above 0 the flow feeds the vibration",
        (),
        allowed=VALUES,
    )
    speed_rpm: Numbers | None = key(
        "speeds of the coefficients, rev/min; linear between them at load.speed_rpm", None, allowed=ROWS
    )
    frequency: Numbers | None = key(
        "frequencies of the coefficients, Hz; linear between them at the frequency of the family", None, allowed=ROWS
    )
    file: File | None = key(
        "in place of the lists: columns offset, nodal_diameter or phase_angle, real, and imaginary, damping_ratio "
        "or log_decrement, optional speed_rpm, frequency",
        None,
    )

    def read(self, contents: Contents | None = None) -> AeroFamily:
        """The family with the lists of its file, if it has one; `contents`: hashes of input files. InputError."""
        if self.file is None:
            return self
        columns = as_coefficients(self.file, csv_columns(self.file, (*COLUMNS, PHASE, *DAMPING), contents))
        places = [name for name in COLUMNS[:2] if name in columns]
        if len(places) != 1 or not all(name in columns for name in VALUES_OF):
            allowed = "offset, nodal_diameter or phase_angle; real and imaginary, damping_ratio or log_decrement"
            raise InputError(f"{self.file}: columns {', '.join(columns)}, allowed: {allowed}")
        if any(value % 1.0 or abs(value) > MOST for value in columns[places[0]]):
            raise InputError(f"{self.file}: {places[0]} that is no whole number, allowed: -{MOST} to {MOST}")
        if any(abs(value) > 1.0 for name in VALUES_OF for value in columns[name]):
            raise InputError(f"{self.file}: a coefficient beyond -1 to 1, allowed: parts of the squared frequency")
        if any(not 0.0 <= value <= 1e6 for name in AXES for value in columns.get(name, ())):
            raise InputError(f"{self.file}: speed_rpm or frequency beyond 0 to 1e6, allowed: rev/min and Hz")
        lists = {name: tuple(columns[name].tolist()) for name in (*AXES, *VALUES_OF) if name in columns}
        lists[places[0]] = tuple(int(value) for value in columns[places[0]])
        return self.model_copy(update=lists)

    def with_each_wave_once(self, blades: int) -> AeroFamily:
        """The family without waves that are given again with the same coefficients: -N/2 and N/2 are one wave."""
        if self.nodal_diameter is None:
            return self
        parts = [name for name in ("nodal_diameter", *AXES, *VALUES_OF) if getattr(self, name)]
        rows = list(zip(*(getattr(self, name) for name in parts), strict=True))
        once = list({(row[0] % blades, *row[1:]): row for row in reversed(rows)}.values())[::-1]
        return self.model_copy(update=dict(zip(parts, zip(*once, strict=True), strict=True)))

    @property
    def places(self) -> tuple[int, ...]:
        """Offsets, or nodal diameters."""
        return self.offset or self.nodal_diameter or ()

    def axes(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Speeds and frequencies of the table, ascending; () of what it does not depend on."""
        speeds, frequencies = (tuple(sorted(set(getattr(self, name) or ()))) for name in AXES)
        return speeds, frequencies

    def rows(self) -> dict[tuple[float, float], dict[int, complex]]:
        """The coefficients by place, for each speed and frequency, 0 for what they do not depend on."""
        count, found = len(self.places), dict[tuple[float, float], dict[int, complex]]()
        axes = (getattr(self, name) or (0.0,) * count for name in AXES)
        for place, speed, frequency, real, imaginary in zip(
            self.places, *axes, self.real, self.imaginary, strict=True
        ):
            found.setdefault((speed, frequency), {})[place] = complex(real, imaginary)
        return found


def as_coefficients(file: Path | str, columns: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Columns with coefficients by nodal diameter in place of damping by phase angle, as flow solvers give it.

    Im C = -2 zeta = -delta / pi; the phase angle of a forward wave is positive, its nodal diameter here negative.
    """
    found = dict(columns)
    given = [name for name in DAMPING if name in found]
    if len(given) + ("imaginary" in found) > 1:
        allowed = "one of imaginary, damping_ratio and log_decrement"
        raise InputError(f"{file}: columns {', '.join(columns)}, allowed: {allowed}")
    for name in given:
        found["imaginary"] = DAMPING[name] * found.pop(name)
        found.setdefault("real", 0.0 * found["imaginary"])
    return found if PHASE not in found else _by_nodal_diameter(file, found)


def _by_nodal_diameter(file: Path | str, columns: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Columns with nodal diameters in place of phase angles; angles a turn apart are one wave."""
    import numpy as np

    angle = columns.pop(PHASE)
    different = np.unique(angle % 360.0)
    gaps = np.diff(different, append=different[:1] + 360.0)
    waves = int(np.count_nonzero(gaps > SAME_ANGLE * 360.0 / len(different)))  # of the ring, each of which is given
    wave = angle * waves / 360.0
    if abs(wave - wave.round()).max(initial=0.0) > ON_RING:
        allowed = f"multiples of 360/{waves} degrees, for {waves} different angles: every wave of the ring once"
        raise InputError(f"{file}: {PHASE} {angle[abs(wave - wave.round()).argmax()]:g}, allowed: {allowed}")
    columns["nodal_diameter"] = (waves // 2 - wave.round()) % waves - waves // 2  # -waves / 2 and up
    given, first = [name for name in VALUES_OF if name in columns], dict[tuple[float, ...], int]()
    for row, place in enumerate(
        zip(*(columns[name] for name in COLUMNS if name in KEYS_OF & columns.keys()), strict=True)
    ):
        known = first.setdefault(place, row)
        if not all(math.isclose(columns[name][row], columns[name][known], rel_tol=SAME_VALUE) for name in given):
            said = f"{angle[known]:g} and {angle[row]:g} with different values"
            raise InputError(
                f"{file}: {PHASE} {said}, allowed: each wave once; angles 360 degrees apart are one wave"
            )
    return {name: values[list(first.values())] for name, values in columns.items()}


class Aero(Section):
    """[aero]: the flow around the blades, as forces on their modes."""

    family: Annotated[Annotated[tuple[AeroFamily, ...], Field(min_length=1)], Meaning(swept=False)] = key(
        "mode families that the flow acts on", allowed="tables [[aero.family]] with different modes"
    )
    scale: Number = key("factor on all coefficients", 1.0, ge=0.0, le=1000.0)

    def placed(self, folder: Path) -> Aero:
        """The section with the full paths of its files, which are relative to the folder of the scene."""
        found: Aero = placed(self, ("family",), folder)
        return found

    def scaled(self, contents: Contents | None = None) -> list[AeroFamily]:
        """The families with the lists of their files, all coefficients times the factor. InputError."""
        found = []
        for each in self.family:
            family = each.read(contents)
            lists = {name: tuple(self.scale * value for value in getattr(family, name)) for name in VALUES_OF}
            found.append(family.model_copy(update=lists))
        return found


def unfit_aero(path: Path, aero: Aero, scene: Scene, blades: int | None) -> Iterator[InputError]:
    """Mode families of [aero] whose places are not those of the ring."""
    if blades is None:
        yield input_error(path, "aero", "given", "nothing for a single structure: the flow acts on a ring of blades")
        return
    modes = [family.mode for family in aero.family]
    if len(set(modes)) < len(modes):
        yield input_error(path, "aero.family", f"modes {shown(modes)}", "tables [[aero.family]] with different modes")
    for number, given in enumerate(aero.family):
        place = f"aero.family[{number}]"
        if given.file is not None and (given.offset or given.nodal_diameter or given.real or given.imaginary):
            yield input_error(path, f"{place}.file", "given beside lists", "a file or lists")
        try:
            family = given.read(scene.contents)
        except InputError as error:
            yield InputError(f"{path}: {place}.file: {error}")
            continue
        places = family.offset or family.nodal_diameter
        if places is None or (family.offset is not None and family.nodal_diameter is not None):
            found = "missing" if places is None else "given beside offset"
            yield input_error(path, f"{place}.nodal_diameter", found, "offset or nodal_diameter, one of the two")
            continue
        name = "nodal_diameter" if family.offset is None else "offset"
        lists = {part: getattr(family, part) for part in ("real", "imaginary", "speed_rpm", "frequency")}
        wrong = {part: values for part, values in lists.items() if values is not None and len(values) != len(places)}
        for part, values in wrong.items():
            allowed = f"a list of {len(places)} numbers, one for each {name}"
            yield input_error(path, f"{place}.{part}", f"a list of {len(values)}", allowed)
        if not wrong:
            yield from _unfit_table(path, place, family, scene, blades)
            yield from _lost_stiffness(path, f"{place}.real", family, aero.scale, blades)


def _lost_stiffness(path: Path, place: str, family: AeroFamily, scale: float, blades: int) -> Iterator[InputError]:
    """Coefficients that take all stiffness of a wave: its blades bend without a limit, whatever their damping."""
    for row in family.rows().values():
        for n in range(blades):
            turns = {k: cmath.exp(2j * math.pi * n * k / blades) for k in row} if family.offset else {n: 1.0}
            taken = scale * sum((row.get(k, 0.0) * turn for k, turn in turns.items()), 0j).real
            if taken >= 1.0:
                allowed = f"less than 1 in every wave (aero.scale = {scale:g} included)"
                yield input_error(path, place, f"{taken:.3g} of the stiffness at nodal diameter {n}", allowed)
                return


def _unfit_table(path: Path, place: str, family: AeroFamily, scene: Scene, blades: int) -> Iterator[InputError]:
    """Places of a mode family that are missing or twice at a speed and frequency, and a speed beyond the table."""
    name = "nodal_diameter" if family.offset is None else "offset"
    family = family.with_each_wave_once(blades)
    (speeds, frequencies), rows = family.axes(), family.rows()
    every, points = {n % blades for n in family.places}, max(len(speeds), 1) * max(len(frequencies), 1)
    at_each = "" if points == 1 else ", at each speed and frequency"
    if len(every) * points != len(family.places) or any({n % blades for n in row} != every for row in rows.values()):
        said = shown(list(family.places)) if points == 1 else f"a table of {len(family.places)} rows"
        allowed = f"each of {blades} places once{at_each}"
        ends = blades // 2, -(blades // 2)
        if name == "nodal_diameter" and blades % 2 == 0 and set(ends) <= set(family.places):
            allowed += f"; {ends[0]} and {ends[1]} are one wave, with the same coefficients"
        yield input_error(path, f"{place}.{name}", said, allowed)
    elif family.offset is None and len(every) < blades:
        last = blades // 2
        allowed = f"each wave of {blades} blades once, {last - blades + 1} to {last} or 0 to {blades - 1}{at_each}"
        yield input_error(path, f"{place}.{name}", f"a list of {len(every)}", allowed)
    speed = scene.load.speed_rpm
    if speeds and not speeds[0] <= speed <= speeds[-1]:
        allowed = f"speeds on both sides of load.speed_rpm = {speed:g}"
        yield input_error(path, f"{place}.speed_rpm", f"{speeds[0]:g} to {speeds[-1]:g}", allowed)

"""Materials of Ansys archives: MP and MPDATA over MPTEMP, orthotropic ones and the systems that they stand in."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from geometry.mesh_files.file_mesh import FileMesh
from geometry.mesh_files.material_tables import Row, material_of_tables
from geometry.mesh_files.text_files import numbers
from geometry.sector import FloatArray

CONSTANTS = {
    "EX": "young_modulus", "EY": "young_modulus_2", "EZ": "young_modulus_3", "DENS": "density",
    "PRXY": "poisson_ratio", "PRXZ": "poisson_ratio_13", "PRYZ": "poisson_ratio_23",
    "GXY": "shear_modulus", "GXZ": "shear_modulus_13", "GYZ": "shear_modulus_23",
    "ALPX": "expansion", "ALPY": "expansion_2", "ALPZ": "expansion_3",
}  # fmt: skip
INSTANT = {"CTEX": "ALPX", "CTEY": "ALPY", "CTEZ": "ALPZ"}  # expansions at the temperature itself, for mean ones
MINOR = {"NUXY": ("PRXY", "EX", "EY"), "NUXZ": ("PRXZ", "EX", "EZ"), "NUYZ": ("PRYZ", "EY", "EZ")}
REFERENCE = "REFT"  # temperature from which expansions are mean ones
LABELS = (*CONSTANTS, *INSTANT, *MINOR, REFERENCE)
# those that an isotropic material has too, and with which they agree there
OF_AXES = {
    "EY": "EX",
    "EZ": "EX",
    "ALPY": "ALPX",
    "ALPZ": "ALPX",
    "PRXZ": "PRXY",
    "PRYZ": "PRXY",
    "GXZ": "GXY",
    "GYZ": "GXY",
}
MISFIT = 1e-3
USUAL_RATIO = 0.3  # of a material without one, in Ansys
OTHER_LAWS = ("ELAS", "ANEL", "HYPE", "BB", "AHYP", "USER", "SMA", "CAST", "GASK")
PLASTIC = ("BISO", "MISO", "BKIN", "KINH", "MKIN", "NLIS", "CHAB", "PLAS", "CREE", "PRON", "SDAM", "HILL")
UNITS = {"SI": "m", "MKS": "m", "MPA": "mm", "CGS": "cm-g-s", "BIN": "in", "BFT": "ft-lbf-s"}
COMMANDS = ("MP", "TB,", "/UNITS", "TREF", "LOCAL", "BF,", "BFUNIF", "TUNIF")
Values = dict[str, list[tuple[float | None, float]]]  # temperatures, None where there are none, and values by label


def add_materials(mesh: FileMesh, lines: list[str]) -> dict[int, FloatArray | None]:
    """Properties by the number of the material, units; axes of the systems, one a row, None of those that turn."""
    archive = _Archive(mesh)
    for line in lines:
        command = line[:8].upper()
        if command.startswith("MASCALE"):
            raise mesh.refuse(f"{line.strip()!r} scales the matrices: remove it and give the densities that it makes")
        if command.startswith(COMMANDS):
            archive.take(line)
    for material, values in archive.given.items():
        mesh.materials[material] = _material(mesh, material, values, archive.reference)
    return archive.systems


class _Archive:
    """What the commands of an archive say of materials, line by line."""

    def __init__(self, mesh: FileMesh) -> None:
        self.mesh = mesh
        self.given: dict[str, Values] = {}
        self.temperatures: dict[int, float] = {}
        self.reference = 0.0
        self.systems: dict[int, FloatArray | None] = {0: np.eye(3)}

    def take(self, line: str) -> None:
        """A command."""
        fields = [field.strip() for field in line.split("!")[0].split(",")]
        command = fields[0].upper()
        place = 3 if len(fields) > 1 and fields[1].upper().startswith("R") else 1  # behind R5.0 and a length
        if command == "MPTEMP":
            self._take_temperatures(fields[place:], line)
        elif command == "MPDATA":  # label, material, place of the first value, values
            label, material, start = (_padded(fields, place + k) for k in range(3))
            self._take_values(label.upper(), material, start, fields[place + 3 :], line)
        elif command == "MP":  # label, material, constant, linear, ...
            label, material = _padded(fields, 1).upper(), _padded(fields, 2)
            terms = self._numbers(fields[3:], line)
            if label in LABELS and terms:
                self.given.setdefault(material, {})[label] = [(None, terms[0])]
                if any(terms[1:]):
                    said = f"{label} is a polynomial of the temperature: its constant is taken, {terms[0]:g}"
                    self.mesh.remark(material, f"material {material}: {said}")
        elif command == "TB":
            self._take_law(_padded(fields, 1).upper(), _padded(fields, 2))
        elif command == "TREF":
            self.reference = (self._numbers(fields[1:], line) or [0.0])[0]
        elif command == "/UNITS":
            system = UNITS.get(_padded(fields, 1).upper())
            self.mesh.units = () if system is None else (system,)
        elif command in ("BF", "BFUNIF", "TUNIF"):
            self._take_heat(command, [*fields, "", "", ""], line)
        elif command == "LOCAL":
            self._take_system(fields, line)

    def _take_temperatures(self, fields: list[str], line: str) -> None:
        start = int(self._numbers([_padded(fields, 0) or "1"], line)[0])
        if start == 1:
            self.temperatures.clear()
        self.temperatures.update(self._placed(fields[1:], start, line))

    def _take_values(self, label: str, material: str, place: str, fields: list[str], line: str) -> None:
        if label not in LABELS:
            return
        values, start = self.given.setdefault(material, {}), int(self._numbers([place or "1"], line)[0])
        if start == 1:
            values[label] = []
        for k, value in self._placed(fields, start, line):
            if k not in self.temperatures and k > 1:
                raise self.mesh.refuse(
                    f"{line.strip()!r}: place {k} has no temperature, must be given by MPTEMP before"
                )
            values.setdefault(label, []).append((self.temperatures.get(k), value))

    def _take_law(self, name: str, material: str) -> None:
        """A nonlinear or anisotropic law of a material."""
        if name[:4] in OTHER_LAWS:
            self.mesh.unread_materials[material] = f"TB,{name}"
        elif name[:4] in PLASTIC:
            self.mesh.remark(material, f"material {material}: TB,{name} left out: linear elastic")

    def _take_heat(self, command: str, fields: list[str], line: str) -> None:
        """BF, node, TEMP, value; BFUNIF, TEMP, value (or _TINY: none); TUNIF, value: of a node, of all other ones."""
        known, nodes = self.mesh.temperatures, self.mesh.node_labels.tolist()
        if command == "BF" and fields[2].upper().startswith("TEMP") and fields[1].isdecimal():
            known[int(fields[1])] = self._numbers(fields[3:4], line)[0]
        elif command == "TUNIF" or fields[1].upper().startswith("TEMP"):
            values = self._numbers([fields[1] if command == "TUNIF" else fields[2].replace("_TINY", "")], line)
            self.mesh.temperatures = dict.fromkeys(nodes, values[0]) | known if values else known

    def _take_system(self, fields: list[str], line: str) -> None:
        """LOCAL, R5.0, LOC or ANG or PRM, number, kind, three values: angles about z, x, y of a cartesian one (0).

        As a command LOCAL, number, kind, origin, angles.
        """
        written = _padded(fields, 1).upper().startswith("R")
        places, first = ((3, 4), 5) if written else ((1, 2), 6)
        number, kind = (_padded(fields, place).upper().replace("CART", "") or "0" for place in places)
        label = int(self._numbers([number], line)[0])
        if kind != "0":
            self.systems[label] = None
        elif not written or _padded(fields, 2).upper() == "ANG":
            given = [_padded(fields, first + k) or "0" for k in range(3)]
            about_z, about_x, about_y = np.radians(self._numbers(given, line))
            turn = _turn(2, about_z) @ _turn(0, about_x) @ _turn(1, about_y)
            self.systems[label] = turn.T
        else:
            self.systems.setdefault(label, np.eye(3))

    def _placed(self, fields: list[str], start: int, line: str) -> list[tuple[int, float]]:
        """The numbers of fields with their places; one that is left empty is passed over."""
        places = [k for k, field in enumerate(fields, start) if field]
        return list(zip(places, self._numbers(fields, line), strict=True))

    def _numbers(self, fields: list[str], line: str) -> list[float]:
        return [float(value) for value in numbers([field for field in fields if field], _refusal(self.mesh, line))]


def _turn(about: int, angle: float) -> FloatArray:
    """Rotation (3, 3) about an axis."""
    i, j = (about + 1) % 3, (about + 2) % 3
    turn = np.eye(3)
    turn[i, i] = turn[j, j] = np.cos(angle)
    turn[j, i], turn[i, j] = np.sin(angle), -np.sin(angle)
    return turn


def _refusal(mesh: FileMesh, line: str) -> Callable[[str], Exception]:
    return lambda field: mesh.refuse(f"{line.strip()!r}: {field!r} must be a number")


def _padded(fields: list[str], place: int) -> str:
    return fields[place] if place < len(fields) else ""


def _material(mesh: FileMesh, material: str, values: Values, reference: float) -> dict[str, Any]:
    """The constants of a material, isotropic where those along its axes agree."""
    mean = "ALPX" in values
    values = {INSTANT.get(label, label) if not mean else label: rows for label, rows in values.items()}
    for label, (major, along, across) in MINOR.items():
        if label in values and major not in values:
            values[major] = [(at, nu * _at(values, along, at) / _at(values, across, at)) for at, nu in values[label]]
    if "EX" in values and "PRXY" not in values:
        values["PRXY"] = [(None, USUAL_RATIO)]
        said = f"Ansys takes Poisson's ratio {USUAL_RATIO}, so does this program"
        mesh.remark(material, f"material {material}: neither PRXY nor NUXY in the archive: {said}")
    if _is_isotropic(values):
        values = {label: rows for label, rows in values.items() if label not in (*OF_AXES, "GXY")}
    tables: list[list[Row]] = []
    for label in CONSTANTS:
        if values.get(label):
            tables.append([(at, {CONSTANTS[label]: value}) for at, value in values[label]])
    found = material_of_tables(tables)
    if mean and any("expansion" in row for row in found.get("at", ())):
        found["mean_from"] = values.get(REFERENCE, [(None, reference)])[0][1]
    return found


def _at(values: Values, label: str, temperature: float | None) -> float:
    """A modulus at a temperature; one that is left out is that along x."""
    rows = values.get(label) or values.get("EX") or [(None, 1.0)]
    known = [at for at, _ in rows if at is not None]
    if temperature is None or len(known) < 2:
        return rows[0][1]
    return float(np.interp(temperature, known, [value for at, value in rows if at is not None]))


def _is_isotropic(values: Values) -> bool:
    """Whether constants along the axes are those of an isotropic material, at all their temperatures."""
    for label, first in OF_AXES.items():
        for at, value in values.get(label, []):
            same = _at(values, first, at) if first in values else None
            if same is None or abs(value - same) > MISFIT * abs(same):
                return False
    for at, shear in values.get("GXY", []):
        same = _at(values, "EX", at) / (2.0 + 2.0 * _at(values, "PRXY", at))
        if abs(shear - same) > MISFIT * abs(same):
            return False
    return True

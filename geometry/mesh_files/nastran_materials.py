"""Materials of Nastran bulk data: MAT1, parameters that scale masses and stiffness, and what a deck says of units."""

from __future__ import annotations

import re

from geometry.mesh_files.file_mesh import FileMesh
from geometry.mesh_files.nastran_cards import Card, NastranDeck, card_of
from geometry.units import UNIT_SYSTEMS

NAMES = {"E": "young_modulus", "nu": "poisson_ratio", "rho": "density", "A": "expansion"}
OTHERS = ("MAT2", "MAT3", "MAT8", "MAT9", "MAT10", "MAT11", "MATHE", "MATHP")
DEPENDENT = {"MATT1": "depends on temperature", "MATS1": "depends on stress", "MATF1": "depends on frequency"}
SCALES = {"WTMASS": "density", "CM1": "density", "CK1": "young_modulus"}
MISFIT = 0.01  # of E from 2 G (1 + nu), beyond which Nastran warns too
# PARAM,UNITSYS and the comment "$* UNITS:" of Simcenter
_UNITSYS = {
    "MN-MM": "mm-kg-s", "N-MM": "mm", "N-M": "m", "KGF-MM": "mm-kgf-s", "LBF-IN": "in", "LBF-FT": "ft-lbf-s",
}  # fmt: skip
_COMMENT = re.compile(r"\$\*\s*UNITS:\s*(\w+)\s*\(([^)]*)\)", re.IGNORECASE)
_LENGTHS = {"M": 1.0, "METER": 1.0, "MM": 1e-3, "MILLIMETER": 1e-3, "CM": 1e-2, "IN": 0.0254, "INCH": 0.0254} | {
    "CENTIMETER": 1e-2, "FT": 0.3048, "FOOT": 0.3048,
}  # fmt: skip
_FORCES = {"N": 1.0, "NEWTON": 1.0, "KN": 1e3, "LBF": 4.4482216152605, "DYNE": 1e-5, "KGF": 9.80665} | {
    "MILLI-NEWTON": 1e-3, "MN": 1e-3, "POUND F": 4.4482216152605, "POUNDS-FORCE": 4.4482216152605,
}  # fmt: skip


def add_materials(mesh: FileMesh, deck: NastranDeck, by_name: dict[str, list[Card]]) -> None:
    """Properties by the number of the material, masses and stiffness as the parameters of the deck scale them."""
    for card in by_name.get("MAT1", []):
        mesh.materials[card.text(0)] = _isotropic(mesh, card)
    for name in OTHERS:
        for card in by_name.get(name, []):
            mesh.unread_materials[card.text(0)] = name
    for name, what in DEPENDENT.items():
        for card in by_name.get(name, []):
            number = card.text(0)
            mesh.remark(number, f"material {number}: {what} ({name}): the numbers of its MAT1 are taken")
    in_case = [card for line in deck.case_control if (card := card_of(deck.path, line)).name == "PARAM"]
    parameters = [*in_case, *by_name.get("PARAM", [])]
    for name, key in SCALES.items():
        _scale(mesh, [card for card in parameters if card.text(0).upper() == name], key)
    _add_units(mesh, deck, parameters, by_name)


def _isotropic(mesh: FileMesh, card: Card) -> dict[str, float]:
    """Numbers of a MAT1: E, G, nu, rho, A; of E, G and nu one may be blank."""
    given = {name: card.number(k) for k, name in enumerate(("E", "G", "nu", "rho", "A"), 1) if card.text(k)}
    if "E" not in given and {"G", "nu"} <= given.keys():
        given["E"] = 2 * given["G"] * (1 + given["nu"])
    if "nu" not in given and {"E", "G"} <= given.keys():
        if not given["G"] > 0:
            raise card.refuse(f"G = {given['G']:g}: must be positive")
        given["nu"] = given["E"] / (2 * given["G"]) - 1
    if {"E", "G", "nu"} <= given.keys() and abs(2 * given["G"] * (1 + given["nu"]) - given["E"]) > MISFIT * given[
        "E"
    ]:
        number = card.text(0)
        mesh.remark(
            number, f"material {number}: G = {given['G']:g} is not E / (2 + 2 nu): left out, E and nu are taken"
        )
    return {name: given[key] for key, name in NAMES.items() if key in given}


def _scale(mesh: FileMesh, cards: list[Card], key: str) -> None:
    """Multiply a number of all materials by a parameter."""
    if not cards:
        return
    card = cards[0]
    factor = card.number(1)
    if any(other.number(1) != factor for other in cards):
        raise card.refuse(f"{card.text(0)} is given with several values: must have one")
    if not factor > 0:
        raise card.refuse(f"{card.text(0)} is {factor:g}: must be positive")
    if factor == 1.0:
        return
    for name, numbers in mesh.materials.items():
        if key in numbers:
            numbers[key] *= factor
            what = key.replace("_", " ")
            said = f"multiplied by PARAM,{card.text(0).upper()} {factor:g}: {numbers[key]:.6g}"
            mesh.remark(name, f"material {name}: {what} {said}")


def _add_units(mesh: FileMesh, deck: NastranDeck, parameters: list[Card], by_name: dict[str, list[Card]]) -> None:
    """The systems of units that fit what the deck says of them."""
    for comment in deck.comments:
        if found := _COMMENT.match(comment):
            _take_units(mesh, found[0].strip(), _fitting(found[1], found[2]))
    for card in parameters:
        if card.text(0).upper() == "UNITSYS":
            system = _UNITSYS.get(card.text(1).upper())
            _take_units(mesh, f"PARAM,UNITSYS,{card.text(1)}", () if system is None else (system,))
    for card in by_name.get("DTI", []):  # DTI, UNITS, 1, mass, force, length, time
        if card.text(0).upper() == "UNITS" and card.text(1) == "1":
            _take_units(
                mesh, f"DTI,UNITS with {card.text(3)} and {card.text(4)}", _fitting(card.text(4), card.text(3))
            )


def _take_units(mesh: FileMesh, said: str, systems: tuple[str, ...]) -> None:
    mesh.notes.append(
        f"{said}: " + (f"unit {' or '.join(systems)}" if systems else "no system of units that is known")
    )
    mesh.units = mesh.units or systems


def _fitting(length: str, force: str) -> tuple[str, ...]:
    """The systems with these units of length and force."""
    metres, newtons = _LENGTHS.get(length.upper(), 0.0), _FORCES.get(force.upper(), 0.0)
    return tuple(
        name
        for name, system in UNIT_SYSTEMS.items()
        if abs(system.length - metres) < 1e-6 * metres and abs(system.force - newtons) < 1e-6 * newtons
    )

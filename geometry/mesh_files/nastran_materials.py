"""Materials of Nastran decks: MAT1 with its tables over the temperature (MATT1, TABLEM1), orthotropic MAT9."""

from __future__ import annotations

from typing import Any

import numpy as np

from geometry.mesh_files.file_mesh import FileMesh
from geometry.mesh_files.material_tables import Row, material_of_tables, orthotropic_constants, symmetric
from geometry.mesh_files.nastran_cards import Card

NAMES = {"E": "young_modulus", "nu": "poisson_ratio", "rho": "density", "A": "expansion"}
FIELDS = ("E", "G", "nu", "rho", "A")  # of MAT1 and MATT1, behind the number
REFERENCE = 6  # field of the temperature of MAT1 from which expansions are mean ones
OTHERS = ("MAT2", "MAT3", "MAT8", "MAT10", "MAT11", "MATHE", "MATHP")
DEPENDENT = {"MATS1": "depends on stress", "MATF1": "depends on frequency", "MATT9": "depends on temperature"}
SCALES = {"WTMASS": "density", "CM1": "density", "CK1": "modulus"}
MISFIT = 0.01  # of E from 2 G (1 + nu), beyond which Nastran warns too
ORDER = (0, 1, 2, 5, 3, 4)  # xx, yy, zz, xy, yz, zx in the order of Voigt
UPPER = tuple((ORDER[i], ORDER[j]) for i in range(6) for j in range(i, 6))  # of the 21 numbers of MAT9
DENSITY, EXPANSIONS = 22, 23  # fields of MAT9
TABLE = 8  # first field of the pairs of TABLEM1


def add_materials(mesh: FileMesh, by_name: dict[str, list[Card]], parameters: list[Card]) -> None:
    """Properties by the number of the material, masses and stiffness as the parameters of the deck scale them."""
    tables = {card.text(0): card for card in by_name.get("TABLEM1", [])}
    over = {card.text(0): card for card in by_name.get("MATT1", [])}
    for card in by_name.get("MAT1", []):
        mesh.materials[card.text(0)] = _isotropic(mesh, card, over.get(card.text(0)), tables)
    for card in by_name.get("MAT9", []):
        _take_orthotropic(mesh, card)
    for name in OTHERS:
        for card in by_name.get(name, []):
            mesh.unread_materials[card.text(0)] = name
    for name, what in DEPENDENT.items():
        for card in by_name.get(name, []):
            number = card.text(0)
            mesh.remark(number, f"material {number}: {what} ({name}): the numbers of its MAT card are taken")
    for name, key in SCALES.items():
        _scale(mesh, [card for card in parameters if card.text(0).upper() == name], key)


def add_temperatures(mesh: FileMesh, by_name: dict[str, list[Card]]) -> None:
    """Temperatures of nodes: those of the first load set that has some, and its default (TEMPD) elsewhere."""
    pairs = [(card, place) for card in by_name.get("TEMPD", []) for place in (0, 2, 4, 6) if card.text(place)]
    defaults = {card.label(place): card.number(place + 1) for card, place in pairs}
    sets: dict[int, dict[int, float]] = {}
    for card in by_name.get("TEMP", []):
        nodes = sets.setdefault(card.label(0), {})
        nodes |= {card.label(place): card.number(place + 1) for place in (1, 3, 5) if card.text(place)}
    known = sorted({*sets, *defaults})
    if not known:
        return
    if len(known) > 1:
        mesh.notes.append(f"temperatures of load set {known[0]} are taken, not of {', '.join(map(str, known[1:]))}")
    if known[0] in defaults:
        mesh.temperatures = dict.fromkeys(mesh.node_labels.tolist(), defaults[known[0]])
    mesh.temperatures |= sets.get(known[0], {})


def _isotropic(mesh: FileMesh, card: Card, over: Card | None, tables: dict[str, Card]) -> dict[str, Any]:
    """Numbers of a MAT1: E, G, nu, rho, A; of E, G and nu one may be blank."""
    given = {name: card.number(k) for k, name in enumerate(FIELDS, 1) if card.text(k)}
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
    found: list[list[Row]] = [[(None, {NAMES[key]: value})] for key, value in given.items() if key in NAMES]
    for k, name in enumerate(FIELDS, 1):
        if over is not None and name in NAMES and (rows := _table(mesh, over, k, tables)):  # G follows from E and nu
            found.append([(at, {NAMES[name]: value}) for at, value in rows])
    material = material_of_tables(found)
    if any("expansion" in row for row in material.get("at", ())):
        material["mean_from"] = card.number(REFERENCE, 0.0)
    return material


def _table(mesh: FileMesh, over: Card, place: int, tables: dict[str, Card]) -> list[tuple[float, float]] | None:
    """Temperatures and values of the table that a field of MATT1 names; None where it names none that is read."""
    number = over.text(place)
    if number in ("", "0"):
        return None
    card = tables.get(number)
    if card is None:
        told = f"table {number} of MATT1 is not a TABLEM1: the number of MAT1 is taken"
        mesh.remark(over.text(0), f"material {over.text(0)}: {told}")
        return None
    words = [text.upper() for text in card.fields]
    end = words.index("ENDT") if "ENDT" in words else len(words)
    values = [card.number(k) for k in range(TABLE, end) if words[k] not in ("", "SKIP")]
    rows = dict(zip(values[::2], values[1::2], strict=False))
    if len(values) % 2 or len(rows) < 2:
        raise card.refuse("must have pairs of a temperature and a value, two at least, each temperature once")
    return sorted(rows.items())


def _take_orthotropic(mesh: FileMesh, card: Card) -> None:
    """Constants of a MAT9 whose stiffness is that of an orthotropic solid in its system."""
    stiffness = symmetric([card.number(k, 0.0) for k in range(1, 22)], UPPER)
    constants, number = orthotropic_constants(stiffness), card.text(0)
    if constants is None or any(card.number(EXPANSIONS + k, 0.0) for k in (3, 4, 5)):
        mesh.unread_materials[number] = "MAT9 that is not of an orthotropic solid"
        return
    found: dict[str, Any] = {**constants}
    if card.text(DENSITY):
        found["density"] = card.number(DENSITY)
    expansions = np.array([card.number(EXPANSIONS + k, 0.0) for k in range(3)])
    if expansions.any():
        found |= dict(zip(("expansion", "expansion_2", "expansion_3"), map(float, expansions), strict=True))
    mesh.materials[number] = found


def _scale(mesh: FileMesh, cards: list[Card], key: str) -> None:
    """Multiply numbers of all materials, those whose keys end with a word, by a parameter."""
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
    for name, constants in mesh.materials.items():
        for numbers in (constants, *constants.get("at", ())):
            for each in [each for each in numbers if key in each]:
                numbers[each] *= factor
        first = next((each for each in constants if key in each), None)
        if first is not None:
            said = f"multiplied by PARAM,{card.text(0).upper()} {factor:g}: {constants[first]:.6g}"
            mesh.remark(name, f"material {name}: {first.replace('_', ' ')} {said}")

"""Materials of Nastran decks: MAT1 with its tables over the temperature (MATT1, TABLEM1), orthotropic MAT9."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from geometry.mesh_files.file_mesh import FileMesh
from geometry.mesh_files.material_tables import Row, material_of_tables, orthotropic_constants, symmetric
from geometry.mesh_files.nastran_cards import Card

NAMES = {"E": "young_modulus", "nu": "poisson_ratio", "rho": "density", "A": "expansion"}
FIELDS = ("E", "G", "nu", "rho", "A")  # of MAT1 and MATT1, behind the number
REFERENCE = 6  # field of the temperature of MAT1 from which expansions are mean ones
OTHERS = ("MAT2", "MAT3", "MAT8", "MAT10", "MAT11", "MAT12", "MATORT", "MATHE", "MATHP")
DEPENDENT = {"MATS1": "depends on stress", "MATF1": "depends on frequency", "MATT9": "depends on temperature"}
SCALES = {"WTMASS": "density", "CM1": "density", "CK1": "modulus"}
MISFIT = 0.01  # of E from 2 G (1 + nu), beyond which Nastran warns too
ORDER = (0, 1, 2, 5, 3, 4)  # xx, yy, zz, xy, yz, zx in the order of Voigt
UPPER = tuple((ORDER[i], ORDER[j]) for i in range(6) for j in range(i, 6))  # of the 21 numbers of MAT9
DENSITY, EXPANSIONS = 22, 23  # fields of MAT9
Pairs = list[tuple[float, float]]  # temperatures and values
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
    """Numbers of a MAT1: E, G, nu, rho, A; of E, G and nu one may be blank, it follows from the two others."""
    given = {name: card.number(k) for k, name in enumerate(FIELDS, 1) if card.text(k)}
    if {"E", "G", "nu"} <= given.keys() and abs(2 * given["G"] * (1 + given["nu"]) - given["E"]) > MISFIT * given[
        "E"
    ]:
        number = card.text(0)
        mesh.remark(
            number, f"material {number}: G = {given['G']:g} is not E / (2 + 2 nu): left out, E and nu are taken"
        )
    found: dict[str, Pairs] = {name: [(0.0, value)] for name, value in given.items()}
    for k, name in enumerate(FIELDS, 1):
        if over is not None and (rows := _table(mesh, over, k, tables)):
            found[name] = rows
    if any(not value > 0 for _, value in found.get("G", ())):
        raise card.refuse(f"G = {min(value for _, value in found['G']):g}: must be positive")
    if "E" not in found and {"G", "nu"} <= found.keys():
        found["E"] = _following(found["G"], found["nu"], lambda g, nu: 2 * g * (1 + nu))
    if "nu" not in found and {"E", "G"} <= found.keys():
        found["nu"] = _following(found["E"], found["G"], lambda e, g: e / (2 * g) - 1)
    named: list[list[Row]] = [
        [(at, {NAMES[name]: value}) for at, value in rows] for name, rows in found.items() if name in NAMES
    ]
    material = material_of_tables(named)
    if any("expansion" in row for row in material.get("at", ())):
        material["mean_from"] = card.number(REFERENCE, 0.0)
    return material


def _following(one: Pairs, other: Pairs, law: Callable[[float, float], float]) -> Pairs:
    """A number that follows from two others, at the temperatures of their tables."""
    grid = sorted({at for rows in (one, other) for at, _ in rows if len(rows) > 1}) or [0.0]
    values = [np.interp(grid, [at for at, _ in rows], [value for _, value in rows]) for rows in (one, other)]
    return [(at, float(law(*pair))) for at, *pair in zip(grid, *values, strict=True)]


def _table(mesh: FileMesh, over: Card, place: int, tables: dict[str, Card]) -> Pairs | None:
    """Temperatures and values of the table that a field of MATT1 names; None where it names none that is read."""
    number = over.text(place)
    if number in ("", "0"):
        return None
    card = tables.get(number)
    if card is None or "LOG" in (card.text(1).upper(), card.text(2).upper()):
        told = f"table {number} of MATT1 is not a TABLEM1 with linear axes: the number of MAT1 is taken"
        mesh.remark(over.text(0), f"material {over.text(0)}: {told}")
        return None
    words = [text.upper() for text in card.fields]
    end = words.index("ENDT") if "ENDT" in words else len(words)
    pairs = [k for k in range(TABLE, end, 2) if any(words[k : k + 2]) and "SKIP" not in words[k : k + 2]]
    rows = {card.number(k): card.number(k + 1) for k in pairs if k + 1 < end}
    if len(rows) < max(2, len(pairs)):
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

"""Sets of a Nastran deck: SET in the case control, SET1, SET3 and SPC1 in the bulk data.

A set has a number; the comment ``$HMSET number kind "name"`` (kind 1: nodes, 2: elements), as HyperMesh writes it,
gives it a name. Without one it is called SET_number, and is a set of nodes or elements, by which labels it holds.
"""

from __future__ import annotations

import re

import numpy as np

from geometry.errors import MeshFileError
from geometry.mesh_files.file_mesh import FileMesh
from geometry.mesh_files.nastran_cards import Card, NastranDeck
from geometry.mesh_files.text_files import LARGEST_LABEL
from geometry.sector import IntArray

Ranges = list[tuple[int, int]]
_NAMED = re.compile(r'\$HMSET\s+(\d+)\s+(\d+)\s+"([^"]*)"')
_OUTPUT = re.compile(r"\s*OUTPUT\s*\(\s*(\w+)\s*\)", re.IGNORECASE)
_REAL = re.compile(r"[+-]?(\d+\.\d*|\.\d+)([EeDd]?[+-]?\d+)?")
_MOST_STEPS = 1_000_000
_SET = re.compile(r"\s*SET\s+(\d+)\s*=\s*(.*)$", re.IGNORECASE)


def add_sets(mesh: FileMesh, deck: NastranDeck, set_cards: list[Card]) -> None:
    """Put the sets of a deck into its mesh."""
    named = {int(found[1]): (found[3], found[2]) for line in deck.comments if (found := _NAMED.match(line))}
    nodes = np.unique(mesh.node_labels)
    elements = np.unique(np.concatenate([np.empty(0, np.int64), *(group.labels for group in mesh.elements)]))
    cards = [card for card in set_cards if card.name != "SET3" or card.text(1).upper() in ("GRID", "ELEM")]
    if len(cards) < len(set_cards):
        mesh.leave_out("unknown", {"SET3 of neither GRID nor ELEM": len(set_cards) - len(cards)})
    for number, ranges, what in [*_case_control_sets(mesh, deck), *map(_bulk_set, cards)]:
        name, kind = named.get(number, (f"SET_{number}", "")) if what != "SPC1" else (f"SPC1_{number}", "1")
        kind = {"GRID": "1", "ELEM": "2"}.get(what, kind)
        of_nodes, of_elements = _members(nodes, ranges), _members(elements, ranges)
        whole = all(last == first for first, last in ranges) and len(of_elements) == len(set(ranges))
        if kind != "2":
            before = mesh.node_sets.get(name, np.empty(0, np.int64))
            mesh.node_sets[name] = np.concatenate([before, of_nodes])
        if kind == "2" or (kind == "" and (whole or (len(of_elements) and not len(of_nodes)))):
            before = mesh.element_sets.get(name, np.empty(0, np.int64))
            mesh.element_sets[name] = np.concatenate([before, of_elements])


def _members(labels: IntArray, ranges: Ranges) -> IntArray:
    """Those of sorted labels that lie in ranges, in the order of the ranges."""
    if not ranges:
        return np.empty(0, dtype=np.int64)
    table = np.array(ranges, dtype=np.int64)
    first, last = np.searchsorted(labels, table[:, 0]), np.searchsorted(labels, table[:, 1], side="right")
    return np.concatenate([labels[a:b] for a, b in zip(first, last, strict=True)])


def _case_control_sets(mesh: FileMesh, deck: NastranDeck) -> list[tuple[int, Ranges, str]]:
    found = []
    lines = iter(deck.case_control)
    plots = False  # sets of the plotter are of another kind
    for line in lines:
        section = _OUTPUT.match(line)
        plots = plots if section is None else section[1].upper() in ("PLOT", "XYPLOT", "XYOUT")
        head = _SET.match(line)
        if head is None or plots:
            continue
        parts = [head[2]]
        while parts[-1].rstrip().endswith(","):
            parts.append(next(lines, ""))
        words = " ".join(parts).replace(",", " ").split()
        if any(_REAL.fullmatch(word) for word in words):
            mesh.notes.append(f"SET {head[1]} left out: holds frequencies or times, not labels")
            continue
        found.append((int(head[1]), _ranges(deck.path, f"SET {head[1]}", words), "SET"))
    return found


def _bulk_set(card: Card) -> tuple[int, Ranges, str]:
    """Number, ranges and what the members are, of SET1, SET3 or SPC1."""
    skip = 1 if card.name == "SET1" else 2
    what = card.text(1).upper() if card.name == "SET3" else card.name
    words = [word for word in card.fields[skip:] if word]
    return card.label(0), _ranges(card.path, f"line {card.line}, {card.name}", words), what


def _ranges(path: str, where: str, words: list[str]) -> Ranges:
    ranges: Ranges = []
    excepted: set[int] = set()
    place, excluding = 0, False
    while place < len(words):
        word = words[place].upper()
        if word == "ALL":
            ranges.append((1, LARGEST_LABEL))
        elif word == "EXCEPT":
            excluding = True
        elif word == "THRU" and ranges and place + 1 < len(words):
            place += 1
            ranges[-1] = (ranges[-1][0], _label(path, where, words[place]))
            excluding = False
        elif word == "BY" and ranges and place + 1 < len(words):
            place += 1
            (first, last), step = ranges.pop(), _label(path, where, words[place])
            if step < 1 or (last - first) // step > _MOST_STEPS:
                raise MeshFileError(path, f"{where}: BY {step} must be a step with {_MOST_STEPS} labels at most")
            ranges += [(label, label) for label in range(first, last + 1, step)]
        elif excluding:
            excepted.add(_label(path, where, word))
        else:
            ranges.append((_label(path, where, word),) * 2)
        place += 1
    return [part for first, last in ranges for part in _without(first, last, sorted(excepted))]


def _without(first: int, last: int, excepted: list[int]) -> Ranges:
    parts: Ranges = []
    for label in excepted:
        if first <= label <= last:
            if first < label:
                parts.append((first, label - 1))
            first = label + 1
    return [*parts, (first, last)] if first <= last else parts


def _label(path: str, where: str, word: str) -> int:
    if not word.isdecimal() or len(word) > 10 or int(word) > LARGEST_LABEL:
        raise MeshFileError(path, f"{where}: {word!r} must be a positive integer, THRU or EXCEPT")
    return int(word)

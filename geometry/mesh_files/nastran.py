"""Nastran bulk data (.bdf, .nas, .dat): solid elements, coordinate systems, MAT1, sets and units.

meshio and meshlane lose coordinate systems, sets and materials, so the cards are read here. The name of a material is
the number of its MAT1; the elements of a property are the element set PSOLID_number. Sets are SET in the case control
and SET1, SET3 and SPC1 in the bulk data. A set has a number; the comment ``$HMSET number kind "name"`` (kind 1:
nodes, 2: elements), as HyperMesh writes it, gives it a name. Without one it is called SET_number, and is a set of
nodes or elements, by which labels it holds.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from geometry.elements import ELEMENT_KINDS
from geometry.errors import MeshFileError
from geometry.mesh_files.file_mesh import NO_LABELS, FileElements, FileMesh
from geometry.mesh_files.material_tables import take_material
from geometry.mesh_files.nastran_cards import Card, NastranDeck, card_of, cards, nastran_deck
from geometry.mesh_files.nastran_materials import add_materials, add_temperatures
from geometry.mesh_files.text_files import LARGEST_LABEL
from geometry.sector import FloatArray, IntArray
from geometry.units import UNIT_SYSTEMS

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
Ranges = list[tuple[int, int]]
_NAMED = re.compile(r'\$HMSET\s+(\d+)\s+(\d+)\s+"([^"]*)"')
_OUTPUT = re.compile(r"\s*OUTPUT\s*\(\s*(\w+)\s*\)", re.IGNORECASE)
_REAL = re.compile(r"[+-]?(\d+\.\d*|\.\d+)([EeDd]?[+-]?\d+)?")
_MOST_STEPS = 1_000_000
_SET = re.compile(r"\s*SET\s+(\d+)\s*=\s*(.*)$", re.IGNORECASE)
PLANE = {"CTRIA3": 3, "CTRIA6": 6, "CTRIAR": 3, "CQUAD4": 4, "CQUAD8": 8, "CQUADR": 4, "CQUAD": 9}  # nodes
_PROPERTY = re.compile(r'\$HMNAME\s+PROP\s+(\d+)\s*"([^"]*)"', re.IGNORECASE)
FAMILIES = {"CTETRA": ("tet4", "tet10"), "CPENTA": ("wedge6", "wedge15"), "CHEXA": ("hex8", "hex20")}
# CPENTA and CHEXA count the edges between the lower and the upper side before those of the upper side
COLUMNS = {
    "wedge15": [*range(9), 12, 13, 14, 9, 10, 11],
    "hex20": [*range(12), 16, 17, 18, 19, 12, 13, 14, 15],
}
SYSTEMS = ("CORD1R", "CORD1C", "CORD1S", "CORD2R", "CORD2C", "CORD2S")
SETS = ("SET1", "SET3", "SPC1")
CUTS = {"1": "cyclic_left", "2": "cyclic_right"}  # sides of CYJOIN
MATERIALS = ("PSOLID", "PLSOLID", "MAT1", "MATT1", "MAT9", "TABLEM1", "TEMP", "TEMPD")
READ = frozenset(["GRID", "GRDSET", "SPC", "CYJOIN", *FAMILIES, *PLANE, *SYSTEMS, *SETS, *MATERIALS])
GENERATORS = ("EGRID", "GRIDG", "GRIDD", "GRIDU", "GRIDMOD", "CGEN")
# what cards that are left out do, by the keys of `file_mesh.EFFECTS`; the first pattern that fits counts
LEFT_OUT = (
    (r"RBE[123]|RBAR1?|RROD|RTRPLT1?|RSPLINE|RJOINT|RSSCON|RBE2GS|RBODY|MPC|BGSET|TIE", "ties"),
    (r"CELAS[1-4]|CDAMP[1-5]|CBUSH.*|CGAP.*|CVISC|CFAST|CWELD|CSEAM|GENEL|DMIG", "springs"),
    (r"CONM[12]|CMASS[1-4]|NSML?1?", "masses"),
    (r"PLOTEL.*", "surfaces"),
    (r"SPC1?|SUPORT1?", "supports"),
    (r"CYJOIN|CYSYM", "cyclic"),
    (r"BCONP|BCTSET|BCTABLE|BCONTACT|CONTACT", "contacts"),
    (r"C(QUAD|TRI|BAR|BEAM|BEND|ROD|ONROD|TUBE|SHEAR|ONE|HEX|PEN|TET|IHEX|WEDGE|RAC|FLUID|QDX|IFHEX|IFPEN|SUPER)"
     r".*", "bodies"),
)  # fmt: skip
# cards of loads, solutions, optimisation, and those that belong to cards above
_KNOWN = re.compile(
    r"(P[A-Z]|MAT|EIG|LOAD|FORCE|MOMENT|GRAV|RFORCE|ACCEL|TEMP|DLOAD|[RT]LOAD|DAREA|DPHASE|DELAY|FREQ|TABL|TABD|TSTEP|NL"
    r"|DTI|DMI$|[ABCOQRU]SET|OMIT|[SE]POINT|ECHO|SPCADD|MPCADD|SPCD|LSEQ|NSMADD|D(ESVAR|RESP|V|CON|EQATN|OPT|LINK)|TF$"
    r"|NOLIN|CHBDY|CONV|QBDY|QVOL|QHBDY|VIEW|RADM|TIC|BCBODY|BCPARA|BCPROP|BSURF|BLSEG|BCTADD|BGADD|BEGIN|CYAX|CYSUP|SYS|NASTRAN)"
)


@dataclass(frozen=True)
class _System:
    shape: str  # "R", "C" or "S"
    origin: FloatArray
    axes: FloatArray  # columns


class NastranCoordinates:
    """Places of nodes in the basic system.

    Shapes: `labels` (N,), `systems` (N,), `numbers` (N, 3).
    """

    def __init__(self, cards: list[Card], labels: IntArray, systems: IntArray, numbers: FloatArray) -> None:
        self._cards: dict[int, tuple[Card, int]] = {}
        for card in cards:
            for place in (0, 4) if card.name[4] == "1" else (0,):
                if card.text(place):
                    self._cards[card.label(place)] = (card, place)
        self._known: dict[int, _System] = {0: _System("R", np.zeros(3), np.eye(3))}
        self._open: list[int] = []
        self._labels, self._systems, self._numbers = labels, systems, numbers

    def basic(self) -> FloatArray:
        """Positions of all nodes (N, 3)."""
        points = np.empty_like(self._numbers)
        for system in np.unique(self._systems):
            rows = self._systems == system
            points[rows] = self._moved(self._system(int(system), None), self._numbers[rows])
        return points

    def defined(self, number: int) -> bool:
        """Whether there is a system of this number."""
        return number == 0 or number in self._cards

    def axes(self, number: int, card: Card) -> FloatArray | None:
        """Axes of a system, one a row; None of one that turns from place to place, as that of elements (-1)."""
        if number < 0:
            return None
        if not self.defined(number):
            raise card.refuse(f"coordinate system {number} is not defined")
        system = self._system(number, card)
        return system.axes.T if system.shape == "R" else None

    def _moved(self, system: _System, values: FloatArray) -> FloatArray:
        first, second, third = values.T
        if system.shape == "C":
            angle = np.radians(second)
            values = np.column_stack([first * np.cos(angle), first * np.sin(angle), third])
        elif system.shape == "S":
            polar, angle = np.radians(second), np.radians(third)
            flat = first * np.sin(polar)
            values = np.column_stack([flat * np.cos(angle), flat * np.sin(angle), first * np.cos(polar)])
        return values @ system.axes.T + system.origin

    def _system(self, number: int, asked: Card | None) -> _System:
        if number in self._known:
            return self._known[number]
        card, place = self._cards[number]
        if number in self._open:
            raise card.refuse(f"coordinate system {number} is defined by itself")
        self._open.append(number)
        if card.name[4] == "1":
            points = np.vstack([self._node(card, place + k) for k in (1, 2, 3)])
        else:
            reference = card.label(1, 0)
            if not self.defined(reference):
                raise card.refuse(f"coordinate system {reference} is not defined")
            given = np.array([card.number(k, 0.0) for k in range(2, 11)]).reshape(3, 3)
            points = self._moved(self._system(reference, card), given)
        third = points[1] - points[0]
        second = np.cross(third, points[2] - points[0])
        if not np.linalg.norm(second) > 1e-12 * np.linalg.norm(third) * np.linalg.norm(points[2] - points[0]):
            raise card.refuse(f"the three points of coordinate system {number} are on a line")
        axes = np.column_stack([np.cross(second, third), second, third])
        self._known[number] = _System(card.name[5], points[0], axes / np.linalg.norm(axes, axis=0))
        return self._known[number]

    def _node(self, card: Card, place: int) -> FloatArray:
        rows = np.flatnonzero(self._labels == card.label(place))
        if not len(rows):
            raise card.refuse(f"node {card.text(place)} is not defined")
        row = int(rows[0])
        system = int(self._systems[row])
        if not self.defined(system):
            raise card.refuse(f"coordinate system {system} is not defined")
        return self._moved(self._system(system, card), self._numbers[row : row + 1])


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


def add_sets(mesh: FileMesh, deck: NastranDeck, set_cards: list[Card]) -> None:
    """Put the sets of a deck into its mesh."""
    named = {int(found[1]): (found[3], found[2]) for line in deck.comments if (found := _NAMED.match(line))}
    nodes = np.unique(mesh.node_labels)
    groups = (*mesh.elements, *mesh.plane)
    elements = np.unique(np.concatenate([np.empty(0, np.int64), *(group.labels for group in groups)]))
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


def read_nastran(path: str | Path) -> FileMesh:
    """Nodes, elements, sets and materials of a deck."""
    deck = nastran_deck(path)
    mesh = FileMesh(str(path))
    by_name: dict[str, list[Card]] = {}
    for card in cards(deck, READ):
        by_name.setdefault(card.name, []).append(card)
    for name in GENERATORS:
        if name in by_name:
            raise by_name[name][0].refuse(
                "makes nodes or elements, which is not read: must be written out, card by card"
            )
    if "CPYRAM" in by_name:
        raise by_name["CPYRAM"][0].refuse("is a pyramid: only tetrahedra, wedges and hexahedra are read")
    coordinates = _add_nodes(mesh, by_name)
    add_temperatures(mesh, by_name)
    properties = _add_elements(mesh, by_name)
    _add_plane_elements(mesh, by_name, deck)
    in_case = [card for line in deck.case_control if (card := card_of(deck.path, line)).name == "PARAM"]
    parameters = [*in_case, *by_name.get("PARAM", [])]
    add_materials(mesh, by_name, parameters)
    _add_units(mesh, deck, parameters, by_name)
    _add_properties(mesh, by_name, properties, coordinates)
    add_sets(mesh, deck, [card for name in SETS for card in by_name.get(name, [])])
    _add_supports(mesh, by_name)
    _leave_out(mesh, {name: len(found) for name, found in by_name.items()})
    held = sum(bool(card.text(6)) for card in by_name.get("GRID", []))
    mesh.leave_out("supports", {"GRID with PS": held} if held else {})
    return mesh


def _add_supports(mesh: FileMesh, by_name: dict[str, list[Card]]) -> None:
    """Nodes that SPC, SPC1 and GRID hold in all directions, and the sides of CYJOIN as cut faces."""
    nodes = np.unique(mesh.node_labels)
    found: list[tuple[str, IntArray]] = [
        (card.text(6), np.array([card.label(0)])) for card in by_name.get("GRID", [])
    ]
    for card in by_name.get("SPC", []):
        for place in (1, 4):
            if card.text(place) and not (card.text(place + 2) and card.number(place + 2)):
                found.append((card.text(place + 1), np.array([card.label(place)])))
    for card in by_name.get("SPC1", []):
        found.append((card.text(1), _members(nodes, _bulk_set(card)[1])))
    held = [np.concatenate([NO_LABELS, *(rows for text, rows in found if digit in text)]) for digit in "123"]
    mesh.name_held(np.intersect1d(np.intersect1d(held[0], held[1]), held[2]), "SPC")
    for card in by_name.get("CYJOIN", []):
        words = [word for word in card.fields[2:] if word]
        role = CUTS.get(card.text(0))
        if role is not None:
            labels = _members(nodes, _ranges(card.path, f"line {card.line}, CYJOIN", words))
            mesh.node_sets[role] = np.concatenate([mesh.node_sets.get(role, NO_LABELS), labels])


def _leave_out(mesh: FileMesh, counts: dict[str, int]) -> None:
    """Say which constraints, elements and unknown cards are left out."""
    found: dict[str, dict[str, int]] = {}
    for name, count in counts.items():
        effect = next((effect for pattern, effect in LEFT_OUT if re.fullmatch(pattern, name)), "unknown")
        read = name in READ - {"SPC1", "SPC", "CYJOIN"}
        if not read and not (effect == "unknown" and _KNOWN.match(name)):
            found.setdefault(effect, {})[name] = count
    for effect, names in found.items():
        mesh.leave_out(effect, names)


def _add_nodes(mesh: FileMesh, by_name: dict[str, list[Card]]) -> NastranCoordinates:
    found = by_name.get("GRID", [])
    usual = next((card.label(1, 0) for card in by_name.get("GRDSET", [])), 0)
    labels = np.array([card.label(0) for card in found], dtype=np.int64)
    systems = np.array([card.label(1, usual) for card in found], dtype=np.int64)
    try:
        numbers = np.array([[float(text or 0) for text in card.fields[2:5]] for card in found]).reshape(-1, 3)
    except ValueError:  # exponents without E, or no numbers
        numbers = np.array([[card.number(k, 0.0) for k in (2, 3, 4)] for card in found]).reshape(-1, 3)
    coordinates = NastranCoordinates(
        [card for name in SYSTEMS for card in by_name.get(name, [])], labels, systems, numbers
    )
    for system in np.unique(systems):
        if not coordinates.defined(int(system)):
            card = found[int(np.flatnonzero(systems == system)[0])]
            raise card.refuse(f"node {card.text(0)} names coordinate system {system}, which is not defined")
    mesh.node_labels, mesh.points = labels, coordinates.basic()
    return coordinates


def _add_elements(mesh: FileMesh, by_name: dict[str, list[Card]]) -> dict[int, list[int]]:
    """Take the solid elements; labels by property."""
    properties: dict[int, list[int]] = {}
    for name, (linear, quadratic) in FAMILIES.items():
        full, few = ELEMENT_KINDS[quadratic].n_nodes, ELEMENT_KINDS[linear].n_nodes
        rows: dict[str, list[list[int]]] = {linear: [], quadratic: []}
        for card in by_name.get(name, []):
            row = _element_row(card, full)
            properties.setdefault(row.pop(1), []).append(row[0])
            kind = quadratic if any(row[few + 1 :]) else linear
            rows[kind].append(row if kind == quadratic else row[: few + 1])
        for kind, table in rows.items():
            if table:
                array = np.array(table, dtype=np.int64)
                columns = COLUMNS.get(kind, list(range(ELEMENT_KINDS[kind].n_nodes)))
                mesh.elements.append(FileElements(kind, array[:, 0], array[:, 1:][:, columns]))
    return properties


def _add_plane_elements(mesh: FileMesh, by_name: dict[str, list[Card]], deck: NastranDeck) -> None:
    """Take the plane elements, and those of each property as a set."""
    names = {int(found[1]): found[2] for line in deck.comments if (found := _PROPERTY.match(line))}
    thick = {card.label(0) for name in ("PSHELL", "PCOMP", "PCOMPG") for card in by_name.get(name, [])}
    sets: dict[int, list[int]] = {}
    for name, count in PLANE.items():
        rows = [[card.label(place, 0) for place in range(count + 2)] for card in by_name.get(name, [])]
        for row in rows:
            sets.setdefault(row[1] or row[0], []).append(row[0])
        if rows:
            table = np.array(rows, dtype=np.int64)
            mesh.add_plane(name, table[:, 0], table[:, 2:])
    for number, labels in sets.items():
        mesh.element_sets[names.get(number, f"PSHELL_{number}")] = np.array(labels)
        mesh.sections += [np.array(labels)] if number in thick else []


def _element_row(card: Card, count: int) -> list[int]:
    """Label, property and nodes, 0 for a blank field."""
    fields = card.fields[: count + 2]
    try:
        row = [int(field) if field else 0 for field in fields]
    except ValueError:
        row = [card.label(place, 0) for place in range(len(fields))]
    if min(row) < 0:
        raise card.refuse(f"{min(row)} must be a positive integer")
    if any(card.fields[count + 2 :]):
        raise card.refuse(f"element {row[0]} has more than {count} nodes")
    return row + [0] * (count + 2 - len(row))


def _add_properties(
    mesh: FileMesh, by_name: dict[str, list[Card]], properties: dict[int, list[int]], coordinates: NastranCoordinates
) -> None:
    """Element sets of the properties, and the material of their elements."""
    solids = {card.label(0): card for name in ("PSOLID", "PLSOLID") for card in by_name.get(name, [])}
    arrays: dict[int, IntArray] = {number: np.array(labels) for number, labels in properties.items()}
    for number, labels in arrays.items():
        mesh.element_sets[f"PSOLID_{number}"] = labels
        card = solids.get(number)
        if card is not None and card.text(1):
            system = int(card.number(2, 0.0)) if card.name == "PSOLID" else 0
            axes = partial(coordinates.axes, system, card)
            take_material(mesh, labels, card.text(1), f"coordinate system {system}", axes)
        else:
            mesh.notes.append(f"property {number} is not defined by a PSOLID: its elements have no material")

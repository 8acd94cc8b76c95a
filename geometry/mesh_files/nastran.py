"""Nastran bulk data (.bdf, .nas, .dat): solid elements, coordinate systems, MAT1 and sets.

meshio and meshlane lose coordinate systems, sets and materials, so the cards are read here. The name of a material is
the number of its MAT1; the elements of a property are the element set PSOLID_number.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from geometry.elements import ELEMENT_KINDS
from geometry.mesh_files.file_mesh import FileElements, FileMesh
from geometry.mesh_files.nastran_cards import Card, cards, nastran_deck
from geometry.mesh_files.nastran_coordinates import NastranCoordinates
from geometry.mesh_files.nastran_materials import add_materials
from geometry.mesh_files.nastran_sets import add_sets
from geometry.sector import IntArray

FAMILIES = {"CTETRA": ("tet4", "tet10"), "CPENTA": ("wedge6", "wedge15"), "CHEXA": ("hex8", "hex20")}
# CPENTA and CHEXA count the edges between the lower and the upper side before those of the upper side
COLUMNS = {
    "wedge15": [*range(9), 12, 13, 14, 9, 10, 11],
    "hex20": [*range(12), 16, 17, 18, 19, 12, 13, 14, 15],
}
SYSTEMS = ("CORD1R", "CORD1C", "CORD1S", "CORD2R", "CORD2C", "CORD2S")
SETS = ("SET1", "SET3", "SPC1")
MATERIALS = ("PSOLID", "PLSOLID", "MAT1")
READ = frozenset(["GRID", "GRDSET", *FAMILIES, *SYSTEMS, *SETS, *MATERIALS])
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
    _add_nodes(mesh, by_name)
    properties = _add_elements(mesh, by_name)
    _add_properties(mesh, by_name, properties)
    add_materials(mesh, deck, by_name)
    add_sets(mesh, deck, [card for name in SETS for card in by_name.get(name, [])])
    _leave_out(mesh, {name: len(found) for name, found in by_name.items()})
    held = sum(bool(card.text(6)) for card in by_name.get("GRID", []))
    mesh.leave_out("supports", {"GRID with PS": held} if held else {})
    return mesh


def _leave_out(mesh: FileMesh, counts: dict[str, int]) -> None:
    """Say which constraints, elements and unknown cards are left out."""
    found: dict[str, dict[str, int]] = {}
    for name, count in counts.items():
        effect = next((effect for pattern, effect in LEFT_OUT if re.fullmatch(pattern, name)), "unknown")
        read = name in READ - {"SPC1"}
        if not read and not (effect == "unknown" and _KNOWN.match(name)):
            found.setdefault(effect, {})[name] = count
    for effect, names in found.items():
        mesh.leave_out(effect, names)


def _add_nodes(mesh: FileMesh, by_name: dict[str, list[Card]]) -> None:
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


def _add_properties(mesh: FileMesh, by_name: dict[str, list[Card]], properties: dict[int, list[int]]) -> None:
    """Element sets of the properties, and the material of their elements."""
    material = {card.label(0): card.text(1) for name in ("PSOLID", "PLSOLID") for card in by_name.get(name, [])}
    arrays: dict[int, IntArray] = {number: np.array(labels) for number, labels in properties.items()}
    for number, labels in arrays.items():
        mesh.element_sets[f"PSOLID_{number}"] = labels
        if material.get(number):
            mesh.element_material.append((labels, material[number]))
        else:
            mesh.notes.append(f"property {number} is not defined by a PSOLID: its elements have no material")

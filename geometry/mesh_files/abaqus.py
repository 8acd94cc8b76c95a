"""Abaqus and CalculiX input files (.inp): parts and instances, nested sets, surfaces, materials.

meshio and meshlane lose nested sets, instances and surfaces, so the keyword blocks are read here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from geometry.errors import MeshFileError
from geometry.mesh_files.abaqus_blocks import (
    HEAT,
    SHELL_SECTIONS,
    KeywordBlock,
    Scope,
    SetReader,
    add_elements,
    add_nodes,
    keyword_blocks,
)
from geometry.mesh_files.file_mesh import MOST_SETS, NO_LABELS, FileMesh
from geometry.mesh_files.material_tables import (
    NINE,
    Row,
    material_of_tables,
    orthotropic_constants,
    symmetric,
    take_material,
)
from geometry.mesh_files.text_files import numbers
from geometry.sector import FloatArray, IntArray

ISOTROPIC = ("", "ISO", "ISOTROPIC")
ORTHOTROPIC = ("ORTHO", "ORTHOTROPIC")
CONSTANTS = ("ENGINEERING CONSTANTS", "ENGINEERINGCONSTANTS")
# keyword and type (isotropic ones ""): constants of a row
NUMBERS: dict[tuple[str, str], tuple[str, ...]] = {
    ("ELASTIC", ""): ("young_modulus", "poisson_ratio"),
    ("DENSITY", ""): ("density",),
    ("EXPANSION", ""): ("expansion",),
    ("EXPANSION", "ORTHO"): ("expansion", "expansion_2", "expansion_3"),
    ("ELASTIC", "CONSTANTS"): NINE,
    ("ELASTIC", "ORTHO"): ("1111", "1122", "2222", "1133", "2233", "3333", "1212", "1313", "2323"),
}
PLACES = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2), (5, 5), (4, 4), (3, 3))  # of the last ones
PROPERTIES = ("ELASTIC", "DENSITY", "EXPANSION")
PER_LINE = 8  # numbers
OTHER_LAWS = ("HYPERELASTIC", "HYPERFOAM", "LOW DENSITY FOAM", "USER MATERIAL", "UMAT", "ANISOTROPIC HYPERELASTIC")
# what a linear material leaves out of such a one
LAWS_LEFT_OUT = ("PLASTIC", "CYCLIC HARDENING", "CREEP", "VISCOELASTIC", "DAMPING", "DEFORMATION PLASTICITY")
SCALING = ("MASS ADJUST", "FIXED MASS SCALING", "VARIABLE MASS SCALING")
SCALED = "changes the masses of the model: remove it and give the densities that it makes"
MESH = ("NODE", "ELEMENT")
SETS = ("NSET", "ELSET", "SURFACE", "SOLID SECTION", "ORIENTATION", "BOUNDARY", *HEAT, *SHELL_SECTIONS)
GENERATORS = (
    *("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM", "SYMMETRIC MODEL GENERATION", "IMPORT"),
    *("MAP SOLUTION", "TET TO WEDGE"),
)
# what keywords that are left out do, by the keys of `file_mesh.EFFECTS`
LEFT_OUT = {
    "EQUATION": "ties", "MPC": "ties", "RIGID BODY": "ties", "COUPLING": "ties", "KINEMATIC COUPLING": "ties",
    "DISTRIBUTING COUPLING": "ties", "TIE": "ties", "SHELL TO SOLID COUPLING": "ties", "EMBEDDED ELEMENT": "ties",
    "PRE-TENSION SECTION": "ties", "CYCLIC SYMMETRY MODEL": "cyclic", "FASTENER": "ties",
    "NETWORK MPC": "ties", "DISPLAY BODY": "ties", "PERIODIC MEDIA": "ties",
    "SPRING": "springs", "DASHPOT": "springs", "CONNECTOR SECTION": "springs", "JOINT": "springs",
    "BUSHING": "springs", "FOUNDATION": "springs", "ELEMENT FOUNDATION": "springs", "MATRIX ASSEMBLE": "springs",
    "SUBSTRUCTURE PROPERTY": "bodies", "MASS": "masses", "ROTARY INERTIA": "masses", "NONSTRUCTURAL MASS": "masses",
    "IMPERFECTION": "moves", "ADJUST": "moves",
    "BOUNDARY": "supports", "INERTIA RELIEF": "supports",
    "CONTACT PAIR": "contacts", "CONTACT": "contacts",
}  # fmt: skip
_ELEMENTS = (  # the same for types of elements, by how they begin; all others are bodies
    ("MASS", "masses"), ("ROTARYI", "masses"), ("SPRING", "springs"), ("DASHPOT", "springs"), ("CONN", "springs"),
    ("GAP", "springs"), ("GK", "springs"), ("JOINT", "springs"), ("ITT", "springs"), ("COH", "springs"),
    ("RB", "ties"), ("R3D", "ties"), ("RAX", "ties"), ("DCOUP", "ties"), ("KCOUP", "ties"), ("SFM", "surfaces"),
)  # fmt: skip
# keywords that say nothing about the mesh, or belong to those above
_KNOWN = (
    *("HEADING", "PREPRINT", "RESTART", "ASSEMBLY", "END ASSEMBLY", "AMPLITUDE", "SURFACE INTERACTION", "FRICTION"),
    *("SURFACE BEHAVIOR", "CONTACT CONTROLS", "CONTACT DAMPING", "CONTACT INCLUSIONS", "CONTACT EXCLUSIONS"),
    *("CONTACT PROPERTY ASSIGNMENT", "CONTACT INITIALIZATION ASSIGNMENT", "CLEARANCE", "CHANGE FRICTION"),
    *("INITIAL CONDITIONS", "PHYSICAL CONSTANTS", "TRANSFORM", "SECTION CONTROLS", "KINEMATIC"),
    *("DISTRIBUTING", "HOURGLASS STIFFNESS", "DISTRIBUTION", "DISTRIBUTION TABLE", "FILTER", "TIME POINTS"),
    *("BEAM SECTION", "SURFACE SECTION", "PARAMETER"),
    *("BEAM GENERAL SECTION", "TRUSS SECTION", "CONNECTOR BEHAVIOR", "CONNECTOR ELASTICITY", "SURFACE PROPERTY"),
    *("MATERIAL", "ELASTIC", "DENSITY", "EXPANSION", "DAMPING", "CONDUCTIVITY", "SPECIFIC HEAT", "PLASTIC", "CREEP"),
    *("CYCLIC HARDENING", "DEPVAR", "USER MATERIAL", "HYPERELASTIC", "VISCOELASTIC", "POTENTIAL", "RATE DEPENDENT"),
    *("NODAL THICKNESS", "NODE PRINT", "NODE FILE", "EL PRINT", "EL FILE", "CONTACT PRINT", "CONTACT FILE", "OUTPUT"),
    *("NODE OUTPUT", "ELEMENT OUTPUT", "CONTACT OUTPUT", "SECTION PRINT", "END PART", "END INSTANCE", "STEP"),
)
Parts = dict[str, tuple[KeywordBlock, list[KeywordBlock]]]
Instances = list[tuple[str, str, KeywordBlock, list[KeywordBlock]]]


def add_materials(mesh: FileMesh, blocks: list[KeywordBlock]) -> None:
    """Properties by material, and what is left out of them."""
    current = ""
    tables: dict[str, dict[str, list[Row]]] = {}
    zeros: dict[str, float] = {}
    for block in blocks:
        if block.keyword in SCALING:
            raise block.refuse(SCALED)
        if block.keyword == "MATERIAL":
            current = block.needs("NAME")
            mesh.materials.setdefault(current, {})
        elif current and block.keyword in OTHER_LAWS:
            mesh.unread_materials.setdefault(current, f"*{block.keyword}")
        elif current and block.keyword in LAWS_LEFT_OUT:
            mesh.remark(current, f"material {current}: *{block.keyword} left out: linear and without damping")
        elif current and block.keyword in PROPERTIES:
            rows = _rows(mesh, current, block)
            if rows:
                tables.setdefault(current, {})[block.keyword] = rows
            if block.keyword == "EXPANSION" and len(rows) > 1:
                zeros[current] = float(numbers([block.parameters.get("ZERO", "0")], _refusal(block))[0])
    for material, properties in tables.items():
        mesh.materials[material] = material_of_tables(list(properties.values()))
        if material in zeros:
            mesh.materials[material]["mean_from"] = zeros[material]


def _refusal(block: KeywordBlock) -> Callable[[str], MeshFileError]:
    return lambda field: block.refuse(f"{field.strip()!r}: must be a number")


def _rows(mesh: FileMesh, material: str, block: KeywordBlock) -> list[Row]:
    """The constants over the temperature; one that is left out stays unknown, but the first must be there."""
    kind = block.parameters.get("TYPE", "").upper()
    short = (
        "" if kind in ISOTROPIC else "ORTHO" if kind in ORTHOTROPIC else "CONSTANTS" if kind in CONSTANTS else kind
    )
    names = NUMBERS.get((block.keyword, short))
    said = f"*{block.keyword}, TYPE={kind}"
    if names is None:
        if block.keyword == "ELASTIC":
            mesh.unread_materials[material] = said
        else:
            mesh.remark(material, f"material {material}: {said} left out: only isotropic and orthotropic are read")
        return []
    data = block.data
    if len(names) > PER_LINE:  # the ninth stands on a line of its own, with the temperature
        data = [",".join(line.strip().rstrip(",") for line in data[k : k + 2]) for k in range(0, len(data), 2)]
    if int(block.parameters.get("DEPENDENCIES", "0") or 0):
        on = "depends on fields beside the temperature: the first line is taken"
        mesh.remark(material, f"material {material}: *{block.keyword} {on}")
        data = data[:1]
    rows = [_row(block, names, line.split(",")) for line in data] or [_row(block, names, [""])]
    if len({temperature or 0.0 for temperature, _ in rows}) < len(rows):
        raise block.refuse("must have each temperature once")
    if short != "ORTHO" or block.keyword != "ELASTIC":
        return rows
    found = []
    for temperature, values in rows:
        constants = orthotropic_constants(symmetric([values[name] for name in names], PLACES))
        if constants is None:
            mesh.unread_materials[material] = f"{said} with a stiffness that is not positive definite"
            return []
        found.append((temperature, constants))
    return found


def _row(block: KeywordBlock, names: tuple[str, ...], fields: list[str]) -> Row:
    """The constants of a line and its temperature."""
    refusal = _refusal(block)
    given = {name: field for name, field in zip(names, fields, strict=False) if field.strip()}
    if len(names) > PER_LINE and len(given) < len(names):
        raise block.refuse(f"must have {len(names)} constants, {PER_LINE} in the first line")
    if names[0] not in given:
        raise block.refuse(f"must have the number of {names[0].replace('_', ' ')}")
    at = fields[len(names)] if len(fields) > len(names) else ""
    temperature = float(numbers([at], refusal)[0]) if at.strip() else None
    return temperature, {name: float(numbers([field], refusal)[0]) for name, field in given.items()}


def read_abaqus(path: str | Path) -> FileMesh:
    """Nodes, elements, sets, surfaces and materials of an input file."""
    blocks = keyword_blocks(path)
    sets = sum(block.keyword in ("NSET", "ELSET", "SURFACE") for block in blocks)
    if sets > MOST_SETS:
        raise MeshFileError(path, f"holds {sets} sets: at most {MOST_SETS} are read")
    for block in blocks:
        if block.keyword in GENERATORS:
            raise block.refuse(
                "makes or moves nodes or elements, which is not read: must be written out node by node, "
                "as the preprocessor or cgx exports the mesh"
            )
    model, parts, instances = _scopes(blocks)
    if not instances:  # parts without an assembly
        instances = [(name, name, block, []) for name, (block, _) in parts.items()]
    scopes: dict[str, Scope] = {"": Scope("")}
    contents: list[tuple[Scope, list[KeywordBlock]]] = []
    _take_mesh(scopes[""], model)
    for name, part, block, own in instances:
        if name.upper() in scopes:
            raise block.refuse(f"NAME={name} is given twice: must be distinct")
        if part.upper() not in {key.upper() for key in parts}:
            raise block.refuse(f"PART={part} is not defined")
        inner = next(blocks for key, (_, blocks) in parts.items() if key.upper() == part.upper())
        offset = max((scope.offset + scope.highest for scope in scopes.values()), default=0)
        rotation, translation = _placement(block) if block.keyword == "INSTANCE" else (np.eye(3), np.zeros(3))
        scope = Scope(name, offset, rotation, translation)
        _take_mesh(scope, [*inner, *own])
        scopes[name.upper()] = scope
        contents.append((scope, [*inner, *own]))
    contents.append((scopes[""], model))
    SetReader(scopes, contents)
    for scope, inner in contents:
        named = {block.needs("NAME").upper(): block for block in inner if block.keyword == "ORIENTATION"}
        scope.orientations.update(named)
    return _joined(path, blocks, list(scopes.values()))


def _take_mesh(scope: Scope, blocks: list[KeywordBlock]) -> None:
    for block in blocks:
        if block.keyword == "NODE":
            add_nodes(scope, block)
        elif block.keyword == "ELEMENT":
            add_elements(scope, block)


def _scopes(blocks: list[KeywordBlock]) -> tuple[list[KeywordBlock], Parts, Instances]:
    """Blocks of the model and its assembly, of each part, and of each instance."""
    model: list[KeywordBlock] = []
    parts: Parts = {}
    instances: Instances = []
    inside = model
    for block in blocks:
        if block.keyword == "PART":
            inside = []
            name = block.needs("NAME")
            if name in parts:
                raise block.refuse(f"NAME={name} is given twice: must be distinct")
            parts[name] = (block, inside)
        elif block.keyword == "INSTANCE":
            inside = []
            instances.append((block.needs("NAME"), block.needs("PART"), block, inside))
        elif block.keyword in ("END PART", "END INSTANCE"):
            inside = model
        elif block.keyword in MESH or block.keyword in SETS:
            inside.append(block)
    return model, parts, instances


def _placement(block: KeywordBlock) -> tuple[FloatArray, FloatArray]:
    """Rotation and translation of an instance: it is moved, then turned about an axis by an angle in degrees."""

    def refusal(field: str) -> MeshFileError:
        return block.refuse(f"{field.strip()!r}: must be a number")

    rows = [numbers([part for part in line.split(",") if part.strip()], refusal) for line in block.data]
    move = rows[0] if rows else np.zeros(3)
    if len(move) != 3 or len(rows) > 2 or (len(rows) == 2 and len(rows[1]) != 7):
        raise block.refuse("must have 3 numbers of a translation, then 7 of a rotation (two points and an angle)")
    if len(rows) < 2:
        return np.eye(3), move
    start, end, angle = rows[1][:3], rows[1][3:6], np.radians(rows[1][6])
    length = np.linalg.norm(end - start)
    if not length > 0:
        raise block.refuse("the axis of the rotation has no length: must be two distinct points")
    x, y, z = (end - start) / length
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    rotation = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross)
    return rotation, rotation @ (move - start) + start


def _joined(path: str | Path, blocks: list[KeywordBlock], scopes: list[Scope]) -> FileMesh:
    """One mesh of all scopes; names of an instance's sets carry its name where another scope has them too."""
    mesh = FileMesh(str(path))
    mesh.node_labels = np.concatenate([NO_LABELS, *(labels for scope in scopes for labels in scope.node_labels)])
    mesh.points = np.concatenate([np.empty((0, 3)), *(points for scope in scopes for points in scope.points)])
    mesh.elements = [elements for scope in scopes for elements in scope.elements]
    for scope in scopes:
        for elements in scope.plane:
            mesh.add_plane(elements.kind, elements.labels, elements.nodes)
        mesh.sections += [*scope.plane_sections, *(labels for labels, *_ in scope.sections)]
    spelled = _spelling(blocks)
    mesh.node_sets = dict(_named([(scope.name, scope.node_sets) for scope in scopes], spelled))
    mesh.element_sets = dict(_named([(scope.name, scope.element_sets) for scope in scopes], spelled))
    mesh.sides = dict(_named([(scope.name, scope.sides) for scope in scopes], spelled))
    _name_cut_faces(mesh, blocks)
    _name_contacts(mesh, blocks)
    for scope in scopes:
        mesh.temperatures |= scope.temperatures
    held = [np.concatenate([NO_LABELS, *(a for scope in scopes for a in scope.held.get(k, []))]) for k in (1, 2, 3)]
    mesh.name_held(np.intersect1d(np.intersect1d(held[0], held[1]), held[2]), "BOUNDARY")
    add_materials(mesh, blocks)
    _add_sections(mesh, scopes)
    mesh.notes += [note for scope in scopes for note in scope.notes]
    _leave_out(mesh, blocks, scopes)
    if len([scope for scope in scopes if scope.node_labels]) > 1:
        shifts = ", ".join(f"{scope.name} + {scope.offset}" for scope in scopes if scope.name)
        mesh.notes.append(f"several instances: their labels are shifted ({shifts})")
    return mesh


def _add_sections(mesh: FileMesh, scopes: list[Scope]) -> None:
    """Materials of the elements in the orientations of their part, or else of the model."""
    names = {name.upper(): name for name in mesh.materials}
    of_model = next(scope.orientations for scope in scopes if not scope.name)
    for scope in scopes:
        frames = of_model | scope.orientations
        for labels, material, orientation in scope.sections:
            if orientation and orientation.upper() not in frames:
                raise mesh.refuse(f"*ORIENTATION, NAME={orientation} is not defined")
            known = orientation and f"*ORIENTATION {orientation}", scope.name and f"instance {scope.name}"
            frame = " of ".join(filter(None, known))
            axes = partial(_turned_axes, frames.get(orientation.upper()), scope.rotation)
            take_material(mesh, labels, names.get(material.upper(), material), frame, axes)


def _turned_axes(block: KeywordBlock | None, rotation: FloatArray) -> FloatArray | None:
    """Axes of an orientation, or those of the file, in an instance that is turned."""
    axes = np.eye(3) if block is None else _axes(block)
    return None if axes is None else axes @ rotation.T


def _axes(block: KeywordBlock) -> FloatArray | None:
    """Directions of axes 1 and 2 of an *ORIENTATION, (2, 3): through a point and towards one; None of other kinds."""
    if block.parameters.get("SYSTEM", "RECTANGULAR").upper() not in ("RECTANGULAR", "R") or not block.data:
        return None
    if block.parameters.get("DEFINITION", "COORDINATES").upper() != "COORDINATES":
        return None  # nodes that move with the body, or those of each element
    points, turn = ([field.strip() or "0" for field in line.split(",")] for line in (*block.data[:2], "")[:2])
    if points[0][0].isalpha():  # a *DISTRIBUTION: other axes in each element
        return None
    a, b, c = numbers([*points, *["0"] * 9][:9], _refusal(block)).reshape(3, 3)
    third = np.cross(a - c, b - c)
    if not np.linalg.norm(third) > 0.0:
        raise block.refuse("the two points lie on one line: must span a plane")
    first, third = (a - c) / np.linalg.norm(a - c), third / np.linalg.norm(third)
    frame = np.array([first, np.cross(third, first), third])
    about, angle = numbers([*turn, "0"][:2], _refusal(block))  # turned about one of them, about 1 by default
    if about not in (0.0, 1.0, 2.0, 3.0):
        raise block.refuse(f"turned about axis {about:g}: must be about axis 1, 2 or 3")
    i, j = ((1, 2), (2, 0), (0, 1))[max(int(about), 1) - 1]
    cos, sin = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    frame[[i, j]] = cos * frame[i] + sin * frame[j], cos * frame[j] - sin * frame[i]
    return frame[:2]


def _name_cut_faces(mesh: FileMesh, blocks: list[KeywordBlock]) -> None:
    """Give the surfaces of all *TIE, CYCLIC SYMMETRY the names of cut faces, where the file has no such sets."""
    ties = [b for b in blocks if b.keyword == "TIE" and "CYCLIC SYMMETRY" in b.parameters]
    pairs = [[name.strip().upper() for name in line.split(",")[:2]] for tie in ties for line in tie.data]
    roles = ("cyclic_left", "cyclic_right")
    for table in (mesh.sides, mesh.node_sets, mesh.element_sets):
        known = {name.upper(): name for name in table}
        of_table = [[known[name] for name in pair] for pair in pairs if len(pair) == 2 and set(pair) <= known.keys()]
        if not of_table or {role.upper() for role in roles} & known.keys():
            continue
        for role, names in zip(roles, zip(*_same_way(mesh, table, of_table), strict=True), strict=True):
            table[role] = np.concatenate([table[name] for name in names])
        for one, other in of_table:
            mesh.notes.append(f"*TIE, CYCLIC SYMMETRY of {one} and {other}: the cut faces of a disk")
        return


def _same_way(mesh: FileMesh, table: dict[str, IntArray], pairs: list[list[str]]) -> list[list[str]]:
    """Pairs of surfaces in the order in which all turn the same way about the origin as the first."""
    labels = np.concatenate([elements.labels for elements in (*mesh.elements, *mesh.plane)] or [NO_LABELS])
    corner = np.concatenate([elements.nodes[:, 0] for elements in (*mesh.elements, *mesh.plane)] or [NO_LABELS])
    order = np.argsort(mesh.node_labels)

    def middle(name: str) -> FloatArray:
        members = table[name] if table is mesh.node_sets else corner[np.isin(labels, table[name])]
        rows = order[np.minimum(np.searchsorted(mesh.node_labels[order], members), len(order) - 1)]
        return np.asarray(mesh.points[rows].mean(axis=0)) if len(rows) else np.zeros(3)

    turns = [np.cross(middle(one), middle(other)) for one, other in pairs]
    return [pair if turn @ turns[0] >= 0.0 else pair[::-1] for pair, turn in zip(pairs, turns, strict=True)]


def _name_contacts(mesh: FileMesh, blocks: list[KeywordBlock]) -> None:
    """The pairs of surfaces of *CONTACT PAIR that are not tied."""
    known = {name.upper(): name for name in (*mesh.node_sets, *mesh.element_sets, *mesh.sides)}
    for block in blocks:
        if block.keyword == "CONTACT PAIR" and not {"TIED", "TIE"} & block.parameters.keys():
            for line in block.data:
                pair = [known.get(name.strip().upper(), "") for name in line.split(",")[:2]]
                if len(pair) == 2 and all(pair):
                    mesh.contacts.append((pair[0], pair[1]))


def _leave_out(mesh: FileMesh, blocks: list[KeywordBlock], scopes: list[Scope]) -> None:
    """Say which elements, constraints and unknown keywords are left out."""
    found: dict[str, dict[str, int]] = {}
    for scope in scopes:
        for name, count in scope.left_out.items():
            effect = next((effect for start, effect in _ELEMENTS if name.startswith(start)), "bodies")
            counts = found.setdefault(effect, {})
            counts[name] = counts.get(name, 0) + count
    inside_step = False
    for block in blocks:
        inside_step = block.keyword == "STEP" or (inside_step and block.keyword != "END STEP")
        effect = LEFT_OUT.get(block.keyword, "unknown")
        if block.keyword == "TIE" and "CYCLIC SYMMETRY" in block.parameters:
            effect = "cyclic"
        tied = block.keyword == "CONTACT PAIR" and ("TIED" in block.parameters or "TIE" in block.parameters)
        known = block.keyword in (*MESH, *SETS, *_KNOWN) or block.keyword in ("PART", "INSTANCE", "END STEP")
        if effect == "unknown" and (known or inside_step):
            continue
        counts = found.setdefault("ties" if tied else effect, {})
        counts[f"*{block.keyword}"] = counts.get(f"*{block.keyword}", 0) + _definitions(block)
    for effect, counts in found.items():
        mesh.leave_out(effect, counts)


def _definitions(block: KeywordBlock) -> int:
    """How many definitions a block has: one for each data line, but one for each equation, and at least one."""
    if block.keyword == "EQUATION":  # the number of its terms stands on a line of its own
        return max(1, sum("," not in line.strip().rstrip(",") for line in block.data))
    return max(1, len(block.data)) if block.keyword in ("MPC", "TIE", "BOUNDARY") else 1


def _spelling(blocks: list[KeywordBlock]) -> dict[str, str]:
    """Names as first written, by their upper case."""
    spelled: dict[str, str] = {}
    for block in blocks:
        for key in ("NSET", "ELSET", "NAME"):
            name = block.parameters.get(key, "")
            spelled.setdefault(name.upper(), name)
    return spelled


def _named(
    scopes: list[tuple[str, dict[str, list[IntArray]]]], spelled: dict[str, str]
) -> Iterator[tuple[str, IntArray]]:
    for scope, sets in scopes:
        for name, arrays in sets.items():
            shared = sum(name in others for _, others in scopes) > 1
            written = spelled.get(name, name)
            if arrays:
                yield (f"{scope}.{written}" if shared and scope else written), np.concatenate(arrays)

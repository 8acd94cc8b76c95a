"""A mesh from elsewhere taken for a sector, and what was found on the way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from geometry.elements import ElementSides, IntArray
from geometry.errors import OwnMeshError
from geometry.frames import axes_through, distance_from_axis
from geometry.imported_mesh import ImportedMesh
from geometry.own_mesh.body import (
    boundary,
    check_orientation,
    checked_body,
    chosen_sides,
    names_of_file,
    nodes_with_mid_sides,
    side_corners,
)
from geometry.own_mesh.face_pairing import (
    FaceNames,
    FacePair,
    Surface,
    check_places,
    closing_number,
    contact_faces,
    on_ground,
    pair_faces,
)
from geometry.own_mesh.interfaces import (
    LEFT,
    RIGHT,
    TouchingFaces,
    check_held,
    named_faces,
    of_kind,
    ordered,
    patches,
)
from geometry.own_mesh.matching_faces import (
    CutFaces,
    cut_faces,
    find_faces,
    find_root,
    paired_cuts,
    with_cut_names,
    with_other_faces,
    without,
)
from geometry.own_mesh.pitch_pairs import matched_pairs
from geometry.own_mesh.sector_choice import MAIN, NO_CONTACT, SectorChoice
from geometry.own_mesh.side_quadrature import quadrature, side_tables
from geometry.sector import FacePair as SectorPair
from geometry.sector import FloatArray, SectorMesh
from geometry.units import UNIT_SYSTEMS, check_size

_ROUND_OFF = 1e-9


@dataclass(frozen=True)
class SectorFindings:
    """How well the faces of a sector fit."""

    matching: bool  # whether the nodes of the faces are pairs under the pitch
    # largest distance, across the normal, from a node of the right face turned back by one pitch to the nearest node
    # of the left face, m
    mismatch: float
    gap: tuple[float, float]  # smallest and largest distance along the normal, m; above 0 the faces are apart
    overlap: float  # share of the area of either face that has the other opposite
    areas: tuple[float, float]  # areas of the right and the left face, m^2
    normal_angle: float  # largest angle between a normal and the opposite one, degrees
    rotation: FloatArray  # (3, 3) our axes x, y, z in the axes of the file, row by row
    notes: tuple[str, ...] = ()  # what was left out, swapped or assumed, one line each
    warnings: tuple[str, ...] = ()  # what is probably a mistake in the input, one line each

    @property
    def lines(self) -> tuple[str, ...]:
        """The findings as short lines of text."""
        fit, areas = _fit_lines(self)
        return (
            *(f"warning: {warning}" for warning in self.warnings),
            *([f"faces: {fit}", f"areas: {areas}"] if self.areas[0] else []),
            _rotation_text(self.rotation),
            *self.notes,
        )


def _fit_lines(pair: SectorFindings | FacePair) -> tuple[str, str]:
    """How two faces fit: nodes and gap; areas and normals."""
    matching = pair.matching if isinstance(pair, SectorFindings) else pair.partner is not None
    low, high = (f"{round(1e6 * gap, 3) + 0.0:.3g}" for gap in pair.gap)
    gap = f"gap {low} to {high} um" if low != high else f"gap {low} um"
    shared = "" if pair.overlap > 0.995 else f"; {100.0 * pair.overlap:.3g} % of the area is opposite"
    right, left = (f"{1e6 * area:.6g}" for area in pair.areas)
    nodes = "nodes match" if matching else "nodes do not match"
    return (
        f"{nodes}, largest mismatch {round(1e6 * pair.mismatch, 6):.3g} um; {gap}{shared}",
        f"right {right} mm^2, left {left} mm^2; normals opposite to {round(pair.normal_angle, 3):.2g} degrees",
    )


def _rotation_text(rotation: FloatArray) -> str:
    """The rotation in words."""
    if np.array_equal(rotation, np.eye(3)):
        return "axes of the file kept"
    names = [_row(row) for row in rotation]
    return f"axes: x, y, z here = {', '.join(names)} in the file"


def _row(row: FloatArray) -> str:
    for k, axis in enumerate("xyz"):
        if abs(abs(row[k]) - 1.0) < _ROUND_OFF:
            return axis if row[k] > 0.0 else f"-{axis}"
    return f"({', '.join(f'{value:.4g}' for value in row)})"


@dataclass(frozen=True)
class OwnSector:
    """A sector made of a mesh from elsewhere."""

    sector: SectorMesh  # the mesh in SI units and in our axes; sets and surfaces of the file keep their names
    findings: SectorFindings  # how well the faces fit, and what was found or left out
    materials: Mapping[str, Mapping[str, Any]]  # materials of the file in SI units
    material_notes: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # by material, as of `ImportedMesh`
    # materials that are not isotropic and elastic, and what they are
    unread_materials: Mapping[str, str] = field(default_factory=dict)
    units: tuple[str, ...] = ()  # systems of units that the file says it is in


def sector_from_mesh(mesh: ImportedMesh, choice: SectorChoice) -> OwnSector:
    """Take a mesh from elsewhere for a sector: SI units, our axes, faces paired, contact points, frames and areas."""
    mesh, notes = checked_body(mesh, several=bool(choice.interfaces))
    mesh, choice, renamed = _with_names_of_file(mesh, choice)
    mesh, choice, cut_names = with_cut_names(mesh, choice)
    metres = choice.metres
    mesh = replace(mesh, points=(mesh.points - np.asarray(choice.axis_point, dtype=float)) * metres)
    check_size(float(distance_from_axis(choice.direction, mesh.points).max()), choice.unit)
    outside = boundary(mesh.blocks)
    check_orientation(mesh.path, mesh.points, mesh.blocks, outside)
    cuts = cut_faces(mesh, choice, outside)
    shown = outside if cuts is None else without((cuts.right, cuts.left), outside)
    _check_distinct(choice, cuts)
    mesh, faces, rotation, found, doubts = _turned(mesh, choice, shown, cuts)
    sides = [each for face in faces for _, each in face.sides]
    cuts, others = with_other_faces(mesh, choice, outside, sides, of_kind(faces, "neighbours"), cuts)
    joined, of_cuts = ({}, []) if cuts is None else paired_cuts(mesh.points, mesh, cuts, choice.n_blades)
    root, how = _root(mesh, choice, outside, faces, joined=cuts is not None)
    pairs = {face.name: _paired(mesh, face, choice) for face in faces}
    sector = _assembled(mesh, choice, (faces, pairs), {"root": root, **joined}, outside)
    floating = check_held(mesh.path, sector, np.concatenate([root, *joined.values()]))
    said = [*_without_materials(mesh.notes), *notes, *renamed, *cut_names, *found, *others, *of_cuts, *how, *floating]
    first, *further = pairs.items()
    lines = [f"{name}: {line}" for name, pair in further for line in _fit_lines(pair)]
    findings = SectorFindings(
        matching=first[1].partner is not None,
        mismatch=first[1].mismatch,
        gap=first[1].gap,
        overlap=first[1].overlap,
        areas=(0.0, 0.0) if first[0] == NO_CONTACT else first[1].areas,
        normal_angle=first[1].normal_angle,
        rotation=rotation,
        notes=(*lines, *said, *dict.fromkeys(each for pair in pairs.values() for each in _remarks(pair))),
        warnings=(*mesh.warnings, *doubts, *_warnings(pairs, choice.n_blades)),
    )
    materials = _in_si(mesh.materials, choice.unit, rotation)
    return OwnSector(sector, findings, materials, mesh.material_notes, mesh.unread_materials, mesh.units)


def _in_si(materials: Mapping[str, Mapping[str, Any]], unit: str, rotation: FloatArray) -> dict[str, dict[str, Any]]:
    """Materials of a file in Pa and kg/m^3, their axes in ours; `rotation` (3, 3): from the axes of the file."""
    system = UNIT_SYSTEMS[unit]

    def converted(key: str, value: Any) -> Any:
        if key == "at":
            return [{name: converted(name, each) for name, each in row.items()} for row in value]
        if key == "axes":
            return (np.asarray(value) @ rotation.T).tolist()
        return value * (system.pressure if "modulus" in key else system.density if key == "density" else 1.0)

    return {name: {key: converted(key, value) for key, value in of.items()} for name, of in materials.items()}


def _with_names_of_file(mesh: ImportedMesh, choice: SectorChoice) -> tuple[ImportedMesh, SectorChoice, list[str]]:
    """The choice with the names of sets as the file writes them, and notes."""
    sets, notes = names_of_file(mesh, choice.sets)
    interfaces = {}
    for name, each in choice.interfaces.items():
        right, left = (f"mesh.interface.{name}.{side}" for side in ("right", "left"))
        given = {right: each.right} | ({} if each.left is None else {left: each.left})
        known, more = names_of_file(mesh, given)
        interfaces[name] = replace(each, right=known[right], left=known.get(left))
        notes += more
    return mesh, replace(choice, sets=sets, interfaces=interfaces), notes


def _paired(mesh: ImportedMesh, face: TouchingFaces, choice: SectorChoice) -> FacePair:
    """Two faces paired, or one with the ground."""
    right, left = _surface(mesh, face.right), _surface(mesh, face.left)
    return on_ground(right) if face.kind == "ground" else pair_faces(right, left, choice, face.kind, face.of)


def _without_materials(notes: tuple[str, ...]) -> list[str]:
    """Notes of a file but those on its materials, which go with the materials."""
    return [note for note in notes if not note.startswith("material ")]


def _check_distinct(choice: SectorChoice, cuts: CutFaces | None) -> None:
    """Raise OwnMeshError where a set is named as a cut face and as a contact face."""
    for role in (RIGHT, LEFT):
        name = choice.sets.get(role)
        if cuts is not None and name in cuts.names:
            told = "is named as a cut face too: must be joined to the neighbour, or touch its face"
            raise OwnMeshError(f"mesh.sets.{role}", name, told)


def _turned(
    mesh: ImportedMesh, choice: SectorChoice, outside: ElementSides, cuts: CutFaces | None
) -> tuple[ImportedMesh, list[TouchingFaces], np.ndarray, list[str], list[str]]:
    """The mesh in our axes, faces by patches, the rotation, notes and warnings; the origin is on the axis.

    A sector that is joined at its cut faces may be without contact.
    """
    notes: list[str] = []
    doubts: list[str] = []
    faces = named_faces(mesh, choice, outside)
    if not faces:
        points = mesh.points @ axes_through(choice.direction, mesh.points.mean(axis=0)).T
        names = FaceNames(), f"mesh.sets.{RIGHT}"
        if cuts and not matched_pairs(points, mesh.blocks, outside, 2.0 * np.pi / choice.n_blades):
            faces = [_no_faces(points, mesh, outside, cuts)]
            doubts = [f"no contact: name {RIGHT} and {LEFT} where blades touch; their surfaces are not a pitch apart"]
        else:
            right, left, doubts = find_faces(points, mesh.blocks, outside, choice.n_blades)
            notes.append(f"contact faces found: {len(right)} element faces each, the only ones a pitch apart")
            faces = [TouchingFaces(MAIN, "neighbours", right, left, choice.contact_grid, *names)]
    at = [quadrature(mesh.points, side_tables(mesh.blocks, face)) for face in (faces[0].right, faces[0].left)]
    if faces[0].kind == "neighbours":
        check_places(at[0], at[1], choice)
    middle = (at[0].centroid + at[1].centroid) / 2.0 if faces[0].name != NO_CONTACT else mesh.points.mean(axis=0)
    rotation = axes_through(choice.direction, middle)
    if not np.array_equal(rotation, np.eye(3)):
        mesh = replace(mesh, points=mesh.points @ rotation.T)
    found = []
    for each in faces:
        face, swapped = ordered(mesh, each)
        notes += swapped
        found += [face] if face.of == FaceNames() else patches(mesh, face, choice.n_blades)
    return mesh, found, rotation, notes, doubts


def _no_faces(points: FloatArray, mesh: ImportedMesh, outside: ElementSides, cuts: CutFaces) -> TouchingFaces:
    """The outermost side of an element as a face that nothing touches: models have a contact node.

    OwnMeshError where cut faces hold the nodes of all: no node would move apart from the neighbours.
    """
    corners = side_corners(mesh.blocks, outside)
    joined = np.concatenate([cut.nodes(mesh.blocks) for cut in (cuts.right, cuts.left)])
    inside = ~np.isin(corners, joined).all(axis=1)
    if not inside.any():
        told = "must leave nodes between the cut faces: this sector is one element wide, without a blade; refine it"
        raise OwnMeshError("mesh.sets.cyclic_right", cuts.names[0], told)
    radius = np.where(inside, np.hypot(*points[corners, 1:].transpose(2, 0, 1)).mean(axis=1), 0.0)
    side = chosen_sides(outside, np.array([radius.argmax()]))
    return TouchingFaces(NO_CONTACT, "ground", side, side, (1, 1), FaceNames(), "mesh.sets.tip")


def _root(
    mesh: ImportedMesh,
    choice: SectorChoice,
    outside: ElementSides,
    faces: list[TouchingFaces],
    *,
    joined: bool,
) -> tuple[IntArray, list[str]]:
    """Clamped nodes, none with a free bore, and how they were found; OwnMeshError where a contact face is clamped.

    `joined`: whether the sector has cut faces.
    """
    if choice.bore == "free":
        return _nothing_held(choice, joined)
    notes = []
    if "root" in choice.sets:
        root = nodes_with_mid_sides(mesh, "root", choice.sets["root"], outside)
    else:
        surface = find_root(mesh.points, mesh.blocks, outside)
        root = surface.nodes(mesh.blocks)
        radius = np.hypot(*mesh.points[root, 1:].T)
        where = f"radius {radius.min():.4g} to {radius.max():.4g} m"
        free = '; bore = "free" leaves it free' if joined else ""
        notes.append(f"root found: the innermost surface, {len(surface)} element faces at {where}{free}")
    for key, face in (each for touching in faces for each in touching.sides):
        role = key.removeprefix("mesh.sets.").removeprefix("mesh.")
        held = np.isin(side_corners(mesh.blocks, face), root)
        if held.all(axis=1).any():
            told = f"must not hold a contact face: {int(held.all(axis=1).sum())} element faces of {role} are in it"
            raise OwnMeshError("mesh.sets.root", choice.sets.get("root"), told)
        if held.any():
            notes.append(f"{role} touches the clamped root along an edge")
    if len(root) < 3 or np.linalg.matrix_rank(mesh.points[root] - mesh.points[root].mean(axis=0), tol=1e-9) < 2:
        told = f"must hold the blade: three nodes that are not on one line; it has {len(root)}"
        raise OwnMeshError("mesh.sets.root", choice.sets.get("root"), told)
    return root, notes


def _nothing_held(choice: SectorChoice, joined: bool) -> tuple[IntArray, list[str]]:
    """No clamped nodes, and a note; OwnMeshError for a blade alone, and where a root is named."""
    if not joined and not choice.interfaces:
        told = "needs the cut faces of a disk, cyclic_right and cyclic_left: a blade alone is clamped at its root"
        raise OwnMeshError("mesh.bore", choice.bore, told)
    if "root" in choice.sets:
        raise OwnMeshError("mesh.sets.root", choice.sets["root"], 'must not be named with bore = "free"')
    return np.zeros(0, dtype=np.int64), ["the disk is free: nothing holds it"] if joined else ["nothing is clamped"]


def _assembled(
    mesh: ImportedMesh,
    choice: SectorChoice,
    touching: tuple[list[TouchingFaces], dict[str, FacePair]],
    own_sets: dict[str, IntArray],
    outside: ElementSides,
) -> SectorMesh:
    """The sector, with the sets of the file beside ours; `touching`: faces, and how they are paired, by name."""
    made = {}
    for face in touching[0]:
        right, left = contact_faces(touching[1][face.name], face.grid, own_sets["root"])
        nodes = face.right.nodes(mesh.blocks), face.left.nodes(mesh.blocks)
        made[face.name] = SectorPair(right, left, *nodes, face.kind)
    first = touching[0][0]
    main = made.pop(first.name)
    named = {"face_right": main.face_right, "face_left": main.face_left}
    contact = {RIGHT: main.right.nodes, LEFT: main.left.nodes}
    tip = {"tip": np.array([_tip(mesh, choice, outside)], dtype=np.int64)}
    sets = {**mesh.node_sets, **named, **contact, **tip, **own_sets}
    surfaces = {**mesh.surfaces, "face_right": first.right, "face_left": first.left}
    points, blocks, n_blades = mesh.points, mesh.blocks, int(choice.n_blades)
    faces = main.right, main.left
    sector = SectorMesh(points, blocks, sets, *faces, n_blades, surfaces, made, first.name, first.kind)
    return replace(sector, temperature=mesh.temperature)


def _tip(mesh: ImportedMesh, choice: SectorChoice, outside: ElementSides) -> int:
    """The node of the tip nearest to its middle; without a name, the outermost node nearest to the stacking axis."""
    if "tip" in choice.sets:
        nodes = nodes_with_mid_sides(mesh, "tip", choice.sets["tip"], outside)
        middle = mesh.points[nodes].mean(axis=0)
    else:
        radius = np.hypot(mesh.points[:, 1], mesh.points[:, 2])
        nodes = np.flatnonzero(radius > radius.max() - 1e-3 * np.ptp(radius))
        middle = mesh.points[nodes].mean(axis=0) * [1.0, 0.0, 1.0]
    return int(nodes[np.argmin(np.linalg.norm(mesh.points[nodes] - middle, axis=1))])


def _surface(mesh: ImportedMesh, face: ElementSides) -> Surface:
    return Surface(mesh.points, face.nodes(mesh.blocks), side_tables(mesh.blocks, face))


def _warnings(pairs: dict[str, FacePair], n_blades: int) -> list[str]:
    """Whether another number of blades closes the gap or the overlap of faces between neighbours."""
    found = []
    for name, pair in pairs.items():
        other = closing_number(pair.right.samples(), pair.left.samples(), n_blades) if pair.turn else None
        if other is not None:
            what, size = ("a gap" if sum(pair.gap) > 0.0 else "an overlap"), 1e6 * max(map(abs, pair.gap))
            faces = "the contact faces" if name == MAIN else f"the faces of {name}"
            told = f"n_blades = {n_blades} leaves {what} of {size:.3g} um between {faces}"
            found.append(f"{told}; with n_blades = {other} they touch")
    return found


def _remarks(pair: FacePair) -> list[str]:
    """What a user should know about the faces."""
    remarks: list[str] = []
    if pair.gap[0] < -1e-9 - 1e-3 * np.sqrt(pair.areas[0]):
        remarks.append(f"the faces overlap by up to {-1e6 * pair.gap[0]:.3g} um in the mesh")
    if pair.partner is None:
        remarks.append('contact dofs "mortar" or "patch" tie faces whose nodes are no pairs')
    return remarks

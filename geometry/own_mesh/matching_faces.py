"""Faces found by geometry or by the names of sets: root, contact faces, and the cut faces of the sector of a disk."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from geometry.elements import ElementBlock, ElementSides, IntArray
from geometry.errors import OwnMeshError
from geometry.frames import rotate_about_axis
from geometry.imported_mesh import ImportedMesh
from geometry.own_mesh.body import chosen_sides, face_sides, side_corners
from geometry.own_mesh.pitch_pairs import Pair, fitting_number, listed, matched_pairs
from geometry.own_mesh.sector_choice import SectorChoice
from geometry.sector import FloatArray

RIGHT_IS = "right is the one on the +y side, where the next blade is; the file may stay as it is"

_INNERMOST = 1e-4  # of the radial extent of the mesh: nodes of the root are within this of the hub or of its plane
CUT_RIGHT, CUT_LEFT = "cyclic_right", "cyclic_left"
# words for the two sides in names of sets; one letter or digit counts at the end of a name
_SIDES = (
    *(("right", "left"), ("high", "low"), ("plus", "minus"), ("positive", "negative"), ("pos", "neg")),
    *(("upper", "lower"), ("next", "prev"), ("master", "slave"), ("source", "target"), ("hi", "lo")),
    *((r"(?<=[^a-z])h$", "l"), (r"(?<=[mu]\d\d)h$", "l"), (r"(?<=[^a-z])r$", "l")),
    *((r"(?<=[^a-z])b$", "a"), (r"(?<=[^\d])2$", "1"), (r"(?<=[^a-z])p$", "m")),
)
_ANSYS = re.compile(r"_[mu]\d\d[hl]$")  # matched or unmatched node patterns, number of the pair, high or low
_CUT_NAME = re.compile(
    r"cyc|period|(?<![a-z])cut(?![a-z])|(left|right)[_ -]?boundary|boundary[_ -]?(left|right)|_[mu]\d\d[hl]$"
)
_PLAIN = re.compile(r"^((sector|edge|side|boundary|face)?[ _-]?)(high|hi)([ _-]?(sector|edge|side|boundary|face)?)$")
_BESIDE = 0.02  # of the radial extent of the mesh: as far may sides of one shroud be from the radius of its contact
_LARGER = 1.0  # radial extents of the contact face: as far may sides that border on it reach beyond
_MATCH = 1e-5  # of the size of a face: largest distance of two nodes that are one


def find_root(points: FloatArray, blocks: tuple[ElementBlock, ...], outside: ElementSides) -> ElementSides:
    """The innermost cylindrical or plane surface of the boundary, of points (N, 3) with the axis x.

    Raises OwnMeshError where there is none.
    """
    corners = side_corners(blocks, outside)
    radius = np.hypot(points[:, 1], points[:, 2])
    middle = points[np.argmin(radius)] * [0.0, 1.0, 1.0]
    mean = np.array([0.0, *points[:, 1:].mean(axis=0)])
    for direction in (middle, mean):
        for depth in (radius, points @ (direction / (np.linalg.norm(direction) or 1.0))):
            held = depth < depth.min() + _INNERMOST * np.ptp(radius)
            rows = np.flatnonzero(held[corners].all(axis=1))
            if len(rows):
                return chosen_sides(outside, rows)
    told = "name the clamped nodes; the body has no innermost cylindrical or plane surface"
    raise OwnMeshError("mesh.sets.root", None, told)


def find_faces(
    points: FloatArray, blocks: tuple[ElementBlock, ...], outside: ElementSides, n_blades: int
) -> tuple[ElementSides, ElementSides, list[str]]:
    """Right and left face: the only connected pair of surfaces that one pitch turns into each other; doubts.

    Raises OwnMeshError where there is none, or more than one, or where they are parts of larger surfaces.
    """
    found = matched_pairs(points, blocks, outside, 2.0 * np.pi / n_blades)
    key = "mesh.sets.contact_right"
    if not found:
        told = f"name the faces: no two surfaces of the body are one pitch ({360.0 / n_blades:.6g} degrees) apart"
        other = fitting_number(points, blocks, outside)
        told += f"; they would be with n_blades = {other}" if other else ""
        raise OwnMeshError(key, None, told)
    radius = np.hypot(*points[np.unique(side_corners(blocks, outside)), 1:].T)
    innermost = radius.min() + _INNERMOST * np.ptp(radius)
    down = [pair for pair in found if pair.radius[0] < innermost]
    if len(found) > 1 or not found[0].whole:
        what = f"{len(found)} pairs of surfaces are" if len(found) > 1 else "1 pair of surfaces is"
        told = f"name the faces: {what} one pitch apart: {listed(found)}"
        if down:
            told += "; what reaches the innermost radius may be cut faces of a disk: cyclic_right and cyclic_left"
        raise OwnMeshError(key, None, told)
    doubts = [
        f"the contact faces found reach the innermost radius ({found[0]}): if they are the cut faces of a disk, name "
        "them cyclic_right and cyclic_left"
    ]
    return chosen_sides(outside, found[0].right), chosen_sides(outside, found[0].left), doubts if down else []


@dataclass(frozen=True)
class CutFaces:
    """Cut faces by their sides and by their names in the file."""

    # `right`, `left`: their sides; the right one is on the +y side once `ordered`
    right: ElementSides
    left: ElementSides
    names: tuple[str, str]  # sets of the file


def named_cuts(names: Iterable[str]) -> list[tuple[str, str]]:
    """Pairs of set names that say that the sets are the cut faces of a sector.

    Returns right and left name, the surest pair first: `cyclic_right` and `cyclic_left`; the components of the Ansys
    command CYCLIC, `NAME_M01H` and `NAME_M01L`; any two names with "cyclic", "periodic" or "cut" that differ in right
    and left, high and low, ... alone.
    """
    return [pair for pair in _paired_names(names) if _CUT_NAME.search(pair[0].lower())]


def _paired_names(names: Iterable[str]) -> list[tuple[str, str]]:
    """Pairs of names that differ in the word for the side alone; those of cut faces by their very names first."""
    by_lower = {name.lower(): name for name in names}
    found: dict[frozenset[str], tuple[str, str]] = {}
    for right, left in _SIDES:
        for name in by_lower:
            for at in re.finditer(right, name):
                other = name[: at.start()] + left + name[at.end() :]
                if other in by_lower and other != name:
                    found.setdefault(frozenset((name, other)), (by_lower[name], by_lower[other]))
    return sorted(found.values(), key=lambda pair: (pair[0].lower() != CUT_RIGHT, not _ANSYS.search(pair[0].lower())))


def with_cut_names(mesh: ImportedMesh, choice: SectorChoice) -> tuple[ImportedMesh, SectorChoice, list[str]]:
    """The choice with the names of cut faces that the file has, where it names neither; the mesh with these sets.

    Sets that the choice uses otherwise are none. Names with high and low alone are taken where contact faces are
    named. Several pairs of components of one name are joined in one set.
    """
    if CUT_RIGHT in choice.sets or CUT_LEFT in choice.sets:
        return mesh, choice, []
    names = [name for name in (*mesh.node_sets, *mesh.surfaces) if name not in choice.sets.values()]
    found = named_cuts(names)
    if not found and {"contact_right", "contact_left"} <= choice.sets.keys():
        found = [pair for pair in _paired_names(names) if _PLAIN.search(pair[0].lower())]
    if not found:
        return mesh, choice, []
    several = [pair for pair in found if _ANSYS.search(pair[0].lower())]
    if len(several) < 2 or several[0] != found[0]:
        several = found[:1]
    right, left = (" + ".join(pair[k] for pair in several) for k in (0, 1))
    if len(several) > 1:
        joined = {
            name: np.unique(np.concatenate([_nodes_of(mesh, pair[k]) for pair in several]))
            for k, name in enumerate((right, left))
        }
        mesh = replace(mesh, node_sets={**mesh.node_sets, **joined})
    choice = replace(choice, sets={**choice.sets, CUT_RIGHT: right, CUT_LEFT: left})
    said = [f'cut faces of a disk: "{right}" and "{left}", by their names'] * (right.lower() != CUT_RIGHT)
    return mesh, choice, said


def _nodes_of(mesh: ImportedMesh, name: str) -> IntArray:
    return mesh.surfaces[name].nodes(mesh.blocks) if name in mesh.surfaces else mesh.node_sets[name]


def cut_faces(mesh: ImportedMesh, choice: SectorChoice, outside: ElementSides) -> CutFaces | None:
    """The cut faces that are named, without sides of named contact faces; None for a blade alone.

    Raises OwnMeshError where one is missing or is no face.
    """
    roles = [role for role in (CUT_RIGHT, CUT_LEFT) if role in choice.sets]
    if not roles:
        return None
    if len(roles) == 1:
        missing = CUT_LEFT if roles[0] == CUT_RIGHT else CUT_RIGHT
        raise OwnMeshError(f"mesh.sets.{missing}", None, "name both cut faces of the disk, or neither")
    names = choice.sets[CUT_RIGHT], choice.sets[CUT_LEFT]
    sides = [face_sides(mesh, role, choice.sets[role], outside) for role in (CUT_RIGHT, CUT_LEFT)]
    contact = [face_sides(mesh, r, n, outside) for r, n in choice.sets.items() if r.startswith("contact")]
    right, left = (without(contact, cut) if len(without(contact, cut)) else cut for cut in sides)
    return CutFaces(right, left, names)


def without(faces: Iterable[ElementSides], outside: ElementSides) -> ElementSides:
    """The boundary but for some faces."""
    cut = {key for face in faces for key in _keys(face)}
    return chosen_sides(outside, np.array([k for k, key in enumerate(_keys(outside)) if key not in cut], dtype=int))


def with_other_faces(
    mesh: ImportedMesh,
    choice: SectorChoice,
    outside: ElementSides,
    contact: Sequence[ElementSides],
    shroud: ElementSides | None,
    cuts: CutFaces | None,
) -> tuple[CutFaces | None, list[str]]:
    """The cut faces, with those of `choice.other_faces`, and notes on surfaces that match but that nobody has named.

    The mesh is in our axes. Sides beside the right face of a `shroud`, at its radius, belong to the same shroud.
    Raises OwnMeshError where there are others and the choice does not say what they are.
    """
    rest = without((*contact, *(() if cuts is None else (cuts.right, cuts.left))), outside)
    pitch = 2.0 * np.pi / choice.n_blades
    found = matched_pairs(mesh.points, mesh.blocks, rest, pitch)
    beside = [] if shroud is None else _beside(mesh, rest, shroud, found)
    others = [pair for k, pair in enumerate(found) if k not in beside]
    told = listed([found[k] for k in beside])
    notes = [f"free element faces beside the contact faces match under the pitch too: {told}"] if beside else []
    if not others:
        return cuts, notes
    if choice.other_faces == "free":
        return cuts, [*notes, f"free surfaces that match under the pitch: {listed(others)}"]
    if choice.other_faces == "cut":
        sides = [
            chosen_sides(rest, np.concatenate([getattr(pair, side) for pair in others])) for side in ("right", "left")
        ]
        if cuts is not None:
            sides = [together(a, b) for a, b in zip(sides, (cuts.right, cuts.left), strict=True)]
        return CutFaces(sides[0], sides[1], ("found", "found")), [*notes, f"cut faces found: {listed(others)}"]
    what = "pair of surfaces matches" if len(others) == 1 else "pairs of surfaces match"
    told = f"{len(others)} more {what} under the pitch of {360.0 / choice.n_blades:.6g} degrees: "
    told += "; ".join(f"{pair}{_set_names(mesh, rest, pair)}" for pair in others[:4])
    told += "; name cut faces of a disk cyclic_right and cyclic_left, or say what all of them are: "
    told += 'mesh.other_faces = "cut" (joined to the neighbours) or "free"'
    raise OwnMeshError("mesh.sets", None, told)


def _beside(mesh: ImportedMesh, sides: ElementSides, contact: ElementSides, pairs: list[Pair]) -> list[int]:
    """Which pairs lie at the radius of a contact face or border on it, and are not much larger: of one shroud."""
    radius = np.hypot(*mesh.points[:, 1:].T)
    slack, nodes = _BESIDE * float(np.ptp(radius)), contact.nodes(mesh.blocks)
    low, high = float(radius[nodes].min()), float(radius[nodes].max())
    reach = slack + _LARGER * (high - low)
    found: list[int] = []
    while True:
        more = [
            k
            for k, pair in enumerate(pairs)
            if k not in found
            and low - reach < pair.radius[0]
            and pair.radius[1] < high + reach
            and (
                (low - slack < pair.radius[0] and pair.radius[1] < high + slack)
                or np.isin(chosen_sides(sides, pair.right).nodes(mesh.blocks), nodes).any()
            )
        ]
        if not more:
            return found
        found += more
        nodes = np.concatenate([nodes, *(chosen_sides(sides, pairs[k].right).nodes(mesh.blocks) for k in more)])


def together(one: ElementSides, other: ElementSides) -> ElementSides:
    names = ("block", "element", "side")
    return ElementSides(*(np.concatenate([getattr(one, name), getattr(other, name)]) for name in names))


def _set_names(mesh: ImportedMesh, sides: ElementSides, pair: Pair) -> str:
    """Names of sets that hold one face of a pair and no more than a few nodes else, in words; "" for none."""
    found = []
    for rows in (pair.right, pair.left):
        nodes = chosen_sides(sides, rows).nodes(mesh.blocks)
        for name in dict.fromkeys((*mesh.surfaces, *mesh.node_sets)):
            own = _nodes_of(mesh, name)
            if len(own) < 2 * len(nodes) and np.isin(nodes, own).mean() > 0.9:
                found.append(f'"{name}"')
    return f" (sets {', '.join(found)})" if found else ""


def paired_cuts(
    points: FloatArray, mesh: ImportedMesh, cuts: CutFaces, n_blades: int
) -> tuple[dict[str, IntArray], list[str]]:
    """Nodes of the right and of the left face as sets, and notes; points (N, 3) with the engine axis x.

    Raises OwnMeshError where the left face turned by one pitch is not the right one.
    """
    right, left = (np.unique(face.nodes(mesh.blocks)) for face in (cuts.right, cuts.left))
    notes = []
    apart = _apart(points, right, left)
    if apart < 0.0:
        right, left, apart = left, right, -apart
        notes.append(f"right and left cut face swapped: {RIGHT_IS}")
    pitch = 2.0 * np.pi / n_blades
    mismatch, worst = _mismatch(points, right, left, pitch)
    if mismatch > _MATCH or len(right) != len(left):
        degrees, fit = np.degrees(apart), 2.0 * np.pi / apart if apart > 0.0 else np.inf
        told = f"must be {CUT_LEFT} turned by one pitch, {360.0 / n_blades:.6g} degrees, node by node"
        if abs(fit / n_blades - 1.0) > 1e-3:
            told += f"; the faces are {degrees:.6g} degrees apart, n_blades = {fit:.6g} would fit"
        elif len(right) != len(left):
            told += f"; it has {len(right)} nodes, {CUT_LEFT} {len(left)}"
        else:
            told += f"; a node has no partner within {worst:.3g} m"
        raise OwnMeshError(f"mesh.sets.{CUT_RIGHT}", cuts.names[0], told)
    notes.append(f"sector of a disk: {len(right)} nodes of each cut face are joined to the neighbours")
    return {CUT_RIGHT: right, CUT_LEFT: left}, notes


def _keys(surface: ElementSides) -> list[tuple[int, int, int]]:
    return list(zip(surface.block.tolist(), surface.element.tolist(), surface.side.tolist(), strict=True))


def _apart(points: FloatArray, right: IntArray, left: IntArray) -> float:
    """Angle from the left face to the right one, rad, by the directions of their nodes from the axis."""
    angles = [float(np.angle(np.sum(points[nodes, 2] + 1j * points[nodes, 1]))) for nodes in (right, left)]
    return float((angles[0] - angles[1] + np.pi) % (2.0 * np.pi) - np.pi)


def _mismatch(points: FloatArray, right: IntArray, left: IntArray, pitch: float) -> tuple[float, float]:
    """Largest distance of a node of one face from the nearest of the other, relative to the face, and in m."""
    from scipy.spatial import cKDTree

    back = rotate_about_axis(points[right], -pitch)
    distance = max(
        float(cKDTree(points[left]).query(back)[0].max()), float(cKDTree(back).query(points[left])[0].max())
    )
    return distance / float(np.ptp(points[left], axis=0).max()), distance

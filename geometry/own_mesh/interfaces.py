"""Contact interfaces of a mesh from elsewhere: their sets as faces, split into patches, and bodies that they hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from geometry.elements import ElementSides, IntArray
from geometry.errors import OwnMeshError
from geometry.frames import axes_through, rotate_about_axis
from geometry.imported_mesh import ImportedMesh
from geometry.own_mesh.body import boundary, chosen_sides, face_sides, pieces, side_codes, side_corners
from geometry.own_mesh.face_pairing import FaceNames, Surface, lie_opposite
from geometry.own_mesh.matching_faces import RIGHT_IS, together
from geometry.own_mesh.pitch_pairs import smooth_pieces
from geometry.own_mesh.sector_choice import MAIN, InterfaceChoice, SectorChoice
from geometry.own_mesh.side_quadrature import SidePoints, quadrature, side_tables
from geometry.sector import FloatArray, SectorMesh, interface_of

_FACING = -0.5  # cosine of the angle between the normals of two patches above which they do not face each other
_HELD = 1e-6  # of the largest singular value of the contact motions of rigid bodies: a smaller one is free
RIGHT, LEFT = "contact_right", "contact_left"


@dataclass(frozen=True)
class TouchingFaces:
    """Two faces of a mesh that touch, or one that touches the ground."""

    name: str  # of the interface; of one of its patches NAME/1, NAME/2, ...
    kind: str  # as of `InterfaceChoice`
    right: ElementSides
    left: ElementSides  # against the ground the right face
    grid: tuple[int, int] | None  # contact points along t1 and t2
    of: FaceNames  # what messages call them
    right_key: str  # dotted key of the right set

    @property
    def sides(self) -> list[tuple[str, ElementSides]]:
        """The faces with their keys."""
        return [(self.right_key, self.right), *([] if self.kind == "ground" else [(self.of.left_key, self.left)])]


def named_faces(mesh: ImportedMesh, choice: SectorChoice, outside: ElementSides) -> list[TouchingFaces]:
    """The faces of all interfaces that are named, that of `contact_right` and `contact_left` first.

    Raises OwnMeshError where one is no face, or a side is in two faces.
    """
    found = []
    if RIGHT in choice.sets and LEFT in choice.sets:
        right, left = (face_sides(mesh, role, choice.sets[role], outside) for role in (RIGHT, LEFT))
        faces = right, left, choice.contact_grid
        found.append(TouchingFaces(MAIN, "neighbours", *faces, FaceNames(), f"mesh.sets.{RIGHT}"))
    elif RIGHT in choice.sets or LEFT in choice.sets:
        missing = LEFT if RIGHT in choice.sets else RIGHT
        raise OwnMeshError(f"mesh.sets.{missing}", None, "name both contact faces, or neither to have them found")
    for name, each in choice.interfaces.items():
        table = f"mesh.interface.{name}"
        right = face_sides(mesh, f"{table}.right", each.right, outside)
        left = right if each.left is None else face_sides(mesh, f"{table}.left", each.left, outside)
        of = FaceNames(f'"{each.right}"', f"{table}.left", each.left, f"{table}.kind")
        grid = each.contact_grid or choice.contact_grid
        found.append(TouchingFaces(name, each.kind, right, left, grid, of, f"{table}.right"))
    _check_apart(mesh, choice, found)
    return found


def _check_apart(mesh: ImportedMesh, choice: SectorChoice, faces: Sequence[TouchingFaces]) -> None:
    """Raise OwnMeshError where two faces of one interface have a node in common, or any two a side."""
    seen: list[tuple[str, IntArray]] = []
    for each in faces:
        if each.kind != "ground" and len(np.intersect1d(each.right.nodes(mesh.blocks), each.left.nodes(mesh.blocks))):
            right = f'{RIGHT}, "{choice.sets[RIGHT]}"' if each.right_key.endswith(RIGHT) else each.of.right
            left = each.of.left or choice.sets[LEFT]
            raise OwnMeshError(each.of.left_key, left, f"must have no node of {right}")
        for key, sides in each.sides:
            codes = side_codes(mesh.blocks, sides)
            for other, known in seen:
                if common := len(np.intersect1d(codes, known)):
                    told = f"must have no element face of another one: {common} element faces are in {other} too"
                    raise OwnMeshError(key, _set_of(choice, key), told)
            seen.append((key, codes))


def _set_of(choice: SectorChoice, key: str) -> str | None:
    """The set of a face by its dotted key."""
    table, _, side = key.rpartition(".")
    if table == "mesh.sets":
        return choice.sets.get(side)
    return getattr(choice.interfaces[table.removeprefix("mesh.interface.")], side)


def ordered(mesh: ImportedMesh, faces: TouchingFaces) -> tuple[TouchingFaces, list[str]]:
    """Faces between neighbours with the right one on the +y side, and a note; the mesh is in our axes."""
    right, left = (_points(mesh, sides).centroid for sides in (faces.right, faces.left))
    if faces.kind != "neighbours" or np.arctan2(*right[1:]) >= np.arctan2(*left[1:]):
        return faces, []
    of = "" if faces.name == MAIN else f"{faces.name}: "
    note = f"{of}right and left face swapped: {RIGHT_IS}"
    return replace(faces, right=faces.left, left=faces.right), [note]


def patches(mesh: ImportedMesh, faces: TouchingFaces, n_blades: int) -> list[TouchingFaces]:
    """The faces by their separate plane or smooth patches, each with the one opposite; the mesh is in our axes.

    Raises OwnMeshError where a patch has no partner.
    """
    parts = [_patches(mesh, sides) for sides in (faces.right, faces.left)]
    if faces.kind == "ground":
        parts[1] = parts[0]
    elif len(parts[0]) != len(parts[1]):
        told = f"has {len(parts[1])} separate patches, {faces.of.right} has {len(parts[0])}: must be as many"
        raise OwnMeshError(faces.of.left_key, faces.of.left, told)
    if len(parts[0]) == 1:
        return [faces]
    order = range(len(parts[0])) if faces.kind == "ground" else _partners(mesh, faces, parts, n_blades)
    return [
        replace(faces, name=f"{faces.name}/{k + 1}", right=right, left=parts[1][other])
        for k, (right, other) in enumerate(zip(parts[0], order, strict=True))
    ]


def _patches(mesh: ImportedMesh, sides: ElementSides) -> list[ElementSides]:
    """Connected patches without a sharp edge, from the largest radius and then by y and x."""
    number = smooth_pieces(mesh.points, side_corners(mesh.blocks, sides))
    found = [chosen_sides(sides, np.flatnonzero(number == k)) for k in np.unique(number)]
    size = float(np.ptp(mesh.points, axis=0).max())

    def place(patch: ElementSides) -> tuple[float, ...]:
        at = _points(mesh, patch).centroid
        return -round(float(np.hypot(*at[1:])) / size, 4), -round(float(at[1]) / size, 4), float(at[0])

    return sorted(found, key=place)


def _partners(mesh: ImportedMesh, faces: TouchingFaces, parts: list[list[ElementSides]], n_blades: int) -> list[int]:
    """Left patch that each right one lies on; OwnMeshError where there is none, or one for two."""
    turn = 2.0 * np.pi / n_blades if faces.kind == "neighbours" else 0.0
    right, left = ([_points(mesh, patch) for patch in side] for side in parts)
    distance = np.full((len(right), len(left)), np.inf)
    for i, one in enumerate(right):
        at, normal = (rotate_about_axis(each, -turn) for each in (one.centroid, one.mean_normal))
        for k, other in enumerate(left):
            if normal @ other.mean_normal < _FACING * np.linalg.norm(normal) * np.linalg.norm(other.mean_normal):
                distance[i, k] = np.linalg.norm(at - other.centroid)
    order = distance.argmin(axis=1)
    if not np.isfinite(distance.min(axis=1)).all() or len(set(order.tolist())) < len(right):
        bad = int(np.argmax(distance.min(axis=1)))
        where = ", ".join(f"{1e3 * value:.4g}" for value in right[bad].centroid)
        told = f"must have a patch opposite each one of {faces.of.right}; that at ({where}) mm has none of its own"
        raise OwnMeshError(faces.of.left_key, faces.of.left, told)
    return [int(k) for k in order]


def _points(mesh: ImportedMesh, sides: ElementSides) -> SidePoints:
    return quadrature(mesh.points, side_tables(mesh.blocks, sides))


def of_kind(faces: Sequence[TouchingFaces], kind: str) -> ElementSides | None:
    """The right sides of all faces of a kind."""
    found: ElementSides | None = None
    for each in faces:
        if each.kind == kind:
            found = each.right if found is None else together(found, each.right)
    return found


def check_held(path: str, sector: SectorMesh, held: IntArray) -> list[str]:
    """Notes on bodies that contacts alone hold; OwnMeshError where one is free even with all contacts stuck.

    A body without nodes that are `held` has six rigid motions. In the waves of some nodal diameter these may cause no
    relative motion of the contact nodes: then nothing holds it.
    """
    part = pieces(len(sector.points), [block.nodes for block in sector.blocks])
    floating = np.setdiff1d(np.unique(part), part[held])
    if not len(floating):
        return []
    place = np.full(part.max() + 1, -1)
    place[floating] = np.arange(len(floating))
    centre = np.array([sector.points[part == k].mean(axis=0) for k in floating])
    size = np.array([np.ptp(sector.points[part == k], axis=0).max() for k in floating])
    right, left = _contact_motions(sector, place[part], centre, size)
    for n in range(sector.n_blades // 2 + 1):
        motions = right - np.exp(2j * np.pi * n / sector.n_blades) * left
        _, felt, shapes = np.linalg.svd(motions, full_matrices=True)
        felt = np.pad(felt, (0, len(shapes) - len(felt)))
        if felt[-1] < _HELD * max(felt[0], 1.0):
            body = int(np.linalg.norm(shapes[-1].reshape(-1, 6), axis=1).argmax())
            raise OwnMeshError("mesh.file", path, _not_held(sector, part, int(floating[body])))
    return [f"{_said(sector, part, int(k))}: held by contacts alone" for k in floating]


def _contact_motions(
    sector: SectorMesh, place: IntArray, centre: FloatArray, size: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Relative motion (3 n, 6 f) of all contact nodes for rigid motions of f bodies: without and with exp(i psi).

    `place` (N,): the body of each node, -1 for one that is held.
    """
    rows: tuple[list[FloatArray], list[FloatArray]] = ([], [])
    for view in sector.views.values():
        found = np.zeros((2, len(view.right.nodes), 3, 6 * len(centre)))
        for motion, face in zip(found, (view.right, view.left), strict=True):
            for k, (node, at, frame) in enumerate(zip(face.nodes, face.position, face.frame, strict=True)):
                if (body := place[node]) >= 0:
                    turning = np.cross(np.eye(3), (at - centre[body]) / size[body]).T
                    motion[k, :, 6 * body : 6 * body + 6] = frame @ np.hstack([np.eye(3), turning])
        one, other = found.reshape(2, 3 * len(view.right.nodes), -1)
        if view.kind != "neighbours":
            one, other = (one if view.kind == "ground" else one - other), np.zeros_like(other)
        rows[0].append(one)
        rows[1].append(other)
    return np.concatenate(rows[0]), np.concatenate(rows[1])


def _said(sector: SectorMesh, part: IntArray, body: int) -> str:
    """A body in words."""
    count = sum(int((part[block.nodes[:, 0]] == body).sum()) for block in sector.blocks)
    radius = np.hypot(*sector.points[part == body, 1:].T)
    return f"body of {count} elements at radius {radius.min():.4g} to {radius.max():.4g} m"


def _not_held(sector: SectorMesh, part: IntArray, body: int) -> str:
    touching = [
        interface_of(name)
        for name, view in sector.views.items()
        if (part[np.concatenate([view.right.nodes, view.left.nodes])] == body).any()
    ]
    where = f"it touches at {', '.join(dict.fromkeys(touching))} alone" if touching else "no interface touches it"
    told = f"{_said(sector, part, body)}: nothing holds it even where all contacts stick; {where}"
    return f"{told}: name its other interfaces, more contact nodes, or the nodes that are clamped"


_NAMES = {
    "root": ("root", "dovetail", "fir", "flank", "slot"),
    "damper": ("damper",),
    "platform": ("platform",),
    "shroud": ("shroud",),
    "snubber": ("snubber",),
}


def found_interfaces(mesh: ImportedMesh, choice: SectorChoice) -> dict[str, InterfaceChoice]:
    """Interfaces between several bodies of a mesh: contact pairs of the file, then sets that lie on each other.

    Sets may also lie on each other one pitch apart. Names are those that the words of the sets suggest; the right
    face is that of the smaller body. Empty for one body.
    """
    part = pieces(len(mesh.points), [block.nodes for block in mesh.blocks])
    used = np.unique(np.concatenate([block.nodes.ravel() for block in mesh.blocks]))
    size = np.bincount(part[used])
    if np.count_nonzero(size) < 2:
        return {}
    points = mesh.points - np.asarray(choice.axis_point, dtype=float)
    points = points @ axes_through(choice.direction, points[used].mean(axis=0)).T
    faces = _candidates(replace(mesh, points=points), choice, part)
    pitch = 2.0 * np.pi / choice.n_blades
    found: dict[str, InterfaceChoice] = {}
    given = [pair for pair in mesh.contacts if set(pair) <= faces.keys()]
    taken = {name for pair in given for name in pair}
    others = [(a, b) for a, b in combinations(faces, 2) if not {a, b} & taken]
    for one, other in (*given, *others):
        bodies = faces[one].body, faces[other].body
        if bodies[0] == bodies[1]:
            continue
        right, left = (one, other) if size[bodies[0]] <= size[bodies[1]] else (other, one)
        places = [(0.0, (right, left)), (pitch, (right, left)), (pitch, (left, right))]
        fits = [(turn, (a, b)) for turn, (a, b) in places if lie_opposite(faces[a].surface, faces[b].surface, turn)]
        if fits or (one, other) in given:
            turn, pair = (fits or places)[0]
            kind = "neighbours" if turn else "inside"
            found[_name(pair, kind, found)] = InterfaceChoice(*pair, kind=kind)
    return found


@dataclass(frozen=True)
class _Candidate:
    """A set that is a face of one body."""

    body: int
    surface: Surface


def _candidates(mesh: ImportedMesh, choice: SectorChoice, part: IntArray) -> dict[str, _Candidate]:
    """Sets that are faces of one body and that the choice does not use otherwise."""
    outside, known = boundary(mesh.blocks), set()
    found: dict[str, _Candidate] = {}
    for name in dict.fromkeys((*mesh.surfaces, *mesh.node_sets)):
        if name in choice.sets.values() and not any(name in pair for pair in mesh.contacts):
            continue
        try:
            sides = face_sides(mesh, "contact_right", name, outside)
        except OwnMeshError:  # no face
            continue
        nodes = sides.nodes(mesh.blocks)
        bodies, codes = np.unique(part[nodes]), side_codes(mesh.blocks, sides).tobytes()
        if len(bodies) == 1 and (codes not in known or any(name in pair for pair in mesh.contacts)):
            known.add(codes)
            found[name] = _Candidate(int(bodies[0]), Surface(mesh.points, nodes, side_tables(mesh.blocks, sides)))
    return found


def _name(pair: tuple[str, str], kind: str, taken: Mapping[str, InterfaceChoice]) -> str:
    """A name that the sets suggest."""
    text = " ".join(pair).lower()
    word = next((name for name, words in _NAMES.items() if any(each in text for each in words)), "joint")
    names = (
        word,
        f"{word}_next" if kind == "neighbours" else f"{word}_inside",
        *(f"{word}_{k}" for k in range(2, 99)),
    )
    return next(name for name in names if name not in taken)

"""A mesh from elsewhere taken for a sector, and what was found on the way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from geometry.elements import ElementSides, IntArray
from geometry.errors import OwnMeshError
from geometry.frames import axes_through, distance_from_axis
from geometry.imported_mesh import ImportedMesh
from geometry.own_mesh.body import (
    boundary,
    check_orientation,
    checked_body,
    face_sides,
    names_of_file,
    nodes_with_mid_sides,
    side_corners,
)
from geometry.own_mesh.face_pairing import FacePair, Surface, check_places, closing_number, contact_faces, pair_faces
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
from geometry.own_mesh.sector_choice import SectorChoice
from geometry.own_mesh.side_quadrature import quadrature, side_tables
from geometry.sector import ContactFace, FloatArray, SectorMesh
from geometry.units import check_size, materials_in_si

_ROUND_OFF = 1e-9
_RIGHT, _LEFT = "contact_right", "contact_left"


@dataclass(frozen=True)
class SectorFindings:
    """How well the faces of a sector fit.

    Attributes
    ----------
    matching : bool
        Whether the nodes of the faces are pairs under the pitch.
    mismatch : float
        Largest distance, across the normal, from a node of the right face turned back by one pitch to the nearest
        node of the left face, m.
    gap : (float, float)
        Smallest and largest distance along the normal, m; above 0 the faces are apart.
    overlap : float
        Share of the area of either face that has the other opposite.
    areas : (float, float)
        Areas of the right and the left face, m^2.
    normal_angle : float
        Largest angle between a normal and the opposite one, degrees.
    rotation : (3, 3) array
        Our axes x, y, z in the axes of the file, row by row.
    notes : tuple of str
        What was left out, exchanged or assumed, one line each.
    warnings : tuple of str
        What is probably a mistake in the input, one line each.

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import SectorFindings
    >>> found = SectorFindings(True, 1e-9, (4e-5, 5e-5), 1.0, (6e-5, 6e-5), 0.1, np.eye(3), ("root found",))
    >>> print(*found.lines, sep="\\n")
    faces: nodes match, largest mismatch 0.001 um; gap 40 to 50 um
    areas: right 60 mm^2, left 60 mm^2; normals opposite to 0.1 degrees
    axes of the file kept
    root found
    """

    matching: bool
    mismatch: float
    gap: tuple[float, float]
    overlap: float
    areas: tuple[float, float]
    normal_angle: float
    rotation: FloatArray
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def lines(self) -> tuple[str, ...]:
        """The findings as short lines of text."""
        pairs = "nodes match" if self.matching else "nodes do not match"
        low, high = (f"{round(1e6 * gap, 3) + 0.0:.3g}" for gap in self.gap)
        gap = f"gap {low} to {high} um" if low != high else f"gap {low} um"
        shared = "" if self.overlap > 0.995 else f"; {100.0 * self.overlap:.3g} % of the area is opposite"
        right, left = (f"{1e6 * area:.6g}" for area in self.areas)
        angle = round(self.normal_angle, 3)
        return (
            *(f"warning: {warning}" for warning in self.warnings),
            f"faces: {pairs}, largest mismatch {round(1e6 * self.mismatch, 6):.3g} um; {gap}{shared}",
            f"areas: right {right} mm^2, left {left} mm^2; normals opposite to {angle:.2g} degrees",
            _rotation_text(self.rotation),
            *self.notes,
        )


def _rotation_text(rotation: FloatArray) -> str:
    """The rotation in words."""
    if np.array_equal(rotation, np.eye(3)):
        return "axes of the file kept"
    names = [_row(row) for row in rotation]
    return f"turned: our x, y, z are {', '.join(names)} of the file"


def _row(row: FloatArray) -> str:
    for k, axis in enumerate("xyz"):
        if abs(abs(row[k]) - 1.0) < _ROUND_OFF:
            return axis if row[k] > 0.0 else f"-{axis}"
    return f"({', '.join(f'{value:.4g}' for value in row)})"


@dataclass(frozen=True)
class OwnSector:
    """A sector made of a mesh from elsewhere.

    Attributes
    ----------
    sector : SectorMesh
        The mesh in SI units and in our axes; sets and surfaces of the file keep their names.
    findings : SectorFindings
        How well the faces fit, and what was found or left out.
    materials : mapping of str to mapping of str to float
        Materials of the file in SI units.
    material_notes : mapping of str to tuple of str
        By material, as of `ImportedMesh`.
    unread_materials : mapping of str to str
        Materials that are not isotropic and elastic, and what they are.
    units : tuple of str
        Systems of units that the file says it is in.

    Examples
    --------
    A file with one brick, 8 mm wide at radius 300 mm, of a ring of 236 blades:

    >>> import numpy as np
    >>> from geometry import ElementBlock, ImportedMesh, SectorChoice, sector_from_mesh
    >>> x, y = np.array([-5.0, 5, 5, -5] * 2), np.array([-3.994, -3.994, 3.994, 3.994] * 2)
    >>> points = np.column_stack([x, y, [300.0] * 4 + [310.0] * 4])
    >>> points[4:, 1] *= 310 / 300
    >>> sets = {"ps": np.array([2, 3, 6, 7]), "ss": np.array([0, 1, 4, 5]), "hub": np.arange(4)}
    >>> mesh = ImportedMesh("b.inp", points, np.arange(8), (ElementBlock("hex8", np.arange(8)[None]),), (), sets)
    >>> names = {"root": "hub", "contact_right": "ps", "contact_left": "ss"}
    >>> own = sector_from_mesh(mesh, SectorChoice(236, "mm", sets=names, contact_grid=(1, 1)))
    >>> print(own.findings.lines[1])
    areas: right 100.009 mm^2, left 100.009 mm^2; normals opposite to 0 degrees
    """

    sector: SectorMesh
    findings: SectorFindings
    materials: Mapping[str, Mapping[str, float]]
    material_notes: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    unread_materials: Mapping[str, str] = field(default_factory=dict)
    units: tuple[str, ...] = ()


def sector_from_mesh(mesh: ImportedMesh, choice: SectorChoice) -> OwnSector:
    """Take a mesh from elsewhere for a sector: SI units, our axes, faces paired, contact points, frames and areas.

    Parameters
    ----------
    mesh : ImportedMesh
        The mesh, in the units and axes of its file.
    choice : SectorChoice
        Number of blades, unit, axis, sets and contact grid.

    Returns
    -------
    OwnSector
        The sector, and how well its faces fit.

    Raises
    ------
    OwnMeshError
        The mesh is not the sector that the choice says; one line with what is expected and what there is.

    Examples
    --------
    >>> from geometry import ImportedMesh, OwnMeshError, SectorChoice, sector_from_mesh
    >>> try:
    ...     sector_from_mesh(ImportedMesh("b.inp", np.empty((0, 3)), np.empty(0, int), (), ()), SectorChoice(40))
    ... except OwnMeshError as error:
    ...     print(error)
    mesh.file = 'b.inp': must hold solid elements; there are none
    """
    mesh, notes = checked_body(mesh)
    sets, renamed = names_of_file(mesh, choice.sets)
    mesh, choice, cut_names = with_cut_names(mesh, replace(choice, sets=sets))
    metres = choice.metres
    mesh = replace(mesh, points=(mesh.points - np.asarray(choice.axis_point, dtype=float)) * metres)
    check_size(float(distance_from_axis(choice.direction, mesh.points).max()), choice.unit)
    outside = boundary(mesh.blocks)
    check_orientation(mesh.path, mesh.points, mesh.blocks, outside)
    cuts = cut_faces(mesh, choice, outside)
    shown = outside if cuts is None else without((cuts.right, cuts.left), outside)
    _check_distinct(choice, cuts)
    mesh, right, left, rotation, found, doubts = _turned(mesh, choice, shown)
    cuts, others = with_other_faces(mesh, choice, outside, (right, left), cuts)
    joined, of_cuts = ({}, []) if cuts is None else paired_cuts(mesh.points, mesh, cuts, choice.n_blades)
    root, how = _root(mesh, choice, outside, (right, left), joined=cuts is not None)
    pair = pair_faces(_surface(mesh, right), _surface(mesh, left), choice)
    faces = contact_faces(pair, choice.contact_grid, root)
    sector = _assembled(
        mesh, choice, faces, {"root": root, **joined}, {"face_right": right, "face_left": left}, outside
    )
    said = [*_without_materials(mesh.notes), *notes, *renamed, *cut_names, *found, *others, *of_cuts, *how]
    findings = SectorFindings(
        matching=pair.partner is not None,
        mismatch=pair.mismatch,
        gap=pair.gap,
        overlap=pair.overlap,
        areas=pair.areas,
        normal_angle=pair.normal_angle,
        rotation=rotation,
        notes=(*said, *_remarks(pair)),
        warnings=(*mesh.warnings, *doubts, *_warnings(pair, choice.n_blades)),
    )
    materials = materials_in_si(mesh.materials, choice.unit)
    return OwnSector(sector, findings, materials, mesh.material_notes, mesh.unread_materials, mesh.units)


def _without_materials(notes: tuple[str, ...]) -> list[str]:
    """Notes of a file but those on its materials, which go with the materials."""
    return [note for note in notes if not note.startswith("material ")]


def _check_distinct(choice: SectorChoice, cuts: CutFaces | None) -> None:
    """Raise OwnMeshError where a set is named as a cut face and as a contact face."""
    for role in (_RIGHT, _LEFT):
        name = choice.sets.get(role)
        if cuts is not None and name in cuts.names:
            told = "is named as a cut face too: must be joined to the neighbour, or touch its face"
            raise OwnMeshError(f"mesh.sets.{role}", name, told)


def _turned(
    mesh: ImportedMesh, choice: SectorChoice, outside: ElementSides
) -> tuple[ImportedMesh, ElementSides, ElementSides, np.ndarray, list[str], list[str]]:
    """The mesh in our axes, right and left face, the rotation, notes and warnings; the origin is on the axis."""
    notes: list[str] = []
    doubts: list[str] = []
    if _RIGHT in choice.sets and _LEFT in choice.sets:
        right, left = (face_sides(mesh, role, choice.sets[role], outside) for role in (_RIGHT, _LEFT))
        if len(np.intersect1d(right.nodes(mesh.blocks), left.nodes(mesh.blocks))):
            told = f'must have no node of {_RIGHT}, "{choice.sets[_RIGHT]}"'
            raise OwnMeshError(f"mesh.sets.{_LEFT}", choice.sets[_LEFT], told)
    elif _RIGHT in choice.sets or _LEFT in choice.sets:
        missing = _LEFT if _RIGHT in choice.sets else _RIGHT
        raise OwnMeshError(f"mesh.sets.{missing}", None, "name both contact faces, or neither to have them found")
    else:
        first = axes_through(choice.direction, mesh.points.mean(axis=0))
        right, left, doubts = find_faces(mesh.points @ first.T, mesh.blocks, outside, choice.n_blades)
        notes.append(f"contact faces found: {len(right)} element sides each, the only ones a pitch apart")
    at = [quadrature(mesh.points, side_tables(mesh.blocks, face)) for face in (right, left)]
    check_places(at[0], at[1], choice)
    rotation = axes_through(choice.direction, (at[0].centroid + at[1].centroid) / 2.0)
    if (rotation @ (at[0].centroid - at[1].centroid))[1] < 0.0:
        right, left = left, right
        notes.append("right and left face exchanged: the right one is on the +y side")
    if not np.array_equal(rotation, np.eye(3)):
        mesh = replace(mesh, points=mesh.points @ rotation.T)
    return mesh, right, left, rotation, notes, doubts


def _root(
    mesh: ImportedMesh,
    choice: SectorChoice,
    outside: ElementSides,
    faces: tuple[ElementSides, ElementSides],
    *,
    joined: bool,
) -> tuple[IntArray, list[str]]:
    """Clamped nodes, none with a free bore, and how they were found; OwnMeshError where a contact face is clamped.

    `faces`: right and left contact face; `joined`: whether the sector has cut faces.
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
        notes.append(f"root found: the innermost surface, {len(surface)} element sides at {where}{free}")
    for role, face in zip((_RIGHT, _LEFT), faces, strict=True):
        held = np.isin(side_corners(mesh.blocks, face), root)
        if held.all(axis=1).any():
            told = f"must not hold a contact face: {int(held.all(axis=1).sum())} sides of {role} are in it"
            raise OwnMeshError("mesh.sets.root", choice.sets.get("root"), told)
        if held.any():
            notes.append(f"{role} touches the clamped root along an edge")
    if len(root) < 3 or np.linalg.matrix_rank(mesh.points[root] - mesh.points[root].mean(axis=0), tol=1e-9) < 2:
        told = f"must hold the blade: three nodes that are not on one line; it has {len(root)}"
        raise OwnMeshError("mesh.sets.root", choice.sets.get("root"), told)
    return root, notes


def _nothing_held(choice: SectorChoice, joined: bool) -> tuple[IntArray, list[str]]:
    """No clamped nodes, and a note; OwnMeshError for a blade alone, and where a root is named."""
    if not joined:
        told = "needs the cut faces of a disk, cyclic_right and cyclic_left: a blade alone is clamped at its root"
        raise OwnMeshError("mesh.bore", choice.bore, told)
    if "root" in choice.sets:
        raise OwnMeshError("mesh.sets.root", choice.sets["root"], 'must not be named with bore = "free"')
    return np.zeros(0, dtype=np.int64), ["the disk is free: nothing holds it"]


def _assembled(
    mesh: ImportedMesh,
    choice: SectorChoice,
    faces: tuple[ContactFace, ContactFace],
    own_sets: dict[str, IntArray],
    own_surfaces: dict[str, ElementSides],
    outside: ElementSides,
) -> SectorMesh:
    """The sector, with the sets of the file beside ours."""
    named = {f"face_{side}": own_surfaces[f"face_{side}"].nodes(mesh.blocks) for side in ("right", "left")}
    contact = {_RIGHT: faces[0].nodes, _LEFT: faces[1].nodes}
    tip = {"tip": np.array([_tip(mesh, choice, outside)], dtype=np.int64)}
    sets = {**mesh.node_sets, **named, **contact, **tip, **own_sets}
    surfaces = {**mesh.surfaces, **own_surfaces}
    return SectorMesh(mesh.points, mesh.blocks, sets, faces[0], faces[1], int(choice.n_blades), surfaces)


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


def _warnings(pair: FacePair, n_blades: int) -> tuple[str, ...]:
    """Whether another number of blades closes the gap or the overlap of the faces."""
    other = closing_number(pair.right.samples(), pair.left.samples(), n_blades)
    if other is None:
        return ()
    what, size = ("a gap" if sum(pair.gap) > 0.0 else "an overlap"), 1e6 * max(map(abs, pair.gap))
    told = f"n_blades = {n_blades} leaves {what} of {size:.3g} um between the contact faces"
    return (f"{told}; with n_blades = {other} they touch",)


def _remarks(pair: FacePair) -> list[str]:
    """What a user should know about the faces."""
    remarks = []
    if pair.gap[0] < -1e-9 - 1e-3 * np.sqrt(pair.areas[0]):
        remarks.append(f"the faces overlap by up to {-1e6 * pair.gap[0]:.3g} um in the mesh")
    if pair.partner is None:
        remarks.append('contact dofs "mortar" or "patch" tie faces whose nodes are no pairs')
    return remarks

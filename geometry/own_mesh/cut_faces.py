"""The two cut faces of the sector of a bladed disk, at which it is joined to its neighbours."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from geometry.contact import rotate_about_axis
from geometry.elements import ElementSides, IntArray
from geometry.errors import OwnMeshError
from geometry.imported_mesh import ImportedMesh
from geometry.own_mesh.body import chosen_sides
from geometry.own_mesh.named_sets import face_sides
from geometry.own_mesh.sector_choice import SectorChoice
from geometry.sector import FloatArray

CUT_RIGHT, CUT_LEFT = "cyclic_right", "cyclic_left"
_MATCH = 1e-5  # of the size of a face: largest distance of two nodes that are one


@dataclass(frozen=True)
class CutFaces:
    """Cut faces by their sides and by their names in the file.

    Attributes
    ----------
    right, left : ElementSides
        Their sides; the right one is on the +y side once `ordered`.
    names : (str, str)
        Sets of the file.
    """

    right: ElementSides
    left: ElementSides
    names: tuple[str, str]


def with_cut_names(mesh: ImportedMesh, choice: SectorChoice) -> SectorChoice:
    """The choice with the sets of the file that are called cyclic_right and cyclic_left, where it names neither."""
    if CUT_RIGHT in choice.sets or CUT_LEFT in choice.sets:
        return choice
    by_lower = {name.lower(): name for name in (*mesh.node_sets, *mesh.surfaces)}
    found = {role: by_lower[role] for role in (CUT_RIGHT, CUT_LEFT) if role in by_lower}
    return replace(choice, sets={**choice.sets, **found}) if len(found) == 2 else choice


def cut_faces(mesh: ImportedMesh, choice: SectorChoice, outside: ElementSides) -> CutFaces | None:
    """The cut faces that are named; None for a blade alone.

    Raises OwnMeshError where one is missing or is no face.
    """
    roles = [role for role in (CUT_RIGHT, CUT_LEFT) if role in choice.sets]
    if not roles:
        return None
    if len(roles) == 1:
        missing = CUT_LEFT if roles[0] == CUT_RIGHT else CUT_RIGHT
        raise OwnMeshError(f"mesh.sets.{missing}", None, "name both cut faces of the disk, or neither")
    names = choice.sets[CUT_RIGHT], choice.sets[CUT_LEFT]
    right, left = (face_sides(mesh, role, choice.sets[role], outside) for role in (CUT_RIGHT, CUT_LEFT))
    return CutFaces(right, left, names)


def without_cuts(mesh: ImportedMesh, cuts: CutFaces | None, outside: ElementSides) -> ElementSides:
    """The boundary but for the cut faces."""
    if cuts is None:
        return outside
    cut = {key for face in (cuts.right, cuts.left) for key in _keys(face)}
    return chosen_sides(outside, np.array([k for k, key in enumerate(_keys(outside)) if key not in cut], dtype=int))


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
        notes.append("right and left cut face exchanged: the right one is on the +y side")
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

"""Whether two named faces can be the faces of a sector: radius, axial position, pitch, area and normals."""

from __future__ import annotations

import numpy as np

from geometry.errors import OwnMeshError
from geometry.frames import axes_through, distance_from_axis, rotate_about_axis
from geometry.own_mesh.sector_choice import SectorChoice
from geometry.own_mesh.side_quadrature import SidePoints
from geometry.sector import FloatArray

_SAME_PLACE = 0.2  # largest difference of radius or axial position of the faces, over the size of a face
_AREAS = 0.1  # largest relative difference of the areas
_OPPOSITE = 20.0  # degrees, largest angle between a normal and the opposite one
_OBLIQUE = 0.05  # least part of the mean normal across the axis
_WHOLE = 1e-2  # a number of blades this near to a whole one, relatively
_CLOSED = 0.02  # of a gap: what may be left of it with the number of blades that closes it
_LIKE = 0.05  # of the size of a face: as near are the points of two faces that are alike


def check_places(right: SidePoints, left: SidePoints, choice: SectorChoice) -> None:
    """Raise OwnMeshError where the faces are not at the same radius and axial position.

    The faces are in the axes of the file, in m, with the origin on the engine axis that the choice says.
    """
    direction, axis = choice.direction, choice.axis
    size = float(np.sqrt(right.area.sum()))
    faces = (right.centroid, left.centroid)
    radius = [float(distance_from_axis(direction, at)) for at in faces]
    axial = [float(at @ direction) for at in faces]
    if _on_axis(*faces, direction, size):
        told = "must be beside the contact faces; they lie on this axis or on opposite sides of it"
        fitting = _fitting_axis(*faces, size) or _fitting_point(right, left, choice)
        raise OwnMeshError("mesh.axis", axis, told + fitting)
    for what, pair in (("radius", radius), ("axial position", axial)):
        if abs(pair[0] - pair[1]) > _SAME_PLACE * size:
            told = f"the contact faces must be at the same {what}; right {pair[0]:.4g} m, left {pair[1]:.4g} m"
            fitting = _fitting_axis(*faces, size) or _fitting_point(right, left, choice)
            raise OwnMeshError("mesh.axis", axis, told + fitting)


def axis_between(right: SidePoints, left: SidePoints, direction: FloatArray) -> tuple[int, FloatArray] | None:
    """Number of blades and a point (3,) of the axis along a `direction` about which one face turns into the other.

    The mean normals tell the angle, the centroids the place; the angle is positive or negative. None where the faces
    are no images so.
    """
    from_left, to_right = (
        normal - (normal @ direction) * direction for normal in (left.mean_normal, -right.mean_normal)
    )
    chord, size = right.centroid - left.centroid, float(np.sqrt(right.area.sum()))
    turn = float(np.arctan2(direction @ np.cross(from_left, to_right), from_left @ to_right))
    if min(np.linalg.norm(from_left), np.linalg.norm(to_right)) < _OBLIQUE or not abs(turn) > 1e-3:
        return None
    number = round(2.0 * np.pi / abs(turn))
    if number < 3 or abs(2.0 * np.pi / abs(turn) - number) > _WHOLE * number:
        return None
    if abs(chord @ direction) > _LIKE * size:
        return None
    point = (right.centroid + left.centroid) / 2.0
    point = point + np.cross(direction, chord) / (2.0 * np.tan(np.sign(turn) * np.pi / number))
    return number, point - (point @ direction) * direction


def _fitting_point(right: SidePoints, left: SidePoints, choice: SectorChoice) -> str:
    """The axis that does not pass through the point that the choice says, in words; "" where there is none."""
    for direction, name in ((choice.direction, None), *zip(np.eye(3), "xyz", strict=True)):
        found = axis_between(right, left, direction)
        if found is not None:
            number, point = found
            place = point / choice.metres + np.asarray(choice.axis_point, dtype=float)
            there = ", ".join(f"{round(float(value), 6) + 0.0:.6g}" for value in place)
            axis = "" if name is None else f'mesh.axis = "{name}", '
            return f"; they are with {axis}mesh.axis_point = [{there}] and mesh.n_blades = {number}"
    return "; mesh.axis_point names a point of the axis that is not the origin of the file"


def check_pitch(right: SidePoints, left: SidePoints, n_blades: int, tolerance: float) -> None:
    """Raise OwnMeshError where the faces are not one pitch apart, with the number of blades that fits."""
    apart = _apart(right, left)
    pitch = 2.0 * np.pi / n_blades
    radius = float(np.hypot(*right.centroid[1:]))
    if abs(apart - pitch) * radius <= tolerance:
        return
    fit = 2.0 * np.pi / apart if apart > 0.0 else 0.0
    told = f"the contact faces are {np.degrees(apart):.6g} degrees apart, not {np.degrees(pitch):.6g}"
    if fit > 1.5 and abs(fit - round(fit)) < _WHOLE * fit:
        told += f"; n_blades = {round(fit)} would fit"
    else:
        told += "; an axis that does not pass through the origin of the file needs mesh.axis_point"
    raise OwnMeshError("mesh.n_blades", n_blades, told)


def closing_number(right: SidePoints, left: SidePoints, n_blades: int) -> int | None:
    """Another number of blades, with which the faces would touch; None where there is none, or they do touch."""
    apart = _apart(right, left)
    if apart <= 0.0:
        return None
    other = round(2.0 * np.pi / apart)
    away = abs(apart - 2.0 * np.pi / n_blades)
    return None if other == n_blades or abs(apart - 2.0 * np.pi / other) > _CLOSED * away else other


def check_alike(right: SidePoints, left: SidePoints, n_blades: int) -> float:
    """Largest angle, degrees, between a normal of the right face and the opposite one; or OwnMeshError."""
    from scipy.spatial import cKDTree

    name = "mesh.sets.contact_left"
    areas = [float(face.area.sum()) for face in (right, left)]
    pitch = 2.0 * np.pi / n_blades
    back, normal = rotate_about_axis(right.position, -pitch), rotate_about_axis(right.normal, -pitch)
    if _mirrored(right, left):
        told = "is the mirror image of the right face (y to -y), not the right face turned back by one pitch"
        raise OwnMeshError(name, None, told)
    if abs(areas[1] / areas[0] - 1.0) > _AREAS:
        told = f"must have the area of the right face, {areas[0]:.4g} m^2; it has {areas[1]:.4g} m^2"
        raise OwnMeshError(name, None, told)
    opposite = left.normal[cKDTree(left.position).query(back)[1]]
    angle = np.degrees(np.arccos(np.clip(-np.sum(normal * opposite, axis=1), -1.0, 1.0)))
    # the nearest point may lie beyond an edge of a curved face: all but a few must be opposite
    typical = float(np.quantile(angle, 0.9))
    if typical > _OPPOSITE:
        told = f"must face the right face turned back by one pitch; the normals are {typical:.3g} degrees off"
        raise OwnMeshError(name, None, told)
    return float(np.quantile(angle, 0.99))


def _apart(right: SidePoints, left: SidePoints) -> float:
    """Angle from the left face to the right one about the axis x, rad."""
    return float(np.arctan2(*right.centroid[1:]) - np.arctan2(*left.centroid[1:]))


def _mirrored(right: SidePoints, left: SidePoints) -> bool:
    """Whether the left face is the mirror image of the right one about the plane between them, and not its image.

    The image is turned back by the angle between the centroids: symmetric faces are both, whatever the gap.
    """
    from scipy.spatial import cKDTree

    size, tree = float(np.sqrt(right.area.sum())), cKDTree(left.position)
    middle = right.centroid * [0.0, 1.0, 1.0] + left.centroid * [0.0, 1.0, 1.0]
    frame = axes_through(np.array([1.0, 0.0, 0.0]), middle)
    image = right.position @ frame.T * [1.0, -1.0, 1.0] @ frame
    turned = rotate_about_axis(right.position, -_apart(right, left))
    as_turned, as_mirrored = (float(np.quantile(tree.query(each)[0], 0.95)) for each in (turned, image))
    return as_turned > _LIKE * size and as_mirrored < 0.5 * as_turned and as_mirrored < _LIKE * size


def _on_axis(right: FloatArray, left: FloatArray, direction: FloatArray, size: float) -> bool:
    """Whether an axis through the origin goes through a face or between the faces."""
    places = (right, left, (right + left) / 2.0)
    return min(float(distance_from_axis(direction, at)) for at in places) < _SAME_PLACE * size


def _fitting_axis(right: FloatArray, left: FloatArray, size: float) -> str:
    """Which axis of the file has the faces at the same place, in words."""
    found = []
    for direction, name in zip(np.eye(3), "xyz", strict=True):
        radii = [float(distance_from_axis(direction, at)) for at in (right, left)]
        same = abs(radii[0] - radii[1]) < _SAME_PLACE * size and abs((right - left) @ direction) < _SAME_PLACE * size
        if same and not _on_axis(right, left, direction, size):
            found.append(f'"{name}"')
    return f"; they are with {' or '.join(found)}" if found else ""

"""Whether the airfoil fits on its shroud and beside its neighbours, with how much room, and why not.

The side edges of the platform are slanted as given, or so that most room is left for the airfoil. The planform is cut
into an upper and a lower half along the camber line of the airfoil; the cut continues from the trailing edge to the
axial edge of the platform at +x and from the leading edge to the other axial edge: the same cut of the planform
rotated by 180 degrees. Without camber the two halves are images of each other.
"""

from dataclasses import replace
from itertools import pairwise
from math import copysign, cos, pi, radians, sin, tan

import numpy as np
from numpy.typing import NDArray

from geometry.blade.parameters import BladeParameters, ShroudParameters
from geometry.blade.planform import Planform, inner_radius, is_mirrored, planform, section_at
from geometry.blade.section import Section, fillet_offset
from geometry.sector import FloatArray

AMPLE_CLEARANCE = 0.1  # distance from the sides of the platform, relative to its breadth
LEAST_CLEARANCE = 0.01
LEAST_COSINE = 0.3  # of the angle between the camber line and the cut where it leaves the airfoil
CLEARANCE = 0.02  # least distance between outlines and least side edge, relative to the smaller side of the platform
LEAST_CORNER = 25.0  # degrees between a side edge and the contact segment
FLANK_POINTS = 33
AUTO = "auto"
LARGEST_SLANT = 75.0  # degrees
ROOM_DIGITS = 6  # rooms that are equal in these leave the choice to the smaller slant
SLANTS = np.arange(1.0, LARGEST_SLANT + 1.0)
MOST_TRIED = 8
OUTLINE_POINTS = 25
OUTLINE_STEP = 4  # of the points of a section that are compared with those of a neighbour
HEIGHTS = np.linspace(0.0, 1.0, 9)  # at which the sections are compared


def inside(points: FloatArray, polygon: FloatArray) -> NDArray[np.bool_]:
    """(k,) which of ``points`` (k, 2) lie inside the ``polygon`` (m, 2) (even-odd rule)."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    x, y = points[:, :1], points[:, 1:]
    spans = (a[:, 1] > y) != (b[:, 1] > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = a[:, 0] + (y - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return np.asarray((spans & (x < crossing)).sum(axis=1) % 2 == 1)


def distances(points: FloatArray, line: FloatArray, *, closed: bool = True) -> FloatArray:
    """Least distances (k,) from ``points`` (k, 2) to the sides of a polygon or an open ``line`` (m, 2)."""
    a, b = (line, np.roll(line, -1, axis=0)) if closed else (line[:-1], line[1:])
    side = b - a
    offset = points[:, None, :] - a
    length = np.maximum((side**2).sum(axis=-1), 1e-300)
    t = np.clip((offset * side).sum(axis=-1) / length, 0.0, 1.0)
    return np.asarray(np.linalg.norm(offset - t[..., None] * side, axis=-1).min(axis=1))


def distance(points: FloatArray, line: FloatArray, *, closed: bool = True) -> float:
    """Least distance from any of ``points`` (k, 2) to the sides of a polygon or an open ``line`` (m, 2)."""
    return float(distances(points, line, closed=closed).min())


def cross(one: FloatArray, other: FloatArray) -> bool:
    """True where a side of one polygon crosses a side of the other."""
    a, b = one[:, None], np.roll(one, -1, axis=0)[:, None]
    c, d = other[None], np.roll(other, -1, axis=0)[None]

    def turn(p: FloatArray, q: FloatArray, r: FloatArray) -> FloatArray:
        u, v = q - p, r - p
        return np.sign(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])

    crossing = (turn(a, b, c) * turn(a, b, d) < 0) & (turn(c, d, a) * turn(c, d, b) < 0)
    return bool(crossing.any())


def cut_beyond_airfoil(plan: Planform) -> FloatArray | None:
    """Corners (2 or 3, 2) of the cut from the trailing edge to the axial edge; None where there is no room.

    Where the clearance from both sides of the platform is ample, the direction of the cut is half-way between the
    camber line and the side edges. Else the cut is the straight line with the largest clearance, or it follows the
    middle line of the platform round its corner.
    """
    edge = plan.place(np.array([plan.section.half_length, 0.0]))
    x, bend = plan.width / 2, np.array(plan.contact_half)
    usual = edge[1] + (x - edge[0]) * tan(radians(_direction_at_edge(plan) + plan.edge_angle) / 2)
    middle, limit = plan.end_offset, (0.5 - AMPLE_CLEARANCE) * plan.pitch
    path = np.array([edge, [x, min(max(usual, middle - limit), middle + limit)]])
    clearance = _clearance(plan, path)
    if clearance > AMPLE_CLEARANCE * plan.breadth:
        return path
    paths = [path, *(np.array([edge, [x, middle + k * limit]]) for k in np.linspace(-1, 1, 13))]
    if edge[0] < bend[0]:
        paths.append(np.array([edge, bend, [x, middle]]))
    clearances = [clearance, *(_clearance(plan, other) for other in paths[1:])]
    best = int(np.argmax(clearances))
    return paths[best] if clearances[best] > LEAST_CLEARANCE * plan.breadth else None


def _direction_at_edge(plan: Planform) -> float:
    """Angle from x to the camber line at the trailing edge, degrees."""
    return plan.stagger - plan.section.camber / 2


def _clearance(plan: Planform, path: FloatArray) -> float:
    """Least distance (m) of a path from the sides of the platform; -1 for a path off it or along the airfoil."""
    start = path[1] - path[0]
    direction = radians(_direction_at_edge(plan))
    along = start[0] * cos(direction) + start[1] * sin(direction)
    if along < LEAST_COSINE * np.hypot(*start):
        return -1.0
    t = np.linspace(0.0, 0.99, 12)[:, None]
    points = np.vstack([a + t * (b - a) for a, b in pairwise(path)])
    if not inside(points, plan.outline()).all():
        return -1.0
    right = plan.right_profile()
    return min(distance(points, right, closed=False), distance(points, -right, closed=False))


def clearance(plan: Planform) -> float:
    """Least distance (m) required between the outlines of airfoil and platform."""
    return CLEARANCE * min(plan.width, plan.breadth)


def airfoil_outline(plan: Planform, flank_points: int = 0) -> FloatArray:
    """Corners (k, 2) of the section at the shroud in the plane (x, s), counterclockwise; curved flanks sampled."""
    half = plan.section.half_length
    along = np.linspace(half, -half, flank_points or (2 if plan.section.straight else FLANK_POINTS))
    across = plan.section.half_thickness(along)
    upper = np.stack([along, across], axis=-1)
    return plan.place(np.vstack([upper, -upper]))


def edges_fit(plan: Planform) -> bool:
    """True where a side edge is left on both sides of the contact segment: |contact_length cos alpha| < width."""
    return plan.width / 2 - plan.contact_half[0] >= clearance(plan)


def corners_fit(plan: Planform) -> bool:
    """True where the side edges do not fold back along the contact segment."""
    return plan.angle - plan.edge_angle <= 180.0 - LEAST_CORNER


def airfoil_room(plan: Planform) -> float:
    """Least distance (m) from the airfoil to the sides of the platform; negative: how far it stands out."""
    airfoil, platform = airfoil_outline(plan), plan.outline()
    on_platform = np.where(inside(airfoil, platform), 1.0, -1.0)
    off_airfoil = np.where(inside(platform, airfoil), -1.0, 1.0)
    room = min(
        float((on_platform * distances(airfoil, platform)).min()),
        float((off_airfoil * distances(platform, airfoil)).min()),
    )
    return min(room, 0.0) if cross(airfoil, platform) else room


def airfoil_fits(plan: Planform) -> bool:
    """True where the airfoil lies on the platform with clearance on all sides, at the notches too."""
    return airfoil_room(plan) >= clearance(plan)


def misfit(plan: Planform) -> str | None:
    """Why the airfoil and the profile do not fit together; None where they do."""
    if not corners_fit(plan):
        return f"the side edges would fold back along the contact, under less than {LEAST_CORNER:g} degrees"
    if not edges_fit(plan):
        return "contact_length |cos(angle)| leaves no side edge within axial_width"
    if not airfoil_fits(plan):
        return "the notch of the profile would cut the airfoil"
    if cut_beyond_airfoil(plan) is None or cut_beyond_airfoil(plan.turned) is None:
        return "the airfoil, turned by its stagger, leaves no way along the middle of the platform"
    return None


def fits(plan: Planform) -> bool:
    """True where both the profile and the airfoil fit, with room for the cut of the planform."""
    return misfit(plan) is None


def without_notch(plan: Planform) -> Planform:
    """The same platform with straight sides."""
    slant = plan.edge_angle
    return replace(plan, angle=max(slant, 0.0), contact_length=plan.width / 1000)


def fitted_planform(blade: BladeParameters, shroud: ShroudParameters) -> Planform:
    """The planform of a blade with its side edges as given; with "auto" axial where that fits, else slanted.

    The slant is that with the most room between airfoil and platform: towards the stagger at the shroud if one of
    these fits, else any. Where none fits, the edges are axial if the notch alone is in the way, else those that lack
    least.
    """
    if shroud.edge_angle != AUTO:
        return planform(blade, shroud, float(shroud.edge_angle))
    axial = planform(blade, shroud, 0.0)
    if fits(axial):
        return axial
    airfoil = airfoil_outline(axial, FLANK_POINTS)
    towards = copysign(1.0, axial.stagger or 1.0)
    for slants in (towards * SLANTS, -towards * SLANTS) if np.abs(airfoil[:, 0]).max() < axial.width / 2 else ():
        rooms = _rooms(axial, slants, airfoil)
        best = [k for k in np.argsort(-rooms, kind="stable")[:MOST_TRIED] if rooms[k] > 0]
        plans = (replace(axial, edge_angle=float(slants[k])) for k in best)
        fitting = next((plan for plan in plans if fits(plan)), None)
        if fitting is not None:
            return fitting
    if airfoil_fits(without_notch(axial)):
        return axial
    slants = np.concatenate([[0.0], towards * SLANTS, -towards * SLANTS])
    relative = _rooms(axial, slants, airfoil) / np.cos(np.radians(slants))
    least = np.lexsort([np.abs(slants), -relative.round(ROOM_DIGITS)])[0]
    return replace(axial, edge_angle=float(slants[least]))


def _rooms(axial: Planform, slants: FloatArray, airfoil: FloatArray) -> FloatArray:
    """Room (k,) between the outline of the airfoil and the two sides at the ``slants`` (k,), in pitches.

    It is measured along s and projected on the normal of the side edges; the axial edges are no matter of the slant.
    It is -1 where the profile itself is impossible.
    """
    dx, ds = axial.contact_half
    outline = np.vstack([airfoil, -airfoil])  # the left side is the right one rotated by 180 degrees
    x, s = outline.T
    beyond = np.sign(x) * np.maximum(np.abs(x) - dx, 0.0)
    contact = np.interp(x, [-dx, dx], [-ds, ds]) if dx > 0 else np.sign(x) * ds
    above = axial.pitch / 2 + contact - s + beyond * np.tan(np.radians(slants))[:, None]
    rooms = above.min(axis=1) / axial.pitch * np.cos(np.radians(slants))
    possible = [edges_fit(axial) and corners_fit(replace(axial, edge_angle=float(slant))) for slant in slants]
    return np.where(possible, rooms, -1.0)


def side_edge_angle(blade: BladeParameters, shroud: ShroudParameters) -> float:
    """Angle between the engine axis and the side edges of the platform.

    Returns degrees, positive from x towards y as the stagger.
    """
    slant = fitted_planform(blade, shroud).edge_angle
    return 0.0 - slant if is_mirrored(shroud) else slant


def airfoils_touch(blade: BladeParameters, shroud: ShroudParameters) -> bool:
    """True where the sections of two neighbours meet at some height."""
    span = inner_radius(blade, shroud) - blade.hub_radius
    for height in map(float, HEIGHTS):
        radius = blade.hub_radius + height * span
        pitch = 2 * pi * radius / blade.n_blades
        if blade.sections is not None:
            outline = blade.sections.curves(radius).outline[::OUTLINE_STEP]
            if _meet(outline, outline + np.array([0.0, pitch])):
                return True
            continue
        stagger = radians(blade.root_stagger + height * blade.twist)
        offset = fillet_offset(height * span, blade.fillet_radius)
        section = replace(section_at(blade, height), offset=offset)
        if _meets_its_copy(section, np.array([pitch * sin(stagger), pitch * cos(stagger)])):
            return True
    return False


def _meets_its_copy(section: Section, moved: FloatArray) -> bool:
    """Whether a section meets its copy at the distance ``moved`` (2,) m, in its own directions.

    A convex section that is symmetric about its centre does where it contains half of that vector.
    """
    if not section.camber:
        along, across = np.abs(moved) / 2
        return bool(along <= section.half_length and across <= section.half_thickness(along))
    along = np.linspace(section.half_length, -section.half_length, OUTLINE_POINTS)
    upper = np.stack([along, section.half_thickness(along)], axis=-1)
    outline = section.bent(np.vstack([upper, -upper]))
    if (np.abs(moved) > np.ptp(outline, axis=0)).any():
        return False
    return _meet(outline, outline + moved)


def _meet(one: FloatArray, other: FloatArray) -> bool:
    """Whether two outlines (k, 2) have points in common."""
    return cross(one, other) or bool(inside(one, other).any() or inside(other, one).any())

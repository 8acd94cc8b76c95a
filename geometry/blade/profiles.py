"""An airfoil given by sections as points, splined along its height.

Chord, stagger, place and shape of the sections are splines over their mean radii: between sections the stagger turns
the chord instead of shortening it. A shape is the outline in coordinates along and across the chord, over the chord,
about its centroid. Sections may lie on cylinders, planes or cones: the outline at a radius is where the lines through
corresponding points of all sections meet the cylinder of that radius.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import atan, degrees
from typing import TYPE_CHECKING

import numpy as np

from geometry.blade.parameters import LARGEST_CAMBER, LARGEST_STAGGER, BladeParameters
from geometry.blade.profile_loop import (
    EDGE_POINTS,
    SIDE_POINTS,
    LoopError,
    SectionCurves,
    area_moments,
    section_curves,
)
from geometry.errors import GeometryError
from geometry.sector import FloatArray

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

BEYOND = 0.01  # of the height of the stack, by which sections are extrapolated
LEAST_STEP = 1e-4  # of the radius, between the mean radii of two sections
NEWTON_STEPS = 8
BLUNT = 0.6  # thickness of the edges over the largest, from which on a section is a rectangle for its platform
GAUSS_POINTS = 4


@dataclass(frozen=True, eq=False)
class ProfileStack:
    """Sections of an airfoil by their radius."""

    name: str  # file, for messages
    spline: (
        CubicSpline  # over the mean radius, m: chord, stagger, centroid (2), then of each point along, across, radius
    )
    reach: tuple[float, float]  # radii at which all lines have points, m
    reversed_x: bool = False  # mirror image (x -> -x)

    @property
    def mirrored(self) -> ProfileStack:
        """The mirror image, x -> -x."""
        return replace(self, reversed_x=not self.reversed_x)

    def curves(self, radius: float) -> SectionCurves:
        """The outline at a radius (m), in x and arc length at this radius, m."""
        count = (self.spline.c.shape[2] - 4) // 3
        points, at = np.arange(count), np.full(count, radius)
        for _ in range(NEWTON_STEPS):
            value, slope = (self.spline(at, order)[points, 4 + 2 * count + points] for order in (0, 1))
            step = (value - radius) / slope
            at = at - step
            if np.abs(step).max() < 1e-12 * radius:
                break
        values = self.spline(at)
        chord, stagger, place = values[:, 0], values[:, 1], values[:, 2:4]
        along, across = values[points, 4 + points], values[points, 4 + count + points]
        c, s = np.cos(stagger), np.sin(stagger)
        outline = place + chord[:, None] * np.stack([along * c - across * s, along * s + across * c], axis=1)
        cuts = np.cumsum([SIDE_POINTS, SIDE_POINTS, EDGE_POINTS])
        upper, lower, leading, trailing = np.split(outline, cuts)
        if not self.reversed_x:
            return SectionCurves(upper, lower, leading, trailing)
        mirror = np.array([-1.0, 1.0])
        return SectionCurves(upper[::-1] * mirror, lower[::-1] * mirror, trailing * mirror, leading * mirror)


def profile_stack(name: str, sections: Sequence[FloatArray]) -> ProfileStack:
    """The stack of sections (n, 3), from the root to the tip: x, arc length at the radius of the point, radius, m.

    Raises GeometryError.
    """
    from scipy.interpolate import CubicSpline

    found, mean = [], []
    for number, section in enumerate(sections, 1):
        try:
            curves = section_curves(section)
        except LoopError as error:
            raise _refused(name, f"section {number} (radius {section[:, 2].mean():.6g} m): {error}") from None
        found.append(_described(curves))
        mean.append(float(curves.outline[:, 2].mean()))
    if len(found) < 2:
        raise _refused(name, "one section, at least two at different radii are needed")
    for number, (low, high) in enumerate(pairwise(mean), 2):
        if not high - low > LEAST_STEP * high:
            allowed = "sections from the root to the tip, with rising radii"
            raise _refused(name, f"radius {high:.6g} m of section {number} after {low:.6g} m, allowed: {allowed}")
    table = np.array(found)
    table[:, 1] = np.unwrap(table[:, 1])
    count = (table.shape[1] - 4) // 3
    radii, slack = table[:, -count:], BEYOND * (mean[-1] - mean[0])
    if not (np.diff(radii, axis=0) > 0.0).all():
        raise _refused(name, "two sections meet: the radius must rise from section to section at every point")
    return ProfileStack(name, CubicSpline(mean, table), (radii[0].max() - slack, radii[-1].min() + slack))


def _described(curves: SectionCurves) -> FloatArray:
    """What is splined of a section: chord, stagger, centroid, then along, across and radius of its points."""
    points = np.vstack([curves.upper, curves.lower, curves.leading, curves.trailing])
    start, end = (edge[EDGE_POINTS // 2, :2] for edge in (curves.leading, curves.trailing))
    chord, stagger = float(np.hypot(*(end - start))), float(np.arctan2(*(end - start)[::-1]))
    centroid = area_moments(curves.outline)[1]
    c, s = np.cos(stagger), np.sin(stagger)
    along, across = ((points[:, :2] - centroid) @ np.array([[c, -s], [s, c]]) / chord).T
    return np.concatenate([[chord, stagger], centroid, along, across, points[:, 2]])


@dataclass(frozen=True)
class Likeness:
    """A section of the shapes that a parametric blade has, nearest to one of points; metres, degrees."""

    shape: str
    chord: float
    thickness: float
    stagger: float
    camber: float


def likeness(curves: SectionCurves) -> Likeness:
    """The chord, largest thickness, stagger and camber of a section."""
    start, end = (edge[EDGE_POINTS // 2] for edge in (curves.leading, curves.trailing))
    chord, stagger = float(np.hypot(*(end - start))), float(np.arctan2(*(end - start)[::-1]))
    apart = np.linalg.norm(curves.upper - curves.lower, axis=1)
    middle = (curves.upper + curves.lower) / 2 - start
    rise = middle @ np.array([-np.sin(stagger), np.cos(stagger)])
    height = float(rise[int(np.argmax(np.abs(rise)))])
    edges = min(apart[0], apart[-1]) / apart.max()
    shape = "rectangle" if edges > BLUNT else "lens"
    return Likeness(shape, chord, float(apart.max()), degrees(stagger), degrees(4 * atan(2 * height / chord)))


def blade_of_sections(
    n_blades: int, hub_radius: float, length: float, stack: ProfileStack, shroud_thickness: float
) -> BladeParameters:
    """A blade with sections of points, and the parameters of the parametric blade that is nearest to it.

    `hub_radius`, `length` and the radial thickness of the shroud in m. Raises GeometryError.
    """
    tip = hub_radius + length - shroud_thickness
    check_reach(stack, hub_radius, max(tip, hub_radius))
    root, end = (likeness(stack.curves(radius)) for radius in (hub_radius, tip))
    for place, section in (("root", root), ("tip", end)):
        if abs(section.stagger) > LARGEST_STAGGER:
            told = f"stagger of {section.stagger:.4g} degrees at the {place}, allowed: {LARGEST_STAGGER:g} at most"
            raise _refused(stack.name, told)
    return BladeParameters(
        n_blades,
        hub_radius,
        length,
        chord=end.chord,
        thickness=min(root.thickness, 0.9 * end.chord),
        tip_thickness=end.thickness,
        twist=end.stagger - root.stagger,
        section=end.shape,
        root_stagger=root.stagger,
        camber=float(np.clip(end.camber, -LARGEST_CAMBER, LARGEST_CAMBER)),
        sections=stack,
    )


def profile_points(curves: SectionCurves, places: FloatArray, flanks: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Points (k, 2) of a section at `places` (k, 2): along it from 0 to 1, across it from 0, below, to 1.

    `flanks`: places along of the nodes on the upper and on the lower side, ascending. Between them the sides are
    straight, and nearest to the curves by least squares, as those of the parametric sections.
    """
    along, across = places[:, :1], places[:, 1:]
    sides = [_straight_edged(curve, nodes) for curve, nodes in zip((curves.upper, curves.lower), flanks, strict=True)]
    upper, lower = (
        np.stack([np.interp(along[:, 0], nodes, column) for column in side.T], axis=1)
        for side, nodes in zip(sides, flanks, strict=True)
    )
    found = across * upper + (1 - across) * lower
    for edge, share in ((curves.leading, 1 - along), (curves.trailing, along)):
        steps = np.linspace(0.0, 1.0, len(edge))
        bulge = edge - edge[:1] - steps[:, None] * (edge[-1:] - edge[:1])
        found += share * np.stack([np.interp(across[:, 0], steps, column) for column in bulge.T], axis=1)
    return found


def _straight_edged(curve: FloatArray, nodes: FloatArray) -> FloatArray:
    """Corners (k, 2) at `nodes` (k,) of the line of straight pieces nearest to a curve (n, 2) of equal steps."""
    point, weight = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    half = np.diff(nodes)[:, None] / 2
    places = (nodes[:-1, None] + half * (1 + point)).ravel()
    root = np.sqrt(half * weight).ravel()[:, None]
    steps = np.linspace(0.0, 1.0, len(curve))
    values = np.stack([np.interp(places, steps, column) for column in curve.T], axis=1)
    hats = np.stack([np.interp(places, nodes, unit) for unit in np.eye(len(nodes))], axis=-1)
    return np.asarray(np.linalg.lstsq(root * hats, root * values)[0])


def check_reach(stack: ProfileStack, low: float, high: float) -> None:
    """Refuse sections that do not cover the airfoil from one radius to another (m), or lie elsewhere."""
    (first, last) = stack.reach
    covered = f"sections cover radii from {first:.6g} to {last:.6g} m, the airfoil needs {low:.6g} to {high:.6g} m"
    for factor, unit in ((1e3, "mm"), (39.37, "inches"), (1e-3, "km")):
        if 0.8 < last / high / factor < 1.25:
            raise _refused(stack.name, f"{covered}; the file is in {unit}, allowed: metres")
    if first > low or last < high:
        told = "root: a section at or below blade.hub_radius" if first > low else "tip: a section at or above it"
        raise _refused(stack.name, f"{covered}; missing at the {told} (1 % of the height is extrapolated)")
    curves = stack.curves(high)
    chord = likeness(curves).chord
    if chord > 2 * high:
        told = f"a chord of {chord:.6g} m at radius {high:.6g} m: x and y are in mm, allowed: metres"
        raise _refused(stack.name, told)
    centre = area_moments(curves.outline)[1]
    if np.hypot(*centre) > chord / 2:
        told = f"centroid of the section at radius {high:.6g} m at x = {centre[0]:.6g}, y = {centre[1]:.6g} m"
        raise _refused(stack.name, f"{told}; allowed: within half a chord of the stacking axis, x = y = 0")


def _refused(name: str, reason: str) -> GeometryError:
    return GeometryError("blade", "sections", name, reason)

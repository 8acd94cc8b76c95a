"""Hexahedra of the sector from the quadrilaterals of the planform."""

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, radians

import numpy as np

from geometry.blade.fitting import fitted_planform
from geometry.blade.layouts import MeshingError, contact_fractions, graded_fractions
from geometry.blade.parameters import BladeParameters, MeshParameters, ShroudParameters
from geometry.blade.planform import Planform, inner_radius, is_mirrored, mid_radius, section_at, upright
from geometry.blade.planform_mesh import PlanformMesh, mesh_planform
from geometry.blade.profiles import profile_points
from geometry.blade.section import fillet_layers, resized, straight_edged_half_thickness
from geometry.blade.smoothing import Movable, smoothed
from geometry.quality import hexahedron_scaled_jacobian, quadrilateral_scaled_jacobian
from geometry.sector import FloatArray, IntArray

MIRRORED_CORNERS = [0, 3, 2, 1, 4, 7, 6, 5]  # a mirror image turns hexahedra inside out; this node order undoes it
UNMOVED = 0.1  # of the element size: nodes of a platform that move less are not smoothed
TWIST_STEP = 15.0  # degrees: largest twist of one layer of elements


def bend(x: FloatArray, angle: FloatArray, radius: float) -> FloatArray:
    """Cylindrical to Cartesian: y = r sin(theta), z = r cos(theta); (..., 3)."""
    return np.stack(np.broadcast_arrays(x, radius * np.sin(angle), radius * np.cos(angle)), axis=-1)


def airfoil_levels(
    blade: BladeParameters, shroud: ShroudParameters, mesh: MeshParameters, bands: Sequence[FloatArray] = ()
) -> tuple[FloatArray, FloatArray]:
    """Relative heights (n,) of the airfoil's nodes, root to shroud, and the offsets (n,) m of the fillets there.

    `bands` are radii (m,) that must be among those of the nodes, ascending, with no other between them.
    """
    span = inner_radius(blade, shroud) - blade.hub_radius
    root, tip = (fillet_layers(part.fillet_radius, mesh.size) for part in (blade, shroud))
    low, high = blade.fillet_radius / span, shroud.fillet_radius / span
    middle, start = [], low
    for band in (*sorted(bands, key=lambda band: float(band[0])), None):
        length = 1 - start - high if band is None else float(band[0] - blade.hub_radius) / span - start
        least = max(1 if len(bands) else 2, ceil(abs(blade.twist) * (length / (1 - low - high)) / TWIST_STEP))
        middle.append(start + length * graded_fractions(span * length, mesh.size, least, mesh.grading))
        if band is not None:
            middle[-1] = middle[-1][:-1]
            middle.append((band[:-1] - blade.hub_radius) / span)
            start = float(band[-1] - blade.hub_radius) / span
    between = np.concatenate(middle)
    heights = [
        np.linspace(0.0, low, len(root))[:-1],
        between,
        1 - np.linspace(high, 0.0, len(tip))[1:],
    ]
    offsets = [root[:-1], np.zeros(len(between)), tip[::-1][1:]]
    return np.concatenate(heights), np.concatenate(offsets)


def developed_section(
    plan: Planform, flat: PlanformMesh, blade: BladeParameters, radius: float, place: tuple[float, float]
) -> FloatArray:
    """Nodes (f, 2) of the airfoil at a radius (m) in x and arc length: of true size on the cylinder of this radius.

    `place`: relative height, and offset of a fillet there, m.
    """
    height, offset = place
    if blade.sections is not None:
        half = plan.section.half_length
        upper, lower = (
            np.interp(flat.strip[:, 0], nodes, straight_edged_half_thickness(plan.section, nodes))
            for nodes in flat.flanks
        )
        across = flat.strip[:, 1] / np.where(flat.strip[:, 1] > 0, upper, lower)
        places = (np.stack([flat.strip[:, 0] / half, across], axis=1) + 1) / 2
        flanks = ((flat.flanks[0] / half + 1) / 2, (flat.flanks[1] / half + 1) / 2)
        return profile_points(blade.sections.curves(radius), places, flanks)
    section = replace(section_at(blade, height), offset=offset)
    along, across = section.bent(resized(flat.strip, flat.flanks, plan.section, section)).T
    turn = radians(blade.root_stagger + height * blade.twist)
    return np.stack(
        [along * np.cos(turn) - across * np.sin(turn), along * np.sin(turn) + across * np.cos(turn)], axis=1
    )


def _around_sections(
    plan: Planform, flat: PlanformMesh, blade: BladeParameters, shroud: ShroudParameters, mesh: MeshParameters
) -> PlanformMesh:
    """The planform with the nodes of the airfoil on its section of points, those around it smoothed."""
    radius, points, around = inner_radius(blade, shroud), flat.points.copy(), flat.quads[~flat.airfoil]
    points[flat.foot] = developed_section(plan, flat, blade, radius, (1.0, 0.0)) * [1.0, plan.stretch]
    moved = float(np.abs(points - flat.points).max())
    if moved > UNMOVED * mesh.size:
        free = np.ones(points.shape, dtype=bool)
        free[np.concatenate([flat.foot, flat.border])] = False
        points = smoothed(points, around, Movable(free, np.arange(len(points)), np.zeros(points.shape)))
    if not float(quadrilateral_scaled_jacobian(points, flat.quads).min()) > 0.0:
        raise MeshingError("the section at the shroud does not fit on the platform")
    return replace(flat, points=points, origin=int(np.argmin(np.hypot(*points.T))))


def swept_planform(
    blade: BladeParameters, shroud: ShroudParameters, mesh: MeshParameters, bands: Sequence[FloatArray] = ()
) -> tuple[Planform, PlanformMesh, FloatArray, IntArray]:
    """Planform and its mesh before mirroring, points (N, 3) and hexahedra (E, 8) of blade and shroud.

    `bands` as in `airfoil_levels`.

    The footprint of the fillet at the shroud is that between straight edges of elements. Raises MeshingError.
    """
    plan = fitted_planform(blade, shroud)
    offset = float(fillet_layers(shroud.fillet_radius, mesh.size)[0])
    plan = replace(plan, section=replace(plan.section, offset=offset))
    flat = mesh_planform(plan, mesh.size, mesh.contact_grid[0])
    blade = upright(blade, shroud)
    if blade.sections is not None:
        flat = _around_sections(plan, flat, blade, shroud, mesh)
    points, hexahedra = sweep(plan, flat, blade, shroud, mesh, bands)
    if is_mirrored(shroud):
        # 0 - x, not -x: the zeros of the axial coordinate stay +0
        points = np.stack([0.0 - points[:, 0], points[:, 1], points[:, 2]], axis=1)
        hexahedra = hexahedra[:, MIRRORED_CORNERS]
    worst = float(hexahedron_scaled_jacobian(points, hexahedra).min())
    if not worst > 0:
        raise MeshingError(f"folded elements, worst scaled Jacobian {worst:.2g}")
    return plan, flat, points, hexahedra


def sweep(
    plan: Planform,
    flat: PlanformMesh,
    blade: BladeParameters,
    shroud: ShroudParameters,
    mesh: MeshParameters,
    bands: Sequence[FloatArray] = (),
) -> tuple[FloatArray, IntArray]:
    """Points (N, 3) and hexahedra (E, 8): the planform swept through the shroud, the airfoil swept to the hub.

    The layers of the shroud come first, inner surface to outer, each with all points of the planform in order.
    """
    inner, middle = inner_radius(blade, shroud), mid_radius(blade, shroud)
    layers = contact_fractions(mesh.contact_grid[1], shroud.thickness, mesh.size)
    radii = inner + shroud.thickness * layers
    angle = flat.points[:, 1] / middle
    points = [bend(flat.points[:, 0], angle, float(r)) for r in radii]
    n = len(flat.points)
    hexahedra = [np.hstack([flat.quads + k * n, flat.quads + (k + 1) * n]) for k in range(len(radii) - 1)]

    foot = flat.foot
    heights, offsets = (table[:-1] for table in airfoil_levels(blade, shroud, mesh, bands))
    for h, offset in zip(map(float, heights), map(float, offsets), strict=True):
        radius = blade.hub_radius + h * (inner - blade.hub_radius)
        x, arc = developed_section(plan, flat, blade, radius, (h, offset)).T
        points.append(bend(x, arc / radius, radius))
    local = np.full(n, -1)
    local[foot] = np.arange(len(foot))
    quads = local[flat.quads[flat.airfoil]]
    start = len(radii) * n
    for k in range(len(heights) - 1):
        hexahedra.append(np.hstack([quads + start + k * len(foot), quads + start + (k + 1) * len(foot)]))
    last = start + (len(heights) - 1) * len(foot)
    hexahedra.append(np.hstack([quads + last, flat.quads[flat.airfoil]]))
    return np.vstack(points), np.vstack(hexahedra).astype(np.int64)

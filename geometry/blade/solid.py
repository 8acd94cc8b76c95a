"""Hexahedra of the sector from the quadrilaterals of the planform."""

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, radians

import numpy as np

from geometry.blade.fitting import fitted_planform
from geometry.blade.layouts import MeshingError, contact_fractions, graded_fractions
from geometry.blade.parameters import BladeParameters, MeshParameters, ShroudParameters
from geometry.blade.planform import Planform, inner_radius, is_mirrored, mid_radius, section_at
from geometry.blade.planform_mesh import PlanformMesh, mesh_planform
from geometry.blade.section import fillet_layers, resized
from geometry.quality import hexahedron_scaled_jacobian
from geometry.sector import FloatArray, IntArray

MIRRORED_CORNERS = [0, 3, 2, 1, 4, 7, 6, 5]  # a mirror image turns hexahedra inside out; this node order undoes it
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


def airfoil_points(section: FloatArray, stagger: float, radius: float) -> FloatArray:
    """Nodes (k, 3) of a section at a ``radius`` (m), staggered (degrees), from its own coordinates (k, 2).

    It is rotated in the tangent plane of the cylinder of this radius and laid on the cylinder, so that its
    size is true and its radius exact.
    """
    turn = radians(stagger)
    along, across = section[:, 0], section[:, 1]
    x = along * np.cos(turn) - across * np.sin(turn)
    arc = along * np.sin(turn) + across * np.cos(turn)
    return bend(x, arc / radius, radius)


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
    mirrored = is_mirrored(shroud)
    upright = replace(blade, root_stagger=-blade.root_stagger, twist=-blade.twist) if mirrored else blade
    points, hexahedra = sweep(plan, flat, upright, shroud, mesh, bands)
    if mirrored:
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

    foot = np.unique(flat.quads[flat.airfoil])
    strip = plan.unplace(flat.points[foot])
    heights, offsets = (table[:-1] for table in airfoil_levels(blade, shroud, mesh, bands))
    for h, offset in zip(map(float, heights), map(float, offsets), strict=True):
        section = replace(section_at(blade, h), offset=offset)
        stagger, radius = blade.root_stagger + h * blade.twist, blade.hub_radius + h * (inner - blade.hub_radius)
        places = section.bent(resized(strip, flat.flanks, plan.section, section))
        points.append(airfoil_points(places, stagger, radius))
    local = np.full(n, -1)
    local[foot] = np.arange(len(foot))
    quads = local[flat.quads[flat.airfoil]]
    start = len(radii) * n
    for k in range(len(heights) - 1):
        hexahedra.append(np.hstack([quads + start + k * len(foot), quads + start + (k + 1) * len(foot)]))
    last = start + (len(heights) - 1) * len(foot)
    hexahedra.append(np.hstack([quads + last, flat.quads[flat.airfoil]]))
    return np.vstack(points), np.vstack(hexahedra).astype(np.int64)

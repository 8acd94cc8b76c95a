"""Hexahedra of the sector from the quadrilaterals of the planform."""

from math import ceil, radians

import numpy as np

from geometry.divisions import contact_fractions, graded_fractions
from geometry.parameters import BladeParameters, MeshParameters, ShroudParameters
from geometry.planform import Planform, inner_radius, mid_radius, section_at
from geometry.planform_mesh import PlanformMesh
from geometry.sector import FloatArray, IntArray

TWIST_STEP = 15.0  # degrees: largest twist of one layer of elements


def bend(x: FloatArray, angle: FloatArray, radius: float) -> FloatArray:
    """Cylindrical to Cartesian: y = r sin(theta), z = r cos(theta); (..., 3)."""
    return np.stack(np.broadcast_arrays(x, radius * np.sin(angle), radius * np.cos(angle)), axis=-1)


def airfoil_points(section: FloatArray, height: float, blade: BladeParameters, radius: float) -> FloatArray:
    """Nodes (k, 3) of the airfoil at the relative ``height`` (0 root, 1 shroud) from its section at the shroud.

    The section is scaled in thickness (taper), rotated by its stagger in the tangent plane of the cylinder of this
    radius and laid on the cylinder, so that its size is true and its radius exact.
    """
    scale = section_at(blade, height).thickness / section_at(blade, 1.0).thickness
    turn = radians(blade.root_stagger + height * blade.twist)
    along, across = section[:, 0], section[:, 1] * scale
    x = along * np.cos(turn) - across * np.sin(turn)
    arc = along * np.sin(turn) + across * np.cos(turn)
    return bend(x, arc / radius, radius)


def sweep(
    plan: Planform, flat: PlanformMesh, blade: BladeParameters, shroud: ShroudParameters, mesh: MeshParameters
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
    section = plan.unplace(flat.points[foot])
    least = max(2, ceil(abs(blade.twist) / TWIST_STEP))
    heights = graded_fractions(inner - blade.hub_radius, mesh.size, least, mesh.grading)[:-1]
    for h in heights:
        points.append(airfoil_points(section, h, blade, blade.hub_radius + h * (inner - blade.hub_radius)))
    local = np.full(n, -1)
    local[foot] = np.arange(len(foot))
    quads = local[flat.quads[flat.airfoil]]
    start = len(radii) * n
    for k in range(len(heights) - 1):
        hexahedra.append(np.hstack([quads + start + k * len(foot), quads + start + (k + 1) * len(foot)]))
    last = start + (len(heights) - 1) * len(foot)
    hexahedra.append(np.hstack([quads + last, flat.quads[flat.airfoil]]))
    return np.vstack(points), np.vstack(hexahedra).astype(np.int64)

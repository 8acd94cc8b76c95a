"""The named surfaces of the airfoil: their areas, sides and normals."""

import numpy as np
import pytest

from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
from geometry.elements import ELEMENT_KINDS

ANGLES = (60.0, 135.0)  # the second one is meshed as a mirror image


def normals(sector, name):
    """Centres (s, 3) and area vectors (s, 3) of the sides of a surface; outward by the order of their corners."""
    surface = sector.surfaces[name]
    block = sector.blocks[0]
    corners = np.array(ELEMENT_KINDS["hex8"].sides)[surface.side]
    points = sector.points[np.take_along_axis(block.nodes[surface.element], corners, axis=1)]
    return points.mean(axis=1), 0.5 * np.cross(points[:, 2] - points[:, 0], points[:, 3] - points[:, 1])


@pytest.fixture(scope="module", params=[("rectangle", 0.0), ("lens", 0.0), ("lens", 40.0)])
def section(request):
    return {"section": request.param[0], "camber": request.param[1]}


@pytest.mark.parametrize("angle", ANGLES)
def test_the_four_surfaces_enclose_the_airfoil(angle, section):
    blade = BladeParameters(40, 0.3, 0.1, 0.02, 0.006, root_stagger=10.0, **section)
    sector = build_sector(blade, ShroudParameters(angle, 0.01, 0.04, 0.01), MeshParameters(size=0.006))
    total = np.zeros(3)
    for name, direction in (
        ("suction_side", [0.0, 1.0, 0.0]),
        ("pressure_side", [0.0, -1.0, 0.0]),
        ("leading_edge", [-1.0, 0.0, 0.0]),
        ("trailing_edge", [1.0, 0.0, 0.0]),
    ):
        centres, areas = normals(sector, name)
        turn = np.radians(10.0)
        along = np.array([np.cos(turn), np.sin(turn), 0.0]) * direction[0]
        across = np.array([-np.sin(turn), np.cos(turn), 0.0]) * direction[1]
        assert (areas @ (along + across) > 0.0).all(), name
        assert centres[:, 2].max() < 0.4 - 0.01
        total += areas.sum(axis=0)
    # no side is left out and none is there twice: a prism between root and shroud has no net area across its axis
    assert np.linalg.norm(total[:2]) < 0.02 * np.abs(normals(sector, "suction_side")[1]).sum()
    sides = np.concatenate([sector.surfaces[n].element * 6 + sector.surfaces[n].side for n in sector.surfaces])
    assert len(np.unique(sides)) == len(sides)
    length = sum(np.linalg.norm(normals(sector, n)[1], axis=1).sum() for n in sector.surfaces) / 0.09
    if section["section"] == "rectangle":
        assert length == pytest.approx(2 * (0.02 + 0.006), rel=0.02)

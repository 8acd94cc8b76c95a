"""Drawing of blades with platform, under-platform damper and snubber, seen along the engine axis."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from docs.drawings.lines import bare, drawing_style, leader
from geometry import BladeParameters, MeshParameters, PlatformParameters, SectorMesh, SnubberParameters, build_sector
from geometry.frames import rotate_about_axis

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MM = 1e3
BODY, NEIGHBOUR, DAMPER = "0.80", "0.92", "#E69F00"
BLADE = BladeParameters(48, 0.300, 0.150, 0.036, 0.009, tip_thickness=0.006, section="lens")
PLATFORM = PlatformParameters(radius=0.330, thickness=0.008, flank_angle=35.0)
SNUBBER = SnubberParameters(radius=0.400, thickness=0.005, width=0.012, angle=60.0)


def wedge_of(sector: SectorMesh) -> Any:
    """Corners (3, 2), y and z in m, of the wedge that fills the roof of the flanks: both bases, the ridge."""
    middle = np.pi / sector.n_blades
    frame = np.array([[np.cos(middle), -np.sin(middle)], [np.sin(middle), np.cos(middle)]])  # across, upward
    flank = sector.points[sector.seen_from("platform").node_sets["face_right"]][:, 1:] @ frame.T
    low, high = flank[flank[:, 1].argmin()], flank[flank[:, 1].argmax()]
    ridge = [0.0, high[1] - high[0] * (high[1] - low[1]) / (high[0] - low[0])]
    return np.array([low, [-low[0], low[1]], ridge]) @ frame


def damper_figure(_: Path) -> Figure:
    """Three blades with the dampers between them, and one damper between its flanks."""
    from matplotlib import pyplot as plt
    from matplotlib.collections import PolyCollection

    sector = build_sector(BLADE, None, MeshParameters(size=0.003), snubber=SNUBBER, platform=PLATFORM)
    quads = sector.hexahedra[:, [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]]
    wedge = wedge_of(sector)
    pitch = 2.0 * np.pi / sector.n_blades
    with drawing_style():
        figure, (whole, near) = plt.subplots(1, 2, figsize=(9.0, 5.2), width_ratios=(1.0, 1.3), layout="constrained")
        for axes, title in ((whole, "Blades along the engine axis"), (near, "One damper and its two interfaces")):
            for j in (-1, 1, 0):
                colour = NEIGHBOUR if j else BODY
                points = MM * rotate_about_axis(sector.points, j * pitch)[:, 1:]
                corners = points[quads.reshape(-1, 4)]
                axes.add_collection(
                    PolyCollection(list(corners), facecolors=colour, edgecolors=colour, linewidths=0.4)
                )
            for j in (-1, 0):
                y, z = (MM * rotate_about_axis(np.column_stack([np.zeros(3), wedge]), j * pitch)[:, 1:]).T
                axes.fill(y, z, facecolor=DAMPER, edgecolor="black", linewidth=0.8)
            axes.set_aspect("equal")
            bare(axes, title)
        whole.set(xlim=(-75.0, 75.0), ylim=(290.0, 460.0))
        y, z = MM * wedge.mean(axis=0)
        near.set(xlim=(y - 22.0, y + 22.0), ylim=(z - 10.0, z + 16.0))
        _names(whole, near, MM * wedge)
        return figure


def _names(whole: Any, near: Any, wedge: Any) -> None:
    """Names of the parts, and of the two contact interfaces of the damper."""
    whole.text(0.0, 375.0, "blade", ha="center", va="center", rotation=90.0)
    leader(whole, (12.0, 400.0), (40.0, 425.0), "snubber")
    leader(whole, (12.0, 331.0), (38.0, 352.0), "platform")
    leader(whole, tuple(wedge.mean(axis=0)), (44.0, 304.0), "damper")
    right, left, ridge = wedge
    leader(near, tuple((right + ridge) / 2.0), (right[0] - 10.0, ridge[1] + 10.0), "damper_right")
    leader(near, tuple((left + ridge) / 2.0), (left[0] + 8.0, ridge[1] + 10.0), "damper_left")

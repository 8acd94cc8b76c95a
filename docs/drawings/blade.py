"""Drawing of a blade with its dimensions: from the side, from the tip, and the contact between neighbours."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from docs.drawings.contact_element import draw_element
from docs.drawings.lines import (
    CENTRE,
    LEFT,
    OUTLINE,
    RIGHT,
    THIN,
    angle_arc,
    arrow,
    bare,
    dimension,
    drawing_style,
    ground,
    leader,
)
from geometry import BladeParameters, ShroudParameters
from geometry.blade.fitting import fitted_planform
from geometry.blade.planform import Planform, mid_radius, section_at

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MM = 1e3
BODY, NEIGHBOUR = "0.90", "0.965"
PLAIN = {"facecolor": "white", "edgecolor": "none", "pad": 1.2}


@dataclass(frozen=True)
class Drawn:
    """The blade of a scene, lengths in m: parameters, planform of the shroud, pitch at its mid radius."""

    blade: BladeParameters
    shroud: ShroudParameters
    plan: Planform
    pitch: float


def blade_of(scene: Path) -> Drawn:
    """The blade of a scene file with a shroud angle of at most 90 degrees."""
    values = tomllib.loads(scene.read_text(encoding="utf-8"))
    blade, shroud = BladeParameters(**values["blade"]), ShroudParameters(**values["shroud"])
    pitch = 2 * np.pi * mid_radius(blade, shroud) / blade.n_blades
    return Drawn(blade, shroud, fitted_planform(blade, shroud), pitch)


def airfoil(drawn: Drawn, height: float) -> Any:
    """(x, y) of the outline of the section at a relative height, (n, 2) in mm."""
    section = section_at(drawn.blade, height)
    along = np.linspace(-1.0, 1.0, 81) * section.half_length
    half = section.half_thickness(along)
    outline = section.bent(np.vstack([np.column_stack([along, half]), np.column_stack([along, -half])[::-1]]))
    stagger = np.deg2rad(drawn.blade.root_stagger + height * drawn.blade.twist)
    c, s = np.cos(stagger), np.sin(stagger)
    return MM * outline @ np.array([[c, s], [-s, c]])


def draw_side(axes: Axes, drawn: Drawn) -> None:
    """The blade seen along the circumference: x to the right, z upwards from the hub."""
    blade, shroud = drawn.blade, drawn.shroud
    top, depth, half = MM * blade.length, MM * shroud.thickness, MM * shroud.axial_width / 2
    heights = np.linspace(0.0, 1.0, 40)
    x = np.array([(airfoil(drawn, h)[:, 0].min(), airfoil(drawn, h)[:, 0].max()) for h in heights])
    z = heights * (top - depth)
    axes.fill_betweenx(z, x[:, 0], x[:, 1], color=BODY)
    for side in x.T:
        axes.plot(side, z, **OUTLINE)
    axes.fill(
        [-half, half, half, -half],
        [top - depth, top - depth, top, top],
        facecolor=BODY,
        edgecolor="0.1",
        linewidth=1.3,
    )
    contact = MM * drawn.plan.contact_half[0]
    axes.fill([-contact, contact, contact, -contact], [top - depth, top - depth, top, top], color=RIGHT)
    leader(axes, (contact / 2, top - depth / 2), (12, top + 13), "contact face", color=RIGHT, va="center")
    ground(axes, (26, 0), (-26, 0), 3.0)
    axes.plot([0, 0], [-22, top + 16], **CENTRE)
    axes.plot([-34, 40], [-22, -22], **CENTRE)
    arrow(axes, (40, -22), (48, -22), color="0.35", linewidth=0.9)
    axes.text(49, -22, "x, engine axis\n(not to scale)", va="center", color="0.35")
    arrow(axes, (0, top + 16), (0, top + 24), color="0.35", linewidth=0.9)
    axes.text(2, top + 22, "z", color="0.35", va="center")
    root = MM * blade.chord / 2
    dimension(axes, (-root, 0), (root, 0), (0, 20), f"chord {_mm(blade.chord)}")
    dimension(axes, (half, 0), (half, top), (22, 0), f"length {_mm(blade.length)}")
    dimension(axes, (half, top - depth), (half, top), (9, 0), "", at=(half + 4.0, top - 12))
    axes.text(half + 2, top - depth - 3, f"thickness {_mm(shroud.thickness)}", va="top", bbox=PLAIN)
    dimension(axes, (-half, 0), (-half, -22), (-10, 0), "")
    axes.text(-half - 12, -11, f"hub_radius\n{_mm(blade.hub_radius)}", ha="right", va="center")
    tip = blade.thickness if blade.tip_thickness is None else blade.tip_thickness
    depths = f"thickness {_mm(blade.thickness)} at the root,\n{_mm(tip)} at the shroud"
    note = f"{blade.section} section,\n{depths},\ntwist {blade.twist:g}°"
    leader(axes, (-8, 90), (-half - 5, 104), note, ha="right", va="center")
    dimension(axes, (-half, top), (half, top), (0, 32), f"axial_width {_mm(shroud.axial_width)}")
    bare(axes, "From the side")
    axes.set(xlim=(-72, 76), ylim=(-34, top + 40))


def draw_tip(axes: Axes, drawn: Drawn) -> None:
    """Shroud of a blade and of both neighbours in the developed plane: x to the right, circumference upwards."""
    plan, shroud, pitch = drawn.plan, drawn.shroud, MM * drawn.pitch
    outline, right = MM * plan.outline(), MM * plan.right_profile()
    for j in (-1, 0, 1):
        axes.fill(
            *(outline + np.array([0, j * pitch])).T,
            facecolor=BODY if j == 0 else NEIGHBOUR,
            edgecolor="0.1",
            linewidth=1.0,
        )
    section = airfoil(drawn, 1.0)
    axes.plot(*section.T, color="0.35", linewidth=0.8, linestyle=(0, (4, 2)))
    axes.plot(*right[1:3].T, color=RIGHT, linewidth=3.2, solid_capstyle="butt")
    axes.plot(*(right[1:3] - [0, pitch]).T, color=LEFT, linewidth=3.2, solid_capstyle="butt")
    half = MM * shroud.axial_width / 2
    axes.plot([-half - 8, half + 18], [0, 0], **CENTRE)
    arrow(axes, (half + 18, 0), (half + 25, 0), color="0.35", linewidth=0.9)
    axes.text(half + 26, 0, "x", va="center", color="0.35")
    _frame(axes, drawn, (0, pitch / 2))
    axes.plot([0, 17], [-pitch / 2] * 2, **THIN)
    angle_arc(axes, (0, -pitch / 2), 12.0, (0.0, shroud.angle), f"angle $\\alpha$ = {shroud.angle:g}°")
    dimension(axes, (-half, -pitch / 2), (-half, pitch / 2), (-9, 0), f"pitch {_mm(drawn.pitch)}")
    low = outline[:, 1].min() - pitch
    dimension(axes, (-half, -1.5 * pitch), (half, -1.5 * pitch), (0, low + 1.5 * pitch - 5), "")
    axes.text(0, low - 5, f"axial_width {_mm(shroud.axial_width)}", ha="center", va="center", bbox=PLAIN)
    start, end = right[1] - [0, pitch], right[2] - [0, pitch]
    away = np.array([-1.0, 0.36]) * 7
    dimension(
        axes,
        start,
        end,
        away,
        f"contact_length {_mm(shroud.contact_length)}",
        rotation=0,
        ha="right",
        at=(start + end) / 2 + away + [-1, 0],
    )
    axes.text(half - 1, 0.25 * pitch, "blade j", ha="right")
    axes.text(half - 1, 1.2 * pitch, "blade j+1", ha="right", color="0.35")
    axes.text(half - 1, -0.95 * pitch, "blade j-1", ha="right", color="0.35")
    leader(axes, right[1] + 0.25 * (right[2] - right[1]), (half + 6, pitch / 2 + 9), "right face", color=RIGHT)
    leader(axes, right[1] + [0.3, -pitch + 1], (half + 6, -pitch / 2 - 13), "left face", color=LEFT)
    bare(axes, "Shrouds from the tip")
    axes.set(xlim=(-half - 24, half + 30), ylim=(low - 10, outline[:, 1].max() + pitch + 2))


def _frame(axes: Axes, drawn: Drawn, foot: tuple[float, float]) -> None:
    """Tangent and normal of the right face."""
    turn = np.deg2rad(drawn.shroud.angle)
    for name, way in (("t_1", (np.cos(turn), np.sin(turn))), ("n", (-np.sin(turn), np.cos(turn)))):
        head = np.asarray(foot) + 13 * np.asarray(way)
        arrow(axes, foot, head, color=RIGHT)
        axes.text(*(np.asarray(foot) + 15.5 * np.asarray(way)), f"${name}$", color=RIGHT, ha="center", va="center")


def _mm(metres: float) -> str:
    return f"{MM * metres:.4g}"


def blade_figure(scene: Path) -> Figure:
    """The drawing; lengths in mm, named by the keys of the scene."""
    from matplotlib import pyplot as plt

    drawn = blade_of(scene)
    with drawing_style():
        figure, axes = plt.subplots(1, 3, figsize=(12.0, 5.4), width_ratios=(1.05, 0.95, 1.0), layout="constrained")
        draw_side(axes[0], drawn)
        draw_tip(axes[1], drawn)
        draw_element(axes[2], "Contact of two neighbours, enlarged")
        figure.supxlabel("Lengths in mm, named by the keys of a scene.", fontsize=8.5, color="0.35")
        return figure

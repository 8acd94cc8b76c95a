"""Drawing of the frames and of the travelling wave."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from docs.drawings.blade import BODY, MM, NEIGHBOUR, Drawn, blade_of
from docs.drawings.lines import CENTRE, LEFT, RIGHT, THIN, angle_arc, arrow, bare, drawing_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BLADES, ENGINE_ORDER = 12, 2  # of the wave that is drawn


def draw_ring(axes: Axes) -> None:
    """Blades of a ring: y to the right, z upwards, so x points to the reader."""
    pitch = 2 * np.pi / 24
    for j in range(-3, 4):
        turn = j * pitch
        radial, along = np.array([np.sin(turn), np.cos(turn)]), np.array([np.cos(turn), -np.sin(turn)])
        colour = BODY if j == 0 else NEIGHBOUR
        foot, tip, low = 5.0 * radial, 9.0 * radial, 8.6 * radial
        half = 9.0 * np.tan(pitch / 2)
        blade = [foot - 0.12 * along, foot + 0.12 * along, low + 0.12 * along, low - 0.12 * along]
        axes.fill(*np.array(blade).T, facecolor=colour, edgecolor="0.1", linewidth=0.9)
        shroud = [low - half * 0.956 * along, low + half * 0.956 * along, tip + half * along, tip - half * along]
        axes.fill(*np.array(shroud).T, facecolor=colour, edgecolor="0.1", linewidth=0.9)
        axes.text(*(4.55 * radial), f"{j:+d}" if j else "0", ha="center", va="center", fontsize=8.5)
        for side, face in ((1, RIGHT), (-1, LEFT)):
            ends = np.array([low + side * half * 0.956 * along, tip + side * half * along])
            if j == 0:
                axes.plot(*ends.T, color=face, linewidth=3.0, solid_capstyle="butt")
    turns = np.linspace(-0.95, 0.95, 80)
    axes.plot(5 * np.sin(turns), 5 * np.cos(turns), color="0.1", linewidth=1.1)
    arrow(axes, (0, 9), (0, 10.9))
    axes.text(0.2, 10.7, "$z$")
    arrow(axes, (0, 5.2), (1.75, 5.2))
    axes.text(1.85, 5.2, "$y$", va="center")
    axes.text(0, 3.85, "blade", ha="center", va="center", fontsize=8.5)
    turn = np.linspace(0.25, 0.75, 40)
    axes.plot(10.1 * np.sin(turn), 10.1 * np.cos(turn), color="0.35", linewidth=0.9)
    arrow(axes, 10.1 * np.array([np.sin(0.74), np.cos(0.74)]), 10.1 * np.array([np.sin(0.78), np.cos(0.78)]))
    axes.text(4.6, 9.75, "rotation $\\Omega$, towards $+y$", ha="left", fontsize=8.5)
    axes.text(
        -6.6,
        2.6,
        "The right face (orange) of blade $j$ touches the left face (blue)\nof blade $j+1$, which is"
        " blade $j$ turned by one pitch, $2\\pi/N_b$.",
        fontsize=8.5,
        va="top",
    )
    bare(axes, "Ring, seen against the engine axis $x$")
    axes.set(xlim=(-7.6, 8.6), ylim=(1.0, 11.4))


def draw_faces(axes: Axes, drawn: Drawn) -> None:
    """Frames of the right face of blade 0 and of its left face, in the developed plane."""
    plan, pitch = drawn.plan, MM * drawn.pitch
    outline, right = MM * plan.outline(), MM * plan.right_profile()
    for j in (0, 1):
        axes.fill(
            *(outline + np.array([0, j * pitch])).T,
            facecolor=BODY if j == 0 else NEIGHBOUR,
            edgecolor="0.1",
            linewidth=1.0,
        )
        axes.text(-17.5, j * pitch - 3, f"blade {'j+1' if j else 'j'}", color="0.2" if j == 0 else "0.4")
    turn = np.deg2rad(drawn.shroud.angle)
    axes.plot(*right[1:3].T, color=RIGHT, linewidth=3.2, solid_capstyle="butt")
    axes.plot(*(right[1:3] - [0, pitch]).T, color=LEFT, linewidth=3.2, solid_capstyle="butt")
    for colour, foot, face in ((RIGHT, pitch / 2, "R"), (LEFT, -pitch / 2, "L")):
        for name, way in (("t_1", (np.cos(turn), np.sin(turn))), ("n", (-np.sin(turn), np.cos(turn)))):
            arrow(axes, (0, foot), np.array([0, foot]) + 11 * np.array(way), color=colour)
            axes.text(
                *(np.array([0, foot]) + 13.2 * np.array(way)), f"${name}$", color=colour, ha="center", va="center"
            )
        axes.plot(0, foot, "o", color=colour, markersize=4)
        axes.text(4.5, foot - 4.0, f"$q_{face}$", color=colour)
    axes.plot([-26, 26], [0, 0], **CENTRE)
    arrow(axes, (26, 0), (32, 0), color="0.35", linewidth=0.9)
    axes.text(33, 0, "$x$", va="center", color="0.35")
    arrow(axes, (-25, -8), (-25, 6), color="0.35", linewidth=0.9)
    axes.text(-25, 8, "$y$", ha="center", color="0.35")
    axes.plot([0, 15], [pitch / 2] * 2, **THIN)
    angle_arc(axes, (0, pitch / 2), 9.0, (0.0, drawn.shroud.angle), "$\\alpha$")
    low = outline[:, 1].min()
    axes.text(
        0,
        low - 4,
        "$d = q_R - q_L\\,e^{\\mathrm{i}h\\psi}$ in each harmonic;  $t_2$ points to the reader",
        ha="center",
        va="top",
        fontsize=8.5,
    )
    bare(axes, "Contact frames, seen from the tip")
    axes.set(xlim=(-31, 38), ylim=(low - 11, outline[:, 1].max() + pitch + 1))


def draw_wave(axes: Axes) -> None:
    """Displacement of all blades at two instants."""
    psi = 2 * np.pi * ENGINE_ORDER / BLADES
    fine, blades = np.linspace(0, BLADES - 1, 400), np.arange(BLADES)
    for theta, colour, name in ((0.0, "0.1", "$\\theta = 0$"), (np.pi / 3, "#0072B2", "$\\theta = \\pi/3$")):
        axes.plot(fine, np.cos(theta + fine * psi), color=colour, linewidth=0.8, linestyle=(0, (5, 3)))
        axes.plot(blades, np.cos(theta + blades * psi), "o", color=colour, markersize=5, label=name)
    axes.annotate("", (4.95, 1.13), (6.05, 1.13), arrowprops={"arrowstyle": "->", "color": "#0072B2"})
    axes.text(6.2, 1.13, "the wave runs against the rotation", va="center", fontsize=8.5, color="#0072B2")
    axes.set(
        xlabel="blade $j$",
        ylabel="$q_j=\\mathrm{Re}\\;q\\,e^{\\mathrm{i}(\\theta+j\\psi)}$",
        yticks=[-1, 0, 1],
        ylim=(-1.65, 1.3),
        xticks=blades,
    )
    axes.axhline(0, color="0.8", linewidth=0.6, zorder=0)
    axes.legend(loc="lower left", fontsize=8.5, ncols=2, bbox_to_anchor=(0.0, -0.01), frameon=True, framealpha=0.9)
    axes.set_title(
        f"Travelling wave: $N_b = {BLADES}$, engine order {ENGINE_ORDER}, $\\psi = {np.rad2deg(psi):.0f}°$",
        loc="left",
        fontsize=10,
        fontweight="bold",
    )


def frames_figure(scene: Path) -> Figure:
    """Ring, contact frames and travelling wave."""
    from matplotlib import pyplot as plt

    with drawing_style():
        figure = plt.figure(figsize=(11.5, 6.2), layout="constrained")
        grid = figure.add_gridspec(2, 2, width_ratios=(1.15, 1.0), height_ratios=(1.35, 1.0))
        draw_ring(figure.add_subplot(grid[0, 0]))
        draw_wave(figure.add_subplot(grid[1, 0]))
        draw_faces(figure.add_subplot(grid[:, 1]), blade_of(scene))
        return figure

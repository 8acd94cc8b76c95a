"""Drawing of the contact element, and what its laws give: normal load, friction loop of a prescribed motion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from docs.drawings.lines import LEFT, OUTLINE, RIGHT, THIN, arrow, bare, drawing_style, spring
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, ContactParameters
from nonlinear.contact.return_map import jenkins_return_map

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STATES = {STICK: ("stick", "#0072B2"), SLIP: ("slip", "#D55E00"), LIFT_OFF: ("lift-off", "0.55")}


def draw_element(axes: Axes, title: str) -> None:
    """Normal spring, tangential spring and Coulomb slider between the faces of two blades."""
    body = {"edgecolor": "0.1", "linewidth": 1.3}
    axes.fill([-5, 5, 5, -5], [-4.6, -4.6, -3, -3], facecolor="0.90", **body)
    axes.fill([-5, 5, 5, -5], [3, 3, 4.6, 4.6], facecolor="0.965", **body)
    axes.plot([-5, 5], [-3, -3], color=RIGHT, linewidth=3.0, solid_capstyle="butt")
    axes.plot([-5, 5], [3, 3], color=LEFT, linewidth=3.0, solid_capstyle="butt")
    axes.text(0, -3.8, "blade j, right face", ha="center", va="center")
    axes.text(0, 3.8, "blade j+1, left face", ha="center", va="center")
    spring(axes, (-3.4, -3), (-3.4, 1.2), 0.9)
    axes.text(-2.7, -0.9, "$k_n$", va="center", fontsize=11)
    axes.plot([-4.4, -2.4], [1.2, 1.2], **OUTLINE)
    axes.annotate("", (-3.4, 3), (-3.4, 1.2), arrowprops={"arrowstyle": "<->", "color": "0.35", "linewidth": 0.8})
    axes.text(-3.1, 2.1, "$-v_0$\n(gap)", va="center", fontsize=8.5)
    axes.fill([1.0, 2.6, 2.6, 1.0], [1.3, 1.3, 2.1, 2.1], facecolor="0.75", **body)
    axes.plot([0.2, 4.2], [2.15, 2.15], color="0.1", linewidth=0.9)
    for x in np.linspace(0.4, 4.2, 9):
        axes.plot([x, x + 0.35], [2.15, 2.5], **THIN)
    axes.text(2.8, 1.68, "$\\mu$", va="center", fontsize=11)
    axes.plot([2.2, 2.2], [2.5, 3.0], **OUTLINE)
    spring(axes, (1.0, 1.7), (-1.6, 1.7), 0.7)
    axes.text(-0.3, 1.05, "$k_t$", ha="center", va="center", fontsize=11)
    axes.plot([-1.6, -1.6], [1.7, -3.0], **OUTLINE)
    arrow(axes, (1.8, 0.9), (3.2, 0.9), color="0.35", linewidth=0.8)
    axes.plot([1.8, 1.8], [0.7, 1.25], **THIN)
    axes.text(3.3, 0.9, "$w$ slider", va="center", color="0.35")
    for way, text, at in (((2.0, 0.0), "$u$ along $t_1$", (2.1, 0)), ((0.0, 1.7), "$d_n$ along $n$", (0.25, 1.5))):
        arrow(axes, (1.2, -2.2), (1.2 + way[0], -2.2 + way[1]), color=RIGHT)
        axes.text(1.2 + at[0], -2.2 + at[1], text, color=RIGHT, va="center")
    bare(axes, title)
    axes.set(xlim=(-5.4, 5.6), ylim=(-8.2, 5.0))
    laws = [
        "$v_0>0$ interference, $v_0<0$ gap",
        "$N=\\max(N_0+k_n(v_0+d_n),\\,0)$",
        "stick: $T=k_t(u-w)$, $|T|\\leq\\mu N$",
        "slip: $|T|=\\mu N$;  lift-off: $T=N=0$",
    ]
    for row, law in enumerate(laws):
        axes.text(0, -5.3 - 0.75 * row, law, ha="center", va="center")


def friction_loop(contact: ContactParameters, motion: Any, approach: Any) -> tuple[Any, Any, Any]:
    """Normal load, tangential force and state (n,) of one slider over a period, steady cycle."""
    load = contact.normal_load(approach[:, None])[:, 0]
    kt, limit = float(contact.tangential_stiffness[0]), contact.friction[0] * load
    state, source, sign = (np.zeros(len(motion), dtype=np.int64) for _ in range(3))
    jenkins_return_map(motion, limit, kt, state, source, sign)
    position = np.where(source >= 0, motion[source] - sign * limit[source] / kt, 0.0)
    return load, kt * (motion - position), state


def _draw_loop(axes: Axes, contact: ContactParameters, normal: float, title: str) -> None:
    """T and its limits over u, for u = cos theta and d_n = normal cos theta, coloured by state."""
    theta = np.linspace(0.0, 2 * np.pi, 4000, endpoint=False)
    motion = np.cos(theta)
    load, force, state = friction_loop(contact, motion, normal * np.cos(theta))
    limit = contact.friction[0] * load
    for sign in (1, -1):
        axes.plot(motion, sign * limit, color="0.6", linewidth=0.9, linestyle=(0, (5, 3)))
    for kind, (name, colour) in STATES.items():
        shown = np.where(state == kind, force, np.nan)
        if np.isfinite(shown).any():
            axes.plot(motion, shown, color=colour, linewidth=2.0, label=name)
    axes.axhline(0.0, color="0.8", linewidth=0.6, zorder=0)
    axes.text(
        0.0, 1.06 * np.interp(0.0, motion[2000:], limit[2000:]), "$\\mu N$", color="0.45", ha="right", va="bottom"
    )
    axes.margins(y=0.12)
    axes.set(xlabel="tangential motion $u$", ylabel="tangential force $T$", xticks=[], yticks=[], xlim=(-1.2, 1.2))
    axes.set_title(title, loc="left", fontsize=10, fontweight="bold")
    axes.legend(loc="upper left", fontsize=8, handlelength=1.4)


def one_node(**given: float) -> ContactParameters:
    """The parameters of one contact node, without units: friction 0.5, kt 1; kn, N0 and v0 as given, else 0."""
    values = {"normal_stiffness": 0.0, "preload": 0.0, "interference": 0.0} | given
    values |= {"friction": 0.5, "tangential_stiffness": 1.0}
    return ContactParameters(**{name: np.array([value]) for name, value in values.items()})


def element_figure(scene: Path) -> Figure:
    """The element, its normal load, and three cycles: full stick, slip, slip with lift-off; of any scene."""
    from matplotlib import pyplot as plt

    constant, stuck = one_node(preload=1.0), one_node(preload=3.0)
    variable = one_node(normal_stiffness=1.0, interference=0.35)
    with drawing_style():
        figure = plt.figure(figsize=(11.5, 5.0), layout="constrained")
        grid = figure.add_gridspec(2, 3, width_ratios=(1.25, 1.0, 1.0))
        draw_element(figure.add_subplot(grid[:, 0]), "Contact element")
        _draw_load(figure.add_subplot(grid[0, 1]))
        _draw_loop(figure.add_subplot(grid[0, 2]), stuck, 0.0, "Full stick")
        _draw_loop(figure.add_subplot(grid[1, 1]), constant, 0.0, "Slip, constant normal load")
        _draw_loop(figure.add_subplot(grid[1, 2]), variable, 1.0, "Slip and lift-off, $d_n$ in phase with $u$")
        return figure


def _draw_load(axes: Axes) -> None:
    """N over d_n for an interference and a gap."""
    normal = np.linspace(-1.0, 1.0, 401)
    for v0, colour in ((0.4, RIGHT), (-0.4, LEFT)):
        law = one_node(normal_stiffness=1.0, interference=v0)
        name = "interference, $v_0 > 0$" if v0 > 0 else "gap, $v_0 < 0$"
        axes.plot(normal, law.normal_load(normal[:, None])[:, 0], color=colour, linewidth=2.0, label=name)
        axes.plot([-v0], [0.0], "o", color=colour, markersize=4)
        axes.text(-v0, -0.13, f"${'-' if v0 > 0 else '|'}v_0{'' if v0 > 0 else '|'}$", ha="center", color=colour)
    axes.text(0.62, 1.18, "slope $k_n$", ha="right")
    axes.set(xlabel="normal motion $d_n$", ylabel="normal load $N$", xticks=[], yticks=[], ylim=(-0.22, 1.5))
    axes.set_title("Normal load ($N_0 = 0$)", loc="left", fontsize=10, fontweight="bold")
    axes.legend(loc="upper left", fontsize=8, handlelength=1.4)

"""Natural frequencies against nodal diameters, with the engine orders: nodal diameter and interference diagram."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.figures.crossing_marks import draw_crossings, list_height, numbered_crossings
from pipeline.figures.data import PlottedCurve
from pipeline.figures.spectra import LOOKS, MODES, apart, spectrum
from pipeline.figures.style import subplots, write_heading
from pipeline.stages.engine_orders import excited_orders
from pipeline.stages.mode_families_file import read_families

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rom import ModeFamilies, ReducedModel

SHARES = "plasma"  # colours of the disk's share of the strain energy
LISTED = 4  # engine orders that the legend names
NAMES = 0.1  # of the width of the diagram, at each end


def nodal_diameter_figure(curve: PlottedCurve, title: str, orders: Collection[int] = ()) -> Figure | None:
    """A line for each mode and contact condition over nodal diameters 0 .. N_b / 2; the excited ones are marked.

    With a disk the modes of free shrouds have names, and the colour of the disk's share of the strain energy. At a
    steady speed the engine orders make the folded line of the interference diagram. Bars with numbers: resonance
    crossings in the frequency range.
    None for a single blade against ground. The steady speed and the contact stiffness are those of `curve`; `orders`
    are the engine orders of the sweep, without any that of `curve`.
    """
    from rom import excited_nodal_diameter, read_reduced_model

    model = read_reduced_model(curve.rom, with_basis=False)
    if model.n_blades is None:
        return None
    known, families = sorted(model.wave_blocks), read_families(curve.rom)
    diameters = np.array(known or range(model.n_blades // 2 + 1))
    asked = set(orders) or {curve.scene.excitation.engine_order}
    crossings = numbered_crossings(curve, model, families, asked)
    figure, axes = subplots(size=(7.2, 4.8 + list_height(len(crossings))))
    top = _draw_states(axes, model, curve, diameters)
    if families is not None:
        _draw_families(axes, model, families, diameters, top)
    low, high = curve.scene.response.frequency
    axes.axhspan(low, high, color="0.95", zorder=0, label="range of the response")
    excited = sorted({multiple for order in asked for multiple, _ in excited_orders(curve.scene, order)})
    few = ", ".join(map(str, excited))
    numbers = few if len(excited) <= LISTED else f"{excited[0]} to {excited[-1]}"
    name = f"excited by engine order{'s' * (len(excited) > 1)} {numbers}"
    for number, diameter in enumerate(sorted({excited_nodal_diameter(order, model.n_blades) for order in excited})):
        axes.axvline(diameter, color="0.6", linewidth=0.8, zorder=0.5, label=name if number == 0 else None)
    if curve.scene.load.speed_rpm > 0.0:
        _draw_engine_orders(axes, model.n_blades, curve.scene.load.speed_rpm, excited, top)
    draw_crossings(axes, crossings, int(diameters[-1]), 1.05 * top)
    write_heading(axes, title)
    axes.set(xlabel="nodal diameter", ylabel="natural frequency [Hz]")
    axes.set_ylim(0.0, 1.05 * top)
    if families is None:
        axes.set_xlim(-0.5, diameters[-1] + 0.5)
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=9)
    else:  # beside the diagram there are names and colours
        axes.set_xlim(-NAMES * diameters[-1], (1.0 + NAMES) * diameters[-1])
        axes.legend(loc="upper left", bbox_to_anchor=(-0.13, -0.12), ncols=3, fontsize=8.5)
    return figure


def _draw_states(axes: Axes, model: ReducedModel, curve: PlottedCurve, diameters: NDArray[np.int64]) -> float:
    """Lines of free, sliding and stuck shrouds; returns the highest frequency, Hz."""
    free = (
        {} if model.has_disk else spectrum(model, curve, 0, ("free",))
    )  # that of one blade, whatever the nodal diameter
    states = tuple(LOOKS) if model.has_disk else ("sliding", "stuck")
    found = [free | spectrum(model, curve, int(diameter), states) for diameter in diameters]
    for name, look in LOOKS.items():
        lines = np.array([item[name] for item in found])
        for mode in range(lines.shape[1]):
            axes.plot(diameters, lines[:, mode], label=f"shrouds {name}" if mode == 0 else None, **look)
    return max(float(item["stuck"].max()) for item in found)


def _draw_families(
    axes: Axes, model: ReducedModel, families: ModeFamilies, diameters: NDArray[np.int64], top: float
) -> None:
    """Modes of free shrouds by the disk's share of their strain energy, and their names at both ends."""
    assert model.n_blades is not None
    pitch, last = 2.0 * np.pi / model.n_blades, int(diameters[-1])
    modes = [families.modes(model, pitch * int(diameter), count=min(MODES, model.size)) for diameter in diameters]
    places = np.concatenate(
        [np.full(len(hz), diameter) for (hz, _, _), diameter in zip(modes, diameters, strict=True)]
    )
    values, shares = (np.concatenate([item[k] for item in modes]) for k in (0, 2))
    points = axes.scatter(places, values, c=100.0 * shares, cmap=SHARES, vmin=0.0, vmax=100.0, s=14.0, zorder=3.0)
    bar = axes.figure.colorbar(points, ax=axes)
    bar.set_label("share of the disk in the strain energy, shrouds free [%]")
    for side, (hz, names, _) in ((0, modes[0]), (last, modes[-1])):
        offset, align = (-4, "right") if side == 0 else (5, "left")
        for height, name in apart(hz, names, top):
            look: dict[str, Any] = {"xytext": (offset, 0), "ha": align, "va": "center", "fontsize": 8}
            axes.annotate(name, (side, height), textcoords="offset points", **look)


def _draw_engine_orders(axes: Axes, n_blades: int, speed_rpm: float, excited: Sequence[int], top: float) -> None:
    """The line f = EO n / 60 folded at half the number of blades, with the excited orders on it."""
    from rom import excited_nodal_diameter

    per_order = speed_rpm / 60.0
    orders = np.arange(int(1.05 * top / per_order) + 2)
    folded = [excited_nodal_diameter(int(order), n_blades) for order in orders]
    name = f"engine orders at {speed_rpm:g} rev/min"
    axes.plot(folded, orders * per_order, color="#009E73", linewidth=1.0, zorder=2.0, label=name)
    shown = [order for order in excited if order * per_order <= 1.05 * top]
    places = [excited_nodal_diameter(order, n_blades) for order in shown]
    heights = [order * per_order for order in shown]
    axes.plot(places, heights, "s", color="#009E73", markersize=5.0, zorder=4.0)
    for order, place, height in zip(shown, places, heights, strict=True):
        axes.annotate(f"EO {order}", (place, height), textcoords="offset points", xytext=(5, 4), fontsize=8)

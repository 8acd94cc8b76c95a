"""Natural frequencies against nodal diameters."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np

from pipeline.figures.data import PlottedCurve
from pipeline.figures.spectra import LOOKS, aliased, spectrum
from pipeline.figures.style import subplots, write_heading

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def nodal_diameter_figure(curve: PlottedCurve, title: str, orders: Collection[int] = ()) -> Figure | None:
    """A line for each mode and contact condition over nodal diameters 0 .. N_b / 2; the excited ones are marked.

    None for a single blade against ground. The steady speed and the contact stiffness are those of `curve`; `orders`
    are the engine orders of the sweep, without any that of `curve`.
    """
    from rom import read_reduced_model

    model = read_reduced_model(curve.rom, with_basis=False)
    if model.n_blades is None:
        return None
    diameters = np.arange(model.n_blades // 2 + 1)
    free = spectrum(model, curve, 0, ("free",))  # that of one blade, whatever the nodal diameter
    found = [free | spectrum(model, curve, int(diameter), ("sliding", "stuck")) for diameter in diameters]
    figure, axes = subplots(size=(7.2, 4.8))
    for name, look in LOOKS.items():
        lines = np.array([item[name] for item in found])
        for mode in range(lines.shape[1]):
            axes.plot(diameters, lines[:, mode], label=f"shrouds {name}" if mode == 0 else None, **look)
    low, high = curve.scene.response.frequency
    axes.axhspan(low, high, color="0.95", zorder=0, label="range of the response")
    excited = sorted(set(orders) or {curve.scene.excitation.engine_order})
    name = f"excited by engine order{f's {excited[0]} to' if len(excited) > 1 else ''} {excited[-1]}"
    for number, diameter in enumerate(sorted({aliased(order, model.n_blades) for order in excited})):
        axes.axvline(diameter, color="0.6", linewidth=0.8, zorder=0.5, label=name if number == 0 else None)
    write_heading(axes, title)
    axes.set(xlabel="nodal diameter", ylabel="natural frequency [Hz]")
    axes.set_xlim(-0.5, diameters[-1] + 0.5)
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=9)
    return figure

"""Campbell diagram: natural frequencies against speed, with the lines of the engine orders."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.crossing_marks import COLOUR, draw_list, list_height
from pipeline.figures.data import Array, PlottedCurve
from pipeline.figures.spectra import LOOKS, MODES, apart, spectrum
from pipeline.figures.style import subplots, write_heading
from pipeline.stages.engine_orders import FEWEST, by_speed
from pipeline.stages.mode_families_file import read_families

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RAYS = 7  # approximate number of engine orders drawn


def campbell_figure(curves: Sequence[PlottedCurve], title: str) -> Figure | None:
    """A line for each mode and contact condition at the excited nodal diameter; None with fewer than three speeds.

    Where other keys are swept too, the blade, contact and engine order are those of the first curve.
    """
    chosen = by_speed(curves)
    if len(chosen) < FEWEST:
        return None
    speeds = np.array(sorted(chosen))
    order = curves[0].scene.excitation.engine_order
    found = [_spectrum(chosen[speed], order) for speed in speeds]
    crossings = _crossings(speeds, found, order)
    figure, axes = subplots(size=(7.2, 4.8 + list_height(len(crossings))))
    for name, look in LOOKS.items():
        lines = np.array([item[name] for item in found])
        for mode in range(lines.shape[1]):
            axes.plot(speeds, lines[:, mode], label=f"shrouds {name}" if mode == 0 else None, **look)
    top = max(float(item["stuck"].max()) for item in found)
    _draw_engine_orders(axes, float(speeds[-1]), order, top)
    names = _name_modes(axes, chosen[speeds[0]], order, (float(speeds[0]), top))
    _draw_crossings(axes, crossings, names)
    low, high = curves[0].scene.response.frequency
    axes.axhspan(low, high, color="0.95", zorder=0, label="range of the response")
    write_heading(axes, title)
    axes.set(xlabel="speed [rev/min]", ylabel=f"natural frequency [Hz], engine order {order}")
    axes.set_xlim(speeds[0], speeds[-1])
    axes.set_ylim(0.0, 1.05 * top)
    axes.legend(loc="center left", bbox_to_anchor=(1.06, 0.5), fontsize=9)
    return figure


def _spectrum(curve: PlottedCurve, engine_order: int) -> dict[str, Array]:
    from rom import read_reduced_model

    return spectrum(read_reduced_model(curve.rom, with_basis=False), curve, engine_order)


def _crossings(
    speeds: Array, found: Sequence[dict[str, Array]], order: int
) -> list[tuple[int, dict[str, list[tuple[float, float]]]]]:
    """Number of each mode that the engine order meets, with speeds and frequencies of the crossings by state."""
    from rom import speed_crossings

    crossings = []
    for mode in range(len(found[0]["stuck"])):
        lines = {state: [item[state][mode] for item in found] for state in ("free", "stuck")}
        met = {state: speed_crossings(speeds, line, order) for state, line in lines.items()}
        if any(met.values()):
            crossings.append((mode + 1, met))
    return crossings


def _draw_crossings(
    axes: Axes, crossings: Sequence[tuple[int, dict[str, list[tuple[float, float]]]]], names: Sequence[str]
) -> None:
    """A marker at each crossing, the number of the mode's entry in the list below beside it."""
    texts = []
    for number, (mode, met) in enumerate(crossings, start=1):
        name = names[mode - 1] if names else f"mode {mode}"
        parts = [f"{state} {f:.4g} Hz at {n:.0f} rev/min" for state, places in met.items() for n, f in places]
        texts.append(f"{name}: {', '.join(parts)}")
        for speed, frequency in (place for places in met.values() for place in places):
            axes.scatter([speed], [frequency], s=36.0, marker="D", color=COLOUR, edgecolor="0.2", zorder=4.0)
            look: dict[str, Any] = {"xytext": (6, -4), "ha": "left", "va": "top", "fontsize": 8}
            axes.annotate(str(number), (speed, frequency), textcoords="offset points", **look)
    draw_list(axes, "Resonance crossings of the engine order with free and with stuck shrouds", texts)


def _name_modes(axes: Axes, curve: PlottedCurve, engine_order: int, corner: tuple[float, float]) -> list[str]:
    """With a disk the names of the modes of free shrouds; `corner`: the lowest speed and the top of the diagram."""
    from rom import inter_blade_phase, read_reduced_model

    families = read_families(curve.rom)
    if families is None:
        return []
    model = read_reduced_model(curve.rom, with_basis=False)
    phase = inter_blade_phase(engine_order, model.n_blades)
    hz, names, _ = families.modes(model, phase, count=min(MODES, model.size))
    for height, name in apart(hz, names, corner[1]):
        look: dict[str, Any] = {"xytext": (4, 3), "fontsize": 8, "va": "bottom"}
        axes.annotate(name, (corner[0], height), textcoords="offset points", **look)
    return names


def _draw_engine_orders(axes: Axes, fastest: float, excited: int, top: float) -> None:
    """Rays f = EO n / 60 of some evenly spaced engine orders up to the corner of the diagram, and the excited one."""
    highest = 60.0 * top / fastest
    step = max(round(highest / RAYS), 1)
    for order in sorted({*range(step, int(highest) + 1, step), excited}):
        frequency = order * fastest / 60.0
        look: dict[str, Any] = {"color": "0.75", "linewidth": 0.6}
        if order == excited:
            look = {"color": "0.3", "linewidth": 1.2}
        axes.plot([0.0, fastest], [0.0, frequency], **look)
        inside = frequency <= 1.05 * top
        end = (fastest, frequency) if inside else (60.0 * 1.05 * top / order, 1.05 * top)
        beside: dict[str, Any] = {"xytext": (3, 0), "va": "center"}
        if not inside:
            beside = {"xytext": (0, 3), "ha": "center"}
        axes.annotate(f"{order}", end, textcoords="offset points", fontsize=8, **beside)

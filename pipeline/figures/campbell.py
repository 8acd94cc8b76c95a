"""Natural frequencies with free, sliding and stuck shrouds, against speed (Campbell diagram) and nodal diameter.

The nodal diameter diagram has the engine orders on it (interference diagram). Resonance crossings are numbered, and
listed below the diagram.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from pipeline.figures.data import Array
from pipeline.figures.style import TO_POINT, keep_apart, subplots, write_heading
from pipeline.stages.engine_orders import COUNT, FEWEST, by_speed, excited_orders
from pipeline.stages.model.model_files import read_families
from pipeline.stages.scene_to_solver import contact_on_model, coriolis_acts, frequencies_of, springs_by_state

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Annotation

    from pipeline.scene.schema import Scene
    from rom.cyclic.mode_families import ModeFamilies
    from rom.cyclic.mode_following import FollowedModes
    from rom.cyclic.reduced_model import ReducedModel
    from rom.cyclic.resonance_crossings import ResonanceCrossing


MODES = 4  # lowest ones that a diagram shows
DRAWN = 8  # modes that are followed, as lines come down into the diagram and leave it
CLOSE = 0.025  # of the height of the diagram: names nearer than this would overlap
LOOKS: dict[str, dict[str, Any]] = {
    "free": {"color": "0.0", "linestyle": (0, (1, 1.2)), "linewidth": 1.0},
    "sliding": {"color": "#0072B2", "linestyle": (0, (5, 1.5)), "linewidth": 1.2},
    "stuck": {"color": "#D55E00", "marker": "o", "markersize": 2.0, "linewidth": 0.8},
}


class Modelled(Protocol):
    """A member of a sweep with the file of its reduced model."""

    @property
    def rom(self) -> Path: ...

    @property
    def scene(self) -> Scene: ...

    @property
    def parameters(self) -> Mapping[str, Any]: ...


def apart(heights: Array, names: Sequence[str], top: float) -> list[tuple[float, str]]:
    """Names of modes with their heights in a diagram up to `top`; those too near to the last one join it."""
    found: list[tuple[float, str]] = []
    for height, name in zip(heights, names, strict=True):
        if found and height - found[-1][0] < CLOSE * top:
            found[-1] = (0.5 * (found[-1][0] + float(height)), f"{found[-1][1]}, {name}")
        else:
            found.append((float(height), name))
    return found


COLOUR = "#CC79A7"
TITLE = "Resonance crossings: from free to stuck shrouds; speed = 60 f / EO"
LISTED = 16  # crossings that the list names; of more the numbers are those of the table in the report
COLUMNS = 2
BOX = 0.045  # of the height of the diagram: numbers nearer than this share a box
ROW = 0.17  # height of a row of the list, inches


@dataclass(frozen=True)
class NumberedCrossing:
    """A crossing in the frequency range with its number in diagram and table, and the part of the mode's frequencies
    between free and stuck contacts that is in the range, Hz."""

    number: int
    crossing: ResonanceCrossing
    name: str
    low_hz: float
    high_hz: float

    @property
    def text(self) -> str:
        """Engine order, wave, mode, frequencies and speeds."""
        each = self.crossing
        parts = [f"EO {each.engine_order}, {each.wave}, {self.name}: {_span(each.free_hz, each.stuck_hz)} Hz"]
        if each.speeds_rpm is not None:
            parts.append(f"{_span(*each.speeds_rpm)} rev/min")
        return ", ".join(parts)


def numbered_crossings(
    curve: Modelled, model: ReducedModel, families: ModeFamilies | None, orders: Collection[int]
) -> list[NumberedCrossing]:
    """The crossings of engine orders and their multiples in the frequency range, as in the table of the report."""
    from rom.cyclic.cyclic_symmetry import inter_blade_phase
    from rom.cyclic.resonance_crossings import resonance_crossings

    springs, count = springs_by_state(contact_on_model(curve.scene, model)), min(COUNT, model.size)
    ranges = sorted({item for order in orders for item in excited_orders(curve.scene, order)})
    found: list[NumberedCrossing] = []
    for order, (low, high) in ranges:
        phase = inter_blade_phase(order, model.n_blades)
        free, stuck = (
            frequencies_of(curve.scene, model)(model, phase, count=count, **springs[state])
            for state in ("free", "stuck")
        )
        names = [f"mode {mode}" for mode in range(1, count + 1)]
        if families is not None:
            names = families.modes(model, phase, count=count)[1]
        for each in resonance_crossings(order, model.n_blades, free, stuck, (low, high)):
            if each.in_range:
                part = max(each.free_hz, low), min(each.stuck_hz, high)
                found.append(NumberedCrossing(len(found) + 1, each, names[each.mode - 1], *part))
    return found


def list_height(count: int) -> float:
    """Height, inches, that the list of so many crossings takes below the diagram."""
    rows = -(-count // COLUMNS) if count <= LISTED else 0
    return ROW * (1 + rows) if count else 0.0


def draw_crossings(axes: Axes, crossings: Sequence[NumberedCrossing], top: float) -> list[Annotation]:
    """A bar with its numbers for each mode, and the list; returns the numbers. `top` frequency of the diagram."""
    shown = [each for each in crossings if each.low_hz <= top]
    for diameter, low, high in {(each.crossing.nodal_diameter, each.low_hz, each.high_hz) for each in shown}:
        axes.vlines(diameter, low, min(high, top), color=COLOUR, linewidth=6.0, alpha=0.45, zorder=2.5)
    numbers = []
    for diameter in sorted({each.crossing.nodal_diameter for each in shown}):
        here = [each for each in shown if each.crossing.nodal_diameter == diameter]
        places = [(0.5 * (each.low_hz + min(each.high_hz, top)), each.number) for each in here]
        numbers += _write_numbers(axes, diameter, places, top)
    draw_list(axes, TITLE, [each.text for each in crossings])
    return numbers


def draw_list(axes: Axes, title: str, texts: Sequence[str]) -> None:
    """Numbered texts below the diagram; of too many their number alone."""
    from matplotlib.lines import Line2D

    if not texts:
        return
    listed = list(texts) if len(texts) <= LISTED else []
    handles = [
        Line2D([], [], linestyle="", marker=f"${number}$", color="black", markersize=6.0 if number < 10 else 9.0)
        for number in range(1, len(listed) + 1)
    ]
    for handle in handles:
        handle.set_markeredgewidth(0.0)
    figure: Any = axes.figure
    figure.legend(
        handles,
        listed,
        title=title if listed else f"{len(texts)} resonance crossings, numbered as in the report",
        title_fontsize=8,
        loc="outside lower center",
        ncols=COLUMNS,
        fontsize=7.0,
        handletextpad=0.2,
        columnspacing=1.0,
        borderpad=0.0,
    )


def _write_numbers(axes: Axes, diameter: int, places: list[tuple[float, int]], top: float) -> list[Annotation]:
    """Numbers at their heights at a nodal diameter of a diagram up to `top`; those that would overlap in one box."""
    boxes: list[list[tuple[float, int]]] = []
    for place in sorted(places):
        if boxes and place[0] - boxes[-1][-1][0] < BOX * top:
            boxes[-1].append(place)
        else:
            boxes.append([place])
    look: dict[str, Any] = {"textcoords": "offset points", "va": "center", "fontsize": 8, "zorder": 5.0}
    look |= {"bbox": {"boxstyle": "round,pad=0.12", "facecolor": "white", "edgecolor": COLOUR, "linewidth": 0.7}}
    labels = []
    for box in boxes:
        height = sum(place for place, _ in box) / len(box)
        text = ", ".join(str(number) for number in sorted(number for _, number in box))
        labels.append(axes.annotate(text, (diameter, height), xytext=(5, 0), arrowprops=dict(TO_POINT), **look))
    return labels


def _span(first: float, last: float) -> str:
    """Two numbers, or one where both are the same with four digits."""
    ends = list(dict.fromkeys(f"{value:.0f}" if value >= 1e3 else f"{value:.4g}" for value in (first, last)))
    return "–".join(ends)


SHARES = "plasma"  # colours of the disk's share of the strain energy
LISTED_CROSSINGS = 4  # engine orders that the legend names
NAMES = 0.1  # of the width of the diagram, at each end


def nodal_diameter_figure(curve: Modelled, title: str, orders: Collection[int] = ()) -> Figure | None:
    """A line for each mode and contact condition over nodal diameters 0 .. N_b / 2; the excited ones are marked.

    Modes are followed by their shapes, and named with free shrouds at the left end and with stuck ones at the right.
    With a disk the modes of free shrouds have the colour of the disk's share of the strain energy. At a steady speed
    the engine orders make the folded line of the interference diagram. Bars with numbers: resonance crossings in the
    frequency range.
    None for a single blade against ground. The steady speed and the contact stiffness are those of `curve`; `orders`
    are the engine orders of the sweep, without any that of `curve`.
    """
    from rom.cyclic.resonance_crossings import excited_nodal_diameter
    from rom.files.reduced_model_file import read_reduced_model

    model = read_reduced_model(curve.rom, with_basis=False)
    if model.n_blades is None:
        return None
    diameters, families = sorted(model.wave_blocks) or range(model.n_blades // 2 + 1), read_families(curve.rom)
    asked = set(orders) or {curve.scene.excitation.engine_order}
    crossings = numbered_crossings(curve, model, families, asked)
    figure, axes = subplots(size=(7.2, 4.8 + list_height(len(crossings))))
    top = _draw_states(axes, curve.scene, model, diameters, families)
    if families is not None and model.has_disk:
        _draw_shares(axes, model, families, diameters)
    low, high = curve.scene.response.frequency
    axes.axhspan(low, high, color="0.95", zorder=0, label="range of the response")
    excited = sorted({multiple for order in asked for multiple, _ in excited_orders(curve.scene, order)})
    few = ", ".join(map(str, excited))
    numbers = few if len(excited) <= LISTED_CROSSINGS else f"{excited[0]} to {excited[-1]}"
    name = f"excited by engine order{'s' * (len(excited) > 1)} {numbers}"
    for number, diameter in enumerate(sorted({excited_nodal_diameter(order, model.n_blades) for order in excited})):
        axes.axvline(diameter, color="0.6", linewidth=0.8, zorder=0.5, label=name if number == 0 else None)
    labels: list[Annotation] = []
    if curve.scene.load.speed_rpm > 0.0:
        labels = _draw_excited_orders(axes, model.n_blades, curve.scene.load.speed_rpm, excited, top)
    labels = [*draw_crossings(axes, crossings, 1.05 * top), *labels]
    write_heading(axes, title)
    axes.set(xlabel="nodal diameter", ylabel="natural frequency [Hz]")
    axes.set_ylim(0.0, 1.05 * top)
    axes.set_xlim(-NAMES * diameters[-1], (1.0 + NAMES) * diameters[-1])  # names stand beside the lines
    axes.legend(loc="upper left", bbox_to_anchor=(-0.13, -0.12), ncols=3, fontsize=8.5)
    keep_apart(axes, labels)
    return figure


def _draw_states(
    axes: Axes, scene: Scene, model: ReducedModel, diameters: Sequence[int], families: ModeFamilies | None
) -> float:
    """Lines of free, sliding and stuck shrouds with names; returns the highest frequency, Hz."""
    from rom.cyclic.cyclic_symmetry import inter_blade_phase
    from rom.cyclic.mode_following import modes_over_diameters
    from rom.cyclic.resonance_crossings import wave_direction

    found = {}
    sign = -1 if wave_direction(scene.excitation.engine_order, model.n_blades) == "forward" else 1
    phases = [inter_blade_phase(sign * int(diameter), model.n_blades) for diameter in diameters]
    for state, springs in springs_by_state(contact_on_model(scene, model)).items():
        modes = modes_over_diameters(model, diameters, families, count=min(DRAWN, model.size), **springs)
        found[state] = as_in_response(modes, [(scene, model, phase) for phase in phases], springs)
    top = float(found["stuck"].frequency_hz[:, :MODES].max())
    for state, modes in found.items():
        draw_followed(axes, modes, state)
    if families is not None:
        write_names(axes, found["free"], 0, top)
        write_names(axes, found["stuck"], -1, top, color=LOOKS["stuck"]["color"])
    return top


def draw_followed(axes: Axes, modes: FollowedModes, state: str) -> None:
    """A line for each followed mode of one state of the shrouds."""
    for number, (places, hz) in enumerate(modes.curves()):
        axes.plot(places, hz, label=f"{'_' * (number > 0)}shrouds {state}", **LOOKS[state])


def write_names(axes: Axes, modes: FollowedModes, end: int, top: float, color: str = "black") -> None:
    """Names of the modes at the first (0) or last (-1) place, beside the lines in a diagram up to `top`."""
    offset, align = (-4, "right") if end == 0 else (5, "left")
    look: dict[str, Any] = {"xytext": (offset, 0), "ha": align, "va": "center", "fontsize": 8, "color": color}
    shown = int(np.sum(modes.frequency_hz[end] <= top))
    for height, name in apart(modes.frequency_hz[end, :shown], modes.names[end][:shown], top):
        axes.annotate(name, (modes.places[end], height), textcoords="offset points", **look)


def _draw_shares(axes: Axes, model: ReducedModel, families: ModeFamilies, diameters: Sequence[int]) -> None:
    """Modes of free shrouds in the colour of the disk's share of their strain energy."""
    from rom.cyclic.cyclic_symmetry import inter_blade_phase

    modes = [
        families.modes(model, inter_blade_phase(diameter, model.n_blades), count=min(MODES, model.size))
        for diameter in diameters
    ]
    places = np.repeat(diameters, [len(hz) for hz, _, _ in modes])
    values, shares = (np.concatenate([item[k] for item in modes]) for k in (0, 2))
    points = axes.scatter(places, values, c=100.0 * shares, cmap=SHARES, vmin=0.0, vmax=100.0, s=14.0, zorder=3.0)
    bar = axes.figure.colorbar(points, ax=axes)
    bar.set_label("share of the disk in the strain energy, shrouds free [%]")


def _draw_excited_orders(
    axes: Axes, n_blades: int, speed_rpm: float, excited: Sequence[int], top: float
) -> list[Annotation]:
    """The line f = EO n / 60 folded at half the number of blades, and the excited orders on it, whose names are
    returned."""
    from rom.cyclic.resonance_crossings import excited_nodal_diameter

    per_order = speed_rpm / 60.0
    orders = np.arange(int(1.05 * top / per_order) + 2)
    folded = [excited_nodal_diameter(int(order), n_blades) for order in orders]
    name = f"engine orders at {speed_rpm:g} rev/min"
    axes.plot(folded, orders * per_order, color="#009E73", linewidth=1.0, zorder=2.0, label=name)
    shown = [order for order in excited if order * per_order <= 1.05 * top]
    places = [excited_nodal_diameter(order, n_blades) for order in shown]
    heights = [order * per_order for order in shown]
    axes.plot(places, heights, "s", color="#009E73", markersize=5.0, zorder=4.0)
    look: dict[str, Any] = {"textcoords": "offset points", "fontsize": 8, "color": "#00694C", "zorder": 5.0}
    return [
        axes.annotate(f"EO {order}", (place, height), xytext=(5, 4), arrowprops=dict(TO_POINT), **look)
        for order, place, height in zip(shown, places, heights, strict=True)
    ]


RAYS = 7  # approximate number of engine orders drawn


def campbell_figure(curves: Sequence[Modelled], title: str) -> Figure | None:
    """A line for each mode and contact condition at the excited nodal diameter; None with fewer than three speeds.

    Modes are followed by their shapes where those are known. Where other keys are swept too, the blade, contact and
    engine order are those of the first curve.
    """
    chosen = by_speed(curves)
    if len(chosen) < FEWEST:
        return None
    order = curves[0].scene.excitation.engine_order
    found = followed_over_speeds(chosen, order)
    crossings = _crossings(found, order)
    figure, axes = subplots(size=(7.2, 4.8 + list_height(len(crossings))))
    for state, modes in found.items():
        draw_followed(axes, modes, state)
    top, speeds = float(found["stuck"].frequency_hz[:, :MODES].max()), found["stuck"].places
    _draw_engine_orders(axes, float(speeds[-1]), order, top)
    if not found["free"].names[0][0].startswith("mode"):
        write_names(axes, found["free"], 0, top)
    labels = _draw_crossings(axes, crossings, found["free"].names[0])
    low, high = curves[0].scene.response.frequency
    axes.axhspan(low, high, color="0.95", zorder=0, label="range of the response")
    write_heading(axes, title)
    axes.set(xlabel="speed [rev/min]", ylabel=f"natural frequency [Hz], engine order {order}")
    axes.set_xlim(speeds[0] - NAMES * (speeds[-1] - speeds[0]), speeds[-1])
    axes.set_ylim(0.0, 1.05 * top)
    axes.legend(loc="center left", bbox_to_anchor=(1.06, 0.5), fontsize=9)
    keep_apart(axes, labels)
    return figure


def followed_over_speeds(chosen: Mapping[float, Modelled], engine_order: int) -> dict[str, FollowedModes]:
    """The lowest modes of each state of the shrouds over the speeds (rev/min) of some models."""
    from rom.cyclic.cyclic_symmetry import inter_blade_phase
    from rom.cyclic.mode_following import modes_over_speeds
    from rom.files.reduced_model_file import read_reduced_model

    speeds = sorted(chosen)
    models = [read_reduced_model(chosen[speed].rom, with_basis=False) for speed in speeds]
    families = [read_families(chosen[speed].rom) for speed in speeds]
    phase, count = inter_blade_phase(engine_order, models[0].n_blades), min(DRAWN, models[0].size)
    places = [(chosen[speed].scene, model, phase) for speed, model in zip(speeds, models, strict=True)]
    return {
        state: as_in_response(
            modes_over_speeds(models, speeds, families, phase, count=count, **springs), places, springs
        )
        for state, springs in springs_by_state(contact_on_model(chosen[speeds[0]].scene, models[0])).items()
    }


def as_in_response(
    modes: FollowedModes, places: Sequence[tuple[Scene, ReducedModel, float]], springs: Mapping[str, Any]
) -> FollowedModes:
    """Followed modes with Coriolis forces where these act: scene, model and inter-blade phase of each place."""
    found = modes.frequency_hz.copy()
    for row, (scene, model, phase) in zip(found, places, strict=True):
        if coriolis_acts(scene, model):
            row[:] = frequencies_of(scene, model)(model, phase, count=len(row), **springs)
    return replace(modes, frequency_hz=found)


def _crossings(
    found: Mapping[str, FollowedModes], order: int
) -> list[tuple[int, dict[str, list[tuple[float, float]]]]]:
    """Number of each mode that the engine order meets, with speeds and frequencies of the crossings by state."""
    from rom.cyclic.resonance_crossings import speed_crossings

    crossings = []
    for mode in range(min(MODES, found["stuck"].frequency_hz.shape[1])):
        lines = {state: found[state].frequency_hz[:, mode] for state in ("free", "stuck")}
        met = {state: speed_crossings(found[state].places, line, order) for state, line in lines.items()}
        if any(met.values()):
            crossings.append((mode + 1, met))
    return crossings


def _draw_crossings(
    axes: Axes, crossings: Sequence[tuple[int, dict[str, list[tuple[float, float]]]]], names: Sequence[str]
) -> list[Annotation]:
    """A marker at each crossing, the number of the mode's entry in the list below beside it; returns the numbers."""
    texts, labels = [], []
    for number, (mode, met) in enumerate(crossings, start=1):
        name = names[mode - 1]
        parts = [f"{state} {f:.4g} Hz at {n:.0f} rev/min" for state, places in met.items() for n, f in places]
        texts.append(f"{name}: {', '.join(parts)}")
        for speed, frequency in (place for places in met.values() for place in places):
            axes.scatter([speed], [frequency], s=36.0, marker="D", color=COLOUR, edgecolor="0.2", zorder=4.0)
            look: dict[str, Any] = {"xytext": (6, -4), "ha": "left", "va": "top", "fontsize": 8, "zorder": 5.0}
            look["bbox"] = {"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.8}
            look["arrowprops"] = TO_POINT
            labels.append(axes.annotate(str(number), (speed, frequency), textcoords="offset points", **look))
    draw_list(axes, "Resonance crossings of the engine order with free and with stuck shrouds", texts)
    return labels


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
            beside = {"xytext": (4, -3), "va": "top"}
        axes.annotate(f"EO {order}", end, textcoords="offset points", fontsize=8, **beside)

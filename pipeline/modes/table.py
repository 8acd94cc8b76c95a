"""What `shroud modes` and `shroud run --until reduce` print: a table for each wave, static contact, a range."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pipeline.modes.modes_of_scene import STATES, ModelModes, StaticCase, WaveModes

if TYPE_CHECKING:
    from rich.table import Table

ROWS = 6  # modes of a wave that the table shows, or more that are in the frequency range
MOST_MODELS = 8  # reduced models of a sweep that have tables


def wave_heading(model: ModelModes, wave: WaveModes, several: bool) -> str:
    """The model where there are several, engine order, wave, speed."""
    parts = [model.label] if several else []
    if model.n_blades is not None:
        parts.append(
            f"{model.n_blades} blades, EO {wave.engine_order}: nodal diameter {wave.nodal_diameter}, {wave.wave} wave"
        )
    at = f"{model.speed_rpm:g} rev/min"
    parts.append(at if wave.excitation_hz is None else f"{at}: excitation at {wave.excitation_hz:.4g} Hz")
    return ", ".join(parts)


def wave_table(wave: WaveModes) -> Table:
    """One row a mode: frequencies with names for free, sliding and stuck shrouds, speeds of resonance, margin."""
    table = _empty("mode", *(f"{state} [Hz]" for state in STATES), "resonance at [rev/min]", "margin [%]", "in range")
    shown = max([ROWS, *(mode.number for mode in wave.modes if mode.in_range)])
    for mode in wave.modes[:shown]:
        hertz = [f"{hz:.4g} {name}".rstrip() for hz, name in zip(mode.frequency_hz, mode.names, strict=True)]
        speeds = "-" if mode.speeds_rpm is None else " to ".join(f"{speed:.0f}" for speed in mode.speeds_rpm)
        margin = "-" if mode.margin is None else f"{100.0 * mode.margin:+.0f}"
        table.add_row(str(mode.number), *hertz, speeds, margin, "yes" if mode.in_range else "no")
    return table


def static_table(cases: Sequence[StaticCase], speed_rpm: float) -> Table:
    """One row a member of the sweep: static contact, before the excitation acts."""
    title = f"static contact, {speed_rpm:g} rev/min"
    table = _empty(title, "normal force [N]", "open [%]", "v = v0 + d_n [µm]", justify_first="left")
    for case in cases:
        ends = (1e6 * case.lowest_m, 1e6 * case.highest_m)
        ends_said = " to ".join(dict.fromkeys(f"{value:.4g}" for value in ends))
        table.add_row(case.label, f"{case.force_n:.4g}", f"{100.0 * case.open_share:.3g}", ends_said)
    return table


def range_line(model: ModelModes) -> str:
    """The frequency range that is proposed."""
    if model.proposed_hz is None:
        return "response.frequency: the force excites none of these modes"
    proposed, present = (f"[{low:g}, {high:g}]" for low, high in (model.proposed_hz, model.waves[0].range_hz))
    return f"response.frequency = {present}; {proposed} holds its excited modes, or the first one, free to stuck"


def crossing_lines(campbell: Sequence[dict[str, Any]]) -> list[str]:
    """Where the engine order meets modes over the speeds of the sweep."""
    return [
        f"EO {each['engine_order']} meets mode {each['mode']} with {each['contact']} shrouds at "
        f"{each['speed_rpm']:.0f} rev/min, {each['frequency_hz']:.4g} Hz"
        for each in campbell
    ]


def left_out(models: Sequence[ModelModes]) -> str:
    """A line on models without a table; empty where there are none."""
    rest = len(models) - MOST_MODELS
    return f"... {rest} more reduced models, in modes.json" if rest > 0 else ""


def _empty(first: str, *others: str, justify_first: Any = "right") -> Table:
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column(first, justify=justify_first)
    for name in others:
        table.add_column(escape(name), justify="right")
    return table

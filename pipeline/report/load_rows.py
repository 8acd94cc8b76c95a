"""Excitation, static loads and further outputs as rows of the report."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pipeline.scene.labels import prefixed

if TYPE_CHECKING:
    from pipeline.scene.schema import Scene
    from pipeline.stages.respond import CurveResult

Rows = list[tuple[str, str]]


def load_rows(scene: Scene) -> Rows:
    """The excitation with its harmonics and loads, and the static loads beside the speed."""
    wave, load = scene.excitation, scene.load
    rows = [("excitation", f"{wave.force:g} N, engine order {wave.engine_order}")]
    for harmonic in wave.harmonic:
        order = wave.engine_order * harmonic.order
        said = f"{harmonic.amplitude:g} of it, phase {harmonic.phase:g}°"
        rows.append((f"harmonic {harmonic.order} of the excitation, engine order {order}", said))
    rows += [("excitation acts", _excited(item)) for item in wave.load]
    rows += [("static force", f"{item.force:g} N, {_place(item)}") for item in load.force if item.file is None]
    rows += [("static force", f"{item.force:g} times {item.file}") for item in load.force if item.file is not None]
    rows += [("static pressure", f"{item.pressure:g} Pa on {item.surface}") for item in load.pressure]
    if load.temperature is not None:
        field = load.temperature
        found = f"{field.uniform:g}" if field.uniform is not None else str(field.file)
        rows.append(("temperature", f"{found}, free of thermal stress at {field.reference:g}"))
    return rows


def output_rows(curves: Sequence[CurveResult]) -> Rows:
    """The largest value of every further output over all curves, its frequency and its curve."""
    highest: dict[str, tuple[float, float, int, str]] = {}
    for number, curve in enumerate(curves):
        units = {output.name: output.unit for output in curve.member.scene.output}
        for item in curve.facts.outputs if curve.facts is not None else ():
            value, name = item["peak_amplitude"], item["name"]
            if value is not None and value >= highest.get(name, (-1.0, 0.0, 0, ""))[0]:
                highest[name] = value, item["peak_frequency_hz"], number, units.get(name, "m")
    return [(name, _said(*found, many=len(curves) > 1)) for name, found in highest.items()]


def _said(value: float, frequency_hz: float, curve: int, unit: str, *, many: bool) -> str:
    factor, shown = prefixed(value, "m") if unit == "m" else (1e6, "µm/m")
    return f"{value * factor:.4g} {shown} at {frequency_hz:.6g} Hz" + (f", curve {curve}" if many else "")


def _excited(item: Any) -> str:
    parts = [f"{item.amplitude:g} {_unit(item)} per N, {_place(item)}"]
    parts += [f"phase {item.phase:g}°"] * bool(item.phase) + [f"harmonic {item.harmonic}"] * (item.harmonic > 1)
    return ", ".join(parts)


def _unit(item: Any) -> str:
    return "Pa" if item.surface is not None else "N/√kg" if item.mode is not None else "N"


def _place(item: Any) -> str:
    if getattr(item, "mode", None) is not None:
        return f"mode {item.mode}"
    if getattr(item, "surface", None) is not None:
        return f"on {item.surface}"
    if item.file is not None:
        return str(item.file)
    if item.set is not None:
        return f"on {item.set}" + (" (each node)" if item.share == "each" else "")
    return "at the tip" if item.at == "tip" else f"at {list(item.at)} m"

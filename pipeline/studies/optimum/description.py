"""The optimum in words: its message, and the lines and cells of its table."""

from __future__ import annotations

import math

from pipeline.results.worst import END_MARK, truncation_mark
from pipeline.scene.labels import prefixed, quantity
from pipeline.scene.optimum_section import OBJECTIVES
from pipeline.scene.units import key_unit
from pipeline.studies.optimum.optimum_result import OptimumResult, Trial

KINDS = {
    "smooth": "smooth minimum",
    "kink": "kink: two peaks exchange",
    "jump": "beside a jump of the worst motion: keep a distance",
    "sampled": "lowest of single curves",
    "edge": "lowest at an end of a range",
    "flat": "the worst motion changes by less than 0.1 % over the range",
}


def message_of(result: OptimumResult) -> str:
    """One line that says what was found."""
    values = ", ".join(f"{key} = {shown(key, value)}" for key, value in result.values.items())
    if result.kind == "flat":
        return f"{', '.join(result.values)}: {KINDS['flat']}, {_motion(result)}"
    first = "harmonic 1 of " if result.objective == "harmonic_1" else ""
    return f"{values}: {KINDS[result.kind]}, {first}{_motion(result)}{_gain(result)}"


def shown(key: str, value: float) -> str:
    """A value of a key with six digits and its unit."""
    return quantity(key).value(value)


def result_lines(result: OptimumResult) -> list[str]:
    """The table of the optimum for a terminal, and what was left open."""
    rows = table_rows(result)
    width = max(len(name) for name, _ in rows)
    lines = [f"optimum: {result.message}", *(f"  {name:<{width}}  {text}" for name, text in rows)]
    return [*lines, *(f"note: {remark}" for remark in result.remarks)]


def table_rows(result: OptimumResult) -> list[tuple[str, str]]:
    """Names and values of what was found."""
    rows = []
    for key, value in result.values.items():
        low, high = result.ranges[key]
        rows.append((key, f"{shown(key, value)} (range {shown(key, low)} to {shown(key, high)})"))
    rows.append((f"worst motion, {OBJECTIVES[result.objective]}", f"{_motion(result)}, {result.motion}"))
    rows.append(("kind", KINDS[result.kind]))
    if math.isfinite(result.curvature):
        (key,) = result.within
        rows.append(("curvature", f"{result.curvature:.4g} m{_per(key, 2)}"))
    for key, (low, high) in result.within.items():
        rows.append((f"at most 10 % higher, {key}", f"{shown(key, low)} to {shown(key, high)}"))
    for key, slope in result.derivatives.items():
        rows.append((f"derivative, {key}", f"{slope:.4g} m{_per(key)}"))
    rows.append(("scene's own value", _base(result.base)))
    if math.isfinite(result.gain):
        rows.append(("own value over optimum", f"{result.gain:.3g}"))
    rows.append(("cost", f"{result.responses} responses, {result.seconds:.1f} s"))
    return rows


def _per(key: str, power: int = 1) -> str:
    """The rest of the unit of a derivative by a key: "", "/N" or "/(N/m)^2"."""
    unit = key_unit(key)
    if not unit:
        return ""
    bare = f"({unit})" if "/" in unit else unit
    return f"/{bare}" + (f"^{power}" if power > 1 else "")


def _motion(result: OptimumResult | Trial) -> str:
    """Amplitude and frequency with units."""
    factor, unit = prefixed(result.amplitude_m, "m")
    at_end = END_MARK if isinstance(result, Trial) and result.at_end else ""
    mark = at_end + truncation_mark(result.truncation_error)
    return f"{result.amplitude_m * factor:.4g} {unit} at {result.frequency_hz:.6g} Hz{mark}"


def _base(base: Trial) -> str:
    values = ", ".join(f"{key} = {shown(key, value)}" for key, value in base.values.items())
    return f"{values}: {_motion(base) if math.isfinite(base.amplitude_m) else base.reason}"


def _gain(result: OptimumResult) -> str:
    """How the worst motion of the scene's own values compares."""
    if not math.isfinite(result.gain):
        return ""
    factor, unit = prefixed(result.base.amplitude_m, "m")
    return f" (scene: {result.base.amplitude_m * factor:.4g} {unit}, {result.gain:.3g} times)"

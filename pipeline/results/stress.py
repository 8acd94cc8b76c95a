"""The stress on the mesh in words: lines for a terminal and rows of the report, from the entries of summary.json."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from pipeline.scene.labels import prefixed

ELSEWHERE = 1.001  # ratio of the largest amplitude to that of hot spot 1 above which it is named
SPOT_HEADINGS = (
    "place",
    "x, y, z [mm]",
    "amplitude [MPa]",
    "mean [MPa]",
    "between elements [MPa]",
    "margin",
    "at fixed mean",
)


def stress_lines(entries: Sequence[Mapping[str, Any]], unstable: Collection[int]) -> list[str]:
    """Lines for each curve with stress: hot spot, errors, notes; `unstable`: curves whose motion is unstable."""
    return [
        f"curve {entry['curve']}: {said}"
        for entry in entries
        for said in (
            headline(entry, entry["curve"] in unstable),
            f"{errors_said(entry)}; {entry['file']}",
            *entry["notes"],
        )
    ]


def stress_warning(entries: Sequence[Mapping[str, Any]]) -> str:
    """A line on the curves with a margin below the required one; "" where there are none."""
    low = [entry for entry in entries if _short(entry)]
    if not low:
        return ""
    worst = min(low, key=lambda entry: entry["least_margin"])
    curves = ", ".join(str(entry["curve"]) for entry in low)
    return (
        f"fatigue margin {worst['least_margin']:.3g} below the required {worst['required_margin']:g} "
        f"(curve{'s' * (len(low) > 1)} {curves}), outside of singular places"
    )


def _short(entry: Mapping[str, Any]) -> bool:
    margin, required = entry["least_margin"], entry["required_margin"]
    return margin is not None and required is not None and margin < required


def headline(entry: Mapping[str, Any], unstable: bool) -> str:
    """Place, amplitude, mean and margin of the first hot spot, and the largest amplitude where that is elsewhere;
    outside of singular places, marked where no motion has them.
    """
    mark = "no motion persists, " if entry["motion"] == "peak" else "the blades leave this motion, " * unstable
    at, largest = f"{mark}stress at {entry['frequency_hz']:.6g} Hz", entry["largest_amplitude_pa"]
    if not entry["hot_spots"]:
        return f"{at}, outside of singular places: largest amplitude {with_prefix(largest)}"
    spot = entry["hot_spots"][0]
    said = f"amplitude {with_prefix(spot['amplitude_pa'])}, mean {with_prefix(spot['mean_pa'])}"
    if spot["margin"] is not None:
        said += f", margin {spot['margin']:.3g}, the least"
    if largest > spot["amplitude_pa"] * ELSEWHERE:
        said += f"; largest amplitude {with_prefix(largest)}, elsewhere"
    position = ", ".join(f"{1e3 * x:.1f}" for x in spot["position_m"])
    return f"{at}, hot spot 1 at x, y, z = {position} mm: {said}"


def errors_said(entry: Mapping[str, Any]) -> str:
    """The error figures of the amplitude."""
    said = f"errors: modes left out {100 * entry['expansion_error']:.2g} % (corrected)"
    if entry["model_error"] is not None:
        said += f", reduced against full model {100 * entry['model_error']:.2g} %"
    spots = entry["hot_spots"]
    if spots and spots[0]["amplitude_pa"]:
        spread = 100 * spots[0]["spread_pa"] / spots[0]["amplitude_pa"]
        said += f", between elements at hot spot 1 {f'{spread:.2g}' if spread < 99.5 else f'{spread:.0f}'} %"
    return said


def spot_rows(spots: Sequence[Mapping[str, Any]]) -> list[tuple[str, ...]]:
    """Cells of the table of hot spots, under `SPOT_HEADINGS`."""
    return [(_place(number, spot), *_cells(spot)) for number, spot in enumerate(spots, start=1)]


def _place(number: int, spot: Mapping[str, Any]) -> str:
    of = f", {spot['material']}" if spot["material"] else ""
    return f"{spot['singular'] or number}{of}"


def _cells(spot: Mapping[str, Any]) -> tuple[str, ...]:
    position = ", ".join(f"{1e3 * x:.1f}" for x in spot["position_m"])
    stresses = (f"{spot[name] / 1e6:.4g}" for name in ("amplitude_pa", "mean_pa", "spread_pa"))
    margins = ("-" if spot[name] is None else f"{spot[name]:.3g}" for name in ("margin", "amplitude_margin"))
    return (position, *stresses, *margins)


def with_prefix(stress_pa: float) -> str:
    """A stress with four digits and its unit."""
    factor, unit = prefixed(abs(stress_pa), "Pa")
    return f"{stress_pa * factor:.4g} {unit}"

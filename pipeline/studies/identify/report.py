"""The section of the page about identified keys."""

from __future__ import annotations

from collections.abc import Iterator

from pipeline.results.worst import sentence, with_unit
from pipeline.scene.labels import quantity
from pipeline.studies.identify.posterior import misfit_said, rounded
from pipeline.studies.identify.result import Compared, Identification
from pipeline.studies.registry import StudySection

HEADINGS = ("", "value", "from (95 %)", "to (95 %)", "told by the data")
MOST_ROWS = 40
CAPTION = (
    "Left: measured motions with 95 % of their scatter, and the response of the model with the best values; crosses, "
    "peaks of sweeps. Right: what the data say of each pair of keys."
)


def identify_section(result: Identification) -> StudySection:
    """The values with their intervals, then each measured motion beside its computed one."""
    verdict = "the model fits the data" if result.fits else "the model does not fit the data"
    head = f"{verdict}: {misfit_said(result.misfit, result.degrees)}"
    said = (sentence(head), *(sentence(line) for line in (*result.untold, *result.remarks)))
    rows = [
        (
            quantity(item.key).symbol,
            *(rounded(item.key, value) for value in (item.value, item.low, item.high)),
            f"{100.0 * item.told:.0f} %" + (f", at the {item.end} end" if item.end else ""),
        )
        for item in result.keys
    ]
    rows.append(("measured", "Hz", "computed", "amplitude", "computed"))
    rows += list(_compared(result))
    return StudySection("Identified from measurements", said, CAPTION, HEADINGS, tuple(rows))


def _compared(result: Identification) -> Iterator[tuple[str, ...]]:
    for item in result.compared[:MOST_ROWS]:
        yield (
            _name(item),
            f"{item.frequency_hz:.6g}",
            f"{item.computed_hz:.6g}",
            with_unit(item.amplitude, item.unit),
            with_unit(item.computed_amplitude, item.unit),
        )
    if len(result.compared) > MOST_ROWS:
        yield (f"and {len(result.compared) - MOST_ROWS} more", "", "", "", "")


def _name(item: Compared) -> str:
    parts = [item.label, item.output, f"curve {item.curve}" if item.curve else ""]
    parts.append(f"{item.rate_hz_per_s:+.4g} Hz/s" if item.rate_hz_per_s else "")
    return ", ".join(part for part in parts if part)

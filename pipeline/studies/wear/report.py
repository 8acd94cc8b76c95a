"""The section of the page about wear."""

from __future__ import annotations

from pipeline.results.worst import sentence, with_unit
from pipeline.studies.registry import StudySection
from pipeline.studies.wear.result import WearResult, WornResponse
from pipeline.studies.wear.study import headline, told

HEADINGS = ("after [h]", "followed motion", "worst motion", "at [Hz]", "motion", "least margin")
CAPTION = (
    "Life of the contact faces: amplitude of the followed motions, with the worst motion of whole responses as dots; "
    "normal load and power of friction; interference left, from the least to the most worn node; worn depth over the "
    "face at the end, of both faces together. Vertical lines are events."
)


def wear_section(result: WearResult) -> StudySection:
    """How the motion changes as the faces wear, events, and the whole responses in a table."""
    said = (headline(result), *told(result), *result.remarks)
    coefficients = ", ".join(f"{name} {value:.3g} m³/J" for name, value in result.coefficient.items())
    rows = tuple(_row(each) for each in result.responses)
    return StudySection(
        "Wear", (*(sentence(line) for line in said), f"Wear coefficient: {coefficients}."), CAPTION, HEADINGS, rows
    )


def _row(each: WornResponse) -> tuple[str, ...]:
    known = each.worst_m == each.worst_m
    worst = (with_unit(each.worst_m), f"{each.worst_hz:.5g}", each.motion) if known else ("-", "-", each.remark)
    margin = f"{each.margin:.3g}" if each.margin == each.margin else "-"
    return f"{each.hours:.5g}", with_unit(each.followed_m), *worst, margin

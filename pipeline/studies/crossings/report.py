"""The section of the page about the resonance crossings."""

from __future__ import annotations

from pipeline.results.worst import sentence
from pipeline.studies.crossings.result import CrossingsResult
from pipeline.studies.crossings.table import headline, remarks, signature, table_cells
from pipeline.studies.registry import StudySection

CAPTION = (
    "Campbell diagram: engine orders, modes from free to stuck contacts, and the crossings by their numbers in the "
    "table, coloured by the worst motion; open circles have a mark in the table. Grey: speeds of the machine."
)


def crossings_section(result: CrossingsResult) -> StudySection:
    """The table, what qualifies it, and the line to sign."""
    headings, rows = table_cells(result)
    said = (sentence(headline(result)), *(sentence(line) for line in remarks(result)), signature(result))
    return StudySection(
        "Resonance crossings", said, CAPTION, tuple(headings) if rows else (), tuple(tuple(row) for row in rows)
    )

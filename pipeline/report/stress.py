"""Section of the page about the stress on the mesh: picture, hot spots and errors of each curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from pipeline.report.pictures import inline_render
from pipeline.report.report_source import ReportSource
from pipeline.results.publishing import Attempts
from pipeline.results.stress import errors_said, headline, spot_rows
from pipeline.scene.labels import member_label


@dataclass(frozen=True)
class StressDetail:
    """The stress of one curve: texts, picture as a data URI, tables of hot spots with their captions."""

    label: str
    headline: str
    errors: str
    file: str
    uri: str | None
    margin: bool
    tables: tuple[tuple[str, list[tuple[str, ...]]], ...]
    notes: tuple[str, ...]


def stress_details(source: ReportSource, attempts: Attempts) -> list[StressDetail]:
    """What the page shows of each curve whose stress was computed."""
    return [_detail(source, entry, attempts) for entry in source.stress]


def _detail(source: ReportSource, entry: dict[str, Any], attempts: Attempts) -> StressDetail:
    number: int = entry["curve"]
    picture = next((source.pictures[name] for name in entry["pictures"] if name in source.pictures), None)
    drawn = None if picture is None else attempts.result(f"stress of curve {number}", partial(inline_render, picture))
    return StressDetail(
        label=member_label(source.curves[number].member),
        headline=headline(entry),
        errors=errors_said(entry),
        file=entry["file"],
        uri=drawn,
        margin=entry["required_margin"] is not None,
        tables=tuple(_tables(entry)),
        notes=tuple(entry["notes"]),
    )


def _tables(entry: dict[str, Any]) -> Sequence[tuple[str, list[tuple[str, ...]]]]:
    """Hot spots, and the largest values at singular places."""
    captions = (
        ("hot_spots", "Hot spots"),
        ("singular_spots", "Singular places: these numbers grow without limit, or nearly so, as the mesh is refined"),
    )
    return [(caption, spot_rows(entry[name])) for name, caption in captions if entry[name]]

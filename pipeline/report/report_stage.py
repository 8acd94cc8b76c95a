"""The stage `report`: one page about a run, report.html in the output folder."""

from __future__ import annotations

from pathlib import Path

from pipeline.report.published_page import PAGE
from pipeline.report.report_source import ReportSource, report_source
from pipeline.results.publishing import Attempts, published
from pipeline.stages.model.sweep_models import Models
from pipeline.stages.request import Run, RunOutcome


def report_stage(run: Run, models: Models, outcome: RunOutcome) -> Path:
    """The page of the run; it is written where it is missing."""
    source = report_source(run, models, outcome)
    files = published(
        run, "report", source.key(), "writing the report", lambda into: _write(into / PAGE, source), run.request.out
    )
    return files[0]


def _write(path: Path, source: ReportSource) -> list[str]:
    """Write the page; returns one line for each picture that it lacks."""
    from pipeline.report.page import page

    attempts = Attempts(path.parent)
    path.write_text(page(source, attempts), encoding="utf-8")
    return attempts.problems

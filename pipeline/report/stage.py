"""The stage report: one page about a run, kept in the store, put into the output folder as report.html."""

from __future__ import annotations

from pathlib import Path

from pipeline.report.published_page import PAGE
from pipeline.report.source import ReportSource, report_source
from pipeline.stages.request import Run, RunOutcome
from pipeline.stages.sweep_models import Models
from pipeline.store.publishing import publish


def report_stage(run: Run, models: Models, outcome: RunOutcome) -> Path:
    """Make the page if it is missing; returns the file in the output folder."""
    source = report_source(run, models, outcome)
    entry = run.store.find("report", key := source.key())
    if entry is None:
        with run.reporter.working("writing the report"):
            entry = run.store.get("report", key, lambda folder: _write(folder / PAGE, source))
    run.log.note("report", entry.ran, entry.seconds)
    return publish(run.store, entry.folder, run.request.out)[0]


def _write(path: Path, source: ReportSource) -> None:
    from pipeline.report.page import page

    path.write_text(page(source), encoding="utf-8")

"""Sections of the page about the studies: each module is imported where its study is there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from pipeline.report.pictures import inline_figure
from pipeline.report.report_source import ReportSource
from pipeline.results.publishing import Attempts
from pipeline.stages.request import StudyOutcome
from pipeline.studies.registry import StudySection, figure_file, section_of


@dataclass(frozen=True)
class ShownStudy:
    """A study on the page: its name, which is its place, its section, its figure as a data URI."""

    name: str
    section: StudySection
    uri: str | None


def study_sections(source: ReportSource, attempts: Attempts) -> list[ShownStudy]:
    """Sections of all studies of the run, in the order of the scene."""
    shown = []
    for name, study in source.studies.items():
        section = attempts.result(name, partial(_section, study))
        if section is not None:
            shown.append(ShownStudy(name, section, _figure(source, name, attempts)))
    return shown


def _section(study: StudyOutcome) -> StudySection:
    return section_of(study.name)(study.result)


def _figure(source: ReportSource, study: str, attempts: Attempts) -> str | None:
    """The figure of a study as a data URI."""
    svg, png = (source.pictures.get(f"figures/{figure_file(study)}.{suffix}") for suffix in ("svg", "png"))
    return None if svg is None else attempts.result(f"figure {study}", partial(inline_figure, svg, png))

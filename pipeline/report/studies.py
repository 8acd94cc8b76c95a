"""Sections of the page about the studies: each module is imported where its study is there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from pipeline.figures.figure_stage import figure_file
from pipeline.report.pictures import inline_figure
from pipeline.report.report_source import ReportSource
from pipeline.results.publishing import Attempts


@dataclass(frozen=True)
class StudySection:
    """What the page says of a study."""

    heading: str  # heading of the section
    conclusion: tuple[str, ...]  # one or two sentences, each a paragraph
    caption: str = ""  # what its figure shows
    headings: tuple[str, ...] = ()  # headings of the columns of its table; none: no table
    rows: tuple[tuple[str, ...], ...] = ()  # cells of the table; the first column is text


@dataclass(frozen=True)
class ShownStudy:
    """A study on the page: its name, which is its place, its section, its figure as a data URI."""

    name: str
    section: StudySection
    uri: str | None


def section_of(study: str) -> Callable[[Any], StudySection] | None:
    """The function that makes the section of a study from its result; None where a study has none."""
    if study == "backbone":
        from pipeline.report.backbone import backbone_section

        return backbone_section
    if study == "optimum":
        from pipeline.report.optimum import optimum_section

        return optimum_section
    if study == "map":
        from pipeline.report.map_section import map_section

        return map_section
    if study == "uncertainty":
        from pipeline.report.uncertainty import uncertainty_section

        return uncertainty_section
    if study == "mistuning":
        from pipeline.report.mistuning import mistuning_section

        return mistuning_section
    return None


def study_sections(source: ReportSource, attempts: Attempts) -> list[ShownStudy]:
    """Sections of all studies of the run, in the order of the scene."""
    shown = []
    for name, study in source.studies.items():
        make = section_of(name)
        section = None if make is None else attempts.result(name, partial(make, study.result))
        if section is not None:
            shown.append(ShownStudy(name, section, _figure(source, name, attempts)))
    return shown


def _figure(source: ReportSource, study: str, attempts: Attempts) -> str | None:
    """The figure of a study as a data URI."""
    svg, png = (source.pictures.get(f"figures/{figure_file(study)}.{suffix}") for suffix in ("svg", "png"))
    return None if svg is None else attempts.result(f"figure {study}", partial(inline_figure, svg, png))

"""The studies by name: what the files of a folder, pipeline/studies/NAME, give to the program.

A study is registered by its section of the scene, a field of `Scene` whose class is a `StudyKeys`. Its files are
imported where they are asked for, each at the level of the program that it belongs to:

section.py  the class of its section
checks.py   unfit_NAME_keys(file, given_model): errors of the section beyond the schema
study.py    NameStudy: the computation, a `Study`
figure.py   NAME_figure(result, title): its figure
report.py   NAME_section(result): its `StudySection` of the page
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pipeline.studies.study import Study

# names of figures that are not those of their studies: figures/map is of a sweep, figures/flutter of linear waves
FIGURES = {"flutter": "limit_cycles", "map": "response_map"}


@dataclass(frozen=True)
class StudySection:
    """What the page says of a study."""

    heading: str  # heading of the section
    conclusion: tuple[str, ...]  # one or two sentences, each a paragraph
    caption: str = ""  # what its figure shows
    headings: tuple[str, ...] = ()  # headings of the columns of its table; none: no table
    rows: tuple[tuple[str, ...], ...] = ()  # cells of the table; the first column is text


def module_of(name: str, part: str) -> str:
    """Name of a file of a study as a module."""
    return f"pipeline.studies.{name}.{part}"


def study_named(name: str) -> Study:
    """The computation of a study."""
    study: Study = getattr(import_module(module_of(name, "study")), f"{name.title().replace('_', '')}Study")()
    return study


def figure_of(name: str) -> Callable[[Any, str], Figure | None]:
    """The function that draws the result of a study under a title."""
    draw: Callable[[Any, str], Figure | None] = getattr(import_module(module_of(name, "figure")), f"{name}_figure")
    return draw


def figure_file(name: str) -> str:
    """Name of the figure of a study in `figures/`, without its suffix."""
    return FIGURES.get(name, name)


def section_of(name: str) -> Callable[[Any], StudySection]:
    """The function that makes the section of the page from the result of a study."""
    make: Callable[[Any], StudySection] = getattr(import_module(module_of(name, "report")), f"{name}_section")
    return make

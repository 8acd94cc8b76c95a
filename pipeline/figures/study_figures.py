"""Figures of the studies, in `figures/` of the output folder: each module is imported where its study is there."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.results.publishing import Attempts, PicturesMissing, published, remove_outdated
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.stage_names import Stage
from pipeline.store.fingerprints import fingerprint

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pipeline.stages.request import Run, StudyOutcome

StudyFigure = Callable[[Any, str], "Figure | None"]
FILES = {"map": "response_map"}  # names of figures that are not those of their studies: figures/map is of a sweep


def figure_of(study: str) -> StudyFigure | None:
    """The function that draws the result of a study under a title; None where a study has no figure."""
    if study == "backbone":
        from pipeline.figures.backbone_figure import backbone_figure

        return backbone_figure
    if study == "optimum":
        from pipeline.figures.optimum_figure import optimum_figure

        return optimum_figure
    if study == "map":
        from pipeline.figures.map_figure import map_figure

        return map_figure
    if study == "uncertainty":
        from pipeline.figures.uncertainty_figure import uncertainty_figure

        return uncertainty_figure
    if study == "mistuning":
        from pipeline.figures.mistuning_figure import mistuning_figure

        return mistuning_figure
    return None


def figure_file(study: str) -> str:
    """Name of the figure of a study in `figures/`, without its suffix."""
    return FILES.get(study, study)


def study_figures(run: Run, studies: Mapping[str, StudyOutcome], title: str, formats: Sequence[str]) -> list[Path]:
    """The figures of these studies in the output folder; those that are missing are drawn."""
    folder = run.request.out / "figures"
    attempts, files = Attempts(folder), []
    for name, study in studies.items():
        draw = figure_of(name)
        if draw is not None:
            files += attempts.result(figure_file(name), partial(_published, run, study, draw, title, formats)) or []
    remove_outdated(folder, [f"{figure_file(name)}.*" for name in studies], files)
    if attempts.problems:
        raise PicturesMissing(files, attempts.problems)
    return files


def _published(run: Run, study: StudyOutcome, draw: StudyFigure, title: str, formats: Sequence[str]) -> list[Path]:
    """The files of one figure, drawn where they are missing."""

    def build(folder: Path) -> None:
        from pipeline.figures.style import save, styled

        with styled():
            figure = draw(study.result, title)
            if figure is not None:
                save(figure, folder, figure_file(study.name), formats)

    inputs = {"study": study.key, "title": title, "formats": list(formats), "code": code_fingerprint(draw.__module__)}
    doing = f"drawing the figure of the study {study.name}"
    return published(run, Stage.FIGURES, fingerprint(inputs), doing, build, run.request.out / "figures")

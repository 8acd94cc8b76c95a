"""The stage `figures`: every figure that curves and studies of a run allow, in `figures/` of the output folder.

The module of a figure is imported where the figure is drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.process.workers import Call, kept_count, workers
from pipeline.results.publishing import Attempts, PicturesMissing, published, remove_outdated
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.stage import Stage
from pipeline.store.fingerprints import fingerprint
from pipeline.studies.registry import figure_file, figure_of, module_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pipeline.figures.linear_limits import Limit
    from pipeline.stages.curve.respond import CurveResult
    from pipeline.stages.request import Run, StudyOutcome
    from pipeline.studies.backbone.result import BackboneResult

NAMES = ("response", "peaks", "hysteresis", "map", "hysteresis_sweep", "nodal_diameters", "campbell", "outputs")
MAIN = NAMES[:2]  # those of a run that was stopped
_SHARED = NAMES[:3], NAMES[3:]  # between two processes, about the same work for each
MOST_LIMITS = 24  # of a kind, in one figure


def study_figures(run: Run, studies: Mapping[str, StudyOutcome], title: str, formats: Sequence[str]) -> list[Path]:
    """The figures of these studies in the output folder; those that are missing are drawn."""
    folder = run.request.out / "figures"
    attempts, files = Attempts(folder), []
    for name, study in studies.items():
        files += attempts.result(figure_file(name), partial(_published, run, study, title, formats)) or []
    remove_outdated(folder, [f"{figure_file(name)}.*" for name in studies], files)
    if attempts.problems:
        raise PicturesMissing(files, attempts.problems)
    return files


def _published(run: Run, study: StudyOutcome, title: str, formats: Sequence[str]) -> list[Path]:
    """The files of one figure, drawn where they are missing."""

    def build(folder: Path) -> None:
        from pipeline.figures.style import save, styled

        with styled():
            figure = figure_of(study.name)(study.result, title)
            if figure is not None:
                save(figure, folder, figure_file(study.name), formats)

    code = code_fingerprint(module_of(study.name, "figure"))
    inputs = {"study": study.key, "title": title, "formats": list(formats), "code": code}
    doing = f"drawing the figure of the study {study.name}"
    return published(run, Stage.FIGURES, fingerprint(inputs), doing, build, run.request.out / "figures")


def figure_stage(
    run: Run, curves: Sequence[CurveResult], studies: Mapping[str, StudyOutcome], names: Sequence[str] = NAMES
) -> list[Path]:
    """The figures of the run, those `names` of its curves and those of its studies; missing ones are drawn."""
    title, formats = _title(run), _formats(run)
    attempts = Attempts(run.request.out / "figures")
    drawn = attempts.result("studies", partial(study_figures, run, studies, title, formats)) if studies else []
    try:
        files = _curve_figures(run, curves, (title, formats, studies.get("backbone")), names)
    except PicturesMissing as missing:
        attempts.problems.extend(missing.problems)
        files = missing.files
    if attempts.problems:
        raise PicturesMissing([*files, *(drawn or [])], attempts.problems)
    return [*files, *(drawn or [])]


def _curve_figures(
    run: Run,
    curves: Sequence[CurveResult],
    look: tuple[str, Sequence[str], StudyOutcome | None],
    names: Sequence[str],
) -> list[Path]:
    """The figures of the curves; the nonlinear modes are drawn into one of them. `look`: see `_draw_all`."""
    title, formats, backbone = look
    content = {
        "backbone": None if backbone is None else backbone.key,
        "title": title,
        "formats": formats,
        **({} if names == NAMES else {"names": names}),
        "curves": [[c.file.parent.name if c.file else None, c.reason, dict(c.member.parameters)] for c in curves],
        "code": code_fingerprint(__name__),
    }
    folder = run.request.out / "figures"
    key, patterns = fingerprint(content), [f"{name}.*" for name in NAMES]
    try:
        drawn = title, formats, None if backbone is None else backbone.result
        build = partial(_draw_all, run, curves, drawn, names)
        files = published(run, "figures", key, "drawing figures", build, folder)
    except PicturesMissing as missing:
        remove_outdated(folder, patterns, missing.files)
        raise
    remove_outdated(folder, patterns, files)
    return files


def _draw_all(
    run: Run,
    curves: Sequence[CurveResult],
    look: tuple[str, Sequence[str], BackboneResult | None],
    names: Sequence[str],
    folder: Path,
) -> list[str]:
    """Draw all figures, in the processes that have solved the curves, where there are any.

    `look`: title, formats, nonlinear modes.
    """
    title, formats, backbone = look
    if kept_count() < 2 or names != NAMES:
        return draw(folder, curves, title, formats, names, run.request.out, backbone)
    calls = {part: Call(draw, (folder, curves, title, formats, part, run.request.out, backbone)) for part in _SHARED}
    with workers(len(calls), run.reporter.interrupts.check) as pool, run.reporter.interrupts.looking():
        drawn = {part: future.result() for part, future in pool.completed(calls)}
    return [problem for part in _SHARED for problem in drawn[part]]


def draw(
    folder: Path,
    curves: Sequence[CurveResult],
    title: str,
    formats: Sequence[str],
    names: Sequence[str] = NAMES,
    out: Path | None = None,
    backbone: BackboneResult | None = None,
) -> list[str]:
    """Draw every one of the figures `names` that the curves allow; returns one line for each that failed.

    `out` is the folder that an error of the disk names; `backbone` are nonlinear modes drawn into the response.
    """
    from pipeline.figures.campbell import campbell_figure, nodal_diameter_figure
    from pipeline.figures.data import plotted_curves, sweep_points
    from pipeline.figures.hysteresis import most_damped, node_figure, sweep_figure
    from pipeline.figures.linear_limits import count_limits, linear_limits
    from pipeline.figures.peaks import band_figure, curves_to_read, has_few_lines, quantile_figure, trend_figure
    from pipeline.figures.response import has_lines, outputs_figure, response_figure
    from pipeline.figures.style import save, styled
    from pipeline.figures.sweep_map import sweep_map_figure
    from rom import one_blas_thread

    points = sweep_points(curves)
    if not points:
        return []
    lines, few = has_lines(points), has_few_lines(points)
    shown = plotted_curves(curves, None if lines else curves_to_read(points))
    attempts = Attempts(folder, out)
    limits: list[Limit] = []
    damped = most_damped(shown)
    orders = {curve.scene.excitation.engine_order for curve in shown}
    figures: dict[str, Callable[[], Figure | None]] = {
        "response": lambda: (
            response_figure(shown, limits, title, backbone) if lines else band_figure(shown, points, title)
        ),
        "peaks": lambda: trend_figure(points, limits, title) if few else quantile_figure(points, title),
        "hysteresis": lambda: None if damped is None else node_figure(damped, title),
        "map": lambda: sweep_map_figure(curves, points, title),
        "hysteresis_sweep": lambda: sweep_figure(shown, title),
        "nodal_diameters": lambda: nodal_diameter_figure(shown[0], title, orders),
        "campbell": lambda: campbell_figure(shown, title),
        "outputs": lambda: outputs_figure(shown, title),
    }

    def draw_one(name: str) -> None:
        figure = figures[name]()
        if figure is not None:
            save(figure, folder, name, formats)

    with one_blas_thread(), styled():  # the same bits in this process as in a worker
        if {"response", "peaks"} & set(names) and count_limits(shown) <= MOST_LIMITS:
            limits = attempts.result("linear limits", lambda: linear_limits(shown)) or []
        for name in names:
            attempts.result(name, partial(draw_one, name))
    return attempts.problems


def _formats(run: Run) -> list[str]:
    """Formats of the figures: those of the scene, and SVG for the report."""
    asked = set(run.request.scene.first.figures.formats)
    return sorted(asked | {"svg"} if Stage.REPORT in run.request.wanted else asked)


def _title(run: Run) -> str:
    first = run.request.scene.first
    return first.title or first.name

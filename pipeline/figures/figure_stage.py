"""The stage `figures`: every figure that the curves of a run allow, in `figures/` of the output folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.process.workers import Call, kept_count, workers
from pipeline.results.publishing import Attempts, PicturesMissing, published, remove_outdated
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.stage_names import Stage
from pipeline.store.fingerprints import fingerprint

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pipeline.figures.linear_limits import Limit
    from pipeline.stages.request import Run
    from pipeline.stages.respond import CurveResult

NAMES = ("response", "peaks", "hysteresis", "hysteresis_sweep", "nodal_diameters", "campbell")
_SHARED = NAMES[:3], NAMES[3:]  # between two processes, about the same work for each


def figure_stage(run: Run, curves: Sequence[CurveResult]) -> list[Path]:
    """The figures of the run; those that are missing are drawn."""
    title, formats = _title(run), _formats(run)
    content = {
        "title": title,
        "formats": formats,
        "curves": [[c.file.parent.name if c.file else None, c.reason, dict(c.member.parameters)] for c in curves],
        "code": code_fingerprint(__name__),
    }
    folder = run.request.out / "figures"
    key, patterns = fingerprint(content), [f"{name}.*" for name in NAMES]
    try:
        files = published(
            run, "figures", key, "drawing figures", partial(_draw_all, run, curves, title, formats), folder
        )
    except PicturesMissing as missing:
        remove_outdated(folder, patterns, missing.files)
        raise
    remove_outdated(folder, patterns, files)
    return files


def _draw_all(run: Run, curves: Sequence[CurveResult], title: str, formats: Sequence[str], folder: Path) -> list[str]:
    """Draw all figures, in the processes that have solved the curves, where there are any."""
    if kept_count() < 2:
        return draw(folder, curves, title, formats)
    calls = {names: Call(draw, (folder, curves, title, formats, names)) for names in _SHARED}
    with workers(len(calls), run.reporter.interrupts.check) as pool, run.reporter.interrupts.looking():
        drawn = {names: future.result() for names, future in pool.completed(calls)}
    return [problem for names in _SHARED for problem in drawn[names]]


def draw(
    folder: Path, curves: Sequence[CurveResult], title: str, formats: Sequence[str], names: Sequence[str] = NAMES
) -> list[str]:
    """Draw every one of the figures `names` that the curves allow; returns one line for each that failed."""
    from pipeline.figures.campbell import campbell_figure
    from pipeline.figures.data import plotted_curves
    from pipeline.figures.hysteresis import most_damped, node_figure, sweep_figure
    from pipeline.figures.linear_limits import linear_limits
    from pipeline.figures.nodal_diameters import nodal_diameter_figure
    from pipeline.figures.response import response_figure
    from pipeline.figures.style import save, styled
    from pipeline.figures.trend import trend_figure

    shown = plotted_curves(curves)
    if not shown:
        return []
    attempts = Attempts(folder)
    limits: list[Limit] = []
    if {"response", "peaks"} & set(names):
        limits = attempts.result("linear limits", lambda: linear_limits(shown)) or []
    damped = most_damped(shown)
    figures: dict[str, Callable[[], Figure | None]] = {
        "response": lambda: response_figure(shown, limits, title),
        "peaks": lambda: trend_figure(shown, limits, title) if len(shown) > 1 else None,
        "hysteresis": lambda: None if damped is None else node_figure(damped, title),
        "hysteresis_sweep": lambda: sweep_figure(shown, title),
        "nodal_diameters": lambda: nodal_diameter_figure(shown[0], title),
        "campbell": lambda: campbell_figure(shown, title),
    }

    def draw_one(name: str) -> None:
        figure = figures[name]()
        if figure is not None:
            save(figure, folder, name, formats)

    with styled():
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

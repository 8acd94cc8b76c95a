"""The stage `figures`: every figure that the curves of a run allow, in `figures/` of the output folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.results.publishing import published, remove_outdated
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.store.fingerprints import fingerprint

if TYPE_CHECKING:
    from pipeline.stages.request import Run
    from pipeline.stages.respond import CurveResult

NAMES = ("response", "peaks", "hysteresis", "hysteresis_sweep", "nodal_diameters", "campbell")


def figure_stage(run: Run, curves: Sequence[CurveResult]) -> list[Path]:
    """The figures of the run; those that are missing are drawn."""
    title = _title(run)
    content = {
        "title": title,
        "curves": [[c.file.parent.name if c.file else None, c.reason, dict(c.member.parameters)] for c in curves],
        "code": code_fingerprint(__name__),
    }
    folder = run.request.out / "figures"
    files = published(
        run, "figures", fingerprint(content), "drawing figures", lambda into: draw(into, curves, title), folder
    )
    remove_outdated(folder, [f"{name}.*" for name in NAMES], files)
    return files


def draw(folder: Path, curves: Sequence[CurveResult], title: str) -> None:
    """Draw every figure that the curves allow."""
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
        return
    limits = linear_limits(shown)
    with styled():
        save(response_figure(shown, limits, title), folder, "response")
        if len(shown) > 1:
            save(trend_figure(shown, limits, title), folder, "peaks")
        damped = most_damped(shown)
        loops = None if damped is None else node_figure(damped, title)
        if loops is not None:
            save(loops, folder, "hysteresis")
        others = {
            "hysteresis_sweep": sweep_figure(shown, title),
            "nodal_diameters": nodal_diameter_figure(shown[0], title),
            "campbell": campbell_figure(shown, title),
        }
        for name, figure in others.items():
            if figure is not None:
                save(figure, folder, name)


def _title(run: Run) -> str:
    first = run.request.scene.first
    return (first.title or first.name).replace("$", r"\$")  # no formulae: half of one is an error

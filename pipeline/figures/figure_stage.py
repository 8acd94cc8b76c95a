"""The stage `figures`: every figure that curves and studies of a run allow, in `figures/` of the output folder.

The module of a figure is imported where the figure is drawn.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.figures.data import curve_colours
from pipeline.process.workers import Call, kept_count, workers
from pipeline.results.publishing import Attempts, PicturesMissing, published, remove_outdated
from pipeline.scene.labels import fixed_values, values_said
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

NAMES = (
    "response",
    "peaks",
    "hysteresis",
    "map",
    "hysteresis_sweep",
    "nodal_diameters",
    "campbell",
    "flutter",
    "outputs",
)
MAIN = NAMES[:2]  # those of a run that was stopped
_SHARED = NAMES[:3], NAMES[3:]  # between two processes, about the same work for each
MOST_LIMITS = 24  # of a kind, in one figure


@dataclass(frozen=True)
class Look:
    """What the figures of a run say and how they are written."""

    title: str  # of the scene
    fixed: str  # values of the scene that are not swept, a line below the title
    redraw: str  # command that draws them again
    formats: tuple[str, ...]
    bifurcations: bool  # whether they have marks in the response

    @property
    def key(self) -> dict[str, object]:
        """What they show: a folder or scene that is moved does not draw them again."""
        return {name: value for name, value in asdict(self).items() if name != "redraw"}


def look_of(run: Run, verb: str = "run", options: str = " --until figures") -> Look:
    """The look of the figures of a run that `shroud VERB SCENE --out DIR OPTIONS` draws."""
    request = run.request
    first = request.scene.first
    scene, out = (shlex.quote(str(path)) for path in (request.scene.path, request.out))
    given = "" if request.rom is None else f" --rom {shlex.quote(request.rom_said)}"
    if given and verb == "run":
        verb, options = "respond", ""
    redraw = f"shroud {verb} {scene}{given} --out {out}{options}"
    if given and not isinstance(request.rom, Path):
        redraw = f"shroud.read_results({str(request.out)!r}).plot() in Python"
    asked = set(first.figures.formats)
    formats = asked | {"svg"} if Stage.REPORT in request.wanted else asked  # the report has vectors
    fixed = values_said(fixed_values(first, request.scene.swept))
    return Look(first.title or first.name, fixed, redraw, tuple(sorted(formats)), first.figures.bifurcations)


def study_figures(run: Run, studies: Mapping[str, StudyOutcome], look: Look) -> list[Path]:
    """The figures of these studies in the output folder; those that are missing are drawn."""
    folder = run.request.out / "figures"
    attempts, files = Attempts(folder), []
    for name, study in studies.items():
        files += attempts.result(figure_file(name), partial(_published, run, study, look)) or []
    remove_outdated(folder, [f"{figure_file(name)}.*" for name in studies], files)
    if attempts.problems:
        raise PicturesMissing(files, attempts.problems)
    return files


def _published(run: Run, study: StudyOutcome, look: Look) -> list[Path]:
    """The files of one figure, drawn where they are missing."""
    members = run.request.scene.members
    colours = curve_colours(members) if study.name == "backbone" else []
    title = look.title
    if study.name == "optimum":
        swept = {*run.request.scene.swept, *study.result.ranges}
        title += f"\n{values_said(fixed_values(run.request.scene.first, swept))}"

    def build(folder: Path) -> None:
        from pipeline.figures.style import save, styled

        with styled():
            figure = figure_of(study.name)(study.result, title, *([colours] if colours else []))
            if figure is not None:
                save(figure, folder, figure_file(study.name), look.formats, look.redraw)

    code = code_fingerprint(module_of(study.name, "figure"))
    inputs = {"study": study.key, "look": look.key, "title": title, "colours": colours, "code": code}
    doing = f"drawing the figure of the study {study.name}"
    return published(run, Stage.FIGURES, fingerprint(inputs), doing, build, run.request.out / "figures")


def figure_stage(
    run: Run, curves: Sequence[CurveResult], studies: Mapping[str, StudyOutcome], names: Sequence[str] = NAMES
) -> list[Path]:
    """The figures of the run, those `names` of its curves and those of its studies; missing ones are drawn."""
    look, attempts = look_of(run), Attempts(run.request.out / "figures")
    drawn = attempts.result("studies", partial(study_figures, run, studies, look)) if studies else []
    try:
        files = _curve_figures(run, curves, look, studies.get("backbone"), names)
    except PicturesMissing as missing:
        attempts.problems.extend(missing.problems)
        files = missing.files
    if attempts.problems:
        raise PicturesMissing([*files, *(drawn or [])], attempts.problems)
    return [*files, *(drawn or [])]


def _curve_figures(
    run: Run,
    curves: Sequence[CurveResult],
    look: Look,
    backbone: StudyOutcome | None,
    names: Sequence[str],
) -> list[Path]:
    """The figures of the curves; the nonlinear modes are drawn into one of them."""
    content = {
        "backbone": None if backbone is None else backbone.key,
        "look": look.key,
        **({} if names == NAMES else {"names": names}),
        "curves": [[c.file.parent.name if c.file else None, c.reason, dict(c.member.parameters)] for c in curves],
        "code": code_fingerprint(__name__),
    }
    folder = run.request.out / "figures"
    key, patterns = fingerprint(content), [f"{name}.*" for name in NAMES]
    try:
        build = partial(_draw_all, run, curves, look, None if backbone is None else backbone.result, names)
        files = published(run, "figures", key, "drawing figures", build, folder)
    except PicturesMissing as missing:
        remove_outdated(folder, patterns, missing.files)
        raise
    remove_outdated(folder, patterns, files)
    return files


def _draw_all(
    run: Run,
    curves: Sequence[CurveResult],
    look: Look,
    backbone: BackboneResult | None,
    names: Sequence[str],
    folder: Path,
) -> list[str]:
    """Draw all figures, in the processes that have solved the curves, where there are any."""
    if kept_count() < 2 or names != NAMES:
        return draw(folder, curves, look, names, run.request.out, backbone)
    calls = {part: Call(draw, (folder, curves, look, part, run.request.out, backbone)) for part in _SHARED}
    with workers(len(calls), run.reporter.interrupts.check) as pool, run.reporter.interrupts.looking():
        drawn = {part: future.result() for part, future in pool.completed(calls)}
    return [problem for part in _SHARED for problem in drawn[part]]


def draw(
    folder: Path,
    curves: Sequence[CurveResult],
    look: Look,
    names: Sequence[str] = NAMES,
    out: Path | None = None,
    backbone: BackboneResult | None = None,
) -> list[str]:
    """Draw every one of the figures `names` that the curves allow; returns one line for each that failed.

    `out` is the folder that an error of the disk names; `backbone` are nonlinear modes drawn into the response.
    """
    from pipeline.figures.campbell import campbell_figure, nodal_diameter_figure
    from pipeline.figures.data import plotted_curves, sweep_points
    from pipeline.figures.flutter import flutter_figure
    from pipeline.figures.hysteresis import most_damped, node_figure, sweep_figure
    from pipeline.figures.linear_limits import count_limits, linear_limits
    from pipeline.figures.peaks import band_figure, curves_to_read, has_few_lines, quantile_figure, trend_figure
    from pipeline.figures.response import has_lines, outputs_figure, response_figure
    from pipeline.figures.style import save, styled
    from pipeline.figures.sweep_map import sweep_map_figure
    from pipeline.stages.model.flutter import linear_flutter
    from rom.linear_algebra.threads import one_blas_thread

    points = sweep_points(curves)
    if not points:
        return []
    lines, few = has_lines(points), has_few_lines(points)
    shown = plotted_curves(curves, None if lines else curves_to_read(points))
    attempts = Attempts(folder, out)
    limits: list[Limit] = []
    damped = most_damped(shown)
    orders = {curve.scene.excitation.engine_order for curve in shown}
    members = [curve.member for curve in curves]
    colours = dict(zip([member.index for member in members], curve_colours(members), strict=True))
    title, heading = look.title, f"{look.title}\n{look.fixed}"
    figures: dict[str, Callable[[], Figure | None]] = {
        "response": lambda: (
            response_figure(shown, limits, colours, heading, backbone, look.bifurcations)
            if lines
            else band_figure(shown, points, title)
        ),
        "peaks": lambda: trend_figure(points, limits, colours, heading) if few else quantile_figure(points, title),
        "hysteresis": lambda: None if damped is None else node_figure(damped, title),
        "map": lambda: sweep_map_figure(curves, points, heading),
        "hysteresis_sweep": lambda: sweep_figure(shown, colours, title),
        "nodal_diameters": lambda: nodal_diameter_figure(shown[0], title, orders),
        "campbell": lambda: campbell_figure(shown, title),
        "flutter": lambda: flutter_figure(linear_flutter(shown[0].rom, shown[0].scene), title),
        "outputs": lambda: outputs_figure(shown, colours, title),
    }

    def draw_one(name: str) -> None:
        figure = figures[name]()
        if figure is not None:
            save(figure, folder, name, look.formats, look.redraw)

    with one_blas_thread(), styled():  # the same bits in this process as in a worker
        if {"response", "peaks"} & set(names) and count_limits(shown) <= MOST_LIMITS:
            limits = attempts.result("linear limits", lambda: linear_limits(shown)) or []
        for name in names:
            attempts.result(name, partial(draw_one, name))
    return attempts.problems

"""`shroud modes`: the modes of a scene, with their numbers and pictures in the folder `modes` of the output."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.codec import plain
from pipeline.figures.figure_stage import Look, look_of
from pipeline.results.modes import ModelModes, modes_of_scene
from pipeline.results.publishing import Attempts, PicturesMissing, published, remove_outdated
from pipeline.run import built_models
from pipeline.scene.labels import member_label
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.model.sweep_models import campbell_summary
from pipeline.stages.stage import Stage
from pipeline.store.fingerprints import fingerprint

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pipeline.process.progress import Reporter
    from pipeline.scene.schema import Scene
    from pipeline.stages.model.flutter import LinearFlutter
    from pipeline.stages.model.sweep_models import Models
    from pipeline.stages.request import Request, Run

FOLDER, FILE = "modes", "modes.json"
FIGURES = ("nodal_diameters", "campbell", "flutter")


@dataclass(frozen=True)
class ModesFound:
    """The modes of a scene."""

    models: list[ModelModes]
    values: dict[str, Any]  # as in modes.json
    files: list[Path]  # pictures and modes.json in the output folder
    problems: list[str]  # what could not be computed or drawn, one line each


@dataclass(frozen=True)
class ShownModel:
    """A member of a sweep with the file of its reduced model, as the diagrams take it."""

    rom: Path
    scene: Scene
    parameters: Mapping[str, Any]


def find_modes(request: Request, reporter: Reporter) -> ModesFound:
    """The modes of the reduced models of a scene; no response is solved. Models of an earlier run are reused."""
    with built_models(request, reporter) as (run, models, outcome):
        found = modes_of_scene(run, models, outcome.problems)
        campbell = campbell_summary(run, models, outcome)
        values = {"scene": request.scene.first.name, "models": plain(found), "campbell": campbell}
        try:
            files = _published(run, models, values, next((each.flutter for each in found), None))
        except PicturesMissing as missing:
            files = missing.files
            outcome.problems.extend(missing.problems)
        remove_outdated(request.out / FOLDER, [f"{name}.*" for name in FIGURES], files)
        if len(request.scene.members) > 1:
            said = member_label(request.scene.members[0])
            reporter.line(f"nodal_diameters.png is drawn for the first value of the sweep, {said}")
    return ModesFound(found, values, files, outcome.problems)


def _published(run: Run, models: Models, values: dict[str, Any], flutter: LinearFlutter | None) -> list[Path]:
    """modes.json and the diagrams, drawn where they are missing."""
    members = run.request.scene.members
    built = [(member, model) for member in members if (model := models[member.index]) is not None]
    if not built:
        return []
    shown = [ShownModel(model.rom, member.scene, member.parameters) for member, model in built]
    first = run.request.scene.first
    look = look_of(run, "modes", "")
    content = {
        "values": values,
        "models": [model.key for _, model in built],
        "range": first.response.frequency,
        "look": look.key,
        "code": [code_fingerprint(f"pipeline.figures.{name}") for name in ("campbell", "flutter")],
    }
    build = partial(_write, shown, values, look, flutter)
    return published(run, Stage.FIGURES, fingerprint(content), "drawing modes", build, run.request.out / FOLDER)


def _write(
    shown: Sequence[ShownModel], values: dict[str, Any], look: Look, flutter: LinearFlutter | None, folder: Path
) -> list[str]:
    """Write modes.json and the diagrams; returns one line for each that failed."""
    from pipeline.figures.campbell import campbell_figure, nodal_diameter_figure
    from pipeline.figures.flutter import flutter_figure
    from pipeline.figures.style import save, styled
    from rom.linear_algebra.threads import one_blas_thread

    (folder / FILE).write_text(json.dumps(values, indent=1, ensure_ascii=False), encoding="utf-8")
    orders = {each.scene.excitation.engine_order for each in shown}
    figures = {
        "nodal_diameters": lambda: nodal_diameter_figure(shown[0], look.title, orders),
        "campbell": lambda: campbell_figure(shown, look.title),
        "flutter": lambda: flutter_figure(flutter, look.title),
    }
    attempts = Attempts(folder)

    def draw(name: str) -> None:
        figure = figures[name]()
        if figure is not None:
            save(figure, folder, name, look.formats, look.redraw)

    with one_blas_thread(), styled():
        for name in FIGURES:
            attempts.result(name, partial(draw, name))
    return attempts.problems

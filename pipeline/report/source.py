"""Everything that the page is made from, and the key that says whether an earlier page still holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pipeline.report.published_page import results_fingerprint
from pipeline.scene.schema import Scene
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.model_chain import BuiltModel
from pipeline.stages.request import Run, RunOutcome
from pipeline.stages.respond import CurveResult
from pipeline.stages.sweep_models import Models
from pipeline.store.fingerprints import file_fingerprint, fingerprint
from pipeline.verify.cases import Measuring, distinct_cases
from pipeline.verify.stage import Measured

_PAGE_MODULE = "pipeline.report.page"
_TEMPLATES = Path(__file__).parent / "templates"


@dataclass(frozen=True)
class ReportSource:
    """Results of a run.

    models: by index of the member; model_rows: `models` of summary.json; pictures: files in `out`; measured: what
    `shroud verify` has found, empty where it has not been run; costs: stage -> seconds that making its results took,
    in this run or an earlier one; results: stage -> how many; results_key: by which a later run knows
    whether the page is still about them.
    """

    out: Path
    scene_file: Path
    scene_text: str
    swept: tuple[str, ...]
    curves: Sequence[CurveResult]
    models: Mapping[int, BuiltModel | None]
    model_rows: Sequence[dict[str, Any]]
    pictures: Sequence[str]
    measured: Sequence[Measured]
    costs: Mapping[str, float]
    results: Mapping[str, int]
    problems: Sequence[str]
    results_key: str

    @property
    def first(self) -> Scene:
        """The scene of the first member."""
        return self.curves[0].member.scene

    @property
    def title(self) -> str:
        """Heading of the page."""
        return self.first.title or self.first.name

    def picture(self, name: str) -> Path | None:
        """A picture of this run by its name in the output folder, `figures/response.svg`."""
        return self.out / name if name in self.pictures else None

    def key(self) -> str:
        """Hash of all this and of the code that makes the page."""
        return fingerprint(
            {
                "scene": [self.scene_file.name, self.scene_text],
                "curves": [
                    [curve.file.parent.name if curve.file else None, curve.reason, dict(curve.member.parameters)]
                    for curve in self.curves
                ],
                "models": {str(index): model.key for index, model in self.models.items() if model is not None},
                "rows": list(self.model_rows),
                "pictures": {name: file_fingerprint(self.out / name) for name in self.pictures},
                "measured": [[case.label, repr(errors)] for case, errors in self.measured],
                "costs": dict(self.costs),
                "problems": list(self.problems),
                "results": self.results_key,
                "code": code_fingerprint(_PAGE_MODULE),
                "templates": {path.name: file_fingerprint(path) for path in _TEMPLATES.iterdir()},
            }
        )


def report_source(run: Run, models: Models, outcome: RunOutcome) -> ReportSource:
    """The results of a run whose stages before the report are done."""
    scene = run.request.scene
    costs = dict(run.log.cost)
    files = {curve.file: curve.facts.seconds for curve in outcome.curves if curve.file and curve.facts}
    costs["respond"] = sum(files.values())
    counts = {stage: run.log.ran[stage] + run.log.reused[stage] for stage in costs}
    return ReportSource(
        out=run.request.out,
        scene_file=scene.path,
        scene_text=scene.path.read_text(encoding="utf-8"),
        swept=scene.swept,
        curves=outcome.curves,
        models=models,
        model_rows=outcome.models,
        pictures=outcome.pictures,
        measured=_measured(run, models),
        costs={stage: round(seconds, 2) for stage, seconds in costs.items() if counts[stage]},
        results=counts,
        problems=outcome.problems,
        results_key=results_fingerprint(models, outcome),
    )


def _measured(run: Run, models: Models) -> list[Measured]:
    """Errors that an earlier `shroud verify` left in the store; nothing is measured for the page."""
    measuring = Measuring(replace(run, store=replace(run.store, force=False)))
    found = [(case, measuring.known(case)) for case in distinct_cases(run, models)]
    return [(case, errors) for case, errors in found if errors is not None]

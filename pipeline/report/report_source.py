"""Everything that the page shows, and its hash, which tells whether an earlier page is still valid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pipeline.report.published_page import results_fingerprint
from pipeline.scene.schema import Scene
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.curve.respond import CurveResult
from pipeline.stages.model.model_chain import BuiltModel
from pipeline.stages.model.sweep_models import Models
from pipeline.stages.request import Run, RunOutcome, StudyOutcome
from pipeline.store.fingerprints import content_fingerprint, fingerprint
from pipeline.studies.registry import module_of
from pipeline.verify.stage import VerifiedCase, Verifier, distinct_cases

_PAGE_MODULE = "pipeline.report.page"


@dataclass(frozen=True)
class ReportSource:
    """Results of a run."""

    out: Path  # output folder
    # `scene_file`, `scene_text`: the scene
    scene_file: Path
    scene_text: str
    swept: tuple[str, ...]  # swept keys
    curves: Sequence[CurveResult]  # the response curves
    models: Mapping[int, BuiltModel | None]  # reduced model of each member of the sweep, by its index
    model_rows: Sequence[dict[str, Any]]  # `models` of summary.json
    campbell: Sequence[dict[str, Any]]  # `campbell` of summary.json
    pictures: Mapping[str, bytes]  # figures and stills that the page may show, by their names in `out`
    stress: Sequence[dict[str, Any]]  # `stress` of summary.json
    studies: Mapping[str, StudyOutcome]  # results of the studies by their names
    verified: Sequence[VerifiedCase]  # errors found by `shroud verify`, empty where it has not been run
    # seconds that the results of a stage took, in this run or an earlier one, and the number of results
    costs: Mapping[str, float]
    # seconds that the results of a stage took, in this run or an earlier one, and the number of results
    results: Mapping[str, int]
    problems: Sequence[str]  # what could not be computed, one line each
    results_key: str  # hash of the results, by which a later run knows whether the page is still about them

    @property
    def first(self) -> Scene:
        """The scene of the first member."""
        return self.curves[0].member.scene

    @property
    def title(self) -> str:
        """Heading of the page."""
        return self.first.title or self.first.name

    def key(self) -> str:
        """Hash of all this and of the code that makes the page."""
        return fingerprint(
            {
                "scene": [self.scene_file.name, self.scene_text, list(self.swept)],
                "curves": [
                    [
                        curve.file.parent.name if curve.file else None,
                        curve.reason,
                        dict(curve.member.parameters),
                        curve.member.scene.model_dump_json(),
                    ]
                    for curve in self.curves
                ],
                "models": {str(index): model.key for index, model in self.models.items() if model is not None},
                "rows": list(self.model_rows),
                "campbell": list(self.campbell),
                "pictures": {name: content_fingerprint(content) for name, content in self.pictures.items()},
                "stress": list(self.stress),
                "studies": {name: study.key for name, study in self.studies.items()},
                "verified": [[case.label, repr(errors)] for case, errors in self.verified],
                "costs": dict(self.costs),
                "numbers": dict(self.results),
                "problems": list(self.problems),
                "results": self.results_key,
                "code": code_fingerprint(_PAGE_MODULE, *(module_of(name, "report") for name in self.studies)),
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
        scene_text=scene.text,
        swept=scene.swept,
        curves=outcome.curves,
        models=models,
        model_rows=outcome.models,
        campbell=outcome.campbell,
        pictures={
            name: (run.request.out / name).read_bytes()
            for name in outcome.pictures
            if name.endswith((".svg", ".png"))
        },
        stress=outcome.stress,
        studies=outcome.studies,
        verified=_verified(run, models),
        costs={stage: round(seconds, 2) for stage, seconds in costs.items() if counts[stage]},
        results=counts,
        problems=outcome.problems,
        results_key=results_fingerprint(models, outcome),
    )


def _verified(run: Run, models: Models) -> list[VerifiedCase]:
    """Errors that an earlier `shroud verify` left in the store; none are computed for the page."""
    if run.request.rom is not None:  # a given reduced model: what it was reduced from is not known
        return []
    verifier = Verifier(replace(run, store=replace(run.store, recompute=False)))
    found = [(case, verifier.cached_errors(case)) for case in distinct_cases(run, models)]
    return [(case, errors) for case, errors in found if errors is not None]

"""The stage `study`: the studies that a scene asks for, each in a JSON file of the output folder."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pipeline.codec import plain, restored
from pipeline.results.outputs import as_json
from pipeline.results.publishing import copied, remove_outdated, same_file
from pipeline.scene.schema import STUDIES
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.request import StudyOutcome
from pipeline.stages.stage import Stage
from pipeline.store.content_store import read_json
from pipeline.store.disk_errors import StorageError
from pipeline.store.fingerprints import fingerprint
from pipeline.studies.registry import figure_file, study_named
from pipeline.studies.study import Study, StudyContext, TabledStudy, said_of

SCENES = {"identify": ("identified.toml",)}  # what the command of a study writes beside its result
CURVE = "curve_key"  # in the file of a study: key of the curve with the base values of the scene


def study_stage(context: StudyContext) -> None:
    """Find or compute the studies of the scene; results and problems go to the outcome."""
    outcome = context.outcome
    for name in context.scene.studies:
        try:
            outcome.studies[name] = studied(context, study_named(name))
        except StorageError:
            raise
        except Exception as error:  # the curves stand without it
            outcome.problems.append(f"{name}: {said_of(error)}")
            remove_study(context.run.request.out, name)  # what an earlier run left is of other values


def remove_study(out: Path, name: str) -> None:
    """Remove the result of a study from the output folder, with its table, its scene and its figure."""
    remove_outdated(out, [f"{name}.json", f"{name}.csv", *SCENES.get(name, ())], [])
    remove_outdated(out / "figures", [f"{figure_file(name)}.*"], [])


def studied(context: StudyContext, study: Study) -> StudyOutcome:
    """The result of a study, found in the store or computed, and published."""
    run, name = context.run, f"{study.name}.json"
    section = getattr(context.scene, study.name)
    key = fingerprint(
        {
            "study": study.name,
            "section": None if section is None else section.model_dump(),
            "curve": context.base_key,
            "own": dict(study.key(context)),
            "code": code_fingerprint(type(study).__module__, "pipeline.codec"),
        }
    )

    def build(folder: Path) -> None:
        write_study(folder / name, context, study, plain(study.compute(context)))

    entry = run.store.get(Stage.STUDY, key, build)
    run.log.note(Stage.STUDY, entry.ran, entry.seconds)
    if not same_file(entry.file(name), run.request.out / name):
        remove_outdated(run.request.out, SCENES.get(study.name, ()), [])
    files = copied(run.store, entry.folder, run.request.out)
    remove_outdated(run.request.out, [f"{study.name}.csv"], files)
    values = json.loads(entry.file(name).read_text(encoding="utf-8"))
    del values["study"], values[CURVE]
    result = restored(study.result, values)
    return StudyOutcome(study.name, key, result, tuple(study.lines(result)), name, round(entry.seconds, 4))


def write_study(path: Path, context: StudyContext, study: Study, found: Mapping[str, Any]) -> dict[str, Any]:
    """Write the file of a study from the plain fields of its result, its table beside it, and return its content."""
    values = {"study": study.name, CURVE: context.base_key, **found}
    path.write_text(as_json(values) + "\n", encoding="utf-8")
    if isinstance(study, TabledStudy):
        table = study.table(restored(study.result, found))
        if table:
            path.with_suffix(".csv").write_text(table, encoding="utf-8")
    return values


def remove_outdated_studies(context: StudyContext) -> None:
    """Remove results of studies in the output folder that are about another curve than the first of the scene."""
    for name in STUDIES:
        file = context.run.request.out / f"{name}.json"
        if file.is_file() and _curve_of(file) != context.base_key:
            remove_study(file.parent, name)


def _curve_of(file: Path) -> Any:
    try:
        return read_json(file)[CURVE]
    except (OSError, ValueError, KeyError, TypeError):
        return None

"""`shroud verify`: the distinct reduced models and operations of a scene, each measured once."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pipeline.checks import check_scene, parameter_error
from pipeline.errors import StageError, input_error
from pipeline.fingerprint import fingerprint, source_fingerprint
from pipeline.keys import Versions, model_keys
from pipeline.labels import value_label
from pipeline.making import FULL_MODEL, SECTOR
from pipeline.model_stage import Models, blade_models
from pipeline.models import BuiltModel, ModelChain
from pipeline.operation import operation_values
from pipeline.progress import Reporter
from pipeline.request import Outcome, Request, Run
from pipeline.run import open_store
from pipeline.scene_file import Member, SceneFile
from pipeline.stage_log import StageLog
from pipeline.verify.advice import advice
from pipeline.verify.compare import Files, OtherMeshes, model_errors
from pipeline.verify.model_errors import ModelErrors

FILE = "verify.json"
_SOURCES = ["geometry", "rom", "pipeline/verify", "pipeline/operation.py", "pipeline/making.py"]
# Keys that change a response but nothing linear.
_WITHOUT_EFFECT = (
    *(f"contact.{key}" for key in ("friction", "interference", "preload", "law", "integration", "samples")),
    *(f"response.{key}" for key in ("harmonics", "tolerance", "method", "stability", "detached", "truncation")),
    "excitation.force",
)


@dataclass(frozen=True)
class Case:
    """A reduced model in one operation: the first member of the sweep that has it, its errors, what to change.

    label: the swept parameters that tell it from other cases, the scene's name where there are none.
    """

    member: Member
    label: str
    errors: ModelErrors
    tolerance: float
    advice: str


@dataclass
class Verification:
    """What verifying a scene came to. `problems`: what could not be computed, one line each."""

    cases: list[Case] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)


def verify(file: SceneFile, out: Path, tolerance: float | None, force: bool, reporter: Reporter) -> Verification:
    """Measure the reduced models of a scene against full models; `tolerance` goes before `rom.tolerance`.

    Raises
    ------
    InputError : the scene is not usable.
    """
    if file.first.blade is None:
        allowed = "a table [blade] (a given reduced model has no full model to be measured against)"
        raise input_error(file.path, "blade", "missing", allowed)
    check_scene(file)
    request = Request(file, out, "reduce", force)
    store = open_store(request)
    try:
        run = Run(request, store, StageLog(), reporter, Versions.current())
        outcome = Outcome()
        models = blade_models(run, outcome)
        verification = Verification(problems=outcome.problems)
        _measure_all(run, models, tolerance, verification)
    except KeyboardInterrupt:
        store.sweep_up(own=True)
        raise
    return verification


def _measure_all(run: Run, models: Models, tolerance: float | None, verification: Verification) -> None:
    code = source_fingerprint(_SOURCES, ["gmsh", "numpy", "scipy", "scikit-fem"])
    others, seen = OtherMeshes(), set()
    for member in run.request.scene.members:
        model, scene = models[member.index], member.scene
        if model is None:
            continue
        wanted = scene.rom.tolerance if tolerance is None else tolerance
        key = fingerprint({"reduce": model.key, **operation_values(scene), "tolerance": wanted, "code": code})
        if key in seen:
            continue
        seen.add(key)
        try:
            errors = _measured(run, member, model, key, wanted, others)
        except StageError as error:
            if error.is_input and not verification.cases:
                raise parameter_error(run.request.scene.path, member, error.cause) from None
            verification.problems.append(str(error))
        else:
            verification.cases.append(Case(member, _label(member), errors, wanted, advice(errors, scene.rom, wanted)))


def _measured(
    run: Run, member: Member, model: BuiltModel, key: str, tolerance: float, others: OtherMeshes
) -> ModelErrors:
    entry = run.store.find("verify", key)
    if entry is None:
        chain, scene = ModelChain(run.store, run.log, run.reporter), member.scene
        keys = model_keys(scene, run.versions)
        mesh = chain.mesh(scene, keys)
        files = Files(mesh.file(SECTOR), chain.full_model(scene, keys, mesh).file(FULL_MODEL), model.rom)

        def build(folder: Path) -> None:
            errors = model_errors(scene, files, model.facts["modes"], tolerance, others)
            (folder / FILE).write_text(json.dumps(errors.plain()))

        with run.reporter.working(f"measuring {_label(member)}"):
            try:
                entry = run.store.get("verify", key, build)
            except Exception as error:  # one case may fail while the others go on
                raise StageError("verify", error) from error
    return ModelErrors.of_plain(json.loads(entry.file(FILE).read_text()))


def _label(member: Member) -> str:
    matter = {key: value for key, value in member.parameters.items() if key not in _WITHOUT_EFFECT}
    return ", ".join(value_label(key, value) for key, value in matter.items()) or member.scene.name


def plain(verification: Verification) -> dict[str, Any]:
    """What `--json` prints; what is not known is null."""
    cases = [
        {
            "label": case.label,
            "engine_order": case.member.scene.excitation.engine_order,
            "tolerance": case.tolerance,
            **case.errors.plain(),
            "modes_frequency_error": case.errors.modes_frequency,
            "receptance_error": case.errors.receptance,
            "mesh_frequency_error": case.errors.mesh_frequency,
            "advice": case.advice,
        }
        for case in verification.cases
    ]
    return {"cases": _without_nan(cases), "problems": verification.problems}


def _without_nan(value: Any) -> Any:
    """JSON has neither NaN nor infinity."""
    if isinstance(value, float):
        return value if abs(value) < float("inf") else None
    if isinstance(value, dict):
        return {key: _without_nan(inner) for key, inner in value.items()}
    return [_without_nan(inner) for inner in value] if isinstance(value, list | tuple) else value

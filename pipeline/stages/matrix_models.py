"""The reduced models of a scene with [model]: found in the store, or made of the files; no mesh, no assembly."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from pipeline.errors import InputError, StageError
from pipeline.scene.consistency import check_balance, parameter_error, unfit_node_lists
from pipeline.scene.reading import Member
from pipeline.stages.build_from_matrices import (
    FACTS,
    REDUCED_MODEL,
    make_reduced_of_matrices,
    make_superelement,
    read_matrices,
    read_superelement,
)
from pipeline.stages.cache_keys import ModelKeys, model_keys
from pipeline.stages.model_chain import BuiltModel
from pipeline.stages.request import Run, RunOutcome
from pipeline.stages.stage_names import Stage
from pipeline.store.content_store import Entry
from pipeline.store.disk_errors import StorageError

if TYPE_CHECKING:
    from rom import MatrixModel

KIND = "reduce"


def models_of_matrices(run: Run, outcome: RunOutcome) -> dict[int, BuiltModel | None]:
    """The reduced model of every member; failures go to the outcome's problems."""
    made: dict[str, BuiltModel | None] = {}
    read: dict[str, MatrixModel] = {}  # the last files read, by the key of their content
    result: dict[int, BuiltModel | None] = {}
    for member in run.request.scene.members:
        keys = model_keys(member.scene)
        if keys.reduce not in made:
            try:
                made[keys.reduce] = _built(run, member, keys, read)
            except StageError as error:
                made[keys.reduce] = None
                outcome.problems.append(str(error))
        result[member.index] = made[keys.reduce]
        _check(run, member, made[keys.reduce])
    return result


def _built(run: Run, member: Member, keys: ModelKeys, read: dict[str, MatrixModel]) -> BuiltModel | None:
    with run.log.timed(Stage.REDUCE):
        entry = run.store.find(KIND, keys.reduce)
    ran = entry is None
    if entry is None:
        entry = _make(run, member, keys, read)
    run.log.note(Stage.REDUCE, ran=ran, seconds=entry.seconds)
    facts = json.loads(entry.file(FACTS).read_text(encoding="utf-8"))
    for note in facts["notes"] if ran else ():
        run.reporter.line(f"{member.scene.name}: {note}")
    return BuiltModel(keys.reduce, entry.file(REDUCED_MODEL), None, facts)


def _make(run: Run, member: Member, keys: ModelKeys, read: dict[str, MatrixModel]) -> Entry:
    """Read the files, reduce and store. Raises InputError for bad files, StageError for other failures."""
    scene = member.scene
    assert scene.model is not None
    try:
        if scene.model.reduced:
            model, notes = read_superelement(scene)
            with run.log.timed(Stage.REDUCE):
                return run.store.get(KIND, keys.reduce, lambda folder: make_superelement(folder, model, notes, scene))
        if keys.assemble not in read:
            read.clear()
            with run.log.timed(Stage.ASSEMBLE), run.reporter.working("reading matrices"):
                read[keys.assemble] = read_matrices(scene)
        matrices = read[keys.assemble]
        with run.log.timed(Stage.REDUCE), run.reporter.working("reducing"):
            return run.store.get(
                KIND,
                keys.reduce,
                lambda folder: make_reduced_of_matrices(folder, matrices, scene),
            )
    except (InputError, StorageError):
        raise
    except Exception as error:
        if StageError(Stage.REDUCE, error).is_input:
            raise parameter_error(run.request.scene.path, member, error) from None
        raise StageError(Stage.REDUCE, error) from error


def _check(run: Run, member: Member, model: BuiltModel | None) -> None:
    """Refuse lists and numbers of unknowns that do not fit the contact nodes, which only the files tell."""
    if model is None:
        return
    n_contacts: Any = model.facts["n_contacts"]
    for error in unfit_node_lists(run.request.scene.path, member, n_contacts):
        raise error
    check_balance(run.request.scene.path, member, n_contacts)

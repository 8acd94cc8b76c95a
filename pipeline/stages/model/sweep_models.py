"""The reduced model of every member of a sweep: built by tasks, found in the store, or given; and their summary.

With [model] it is made of matrix files, without a mesh. Each result is stored as soon as it is there.
"""

from __future__ import annotations

import json
import shutil
import time
from collections import Counter
from collections.abc import Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.errors import InputError, StageError, reason_of
from pipeline.executor.task import Progress, Task, TaskFailed, TaskResult
from pipeline.process.progress import seconds_since
from pipeline.process.workers import WorkerDied
from pipeline.scene.consistency import check_contacts
from pipeline.scene.labels import member_label
from pipeline.scene.reading import Member, parameter_error
from pipeline.scene.schema import Scene
from pipeline.scene.size_limits import estimated_elements
from pipeline.stages.cache_keys import ModelKeys, linear_operation_inputs, model_keys, rotation_of_response
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.engine_orders import excited_orders
from pipeline.stages.model.build_from_matrices import (
    FACTS,
    make_reduced_of_matrices,
    make_superelement,
    read_matrices,
    read_superelement,
)
from pipeline.stages.model.build_full_model import FULL_MODEL, make_full_model
from pipeline.stages.model.build_mesh import MESH_FILES, SECTOR, make_mesh
from pipeline.stages.model.build_reduced_model import make_reduced_model
from pipeline.stages.model.modal_truncation import larger, stored_coriolis_error, stored_truncation_error
from pipeline.stages.model.model_chain import WITH_BASIS, BuiltModel, ModelChain
from pipeline.stages.model.model_files import REDUCED_MODEL
from pipeline.stages.model.natural_frequencies import campbell_entries, crossing_entries, stored_frequencies
from pipeline.stages.model.scene_materials import FINDINGS, materials_of_file, own_findings
from pipeline.stages.request import Run, RunOutcome
from pipeline.stages.scene_to_solver import interface_facts, touching
from pipeline.stages.stage import Stage
from pipeline.store.content_store import Entry
from pipeline.store.disk_errors import StorageError
from pipeline.store.fingerprints import arrays_fingerprint, fingerprint
from pipeline.store.output_folder import relative_path

if TYPE_CHECKING:
    from rom.cyclic.reduced_model import ReducedModel
    from rom.matrix_files.matrix_model import MatrixModel


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
    """Refuse what does not fit the contact interfaces, which the model alone tells."""
    if model is not None:
        check_contacts(run.request.scene, member, model.facts["interfaces"])


SMALL = 8000.0  # elements, some 100 000 dofs: larger models are built one by one, each with all the memory
SECONDS = "seconds.json"


@dataclass(frozen=True)
class _Missing:
    """A reduced model to build."""

    member: Member
    keys: ModelKeys
    files: Mapping[str, Path] = field(default_factory=dict)  # of a mesh from a file, which is read here


def build_models(run: Run) -> set[tuple[str, str]]:
    """Build the reduced models that the sweep needs and the store does not have, where there are several small ones.

    Returns the results that the log has been told of, by stage and key. Models with a mesh in common are left out, as
    it would be made for each of them; so is what fails: who asks the store for the model builds it and learns the
    reason. A mesh from a file is read here, once, and goes out as a file of the task.
    """
    missing = [] if Stage.REDUCE not in run.request.wanted or run.executor.count < 2 else _missing(run)
    built: set[tuple[str, str]] = set()
    if len(missing) < 2:
        return built
    waiting: dict[Future[TaskResult], _Missing] = {}
    with run.log.timed(Stage.REDUCE), run.reporter.counting("models", len(missing), run.executor.count) as counter:
        for item in missing:
            task = Task(
                member_label(item.member), _build_reduced, item.files, (item.member.scene, run.request.expands)
            )
            waiting[run.executor.submit(task)] = item
        for future in run.executor.completed(counter.within):
            item = waiting.pop(future)
            try:
                result = future.result()
            except (TaskFailed, WorkerDied) as error:
                counter.done(f"{member_label(item.member)}: {reason_of(error)}")
            else:
                built |= _keep(run, item.keys, result)
                counter.done(f"{member_label(item.member)}: {result.seconds:.2f} s")
    return built


def _missing(run: Run) -> list[_Missing]:
    found: dict[str, _Missing] = {}
    for member in run.request.scene.members:
        keys = model_keys(member.scene)
        if keys.blade not in found and not _is_there(run, keys, member.scene.mesh_file is not None):
            found[keys.blade] = _Missing(member, keys)
    shared = Counter(item.keys.mesh for item in found.values())
    alone = [item for item in found.values() if shared[item.keys.mesh] == 1]
    small = [item for item in alone if estimated_elements(item.member.scene) <= SMALL]
    if len(small) < 2:
        return []
    return [each for item in small if (each := _with_files(run, item)) is not None]


def _with_files(run: Run, item: _Missing) -> _Missing | None:
    """The model with the files of its mesh where that comes from a file; None where it cannot be read."""
    if item.member.scene.mesh_file is None:
        return item
    try:
        mesh = ModelChain(run.store, run.log, run.reporter, force=run.request.force).mesh(
            item.member.scene, item.keys
        )
    except StageError:  # said by who asks for the model
        return None
    return replace(item, files={name: mesh.file(name) for name in (SECTOR, FINDINGS, *MESH_FILES)})


def _is_there(run: Run, keys: ModelKeys, of_file: bool) -> bool:
    """Whether the reduced model is in the store, or its mesh, which need not be made again."""
    places = [(kind, key) for key in (keys.reduce, keys.blade) for kind in (WITH_BASIS, "reduce")]
    places += [("mesh", keys.mesh)] * (not of_file)
    return any(run.store.find(kind, key, thorough=False) is not None for kind, key in places)


def _keep(run: Run, keys: ModelKeys, result: TaskResult) -> set[tuple[str, str]]:
    """Store mesh and reduced model, and tell the log of them."""
    seconds = json.loads((result.folder / SECONDS).read_text(encoding="utf-8"))
    kind = WITH_BASIS if run.request.expands else "reduce"
    if run.store.find("mesh", keys.mesh, thorough=False) is None:
        run.store.keep("mesh", keys.mesh, result.folder / "mesh", seconds["mesh"])
    else:  # of a mesh from a file, which the log has been told of
        del seconds["mesh"]
    run.store.keep(kind, keys.blade, result.folder / "reduce", seconds["reduce"])
    shutil.rmtree(result.folder, ignore_errors=True)
    for stage, time_taken in seconds.items():
        run.log.note(stage, ran=True, seconds=time_taken)
    return {("mesh", keys.mesh), ("reduce", keys.blade)}


def _build_reduced(
    folder: Path, files: Mapping[str, Path], scene: Scene, expands: bool, progress: Progress | None = None
) -> None:
    """Mesh, matrices, reduced model; the matrices, many times the size of the rest, are not kept."""
    seconds: dict[str, Any] = {}
    parts = {name: folder / name for name in ("mesh", "assemble", "reduce")}
    for part in parts.values():
        part.mkdir()
    sector, full = parts["mesh"] / SECTOR, parts["assemble"] / FULL_MODEL
    steps = {
        "mesh": lambda: _put(files, parts["mesh"]) if files else make_mesh(parts["mesh"], scene),
        "assemble": lambda: make_full_model(parts["assemble"], sector, scene),
        "reduce": lambda: make_reduced_model(parts["reduce"], sector, full, scene, store_basis=expands),
    }
    for name, step in steps.items():
        start = time.perf_counter()
        step()
        seconds[name] = seconds_since(start)
    shutil.rmtree(parts["assemble"])
    (folder / SECONDS).write_text(json.dumps(seconds), encoding="utf-8")


def _put(files: Mapping[str, Path], folder: Path) -> None:
    """Copy the files of a mesh into a folder."""
    for name, path in files.items():
        shutil.copyfile(path, folder / name)


Models = dict[int, BuiltModel | None]  # by index of the member; None: it could not be made, or was not asked for
WRITER = "rom.files.reduced_model_file"


def models_from_file(run: Run, model: ReducedModel) -> Models:
    """A reduced model from elsewhere for every member, written into the output folder beside the results.

    It is written anew and not copied: what else its file may hold stays outside. Its key is the hash of what was
    read, not of the file, which may be another one by now.
    """
    dofs = model.size if model.basis is None else model.basis.shape[0]
    built: dict[tuple[str, ...] | None, BuiltModel] = {}  # by the interfaces that touch
    for scene in (member.scene for member in run.request.scene.members):
        if (chosen := scene.contact.interfaces) not in built:
            kept = touching(scene, model)
            key = given_model_key(kept)
            entry = run.store.get("rom", key, partial(_write_given, kept))
            facts = {
                "dofs": dofs,
                "reduced_dofs": model.size,
                **interface_facts(scene, model),
                "modes": None,
                "n_blades": model.n_blades,
            }
            built[chosen] = BuiltModel(key, entry.file(REDUCED_MODEL), None, facts)
    return {member.index: built[member.scene.contact.interfaces] for member in run.request.scene.members}


def _write_given(model: ReducedModel, folder: Path) -> None:
    from rom.files.reduced_model_file import write_reduced_model

    write_reduced_model(folder / REDUCED_MODEL, model)


def given_model_key(model: ReducedModel) -> str:
    """Key of a reduced model from elsewhere."""
    return fingerprint({"model": arrays_fingerprint(vars(model)), "code": code_fingerprint(WRITER)})


def models_of_blade(run: Run, outcome: RunOutcome) -> Models:
    """Mesh, full and reduced model of every member, as far as wanted; failures go to the outcome's problems."""
    chain = ModelChain(run.store, run.log, run.reporter, run.request.expands, build_models(run), run.request.force)
    made: dict[str, BuiltModel | None] = {}
    failures: list[tuple[Member, StageError]] = []
    result: Models = {}
    for member in run.request.scene.members:
        key = model_keys(member.scene).reduce
        if key not in made:
            try:
                made[key] = _build(run, chain, member)
            except StageError as error:
                made[key] = None
                failures.append((member, error))
                outcome.problems.append(str(error))
        result[member.index] = made[key]
        _check(run, member, made[key])
    if failures and len(failures) == len(made) and failures[0][1].is_input:
        first, failure = failures[0]
        raise parameter_error(run.request.scene.path, first, failure.cause)
    return result


def model_summaries(run: Run, models: Models, outcome: RunOutcome) -> list[dict[str, Any]]:
    """Entries of `models` in summary.json: one for every reduced model and contact stiffness in the sweep."""
    entries: dict[tuple[str, str], dict[str, Any]] = {}
    known: set[tuple[Any, ...]] = set()
    seen: set[str] = set()  # what the values below depend on: members that differ in friction or gap have one
    for member in run.request.scene.members:
        model = models[member.index]
        if model is None or (inputs := _linear_inputs(model, member.scene)) in seen:
            continue
        try:
            values = stored_frequencies(run.store, model, member.scene)
            coriolis = stored_coriolis_error(run.store, model, member.scene)
            included = member.scene.load.coriolis and coriolis is not None and member.scene.load.speed_rpm != 0.0
            errors = {**stored_truncation_error(run.store, model, member.scene), "coriolis_error": coriolis}
            case = model.key, fingerprint(values["interfaces"])
            excited = (case, member.scene.load.speed_rpm, *excited_orders(member.scene))
            crossings = [] if excited in known else crossing_entries(run.store, model, member.scene)
        except StorageError:
            raise
        except Exception as error:  # the curves stand without them
            outcome.problems.append(f"natural frequencies: {reason_of(error)}")
            continue
        order = str(member.scene.excitation.engine_order)
        entry = entries.setdefault(case, {**_entry(run.request.out, model, values, member.scene), **errors})
        entry |= larger(entry, errors)
        entry["coriolis_included"] = included and entry.get("coriolis_included", True)
        entry["sliding_hz"][order] = values["sliding_hz"]
        entry["stuck_hz"][order] = values["stuck_hz"]
        entry["crossings"] += crossings
        known.add(excited)
        seen.add(inputs)
        if values["each_wave"]:
            entry.setdefault("free_at_order_hz", {})[order] = values["free_hz"]
        for name in ("free_names", "stuck_names"):
            if name in values:
                entry.setdefault(name, {})[order] = values[name]
    return list(entries.values())


def _linear_inputs(model: BuiltModel, scene: Scene) -> str:
    """Hash of what the natural frequencies of a model, their errors and crossings depend on."""
    material = None if scene.material is None else scene.material.model_dump()
    more = {"orders": excited_orders(scene), "material": material, **rotation_of_response(scene)}
    return fingerprint({"model": model.key, **linear_operation_inputs(scene), **more})


def campbell_summary(run: Run, models: Models, outcome: RunOutcome) -> list[dict[str, Any]]:
    """Entries of `campbell` in summary.json: crossings of the engine order over the speeds of the sweep."""
    try:
        return campbell_entries(run.store, models, run.request.scene.members)
    except StorageError:
        raise
    except Exception as error:  # the curves stand without them
        outcome.problems.append(f"Campbell diagram: {reason_of(error)}")
        return []


def _build(run: Run, chain: ModelChain, member: Member) -> BuiltModel | None:
    keys = model_keys(member.scene)
    if Stage.REDUCE in run.request.wanted:
        return chain.reduced_model(member.scene, keys)
    mesh = chain.mesh(member.scene, keys)
    if Stage.ASSEMBLE in run.request.wanted:
        chain.full_model(member.scene, keys, mesh)
    return None


def _entry(out: Path, model: BuiltModel, values: dict[str, Any], scene: Scene) -> dict[str, Any]:
    return {
        "rom": relative_path(model.rom, out),
        "mesh": None if model.mesh is None else relative_path(model.mesh, out),
        **_of_mesh_file(model, scene),
        **{name: value for name, value in model.facts.items() if name not in ("highest_mode_hz", "interfaces")},
        **({"interfaces": values["interfaces"]} if len(values["interfaces"]) > 1 else {}),
        "normal_stiffness": values["normal_stiffness"],
        "tangential_stiffness": values["tangential_stiffness"],
        "free_hz": values["free_hz"],
        "sliding_hz": {},
        "stuck_hz": {},
        "crossings": [],
    }


def _of_mesh_file(model: BuiltModel, scene: Scene) -> dict[str, Any]:
    """Elements, materials and findings of a mesh from a file; nothing for a mesh that was made here."""
    found = {} if model.mesh is None else own_findings(model.mesh.parent)
    if not found:
        return {}
    materials = [line for m in materials_of_file(scene, found).values() for line in (m.line, *m.notes)]
    return {"elements": found["elements"], "mesh_findings": [*found["findings"], *materials]}

"""Reduced models of a sweep built by tasks, several at the same time; each is stored as soon as it is there."""

from __future__ import annotations

import json
import shutil
import time
from collections import Counter
from collections.abc import Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pipeline.errors import StageError, reason_of
from pipeline.executor.task import Progress, Task, TaskFailed, TaskResult
from pipeline.process.clock import seconds_since
from pipeline.process.workers import WorkerDied
from pipeline.scene.labels import member_label
from pipeline.scene.reading import Member
from pipeline.scene.schema import Scene
from pipeline.scene.size_limits import estimated_elements
from pipeline.stages.build_full_model import FULL_MODEL, make_full_model
from pipeline.stages.build_mesh import MESH_FILES, SECTOR, make_mesh
from pipeline.stages.build_reduced_model import make_reduced_model
from pipeline.stages.cache_keys import ModelKeys, model_keys
from pipeline.stages.mesh_findings import FINDINGS
from pipeline.stages.model_chain import WITH_BASIS, ModelChain
from pipeline.stages.request import Run
from pipeline.stages.stage_names import Stage

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
            task = Task(member_label(item.member), _build, item.files, (item.member.scene, run.request.expands))
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
        if keys.reduce not in found and not _is_there(run, keys, member.scene.mesh_file is not None):
            found[keys.reduce] = _Missing(member, keys)
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
        mesh = ModelChain(run.store, run.log, run.reporter).mesh(item.member.scene, item.keys)
    except StageError:  # said by who asks for the model
        return None
    return replace(item, files={name: mesh.file(name) for name in (SECTOR, FINDINGS, *MESH_FILES)})


def _is_there(run: Run, keys: ModelKeys, of_file: bool) -> bool:
    """Whether the reduced model is in the store, or its mesh, which need not be made again."""
    places = [(WITH_BASIS, keys.reduce), ("reduce", keys.reduce), *[("mesh", keys.mesh)] * (not of_file)]
    return any(run.store.find(kind, key, thorough=False) is not None for kind, key in places)


def _keep(run: Run, keys: ModelKeys, result: TaskResult) -> set[tuple[str, str]]:
    """Store mesh and reduced model, and tell the log of them."""
    seconds = json.loads((result.folder / SECONDS).read_text(encoding="utf-8"))
    kind = WITH_BASIS if run.request.expands else "reduce"
    if run.store.find("mesh", keys.mesh, thorough=False) is None:
        run.store.keep("mesh", keys.mesh, result.folder / "mesh", seconds["mesh"])
    else:  # of a mesh from a file, which the log has been told of
        del seconds["mesh"]
    run.store.keep(kind, keys.reduce, result.folder / "reduce", seconds["reduce"])
    shutil.rmtree(result.folder, ignore_errors=True)
    for stage, time_taken in seconds.items():
        run.log.note(stage, ran=True, seconds=time_taken)
    return {("mesh", keys.mesh), ("reduce", keys.reduce)}


def _build(
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

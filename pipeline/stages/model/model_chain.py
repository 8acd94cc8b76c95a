"""The chain from blade to reduced model: a stage runs only where its result is needed and not in the store."""

from __future__ import annotations

import json
from collections.abc import Callable
from collections.abc import Set as AbstractSet
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.errors import StageError
from pipeline.process.progress import Reporter
from pipeline.process.workers import call_apart
from pipeline.scene.schema import Scene
from pipeline.stages.cache_keys import ModelKeys
from pipeline.stages.model.build_full_model import FULL_MODEL, make_full_model
from pipeline.stages.model.build_mesh import MESH_FILES, SECTOR, check_on_mesh, make_mesh
from pipeline.stages.model.build_reduced_model import FACTS, add_damper, make_reduced_model
from pipeline.stages.model.model_files import REDUCED_MODEL
from pipeline.stages.model.scene_materials import own_findings
from pipeline.stages.stage import StageLog
from pipeline.store.content_store import Entry, Store
from pipeline.store.disk_errors import StorageError
from rom.linear_algebra.threads import require_memory

if TYPE_CHECKING:
    from rom.finite_elements.full_model import FullModel


ROOM = 450  # megabytes that a small model takes with the libraries behind it
LARGE = 60_000_000  # bytes of a full model, some 60 000 dofs
WITH_BASIS = "reduce-with-basis"  # kind of the reduced models that can be expanded to the mesh


@dataclass(frozen=True)
class BuiltModel:
    """A reduced model in the store."""

    key: str  # its key
    rom: Path  # its file
    mesh: Path | None  # file of its mesh; None for a model from elsewhere
    facts: dict[str, Any]  # its sizes, from `facts.json`


@dataclass(frozen=True)
class ModelChain:
    """Finds mesh, full model and reduced model of scenes in the store, or builds them; the log tells which."""

    # `store`, `log`, `reporter`: where results are, how they came about, and who reports on it
    store: Store
    log: StageLog
    reporter: Reporter
    expands: bool = False  # whether shapes are expanded to the mesh, for which a reduced model needs its basis
    # results that the log has been told of already, by stage and key
    built: AbstractSet[tuple[str, str]] = frozenset()
    force: bool = False  # whether values far beyond the usual are accepted

    def mesh(self, scene: Scene, keys: ModelKeys) -> Entry:
        """The sector's mesh."""
        known = self.store.find("mesh", keys.mesh, thorough=False) is not None
        verb = "meshing" if scene.mesh_file is None else "reading the mesh"
        entry = self._get("mesh", keys.mesh, verb, lambda folder: make_mesh(folder, scene))
        if scene.mesh_file is not None:
            for line in own_findings(entry.file(SECTOR).parent)["findings"]:
                if not known or line.startswith("warning: "):
                    self.reporter.line(f"{Path(scene.mesh_file).name}: {line}")
            try:
                for line in check_on_mesh(scene, entry.file(SECTOR).parent, self.force):
                    self.reporter.line(f"{Path(scene.mesh_file).name}: warning: {line}")
            except ValueError as error:
                raise StageError("mesh", error) from error
        return entry

    def full_model(
        self, scene: Scene, keys: ModelKeys, mesh: Entry, keep: Callable[[FullModel], None] = lambda full: None
    ) -> Entry:
        """The assembled matrices of a mesh; where they are assembled now, `keep` gets them as well."""
        sector = mesh.file(SECTOR)
        return self._get(
            "assemble", keys.assemble, "assembling", lambda folder: keep(make_full_model(folder, sector, scene))
        )

    def reduced_model(self, scene: Scene, keys: ModelKeys) -> BuiltModel:
        """The reduced model; the full model is built, or its file read, only where this one is missing.

        With its basis or without it is the same model: curves solved on one hold for the other.
        """
        mesh = self.mesh(scene, keys)
        entry = self._reduced(scene, keys, mesh, keys.reduce)
        facts = json.loads(entry.file(FACTS).read_text())
        return BuiltModel(keys.reduce, entry.file(REDUCED_MODEL), mesh.file(MESH_FILES[0]), facts)

    def _reduced(self, scene: Scene, keys: ModelKeys, mesh: Entry, key: str) -> Entry:
        """The reduced model with one of the keys: that of the blade, or the blade with its damper."""
        entry = self._find("reduce", key, WITH_BASIS)
        if entry is None and not self.expands:
            entry = self._find("reduce", key)
        if entry is None:
            kind, sector = WITH_BASIS if self.expands else "reduce", mesh.file(SECTOR)
            if key != keys.blade:
                known = self.store.find(kind, keys.blade)  # one of a sweep that needs it again is not counted again
                blade = (known or self._reduced(scene, keys, mesh, keys.blade)).file(REDUCED_MODEL).parent
                build = partial(add_damper, sector_file=sector, blade=blade, scene=scene, store_basis=self.expands)
                return self._make("reduce", kind, key, "", build)  # too short to be reported
            assembled: list[FullModel] = []  # to read it from its file takes as long as to assemble half of it
            full = self.full_model(scene, keys, mesh, assembled.append).file(FULL_MODEL)
            return self._make("reduce", kind, key, "reducing", self._reducer(sector, full, scene, assembled))
        if full_model := self.store.find("assemble", keys.assemble, thorough=False):
            self.log.note("assemble", ran=False, seconds=full_model.seconds)
        return entry

    def _reducer(self, sector: Path, full: Path, scene: Scene, assembled: list[FullModel]) -> Callable[[Path], None]:
        """A function that writes the reduced model into a folder, of the full model `assembled` if it is not large.

        The factorisation of a large one takes many seconds in C code that ignores Ctrl-C: it runs in another process.
        """

        def reduce(folder: Path) -> None:
            if full.stat().st_size > LARGE:
                assembled.clear()
                call_apart(make_reduced_model, folder, sector, full, scene, store_basis=self.expands)
            else:
                make_reduced_model(folder, sector, full, scene, store_basis=self.expands, assembled=assembled)

        return reduce

    def _find(self, stage: str, key: str, kind: str | None = None) -> Entry | None:
        with self.log.timed(stage):
            entry = self.store.find(kind or stage, key)
        if entry is not None and (stage, key) not in self.built:
            self.log.note(stage, ran=False, seconds=entry.seconds)
        return entry

    def _get(self, stage: str, key: str, verb: str, build: Callable[[Path], None]) -> Entry:
        return self._find(stage, key) or self._make(stage, stage, key, verb, build)

    def _make(self, stage: str, kind: str, key: str, verb: str, build: Callable[[Path], None]) -> Entry:
        with self.log.timed(stage), self.reporter.working(verb) if verb else nullcontext():
            require_memory(ROOM)  # without it no member can go on
            try:
                entry = self.store.get(kind, key, build)
            except StorageError:
                raise
            except Exception as error:  # one member of a sweep may fail while the others go on
                raise StageError(stage, error) from error
        self.log.note(stage, ran=True, seconds=entry.seconds)
        return entry

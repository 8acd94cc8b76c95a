"""Reduced models in memory: built once through the store of the output folder, the last ones kept."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from pipeline.errors import StageError
from pipeline.process.progress import Reporter
from pipeline.run import built_models
from pipeline.scene.reading import Member, SceneFile
from pipeline.scene.schema import Scene
from pipeline.stages.cache_keys import model_keys
from pipeline.stages.model.model_chain import WITH_BASIS, BuiltModel
from pipeline.stages.request import Request
from pipeline.stages.scene_to_solver import contact_on_model, damped_modes, section_excitation
from pipeline.stages.stage import Stage
from pipeline.store.content_store import Store
from pipeline.store.output_folder import STORE

if TYPE_CHECKING:
    from geometry import SectorMesh
    from pipeline.figures.linear_limits import Limit
    from rom import ReducedModel

T = TypeVar("T")

KEPT = 12  # reduced models without their bases in memory, a megabyte or so each
LIMITS = 64  # linear limits in memory, some 30 kB each
GIVEN = "given"


@dataclass(frozen=True)
class LoadedModel:
    """A reduced model in memory, without its basis."""

    built: BuiltModel  # its place in the store
    model: ReducedModel
    seconds: Mapping[str, float]  # what each stage took to make it, now or in an earlier run


@dataclass
class LiveModels:
    """The reduced models of scenes that differ in their knobs."""

    out: Path  # output folder, whose store has the models
    rom: Path | ReducedModel | None = None  # model from elsewhere, in place of those of scenes
    reporter: Reporter = field(default_factory=lambda: Reporter(quiet=True))
    _kept: OrderedDict[str, LoadedModel] = field(default_factory=OrderedDict)
    _mesh: dict[str, tuple[ReducedModel, SectorMesh]] = field(default_factory=dict)  # the last one with its basis
    _limits: OrderedDict[tuple[object, ...], Limit | None] = field(default_factory=OrderedDict)
    _facts: dict[str, Any] = field(default_factory=dict)
    _lock: threading.RLock = field(default_factory=threading.RLock)

    def key(self, scene: Scene) -> str:
        """What tells the models of scenes apart."""
        return GIVEN if self.rom is not None else model_keys(scene).reduce

    def is_at_hand(self, scene: Scene) -> bool:
        """Whether the model of a scene is in memory or in the store, or is one of those with another damper."""
        if self.rom is not None:
            return True
        keys = model_keys(scene)
        wanted = {keys.reduce, keys.blade}  # a damper is added in hundredths of a second
        store = Store(self.out / STORE)
        return bool(wanted & self._kept.keys()) or any(
            store.lists(kind, key) for kind in ("reduce", WITH_BASIS) for key in wanted
        )

    def of(self, file: SceneFile, member: Member) -> LoadedModel:
        """The model of a member of a scene; built where it is missing, which takes seconds."""
        key = self.key(member.scene)
        with self._lock:
            if key not in self._kept:
                self._kept[key] = self._loaded(file, member)
                while len(self._kept) > KEPT:
                    self._kept.popitem(last=False)
            self._kept.move_to_end(key)
            return self._kept[key]

    def on_mesh(self, file: SceneFile, member: Member) -> tuple[ReducedModel, SectorMesh] | None:
        """The model with its basis, and the mesh; None for a model without a mesh."""
        from pipeline.stages.model.build_mesh import SECTOR
        from rom import load_sector, read_reduced_model

        if self.rom is not None or member.scene.model is not None:
            return None
        with self._lock:
            built = self.of(file, member).built
            assert built.mesh is not None
            if built.key not in self._mesh:
                self._mesh.clear()
                self._mesh[built.key] = read_reduced_model(built.rom), load_sector(built.mesh.parent / SECTOR)
            return self._mesh[built.key]

    def limits(self, scene: Scene, loaded: LoadedModel) -> tuple[Limit, ...]:
        """The linear limits of a scene on its model; those whose inputs a knob does not touch are kept."""
        found = (self._limit(kind, scene, loaded) for kind in ("free", "stuck"))
        return tuple(limit for limit in found if limit is not None)

    def remembered(self, name: str, find: Callable[[], T]) -> T:
        """A fact on the scene that was opened, found once."""
        with self._lock:
            if name not in self._facts:
                self._facts[name] = find()
            found: T = self._facts[name]
            return found

    def _limit(self, kind: str, scene: Scene, loaded: LoadedModel) -> Limit | None:
        from pipeline.figures.linear_limits import limit_of

        response, wave, contact = scene.response, scene.excitation, contact_on_model(scene, loaded.model)
        case: tuple[object, ...] = (kind, loaded.built.key, wave.force, wave.harmonic)
        case += (response.damping_ratio, response.rayleigh, response.frequency)
        if kind == "stuck" or loaded.model.has_disk:
            case += (wave.engine_order,)
        if kind == "stuck":
            case += (contact.normal_stiffness.tobytes(), contact.tangential_stiffness.tobytes())
        with self._lock:
            if case not in self._limits:
                modal = damped_modes(loaded.model, response, scene.load)
                problem = modal, contact, section_excitation(wave)
                self._limits[case] = limit_of(kind, loaded.model, problem, response.frequency)
                while len(self._limits) > LIMITS:
                    self._limits.popitem(last=False)
            self._limits.move_to_end(case)
            return self._limits[case]

    def _loaded(self, file: SceneFile, member: Member) -> LoadedModel:
        from rom import read_reduced_model

        built, seconds = build_model(self.out, self.rom, file, member, self.reporter)
        return LoadedModel(built, read_reduced_model(built.rom, with_basis=False), seconds)


def build_model(
    out: Path, rom: Path | ReducedModel | None, file: SceneFile, member: Member, reporter: Reporter
) -> tuple[BuiltModel, dict[str, float]]:
    """The model of a member in the store, with its basis where there is a mesh, and what each stage took."""
    single = replace(file, members=(replace(member, index=0),), swept=())
    request = Request(single, out, Stage.REDUCE, jobs=1, rom=rom)
    if not request.without_mesh:
        request = replace(request, until=Stage.RENDER)  # which needs the basis; nothing is drawn
    with built_models(request, reporter) as (run, models, outcome):
        built = models[0]
        if built is None:
            problem = outcome.problems[0] if outcome.problems else "the reduced model could not be made"
            raise StageError(Stage.REDUCE, RuntimeError(problem))
        return built, {stage: run.log.cost[stage] for stage in (Stage.MESH, Stage.ASSEMBLE, Stage.REDUCE)}

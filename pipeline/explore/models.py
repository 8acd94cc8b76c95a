"""Reduced models in memory: built once through the store of the output folder, the last ones kept.

That of a blade with another damper is made in memory alone: it takes hundredths of a second, and a slider asks for
many.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from pipeline.errors import StageError
from pipeline.process.progress import Reporter
from pipeline.run import built_models
from pipeline.scene.reading import Member, SceneFile
from pipeline.scene.schema import Scene
from pipeline.stages.cache_keys import ModelKeys, model_keys
from pipeline.stages.model.model_chain import WITH_BASIS, BuiltModel
from pipeline.stages.model.model_files import REDUCED_MODEL
from pipeline.stages.request import Request
from pipeline.stages.scene_to_solver import contact_on_model, scene_modes, section_excitation, touching
from pipeline.stages.stage import Stage
from pipeline.store.content_store import Store
from pipeline.store.output_folder import STORE

if TYPE_CHECKING:
    from geometry.sector import SectorMesh
    from pipeline.figures.linear_limits import Limit
    from rom.cyclic.reduced_model import ReducedModel

K = TypeVar("K")
T = TypeVar("T")

KEPT = 12  # reduced models without their bases in memory, a megabyte or so each
LIMITS = 64  # linear limits under 1 N in memory, some 10 kB each
GIVEN = "given"
REDUCED = (WITH_BASIS, "reduce")  # kinds of reduced models in the store


@dataclass(frozen=True)
class LoadedModel:
    """A reduced model in memory, without its basis."""

    key: str  # what tells it from others
    model: ReducedModel


@dataclass
class LiveModels:
    """The reduced models of scenes that differ in their knobs."""

    out: Path  # output folder, whose store has the models
    rom: Path | ReducedModel | None = None  # model from elsewhere, in place of those of scenes
    reporter: Reporter = field(default_factory=lambda: Reporter(quiet=True))
    _kept: OrderedDict[str, LoadedModel] = field(default_factory=OrderedDict)
    # the last ones: blade without its damper with its mesh, model with its basis and its mesh
    _blade: dict[str, tuple[ReducedModel, SectorMesh]] = field(default_factory=dict)
    _mesh: dict[str, tuple[ReducedModel, SectorMesh]] = field(default_factory=dict)
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
        wanted = {keys.reduce, keys.blade}
        known = any(self._store.lists(kind, key) for kind in REDUCED for key in wanted)
        return known or bool(wanted & self._kept.keys())

    def in_memory(self, scene: Scene) -> LoadedModel | None:
        """The model of a scene where it is in memory."""
        return self._kept.get(self.key(scene))

    def of(self, file: SceneFile, member: Member) -> LoadedModel:
        """The model of a member of a scene; built where it is missing, which takes seconds."""
        key = self.key(member.scene)
        with self._lock:
            return _remembered(self._kept, key, KEPT, lambda: self._loaded(file, member))

    def on_mesh(self, file: SceneFile, member: Member) -> tuple[ReducedModel, SectorMesh] | None:
        """The model with its basis, and the mesh; None for a model without a mesh."""
        from pipeline.stages.model.build_mesh import SECTOR
        from rom.files.reduced_model_file import read_reduced_model
        from rom.files.sector_file import load_sector

        if self.rom is not None or member.scene.model is not None:
            return None
        with self._lock:
            key = self.key(member.scene)
            if key not in self._mesh:
                built = build_model(self.out, None, file, member, self.reporter)
                assert built.mesh is not None
                self._mesh.clear()
                self._mesh[key] = read_reduced_model(built.rom), load_sector(built.mesh.parent / SECTOR)
            return self._mesh[key]

    def seconds(self, keys: ModelKeys) -> dict[str, float]:
        """What mesh, full model and reduced blade of these keys took to make, by stage; 0 where it is not known."""
        kinds = {"mesh": (("mesh",), keys.mesh), "assemble": (("assemble",), keys.assemble)}
        found = {}
        for stage, (names, key) in {**kinds, "reduce": (REDUCED, keys.blade)}.items():
            entries = (self._store.find(kind, key, thorough=False) for kind in names)
            found[stage] = next((entry.seconds for entry in entries if entry is not None), 0.0)
        return found

    @property
    def _store(self) -> Store:
        return Store(self.out / STORE)

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
        from pipeline.figures.linear_limits import COARSE, limit_of

        response, wave, contact = scene.response, scene.excitation, contact_on_model(scene, loaded.model)
        case: tuple[object, ...] = (kind, loaded.key, wave.harmonic)
        case += (response.damping_ratio, response.rayleigh, response.frequency, scene.load.coriolis)
        if kind == "stuck" or loaded.model.has_disk:
            case += (wave.engine_order,)
        if kind == "stuck":
            case += (contact.normal_stiffness.tobytes(), contact.tangential_stiffness.tobytes())

        def find() -> Limit | None:
            modal = scene_modes(scene, loaded.model)
            problem = modal, contact, replace(section_excitation(wave), force=1.0)
            return limit_of(kind, loaded.model, problem, response.frequency, counts=COARSE)

        with self._lock:
            found = _remembered(self._limits, case, LIMITS, find)
        return None if found is None else found.times(wave.force)

    def _loaded(self, file: SceneFile, member: Member) -> LoadedModel:
        from rom.files.reduced_model_file import read_reduced_model

        if self.rom is None and (found := self._damped(member.scene)) is not None:
            return found
        built = build_model(self.out, self.rom, file, member, self.reporter)
        return LoadedModel(self.key(member.scene), read_reduced_model(built.rom, with_basis=False))

    def _damped(self, scene: Scene) -> LoadedModel | None:
        """The model of a blade in the store with a damper that is not there; None where there is no such blade."""
        from pipeline.stages.model.build_reduced_model import damped_model

        if not scene.damper_touches:
            return None
        keys = model_keys(scene)
        if keys.blade not in self._blade:
            found = self._stored_blade(keys)
            if found is None:
                return None
            self._blade.clear()
            self._blade[keys.blade] = found
        return LoadedModel(keys.reduce, touching(scene, damped_model(scene, *self._blade[keys.blade])))

    def _stored_blade(self, keys: ModelKeys) -> tuple[ReducedModel, SectorMesh] | None:
        from pipeline.stages.model.build_mesh import SECTOR
        from rom.files.reduced_model_file import read_reduced_model
        from rom.files.sector_file import load_sector

        blade = next(filter(None, (self._store.find(kind, keys.blade) for kind in REDUCED)), None)
        mesh = self._store.find("mesh", keys.mesh)
        if blade is None or mesh is None:
            return None
        return read_reduced_model(blade.file(REDUCED_MODEL), with_basis=False), load_sector(mesh.file(SECTOR))


def stored_model(out: Path, scene: Scene) -> Path | None:
    """The file of the reduced model in the store; None where it is not there. No run is waited for."""
    store, key = Store(out / STORE), model_keys(scene).reduce
    found = next(filter(None, (store.find(kind, key, thorough=False) for kind in REDUCED)), None)
    return None if found is None else found.file(REDUCED_MODEL)


def build_model(
    out: Path, rom: Path | ReducedModel | None, file: SceneFile, member: Member, reporter: Reporter
) -> BuiltModel:
    """The model of a member in the store, with its basis where there is a mesh."""
    single = replace(file, members=(replace(member, index=0),), swept=())
    request = Request(single, out, Stage.REDUCE, jobs=1, rom=rom)
    if not request.without_mesh:
        request = replace(request, until=Stage.RENDER)  # which needs the basis; nothing is drawn
    with built_models(request, reporter) as (_, models, outcome):
        built = models[0]
        if built is None:
            problem = outcome.problems[0] if outcome.problems else "the reduced model could not be made"
            raise StageError(Stage.REDUCE, RuntimeError(problem))
        return built


def _remembered(kept: OrderedDict[K, T], key: K, most: int, find: Callable[[], T]) -> T:
    """The value of a key, found where it is missing; the `most` used last are kept."""
    if key not in kept:
        kept[key] = find()
        while len(kept) > most:
            kept.popitem(last=False)
    kept.move_to_end(key)
    return kept[key]

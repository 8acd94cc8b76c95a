"""The distinct reduced models and operations of a scene; the errors of each are cached in the store."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from pipeline.errors import StageError
from pipeline.scene.labels import value_label
from pipeline.scene.reading import Member
from pipeline.scene.schema import Scene
from pipeline.stages.build_full_model import FULL_MODEL
from pipeline.stages.build_mesh import SECTOR
from pipeline.stages.build_reduced_model import MOTIONS
from pipeline.stages.cache_keys import linear_operation_inputs, model_keys, rotation_inputs
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.model_chain import BuiltModel, ModelChain
from pipeline.stages.request import Run
from pipeline.stages.sweep_models import Models
from pipeline.store.disk_errors import StorageError
from pipeline.store.fingerprints import fingerprint
from pipeline.verify.advice import AdvisedContacts
from pipeline.verify.advised_mesh import AdvisedMesh, advised_mesh
from pipeline.verify.compare import (
    BladeFiles,
    BladeReference,
    blade_reference,
    model_errors,
    needed_grid,
    needed_modes,
    node_by_node,
    with_orders,
)
from pipeline.verify.model_errors import ModelErrors

KIND, FILE = "verify", "verify.json"
_COMPARISON = "pipeline.verify.advised_mesh"  # it imports the module that measures
# Keys that change a response but nothing linear.
_WITHOUT_EFFECT = (
    *(f"contact.{key}" for key in ("friction", "interference", "preload", "law", "integration", "samples")),
    *(f"response.{key}" for key in ("harmonics", "tolerance", "method", "stability", "detached", "truncation")),
    "response.residual_tractions",
    "excitation.force",
)


@dataclass(frozen=True)
class Case:
    """A reduced model in one operation."""

    member: Member  # the first member of the sweep that has this model and operation
    model: BuiltModel  # the reduced model
    label: str  # swept parameters that tell it from other cases, or the scene's name
    blade: str  # hash of what the full models depend on

    @property
    def scene(self) -> Scene:
        """The member's scene."""
        return self.member.scene


VerifiedCase = tuple[Case, ModelErrors]


@dataclass
class Verifier:
    """Finds the errors of cases, in the store or by computing them; holds the full models of the last blade only."""

    run: Run
    code: str = field(default_factory=lambda: code_fingerprint(_COMPARISON))
    _last: dict[str, BladeReference] = field(default_factory=dict)

    def errors(self, case: Case, place: str = "") -> ModelErrors:
        """Errors of a case; progress shows `place`, such as "2/5 ". Raises StageError."""
        modes = case.model.facts["modes"]

        def compute() -> dict[str, Any]:
            return model_errors(case.scene, self._reference(case), case.model.rom, modes).plain()

        return ModelErrors.of_plain(self._cached(self._key(case), f"measuring {place}{case.label}", compute))

    def with_orders(self, case: Case, errors: ModelErrors) -> ModelErrors:
        """The errors with orders of convergence from a third mesh. Raises StageError."""

        def compute() -> dict[str, Any]:
            return with_orders(case.scene, self._files(case.scene), errors).plain()

        key = fingerprint({"orders": self._key(case)})
        return ModelErrors.of_plain(self._cached(key, f"third mesh of {case.label}", compute))

    def cached_errors(self, case: Case) -> ModelErrors | None:
        """Errors of a case where the store has them."""
        entry = self.run.store.find(KIND, self._key(case))
        return None if entry is None else ModelErrors.of_plain(json.loads(entry.file(FILE).read_text()))

    def _key(self, case: Case) -> str:
        content = {
            "reduce": case.model.key,
            "blade": case.blade,
            **linear_operation_inputs(case.scene),
            "code": self.code,
        }
        return fingerprint(content)

    def needed(self, cases: Sequence[Case], tolerance: float) -> int | None:
        """Fixed-interface modes that a tolerance needs in all cases, None: over 1000. Raises StageError."""
        most = 0
        for blade in dict.fromkeys(case.blade for case in cases):
            of_blade = [case for case in cases if case.blade == blade]
            modes = self._needed_on(of_blade, tolerance)
            if modes is None:
                return None
            most = max(most, modes)
        return most

    def contacts(self, cases: Sequence[VerifiedCase], tolerance: float) -> AdvisedContacts:
        """The contact dofs of a mortar that a tolerance needs in all cases, or the best ones. Raises StageError."""
        found = [self._contacts_of(case, errors, tolerance) for case, errors in cases]
        return max(found, key=lambda each: (each.grid[0] * each.grid[1], each.error))

    def _contacts_of(self, case: Case, errors: ModelErrors, tolerance: float) -> AdvisedContacts:
        content = {"contacts": self._key(case), "tolerance": tolerance}

        def compute() -> dict[str, Any]:
            grid, error = needed_grid(case.scene, self._reference(case), errors, tolerance)
            return {"grid": grid, "error": error}

        found = self._cached(fingerprint(content), "counting the contact nodes needed", compute)
        return AdvisedContacts((found["grid"][0], found["grid"][1]), found["error"])

    def mesh(self, case: Case, errors: ModelErrors, tolerance: float, grid: tuple[int, int]) -> AdvisedMesh:
        """The mesh that a tolerance needs, or the best one. Raises StageError."""
        content = {"mesh": self._key(case), "tolerance": tolerance, "grid": grid, "orders": errors.orders}

        def compute() -> dict[str, Any]:
            return asdict(advised_mesh(case.scene, errors, tolerance, grid))

        return AdvisedMesh(**self._cached(fingerprint(content), "building the mesh advised", compute))

    def _needed_on(self, cases: Sequence[Case], tolerance: float) -> int | None:
        scenes = [case.scene for case in cases]
        content = {
            "needed": [linear_operation_inputs(scene) for scene in scenes],
            "blade": cases[0].blade,
            "tolerance": tolerance,
            "code": self.code,
        }

        def compute() -> dict[str, Any]:
            return {"modes": needed_modes(scenes, self._files(scenes[0]), tolerance)}

        modes: int | None = self._cached(fingerprint(content), "counting the modes needed", compute)["modes"]
        return modes

    def _reference(self, case: Case) -> BladeReference:
        if case.blade not in self._last:
            self._last.clear()
            self._last[case.blade] = blade_reference(case.scene, self._files(case.scene))
        return self._last[case.blade]

    def _files(self, scene: Scene) -> BladeFiles:
        chain = ModelChain(self.run.store, self.run.log, self.run.reporter)
        keys = model_keys(scene)
        mesh = chain.mesh(scene, keys)
        return BladeFiles(mesh.file(SECTOR), chain.full_model(scene, keys, mesh).file(FULL_MODEL))

    def _cached(self, key: str, doing: str, compute: Callable[[], dict[str, Any]]) -> dict[str, Any]:
        """The result of `compute`, from the store where it has it."""
        entry = self.run.store.find(KIND, key)
        if entry is None:

            def build(folder: Path) -> None:
                (folder / FILE).write_text(json.dumps(compute()))

            try:
                with self.run.reporter.working(doing):
                    entry = self.run.store.get(KIND, key, build)
            except (StageError, StorageError):
                raise
            except Exception as error:  # a case that fails does not stop the others
                raise StageError(KIND, error) from error
        values: dict[str, Any] = json.loads(entry.file(FILE).read_text())
        return values


def distinct_cases(run: Run, models: Models) -> list[Case]:
    """The cases among the members of a scene whose reduced models could be made."""
    cases: dict[tuple[str, str], Case] = {}
    for member in run.request.scene.members:
        model, scene = models[member.index], member.scene
        if model is not None:
            key = model.key, fingerprint(linear_operation_inputs(scene))
            cases.setdefault(key, Case(member, model, _label(member), _blade_key(scene, MOTIONS in model.facts)))
    return list(cases.values())


def _blade_key(scene: Scene, joined: bool) -> str:
    """Hash of what the full models depend on; that of a bladed disk is `joined` and holds for one engine order."""
    return fingerprint(
        {
            "assemble": model_keys(scene).assemble,
            **rotation_inputs(scene),
            "direction": scene.excitation.unit_direction,
            "at": scene.excitation.at,
            "contact_dofs": scene.rom.contact_dofs,
            "node_by_node": node_by_node(scene),
            "highest": scene.response.frequency[1],
            "wave": [scene.excitation.engine_order, scene.rom.nodal_diameters] if joined else None,
        }
    )


def _label(member: Member) -> str:
    relevant = {key: value for key, value in member.parameters.items() if key not in _WITHOUT_EFFECT}
    return ", ".join(value_label(key, value) for key, value in relevant.items()) or member.scene.name

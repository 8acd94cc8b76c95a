"""`shroud verify`: errors of the distinct reduced models of a scene, cached in the store, and what to change for a
tolerance.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pipeline.codec import plain, restored
from pipeline.errors import StageError, input_error
from pipeline.process.progress import Reporter
from pipeline.scene.consistency import check_scene
from pipeline.scene.labels import value_label
from pipeline.scene.reading import Member, parameter_error
from pipeline.scene.schema import Scene
from pipeline.stages.cache_keys import linear_operation_inputs, model_keys, rotation_inputs
from pipeline.stages.code_fingerprint import code_fingerprint, remember_code
from pipeline.stages.model.build_full_model import FULL_MODEL
from pipeline.stages.model.build_mesh import SECTOR
from pipeline.stages.model.build_reduced_model import MOTIONS
from pipeline.stages.model.model_chain import BuiltModel, ModelChain
from pipeline.stages.model.sweep_models import Models, models_of_blade
from pipeline.stages.request import Request, Run, RunOutcome
from pipeline.stages.stage import StageLog
from pipeline.stages.worker_start import open_executor
from pipeline.store.disk_errors import StorageError
from pipeline.store.fingerprints import fingerprint
from pipeline.store.output_folder import working_store
from pipeline.verify.advice import AdvisedContacts, AdvisedMesh, Remedies, advice, advised_mesh, within, worst_mesh
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
_COMPARISON = "pipeline.verify.advice"  # it imports the module that measures
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
            return plain(model_errors(case.scene, self._reference(case), case.model.rom, modes))

        return restored(ModelErrors, self._cached(self._key(case), f"measuring {place}{case.label}", compute))

    def with_orders(self, case: Case, errors: ModelErrors) -> ModelErrors:
        """The errors with orders of convergence from a third mesh. Raises StageError."""

        def compute() -> dict[str, Any]:
            return plain(with_orders(case.scene, self._files(case.scene), errors))

        key = fingerprint({"orders": self._key(case)})
        return restored(ModelErrors, self._cached(key, f"third mesh of {case.label}", compute))

    def cached_errors(self, case: Case) -> ModelErrors | None:
        """Errors of a case where the store has them."""
        entry = self.run.store.find(KIND, self._key(case))
        return None if entry is None else restored(ModelErrors, json.loads(entry.file(FILE).read_text()))

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
            return plain(advised_mesh(case.scene, errors, tolerance, grid))

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
        chain = ModelChain(self.run.store, self.run.log, self.run.reporter, force=self.run.request.force)
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


@dataclass(frozen=True)
class Advice:
    """What to change for a tolerance, in the cases with one choice of mesh and modes."""

    labels: tuple[str, ...]  # the cases
    tolerance: float  # relative error allowed
    within: bool  # whether all errors are within it
    # fixed-interface modes that the tolerance needs on this mesh, None where the present ones are enough or the
    # number is not known
    needed_modes: int | None
    advised_dofs: int | None  # degrees of freedom of the mesh that is advised, None where the mesh is good enough
    text: str  # the advice on one line


@dataclass
class Verification:
    """Errors of the reduced models of a scene."""

    measured: list[VerifiedCase] = field(default_factory=list)  # each case with its errors
    advice: list[Advice] = field(default_factory=list)  # what to change for the tolerance
    problems: list[str] = field(default_factory=list)  # what could not be computed, one line each


def verify(request: Request, tolerance: float | None, reporter: Reporter) -> Verification:
    """Measure the reduced models of a scene against full models; `tolerance` overrides `rom.tolerance`."""
    file = request.scene
    remember_code()
    if file.first.blade is None and file.first.mesh_file is None:
        allowed = "a table [blade] (a given reduced model or [model] has no mesh to be measured against)"
        raise input_error(file.path, "blade", "missing", allowed)
    check_scene(file, request.force)
    with (
        working_store(request.out, request.recompute, reporter) as store,
        open_executor(request, store, reporter) as executor,
    ):
        run, outcome = Run(request, store, StageLog(), reporter, executor), RunOutcome()
        models = models_of_blade(run, outcome)
        verification = Verification(problems=outcome.problems)
        verifier = Verifier(run)
        _verify_cases(verifier, distinct_cases(run, models), verification, tolerance)
        _advise(verifier, tolerance, verification)
    return verification


def _verify_cases(
    verifier: Verifier, cases: Sequence[Case], verification: Verification, tolerance: float | None
) -> None:
    """Errors of all cases; the order of convergence is fitted where a mesh error is above the tolerance."""
    found = {}
    for number, case in enumerate(sorted(cases, key=lambda case: case.blade), start=1):  # one blade after the other
        place = f"{number}/{len(cases)} " if len(cases) > 1 else ""
        try:
            errors = verifier.errors(case, place)
            if errors.mesh_frequency > (case.scene.rom.tolerance if tolerance is None else tolerance):
                errors = verifier.with_orders(case, errors)
            found[case.member.index] = case, errors
        except StageError as error:
            if error.is_input and len(cases) == 1:
                raise parameter_error(verifier.run.request.scene.path, case.member, error.cause) from None
            verification.problems.append(f"{case.label}: {error}")
    verification.measured.extend(found[index] for index in sorted(found))


def _advise(verifier: Verifier, tolerance: float | None, verification: Verification) -> None:
    """One advice for every choice of mesh and modes in the sweep."""
    groups: dict[Any, list[VerifiedCase]] = {}
    for case, errors in verification.measured:
        groups.setdefault((case.scene.mesh, case.scene.rom), []).append((case, errors))
    for (_, rom), group in groups.items():
        allowed = rom.tolerance if tolerance is None else tolerance
        found = [each for _, each in group]
        remedies = Remedies()
        try:
            remedies = _remedies(verifier, group, allowed)
        except StageError as error:
            verification.problems.append(str(error))
        labels = tuple(case.label for case, _ in group)
        mesh_file = group[0][0].scene.mesh_file
        text = advice(found, rom, allowed, remedies, None if mesh_file is None else Path(mesh_file).name)
        if len(groups) > 1:
            text = f"{labels[0]}{' ...' if len(labels) > 1 else ''}: {text}"
        dofs = None if remedies.mesh is None else remedies.mesh.dofs
        verification.advice.append(Advice(labels, allowed, within(found, allowed), remedies.modes, dofs, text))


def _remedies(verifier: Verifier, group: Sequence[VerifiedCase], tolerance: float) -> Remedies:
    """What helps where an error of the cases is above the tolerance. Raises StageError."""
    contacts, mesh, no_mesh, modes = None, None, "", None
    stiff = [(case, each) for case, each in group if each.contact_frequency > tolerance]
    if stiff:
        contacts = verifier.contacts(stiff, tolerance)
    case, errors = group[worst_mesh([each for _, each in group])]
    if errors.mesh_frequency > tolerance and errors.other is not None:
        try:
            mesh = verifier.mesh(case, errors, tolerance, errors.contact_grid if contacts is None else contacts.grid)
        except StageError as error:
            no_mesh = str(error)
    lacking = [case for case, each in group if max(each.modes_frequency, each.receptance) > tolerance]
    if lacking and case.scene.rom.modes != "auto":
        modes = verifier.needed(lacking, tolerance)
    return Remedies(contacts, mesh, modes, no_mesh)


def printed(verification: Verification) -> dict[str, Any]:
    """The values that `--json` prints; null: not known."""
    cases = [
        {
            "label": case.label,
            "engine_order": case.scene.excitation.engine_order,
            **errors.printed(),
            "modes_frequency_error": errors.modes_frequency,
            "receptance_error": errors.receptance,
            "contact_frequency_error": errors.contact_frequency,
            "mesh_frequency_error": errors.mesh_frequency,
        }
        for case, errors in verification.measured
    ]
    values: dict[str, Any] = plain({"cases": cases, "advice": verification.advice, "problems": verification.problems})
    return values

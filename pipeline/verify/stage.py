"""`shroud verify`: errors of the reduced models of a scene, and what to change for a tolerance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pipeline.errors import StageError, input_error
from pipeline.process.progress import Reporter
from pipeline.scene.consistency import check_scene, parameter_error
from pipeline.scene.reading import SceneFile
from pipeline.stages.code_fingerprint import remember_code
from pipeline.stages.open_executor import open_executor
from pipeline.stages.request import Request, Run, RunOutcome
from pipeline.stages.stage_log import StageLog
from pipeline.stages.sweep_models import models_of_blade
from pipeline.store.output_folder import working_store
from pipeline.verify.advice import Remedies, advice, within, worst_mesh
from pipeline.verify.cases import Case, VerifiedCase, Verifier, distinct_cases


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


def verify(file: SceneFile, out: Path, tolerance: float | None, force: bool, reporter: Reporter) -> Verification:
    """Measure the reduced models of a scene against full models; `tolerance` goes before `rom.tolerance`."""
    remember_code()
    if file.first.blade is None and file.first.mesh_file is None:
        allowed = "a table [blade] (a given reduced model or [model] has no mesh to be measured against)"
        raise input_error(file.path, "blade", "missing", allowed)
    check_scene(file, force)
    request = Request(file, out, "reduce", force)
    with working_store(out, force, reporter) as store, open_executor(request, store, reporter) as executor:
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


def plain(verification: Verification) -> dict[str, Any]:
    """The values that `--json` prints; null: not known."""
    cases = [
        {
            "label": case.label,
            "engine_order": case.scene.excitation.engine_order,
            **errors.plain(),
            "modes_frequency_error": errors.modes_frequency,
            "receptance_error": errors.receptance,
            "contact_frequency_error": errors.contact_frequency,
            "mesh_frequency_error": errors.mesh_frequency,
        }
        for case, errors in verification.measured
    ]
    given = [vars(each) for each in verification.advice]
    values: dict[str, Any] = _without_nan({"cases": cases, "advice": given, "problems": verification.problems})
    return values


def _without_nan(value: Any) -> Any:
    """JSON has neither NaN nor infinity."""
    if isinstance(value, float):
        return value if abs(value) < float("inf") else None
    if isinstance(value, dict):
        return {key: _without_nan(inner) for key, inner in value.items()}
    return [_without_nan(inner) for inner in value] if isinstance(value, list | tuple) else value

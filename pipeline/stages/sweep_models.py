"""The reduced model of every member of a sweep: built, found in the store, or given; and their summary."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.errors import StageError, reason_of
from pipeline.scene.consistency import parameter_error
from pipeline.scene.reading import Member
from pipeline.scene.schema import Scene
from pipeline.stages.build_reduced_model import REDUCED_MODEL
from pipeline.stages.cache_keys import model_keys
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.coriolis_error import stored_coriolis_error
from pipeline.stages.engine_order_crossings import campbell_entries, crossing_entries
from pipeline.stages.engine_orders import excited_orders
from pipeline.stages.mesh_findings import own_findings
from pipeline.stages.modal_truncation import larger, stored_truncation_error
from pipeline.stages.model_chain import BuiltModel, ModelChain
from pipeline.stages.model_tasks import build_models
from pipeline.stages.natural_frequencies import stored_frequencies
from pipeline.stages.request import Run, RunOutcome
from pipeline.stages.scene_materials import materials_of_file
from pipeline.stages.stage_names import Stage
from pipeline.store.disk_errors import StorageError
from pipeline.store.fingerprints import arrays_fingerprint, fingerprint
from pipeline.store.output_folder import relative_path

if TYPE_CHECKING:
    from rom import ReducedModel

Models = dict[int, BuiltModel | None]  # by index of the member; None: it could not be made, or was not asked for
WRITER = "rom.files.reduced_model_file"


def models_from_file(run: Run, model: ReducedModel) -> Models:
    """A reduced model from elsewhere for every member, written into the output folder beside the results.

    It is written anew and not copied: what else its file may hold stays outside. Its key is the hash of what was
    read, not of the file, which may be another one by now.
    """
    from rom import write_reduced_model

    key = given_model_key(model)
    entry = run.store.get("rom", key, lambda folder: write_reduced_model(folder / REDUCED_MODEL, model))
    dofs = model.size if model.basis is None else model.basis.shape[0]
    facts: dict[str, Any] = {"dofs": dofs, "reduced_dofs": model.size, "n_contacts": model.n_contacts}
    facts |= {"modes": None}
    built = BuiltModel(key, entry.file(REDUCED_MODEL), None, facts)
    return {member.index: built for member in run.request.scene.members}


def given_model_key(model: ReducedModel) -> str:
    """Key of a reduced model from elsewhere."""
    return fingerprint({"model": arrays_fingerprint(vars(model)), "code": code_fingerprint(WRITER)})


def models_of_blade(run: Run, outcome: RunOutcome) -> Models:
    """Mesh, full and reduced model of every member, as far as wanted; failures go to the outcome's problems."""
    chain = ModelChain(run.store, run.log, run.reporter, run.request.expands, build_models(run))
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
    if failures and len(failures) == len(made) and failures[0][1].is_input:
        first, failure = failures[0]
        raise parameter_error(run.request.scene.path, first, failure.cause)
    return result


def model_summaries(run: Run, models: Models, outcome: RunOutcome) -> list[dict[str, Any]]:
    """Entries of `models` in summary.json: one for every reduced model and contact stiffness in the sweep."""
    entries: dict[tuple[str, float, float], dict[str, Any]] = {}
    known: set[tuple[Any, ...]] = set()
    for member in run.request.scene.members:
        model = models[member.index]
        if model is None:
            continue
        try:
            values = stored_frequencies(run.store, model, member.scene)
            coriolis = stored_coriolis_error(run.store, model, member.scene)
            errors = {**stored_truncation_error(run.store, model, member.scene), "coriolis_error": coriolis}
            case = model.key, values["normal_stiffness"], values["tangential_stiffness"]
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
        entry["sliding_hz"][order] = values["sliding_hz"]
        entry["stuck_hz"][order] = values["stuck_hz"]
        entry["crossings"] += crossings
        known.add(excited)
        if values["each_wave"]:
            entry.setdefault("free_at_order_hz", {})[order] = values["free_hz"]
        if "free_names" in values:
            entry.setdefault("free_names", {})[order] = values["free_names"]
    return list(entries.values())


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
        **{name: value for name, value in model.facts.items() if name != "highest_mode_hz"},
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

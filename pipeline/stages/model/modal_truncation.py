"""Errors of a reduced model, cached in the store: modal truncation, and what Coriolis forces change."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.stages.cache_keys import linear_operation_inputs
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.model.build_reduced_model import AUGMENTED_MODEL
from pipeline.stages.scene_to_solver import linear_operation_on_model
from pipeline.store.fingerprints import fingerprint

if TYPE_CHECKING:
    from pipeline.scene.schema import Scene
    from pipeline.stages.model.model_chain import BuiltModel
    from pipeline.store.content_store import Store
    from rom.cyclic.reduced_model import ReducedModel
    from rom.reduction.model_comparison import LinearOperation


CORIOLIS = "coriolis_error.json"


def stored_coriolis_error(store: Store, model: BuiltModel, scene: Scene) -> float | None:
    """Largest relative change of a natural frequency in the range by the Coriolis forces; 0 at rest, None: not known.

    It is not known for a model from elsewhere without its Coriolis matrix.
    """
    if scene.load.speed_rpm == 0.0:
        return 0.0
    key = fingerprint({"reduce": model.key, **linear_operation_inputs(scene), "code": code_fingerprint(__name__)})
    entry = store.get("coriolis-error", key, lambda folder: _write_coriolis(folder / CORIOLIS, model.rom, scene))
    value: float | None = json.loads(entry.file(CORIOLIS).read_text())
    return value


def _write_coriolis(path: Path, rom: Path, scene: Scene) -> None:
    from rom.files.reduced_model_file import read_reduced_model
    from rom.reduction.model_comparison import coriolis_error

    model = read_reduced_model(rom, with_basis=False)
    path.write_text(json.dumps(coriolis_error(model, linear_operation_on_model(scene, model))))


FILE = "modes_error.json"
HELD = "stuck_immobility"  # residue at the first free natural frequency over that at the first stuck one
UNKNOWN: dict[str, float | None] = {
    "modes_error": None,
    "modes_frequency_error": None,
    "receptance_error": None,
    HELD: None,
}


def stored_truncation_error(store: Store, model: BuiltModel, scene: Scene) -> dict[str, float | None]:
    """Largest relative errors: of the natural frequencies in the range, of the receptances over it, of both.

    Beside them how much less the force moves the outputs in the first stuck mode than in the first free one. All
    None where they are not known: for a model from elsewhere, with many contact nodes, and where the frequency range
    goes beyond the modes of the model.
    """
    augmented = model.rom.parent / AUGMENTED_MODEL
    if not augmented.exists():
        return UNKNOWN
    key = fingerprint({"reduce": model.key, **linear_operation_inputs(scene), "code": code_fingerprint(__name__)})
    entry = store.get("modes-error", key, lambda folder: _write(folder / FILE, model, augmented, scene))
    values: dict[str, float | None] = json.loads(entry.file(FILE).read_text())
    return values


def larger(one: dict[str, Any], other: dict[str, float | None]) -> dict[str, float | None]:
    """The larger of the errors of two operations, None where one of them is not known."""
    pairs = {name: (one[name], value) for name, value in other.items()}
    return {name: None if None in pair else max(pair) for name, pair in pairs.items()}


def _immobility(model: ReducedModel, operation: LinearOperation) -> float:
    """The output per force at the first resonance times its frequency squared, free over stuck.

    With equal damping ratios that is the product of the mass-normalised mode at force and output.
    """
    from rom.cyclic.natural_frequencies import natural_frequencies
    from rom.reduction.model_comparison import linear_responses

    conditions = operation.contact_conditions()
    name = list(conditions)[
        -1
    ]  # that holds most: without tangential springs contacts slide, without any they are free
    normal, tangential = conditions[name]
    free = float(natural_frequencies(model, operation.phase, count=1)[0])
    stuck = float(natural_frequencies(model, operation.phase, normal=normal, tangential=tangential, count=1)[0])
    around = replace(operation, frequency_hz=(0.9 * min(free, stuck), 1.1 * max(free, stuck)))
    residues = {}
    for found in linear_responses(model, around):
        row = int(np.argmin(np.abs(found.sample_hz - found.natural_hz[0])))
        residues[found.condition] = float(np.abs(found.output[row]).max()) * float(found.natural_hz[0]) ** 2
    return residues["free"] / max(residues[name], 1e-30)


def _write(path: Path, model: BuiltModel, augmented: Path, scene: Scene) -> None:
    from rom.files.reduced_model_file import read_reduced_model
    from rom.reduction.mode_selection import reduction_errors

    reduced = read_reduced_model(model.rom, with_basis=False)
    operation = linear_operation_on_model(scene, reduced)
    found = reduction_errors(reduced, read_reduced_model(augmented), model.facts["highest_mode_hz"], operation)
    values = UNKNOWN
    if found is not None:
        frequency = max(error.frequency for error in found)
        receptance = max(max(error.contact, error.output) for error in found)
        values = {
            "modes_error": max(frequency, receptance),
            "modes_frequency_error": frequency,
            "receptance_error": receptance,
            HELD: _immobility(reduced, operation),
        }
    path.write_text(json.dumps(values))

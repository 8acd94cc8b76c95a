"""Natural frequencies of a reduced model with its shrouds free, sliding and stuck, cached in the store as JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.engine_orders import COUNT
from pipeline.stages.mode_families_file import read_families
from pipeline.stages.scene_to_solver import contact_on_model
from pipeline.store.fingerprints import fingerprint

if TYPE_CHECKING:
    from pipeline.scene.schema import Scene
    from pipeline.stages.model_chain import BuiltModel
    from pipeline.store.content_store import Store

FILE = "frequencies.json"


def stored_frequencies(
    store: Store, model: BuiltModel, scene: Scene, engine_order: int | None = None
) -> dict[str, Any]:
    """First ten natural frequencies, Hz: `free_hz`, `sliding_hz` (normal springs), `stuck_hz` (all springs).

    Without `engine_order` at that of the scene. `each_wave`: whether `free_hz` depends on the engine order too, with
    a disk; of one made here also `free_names`. `n_blades`: None for a single structure.
    """
    order = scene.excitation.engine_order if engine_order is None else engine_order
    key = fingerprint(
        {
            "reduce": model.key,
            "engine_order": order,
            "normal": scene.contact.normal_stiffness,
            "tangential": scene.contact.tangential_stiffness,
            "material": scene.material.model_dump() if scene.material else None,
            "code": code_fingerprint(__name__),
        }
    )
    entry = store.get("frequencies", key, lambda folder: _write(folder / FILE, model.rom, scene, order))
    values: dict[str, Any] = json.loads(entry.file(FILE).read_text())
    return values


def _write(path: Path, rom: Path, scene: Scene, engine_order: int) -> None:
    from rom import inter_blade_phase, natural_frequencies, read_reduced_model

    model = read_reduced_model(rom, with_basis=False)
    phase = inter_blade_phase(engine_order, model.n_blades)
    contact = contact_on_model(scene, model)
    normal, tangential = contact.normal_stiffness, contact.tangential_stiffness
    count = min(COUNT, model.size)
    states: dict[str, dict[str, Any]] = {
        "free_hz": {},
        "sliding_hz": {"normal": normal},
        "stuck_hz": {"normal": normal, "tangential": tangential},
    }
    values: dict[str, Any] = {
        name: natural_frequencies(model, phase, count=count, **springs).tolist() for name, springs in states.items()
    }
    families = read_families(rom)
    values |= {"each_wave": model.has_disk, "n_blades": model.n_blades}
    if families is not None:
        values["free_names"] = families.modes(model, phase, count=count)[1]
    values |= {"normal_stiffness": float(normal.sum()), "tangential_stiffness": float(tangential.sum())}
    path.write_text(json.dumps(values))

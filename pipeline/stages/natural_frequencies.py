"""Natural frequencies of a reduced model with its shrouds free, sliding and stuck, kept in the store as JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.scene.schema import Scene
from pipeline.stages.curve_file import face_area
from pipeline.stages.model_chain import BuiltModel
from pipeline.stages.scene_to_solver import stiffness_by_node, used_contact
from pipeline.store.content_store import Store
from pipeline.store.fingerprints import fingerprint

if TYPE_CHECKING:
    from rom import ReducedModel

COUNT = 10
FILE = "frequencies.json"


def frequencies(store: Store, model: BuiltModel, scene: Scene, version: str) -> dict[str, Any]:
    """First ten natural frequencies, Hz: `free_hz`, `sliding_hz` (normal springs), `stuck_hz` (all springs)."""
    order = scene.excitation.engine_order
    key = fingerprint(
        {
            "reduce": model.key,
            "engine_order": order,
            "normal": scene.contact.normal_stiffness,
            "tangential": scene.contact.tangential_stiffness,
            "material": scene.material.model_dump() if scene.material else None,
            "code": version,
        }
    )
    entry = store.get("frequencies", key, lambda folder: _write(folder / FILE, model.rom, scene))
    values: dict[str, Any] = json.loads(entry.file(FILE).read_text())
    return values


def _write(path: Path, rom: Path, scene: Scene) -> None:
    from rom import read_reduced_model

    model = read_reduced_model(rom, with_basis=False)
    path.write_text(json.dumps(_solve(model, used_contact(scene, face_area(model)), scene.excitation.engine_order)))


def _solve(model: ReducedModel, contact: Mapping[str, Any], engine_order: int) -> dict[str, Any]:
    from rom import inter_blade_phase, natural_frequencies

    phase = inter_blade_phase(engine_order, model.n_blades)
    normal = stiffness_by_node(contact["normal_stiffness"], model.n_contacts)
    tangential = stiffness_by_node(contact["tangential_stiffness"], model.n_contacts)
    count = min(COUNT, model.size)
    joints: dict[str, dict[str, Any]] = {
        "free_hz": {},
        "sliding_hz": {"normal": normal},
        "stuck_hz": {"normal": normal, "tangential": tangential},
    }
    values: dict[str, Any] = {
        name: natural_frequencies(model, phase, count=count, **springs).tolist() for name, springs in joints.items()
    }
    return values | {
        "normal_stiffness": float(normal.sum()),
        "tangential_stiffness": float(tangential.sum()),
    }

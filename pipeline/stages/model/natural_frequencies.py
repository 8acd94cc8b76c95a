"""Natural frequencies of a reduced model with its shrouds free, sliding and stuck, cached in the store as JSON.

With the engine orders that excite them: the entries of `crossings` and `campbell` in summary.json.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.stages.cache_keys import rotation_of_response, stiffness_inputs
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.engine_orders import COUNT, FEWEST, by_speed, excited_orders
from pipeline.stages.model.model_files import read_families
from pipeline.stages.scene_to_solver import (
    STATES,
    contact_on_model,
    coriolis_acts,
    frequencies_of,
    springs_by_state,
)
from pipeline.store.fingerprints import fingerprint

if TYPE_CHECKING:
    from pipeline.scene.reading import Member
    from pipeline.scene.schema import Scene
    from pipeline.stages.model.model_chain import BuiltModel
    from pipeline.store.content_store import Store
    from rom.cyclic.resonance_crossings import ResonanceCrossing


FILE = "frequencies.json"


def stored_frequencies(
    store: Store, model: BuiltModel, scene: Scene, engine_order: int | None = None
) -> dict[str, Any]:
    """First ten natural frequencies, Hz: `free_hz`, `sliding_hz` (normal springs), `stuck_hz` (all springs), with the
    Coriolis forces where they act in the response.

    Without `engine_order` at that of the scene. `free_names`, `sliding_names`, `stuck_names`: names of the modes, of
    a model with a mesh. `each_wave`: whether `free_hz` depends on the engine order too, with a disk. `n_blades`: None
    for a single structure.
    """
    order = scene.excitation.engine_order if engine_order is None else engine_order
    key = fingerprint(
        {
            "reduce": model.key,
            "engine_order": order,
            **stiffness_inputs(scene),
            "load": rotation_of_response(scene),
            "material": scene.material.model_dump() if scene.material else None,
            "code": code_fingerprint(__name__),
        }
    )
    entry = store.get("frequencies", key, lambda folder: _write(folder / FILE, model.rom, scene, order))
    values: dict[str, Any] = json.loads(entry.file(FILE).read_text())
    return values


def _write(path: Path, rom: Path, scene: Scene, engine_order: int) -> None:
    import numpy as np

    from rom.cyclic.cyclic_symmetry import inter_blade_phase
    from rom.cyclic.natural_frequencies import natural_modes
    from rom.files.reduced_model_file import read_reduced_model

    model = read_reduced_model(rom, with_basis=False)
    phase = inter_blade_phase(engine_order, model.n_blades)
    contact = contact_on_model(scene, model)
    count = min(COUNT, model.size)
    families, found = read_families(rom), frequencies_of(scene, model)
    acts = coriolis_acts(scene, model)
    values: dict[str, Any] = {"each_wave": model.has_disk, "n_blades": model.n_blades, "coriolis": acts}
    for name, springs in springs_by_state(contact).items():
        frequency, modes = natural_modes(model, phase, count=count, **springs)
        values[f"{name}_hz"] = found(model, phase, count=count, **springs).tolist()
        if families is not None:
            values[f"{name}_names"] = families.names(frequency, modes)[0]
    stiffness = {name: getattr(contact, name) for name in ("normal_stiffness", "tangential_stiffness")}
    faces = np.split(np.arange(model.n_contacts), np.cumsum([*model.interfaces.values()])[:-1])
    values["interfaces"] = {
        interface: {"nodes": len(nodes), **{name: float(value[nodes].sum()) for name, value in stiffness.items()}}
        for interface, nodes in zip(model.interfaces, faces, strict=True)
    }
    values |= {name: float(value.sum()) for name, value in stiffness.items()}
    path.write_text(json.dumps(values))


def crossing_entries(store: Store, model: BuiltModel, scene: Scene) -> list[dict[str, Any]]:
    """Crossings of the engine orders of a scene with the first ten modes of their nodal diameters."""
    from rom.cyclic.resonance_crossings import resonance_crossings

    entries = []
    for order, range_hz in excited_orders(scene):
        values = stored_frequencies(store, model, scene, order)
        limits, names = (values["free_hz"], values["stuck_hz"]), values.get("free_names")
        for each in resonance_crossings(order, values["n_blades"], *limits, range_hz, scene.load.speed_rpm):
            entries.append(_entry(each, "" if names is None else names[each.mode - 1]))
    return entries


def campbell_entries(
    store: Store, models: Mapping[int, BuiltModel | None], members: Sequence[Member]
) -> list[dict[str, Any]]:
    """Crossings over the speeds of a sweep, of the first engine order; none with fewer than three speeds."""
    from rom.cyclic.resonance_crossings import speed_crossings

    chosen = by_speed(members)
    built = [(speed, chosen[speed], models[chosen[speed].index]) for speed in sorted(chosen)]
    if len(built) < FEWEST:
        return []
    order = members[0].scene.excitation.engine_order
    found = {
        speed: stored_frequencies(store, model, m.scene, order) for speed, m, model in built if model is not None
    }
    speeds, entries = list(found), []
    for state in STATES:
        for mode, natural in enumerate(zip(*(values[f"{state}_hz"] for values in found.values()), strict=False), 1):
            for speed, frequency in speed_crossings(speeds, natural, order):
                place: dict[str, Any] = {"speed_rpm": speed, "frequency_hz": frequency}
                entries.append({"engine_order": order, "mode": mode, "contact": state, **place})
    return sorted(entries, key=lambda entry: (entry["mode"], entry["frequency_hz"]))


def _entry(crossing: ResonanceCrossing, name: str) -> dict[str, Any]:
    speeds = crossing.speeds_rpm or (None, None)
    return {**vars(crossing), "name": name, "free_rpm": speeds[0], "stuck_rpm": speeds[1]}

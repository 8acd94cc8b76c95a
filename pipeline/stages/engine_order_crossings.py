"""Entries of `crossings` and `campbell` in summary.json: engine orders of the scene at the natural frequencies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pipeline.stages.engine_orders import FEWEST, by_speed, excited_orders
from pipeline.stages.natural_frequencies import stored_frequencies

if TYPE_CHECKING:
    from pipeline.scene.reading import Member
    from pipeline.scene.schema import Scene
    from pipeline.stages.model_chain import BuiltModel
    from pipeline.store.content_store import Store
    from rom import ResonanceCrossing


def crossing_entries(store: Store, model: BuiltModel, scene: Scene) -> list[dict[str, Any]]:
    """Crossings of the engine orders of a scene with the first ten modes of their nodal diameters."""
    from rom import resonance_crossings

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
    from rom import speed_crossings

    chosen = by_speed(members)
    built = [(speed, chosen[speed], models[chosen[speed].index]) for speed in sorted(chosen)]
    if len(built) < FEWEST:
        return []
    order = members[0].scene.excitation.engine_order
    found = {
        speed: stored_frequencies(store, model, m.scene, order) for speed, m, model in built if model is not None
    }
    speeds, entries = list(found), []
    for state in ("free", "sliding", "stuck"):
        for mode, natural in enumerate(zip(*(values[f"{state}_hz"] for values in found.values()), strict=False), 1):
            for speed, frequency in speed_crossings(speeds, natural, order):
                place: dict[str, Any] = {"speed_rpm": speed, "frequency_hz": frequency}
                entries.append({"engine_order": order, "mode": mode, "contact": state, **place})
    return sorted(entries, key=lambda entry: (entry["mode"], entry["frequency_hz"]))


def _entry(crossing: ResonanceCrossing, name: str) -> dict[str, Any]:
    speeds = crossing.speeds_rpm or (None, None)
    return {**vars(crossing), "name": name, "free_rpm": speeds[0], "stuck_rpm": speeds[1]}

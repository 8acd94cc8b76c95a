"""Checks of [crossings] beyond the schema."""

from __future__ import annotations

from collections.abc import Iterator

from pipeline.errors import InputError, input_error, shown, shown_key
from pipeline.scene.reading import SceneFile
from pipeline.scene.schema import Scene
from pipeline.scene.validation_errors import allowed_values
from pipeline.studies.optimum.checks import solver_keys


def unfit_crossings_keys(file: SceneFile, given_model: bool = False) -> Iterator[InputError]:
    """Keys of [crossings] that do not fit each other or the rest of a scene."""
    scene = file.first
    section, excitation = scene.crossings, scene.excitation
    if section is None or excitation is None:  # does not obey the schema
        return
    if not section.speed[0] < section.speed[1]:
        allowed = allowed_values("crossings.speed")
        yield input_error(file.path, "crossings.speed", shown(list(section.speed)), allowed)
    if section.temperature_factor is not None and (given_model or scene.load.temperature is None):
        found, allowed = shown(list(section.temperature_factor)), allowed_values("crossings.temperature_factor")
        yield input_error(file.path, "crossings.temperature_factor", found, allowed)
    if not excitation.forces:
        yield input_error(file.path, "excitation.order", "every force is 0", "a force above 0 of one engine order")
    if 0 in excitation.forces:
        allowed = "1 or more, or tables [[excitation.order]], with [crossings]: order 0 does not follow the speed"
        yield input_error(file.path, "excitation.engine_order", "0", allowed)
    if excitation.harmonic:
        found = f"{len(excitation.harmonic)} with [crossings]"
        allowed = "none: each multiple is an engine order of [[excitation.order]] with its own row"
        yield input_error(file.path, "excitation.harmonic", found, allowed)
    yield from _unfit_scatter(file, scene)


def _unfit_scatter(file: SceneFile, scene: Scene) -> Iterator[InputError]:
    """Limits without distributions, and keys over which no peak can be followed."""
    section, laws, known = scene.crossings, scene.uncertainty, solver_keys(scene)
    assert section is not None
    for name in ("limit", "margin"):
        if (value := getattr(section, name)) is None:
            continue
        if laws is None or (name == "margin" and scene.fatigue is None):
            needed = "[uncertainty]" if laws is None else "[fatigue]"
            yield input_error(file.path, f"crossings.{name}", shown(value), f"nothing without a table {needed}")
    limits = section.limit is not None or section.margin is not None
    asked: list[tuple[str, str, float | None]] = [
        (f"crossings.tolerance.{shown_key(key)}", key, None) for key in section.tolerances
    ]
    if limits and laws is not None:
        asked += [
            (f"uncertainty.parameter[{k}].key", p.key, p.correlation_length) for k, p in enumerate(laws.parameter)
        ]
    for place, key, length in asked:
        damping = isinstance(scene.response.damping_ratio, float) or key != "response.damping_ratio"
        if key not in known or length is not None or not damping:
            found = f"{shown(key)}, along which no peak is followed" + " node by node" * (length is not None)
            yield input_error(file.path, place, found, f"{', '.join(known)}, with [crossings]")
    if asked and scene.response.method != "coupled":
        allowed = '"coupled", with crossings.tolerance, limit and margin'
        yield input_error(file.path, "response.method", shown(scene.response.method), allowed)
    if asked and scene.contact.integration == "sampled":
        allowed = (
            '"exact", with crossings.tolerance, limit and margin: no peak is followed of forces that are sampled'
        )
        yield input_error(file.path, "contact.integration", '"sampled"', allowed)

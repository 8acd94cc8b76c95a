"""Checks of [identify] beyond the schema."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from pipeline.errors import InputError, input_error, shown, shown_key
from pipeline.scene.dotted_keys import flattened_keys
from pipeline.scene.input_files import file_problem
from pipeline.scene.measured_motions import measured_motions
from pipeline.scene.reading import SceneFile, derived_member
from pipeline.scene.schema import Scene
from pipeline.scene.sweep import swept_keys
from pipeline.scene.validation_errors import allowed_values, unknown_key
from pipeline.studies.identify.section import MeasuredMotion
from pipeline.studies.optimum.checks import refused_values, solver_keys, unfit_range

PLACE, CANDIDATES = "identify.over", "identify.candidates"
MOST_VALUES = 20
SOUGHT = "which is sought"


def unfit_identify_keys(file: SceneFile, given_model: bool = False) -> Iterator[InputError]:
    """Keys of [identify] that do not fit the rest of a scene, and measured motions that do not fit the keys."""
    scene = file.first
    section = scene.identify
    if section is None:
        return
    known = solver_keys(scene)
    for key, limits in section.ranges.items():
        if key not in known:
            yield input_error(file.path, f"{PLACE}.{shown_key(key)}", "no parameter of it", ", ".join(known))
        else:
            refused = unfit_range(file, key, limits, PLACE) or refused_values(file, key, limits, PLACE, given_model)
            if refused is not None:
                yield refused
            elif key == "response.damping_ratio" and not isinstance(scene.response.damping_ratio, float):
                allowed = "a scene whose response.damping_ratio is one number"
                yield input_error(file.path, f"{PLACE}.{shown_key(key)}", "no number in the scene", allowed)
    if getattr(scene.response, "method", "coupled") != "coupled":
        yield input_error(file.path, "response.method", shown(scene.response.method), '"coupled", with [identify]')
        return
    yield from _unfit_candidates(file, given_model)
    if section.data is not None and (problem := file_problem(Path(section.data), "a CSV or a universal file")):
        found, _, allowed = problem.partition(", allowed: ")
        yield input_error(
            file.path, "identify.data", f"{section.data}: {found}", allowed or "a CSV or a universal file"
        )
        return
    try:
        motions = measured_motions(scene)
    except InputError as refused:
        yield refused
        return
    yield from _unfit_motions(file, scene, motions, given_model)


def _unfit_candidates(file: SceneFile, given_model: bool) -> Iterator[InputError]:
    """Measurements that could come next, of keys or with values that the scene does not have."""
    section = file.first.identify
    assert section is not None
    for key, values in flattened_keys(section.candidates).items():
        if key not in swept_keys(key):
            yield unknown_key(file.path, key, swept_keys(key), CANDIDATES)
        elif key in section.ranges:
            yield input_error(
                file.path, f"{CANDIDATES}.{shown_key(key)}", SOUGHT, "nothing there, or in identify.over"
            )
        elif not isinstance(values, list | tuple) or not 1 <= len(values) <= MOST_VALUES:
            allowed = f"a list of 1 to {MOST_VALUES} values"
            yield input_error(file.path, f"{CANDIDATES}.{shown_key(key)}", shown(values), allowed)
        else:
            refused = refused_values(file, key, tuple(values), CANDIDATES, given_model)
            if refused is not None:
                yield refused


def _unfit_motions(
    file: SceneFile, scene: Scene, motions: tuple[MeasuredMotion, ...], given_model: bool
) -> Iterator[InputError]:
    section = scene.identify
    assert section is not None
    numbers = sum(1 if motion.curve else 2 for motion in motions)
    if motions and numbers < len(section.ranges):
        found = f"{len(section.ranges)} keys beside {numbers} measured numbers"
        yield input_error(file.path, PLACE, found, "as many keys as measured numbers at most")
    if scene.contact.integration == "sampled" and any(motion.curve is None for motion in motions):
        allowed = '"exact", with a measured peak: no peak is followed of forces that are sampled'
        yield input_error(file.path, "contact.integration", '"sampled"', allowed)
    single = [item.name for item in scene.output if not item.of_model and item.direction != "magnitude"]
    refused = set()
    for number, motion in enumerate(motions):
        place = f"identify.measured, {number + 1} of {len(motions)}"
        low, high = _frequency_range(scene, motion)
        if not low < motion.frequency < high:
            allowed = f"within response.frequency = {[low, high]}"
            yield input_error(file.path, place, f"frequency {motion.frequency:g} Hz", allowed)
        if motion.output is not None and motion.output not in single:
            allowed = ", ".join(single) or allowed_values("run_up.output")
            yield input_error(file.path, place, f"output {shown(motion.output)}", allowed)
        for key, value in motion.conditions.items():
            if (key, repr(value)) in refused:
                continue
            refused.add((key, repr(value)))
            if key in section.ranges:
                yield input_error(file.path, place, f"{key}, {SOUGHT}", "nothing there, or in identify.over")
                continue
            try:
                derived_member(file, {key: value}, "identify.measured", given_model)
            except InputError as error:
                yield error


def _frequency_range(scene: Scene, motion: MeasuredMotion) -> tuple[float, float]:
    """The frequency range of the response that has a motion; any where it is no range, which is refused elsewhere."""
    given = motion.conditions.get("response.frequency", getattr(scene.response, "frequency", None))
    try:
        low, high = map(float, given or ())
    except (TypeError, ValueError):
        return 0.0, float("inf")
    return low, high

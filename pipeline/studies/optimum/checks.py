"""Checks of [optimum] beyond the schema: keys that are numbers of the scene, ranges and tolerances allowed."""

from __future__ import annotations

from collections.abc import Iterator

from pipeline.errors import InputError, input_error, shown, shown_key
from pipeline.scene.contact_section import PER_NODE, FaceField
from pipeline.scene.dotted_keys import CONTACT, of_contact
from pipeline.scene.reading import IGNORED_WITH_MODEL, SceneFile
from pipeline.scene.schema import MEANINGS, Scene
from pipeline.scene.sweep import SWEPT_KEYS, key_value, swept_keys, takes_fractions
from pipeline.scene.validation_errors import unknown_key
from pipeline.studies.optimum.section import BY_STRESS, LIFE, Range

PLACE, TOLERANCE = "optimum.over", "optimum.tolerance"
SOLVER_KEYS = {  # key of a scene -> parameter of the solver, over which peaks are followed
    key: meaning.solver for key, meaning in MEANINGS.items() if meaning.solver
}
KEYS = {name: key for key, name in SOLVER_KEYS.items()}
_DESIGN = ("blade", "shroud", "snubber", "platform", "damper", "material")  # sections whose numbers can be optimised
OPTIMISED_KEYS = (
    *SOLVER_KEYS,
    *(key for key in SWEPT_KEYS if key.partition(".")[0] in _DESIGN and takes_fractions(key)),
    "load.speed_rpm",
)
LEAST_RANGE = 1e-9  # width of a range relative to its ends
LEAST_TOLERANCE = 1e-3  # of the range of its key


def solver_keys(scene: Scene) -> dict[str, str]:
    """The keys that are parameters of the solver, which change all contact nodes alike: not those an interface has
    too, and no fields over the face.
    """
    own = {f"{CONTACT}.{name}" for table in scene.interface.values() for name in table.given}
    own |= {f"{CONTACT}.{name}" for name in PER_NODE if isinstance(getattr(scene.contact, name), FaceField)}
    return {key: name for key, name in SOLVER_KEYS.items() if key not in own}


def unfit_optimum_keys(file: SceneFile, given_model: bool = False) -> Iterator[InputError]:
    """Keys of [optimum] that do not fit the rest of a scene, ranges and tolerances that are not allowed."""
    section = file.first.optimum
    if section is None:
        return
    sound = []
    for key, (low, high) in section.ranges.items():
        error = _unfit_key(file, key, PLACE, given_model) or unfit_range(file, key, (low, high))
        error = error or refused_values(file, key, (low, high), PLACE, given_model)
        if error is None:
            sound.append(key)
        else:
            yield error
    yield from _unfit_objective(file, given_model)
    if section.tolerance == "uncertainty" and file.first.uncertainty is None:
        yield input_error(file.path, TOLERANCE, '"uncertainty"', "a scene with a table [uncertainty]")
    if section.tolerance == "uncertainty" and file.first.uncertainty is not None:
        for number, item in enumerate(file.first.uncertainty.parameter):
            if item.correlation_length is not None:
                place = f"uncertainty.parameter[{number}].correlation_length"
                yield input_error(file.path, place, shown(item.correlation_length), f"nothing with {TOLERANCE}")
    for key, tolerance in section.tolerances.items():
        if key not in section.ranges or key in sound:
            error = _unfit_tolerance(file, key, tolerance, section.ranges.get(key), given_model)
            if error is not None:
                yield error


def _unfit_objective(file: SceneFile, given_model: bool) -> Iterator[InputError]:
    """Objectives that need a mesh, limits of the fatigue or an output that the scene does not have."""
    scene, section = file.first, file.first.optimum
    assert section is not None
    place = "optimum.objective"
    if section.objective in BY_STRESS and (given_model or scene.model is not None):
        yield input_error(file.path, place, f'"{section.objective}" without a mesh', "displacement or harmonic_1")
    elif section.objective == "margin" and scene.fatigue is None:
        yield input_error(file.path, place, '"margin"', "a scene with a table [fatigue]")
    elif section.objective == LIFE and scene.wear is None:
        yield input_error(file.path, place, '"life"', "a scene with a table [wear]")
    if section.life is not None and section.objective != LIFE:
        yield input_error(file.path, "optimum.life", f"{section.life:g}", 'a number with objective = "life"')
    if section.output is None:
        return
    names = [each.name for each in scene.output]
    if section.output not in names:
        allowed = ", ".join(names) or "a scene with an [[output]]"
        yield input_error(file.path, "optimum.output", shown(section.output), allowed)
    elif section.objective != "displacement":
        yield input_error(file.path, place, f'"{section.objective}" of an output', "displacement")


def refused_values(
    file: SceneFile, key: str, values: tuple[float, ...], place: str, given_model: bool
) -> InputError | None:
    """The error of the first of some values of a key that the scene does not allow."""
    from pipeline.scene.reading import derived_member

    for value in values:
        try:
            derived_member(file, {key: value}, place, given_model)
        except InputError as refused:
            return refused
    return None


def _unfit_tolerance(
    file: SceneFile, key: str, tolerance: float, limits: Range | None, given_model: bool
) -> InputError | None:
    """The error of a tolerance of an unknown key, that is too small for its range, or leads to values not allowed."""
    place = f"{TOLERANCE}.{shown_key(key)}"
    error = _unfit_key(file, key, TOLERANCE, given_model)
    if error is not None:
        return error
    own = key_value(file.first, key)
    if limits is None and own is None:
        return input_error(file.path, place, "the scene has no number there", "a number in the scene, or a range")
    low, high = limits or (own or 0.0, own or 0.0)
    least = LEAST_TOLERANCE * (high - low)
    if tolerance < least:
        return input_error(file.path, place, f"{tolerance:g}", f"at least a thousandth of the range, {least:g}")
    if refused_values(file, key, (low - tolerance, high + tolerance), TOLERANCE, given_model) is None:
        return None
    found = f"{low:g} to {high:g} with {tolerance:g} on both sides"
    return input_error(file.path, place, found, "values that the key may have")


def _unfit_key(file: SceneFile, key: str, table: str, given_model: bool) -> InputError | None:
    """The error of a key that is unknown, no number, or not of this scene."""
    place = f"{table}.{shown_key(key)}"
    if of_contact(key) not in OPTIMISED_KEYS:
        if key not in swept_keys(key):
            return unknown_key(file.path, key, OPTIMISED_KEYS, table)
        return input_error(file.path, place, "not a design parameter", ", ".join(OPTIMISED_KEYS))
    section = key.partition(".")[0]
    if given_model and section in IGNORED_WITH_MODEL:
        allowed = "keys of contact, excitation and response"
        return input_error(file.path, place, "has no effect on a given reduced model", allowed)
    if section in _DESIGN and getattr(file.first, section) is None:
        return input_error(file.path, place, f"the scene has no [{section}]", "keys of sections that it has")
    damping, rayleigh = file.first.response.damping_ratio, file.first.response.rayleigh
    if key == "response.damping_ratio" and not isinstance(damping, float):
        found = "rayleigh is given" if rayleigh else "a list mode by mode"
        return input_error(file.path, place, found, "a scene whose response.damping_ratio is one number")
    return None


def unfit_range(file: SceneFile, key: str, limits: Range, table: str = PLACE) -> InputError | None:
    """The error of a range that does not rise, or is too narrow to search."""
    low, high = limits
    if not high - low > LEAST_RANGE * max(abs(low), abs(high)):
        allowed = "two numbers, the second above the first"
        return input_error(file.path, f"{table}.{shown_key(key)}", shown([low, high]), allowed)
    return None

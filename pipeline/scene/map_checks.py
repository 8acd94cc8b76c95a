"""Checks of [map] beyond the schema: keys that can have a range, and values that they can have."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import ValidationError

from pipeline.errors import InputError, input_error, shown
from pipeline.scene.latin_hypercube import takes_fractions
from pipeline.scene.reading import IGNORED_WITH_MODEL, WITHOUT_EFFECT_ON_MODEL, SceneFile
from pipeline.scene.schema import SECTIONS, Scene
from pipeline.scene.swept_keys import SWEPT_KEYS
from pipeline.scene.validation_errors import allowed_values, shown_key, unknown_key

PLACE = "map.over"


def unfit_map_keys(file: SceneFile, given_model: bool = False) -> Iterator[InputError]:
    """Keys of [map] that cannot be mapped, and values that the scene does not allow.

    Parameters
    ----------
    file : SceneFile
        The scene.
    given_model : bool
        Whether it runs on a reduced model from elsewhere.

    Yields
    ------
    InputError
        One for each key.
    """
    section = file.first.map
    for key, values in () if section is None else section.over.items():
        place = f"{PLACE}.{shown_key(key)}"
        if key not in SWEPT_KEYS:
            yield unknown_key(file.path, key, SWEPT_KEYS, PLACE)
        elif not takes_fractions(key):
            yield input_error(file.path, place, "cannot be mapped", "keys of numbers with a fraction")
        elif given_model and (key.partition(".")[0] in IGNORED_WITH_MODEL or key in WITHOUT_EFFECT_ON_MODEL):
            allowed = "keys of load, contact, excitation and response"
            yield input_error(file.path, place, "has no effect on a given reduced model", allowed)
        elif (refused := _refused(file.first, key, values)) is not None:
            yield input_error(file.path, place, shown(refused), allowed_values(key))


def _refused(scene: Scene, key: str, values: tuple[float, ...]) -> float | None:
    """A value that the schema does not allow for a key; None where it allows all. Ranges have no holes."""
    section, _, name = key.partition(".")
    given = getattr(scene, section)
    held = {} if given is None else given.model_dump(exclude_unset=True)
    for value in (values[0], values[-1]):
        try:
            SECTIONS[section].model_validate({**held, name: value})
        except ValidationError as error:
            if any(item["loc"][:1] == (name,) for item in error.errors(include_url=False)):
                return value
    return None

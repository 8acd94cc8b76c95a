"""Validation errors of pydantic as one line in terms of the scene file, with what an unknown key may stand for."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from pipeline.errors import InputError, input_error, one_line, shown, shown_key
from pipeline.scene.aero_section import AeroFamily
from pipeline.scene.contact_section import PER_NODE, FaceField, Interface
from pipeline.scene.dotted_keys import CONTACT
from pipeline.scene.fields import allowed_of
from pipeline.scene.loads_section import TABLES as LOAD_TABLES
from pipeline.scene.loads_section import Temperature
from pipeline.scene.material_section import Material
from pipeline.scene.mesh_section import MeshInterface, MeshSets
from pipeline.scene.model_section import ModelSets
from pipeline.scene.schema import MEANINGS, SECTIONS, Scene
from pipeline.scene.units import number_in_text
from pipeline.studies.uncertainty.section import UncertainParameter
from pipeline.studies.wear.section import DutyPoint

_BY_WORD = {word: key for key, meaning in MEANINGS.items() for word in meaning.words.split()}


MOST_LISTED = 12  # keys in a message; of more only the nearest
_NEAREST = 4


def meant(
    key: str,
    known: Sequence[str],
    section: str = "",
    inside: Collection[str] | None = None,
    tables: Collection[str] = (),
) -> str:
    """The key of a scene that an unknown one may stand for; empty where nothing is near."""
    if inside is not None and not section:
        alike = [name for name, model in SECTIONS.items() if inside and set(inside) <= set(model.model_fields)]
        alike.sort(key=lambda name: name in tables)
        return next(iter([*difflib.get_close_matches(key, list(SECTIONS), n=1, cutoff=0.75), *alike]), "")
    place = f"{section}." if section in SECTIONS else ""
    name = key.rpartition(".")[2]
    word = _BY_WORD.get(name.lower().replace("_", "").replace("-", ""), "")
    near = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
    elsewhere = [f"{table}.{name}" for table, model in SECTIONS.items() if name in model.model_fields]
    elsewhere.sort(key=lambda each: each.partition(".")[0] not in tables)
    if any("." in each for each in known):  # of dotted keys, as in [sweep], only these help
        near = [each for each in [word, *near, *elsewhere] if each in known]
        return near[0] if near else ""
    return word or [*elsewhere, *(place + each for each in near), ""][0]


def listed(known: Sequence[str], key: str, near: str = "") -> str:
    """The keys that there are, for a message about an unknown one; of many only the nearest, or the tables."""
    if len(known) <= MOST_LISTED:
        return ", ".join(known)
    if near and near not in known:
        return near
    closest = difflib.get_close_matches(near or key, known, n=_NEAREST, cutoff=0.6)
    if closest:
        return f"{', '.join(closest)} and others"
    tables = [*dict.fromkeys(each.partition(".")[0] for each in known)]
    if len(tables) == len(known):
        return ", ".join(tables)
    return f"keys of {', '.join(tables[:MOST_LISTED])}{' and others' * (len(tables) > MOST_LISTED)}"


MISSING = object()
SETS: dict[str, type[BaseModel]] = {  # tables in sections
    "mesh.sets": MeshSets,
    "model.sets": ModelSets,
    "load.temperature": Temperature,
}
TABLES: dict[str, type[BaseModel]] = {  # lists of tables
    **LOAD_TABLES,
    "uncertainty.parameter": UncertainParameter,
    "aero.family": AeroFamily,
    "wear.duty": DutyPoint,
}
NAMED: dict[str, type[BaseModel]] = {"materials": Material, "interface": Interface}  # tables of tables by name
NAMED_IN: dict[str, type[BaseModel]] = {"mesh.interface": MeshInterface}  # the same in sections
ALIKE = {"materials": "material", "interface": "contact"}  # sections with the same keys
FIELDS = tuple(f"{CONTACT}.{name}" for name in PER_NODE)  # that may be tables over the face
MOST_ERRORS = 50  # that are listed at once


def allowed_values(key: str) -> str:
    """The allowed values of a dotted key, from its field in `pipeline.scene.schema`."""
    return allowed_of(*_owner(key))


def unknown_key(
    path: Path, key: str, known: Sequence[str], place: str = "", raw: Mapping[str, Any] | None = None
) -> InputError:
    """Error about a key that does not exist, with the one that it may stand for; `raw`: the scene whose key it is."""
    value = None if raw is None else raw.get(key)
    near = meant(key, known, place, list(value) if isinstance(value, Mapping) else None, raw or ())
    hint = f"unknown key, did you mean {near}?" if near else "unknown key"
    dotted = f"{place}.{shown_key(key)}" if place else shown_key(key)
    return input_error(path, dotted, hint, listed(known, key, near))


def scene_error(path: Path, raw: Mapping[str, Any], errors: Sequence[Any], places: Mapping[str, str]) -> InputError:
    """The first of pydantic's `errors` about the raw scene, in terms of the scene file.

    `places` says for each swept dotted key how the line names its value, such as `sweep."contact.friction"[2]`.
    """
    # a misspelt key explains a missing one, so it is the more helpful of the two
    first = min(errors, key=lambda e: e["type"] != "extra_forbidden")
    return _in_terms_of_the_file(path, raw, first, errors, places)


def scene_errors(
    path: Path, raw: Mapping[str, Any], errors: Sequence[Any], places: Mapping[str, str]
) -> list[InputError]:
    """All of pydantic's `errors`, one for each key, `MOST_ERRORS` at most, as `scene_error` says the first."""
    firsts: dict[tuple[Any, ...], Any] = {}
    for error in errors:
        firsts.setdefault(tuple(error["loc"][:2]), error)
    listed = list(firsts.values())[:MOST_ERRORS]
    return [_in_terms_of_the_file(path, raw, error, errors, places) for error in listed]


def _in_terms_of_the_file(
    path: Path, raw: Mapping[str, Any], error: Any, errors: Sequence[Any], places: Mapping[str, str]
) -> InputError:
    location = tuple(part for part in error["loc"])
    said = _said_by_validator(error)
    if not location:
        return input_error(path, "", "keys that do not fit together", said)
    section = str(location[0])
    of_field = _of_field(path, raw, errors, location, places)
    if of_field is not None:
        return of_field
    if section in NAMED and len(location) > 2:
        return _of_named_table(path, raw, errors, location, places)
    if ".".join(map(str, location[:2])) in NAMED_IN and len(location) > 2:
        return _of_table_in_section(path, raw, error, location)
    listed = _of_listed_table(path, raw, error, location)
    if listed is not None:
        return listed
    if error["type"] == "extra_forbidden":
        return _unknown(path, raw, location)
    if section not in SECTIONS:
        return input_error(
            path, section, _found(raw.get(section, MISSING)) + _nearest(error), said or allowed_values(section)
        )
    if len(location) == 1 or not isinstance(raw.get(section), Mapping):
        return input_error(path, section, _found(raw.get(section, MISSING)), said or f"a table [{section}]")
    name = str(location[1])
    key = f"{section}.{name}"
    if key in SETS and len(location) > 2 and isinstance(raw[section][name], Mapping):
        inner = str(location[2])
        value = raw[section][name].get(inner, MISSING)
        return input_error(path, f"{key}.{inner}", _found(value), said or allowed_of(SETS[key], inner))
    value, index = _pick(raw[section].get(name, MISSING), errors, location[:2])
    allowed = said or allowed_values(key)
    if hint := _as_number(key, value, [each for each in errors if each["loc"][:2] == location[:2]]):
        allowed = f"{allowed}; {hint}"
    return input_error(path, places.get(key, key) + index, _found(value), allowed)


def _of_field(
    path: Path, raw: Mapping[str, Any], errors: Sequence[Any], location: tuple[Any, ...], places: Mapping[str, str]
) -> InputError | None:
    """An error in the table of a field over the face, such as contact.friction = { tilt = 1 }; else None."""
    depth = 3 if location[0] in NAMED else 2
    if len(location) < depth:
        return None
    value: Any = raw
    for part in location[:depth]:
        value = value.get(part) if isinstance(value, Mapping) else None
    if not isinstance(value, Mapping) or f"{CONTACT}.{location[depth - 1]}" not in FIELDS:
        return None
    place = places.get(".".join(map(str, location[:depth])), ".".join(shown_key(str(p)) for p in location[:depth]))
    inside = [
        each for each in errors if each["loc"][:depth] == location[:depth] and FaceField.__name__ in each["loc"]
    ]
    if not inside:
        return None
    first = min(inside, key=lambda error: error["type"] != "extra_forbidden")
    inner = str(first["loc"][depth + 1])
    if first["type"] == "extra_forbidden":
        return unknown_key(path, inner, list(FaceField.model_fields), place)
    return input_error(path, f"{place}.{inner}", _found(value.get(inner, MISSING)), allowed_of(FaceField, inner))


def _as_number(key: str, value: Any, errors: Sequence[Any]) -> str:
    """What text or a list may mean as numbers: with a unit, with decimal commas; "" where it means nothing."""
    if isinstance(value, str) and any(error["type"] != "literal_error" for error in errors):
        return number_in_text(key, value)
    count = errors[0].get("ctx", {}).get("max_length")
    if isinstance(value, list) and count and len(value) == 2 * count and all(type(v) is int for v in value[::2]):
        numbers = [f"{whole}.{part}" for whole, part in zip(value[::2], value[1::2], strict=True)]
        return f"with decimal points: [{', '.join(numbers)}]"
    return ""


def _of_named_table(
    path: Path, raw: Mapping[str, Any], errors: Sequence[Any], location: tuple[Any, ...], places: Mapping[str, str]
) -> InputError:
    """An error in a table such as [materials.NAME], said as of [material]."""
    section, name, key = (str(part) for part in location[:3])
    place, kind = f"{section}.{shown_key(name)}", NAMED[section]
    if key not in kind.model_fields:
        return unknown_key(path, key, list(kind.model_fields), place)
    value, index = _pick(raw[section][name].get(key, MISSING), errors, location[:3])
    said = places.get(f"{section}.{name}.{key}", f"{place}.{key}")
    like = f"{ALIKE[section]}.{key}"
    same = [each for each in errors if each["loc"][:3] == location[:3]]
    hint = _as_number(like, value, same)
    return input_error(path, said + index, _found(value), allowed_values(like) + (f"; {hint}" if hint else ""))


def _of_table_in_section(path: Path, raw: Mapping[str, Any], error: Any, location: tuple[Any, ...]) -> InputError:
    """An error in a table such as [mesh.interface.NAME]."""
    section, table, name = (str(part) for part in location[:3])
    place, kind, value = f"{section}.{table}.{shown_key(name)}", NAMED_IN[f"{section}.{table}"], raw[section][table]
    if len(location) == 3 or not isinstance(value[name], Mapping):
        return input_error(path, place, _found(value[name]), f"a table [{place}]")
    key = str(location[3])
    if error["type"] == "extra_forbidden":
        return unknown_key(path, key, list(kind.model_fields), place)
    found = value[name].get(key, MISSING)
    return input_error(path, f"{place}.{key}", _found(found) + _nearest(error), allowed_of(kind, key))


def _of_listed_table(path: Path, raw: Mapping[str, Any], error: Any, location: tuple[Any, ...]) -> InputError | None:
    """An error in a table of a list such as [[load.force]]; None for any other error."""
    depth = next((k for k in (1, 2) if ".".join(map(str, location[:k])) in TABLES), 0)
    if not depth or len(location) < depth + 2 or not isinstance(location[depth], int):
        return None
    name, number, inner = ".".join(map(str, location[:depth])), location[depth], str(location[depth + 1])
    value: Any = raw
    for part in location[: depth + 1]:
        value = value[part]
    place = f"{name}[{number}]"
    if error["type"] == "extra_forbidden":
        return unknown_key(path, inner, list(TABLES[name].model_fields), place)
    found = value.get(inner, MISSING) if isinstance(value, Mapping) else value
    said = _said_by_validator(error)
    shown_value = "not given" if said and found is MISSING else _found(found) + _nearest(error)
    return input_error(path, f"{place}.{inner}", shown_value, said or allowed_of(TABLES[name], inner))


def _said_by_validator(error: Any) -> str:
    """The message of a validator of the schema, without what pydantic puts before it; empty for other errors."""
    cause = error.get("ctx", {}).get("error")
    return one_line(str(cause)) if isinstance(cause, Exception) else ""


def _owner(key: str) -> tuple[type[BaseModel], str]:
    section, _, name = key.rpartition(".")
    return (SECTIONS[section], name) if section else (Scene, name)


def _unknown(path: Path, raw: Mapping[str, Any], location: tuple[Any, ...]) -> InputError:
    if len(location) == 1:
        return unknown_key(path, str(location[0]), [*Scene.model_fields, "sweep"], raw=raw)
    section = str(location[0])
    table = ".".join(str(part) for part in location[:2])
    if table in SETS and len(location) > 2:
        return unknown_key(path, str(location[2]), list(SETS[table].model_fields), table)
    return unknown_key(path, str(location[1]), list(SECTIONS[section].model_fields), section)


def _found(value: Any) -> str:
    return "missing" if value is MISSING else shown(value)


def _nearest(error: Any) -> str:
    """A suggestion where one of a few words was expected and something like it found."""
    if error["type"] != "literal_error" or not isinstance(error["input"], str):
        return ""
    words = [word for word in str(error["ctx"]["expected"]).split("'") if word.isalpha()]
    near = difflib.get_close_matches(error["input"], words, n=1, cutoff=0.5)
    return f", did you mean {near[0]}?" if near else ""


def _pick(value: Any, errors: Sequence[Any], place: tuple[Any, ...]) -> tuple[Any, str]:
    """The element of a list that is wrong, where one element is; otherwise the whole value."""
    if isinstance(value, list):
        for error in errors:
            inner = [part for part in error["loc"][len(place) :] if isinstance(part, int)]
            if error["loc"][: len(place)] == place and inner and inner[0] < len(value):
                return value[inner[0]], f"[{inner[0]}]"
    return value, ""

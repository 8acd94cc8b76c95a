"""Validation errors of pydantic as one line in terms of the scene file, with what an unknown key may stand for."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, get_args, get_origin

from pydantic import BaseModel

from pipeline.errors import InputError, input_error, one_line, shown, shown_key
from pipeline.scene.contact_section import Contact, Interface
from pipeline.scene.dotted_keys import split_key
from pipeline.scene.fields import allowed_of, alternatives, meaning_in
from pipeline.scene.material_section import Material, NamedMaterial
from pipeline.scene.schema import MEANINGS, SECTIONS, Scene
from pipeline.scene.units import number_in_text

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
ALIKE: Mapping[Any, type[BaseModel]] = {NamedMaterial: Material, Interface: Contact}  # tables with the same keys
MOST_ERRORS = 50  # that are listed at once


def allowed_values(key: str) -> str:
    """The allowed values of a dotted key."""
    section, name = split_key(key)
    return allowed_of(SECTIONS[section] if section else Scene, name)


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
    location = error["loc"]
    if not location:
        return input_error(path, "", "keys that do not fit together", _said_by_validator(error))
    first = _place_of(raw, location, places)
    # each type of a union has its errors: those say most that lead furthest into the file
    same = [each for each in errors if each["loc"][: first.certain] == location[: first.certain]]
    found = [(_place_of(raw, each["loc"], places), each) for each in same[:MOST_ERRORS]]
    at, error = max(found, key=lambda item: (not item[0].kinds, item[0].steps))
    if not at.kinds:
        whole = raw if at.table == "" else None
        return unknown_key(path, at.name, [*at.owner.model_fields, *(["sweep"] if whole else [])], at.table, whole)
    allowed = usual = allowed_of(at.owner, at.name)
    if said := _said_by_validator(error):
        allowed = said
    elif all(_is_table(kind) for kind in at.kinds) and not at.key.endswith("]"):
        allowed = f"a table [{at.key}]"
    if hint := _as_number(meaning_in(ALIKE.get(at.owner, at.owner), at.name).unit, at.value, same):
        allowed = f"{allowed}; {hint}"
    if at.value is MISSING:
        return input_error(path, at.key, "missing" if said in ("", usual) else "not given", allowed)
    return input_error(path, at.key, shown(at.value) + _nearest(error), allowed)


@dataclass(frozen=True)
class _Place:
    """Where an error stands in the file, by messages, and whose key it is."""

    key: str
    value: Any  # MISSING: nothing stands there
    table: str  # the table with the key, "" for the scene
    owner: type[BaseModel]  # its class
    name: str  # the key in the table; of an element of a list, that of the list
    kinds: Sequence[Any]  # types that the value may be of; none: the key is unknown
    steps: int  # parts of pydantic's location that lead there; the others name types of unions
    certain: int  # the first of them, before the name of a type


def _place_of(raw: Mapping[str, Any], location: Sequence[Any], places: Mapping[str, str]) -> _Place:
    """The place that a location leads to, down the types of the scene and what stands in the file together."""
    at = _Place("", raw, "", Scene, "", [Scene], 0, len(location))
    dotted = ""
    for number, part in enumerate(location):
        inside = _inside(at, part)
        if inside is None:
            at = replace(at, certain=min(at.certain, number))
            continue
        owner, kinds = inside
        if isinstance(part, int):
            at = replace(at, key=f"{at.key}[{part}]", value=at.value[part], kinds=kinds, steps=at.steps + 1)
            continue
        dotted = f"{dotted}.{part}" if dotted else part
        key = places.get(dotted, f"{at.key}.{shown_key(part)}" if at.key else shown_key(part))
        if owner is not None:
            at = replace(at, table=at.key, owner=owner, name=part)
        at = replace(at, key=key, value=at.value.get(part, MISSING), kinds=kinds, steps=at.steps + 1)
    return at


def _inside(at: _Place, part: str | int) -> tuple[type[BaseModel] | None, Sequence[Any]] | None:
    """The table that has a key, None for a name or number, and the types of its value; None where it names a type."""
    if isinstance(at.value, list) and isinstance(part, int) and part < len(at.value):
        items = [get_args(kind) for kind in at.kinds if get_origin(kind) is tuple]
        return (None, alternatives(items[0][0 if items[0][-1] is Ellipsis else part])) if items else None
    if not isinstance(at.value, Mapping):
        return None
    tables = [kind for kind in at.kinds if _is_table(kind)]
    for table in tables:
        if part in table.model_fields:
            return table, alternatives(table.model_fields[part].annotation)
    if part not in at.value:
        return None
    named = [get_args(kind)[1] for kind in at.kinds if get_origin(kind) is dict]
    return (None, alternatives(named[0])) if named else (tables[0], ()) if tables else None


def _is_table(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _as_number(unit: str, value: Any, errors: Sequence[Any]) -> str:
    """What text or a list may mean as numbers: with a unit, with decimal commas; "" where it means nothing."""
    if isinstance(value, str) and any(error["type"] != "literal_error" for error in errors):
        return number_in_text(unit, value)
    count = errors[0].get("ctx", {}).get("max_length")
    if isinstance(value, list) and count and len(value) == 2 * count and all(type(v) is int for v in value[::2]):
        numbers = [f"{whole}.{part}" for whole, part in zip(value[::2], value[1::2], strict=True)]
        return f"with decimal points: [{', '.join(numbers)}]"
    return ""


def _said_by_validator(error: Any) -> str:
    """The message of a validator of the schema, without what pydantic puts before it; empty for other errors."""
    cause = error.get("ctx", {}).get("error")
    return one_line(str(cause)) if isinstance(cause, Exception) else ""


def _nearest(error: Any) -> str:
    """A suggestion where one of a few words was expected and something like it found."""
    if error["type"] != "literal_error" or not isinstance(error["input"], str):
        return ""
    words = [word for word in str(error["ctx"]["expected"]).split("'") if word.isalpha() and len(word) > 2]
    near = difflib.get_close_matches(error["input"], words, n=1, cutoff=0.5)
    return f", did you mean {near[0]}?" if near else ""

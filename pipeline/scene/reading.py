"""Reading of a scene: TOML or tables given in Python, presets, earlier spellings of values, schema, sweep.

Nothing is run or written.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from pipeline.errors import InputError, input_error, shown
from pipeline.scene.contact_section import Interface
from pipeline.scene.dotted_keys import (
    INTERFACE,
    NAMED_TABLES,
    flattened_keys,
    interface_of,
    split_key,
    table_in,
    with_table,
)
from pipeline.scene.input_files import with_hashes
from pipeline.scene.loads_section import files_of
from pipeline.scene.presets import Accuracy, with_preset
from pipeline.scene.schema import MEANINGS, NOT_SWEPT, SECTIONS, Scene
from pipeline.scene.sweep import GRID, LATIN_HYPERCUBE, POINTS, Sweep, read_sweep
from pipeline.scene.toml_text import load_tables, parsed
from pipeline.scene.validation_errors import scene_error, scene_errors

# dotted key -> earlier spelling -> today's
DEPRECATED_VALUES = {key: meaning.formerly for key, meaning in MEANINGS.items() if meaning.formerly is not None}


def with_current_values(
    path: Path, raw: Mapping[str, Any], sweep: Mapping[str, list[Any]]
) -> tuple[dict[str, Any], dict[str, list[Any]], tuple[str, ...]]:
    """Replace deprecated values in a raw scene and in the lists of its sweep; what a reader should know of values."""
    raw, sweep = dict(raw), dict(sweep)
    notes: dict[str, None] = {}
    for key, spellings in DEPRECATED_VALUES.items():
        section, _, name = key.partition(".")
        table = raw.get(section)
        if isinstance(table, Mapping) and (old := _deprecated(table.get(name), spellings)):
            raw[section] = {**table, name: spellings[old]}
            notes[_note(path, key, old, spellings[old])] = None
        for index, value in enumerate(sweep.get(key, ())):
            if old := _deprecated(value, spellings):
                sweep[key] = [*sweep[key][:index], spellings[old], *sweep[key][index + 1 :]]
                notes[_note(path, f'sweep."{key}"', old, spellings[old])] = None
    return raw, sweep, (*notes, *_unused_values(path, raw, sweep))


def _unused_values(path: Path, raw: Mapping[str, Any], sweep: Mapping[str, list[Any]]) -> Iterator[str]:
    """A line for each swept key with another value in its own section, which no curve has."""
    for key, values in sweep.items():
        place, name = split_key(key)
        table = table_in(raw, place)
        if isinstance(table, Mapping) and name in table and table[name] not in values:
            yield f"{path}: {key} = {shown(table[name])} is not used: [sweep] gives the values"


def _deprecated(value: Any, spellings: Mapping[str, str]) -> str:
    """The value where it is a deprecated spelling, otherwise an empty text."""
    return value if isinstance(value, str) and value in spellings else ""


def _note(path: Path, key: str, old: str, new: str) -> str:
    return f"{path}: {key} = {shown(old)} is now spelled {shown(new)}"


IGNORED_WITH_MODEL = (
    *(
        "blade",
        "shroud",
        "snubber",
        "platform",
        "damper",
        "disk",
        "materials",
        "mesh",
        "model",
        "rom",
        "stress",
        "fatigue",
    ),
    "render",
)
WITHOUT_EFFECT_ON_MODEL = ("excitation.direction", "excitation.at", "load.equilibrium")


@dataclass(frozen=True)
class Member:
    """One point of a sweep.

    Attributes
    ----------
    index : int
        Its number, from 0.
    scene : Scene
        The scene with one value for every key.
    parameters : mapping of str to value
        The swept dotted keys with their values here.
    place : str
        How messages name the table that these values stand in.

    Examples
    --------
    >>> from pipeline import read_scene
    >>> member = read_scene("scenes/dummy.toml").members[1]
    >>> member.index, dict(member.parameters), member.scene.contact.interference
    (1, {'contact.interference': -2e-05}, -2e-05)
    """

    index: int
    scene: Scene
    parameters: Mapping[str, Any]
    place: str = "sweep"

    def key_in_file(self, key: str) -> str:
        """The dotted key as the file spells it: in its section or in the sweep.

        Parameters
        ----------
        key : str
            A dotted key, such as "contact.friction".

        Returns
        -------
        str
            The key, or its place in the sweep: `sweep."contact.friction"`.
        """
        return f'{self.place}."{key}"' if key in self.parameters else key


@dataclass(frozen=True)
class SceneFile:
    """A scene file that obeys the schema.

    Attributes
    ----------
    path : Path
        The file.
    members : tuple of Member
        The points of its sweep; one member where there is no sweep.
    swept : tuple of str
        Dotted keys of the sweep.
    accuracy : Accuracy or None
        What the preset gave to the first member; None where the scene names none.
    notes : tuple of str
        One line for every deprecated spelling of a value, and for every swept key whose own value is not used.
    text : str
        Text of the file as it was read.
    sweep_kind : str
        "grid" (every combination of lists), "points" or "latin_hypercube".
    contents : mapping of str to str
        Hashes of the input files as they were when the scene was read.

    Examples
    --------
    >>> from pipeline import read_scene
    >>> scene = read_scene("scenes/dummy.toml")
    >>> scene.path.name, scene.sweep_kind, scene.first.blade.n_blades
    ('dummy.toml', 'grid', 72)
    """

    path: Path
    members: tuple[Member, ...]
    swept: tuple[str, ...]
    accuracy: Accuracy | None = None
    notes: tuple[str, ...] = ()
    text: str = ""
    sweep_kind: str = GRID
    contents: Mapping[str, str] = field(default_factory=dict)

    @property
    def first(self) -> Scene:
        """The scene of the first member; it names the whole."""
        return self.members[0].scene

    @cached_property
    def _tables(self) -> Mapping[str, Any]:
        """The tables of the text, parsed once for all scenes that are derived from this one."""
        return parsed(self.path, self.text)


def read_scene(path: str | os.PathLike[str], given_model: bool = False) -> SceneFile:
    """Read a scene file and validate it against the schema.

    Parameters
    ----------
    path : str or path
        The file, TOML.
    given_model : bool
        Whether the scene is for a reduced model from elsewhere: the sections that describe a blade are ignored.

    Returns
    -------
    SceneFile
        Every point of its sweep, validated.

    Raises
    ------
    InputError
        The file cannot be read, is not TOML, or a value is missing, unknown or not allowed.

    Examples
    --------
    >>> scene = read_scene("scenes/dummy.toml")
    >>> scene.swept, len(scene.members), scene.first.contact.friction
    (('contact.interference',), 8, 0.4)
    """
    path = Path(path)
    raw, text = load_tables(path)
    return scene_of_tables(path, raw, text, given_model)


def scene_of_tables(
    path: Path,
    raw: Mapping[str, Any],
    text: str = "",
    given_model: bool = False,
    broken: Callable[[int, list[InputError]], None] | None = None,
    swept: Sweep | None = None,
    contents: Mapping[str, str] | None = None,
) -> SceneFile:
    """The scene of the tables of a file, as `read_scene` reads it."""
    raw = dict(raw)
    table = raw.pop("sweep", {})
    sweep = read_sweep(path, table) if swept is None else swept
    unused = _unused_with_model(path, raw) if given_model else ()
    if given_model:
        _refuse_without_effect(path, sweep)
        raw = {key: value for key, value in raw.items() if key not in IGNORED_WITH_MODEL}
    raw, lists, notes = with_current_values(path, raw, sweep.lists)
    sweep = sweep.with_lists(lists)
    members: list[Member] = []
    presets = []
    for index, chosen in enumerate(sweep.combinations()):
        merged, preset = with_preset(_merged(path, raw, chosen), given_model)
        presets.append(preset)
        try:
            scene = Scene.model_validate(merged)
        except ValidationError as error:
            found = error.errors(include_url=False)
            if broken is None:
                raise scene_error(path, merged, found, sweep.places(index)) from None
            broken(index, scene_errors(path, merged, found, sweep.places(index)))
            scene = _valid_sections(merged)
        members.append(Member(index, _with_full_paths(path, scene), chosen, sweep.place(index)))
    file = SceneFile(path, tuple(members), tuple(lists), presets[0], (*unused, *notes), text, sweep.kind)
    return with_contents(file, contents or {})


def with_contents(file: SceneFile, known: Mapping[str, str]) -> SceneFile:
    """The scene with the hashes of its input files: those known, the others as the files are now."""
    contents = dict(known)
    for member in file.members:
        with_hashes(input_files(member.scene), contents)
    members = tuple(replace(member, scene=member.scene.with_contents(contents)) for member in file.members)
    return replace(file, members=members if contents else file.members, contents=contents)


def input_files(scene: Scene) -> list[str]:
    """The files of the sections, of the mesh or of the matrices, and of loads."""
    sections = None if scene.blade is None else scene.blade.sections
    found = [file for file in (sections, scene.mesh_file) if file is not None]
    found += [] if scene.model is None else scene.model.files.values()
    found += files_of(scene.load.force, scene.load.temperature, None if scene.aero is None else scene.aero.family)
    found += [scene.identify.data] if scene.identify is not None and scene.identify.data else []
    return found if scene.excitation is None else found + files_of(scene.excitation.load)  # does not obey the schema


def _valid_sections(merged: Mapping[str, Any]) -> Scene:
    """A scene of the sections that obey the schema; the others have their defaults, or None."""
    valid: dict[str, Any] = {name: None for name, field in Scene.model_fields.items() if field.is_required()}
    for name, model in SECTIONS.items():
        with suppress(ValidationError):
            if name in merged:
                valid[name] = model.model_validate(merged[name])
    with suppress(ValidationError, AttributeError):
        valid[INTERFACE] = {
            name: Interface.model_validate(values) for name, values in merged.get(INTERFACE, {}).items()
        }
    return Scene.model_construct(**valid)


_WITH_FILES = ("load", "force", "temperature", "family", "data")  # tables of sections that may name files


def _with_full_paths(path: Path, scene: Scene) -> Scene:
    """The scene with the full paths of its input files, which are relative to the scene file."""
    if scene.model is not None:
        scene = scene.model_copy(update={"model": scene.model.placed(path.parent)})
    for name in ("load", "excitation", "aero", "identify"):
        section = getattr(scene, name)
        if section is not None and any(getattr(section, given, None) for given in _WITH_FILES):
            scene = scene.model_copy(update={name: section.placed(path.parent)})
    blade, mesh = scene.blade, scene.mesh
    if blade is not None and blade.sections is not None:
        place = os.path.abspath(path.parent / blade.sections)
        scene = scene.model_copy(update={"blade": blade.model_copy(update={"sections": place})})
    if mesh is None or mesh.file is None:
        return scene
    place = os.path.abspath(path.parent / mesh.file)
    return scene.model_copy(update={"mesh": mesh.model_copy(update={"file": place})})


def _unused_with_model(path: Path, raw: Mapping[str, Any]) -> tuple[str, ...]:
    """A line on the sections and keys of a scene that have no effect on a given reduced model."""
    names = [f"[{name}]" for name in IGNORED_WITH_MODEL if name in raw]
    for key in (*WITHOUT_EFFECT_ON_MODEL, "excitation.load", "load.force", "load.pressure", "load.temperature"):
        section, _, name = key.partition(".")
        table = raw.get(section)
        names += [key] if isinstance(table, Mapping) and name in table else []
    if not names:
        return ()
    return (f"{path}: not used, as the reduced model is given and has what it has: {', '.join(names)}",)


def _refuse_without_effect(path: Path, sweep: Sweep) -> None:
    for key in sweep.lists:
        if key.partition(".")[0] in IGNORED_WITH_MODEL or key in WITHOUT_EFFECT_ON_MODEL:
            allowed = "keys of load, contact, excitation and response"
            raise input_error(path, f'{sweep.place(0)}."{key}"', "has no effect on a given reduced model", allowed)


def _merged(path: Path, raw: Mapping[str, Any], chosen: Mapping[str, Any]) -> dict[str, Any]:
    merged = dict(raw)
    for key, value in chosen.items():
        place, name = split_key(key)
        first = merged.get(INTERFACE, {}) if interface_of(key) else {}
        table = table_in(merged, place) if isinstance(first, Mapping) else first
        if not isinstance(table, Mapping | None):
            place = place if isinstance(first, Mapping) else INTERFACE
            raise input_error(path, place, shown(table), f"a table [{place}]")
        merged = with_table(merged, place, {**(table or {}), name: value})
    return merged


def parameter_error(path: Path, member: Member, error: Any) -> InputError:
    """The one line for an exception that carries `table`, `parameter`, `value` and `allowed`, or is such a line."""
    if isinstance(error, InputError):
        return error
    key = f"{error.table}.{error.parameter}"
    known = error.table in SECTIONS and error.parameter in SECTIONS[error.table].model_fields
    found = error.value if error.value in ("missing", "given in part", "unknown name") else shown(error.value)
    return input_error(path, member.key_in_file(key) if known else key.rstrip("."), found, str(error.allowed))


NAMELESS = Path("scene")  # how messages name a scene without a file
_BARE = re.compile(r"[A-Za-z0-9_-]+")


def given_scene(
    scene: SceneFile | Mapping[str, Any] | str | os.PathLike[str],
    overrides: Mapping[str, Any],
    given_model: bool = False,
    more: Mapping[str, Any] | None = None,
) -> SceneFile:
    """A scene as it is given in Python, validated; `overrides` and `more` replace what it says."""
    given = [*overrides.items(), *(more or {}).items()]
    if isinstance(scene, SceneFile) and not given:
        return with_contents(scene, {})  # its files may have been written again
    if isinstance(scene, SceneFile):
        path, tables, text = scene.path, parsed(scene.path, scene.text), scene.text
    elif isinstance(scene, Mapping):
        path, tables, text = NAMELESS, _plain(scene), ""
    else:
        path = Path(scene)
        tables, text = load_tables(path)
    swept = _swept_by(path, given)
    for key, value in sorted(given, key=lambda item: not item[0].startswith("sweep")):
        _replace(path, tables, key, _plain(value), swept)
    if given or not text:
        text = toml_text(tables)
    return scene_of_tables(path, tables, text, given_model)


def _swept_by(path: Path, given: Sequence[tuple[str, Any]]) -> frozenset[str]:
    """Keys that a call sweeps; two values of one key are refused, and one beside a sweep without it."""
    values: dict[str, Any] = {}
    tables: dict[str, Any] = {}
    for key, value in given:
        for name, item in flattened_keys({key: _plain(value)}).items():
            if values.setdefault(name, item) != item:
                raise input_error(
                    path, name, f"given twice, {shown(values[name])} and {shown(item)}", "one of the two"
                )
        if key.partition(".")[0] == "sweep" and value is not None:
            _replace(path, tables, key, _plain(value))
    lists = read_sweep(path, tables.get("sweep", {})).lists
    for key, swept in lists.items():
        if values.get(key) is not None and values[key] not in swept:
            raise input_error(path, key, f"given as {shown(values[key])} beside a sweep of it", "one of the two")
    return frozenset(lists)


def derived_member(file: SceneFile, values: Mapping[str, Any], place: str, given_model: bool = False) -> Member:
    """The first member of a scene with other values of some keys; nothing is swept, no picture asked for."""
    tables = dict(file._tables)
    for name in ("sweep", *NOT_SWEPT):
        tables.pop(name, None)
    chosen = {key: [_plain(value)] for key, value in {**file.members[0].parameters, **values}.items()}
    sweep = Sweep(chosen, POINTS, (place,)) if chosen else Sweep({})
    derived = scene_of_tables(file.path, tables, "", given_model, swept=sweep, contents=file.contents)
    return replace(derived.members[0], parameters=dict(values), place=place)


def _replace(path: Path, tables: dict[str, Any], key: str, value: Any, swept: AbstractSet[str] = frozenset()) -> None:
    """Put a value in the place of a dotted key, the keys of a table, or a key at the top.

    A key that the scene sweeps is swept no longer, unless it is among `swept`.
    """
    table, _, name = key.partition(".")
    if not name and isinstance(value, Mapping) and table in (*SECTIONS, *NAMED_TABLES, "sweep"):
        for inner, item in value.items():
            _replace(path, tables, f"{table}.{inner}", item, swept)
    elif not name:
        _put(tables, table, value)
    elif table in NAMED_TABLES and isinstance(value, Mapping):
        for inner, item in value.items():
            _replace(path, tables, f"{key}.{inner}", item, swept)
    else:
        varied = name if table == "sweep" else key
        if (split_key(varied)[0] in SECTIONS or interface_of(varied)) and (table == "sweep" or key not in swept):
            _sweep_no_longer(path, tables, varied)
        named = table in NAMED_TABLES and "." in name
        places = [table, *split_key(name)] if named else [table, name]
        _put(_inside(path, tables, places[:-1]), places[-1], value)


def _inside(path: Path, tables: dict[str, Any], places: list[str]) -> dict[str, Any]:
    """The table in tables, made where there is none."""
    for count, place in enumerate(places, start=1):
        inside = tables.setdefault(place, {})
        if not isinstance(inside, dict):
            raise input_error(path, table := ".".join(places[:count]), shown(inside), f"a table [{table}]")
        tables = inside
    return tables


def _put(table: dict[str, Any], name: str, value: Any) -> None:
    if value is None:
        table.pop(name, None)
    else:
        table[name] = value


def _sweep_no_longer(path: Path, tables: dict[str, Any], key: str) -> None:
    """Take a key out of [sweep]."""
    sweep = tables.get("sweep")
    if not isinstance(sweep, dict):
        return
    sweep.pop(key, None)
    table, name = split_key(key)
    for inner in (sweep.get(table), table_in(sweep, table)):
        if isinstance(inner, dict):
            inner.pop(name, None)
    kind = next((kind for kind in (POINTS, LATIN_HYPERCUBE) if kind in sweep), "")
    if kind and key in read_sweep(path, sweep).lists:
        raise input_error(path, key, f"swept by sweep.{kind}", "keys that are not swept, or sweep = None too")


def _plain(value: Any) -> Any:
    """Values of NumPy and paths as those that TOML has; a copy of tables and lists."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items() if item is not None}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return os.fspath(value) if isinstance(value, os.PathLike) else value


def toml_text(tables: Mapping[str, Any]) -> str:
    """Tables of a scene as TOML, a line for each key."""
    top = [f"{_key(key)} = {_value(value)}" for key, value in tables.items() if not isinstance(value, Mapping)]
    for name, table in tables.items():
        if isinstance(table, Mapping):
            top += ["", f"[{_key(name)}]", *(f"{_key(key)} = {_value(value)}" for key, value in table.items())]
    return "\n".join(top) + "\n"


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else json.dumps(key, ensure_ascii=False)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return repr(value) if isinstance(value, float) else json.dumps(value, ensure_ascii=False, default=str)

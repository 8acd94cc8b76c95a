"""The JSON schema of a scene, for editors that complete and check TOML."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from pipeline.scene.contact_section import OF_INTERFACE
from pipeline.scene.dotted_keys import INTERFACE
from pipeline.scene.presets import PRESETS, SIZE
from pipeline.scene.reading import DEPRECATED_VALUES
from pipeline.scene.schema import NOT_SWEPT, NOT_SWEPT_KEYS, SECTIONS, Scene
from pipeline.scene.sweep import LARGEST_SWEEP, takes_fractions

DIALECT = "https://json-schema.org/draft/2020-12/schema"
INTERFACE_KEYS = rf"^{INTERFACE}\..+\.({'|'.join(OF_INTERFACE)})$"  # dotted keys, for whatever interfaces a model has
Schemas = Mapping[str, Mapping[str, dict[str, Any]]]  # section -> key -> schema of its value
BY_PRESET = {SIZE, *(key for preset in PRESETS.values() for key in preset.values)}


def scene_schema() -> dict[str, Any]:
    """JSON schema (draft 2020-12) of a scene file, its [sweep] included.

    Every key says what it means and what is allowed. What lies between keys (a range that rises, one of two keys) is
    checked by `shroud validate` only.
    """
    schema = _described(Scene.model_json_schema())
    sections = {name: schema["$defs"][model.__name__] for name, model in SECTIONS.items()}
    for key, spellings in DEPRECATED_VALUES.items():
        section, _, name = key.partition(".")
        _accept_deprecated(sections[section]["properties"][name], spellings)
    schema["properties"]["sweep"] = _sweep(sections)
    schema["allOf"] = [
        _given_or_swept(name, key) for name, section in sections.items() for key in section.pop("required", ())
    ]
    schema["allOf"] += [_one_of_two_meshes(), _one_of_two_airfoils(), _CONTACT_OR_MESH_FILE]
    return {"$schema": DIALECT, **schema, "title": "Scene of shroud"}


def _accept_deprecated(field: dict[str, Any], spellings: Mapping[str, str]) -> None:
    """Let the field be one of today's words, or a deprecated spelling of one."""
    old = {"enum": list(spellings), "deprecated": True}
    field["anyOf"] = [{"enum": field.pop("enum")}, old]
    del field["type"]


def _sweep(sections: dict[str, Any]) -> dict[str, Any]:
    """Schema of [sweep]: lists, points or ranges by dotted keys or in tables such as [sweep.contact]."""
    values = {
        name: {key: value for key, value in section["properties"].items() if f"{name}.{key}" not in NOT_SWEPT_KEYS}
        for name, section in sections.items()
        if name not in NOT_SWEPT
    }
    lists = _by_key(values, lambda value: {"type": "array", "minItems": 1, "items": value})
    point = {"minProperties": 1, **_keys(_by_key(values, dict), {})}
    points = {
        "anyOf": [{"type": "array", "minItems": 1, "items": point}, {"type": "string"}],
        "description": "one curve for each point: a list of tables with the same keys, or a CSV file with a column "
        "for each key",
    }
    return {
        **_keys(
            {**lists, "points": points, "latin_hypercube": _latin_hypercube(values)}, {"type": "array", "minItems": 1}
        ),
        "description": "dotted keys with lists: one curve for every combination; or points; or latin_hypercube",
    }


def _keys(properties: dict[str, Any], of_interface: dict[str, Any]) -> dict[str, Any]:
    """Schema of a table of swept keys, dotted keys of interfaces among them."""
    return {
        "type": "object",
        "properties": properties,
        "patternProperties": {INTERFACE_KEYS: of_interface},
        "additionalProperties": False,
    }


def _by_key(values: Schemas, changed: Callable[[dict[str, Any]], dict[str, Any]]) -> dict[str, Any]:
    """Schemas of the keys of all sections, dotted and in tables of sections, each made from that of its value."""
    tables = {
        name: {key: {"description": value["description"], **changed(value)} for key, value in keys.items()}
        for name, keys in values.items()
    }
    dotted = {f"{name}.{key}": value for name, keys in tables.items() for key, value in keys.items()}
    inner = {
        name: {"type": "object", "properties": keys, "additionalProperties": False} for name, keys in tables.items()
    }
    return dotted | inner


def _latin_hypercube(values: Schemas) -> dict[str, Any]:
    """Schema of [sweep.latin_hypercube]."""
    pair = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
    numbers = {
        name: {key: value for key, value in keys.items() if takes_fractions(f"{name}.{key}")}
        for name, keys in values.items()
    }
    ranges = {"minProperties": 1, **_keys(_by_key(numbers, lambda _: pair), pair)}
    names = [f"{name}.{key}" for name, keys in numbers.items() for key in keys]
    properties = {
        "samples": {"type": "integer", "minimum": 1, "maximum": LARGEST_SWEEP, "description": "number of points"},
        "seed": {"type": "integer", "minimum": 0, "description": "the same seed gives the same points"},
        "ranges": {**ranges, "description": "dotted keys with [low, high]"},
        "logarithmic": {
            "type": "array",
            "items": {"anyOf": [{"enum": names}, {"type": "string", "pattern": INTERFACE_KEYS}]},
            "description": "keys of ranges whose logarithm is sampled",
        },
    }
    return {
        "type": "object",
        "properties": properties,
        "required": ["samples", "seed", "ranges"],
        "additionalProperties": False,
        "description": "points of which each n-th of every range holds exactly one",
    }


def _given_or_swept(section: str, key: str) -> dict[str, Any]:
    """A required key stands in its table, or in [sweep] as a list, or a preset gives it."""
    swept = [
        {"required": [f"{section}.{key}"]},
        {"properties": {section: {"required": [key]}}, "required": [section]},
        {"required": ["points"]},
        {"required": ["latin_hypercube"]},
    ]
    given: dict[str, Any] = {"properties": {section: {"required": [key]}}}
    ways = [given, {"properties": {"sweep": {"anyOf": swept}}, "required": ["sweep"]}]
    if f"{section}.{key}" in BY_PRESET:
        ways.append({"required": ["accuracy"]})
    return {"anyOf": ways}


def _one_of_two_meshes() -> dict[str, Any]:
    """A mesh has an element size, or a file and the number of blades; no mesh has neither."""
    of_file = {"allOf": [_given_or_swept("mesh", "file"), _given_or_swept("mesh", "n_blades")]}
    return {"anyOf": [{"not": {"required": ["mesh"]}}, _given_or_swept("mesh", "size"), of_file]}


def _one_of_two_airfoils() -> dict[str, Any]:
    """An airfoil has a chord and a thickness, or sections."""
    parametric = {"allOf": [_given_or_swept("blade", "chord"), _given_or_swept("blade", "thickness")]}
    sections = {"properties": {"blade": {"required": ["sections"]}}, "required": ["blade"]}
    return {"anyOf": [{"not": {"required": ["blade"]}}, sections, parametric]}


# the mesh of a file may be without contact faces, what is made here has some
_CONTACT_OR_MESH_FILE = {
    "anyOf": [{"required": ["contact"]}, {"properties": {"mesh": {"required": ["file"]}}, "required": ["mesh"]}]
}


def _described(node: Any) -> Any:
    """What is allowed moves into the description, the only text that editors show."""
    if isinstance(node, list):
        return [_described(item) for item in node]
    if not isinstance(node, dict):
        return node
    result = {name: _described(value) for name, value in node.items() if name != "allowed"}
    if isinstance(allowed := node.get("allowed"), str):
        meaning = node.get("description", "")
        result["description"] = f"{meaning}; allowed: {allowed}" if meaning else allowed
    return result

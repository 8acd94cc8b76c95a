"""The JSON schema of a scene, for editors that complete and check TOML."""

from __future__ import annotations

from typing import Any

from pipeline.scene.deprecated_values import DEPRECATED_VALUES
from pipeline.scene.presets import PRESETS, SIZE
from pipeline.scene.schema import NOT_SWEPT, SECTIONS, Scene

DIALECT = "https://json-schema.org/draft/2020-12/schema"
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
    return {"$schema": DIALECT, **schema, "title": "Scene of shroud"}


def _accept_deprecated(field: dict[str, Any], spellings: dict[str, str]) -> None:
    """Let the field be one of today's words, or a deprecated spelling of one."""
    old = {"enum": list(spellings), "deprecated": True}
    field["anyOf"] = [{"enum": field.pop("enum")}, old]
    del field["type"]


def _sweep(sections: dict[str, Any]) -> dict[str, Any]:
    """Schema of [sweep]: lists under dotted keys, or under the keys of [sweep.contact] and so on."""
    lists = {
        name: {
            key: {"type": "array", "minItems": 1, "items": value, "description": value["description"]}
            for key, value in section["properties"].items()
        }
        for name, section in sections.items()
        if name not in NOT_SWEPT
    }
    dotted = {f"{name}.{key}": value for name, keys in lists.items() for key, value in keys.items()}
    tables = {
        name: {"type": "object", "properties": keys, "additionalProperties": False} for name, keys in lists.items()
    }
    return {
        "type": "object",
        "properties": dotted | tables,
        "additionalProperties": False,
        "description": "dotted keys with lists: one curve for every combination",
    }


def _given_or_swept(section: str, key: str) -> dict[str, Any]:
    """A required key stands in its table, or in [sweep] as a list, or a preset gives it."""
    swept = [
        {"required": [f"{section}.{key}"]},
        {"properties": {section: {"required": [key]}}, "required": [section]},
    ]
    given: dict[str, Any] = {"properties": {section: {"required": [key]}}}
    ways = [given, {"properties": {"sweep": {"anyOf": swept}}, "required": ["sweep"]}]
    if f"{section}.{key}" in BY_PRESET:
        ways.append({"required": ["accuracy"]})
    return {"anyOf": ways}


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

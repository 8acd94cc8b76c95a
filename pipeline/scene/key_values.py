"""The value of a dotted key as one number, also where the scene lists it node by node."""

from __future__ import annotations

from typing import Any

from pipeline.scene.schema import Contact, Scene

WHOLE_FACE = ("contact.normal_stiffness", "contact.tangential_stiffness")  # a number is the sum over the nodes
SHIFTED = ("contact.interference",)  # a list is shifted; lists of other keys are multiplied by a factor


def key_value(scene: Scene, key: str, contact: Contact | None = None) -> float | None:
    """The value of a key as one number; None where it has none."""
    section, _, name = key.partition(".")
    table: Any = contact if section == "contact" and contact is not None else getattr(scene, section)
    value = None if table is None else getattr(table, name)
    if isinstance(value, tuple):
        return float(sum(value)) / (1.0 if key in WHOLE_FACE else len(value))
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def as_in_scene(scene: Scene, key: str, value: float) -> Any:
    """A value of `key_value` as the scene gives the key: a number, or a list with the same shape over the nodes."""
    section, _, name = key.partition(".")
    given = getattr(getattr(scene, section), name)
    if not isinstance(given, tuple):
        return value
    now = key_value(scene, key)
    assert now is not None
    if key in SHIFTED or now == 0.0:
        return [item + (value - now) for item in given]
    return [item * (value / now) for item in given]

"""Keys and ranges of the command line, `--over KEY=LOW:HIGH`; a key without a range gets one from the scene."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from pipeline.errors import InputError, input_error, shown
from pipeline.scene.key_values import key_value
from pipeline.scene.optimum_checks import OPTIMISED_KEYS, PLACE, unfit_optimum_keys
from pipeline.scene.optimum_section import MOST_KEYS, Objective, Optimum, Range
from pipeline.scene.reading import SceneFile
from pipeline.scene.suggestions import meant
from pipeline.scene.swept_keys import SWEPT_KEYS

COMMAND, OPTION = "shroud", "--over"
WRITTEN = "KEY=LOW:HIGH with numbers, LOW below HIGH, or KEY"
STATIC = ("contact.interference", "contact.preload")  # their ranges come from linear responses
DECADE = (
    "contact.normal_stiffness",
    "contact.tangential_stiffness",
    "excitation.force",
    "response.damping_ratio",
    "material.young_modulus",
)
FIXED = {"contact.friction": (0.05, 1.0)}
MOST_DAMPING = 0.99
SHARE = 0.2  # of the value, on each side, for all other keys


def asked_ranges(options: Sequence[str]) -> dict[str, Range | None]:
    """The keys of the options with their ranges; None where the range is left to the program."""
    found: dict[str, Range | None] = {}
    for text in options:
        key, given, limits = text.partition("=")
        key = key.strip()
        if key not in OPTIMISED_KEYS:
            raise _error(key, "not a design parameter" if key in SWEPT_KEYS else _unknown(key))
        if key in found:
            raise _error(key, "given twice", "each key once")
        found[key] = _limits(text, limits) if given else None
    if len(found) > MOST_KEYS:
        raise input_error(COMMAND, OPTION, f"{len(found)} keys", f"{MOST_KEYS} at most")
    return found


def check_ranges(file: SceneFile, given_model: bool) -> None:
    """Refuse ranges of the command line that do not fit the scene."""
    for error in unfit_optimum_keys(file, given_model):
        raise _of_command_line(error)


def default_range(file: SceneFile, key: str, now: float | None, static: Range | None) -> Range:
    """The range of a key that was given none."""
    swept = [key_value(member.scene, key) for member in file.members] if key in file.swept else []
    values = [value for value in swept if value is not None]
    if len(set(values)) > 1:
        return min(values), max(values)
    if key in FIXED:
        return FIXED[key]
    if key in STATIC and static is not None:
        return static
    if not now:
        raise _error(key, "no range, and the scene's value tells none", WRITTEN)
    if key in DECADE:
        high = 10.0 * now
        return 0.1 * now, min(high, MOST_DAMPING) if key == "response.damping_ratio" else high
    highest = 180.0 if key == "shroud.angle" else math.inf
    low, high = sorted(((1.0 - SHARE) * now, (1.0 + SHARE) * now))
    return low, min(high, highest)


def with_ranges(file: SceneFile, ranges: dict[str, Range], objective: Objective = "displacement") -> SceneFile:
    """The scene with the section [optimum] over these ranges."""
    optimum = Optimum(over=dict(ranges), objective=objective)
    changed = [replace(m, scene=m.scene.model_copy(update={"optimum": optimum})) for m in file.members]
    return replace(file, members=tuple(changed))


def _limits(text: str, limits: str) -> Range:
    try:
        low, high = (float(part) for part in limits.split(":"))
    except ValueError:
        raise input_error(COMMAND, OPTION, shown(text), WRITTEN) from None
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise input_error(COMMAND, OPTION, shown(text), WRITTEN)
    return low, high


def _unknown(key: str) -> str:
    near = meant(key, OPTIMISED_KEYS, "")
    return f"unknown key, did you mean {near}?" if near else "unknown key"


def _error(key: str, found: str, allowed: str = "") -> InputError:
    return input_error(COMMAND, f"{OPTION} {key}", found, allowed or ", ".join(OPTIMISED_KEYS))


def _of_command_line(error: InputError) -> InputError:
    """An error of [optimum] in the words of the command line."""
    said = str(error).removeprefix(f"{error.source}: ").removeprefix(f"{error.key}: ")
    key = error.key.removeprefix(f"{PLACE}.").strip('"')
    changed = InputError(f"{COMMAND}: {OPTION} {key}: {said}")
    changed.source, changed.key = COMMAND, f"{OPTION} {key}"
    return changed

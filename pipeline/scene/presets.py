"""Accuracy presets: values of mesh, modes, harmonics and tolerances, and the errors measured with them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pipeline.codec import plain

SOURCE = "measured on scenes/dummy.toml by make bench"
SIZE = "mesh.size"
# Checks of motions, which change no peak of a curve: a draft looks at the worst motion only.
UNCHECKED: Mapping[str, Any] = {"response.stability": "folds", "response.search": "off"}
NOT_CHECKED = "only the stability of the highest motion is checked; no time integration"
_DIGITS = 3  # of an element size: what a user would type


@dataclass(frozen=True)
class Expected:
    """Largest relative errors of the default scene, rounded up: of a peak's amplitude and of its frequency."""

    peak_amplitude: float
    peak_frequency: float


@dataclass(frozen=True)
class Preset:
    """Values of a preset."""

    # the element size is the chord divided by this, so that a preset fits blades of any size
    elements_along_chord: float
    values: Mapping[str, Any]  # dotted keys of a scene with their values, besides the element size
    expected: Expected  # errors measured with them


def _values(modes: int, tolerance: float, harmonics: int | str = "auto") -> dict[str, Any]:
    """Numbers of modes are fixed, because an automatic choice makes a reduced model for every engine order.

    To choose the harmonics takes as long as several curves: a draft does without.
    """
    return {
        "mesh.element": "hex20",
        "rom.modes": modes,
        "rom.tolerance": tolerance,
        "response.harmonics": harmonics,
        "response.tolerance": tolerance,
    }


PRESETS: dict[str, Preset] = {
    "draft": Preset(4.5, {**_values(10, 0.05, 5), **UNCHECKED}, Expected(0.05, 0.025)),
    "standard": Preset(9.0, _values(30, 0.005), Expected(0.01, 0.005)),
    "reference": Preset(18.0, _values(40, 0.0005), Expected(0.001, 0.0005)),
}


@dataclass(frozen=True)
class Accuracy:
    """The preset of a scene: its name, the values that it set, and its keys that are overridden or do not apply."""

    name: str
    values: Mapping[str, Any]
    others: tuple[str, ...]

    @property
    def expected(self) -> Expected:
        """Errors that were measured with all values of the preset."""
        return PRESETS[self.name].expected

    def text(self, measured: tuple[float, float] | None = None) -> str:
        """One line: values, expected errors or larger ones that a run measured, and the keys that they do not cover.

        `measured`: relative errors of receptances and of natural frequencies of the scene itself.
        """
        given = ", ".join(
            f"{key} {value:g}" if key == SIZE else f"{key} {value}"
            for key, value in self.values.items()
            if key not in UNCHECKED
        )
        amplitude, frequency = (
            f"{100.0 * e:g} %" for e in (self.expected.peak_amplitude, self.expected.peak_frequency)
        )
        error = f"error of a peak of the default blade {amplitude}, of its frequency {frequency} ({SOURCE})"
        limits = self.expected.peak_amplitude, self.expected.peak_frequency
        if measured is not None and any(found > limit for found, limit in zip(measured, limits, strict=True)):
            receptance, natural = (f"{100.0 * found:.2g} %" for found in measured)
            error = (
                f"modes left out change a receptance of this scene by {receptance}, a frequency by {natural}, "
                f"more than the {amplitude} and {frequency} of the default blade ({SOURCE}): raise rom.modes"
            )
        line = f'accuracy "{self.name}": {given or "nothing"}; {error}'
        if any(key in UNCHECKED for key in self.values):
            line += f"; {NOT_CHECKED}"
        return line + (
            f"; not by the preset, so that the error may be another: {', '.join(self.others)}" * bool(self.others)
        )

    def plain(self) -> dict[str, Any]:
        """The same for summary.json."""
        return {
            "preset": self.name,
            "values": dict(self.values),
            "not_by_preset": list(self.others),
            "expected_error": plain(self.expected),
            "source": SOURCE,
        }


def preset_values(name: str, chord: float | None) -> dict[str, Any]:
    """Dotted keys of a scene with the values of a preset; no element size where the chord, m, is not known."""
    preset = PRESETS[name]
    size = {} if chord is None else {SIZE: float(f"{chord / preset.elements_along_chord:.{_DIGITS}g}")}
    return {**size, **preset.values}


def with_preset(raw: Mapping[str, Any], given_model: bool) -> tuple[dict[str, Any], Accuracy | None]:
    """A raw scene with the values of its preset for the keys that it does not set; unchanged without a preset.

    With `given_model` the values of mesh and reduction do not apply. Errors of the scene are left for the schema.
    """
    name = raw.get("accuracy")
    if not isinstance(name, str) or name not in PRESETS:
        return dict(raw), None
    filled, used, others = dict(raw), {}, []
    for key, value in preset_values(name, _chord(raw)).items():
        section, _, field = key.partition(".")
        table = filled.get(section, {})
        if not isinstance(table, Mapping):
            continue
        without_effect = given_model and section in ("mesh", "rom")
        if section == "mesh" and "mesh" not in raw and _chord(raw) is None:
            continue  # a mesh of nothing: what the scene lacks is the blade
        if section == "mesh" and table.get("file") is not None:
            continue  # the elements of a file are what they are
        if field in table or without_effect or (key == "rom.modes" and "frequency_limit" in table):
            others += [key] * (key not in UNCHECKED)
        else:
            filled[section] = {**table, field: value}
            used[key] = value
    return filled, Accuracy(name, used, tuple(others))


def _chord(raw: Mapping[str, Any]) -> float | None:
    """The chord, m, where the scene has one that can be divided."""
    blade = raw.get("blade")
    chord = blade.get("chord") if isinstance(blade, Mapping) else None
    number = isinstance(chord, int | float) and not isinstance(chord, bool) and 0.0 < chord < float("inf")
    return float(chord) if chord is not None and number else None

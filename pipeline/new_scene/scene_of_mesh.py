"""The text of a scene to start from for a mesh file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pipeline.scene.presets import PRESETS
from pipeline.scene.templates import PRESET, SCENE, SCHEMA

if TYPE_CHECKING:
    from pipeline.new_scene.mesh_survey import Guess

STEEL = {"young_modulus": 210e9, "poisson_ratio": 0.3, "density": 7850.0}
UNITS = {"young_modulus": "Pa", "density": "kg/m^3"}
SOFT = 1e-4  # contact stiffness to start with, over E sqrt(A)
COLUMN = 30


@dataclass(frozen=True)
class StartingValues:
    """Numbers of a scene that are told from the mesh."""

    material: Mapping[str, float] | None = None  # A material of the file in SI units, where it has all numbers
    area: float | None = None  # area of a contact face, m^2
    frequency: tuple[float, float] | None = None  # range around the first natural frequency, Hz
    general: bool = True  # whether elements need [material]
    # by material of the file: numbers that the user has to give
    incomplete: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    modulus: float | None = None  # young's modulus of a material of the file, Pa


def scene_of_mesh(name: str, title: str, file: str, guess: Guess, values: StartingValues) -> str:
    """The scene as TOML."""
    blades = guess.n_blades
    order = 1 if blades is None else blades // 2
    material = {key: (values.material or STEEL)[key] for key in STEEL}
    modulus = material["young_modulus"] if values.modulus is None else values.modulus
    area = 6e-5 if values.area is None else values.area
    normal = float(f"{SOFT * modulus * area**0.5:.2g}")
    low, high = values.frequency or (100.0, 2000.0)
    lines = [
        f"#:schema ./{SCHEMA}",
        "#",
        f"# A scene for the mesh of a sector from another program; run it with `shroud run {SCENE}`.",
        "#",
        *_keys(
            {"name": name, "title": title, "accuracy": PRESET}, {"accuracy": " or ".join(map(json.dumps, PRESETS))}
        ),
        *_mesh_lines(file, guess),
        "",
        *_material_lines(material, values),
        *_named_materials(guess, values),
        "[load]",
        *_keys({"speed_rpm": 0.0}, {"speed_rpm": "rotation; 0 = none"}),
        "",
        "[contact]",
        *_keys(
            {"normal_stiffness": normal, "tangential_stiffness": float(f"{0.75 * normal:.2g}"), "friction": 0.4},
            {"normal_stiffness": 'N/m for the whole face, to be set; or "punch"', "friction": "friction coefficient"},
        ),
        *_keys({"interference": 5e-6}, {"interference": "m; below 0: gap"}),
        "",
        "[excitation]",
        *_keys(
            {"engine_order": order, "force": 1.0, "direction": "y"}, {"force": "N", "direction": "circumferential"}
        ),
        "",
        "[response]",
        *_keys({"frequency": [low, high]}, {"frequency": _frequency_comment(values)}),
        *_keys({"damping_ratio": 0.003}, {"damping_ratio": "of every mode, besides the friction"}),
        "",
        "[render]                      # without this section nothing is rendered",
        "modes = [1, 2, 3]",
    ]
    return "\n".join(lines) + "\n"


def _mesh_lines(file: str, guess: Guess) -> list[str]:
    """[mesh] and [mesh.sets]."""
    blades = guess.n_blades
    return [
        "",
        "[mesh]",
        *_keys({"file": file}, {"file": "relative to this file"}),
        *_keys({"unit": guess.unit}, {"unit": "of the file and its materials"}),
        *(
            []
            if blades is not None
            else ["# n_blades = ...              # of the ring: to be set, the file does not say"]
        ),
        *(_keys({"n_blades": blades}, {"n_blades": "of the ring"}) if blades is not None else []),
        *_keys({"axis": guess.axis}, {"axis": "engine axis in the file"}),
        *(
            _keys({"axis_point": [*guess.axis_point]}, {"axis_point": "a point of it"})
            if any(guess.axis_point)
            else []
        ),
        *_keys({"contact_grid": [3, 3]}, {"contact_grid": "contact nodes on a face, along it and along the radius"}),
        *(
            ['# bore = "free"               # nothing holds the disk: without a root']
            if "cyclic_right" in guess.sets
            else []
        ),
        "",
        "[mesh.sets]                   # node sets or surfaces of the file; what is left out is found by geometry",
        *(f"{role} = {json.dumps(chosen, ensure_ascii=False)}" for role, chosen in guess.sets.items()),
        *(f'# {role} = "..."' for role in ("root", "contact_right", "contact_left", "tip") if role not in guess.sets),
    ]


def _named_materials(guess: Guess, values: StartingValues) -> list[str]:
    """[materials.NAME]: numbers that are in other units in the file, and those that it lacks, to be set."""
    lines = []
    for name in dict.fromkeys([*guess.numbers, *values.incomplete]):
        given, missing = guess.numbers.get(name, {}), values.incomplete.get(name, ())
        table = f"[materials.{name if name.replace('-', '').replace('_', '').isalnum() else json.dumps(name)}]"
        lines += [f"{table.ljust(COLUMN - 1)} # takes precedence over what the file says of it", *_keys(given, UNITS)]
        lines += [
            f"# {key} = ...".ljust(COLUMN - 1) + f" # {UNITS.get(key, '')}: to be set".replace(" : ", " ")
            for key in missing
            if key not in given
        ]
        lines.append("")
    return lines


def _keys(values: Mapping[str, object], comments: Mapping[str, str]) -> list[str]:
    """A line for each key, with its comment; an empty text is left out."""
    lines = []
    for key, value in values.items():
        if value == "":
            continue
        text = f"{key} = {_toml(value)}"
        lines.append(f"{text.ljust(COLUMN - 1)} # {comments[key]}" if key in comments else text)
    return lines


def _toml(value: object) -> str:
    if isinstance(value, float):
        return f"{value:g}" if "e" in f"{value:g}" or "." in f"{value:g}" else f"{value:.1f}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value, ensure_ascii=False)


def _material_lines(material: Mapping[str, float], values: StartingValues) -> list[str]:
    """[material], where a number of it may be needed."""
    if not (values.material or values.general):
        return []
    comment = "# for elements without one; as in the file" if values.material else "# steel: set yours"
    return ["[material]" + " " * 20 + comment, *_keys(material, UNITS), ""]


def _frequency_comment(values: StartingValues) -> str:
    return "Hz, around the first natural frequency" if values.frequency else "Hz, to be set"

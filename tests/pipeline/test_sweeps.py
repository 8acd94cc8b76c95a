"""Sweeps beyond a grid: points listed in the scene or in a CSV file, and Latin hypercubes; units of swept keys."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator
from pipeline_support import ground_scene, shroud, small_scene, summary_of, to_toml, write_ground_model, write_scene

from pipeline.scene.json_schema import scene_schema
from pipeline.scene.labels import quantity
from pipeline.scene.reading import SceneFile, read_scene
from pipeline.scene.schema import SECTIONS, has_role, meaning_of
from pipeline.scene.toml_text import parsed
from pipeline.scene.units import column_name, key_unit, unit_of

HYPERCUBE = """
[sweep.latin_hypercube]
samples = 40
seed = 7
ranges = { "contact.friction" = [0.1, 0.6], "excitation.force" = [1e-3, 1e-1] }
logarithmic = ["excitation.force"]
"""
SNUBBER = {"radius": 0.36, "thickness": 0.004, "width": 0.01}
POINTS = """
[[sweep.points]]
"contact.friction" = 0.3
"contact.interference" = 1e-6
[[sweep.points]]
contact.interference = [0.0, 0.1, 0.2]
contact.friction = 0.4
"""


def write(folder: Path, sweep: str) -> Path:
    path = folder / "s.toml"
    path.write_text(to_toml(ground_scene()) + sweep)
    return path


def read(folder: Path, sweep: str) -> SceneFile:
    return read_scene(write(folder, sweep), given_model=True)


def test_points_of_a_list_are_the_members(tmp_path: Path) -> None:
    file = read(tmp_path, POINTS)
    assert (file.swept, file.sweep_kind) == (("contact.friction", "contact.interference"), "points")
    found = [(m.scene.contact.friction, m.scene.contact.interference) for m in file.members]
    assert found == [(0.3, 1e-6), (0.4, (0.0, 0.1, 0.2))]


def test_points_of_a_file_are_those_of_the_list(tmp_path: Path) -> None:
    lines = ("contact.friction,contact.interference_m", "0.3,1e-6", "", '0.4,"[0.0, 0.1, 0.2]"')
    (tmp_path / "points.csv").write_text("\n".join(lines))
    listed, in_file = read(tmp_path, POINTS), read(tmp_path, '\n[sweep]\npoints = "points.csv"\n')
    assert [dict(m.parameters) for m in in_file.members] == [dict(m.parameters) for m in listed.members]
    assert [m.scene for m in in_file.members] == [m.scene for m in listed.members]


def test_words_in_a_file(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text("contact.law,response.harmonics\ncone, auto\ntwo_sliders,3\n")
    members = read(tmp_path, '\n[sweep]\npoints = "points.csv"\n').members
    assert [(m.scene.contact.law, m.scene.response.harmonics) for m in members] == [
        ("cone", "auto"),
        ("two_sliders", 3),
    ]


def test_every_part_of_a_range_has_one_point_of_a_latin_hypercube(tmp_path: Path) -> None:
    file = read(tmp_path, HYPERCUBE)
    values = np.array([[m.parameters[key] for key in file.swept] for m in file.members])
    assert file.swept == ("contact.friction", "excitation.force")
    for column in ((values[:, 0] - 0.1) / 0.5, (np.log10(values[:, 1]) + 3.0) / 2.0):
        assert sorted(np.floor(column * 40).astype(int)) == list(range(40))
    assert [m.scene.contact.friction for m in file.members] == list(values[:, 0])


def test_a_seed_has_its_points(tmp_path: Path) -> None:
    one, same, other = (
        [dict(m.parameters) for m in read(tmp_path, HYPERCUBE.replace("seed = 7", f"seed = {seed}")).members]
        for seed in (7, 7, 8)
    )
    assert one == same != other


@pytest.mark.parametrize("sweep", [POINTS, HYPERCUBE, '\n[sweep]\npoints = "points.csv"\n'])
def test_editors_know_the_sweeps(tmp_path: Path, sweep: str) -> None:
    path = write(tmp_path, sweep)
    validator = Draft202012Validator(scene_schema())
    assert [error.message for error in validator.iter_errors(parsed(path, path.read_text()))] == []


LISTED, SAMPLED = "[sweep]\npoints = ", "[sweep.latin_hypercube]\n"
RANGE = 'ranges = { "contact.friction" = [0.1, 0.6] }\n'


@pytest.mark.parametrize(
    ("sweep", "expected"),
    [
        (LISTED + "[]", "sweep.points: [], allowed: a list of one or more tables"),
        (LISTED + "3", "sweep.points: 3, allowed: "),
        (LISTED + "[{}]", "sweep.points[0]: {}, allowed: a table of dotted keys"),
        (
            LISTED + '[{"contact.frction" = 1}]',
            'sweep.points[0]."contact.frction": unknown key, did you mean contact.',
        ),
        (
            LISTED + '[{"contact.friction" = 1}, {"contact.preload" = 1}]',
            'sweep.points[1]."contact.friction": missing, allowed: the same keys in every point',
        ),
        (
            LISTED + '[{"contact.friction" = 1}, {"contact.friction" = 1.0}]',
            "sweep.points[1]: the same point as sweep.points[0], allowed: each point once",
        ),
        (
            LISTED + '[{"contact.friction" = 0.1}, {"contact.friction" = -1}]',
            'sweep.points[1]."contact.friction": -1, allowed: a number, 0 to 1e15',
        ),
        (
            LISTED + '[{"contact.friction" = 0.1}]\n"contact.preload" = [1]',
            'sweep.points: given beside "contact.preload", allowed: one of points, latin_hypercube and lists',
        ),
        (LISTED + '[{"response.frequency" = [0.3, 0.1]}]', 'sweep.points[0]."response.frequency": [0.3, 0.1],'),
        (LISTED + '"absent.csv"', 'absent.csv": no such file'),
        (LISTED + '"empty.csv"', 'sweep.points = "empty.csv": empty, allowed: a line of dotted keys'),
        (LISTED + '"head.csv"', 'sweep.points = "head.csv": 0 points, allowed: 1 to 10000 points'),
        (LISTED + '"key.csv"', 'sweep.points (key.csv)."contact.mu": unknown key'),
        (LISTED + '"short.csv"', 'sweep.points = "short.csv line 3": 1 value, allowed: 2, one for each key'),
        (LISTED + '"hole.csv"', 'sweep.points = "hole.csv line 2": no contact.preload, allowed: a value for each'),
        (LISTED + '"same.csv"', "sweep.points (same.csv line 3): the same point as sweep.points (same.csv line 2)"),
        (LISTED + '"wrong.csv"', 'sweep.points (wrong.csv line 2)."contact.friction": -1, allowed: '),
        (SAMPLED + RANGE + "samples = 4", "sweep.latin_hypercube.seed: missing, allowed: a whole number, 0 or more"),
        (SAMPLED + RANGE + "seed = 1", "sweep.latin_hypercube.samples: missing, allowed: a whole number of points"),
        (SAMPLED + RANGE + "seed = 1\nsamples = 0", "sweep.latin_hypercube.samples: 0, allowed: "),
        (SAMPLED + "seed = 1\nsamples = 4", "sweep.latin_hypercube.ranges: missing, allowed: a table of dotted keys"),
        (SAMPLED + "seed = 1\nsamples = 4\nranges = {}", "sweep.latin_hypercube.ranges: {}, allowed: "),
        (SAMPLED + "seed = 1\nsample = 4\n" + RANGE, "sweep.latin_hypercube.sample: unknown key, did you mean "),
        (
            SAMPLED + 'seed = 1\nsamples = 4\nranges = { "contact.friction" = [0.6, 0.1] }',
            'ranges."contact.friction": [0.6, 0.1], allowed: [low, high], two numbers, low below high',
        ),
        (
            SAMPLED + 'seed = 1\nsamples = 4\nranges = { "contact.friction" = [-2.0, -1.0] }',
            'sweep.latin_hypercube.ranges."contact.friction": -1.',
        ),
        (
            SAMPLED + 'seed = 1\nsamples = 4\nranges = { "excitation.engine_order" = [1, 9] }',
            'ranges."excitation.engine_order": cannot have a range, allowed: keys of numbers with a fraction',
        ),
        (
            SAMPLED + 'seed = 1\nsamples = 4\nlogarithmic = ["contact.preload"]\n' + RANGE,
            'sweep.latin_hypercube.logarithmic: "contact.preload" has no range, allowed: ',
        ),
    ],
)
def test_sweeps_that_make_no_sense_are_one_line(tmp_path: Path, sweep: str, expected: str) -> None:
    texts = {
        "empty": "\n",
        "head": "contact.friction\n",
        "key": "contact.mu\n1\n",
        "short": "contact.friction,contact.preload\n0.1,1\n0.2\n",
        "hole": "contact.friction,contact.preload\n0.1,\n",
        "same": "contact.friction\n1\n1.0\n",
        "wrong": "contact.friction\n-1\n",
    }
    for name, text in texts.items():
        (tmp_path / f"{name}.csv").write_text(text)
    scene, rom = write(tmp_path, f"\n{sweep}\n"), write_ground_model(tmp_path / "g.h5")
    status, said, error = shroud("respond", scene, "--rom", rom, "--out", tmp_path / "out")
    assert (status, said, error.count("\n")) == (2, "", 1)
    assert expected in error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        (
            {"sweep": {"contact.friction": [0.1, 0.2]}},
            'sweep."contact.friction": has no effect: interface.shroud.friction is used',
        ),
        ({"sweep": {"contact": {"friction": [0.1, 0.2]}, "shroud": {"angle": [60.0, 70.0]}}}, "has no effect"),
        (
            {"sweep": {"points": [{"contact.friction": 0.1}, {"contact.friction": 0.2}]}},
            "has no effect: interface.sh",
        ),
        ({"optimum": {"over": {"contact.friction": [0.1, 0.2]}}}, 'optimum.over."contact.friction": has no effect'),
        ({"optimum": {"over": {"shroud.angle": [60.0, 70.0]}, "tolerance": {"contact.friction": 0.1}}}, "no effect"),
        ({"map": {"over": {"contact.friction": [0.1, 0.2], "shroud.angle": [60.0, 70.0]}}}, "map.over."),
        (
            {
                "uncertainty": {
                    "parameter": [{"key": "contact.friction", "distribution": "normal", "deviation": 0.01}]
                }
            },
            "uncertainty.parameter[0].key: has no effect: interface.shroud.friction is used",
        ),
        ({"contact__integration": "exact", "sweep": {"contact.samples": [64, 128]}}, "needs no samples"),
        ({"sweep": {"response.tolerance": [0.1, 0.01]}}, "has no effect: response.harmonics = 1"),
        ({"sweep": {"load.coriolis": [True, False]}}, "has no effect: load.speed_rpm = 0"),
        (
            {
                "contact__interfaces": ["snubber"],
                "snubber": SNUBBER,
                "sweep": {"interface.shroud.friction": [0.1, 0.2]},
            },
            'sweep."interface.shroud.friction": has no effect: shroud does not touch',
        ),
    ],
)
def test_what_is_varied_has_an_effect(tmp_path: Path, changes: dict[str, Any], complaint: str) -> None:
    scene = small_scene(interface__shroud={"friction": 0.3}, **changes)
    status, _, error = shroud("validate", write_scene(tmp_path / "s.toml", scene))
    assert (status, error.count("\n")) == (2, 1)
    assert complaint in error


@pytest.mark.parametrize(
    "changes",
    [
        {"sweep": {"contact.friction": [0.1, 0.2]}, "interface__shroud": {"preload": 1.0}},
        {"sweep": {"contact.friction": [0.1, 0.2]}, "interface__shroud": {"friction": 0.3}, "snubber": SNUBBER},
        {"sweep": {"contact.samples": [64, 128], "contact.integration": ["sampled", "exact"]}},
        {"sweep": {"load.coriolis": [True, False], "load.speed_rpm": [0.0, 3000.0]}},
    ],
)
def test_what_some_curves_use_may_be_swept(tmp_path: Path, changes: dict[str, Any]) -> None:
    status, said, error = shroud("validate", write_scene(tmp_path / "s.toml", small_scene(**changes)))
    assert status == 0, error
    assert "valid" in said


def test_a_model_from_elsewhere_tells_what_is_overridden(tmp_path: Path) -> None:
    scene = ground_scene() | {"interface": {"shroud": {"friction": 0.3}}, "sweep": {"contact.friction": [0.1, 0.2]}}
    path, rom = write_scene(tmp_path / "s.toml", scene), write_ground_model(tmp_path / "g.h5")
    status, _, error = shroud("respond", path, "--rom", rom, "--out", tmp_path / "out")
    assert status == 2
    assert "has no effect: interface.shroud.friction is used" in error


@pytest.mark.parametrize("sweep", [POINTS, HYPERCUBE.replace("samples = 40", "samples = 3")])
def test_a_sweep_of_points_runs(tmp_path: Path, sweep: str) -> None:
    scene, rom = write(tmp_path, sweep), write_ground_model(tmp_path / "g.h5")
    status, _, error = shroud("respond", scene, "--rom", rom, "--out", tmp_path / "out", "--quiet")
    assert (status, error) == (0, "")
    curves = summary_of(tmp_path / "out")["curves"]
    given = [dict(m.parameters) for m in read_scene(scene, given_model=True).members]
    assert [curve["parameters"] for curve in curves] == given
    assert (tmp_path / "out" / "figures" / "response.png").is_file()


def test_a_key_of_an_interface_means_what_that_of_contact_means() -> None:
    assert meaning_of("interface.NAME.friction") == meaning_of("contact.friction") != meaning_of("contact.law")
    assert quantity("interface.NAME.interference").axis() == "NAME v0 [µm]"
    roles = {"interface.NAME.preload": "design", "interface.NAME.friction": "condition", "shroud.angle": "design"}
    assert all(has_role(key, "design") == (role == "design") for key, role in roles.items())
    assert not any(has_role("response.harmonics", role) for role in ("design", "condition"))


def units_said(meaning: str) -> set[str]:
    """Units in the description of a key."""
    names = ("kg m^2", "kg/m^3", "m^3/J", "rev/min", "degrees", "N/m", "m^2", "Pa", "kg", "Hz", "m", "N", "h")
    units = "|".join(map(re.escape, names))
    return set(re.findall(rf"(?<![^,;: ])(?:{units})(?![^,;: ])", re.sub(r"\([^)]*\)", "", meaning)))


def test_units_of_keys_are_those_that_their_descriptions_say() -> None:
    for section, model in SECTIONS.items():
        for key, field in model.model_fields.items():
            unit, meaning = key_unit(f"{section}.{key}"), str(field.description)
            if unit or section not in ("response", "render", "figures"):
                assert units_said(meaning) == ({unit} if unit else set()), f"{section}.{key}: {meaning}"


@pytest.mark.parametrize(
    ("key", "name", "unit"),
    [
        ("contact.interference", "contact.interference_m", "m"),
        ("load.speed_rpm", "load.speed_rpm", "rev/min"),
        ("contact.normal_stiffness", "contact.normal_stiffness_n_per_m", "N/m"),
        ("shroud.angle", "shroud.angle_deg", "degrees"),
        ("contact.friction", "contact.friction", ""),
    ],
)
def test_columns_end_with_their_unit(key: str, name: str, unit: str) -> None:
    assert column_name(key) == name
    assert unit_of(name) == unit


def test_a_scene_without_a_sweep_has_one_member(tmp_path: Path) -> None:
    file = read(tmp_path, "")
    parameters: list[dict[str, Any]] = [dict(member.parameters) for member in file.members]
    assert (parameters, file.swept, file.sweep_kind) == ([{}], (), "grid")

"""`shroud validate` lists every error of a scene, each with its line, and says what an unknown key may stand for."""

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pipeline_support import shroud, small_scene, write_scene

from pipeline.scene.schema import MEANINGS, SECTIONS
from pipeline.scene.toml_text import key_lines, plain_key
from pipeline.scene.validation_errors import MOST_ERRORS, MOST_LISTED, allowed_values

SHIPPED = sorted(Path(__file__).parents[2].glob("scenes/*.toml"))


def complaints(path: Path) -> dict[str, tuple[int, str]]:
    """Of each key: the line (0: none) and the rest of its message."""
    status, said, error = shroud("validate", path)
    assert (status, said) == (2, "")
    found = [re.fullmatch(rf"{re.escape(str(path))}(?::(\d+))?: (\S+): (.*)", line) for line in error.splitlines()]
    assert all(found), error
    places = [int(each[1] or 0) for each in found if each]
    assert places == sorted(places), "in the order of the lines"
    return {each[2]: (int(each[1] or 0), each[3]) for each in found if each}


def test_every_error_is_listed_with_the_line_of_its_key(tmp_path: Path) -> None:
    scene = small_scene(
        blade__n_blades=2,
        shroud__angle=190.0,
        contact__mu=0.3,
        contact__friction=None,
        response__harmonics="many",
        excitation__direction=[0, 0, 0],
        material=None,
        sweep={"contact.interferense": [0.0], "contact.preload": [1.0, -1.0]},
    )
    path = write_scene(tmp_path / "scene.toml", scene)
    found = complaints(path)
    assert set(found) == {
        "blade.n_blades",
        "shroud.angle",
        "contact.mu",
        "response.harmonics",
        "excitation.direction",
        "material",
        'sweep."contact.interferense"',
        'sweep."contact.preload"[1]',
    }
    lines = path.read_text().splitlines()
    for key, (number, _) in found.items():
        name = plain_key(key).removeprefix("sweep.")
        shown = name if key.startswith("sweep") else name.rpartition(".")[2]
        assert f'"{shown}" = ' in lines[number - 1] if number else key == "material", key
    assert found["contact.mu"][1].startswith("unknown key, did you mean contact.friction?")


def test_errors_between_keys_are_listed_beside_those_of_the_schema(tmp_path: Path) -> None:
    scene = small_scene(
        contact__friction=-1.0, shroud__contact_length=0.2, response__frequency=[9.0, 3.0], rom__frequency_limit=1e3
    )
    found = complaints(write_scene(tmp_path / "scene.toml", scene))
    expected = {"contact.friction", "shroud.contact_length", "response.frequency", "rom.frequency_limit"}
    assert set(found) == expected


def test_an_error_of_every_member_is_listed_once_and_not_without_end(tmp_path: Path) -> None:
    sweep = {"contact.interference": [1e-6 * k for k in range(100)], "contact.friction": [-1.0, 0.1]}
    found = complaints(write_scene(tmp_path / "a.toml", small_scene(response__harmonics=0, sweep=sweep)))
    assert set(found) == {"response.harmonics", 'sweep."contact.friction"[0]'}
    many = small_scene(sweep={"contact.friction": [-1.0 * k for k in range(1, 200)]})
    assert len(complaints(write_scene(tmp_path / "b.toml", many))) == MOST_ERRORS


def test_other_commands_say_the_first_with_its_line(tmp_path: Path) -> None:
    path = write_scene(tmp_path / "scene.toml", small_scene(contact__friction=-0.1, blade__n_blades=2))
    status, _, error = shroud("run", path, "--out", tmp_path / "out")
    assert (status, error.count("\n")) == (2, 1)
    line = path.read_text().splitlines().index('"n_blades" = 2') + 1
    assert error.startswith(f"{path}:{line}: blade.n_blades: 2, allowed: ")


def test_errors_as_json_are_the_same(tmp_path: Path) -> None:
    path = write_scene(tmp_path / "scene.toml", small_scene(contact__friction=-0.1, blade__n_blades=2))
    status, said, error = shroud("validate", path, "--json")
    assert status == 2
    assert tomllib.loads("errors = " + re.sub(r"\s+", " ", said.split('"errors": ')[1].split("]")[0] + "]"))[
        "errors"
    ] == (error.splitlines())


SYMBOLS = [("contact", "mu"), ("contact", "kn"), ("shroud", "alpha"), ("excitation", "eo"), ("contact", "v0")]
WORDS = [(key.partition(".")[0], word) for key, meaning in MEANINGS.items() for word in meaning.words.split()]


@pytest.mark.parametrize(("section", "word"), [*SYMBOLS, *WORDS, ("contact", "Mu"), ("material", "E")])
def test_symbols_and_other_words_lead_to_the_key(tmp_path: Path, section: str, word: str) -> None:
    (key,) = [key for key, meaning in MEANINGS.items() if word.lower() in meaning.words.split()]
    path = tmp_path / "scene.toml"
    path.write_text(f"[{section}]\n{word} = 1.0\n[sweep]\n{word} = [1.0]\n")
    found = complaints(path)
    assert found[f"{section}.{word}"] == (2, found[f"{section}.{word}"][1])
    for place in (f"{section}.{word}", f"sweep.{word}"):
        assert found[place][1].startswith(f"unknown key, did you mean {key}?"), found[place]


def test_a_symbol_stands_for_one_key() -> None:
    assert len({word for _, word in WORDS}) == len(WORDS)


def test_a_key_of_another_table_is_found_there(tmp_path: Path) -> None:
    path = write_scene(tmp_path / "scene.toml", small_scene(blade__friction=0.3))
    assert "did you mean contact.friction?" in complaints(path)["blade.friction"][1]


def without(*keys: str, **changes: Any) -> dict[str, Any]:
    """The small scene without keys or tables, with changes."""
    scene = small_scene(**changes)
    for key in keys:
        table, _, name = key.rpartition(".")
        del (scene[table] if table else scene)[name]
    return scene


OF_FILE = {"n_blades": 24, "unit": "mm"}


@pytest.mark.parametrize(
    ("scene", "expected"),
    [
        (without("contact"), {"contact": "missing, allowed: a table [contact]"}),
        (
            without("contact", sweep={"contact.friction": [0.3]}),
            {"contact": "missing, allowed: a table [contact] with normal_stiffness, tangential_stiffness"},
        ),
        (without("contact", contacts=small_scene()["contact"]), {"contacts": "unknown key, did you mean contact?"}),
        (without("blade", blades=small_scene()["blade"]), {"blades": "unknown key, did you mean blade?"}),
        (without("shroud", tip=small_scene()["shroud"]), {"tip": "unknown key, did you mean shroud?"}),
        (without("mesh.size", size=0.009), {"size": "unknown key, did you mean mesh.size?, allowed: mesh.size"}),
        (without("blade", "shroud", "material", mesh=OF_FILE), {"mesh.file": "missing, allowed: the name of a"}),
        (
            without("blade", "shroud", "material", mesh={**OF_FILE, "fil": "a.inp"}),
            {"mesh.fil": "unknown key, did you mean mesh.file?"},
        ),
        (
            without("blade", "shroud", "material", mesh={"file": "a.inp", "n_blade": 24}),
            {"mesh.n_blade": "unknown key, did you mean mesh.n_blades?"},
        ),
    ],
)
def test_what_is_missing_is_one_error(tmp_path: Path, scene: dict[str, Any], expected: dict[str, str]) -> None:
    """A misspelt table explains the keys that it holds, a mesh from a file all that describes a blade."""
    found = {key: said for key, (_, said) in complaints(write_scene(tmp_path / "s.toml", scene)).items()}
    assert found.keys() == expected.keys()
    assert all(found[key].startswith(said) for key, said in expected.items()), found


@pytest.mark.parametrize("section", [name for name, model in SECTIONS.items() if len(model.model_fields) > 1])
def test_of_many_keys_a_message_names_the_nearest(tmp_path: Path, section: str) -> None:
    path = tmp_path / "scene.toml"
    for name in SECTIONS[section].model_fields:
        path.write_text(f'[{section}]\n{name}q = 1\n[sweep]\n"{section}.{name}q" = [1]\n')
        for place, (_, said) in complaints(path).items():
            if said.startswith("unknown key"):
                allowed = said.partition("allowed: ")[2].split(", ")
                assert len(allowed) <= MOST_LISTED, (place, said)


def places_of(table: dict[str, Any], text: str, before: str = "") -> set[str]:
    """Dotted names of tables and keys; not of keys inside `{}`, nor of tables that only others within them name."""
    found = set()
    for key, value in table.items():
        if not isinstance(value, dict) or re.search(
            rf"^(\[{re.escape(before + key)}\]|{re.escape(key)} *=)", text, re.M
        ):
            found.add(before + key)
        if isinstance(value, dict) and not re.search(rf"^{re.escape(key)} *= *\{{", text, re.MULTILINE):
            found |= places_of(value, text, f"{before}{key}.")
        if re.search(rf"^\[\[{re.escape(before + key)}\]\]", text, re.MULTILINE):
            found |= {name for each in value for name in places_of(each, text, f"{before}{key}.")}
    return found


@pytest.mark.parametrize("scene", SHIPPED, ids=lambda path: path.stem)
def test_lines_of_a_shipped_scene(scene: Path) -> None:
    text = scene.read_text()
    lines, rows = key_lines(text), text.splitlines()
    assert set(lines) == places_of(tomllib.loads(text), text)
    for key, number in lines.items():
        name = key.rpartition(".")[2]
        assert re.search(rf'[\["]?{re.escape(name)}"?\]? ?(=|\]|$|#)', rows[number - 1].partition("#")[0]), key


VALUES = ["1", '"#"', "'\"'", '"""a = 1\n[b]\n\\""" c"""', "'''[x]\ny = 1'''", "[1, # ]\n 2]", '[["]"],\n\n[1]]']
VALUES += ["{ a = 1, b = [2] }", "[\n]", '"\\""', "1979-05-27", '""', '""""x"""']


@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(
    drawn=st.lists(
        st.tuples(st.sampled_from(VALUES), st.sampled_from(["", " # = [", "\n", "\n# k = {\n"])), max_size=8
    )
)
def test_lines_of_keys_after_values_of_every_kind(drawn: list[tuple[str, str]]) -> None:
    text, expected = "", {}
    for number, (value, after) in enumerate(drawn):
        if number == 3:
            text += '["table"]\n'
            expected["table"] = text.count("\n")
        key = f"key{number}"
        expected[f"table.{key}" if number >= 3 else key] = text.count("\n") + 1
        text += f"{key} = {value}{after}\n"
    tomllib.loads(text)  # it is TOML
    assert key_lines(text) == expected


@pytest.mark.parametrize("section", SECTIONS)
def test_the_words_for_what_is_allowed_have_the_bounds_of_the_schema(section: str) -> None:
    """So that no value within the words is refused, and the JSON schema and the messages say the same."""
    for name, field in SECTIONS[section].model_json_schema()["properties"].items():
        words = allowed_values(f"{section}.{name}")
        numbers = [float(each) for each in re.findall(r"-?\d+(?:\.\d+)?(?:e-?\d+)?", words)]
        bounds = set(_bounds(field))
        for bound in bounds:
            said = bound in numbers or (0.0 < bound <= 1e-9 and "a number above 0, at most" in words)
            assert said, f"{section}.{name}: {bound} not in: {words}"


def _bounds(node: Any) -> list[float]:
    if isinstance(node, list):
        return [bound for each in node for bound in _bounds(each)]
    if not isinstance(node, dict):
        return []
    own = [float(node[key]) for key in ("minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum") if key in node]
    return own + [bound for each in node.values() for bound in _bounds(each)]


@pytest.mark.parametrize(
    "key", ["blade.twist", "blade.root_stagger", "blade.camber", "shroud.edge_angle", "shroud.angle", "mesh.grading"]
)
@pytest.mark.parametrize("end", ["minimum", "maximum"])
def test_the_bounds_of_the_schema_are_those_of_the_geometry(tmp_path: Path, key: str, end: str) -> None:
    """At a bound the geometry may find that parts do not fit, but not that the number itself is out of range."""
    section, _, name = key.partition(".")
    node = SECTIONS[section].model_json_schema()["properties"][name]
    value = node[end] if end in node else next(each[end] for each in node["anyOf"] if end in each)
    _, _, error = shroud("validate", write_scene(tmp_path / "s.toml", small_scene(**{f"{section}__{name}": value})))
    assert f"{key}: " not in error or "must lie within" not in error
    assert f"{key}: " not in error or "must be above" not in error

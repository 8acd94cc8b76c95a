"""Texts that are no TOML: one line with the number of the line, in plain words, whatever is wrong."""

import ast
import inspect
import tomllib
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pipeline_support import RAW_TEXT, shroud, small_scene, to_toml

import pipeline.scene.toml_text
from pipeline.errors import InputError
from pipeline.scene.consistency import check_scene
from pipeline.scene.reading import read_scene

SHIPPED = sorted(Path(__file__).parents[2].glob("scenes/*.toml"))
TWICE = "this key or table is given twice, or as a value and as a table"


@pytest.mark.parametrize(
    ("added", "line", "expected"),
    [
        ("damping_ratio = 0.1", "damping_ratio = 0.1", TWICE),
        ("[blade]", "[blade]", TWICE),
        ("contact.friction = 1", "contact.friction = 1", ""),
        ("a = {b = 1, b = 2}", "a = {b = 1, b = 2}", TWICE),
        ("a = {}\na.b = 1", "a.b = 1", TWICE),
        ("friction", "friction", "a key without = and a value"),
        ("a = 0.1 b = 2", "a = 0.1 b = 2", "more than one key"),
        ("a = .5", "a = .5", "no value that TOML has"),
        ("a = True", "a = True", "no value that TOML has"),
        ("a = 1,5", "a = 1,5", "write 1.5, TOML has decimal points,"),
        ("a = -210,5e9  # Pa", "a = -210,5e9", "write -210.5e9, TOML has decimal points,"),
        ("a = [[0,130, 0,020]]", "a = [[0,130, 0,020]]", "write 0.020, TOML has decimal points,"),
        ("a = 1, 5", "a = 1, 5", "more than one key"),
        ("[sweep", "[sweep", "a table heading without its closing bracket"),
        ("a = [1, 2", "a = [1, 2", "a list without its closing bracket"),
        ('a = "text', 'a = "text', "quotes"),
        ('a = "C:\\blade"', 'a = "C:\\blade"', ""),
        ('a = "C:\\quick"', 'a = "C:\\quick"', "a backslash in text"),
        ("a = 1970-02-30", "a = 1970-02-30", ""),
        ("a = " + "9" * 5000, None, "a number of thousands of digits"),
        (".".join("a" * 51) + " = 1", "a.a.a", "a key of more than 50 parts"),
    ],
)
def test_the_line_and_what_is_wrong_with_it_are_named(
    tmp_path: Path, added: str, line: str | None, expected: str
) -> None:
    path = tmp_path / "s.toml"
    path.write_text(to_toml(small_scene()) + added + "\n")
    status, said, error = shroud("validate", path)
    if added in ("contact.friction = 1", 'a = "C:\\blade"'):  # TOML, but no scene
        assert "unknown key" in error
        return
    assert (status, said, error.count("\n")) == (2, "", 1)
    assert not RAW_TEXT.search(error), error
    assert expected in error
    if line is not None:
        assert error.startswith(f"{path}: line {len(path.read_text().splitlines())} ({line}"), error


def test_the_folder_or_the_name_of_a_scene_leads_to_its_file(tmp_path: Path) -> None:
    """`shroud run mine` after `shroud new mine`, and a name without its ending."""
    for name in ("mine/scene.toml", "a.toml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(to_toml(small_scene()))
    for asked, meant in (
        ("mine", "not a file, did you mean {}/mine/scene.toml?"),
        ("a", "no such file, did you mean {}/a.toml?"),
    ):
        status, _, error = shroud("validate", tmp_path / asked)
        assert (status, meant.format(tmp_path) in error, error.count("\n")) == (2, True, 1)


def test_every_message_of_the_parser_has_its_words() -> None:
    """Of this version of Python: each text that the parser of the standard library raises."""
    tree = ast.parse(inspect.getsource(inspect.getmodule(tomllib.loads)))  # type: ignore[arg-type]
    calls = [n for n in ast.walk(tree) if isinstance(n, ast.Call) and getattr(n.func, "id", "") == "suffixed_err"]
    assert len(calls) > 15
    for call in calls:
        text = call.args[2]
        first = text.values[0] if isinstance(text, ast.JoinedStr) else text
        assert isinstance(first, ast.Constant)
        meanings = pipeline.scene.toml_text._MEANINGS
        assert any(first.value.strip().startswith(start) or start.startswith(first.value) for start in meanings), (
            first.value
        )


PIECES = [*"[]{}='.,#\\\n\r\0-x\u00e9", '"', '"""', "1e999", "nan", "true", "0x1F", "1970-01-01", "[[mesh]]\n"]
PIECES += ["[contact]\n", "[sweep]\n", '"contact.friction" = [1, 2]\n', "contact.friction = [1]\n"]
pieces = st.sampled_from(PIECES)


@settings(max_examples=120, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_no_change_of_a_shipped_scene_shows_a_raw_text(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """Lines left out, doubled and exchanged, and pieces of TOML put anywhere."""
    lines = data.draw(st.sampled_from(SHIPPED)).read_text(encoding="utf-8").splitlines(keepends=True)
    places = st.integers(0, len(lines) - 1)
    for _ in range(data.draw(st.integers(0, 2))):
        first, second = data.draw(places), data.draw(places)
        kind = data.draw(st.sampled_from(["leave out", "double", "exchange"]))
        if kind == "exchange":
            lines[first], lines[second] = lines[second], lines[first]
        else:
            lines[first] = "" if kind == "leave out" else lines[first] + lines[second]
    text = "".join(lines)
    for _ in range(data.draw(st.integers(0, 2))):
        at = data.draw(st.integers(0, len(text)))
        text = text[:at] + data.draw(pieces) + text[at + data.draw(st.integers(0, 3)) :]
    path = tmp_path_factory.mktemp("changed") / "scene.toml"
    path.write_text(text, encoding="utf-8", newline="")
    try:
        check_scene(read_scene(path))
    except InputError as error:
        said = str(error)
        assert said.startswith(f"{path}: ")
        assert said.isprintable()
        assert ", allowed: " in said or "no such file" in said
        assert not RAW_TEXT.search(said), said

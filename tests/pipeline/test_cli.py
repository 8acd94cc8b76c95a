"""The command line: exit status, one-line complaints, failures that do not stop a sweep."""

from pathlib import Path
from typing import Any

import pytest
import typer
from pipeline_support import RAW_TEXT, ground_scene, shroud, small_scene, summary_of, write_ground_model, write_scene

import pipeline.stages.curve.respond
from pipeline.cli import app
from pipeline.command_usage import FLAGS
from pipeline.scene.schema import Scene


@pytest.mark.parametrize(
    "arguments",
    [
        ["frobnicate"],
        ["run"],
        ["run", "a.toml", "--frob"],
        ["run", "a.toml", "--until", "lunch"],
        ["run", "a.toml", "--jobs", "0"],
        ["run", "a.toml", "--jobs", "many"],
        ["run", "a.toml", "--jobs", "257"],
        ["run", "a.toml", "--until", ""],
        ["run", "a\0b"],
        ["info", "a\0b"],
        ["verify", "a.toml", "--tolerance", "nan"],
        ["verify", "a.toml", "--tolerance", "1e-9"],
        ["respond", "a.toml"],
        ["info"],
        ["validate", "a.toml", "b.toml"],
    ],
)
def test_wrong_usage(arguments: list[str]) -> None:
    status, said, error = shroud(*arguments)
    assert (status, said) == (2, "")
    assert error.count("\n") == 1
    assert error.startswith("shroud: ")
    assert not RAW_TEXT.search(error), error
    value = arguments[-1]
    if len(arguments) > 3 or "\0" in value:
        shown = value.replace("\0", " ")
        assert f': "{shown}", allowed: ' in error


@pytest.mark.parametrize("second", [["--out", "b"], ["--out=b"], ["--out", "a"]])
def test_an_option_with_two_values_is_refused(second: list[str]) -> None:
    for name in ("run", "respond", "verify", "report"):
        found = shroud(name, "a.toml", "--out", "a", *second)
        assert found == (2, "", "shroud: --out: given twice, allowed: one value\n")


def test_every_flag_may_be_given_twice() -> None:
    commands = typer.main.get_command(app).commands.values()  # type: ignore[attr-defined]
    flags = {
        name
        for found in commands
        for option in found.params
        if getattr(option, "is_flag", False)
        for name in option.opts
    }
    assert flags <= set(FLAGS)
    assert shroud("validate", "none.toml", "--json", "--json")[0] == 2


@pytest.mark.parametrize("arguments", [[], ["--help"], ["run", "--help"], ["respond", "--help"]])
def test_help(arguments: list[str]) -> None:
    status, said, error = shroud(*arguments)
    assert (status, error) == (0, "")
    assert "Usage: shroud" in said


def test_help_of_every_command_has_examples_and_no_text_that_is_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    assert "..." not in shroud("--help")[1].replace("[ARGS]...", "")
    for name in commands:
        text = shroud(name, "--help")[1]
        assert max(map(len, text.splitlines())) <= 80
        assert "..." not in text
        assert f"\n    shroud {name}" in text or name == "warm-up"


@pytest.mark.parametrize("content", [None, b"not HDF5", b""])
def test_info_on_what_is_no_result(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "x.h5"
    if content is not None:
        path.write_bytes(content)
    status, said, error = shroud("info", path)
    assert (status, said) == (2, "")
    assert error.startswith(f"{path}: ")
    assert error.count("\n") == 1


def test_an_output_folder_that_cannot_be_one(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    scene = write_scene(tmp_path / "s.toml", small_scene())
    for out in (tmp_path / "file", tmp_path / "file" / "below"):
        status, _, error = shroud("run", scene, "--out", out)
        assert status == 2
        assert error.count("\n") == 1
        assert str(out) in error
    assert (tmp_path / "file").read_text() == "in the way"


def test_the_table_and_the_progress_are_for_people(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "s.toml", ground_scene() | {"sweep": {"contact.friction": [0.1, 0.5]}})
    rom = write_ground_model(tmp_path / "g.h5")
    status, said, error = shroud("respond", scene, "--rom", rom, "--out", tmp_path / "out")
    assert status == 0
    assert {"friction", "coefficient"} <= set(said.split())
    rows = [line.split() for line in said.splitlines() if line.lstrip().startswith(("0 ", "1 "))]
    assert [row[:2] for row in rows] == [["0", "0.1"], ["1", "0.5"]]
    assert str(tmp_path / "out") in said
    assert "curves, 2 of 2 done: friction coefficient 0.5: peak " in error
    assert shroud("respond", scene, "--rom", rom, "--out", tmp_path / "out", "--quiet") == (0, "", "")


def test_one_failing_curve_does_not_stop_the_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = pipeline.stages.curve.respond.solve_curve

    def solve(folder: Path, rom: Path, scene: Scene, *more: Any) -> None:
        if scene.contact.friction == 0.2:
            raise ArithmeticError("made to fail")
        real(folder, rom, scene, *more)

    monkeypatch.setattr(pipeline.stages.curve.respond, "solve_curve", solve)
    scene = write_scene(tmp_path / "s.toml", ground_scene() | {"sweep": {"contact.friction": [0.1, 0.2, 0.3]}})
    arguments = ("respond", scene, "--rom", write_ground_model(tmp_path / "g.h5"), "--out", tmp_path / "out")
    status, said, error = shroud(*arguments)
    assert status == 1
    assert "1 of 3 curves not completed: made to fail" in error
    assert "FAILED: made to fail" in said
    curves = summary_of(tmp_path / "out")["curves"]
    assert [curve["complete"] for curve in curves] == [True, False, True]
    assert curves[1]["reason"] == "made to fail"
    assert curves[1]["peak_amplitude_m"] is None
    assert summary_of(tmp_path / "out")["complete"] is False

    monkeypatch.setattr(pipeline.stages.curve.respond, "solve_curve", real)
    assert shroud(*arguments, "--quiet") == (0, "", "")
    assert summary_of(tmp_path / "out")["stages"]["respond"]["ran"] == 1


def test_one_failing_mesh_does_not_stop_the_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import pipeline.stages.model.model_chain

    real = pipeline.stages.model.model_chain.make_mesh

    def mesh(folder: Path, scene: Any) -> None:
        if scene.shroud.angle == 80.0:
            raise RuntimeError("made to fail")
        real(folder, scene)

    monkeypatch.setattr(pipeline.stages.model.model_chain, "make_mesh", mesh)
    scene = write_scene(tmp_path / "s.toml", small_scene(sweep={"shroud.angle": [80.0, 70.0]}))
    status, _, error = shroud("run", scene, "--out", tmp_path / "out", "--quiet")
    assert status == 1
    assert error.splitlines()[0] == "mesh: made to fail"
    assert [curve["complete"] for curve in summary_of(tmp_path / "out")["curves"]] == [False, True]
    assert summary_of(tmp_path / "out")["problems"] == ["mesh: made to fail"]

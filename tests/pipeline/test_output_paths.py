"""Where results are not written: nowhere in particular, at places of others, and below paths that are too long."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from pipeline_support import ground_scene, shroud, small_scene, write_ground_model, write_scene

import pipeline
from pipeline.errors import InputError
from pipeline.python_interface import run_scene

PROGRAM = Path(pipeline.__file__).parent


@pytest.fixture
def given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a model and a scene for it, from which commands run; the home folder is an empty one."""
    (tmp_path / "home").mkdir()
    (tmp_path / "work").mkdir()
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path / "work")
    write_ground_model(tmp_path / "work" / "g.h5")
    write_scene(tmp_path / "work" / "s.toml", ground_scene())
    write_scene(tmp_path / "work" / "small.toml", small_scene())
    return tmp_path / "work"


def tree(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


def others(folder: Path) -> Path:
    """A folder with somebody else's files, some of which have names of results."""
    (folder / "figures").mkdir(parents=True)
    (folder / "figures" / "response.png").write_text("mine")
    (folder / "response.csv").write_text("mine")
    (folder / "summary.json").write_text('{"stages": "of a rocket"}')
    return folder


def link(path: Path, target: str | Path) -> Path:
    path.symlink_to(target)
    return path


PLACES: dict[str, tuple[Callable[[Path], object], str]] = {
    "empty": (lambda here: "", '"" is no path'),
    "blank": (lambda here: "  ", '" " is no path'),
    "root": (lambda here: "/", "is the root of the file system"),
    "root by dots": (lambda here: "../" * 40, "is the root of the file system"),
    "link to the root": (lambda here: link(here / "l", "/"), "is the root of the file system"),
    "home": (lambda here: here.parent / "home", "is the home folder"),
    "home that no shell replaced": (lambda here: "~", 'begins with "~"'),
    "below a home that no shell replaced": (lambda here: "~/out", 'begins with "~"'),
    "the program": (lambda here: PROGRAM / "new-results", "is inside the program"),
    "a long name": (lambda here: "a" * 256, "a name of 256 bytes, allowed: 255 bytes at most"),
    "a long name in bytes": (lambda here: "ü" * 128, "a name of 256 bytes"),
    "a long path": (lambda here: "abcdefghi/" * 410 + "x", "bytes at most"),
}
FOLDERS: dict[str, tuple[Callable[[Path], object], str]] = {
    "current": (lambda here: ".", 'holds "g.h5" and no earlier results'),
    "files of others": (lambda here: others(here / "o"), 'holds "figures" and 2 more and no earlier results'),
    "link to files of others": (lambda here: link(here / "l", others(here / "o")), 'holds "figures" and 2 more'),
    "a system folder": (lambda here: "/usr", "no earlier results"),
    "a file": (lambda here: here / "g.h5", "cannot be written"),
}


@pytest.mark.parametrize("place", [*PLACES, *FOLDERS])
def test_results_are_not_written_where_nobody_meant(given: Path, place: str) -> None:
    make, expected = (PLACES | FOLDERS)[place]
    out = make(given)
    before = tree(given.parent)
    status, said, error = shroud("respond", "s.toml", "--rom", "g.h5", "--out", out)
    assert (status, said, error.count("\n")) == (2, "", 1), error
    assert error.startswith("--out: ")
    assert expected in error
    assert ", allowed: " in error
    with pytest.raises(InputError):
        run_scene("s.toml", str(out), rom="g.h5")
    assert tree(given.parent) == before
    assert not (PROGRAM / "new-results").exists()


@pytest.mark.parametrize("command", ["run", "report", "verify"])
@pytest.mark.parametrize("out", ["", "/", "."])
def test_other_commands_do_not_either(given: Path, command: str, out: str) -> None:
    before = tree(given.parent)
    for arguments in (("--out", out), (f"--out={out}",)):
        status, _, error = shroud(command, "small.toml", *arguments)
        assert (status, error.count("\n")) == (2, 1), error
        assert error.startswith("--out: ")
    assert tree(given.parent) == before


@pytest.mark.parametrize("place", PLACES)
def test_a_new_scene_and_an_export_do_not_either(given: Path, place: str) -> None:
    make, expected = PLACES[place]
    out = str(make(given))
    before = tree(given.parent)
    status, _, error = shroud("new", out)
    assert (status, error.count("\n")) == (2, 1), error
    assert expected in error
    assert error.startswith("DIR: ")
    if place not in ("root", "root by dots", "link to the root", "home"):  # an export is a file
        status, _, error = shroud("export", "g.h5", "--to", f"{out}.mat" if out.strip() else out)
        assert (status, error.count("\n")) == (2, 1), error
        assert error.startswith("--to: ")
    assert tree(given.parent) == before


def test_an_export_does_not_replace_what_it_reads(given: Path) -> None:
    source = (given / "g.h5").rename(given / "g.mat")
    (given / "same.mat").hardlink_to(source)
    content = source.read_bytes()
    for target in ("g.mat", "./g.mat", "same.mat"):
        status, _, error = shroud("export", source, "--to", target)
        assert (status, error) == (2, f"--to: {Path(target)}: is also the file to export, allowed: another file\n")
    status, _, error = shroud("export", "s.toml", "--to", "g.vtu", "--mesh", link(given / "g.vtu", source))
    assert (status, error) == (2, "--to: g.vtu: is also --mesh, allowed: another file\n")
    assert source.read_bytes() == content


def test_an_export_that_fails_leaves_no_folder(given: Path) -> None:
    for target in ("new/folder/x.uff", "new/x.vtu"):
        status, _, error = shroud("export", "g.h5", "--to", target)
        assert (status, error.count("\n")) == (2, 1)
        assert not (given / "new").exists()
    assert shroud("export", "g.h5", "--to", "new/folder/x.mat", "--quiet") == (0, "", "")
    assert (given / "new" / "folder" / "x.mat").is_file()


def test_a_folder_of_scenes_or_of_earlier_results_is_fine(given: Path) -> None:
    (given / "g.h5").rename(given.parent / "g.h5")
    (given / ".gitignore").touch()
    (given / "store").mkdir()
    for _ in range(2):
        assert run_scene("s.toml", ".", rom="../g.h5", until="respond").curves[0].complete
        (given / "notes.txt").write_text("beside earlier results")
    link(given.parent / "l", given)
    assert run_scene("s.toml", "../l", rom="../g.h5", until="respond").curves[0].complete
    for inside in ("store", "store/x", "../l/store/tmp"):
        status, _, error = shroud("respond", "s.toml", "--rom", "../g.h5", "--out", inside)
        assert (status, error.count("\n")) == (2, 1), error
        assert "is inside the store of" in error
    for path in (given / "store").iterdir():
        path.rename(given.parent / path.name)
    assert run_scene("s.toml", ".", rom="../g.h5", until="respond").curves[0].complete


def test_the_longest_path_that_is_taken_has_room_for_all_results(given: Path) -> None:
    """One byte more is refused before anything is written; at the limit all names below it fit."""
    most = os.pathconf("/", "PC_PATH_MAX") - 1 - 100
    short = str(given) + "/abcdefghi" * ((most - len(str(given))) // 10 - 1)
    out = short + "/" + "x" * (most - len(short) - 1)
    status, _, error = shroud("respond", "s.toml", "--rom", "g.h5", "--out", out + "x")
    assert (status, error.count("\n")) == (2, 1)
    assert not (given / "abcdefghi").exists()
    assert run_scene("s.toml", out, rom="g.h5", until="respond").curves[0].complete
    assert len(os.path.abspath(out)) == most
    inside = max(len(str(path)) for path in Path(out).rglob("*"))
    assert inside < os.pathconf("/", "PC_PATH_MAX")

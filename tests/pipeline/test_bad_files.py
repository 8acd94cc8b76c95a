"""Bad files on the command line, and files of a run that something damaged: one line, or made again the same."""

import copy
import ctypes
import itertools
import json
import os
import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from pipeline_support import ground_scene, shroud, summary_of, write_ground_model, write_scene

import pipeline.export.source
import pipeline.process.isolated_reading
import pipeline.results.file_info
from pipeline import read_results
from pipeline.errors import InputError
from pipeline.process.isolated_reading import read_apart
from pipeline.results.file_info import contents, described
from pipeline.results.outputs import as_json
from pipeline.results.run_folder import models_of_run
from pipeline.store.content_store import MANIFEST, Store


def one_line(command: tuple[object, ...], path: Path) -> str:
    """The complaint of a command line about the file `path`."""
    status, said, error = shroud(*command)
    assert (status, said) == (2, ""), error
    assert error.count("\n") == 1, error
    assert str(path) in error
    assert len(error) < len(str(path)) * 2 + 400
    return error


def damaged_models(folder: Path) -> dict[str, Path]:
    """Files that are no models, each in its own way."""
    whole = write_ground_model(folder / "whole.h5").read_bytes()
    made = {
        name: folder / f"{name}.h5"
        for name in ("empty", "text", "cut", "signature", "folder", "pipe", "link", "zeros")
    }
    made["empty"].write_bytes(b"")
    made["text"].write_text("mass = 1\n" * 100)
    made["cut"].write_bytes(whole[: len(whole) // 3])
    made["signature"].write_bytes(whole[:8])
    made["zeros"].write_bytes(bytes(10_000))
    made["folder"].mkdir()
    made["link"].symlink_to(folder / "nowhere")
    os.mkfifo(made["pipe"])
    return {**made, "absent": folder / "absent.h5", "device": Path("/dev/zero")}


def test_files_that_are_no_models(tmp_path: Path) -> None:
    scene, out = write_scene(tmp_path / "s.toml", ground_scene()), tmp_path / "out"
    for path in damaged_models(tmp_path).values():
        one_line(("info", path), path)
        one_line(("respond", scene, "--rom", path, "--out", out), path)
        for target in ("x.mat", "x.uff", "x.vtu"):
            one_line(("export", path, "--to", tmp_path / target, "--mesh", path), path)
            assert not (tmp_path / target).exists()
    assert not out.exists()


def test_links_into_other_files_are_not_followed(tmp_path: Path) -> None:
    """Of a model, of a response, and of a group with all that is in it."""
    other = write_ground_model(tmp_path / "other.h5")
    for name in ("mass", "contact", "output/tip", "curve"):
        path = tmp_path / "linked.h5"
        shutil.copy(other, path)
        with h5py.File(path, "r+") as file:
            if name in file:
                del file[name]
            file[name] = h5py.ExternalLink(str(other), "/" if name == "curve" else name)
        error = one_line(("info", path), path)
        assert f"{name}: a link into another file" in error
        one_line(("export", path, "--to", tmp_path / "x.mat"), path)


@pytest.mark.parametrize("name", ["a/b", "ü", "x" * 64, "9a", "_x", "a b", "$\\frac{", "a\nb", "\x1b[31m", ".."])
def test_names_of_outputs(tmp_path: Path, name: str) -> None:
    """Odd names are read and shown on one line; MATLAB cannot have them, and a group is no output."""
    path = write_ground_model(tmp_path / "model.h5")
    with h5py.File(path, "r+") as file:
        file.create_dataset(f"output/{name}", data=np.ones(12))
    if "/" in name:
        assert "output/a: missing dataset" in one_line(("info", path), path)
        return
    status, said, error = shroud("info", path)
    assert (status, error, said.count("\n")) == (0, "", 6)
    assert said.replace("\n", "").isprintable()
    assert "output: " in one_line(("export", path, "--to", tmp_path / "x.mat"), path)


@pytest.mark.parametrize("producer", ["a\nb", "\x1b[31mred", "x" * 50_000, np.bytes_(b"\xff\xfe"), 5, [1, 2]])
def test_an_odd_producer_stays_on_its_line(tmp_path: Path, producer: object) -> None:
    path = write_ground_model(tmp_path / "model.h5")
    with h5py.File(path, "r+") as file:
        file.attrs["producer"] = str(producer)[:5000] if isinstance(producer, str) else producer
    status, said, error = shroud("info", path)
    assert (status, error, said.count("\n")) == (0, "", 6)


def test_a_response_with_something_missing(finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every dataset and attribute of a curve removed or made nonsense: the info or the complaint, never more.

    Read in this process: the files are whole ones to the HDF5 library, and a process for each takes most of the time.
    """
    for module in (pipeline.results.file_info, pipeline.export.source):
        monkeypatch.setattr(module, "read_apart", lambda path, allowed, read: read())
    path = tmp_path / "response.h5"
    with h5py.File(finished / "response.h5") as file:
        attributes, datasets = list(file["curve/0"].attrs), [n for n in file["curve/0"] if n != "branch"]
    for name, value in zip(attributes, itertools.cycle((None, [1.0, 2.0]))):
        shutil.copy(finished / "response.h5", path)
        with h5py.File(path, "r+") as file:
            del file["curve/0"].attrs[name]
            if value is not None:
                file["curve/0"].attrs[name] = value
        status, _, error = shroud("info", path)
        assert status in (0, 2), (name, value, error)
        assert error.count("\n") == (status == 2)
    for name, target in zip((*datasets, "."), itertools.cycle(("x.mat", "x.uff"))):
        shutil.copy(finished / "response.h5", path)
        with h5py.File(path, "r+") as file:
            del file[f"curve/{'0' if name == '.' else f'0/{name}'}"]
            file[f"curve/{'0' if name == '.' else f'0/{name}'}"] = "text"
        status, _, error = shroud("export", path, "--to", tmp_path / target)
        assert status in (0, 2), (name, error)
        assert error.count("\n") == (status == 2)


def test_meshes_for_an_export_that_are_none(finished: Path, tmp_path: Path) -> None:
    rom = finished / summary_of(finished)["curves"][0]["rom"]
    mesh = finished / summary_of(finished)["models"][0]["mesh"]
    draw = random.Random(3)
    for source in (mesh, mesh.with_suffix(".msh"), mesh.with_name("sector.h5")):
        content = source.read_bytes()
        for size in (0, 100, len(content) - 20):
            damaged = tmp_path / f"damaged{source.suffix}"
            damaged.write_bytes(content[:size])
            one_line(("export", rom, "--to", tmp_path / "x.vtu", "--mesh", damaged), damaged)
        for _ in range(2):
            changed = bytearray(content)
            for _ in range(20):
                changed[draw.randrange(len(changed))] = draw.randrange(256)
            damaged.write_bytes(changed)
            status, _, error = shroud("export", rom, "--to", tmp_path / "x.vtu", "--mesh", damaged)
            assert (status, error.count("\n")) == (2, 1), error


DAMAGE: dict[str, Callable[[Path], object]] = {
    "truncated": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "one bit": lambda path: path.write_bytes(bytes([path.read_bytes()[0] ^ 1]) + path.read_bytes()[1:]),
}


def again(finished: Path, copied: Path) -> None:
    """Run the scene of `finished` on the damaged copy; the numbers must be the same."""
    status, _, error = shroud("run", finished.parent / "small.toml", "--out", copied, "--quiet")
    assert (status, error) == (0, "")
    assert _numbers(copied) == _numbers(finished)


def _numbers(out: Path) -> object:
    summary = summary_of(out)
    curves = [[curve["peak_frequency_hz"], curve["peak_amplitude_m"], curve["points"]] for curve in summary["curves"]]
    return curves, [model["free_hz"] for model in summary["models"]]


@pytest.mark.parametrize("damage", ["truncated", pytest.param("one bit", marks=pytest.mark.long)])
def test_a_damaged_store_is_made_again(finished: Path, copied: Path, damage: str) -> None:
    for path in sorted((copied / "store").rglob("*")):
        if path.is_file():
            DAMAGE[damage](path)
    again(finished, copied)


@pytest.mark.parametrize("kind", ["reduce", "curve"])
def test_a_damaged_result_of_one_stage_is_made_again(finished: Path, copied: Path, kind: str) -> None:
    for path in sorted((copied / "store" / kind).rglob("*")):
        if path.is_file() and path.name != "entry.json":
            DAMAGE["one bit"](path)
    again(finished, copied)


NONSENSE = ["", "[]", "{}", '{"files": {}}', '{"files": 3}', "null", "\x00", "[" * 100_000]


def test_nonsense_in_lists_of_files(finished: Path, copied: Path) -> None:
    """Another kind of it in every entry of the store."""
    for path, nonsense in zip(
        sorted((copied / "store").rglob("entry.json")), itertools.cycle(NONSENSE), strict=False
    ):
        path.write_text(nonsense)
    again(finished, copied)


def test_a_given_model_that_was_damaged_meanwhile(tmp_path: Path) -> None:
    scene, rom, out = write_scene(tmp_path / "s.toml", ground_scene()), tmp_path / "g.h5", tmp_path / "out"
    command = ("respond", scene, "--rom", rom, "--out", out, "--quiet")
    write_ground_model(rom)
    assert shroud(*command)[0] == 0
    before = json.dumps(summary_of(out)["curves"])
    whole = rom.read_bytes()
    rom.write_bytes(whole[:-3000])
    one_line(command, rom)
    assert json.dumps(summary_of(out)["curves"]) == before
    rom.write_bytes(whole)
    assert shroud(*command)[0] == 0
    assert [c["peak_amplitude_m"] for c in summary_of(out)["curves"]] == [
        c["peak_amplitude_m"] for c in json.loads(before)
    ]


def test_output_folders(tmp_path: Path) -> None:
    scene, rom = write_scene(tmp_path / "s.toml", ground_scene()), write_ground_model(tmp_path / "g.h5")
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "real")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    (tmp_path / "file").write_text("in the way")
    command = ("respond", scene, "--rom", rom, "--quiet", "--out")
    assert shroud(*command, tmp_path / "link") == (0, "", "")
    assert (tmp_path / "real" / "summary.json").is_file()
    for out in ("loop", "file", "file/below", "x" * 300):
        one_line((*command, tmp_path / out), tmp_path / out)
    assert (tmp_path / "file").read_text() == "in the way"


def test_a_library_that_crashes_or_never_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In C, where no exception and no interrupt of Python's gets through."""
    path = tmp_path / "file.h5"
    path.write_bytes(b"x")
    monkeypatch.setattr(pipeline.process.isolated_reading, "PATIENCE", 0.2)
    home = os.getpid()

    def crash() -> None:
        if os.getpid() != home:
            ctypes.string_at(0)

    def hang() -> None:
        if os.getpid() != home:
            ctypes.PyDLL(None).pause()

    with pytest.raises(InputError, match=r"file\.h5: cannot be read: the HDF5 library crashes on it \(SIGSEGV\)"):
        read_apart(path, "a file", crash)
    with pytest.raises(InputError, match=r"file\.h5: cannot be read: the HDF5 library has not come to an end"):
        read_apart(path, "a file", hang)
    assert read_apart(path, "a file", lambda: 3) == 3
    with pytest.raises(KeyError):
        read_apart(path, "a file", lambda: {}["a"])


WRONG: list[Any] = [
    None,
    True,
    -7,
    1e308,
    "x",
    "",
    "../../etc/passwd",
    "/etc/passwd",
    "a\0b",
    "\ud800",
    [],
    {},
    [[{}]],
]
TEXTS = ["", "{", "[]", "null", '"x"', '{"seconds": NaN}', '{"seconds": 1e999}', '{"seconds": 1' + 400 * "0" + "}"]
TEXTS += ["[" * 100_000, '{"a":' * 60 + "1" + "}" * 60, "\ufeff{}", "\x00"]


def places(value: Any, way: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Ways to all values in a JSON value, of a list to the first only."""
    inner = value.items() if isinstance(value, dict) else enumerate(value[:1]) if isinstance(value, list) else ()
    return [way, *(found for key, item in inner for found in places(item, (*way, key)))]


def altered(summary: dict[str, Any], way: tuple[Any, ...], value: Any) -> Any:
    """The summary with another value in a place; `places` as the value: without it."""
    changed = copy.deepcopy(summary)
    part = changed
    for key in way[:-1]:
        part = part[key]
    if value is places:
        del part[way[-1]]
    else:
        part[way[-1]] = value
    return changed


def test_an_altered_summary_is_read_or_refused_in_one_line(finished: Path, tmp_path: Path) -> None:
    """Whatever value of it is exchanged: no other exception, and no file outside of the folder."""
    summary = summary_of(finished) | {"response": None}
    kept = ("models", "pictures", "problems", "complete", "response", "table_hash", "report", "seconds", "scene")
    ways = [way for way in places(summary) if way and (way[0] in kept or len(way) == 1)]
    cases = [(way, value) for way in ways for value in (*WRONG, places)]
    texts = [json.dumps(altered(summary, *case)) for case in random.Random(39).sample(cases, 250)]
    refused, accepted = 0, 0
    for text in texts + TEXTS:
        (tmp_path / "summary.json").write_text(text)
        try:
            assert read_results(tmp_path).folder == tmp_path
            assert as_json(found := contents(tmp_path))
            assert described(found)
            models = models_of_run(tmp_path)
        except InputError as error:
            refused += "\n" not in str(error)
        else:
            files = [path for model in models for path in (model.rom, model.mesh) if path is not None]
            accepted += all(path.resolve().is_relative_to(tmp_path.resolve()) for path in files)
    assert refused > 80
    assert refused + accepted == len(texts) + len(TEXTS)


@pytest.mark.parametrize(
    ("key", "found"), [("models.0.rom", "../secret.h5"), ("models.0.mesh", "link.vtu"), ("pictures.0", "/etc/passwd")]
)
def test_paths_out_of_the_folder_are_named(copied: Path, key: str, found: str) -> None:
    shutil.copyfile(copied / summary_of(copied)["models"][0]["rom"], copied.parent / "secret.h5")
    (copied / "link.vtu").symlink_to(copied.parent / "secret.h5")
    way = tuple(int(part) if part.isdigit() else part for part in key.split("."))
    (copied / "summary.json").write_text(json.dumps(altered(summary_of(copied), way, found)))
    said = f'{copied}: summary.json: {key}: "{found}", allowed: a file inside the output folder\n'
    for command in (("info", copied), ("export", copied, "--to", copied.parent / "x.vtu")):
        assert shroud(*command) == (2, "", said)


def test_a_folder_of_a_killed_run_is_told_from_others(tmp_path: Path) -> None:
    (tmp_path / "store").mkdir()
    (tmp_path / "store" / "lock").touch()
    said = one_line(("info", tmp_path), tmp_path)
    assert said.endswith("a run that was killed, or a command of one study): shroud run goes on from there\n")


def test_a_summary_that_is_no_file_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "summary.json")
    with pytest.raises(InputError, match="is no regular file"):
        read_results(tmp_path)


def test_a_list_of_an_entry_that_was_altered_makes_the_entry_absent(tmp_path: Path) -> None:
    store = Store(tmp_path)
    entry = store.get("k", "x", lambda folder: (folder / "a.txt").write_text("one"))
    whole = json.loads(entry.file(MANIFEST).read_text())
    cases = [altered(whole, way, value) for way in places(whole) if way for value in (*WRONG, places, 10**290)]
    free = {"seconds": 0.0, "run": ""}  # of these any will do
    for text in [*map(json.dumps, cases), *TEXTS]:
        entry.file(MANIFEST).write_text(text)
        assert store.find("k", "x") is None or json.loads(text) | free == whole | free
    entry.file(MANIFEST).write_text(json.dumps(whole))
    assert store.find("k", "x") is not None
    shutil.move(entry.file("a.txt"), tmp_path / "a.txt")
    entry.file("a.txt").symlink_to(tmp_path / "a.txt")
    assert store.find("k", "x") is None

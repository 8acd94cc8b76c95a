"""The store: whole entries or none, found by key and checked by content."""

import hashlib
import json
import os
import shutil
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.store.content_store import Store
from pipeline.store.fingerprints import arrays_fingerprint, content_fingerprint, fingerprint


def writer(text: str):
    """A builder that writes one file."""
    return lambda folder: (folder / "a.txt").write_text(text)


def test_an_entry_is_made_once(tmp_path: Path) -> None:
    store = Store(tmp_path)
    first, second = store.get("k", "x", writer("one")), store.get("k", "x", writer("two"))
    assert (first.ran, second.ran) == (True, False)
    assert second.file("a.txt").read_text() == "one"


def test_force_ignores_other_runs_but_not_its_own(tmp_path: Path) -> None:
    Store(tmp_path).get("k", "x", writer("one"))
    forced = Store(tmp_path, recompute=True)
    assert forced.get("k", "x", writer("two")).ran
    assert not forced.get("k", "x", writer("three")).ran
    assert Store(tmp_path).get("k", "x", writer("four")).file("a.txt").read_text() == "two"


def test_a_failure_leaves_nothing(tmp_path: Path) -> None:
    store = Store(tmp_path)

    def fail(folder: Path) -> None:
        (folder / "a.txt").write_text("half")
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        store.get("k", "x", fail)
    assert store.find("k", "x") is None
    assert list((tmp_path / "tmp").iterdir()) == []


def test_sizes_are_compared_always_and_content_on_demand(tmp_path: Path) -> None:
    store = Store(tmp_path)
    file = store.get("k", "x", writer("one")).file("a.txt")
    file.write_text("two")
    assert store.find("k", "x", thorough=False) is not None
    assert store.find("k", "x") is None
    file.write_text("three")
    assert store.find("k", "x", thorough=False) is None
    assert store.get("k", "x", writer("one")).ran


def test_an_entry_knows_its_kind_and_its_key(tmp_path: Path) -> None:
    store = Store(tmp_path)
    for kind, key, text in (("k", "x", "one"), ("k", "y", "two"), ("l", "x", "three")):
        store.get(kind, key, writer(text))
    shutil.rmtree(tmp_path / "k" / "x")
    shutil.copytree(tmp_path / "k" / "y", tmp_path / "k" / "x")
    assert store.find("k", "x") is None
    shutil.rmtree(tmp_path / "k" / "x")
    shutil.copytree(tmp_path / "l" / "x", tmp_path / "k" / "x")
    assert store.find("k", "x") is None
    assert store.get("k", "x", writer("one")).file("a.txt").read_text() == "one"
    assert store.find("k", "x") is not None


LISTS: dict[str, dict[str, Any]] = {
    "no files": {"files": {}},
    "of an earlier version": {"kind": None, "key": None},
    "files as a list": {"files": ["a.txt"]},
    "a file without its hash": {"files": {"a.txt": {"size": 3}}},
    "a file elsewhere": {"files": {"../y/a.txt": {"size": 3, "sha256": hashlib.sha256(b"two").hexdigest()}}},
    "no time": {"seconds": float("nan")},
    "a negative time": {"seconds": -1.0},
    "more than is known": {"colour": "red"},
}


@pytest.mark.parametrize("name", LISTS)
def test_an_entry_with_a_wrong_list_is_absent_and_made_again(tmp_path: Path, name: str) -> None:
    store = Store(tmp_path)
    store.get("k", "x", writer("one"))
    store.get("k", "y", writer("two"))
    path = tmp_path / "k" / "x" / "entry.json"
    changed = json.loads(path.read_text()) | LISTS[name]
    path.write_text(json.dumps({key: value for key, value in changed.items() if value is not None}))
    if name == "no files":
        (tmp_path / "k" / "x" / "a.txt").unlink()
    assert store.find("k", "x") is None
    assert store.get("k", "x", writer("one")).ran
    assert store.find("k", "x") is not None


def test_a_file_in_the_place_of_an_entry_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "k").mkdir()
    (tmp_path / "k" / "x").touch()
    assert Store(tmp_path).get("k", "x", writer("one")).file("a.txt").read_text() == "one"


@pytest.mark.parametrize("name", ["entry.json", "a.txt", "more"])
def test_pipes_among_the_files_are_not_waited_for(tmp_path: Path, name: str) -> None:
    store = Store(tmp_path)
    folder = store.get("k", "x", writer("one")).folder
    (folder / name).unlink(missing_ok=True)
    os.mkfifo(folder / name)
    assert (store.find("k", "x") is None) == (name != "more")  # a pipe is no file, nor part of the result


def test_replacing_is_all_or_nothing(tmp_path: Path) -> None:
    store, target = Store(tmp_path / "store"), tmp_path / "result.txt"
    with store.replacing(target) as (path,):
        path.write_text("old")

    def half() -> None:
        with store.replacing(target) as (path,):
            path.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        half()
    assert target.read_text() == "old"
    assert list((tmp_path / "store" / "tmp").iterdir()) == []


def test_leftovers_of_killed_processes_are_removed(tmp_path: Path) -> None:
    store = Store(tmp_path)
    kept = store.get("k", "x", writer("one"))
    for name in ("99999999-a", "odd"):
        (tmp_path / "tmp" / name).mkdir(parents=True)
    store.remove_temporary()
    assert [path.name for path in tmp_path.iterdir()] == ["k"]
    assert kept.file("a.txt").read_text() == "one"


def test_two_at_once_end_with_one_whole_entry(tmp_path: Path) -> None:
    barrier = threading.Barrier(2)

    def build(folder: Path) -> None:
        (folder / "a.txt").write_text("same")
        barrier.wait(timeout=10)

    threads = [threading.Thread(target=Store(tmp_path).get, args=("k", "x", build)) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    entry = Store(tmp_path).find("k", "x")
    assert entry is not None
    assert entry.file("a.txt").read_text() == "same"


def test_fingerprints_follow_content_and_nothing_else() -> None:
    assert fingerprint({"a": 1.0, "b": (1, 2)}) == fingerprint({"b": [1, 2], "a": 1.0})
    assert fingerprint({"a": 1.0}) != fingerprint({"a": 1.0000000000000002})
    assert fingerprint({"a": None}) != fingerprint({})
    assert content_fingerprint(b"same") == content_fingerprint(bytes([*b"same"])) != content_fingerprint(b"Same")


def test_fingerprints_of_arrays_follow_every_bit_and_every_name() -> None:
    values = {"a": np.eye(2), "b": {"c": np.zeros(3)}, "d": None, "e": 1.0}
    changes: list[dict[str, Any]] = [
        {"a": np.eye(2) * (1.0 + 2e-16)},
        {"a": np.eye(2).astype(complex)},
        {"a": np.eye(2).reshape(1, 4)},
        {"a": None},
        {"b": {"d": np.zeros(3)}},
        {"b": {"c": -np.zeros(3)}},
        {"d": np.zeros(0)},
        {"e": 1},
    ]
    found = [arrays_fingerprint(values | change) for change in [{}, *changes]]
    assert len(set(found)) == len(found)
    assert arrays_fingerprint({"e": 1.0, "d": None, "b": {"c": np.zeros(3)}, "a": np.eye(2).T}) == found[0]

"""The store: whole entries or none, found by key and checked by content."""

import os
import threading
from pathlib import Path

import pytest

from pipeline.store.content_store import Store
from pipeline.store.fingerprints import file_fingerprint, fingerprint


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
    forced = Store(tmp_path, force=True)
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


def test_fingerprints_follow_content_and_nothing_else(tmp_path: Path) -> None:
    assert fingerprint({"a": 1.0, "b": (1, 2)}) == fingerprint({"b": [1, 2], "a": 1.0})
    assert fingerprint({"a": 1.0}) != fingerprint({"a": 1.0000000000000002})
    assert fingerprint({"a": None}) != fingerprint({})
    one, two = tmp_path / "one", tmp_path / "two"
    one.write_bytes(b"same")
    two.write_bytes(b"same")
    os.utime(two, (0, 0))
    assert file_fingerprint(one) == file_fingerprint(two)

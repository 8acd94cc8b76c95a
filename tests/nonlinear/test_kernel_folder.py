"""Compiled kernels are loaded only from folders that nobody but the user can write or replace."""

import os
import pickle
import stat
import threading
import time
from pathlib import Path

import pytest

from nonlinear.contact import numba_cache
from nonlinear.contact.numba_cache import compiled, kernel_folder, lean, own_folder


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def test_a_new_folder_is_the_users_alone_from_the_start(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        found = own_folder(tmp_path / "new" / "cache", "kernels")
    finally:
        os.umask(before)
    assert found == tmp_path / "new" / "cache" / "kernels"
    assert {mode(path) for path in (tmp_path / "new", tmp_path / "new" / "cache", found)} == {0o700}
    assert own_folder(tmp_path / "new" / "cache", "kernels") == found


@pytest.mark.parametrize(
    ("bits", "safe"), [(0o755, {0, 1, 2}), (0o777, set()), (0o757, set()), (0o772, set()), (0o1777, {1, 2})]
)
@pytest.mark.parametrize("level", [0, 1, 2])
def test_a_folder_that_others_can_write_or_replace_is_refused(
    tmp_path: Path, level: int, bits: int, safe: set[int]
) -> None:
    """In a sticky folder others cannot rename the next one, but could add files of their own to the last one."""
    folder = own_folder(tmp_path / "above" / "cache", "kernels")
    assert folder is not None
    (folder, *folder.parents)[level].chmod(bits)
    assert (own_folder(tmp_path / "above" / "cache", "kernels") is not None) == (level in safe)


def test_a_group_that_the_user_shares_with_nobody_is_no_danger(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tmp_path.chmod(0o770)
    monkeypatch.setattr(numba_cache, "_is_private", lambda group_id: True)
    assert own_folder(tmp_path, "kernels") is not None
    monkeypatch.setattr(numba_cache, "_is_private", lambda group_id: False)
    assert own_folder(tmp_path, "kernels") is None


@pytest.mark.parametrize("kind", ["link", "file"])
def test_what_is_no_folder_of_its_own_is_refused(tmp_path: Path, kind: str) -> None:
    place = tmp_path / "kernels"
    if kind == "link":
        (tmp_path / "elsewhere").mkdir()
        place.symlink_to(tmp_path / "elsewhere")
    else:
        place.touch()
    assert own_folder(tmp_path, "kernels") is None


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can make folders of other users")
@pytest.mark.parametrize("level", [0, 1, 2])
def test_a_folder_of_another_user_is_refused(tmp_path: Path, level: int) -> None:
    folder = own_folder(tmp_path / "above" / "cache", "kernels")
    assert folder is not None
    os.chown((folder, *folder.parents)[level], 65534, 65534)
    assert own_folder(tmp_path / "above" / "cache", "kernels") is None


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can make links of other users")
def test_a_link_of_another_user_is_refused(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    link = tmp_path / "link"
    link.symlink_to(tmp_path / "folder")
    assert own_folder(link, "kernels") == tmp_path / "folder" / "kernels"
    os.lchown(link, 65534, 65534)
    assert own_folder(link, "kernels") is None


class Hostile:
    """Its unpickling leaves a file."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[object, tuple[object, ...]]:
        return Path.touch, (self.mark,)


def twice(x: float) -> float:
    """To be compiled."""
    return 2.0 * x


@pytest.fixture
def cached(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file from which `twice` is loaded as the user has chosen the folder `cache`."""
    import numba

    monkeypatch.setattr(numba.core.config, "CACHE_DIR", str(tmp_path / "cache"))
    assert compiled(twice)(21.0) == 42.0
    (file,) = (tmp_path / "cache").rglob("*.nbi")
    return file


def test_code_in_a_folder_open_to_others_is_not_run(cached: Path, tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    cached.write_bytes(pickle.dumps(Hostile(mark)))
    compiled(twice)(21.0)
    assert mark.exists(), "this is how the file would run code"
    cached.write_bytes(pickle.dumps(Hostile(mark)))
    mark.unlink()
    kernel_folder.cache_clear()
    (tmp_path / "cache").chmod(0o777)
    assert compiled(twice)(21.0) == 42.0
    assert not mark.exists()


def test_kernels_are_compiled_in_memory_where_no_folder_is_safe(
    cached: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(numba_cache, "kernel_folder", lambda chosen: None)
    kernel = compiled(twice)
    assert kernel(21.0) == 42.0
    assert kernel._cache.cache_path is None


def test_a_damaged_file_of_a_kernel_is_compiled_anew(cached: Path) -> None:
    whole = cached.read_bytes()
    cached.write_bytes(whole[: len(whole) // 2])
    assert compiled(twice)(21.0) == 42.0
    assert cached.read_bytes() == whole


def test_threads_run_beside_a_kernel(cached: Path) -> None:
    """So that the thread that watches signals can end a process within a long kernel."""

    def work(n: int) -> float:
        x = 0.0
        for i in range(n):
            x = 0.5 * x + i % 7
        return x

    kernel = lean(work)
    kernel(1)  # compiled
    running, turns = threading.Thread(target=kernel, args=(10**8,)), 0
    running.start()
    while running.is_alive():
        time.sleep(0.01)
        turns += 1
    assert turns > 3

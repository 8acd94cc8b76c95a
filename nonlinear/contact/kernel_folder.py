"""Folder of the compiled kernels: one for every state of their source, that nobody but the user can write.

A file of compiled kernels is code: numba unpickles it. Whoever can write the folder, or put another in its place, can
run code as the user.
"""

import hashlib
import os
import re
import stat
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path


@cache
def kernel_folder(chosen: str = "") -> Path | None:
    """Folder of the kernels of this very source, made where it is missing."""
    package = Path(__file__).parent.parent
    name = f"compiled-{source_digest(package)}"
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    usual = (package / "__pycache__", home / "shroud", Path(tempfile.gettempdir()) / f"shroud-{os.getuid()}")
    candidates = (Path(chosen), *usual) if chosen else usual
    return next((found for parent in candidates if (found := own_folder(parent, name)) is not None), None)


def own_folder(parent: Path, name: str) -> Path | None:
    """The folder `name` in `parent`, made where it is missing; None where others could write it or replace it.

    The folder belongs to the user, and those above to the user or the superuser; nobody else can write them. In a
    sticky folder, such as /tmp, others may write, as they cannot rename what is not theirs.
    """
    try:
        _make(parent)
        folder = parent.resolve() / name
        _make(folder)
        above = [path.lstat() for path in folder.parents]
        own, link = folder.lstat(), parent.lstat()
    except OSError:
        return None
    user = os.getuid()
    trusted = {user, 0, above[-1].st_uid}  # whoever owns / owns the system, under whatever number
    safe = all(each.st_uid in trusted and (not _others_write(each) or each.st_mode & stat.S_ISVTX) for each in above)
    if not safe or link.st_uid not in trusted:
        return None
    mine = stat.S_ISDIR(own.st_mode) and own.st_uid == user and not _others_write(own)
    return folder if mine and os.access(folder, os.W_OK | os.X_OK) else None


def source_digest(package: Path) -> str:
    """Hash of the sources of all kernels below `package` and of the modules of the package that these import.

    A kernel depends on the constants and types of the modules that it imports, so these count too.
    """
    sources = {source: source.read_bytes() for source in package.rglob("*.py")}
    needed = [source for source, text in sources.items() if b"from nonlinear.contact.numba_cache import" in text]
    for source in needed:  # grows
        for module in re.findall(rb"from nonlinear\.([\w.]+) import", sources[source]):
            imported = package / (module.decode().replace(".", "/") + ".py")
            if imported in sources and imported not in needed:
                needed.append(imported)
    digest = hashlib.sha256()
    for source in sorted(needed):
        digest.update(source.relative_to(package).as_posix().encode() + sources[source])
    return digest.hexdigest()[:16]


def _make(folder: Path) -> None:
    """Make the folder and those above it that are missing, for the user alone from the start."""
    for path in reversed(list(_missing(folder))):
        try:
            path.mkdir(mode=0o700)
        except FileExistsError:  # another process was faster
            continue


def _missing(folder: Path) -> Iterator[Path]:
    for path in (folder, *folder.parents):
        if os.path.lexists(path):
            return
        yield path


def _others_write(status: os.stat_result) -> bool:
    """Whether anybody but the owner can write; a group that has the user as its only member does not count."""
    by_group = bool(status.st_mode & stat.S_IWGRP) and not _is_private(status.st_gid)
    return by_group or bool(status.st_mode & stat.S_IWOTH)


@cache
def _is_private(group_id: int) -> bool:
    """Whether a group is the one that many systems make for each user: of the same name, with no other member."""
    import grp
    import pwd

    try:
        user, group = pwd.getpwuid(os.getuid()), grp.getgrgid(group_id)
    except KeyError:
        return False
    return (group.gr_gid, group.gr_name) == (user.pw_gid, user.pw_name) and not set(group.gr_mem) - {user.pw_name}

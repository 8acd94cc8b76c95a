"""Whether a folder is one to write results to: new, empty, or with earlier results."""

from __future__ import annotations

import os
import re
from pathlib import Path

from pipeline.errors import input_error, shown
from pipeline.store.manifest import Manifest, read_json

STORE, LOCKS = "store", ("lock", "lock.soft")
TEMPORARY, _NAME = "tmp", re.compile(r"[0-9a-f]{32}")  # folder of what is not finished, and names in it
INPUTS = (".toml", ".schema.json")  # scenes may stand beside their results


def check_output_folder(out: Path) -> None:
    """Refuse a folder with files that are not of this program, so that none of them is mixed up or overwritten."""
    real = Path(os.path.realpath(out))
    try:
        inside = next((folder for folder in [real, *real.parents] if is_store(folder)), None)
        ours = not real.is_dir() or is_store(real / STORE) or _has_results(real)
        others = [] if ours else sorted(path.name for path in real.iterdir() if not _expected(path))
    except OSError:  # what cannot be read cannot be written either, which is said where that is tried
        return
    if inside is not None:
        raise input_error("--out", str(out), f"is inside the store of {inside.parent}", "a folder of its own")
    if others:
        more = f" and {len(others) - 1} more" if len(others) > 1 else ""
        found = f"holds {shown(others[0])}{more} and no earlier results"
        raise input_error("--out", str(out), found, f"a new or empty folder, such as {out / 'results'}")


def is_store(folder: Path) -> bool:
    """Whether the folder is the store of an output folder: it has a lock, or entries and nothing else."""
    if folder.name != STORE or not folder.is_dir():
        return False
    return any((folder / lock).is_file() for lock in LOCKS) or (_is_begun(folder) and bool(_entries(folder)))


def _is_begun(store: Path) -> bool:
    """Whether a store without a lock holds nothing but entries and what an interrupted run has begun."""
    begun = store / TEMPORARY
    names = [path.name for path in begun.iterdir()] if begun.is_dir() else []
    return all(map(_NAME.fullmatch, names)) and all(Manifest.read(entry) is not None for entry in _entries(store))


def _entries(store: Path) -> list[Path]:
    """What should be entries: all that is neither a lock nor temporary."""
    kinds = [path for path in store.iterdir() if path.name not in (TEMPORARY, *LOCKS)]
    return [entry for kind in kinds for entry in (kind.iterdir() if kind.is_dir() else [kind])]


def _expected(path: Path) -> bool:
    """Hidden files, scenes, and a store that an interrupted run has only begun."""
    begun = path.name == STORE and path.is_dir() and _is_begun(path)
    return path.name.startswith(".") or path.name.endswith(INPUTS) or begun


def _has_results(out: Path) -> bool:
    """Whether a summary of this program lies in a folder whose store was deleted."""
    try:
        summary = read_json(out / "summary.json")
    except (OSError, ValueError):
        return False
    return isinstance(summary, dict) and {"scene", "stages", "curves"} <= set(summary)

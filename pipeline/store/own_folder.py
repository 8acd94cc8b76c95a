"""Whether a folder is one to write results to: new, empty, or with earlier results."""

from __future__ import annotations

import json
import os
from pathlib import Path

from pipeline.errors import input_error, shown

STORE, LOCKS = "store", ("lock", "lock.soft")
INPUTS = (".toml", ".schema.json")  # scenes may stand beside their results


def check_output_folder(out: Path) -> None:
    """Refuse a folder with files that are not of this program, so that none of them is mixed up or overwritten.

    Raises
    ------
    InputError
        Names the folder and the first of those files.
    """
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
    """Whether the folder is the store of an output folder."""
    return folder.name == STORE and any((folder / lock).is_file() for lock in LOCKS)


def _expected(path: Path) -> bool:
    """Hidden files, scenes, and a store that an interrupted run has only begun."""
    return path.name.startswith(".") or path.name.endswith(INPUTS) or (path.name == STORE and not any(path.iterdir()))


def _has_results(out: Path) -> bool:
    """Whether a summary of this program lies in a folder whose store was deleted."""
    try:
        summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(summary, dict) and {"scene", "stages", "curves"} <= set(summary)

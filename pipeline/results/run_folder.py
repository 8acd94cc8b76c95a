"""The output folder of a run as an input: which files it holds, from its summary."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.errors import input_error, reason_of

SUMMARY, RESPONSE = "summary.json", "response.h5"
_ALLOWED = "the output folder of a run, with summary.json"


@dataclass(frozen=True)
class ModelFiles:
    """A reduced model of a run: its file, its mesh (None: from elsewhere), and its entry of the summary."""

    rom: Path
    mesh: Path | None
    entry: dict[str, Any]


def read_run_summary(folder: Path) -> dict[str, Any]:
    """The summary of a run.

    Raises
    ------
    InputError
        There is none in the folder, or it cannot be read.
    """
    try:
        found = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
        return {**found, "models": list(found["models"]), "curves": list(found["curves"])}
    except FileNotFoundError:
        raise input_error(folder, "", f"holds no {SUMMARY}", _ALLOWED) from None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise input_error(folder, "", f"{SUMMARY} cannot be read: {reason_of(error)}", _ALLOWED) from None


def models_of_run(folder: Path) -> list[ModelFiles]:
    """The reduced models of a run in the order of the summary.

    Raises
    ------
    InputError
        As `read_run_summary`, or the run has no reduced model.
    """
    entries = [entry for entry in read_run_summary(folder)["models"] if isinstance(entry.get("rom"), str)]
    if not entries:
        raise input_error(folder, "", "holds no reduced model", "a run of the stage reduce or a later one")
    found = []
    for entry in entries:
        mesh = entry.get("mesh")
        found.append(ModelFiles(folder / entry["rom"], folder / mesh if isinstance(mesh, str) else None, entry))
    return found


def response_of_run(folder: Path) -> Path:
    """The response of a run.

    Raises
    ------
    InputError
        The folder holds none.
    """
    read_run_summary(folder)
    if not (folder / RESPONSE).is_file():
        raise input_error(folder, "", f"holds no {RESPONSE}", "a run of the stage respond or a later one")
    return folder / RESPONSE

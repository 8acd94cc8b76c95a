"""The output folder of a run as an input: its summary, which is checked first, and the files that it names.

response.h5 is read piece by piece and stays open, whatever a run puts in its place.
"""

from __future__ import annotations

import errno
import hashlib
import os
import platform
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, ValidationError, ValidationInfo, model_validator

from pipeline.errors import InputError, input_error, reason_of, shown
from pipeline.scene.reading import SceneFile
from pipeline.store.content_store import read_json
from pipeline.store.output_folder import STORE, is_store, path_inside

if TYPE_CHECKING:
    import h5py


COMPARED_WHOLE = 64_000_000  # bytes of a file whose hash is compared too
TABLE_HASH = "table_hash"  # attribute of response.h5, and key in summary.json


class PointReader:
    """An open response.h5 that belongs to a summary."""

    def __init__(self, path: Path, table_hash: str, sha256: str) -> None:
        self._path, self._table_hash, self._sha256 = path, table_hash, sha256
        if not path.is_file():
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
        self._raw = path.open("rb")
        self._file: h5py.File | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {"path": self._path, "table_hash": self._table_hash, "sha256": self._sha256}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(**state)  # type: ignore[misc]  # a process that gets it opens the file itself

    @property
    def file(self) -> h5py.File:
        """The open file."""
        if self._file is None:
            import h5py

            large = self._path.stat().st_size > COMPARED_WHOLE
            if not large and hashlib.file_digest(self._raw, "sha256").hexdigest() != self._sha256:
                raise ValueError(f"summary.json and {self._path.name} are not of one run")
            file = h5py.File(self._raw, "r")
            if file.attrs.get(TABLE_HASH) != self._table_hash:
                raise ValueError(f"summary.json and {self._path.name} are not of one run")
            self._file = file
        return self._file

    def curve(self, number: int) -> h5py.Group | None:
        """The group of a curve; None where it has no points."""
        found: h5py.Group | None = self.file["curve"].get(str(number))
        return found


def origin() -> dict[str, str]:
    """Version, date (UTC) and host of the moment."""
    return {
        "program": f"shroud {_version()}",
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "host": platform.node(),
    }


def provenance(scene: SceneFile) -> dict[str, str]:
    """Version, date (UTC), host, name of the scene file and its text, for files that a run publishes.

    They are no inputs of a result, so nothing is computed again because of them.
    """
    return origin() | {"scene_file": scene.path.name, "scene": scene.text}


def _version() -> str:
    try:
        return version("shroud")
    except PackageNotFoundError:  # a copy of the source that is not installed
        return "of unknown version"


SUMMARY, RESPONSE = "summary.json", "response.h5"
_UNFINISHED = (
    "this one has none so far (a run that was killed, or a command of one study): shroud run goes on from there"
)
_ALLOWED = "the output folder of a run, with summary.json"


def _inside(text: str, info: ValidationInfo) -> str:
    path_inside(Path(info.context or "."), text)
    return text


_File = Annotated[str, AfterValidator(_inside)]  # relative to the output folder, and in it


class _Part(BaseModel):
    """Keys of summary.json that are read; others may stand beside them."""

    model_config = ConfigDict(strict=True, extra="allow", allow_inf_nan=False)


class _Model(_Part):
    rom: _File | None = None
    mesh: _File | None = None
    free_hz: list[float] | None = None


class _Curve(_Part):
    rom: _File | None = None
    complete: bool = False
    reason: str = ""


class _Stored(_Part):
    file: _File


class _Summary(_Part):
    scene: str = ""
    complete: bool
    problems: list[str]
    seconds: float = 0.0
    stages: dict[str, dict[str, Any]] = {}
    curves: list[_Curve] | None = None
    models: list[_Model] = []
    campbell: list[dict[str, Any]] = []
    pictures: list[_File] = []
    stress: list[_Stored] = []
    studies: dict[str, _Stored] = {}
    report: _File | None = None
    response: dict[str, str] | None
    table_hash: str | None = None

    @model_validator(mode="after")
    def _names_the_response(self) -> Self:
        if self.response is not None and (RESPONSE not in self.response or self.table_hash is None):
            raise ValueError(f"response and table_hash with the hashes of {RESPONSE}")
        return self


@dataclass(frozen=True)
class ModelFiles:
    """A reduced model of a run: its file, its mesh (None: from elsewhere), and its entry of the summary."""

    rom: Path
    mesh: Path | None
    entry: dict[str, Any]


def read_run_summary(folder: Path) -> dict[str, Any]:
    """The summary of a run, whatever was done to its file: values of the right kinds, and files inside the folder."""
    try:
        found: dict[str, Any] = read_json(folder / SUMMARY)
        _Summary.model_validate(found, context=folder)
    except FileNotFoundError:
        allowed = f"{_ALLOWED}; {_UNFINISHED}" if is_store(folder / STORE) else _ALLOWED
        raise input_error(folder, "", f"holds no {SUMMARY}", allowed) from None
    except ValidationError as error:
        raise _refusal(folder, error) from None
    except (OSError, ValueError) as error:
        raise input_error(folder, "", f"{SUMMARY} cannot be read: {reason_of(error)}", _ALLOWED) from None
    return {"models": [], **found}


def read_json_of_run(folder: Path, name: str) -> Any:
    """A further JSON file of a run."""
    try:
        return read_json(path_inside(folder, name))
    except (OSError, ValueError) as error:
        raise input_error(folder, "", f"{name} cannot be read: {reason_of(error)}", _ALLOWED) from None


def _refusal(folder: Path, error: ValidationError) -> InputError:
    """One line on the first value that is wrong."""
    first = error.errors(include_url=False)[0]
    key, cause = ".".join(map(str, first["loc"])), first.get("ctx", {}).get("error")
    found = "missing" if first["type"] == "missing" else shown(first["input"])
    place = f"{SUMMARY}: {key}" if key else SUMMARY
    return input_error(folder, place, found, str(cause or f"{_ALLOWED} as it wrote it"))


def models_of_run(folder: Path) -> list[ModelFiles]:
    """The reduced models of a run in the order of the summary."""
    entries = [entry for entry in read_run_summary(folder)["models"] if entry.get("rom")]
    if not entries:
        raise input_error(folder, "", "holds no reduced model", "a run of the stage reduce or a later one")
    return [
        ModelFiles(folder / entry["rom"], folder / entry["mesh"] if entry.get("mesh") else None, entry)
        for entry in entries
    ]


def response_of_run(folder: Path) -> Path:
    """The response of a run."""
    read_run_summary(folder)
    if not (folder / RESPONSE).is_file():
        raise input_error(folder, "", f"holds no {RESPONSE}", "a run of the stage respond or a later one")
    return folder / RESPONSE

"""Reading the file to export: a response or a reduced model."""

from __future__ import annotations

from collections.abc import Iterator
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.errors import input_error
from pipeline.process.isolated_reading import read_apart
from pipeline.stages.curve.curve_file import BRANCHES
from rom.files.hdf5 import UNREADABLE, opened, stored_array, why_unreadable

if TYPE_CHECKING:
    import h5py

Curve = tuple[str, dict[str, Any], dict[str, Any]]
WAVES = "nodal_diameter"  # group of a reduced model with a superelement for each nodal diameter
_ALLOWED = "an HDF5 file with a response (response.h5) or a reduced model (rom.h5)"


class Kind(StrEnum):
    """Kind of a file."""

    response = "response"
    model = "reduced model"


def kind_of(path: Path) -> Kind:
    """Whether the file holds a response or a reduced model."""
    return read_apart(path, _ALLOWED, lambda: _kind(path))


def _kind(path: Path) -> Kind:
    if not path.is_file():
        raise input_error(path, "", "no such file")
    try:
        with opened(path) as file:
            names = set(file)
    except UNREADABLE as error:
        raise input_error(path, "", f"cannot be read: {why_unreadable(error)}", _ALLOWED) from None
    if not names & {"curve", "mass", WAVES}:
        raise input_error(path, "", f"holds {', '.join(sorted(names)[:8]) or 'nothing'}", _ALLOWED)
    return Kind.response if "curve" in names else Kind.model


def curves(path: Path) -> list[Curve]:
    """Name, datasets and attributes of every curve and detached branch of a response, in their order.

    A branch has a name such as `0/branch/1` and the attributes of its curve.
    """
    return read_apart(path, _ALLOWED, lambda: list(_curves(path)))


def _curves(path: Path) -> Iterator[Curve]:
    try:
        with opened(path) as file:
            for name in sorted(file["curve"], key=int):
                group = file[f"curve/{name}"]
                attributes = {key: _plain(value) for key, value in group.attrs.items()}
                yield name, _datasets(group), attributes
                for number in sorted(group.get(BRANCHES, ()), key=int):
                    yield f"{name}/{BRANCHES}/{number}", _datasets(group[f"{BRANCHES}/{number}"]), attributes
    except UNREADABLE as error:
        raise input_error(path, "", f"cannot be read: {why_unreadable(error)}", _ALLOWED) from None


def _datasets(group: h5py.Group) -> dict[str, Any]:
    return {name: stored_array(group[name]) for name in group if hasattr(group[name], "dtype")}


def _plain(value: Any) -> Any:
    if isinstance(value, bytes):
        return value.decode()
    return value.item() if isinstance(value, np.generic) else value

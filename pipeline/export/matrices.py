"""Matrices of a reduced model as Nastran OP4, Matrix Market, Abaqus and MATLAB 7.3 files."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError, input_error, reason_of
from pipeline.export.source import WAVES, Kind, kind_of
from pipeline.process.isolated_reading import read_given_model
from rom import ReducedModel

FORMATS = ("matrix-market", "abaqus", "mat-7.3")  # that `--format` names; the others follow from the suffix
BY_SUFFIX = {".mtx": "matrix-market", ".op4": "op4", ".mat": "mat"}
# names of at most 8 characters for OP4
SHORT_NAMES = {
    "stiffness": "K",
    "mass": "M",
    "coriolis": "CORIOLIS",
    "contact_right": "CRIGHT",
    "contact_left": "CLEFT",
    "contact_position": "CPOS",
    "contact_area": "CAREA",
    "cyclic_right": "CYCRIGHT",
    "cyclic_left": "CYCLEFT",
    "blade_stiffness": "KBLADE",
    "force_excitation": "FEXC",
    "force_centrifugal": "FCENT",
    "force_static": "FSTATIC",
    "basis": "BASIS",
}
_LONGEST = 8


def matrix_format(target: Path, wanted: str | None) -> str | None:
    """The format of `write_matrix_files` for a target; None where its suffix or MATLAB level 5 is not one of them."""
    suffix = target.suffix.lower()
    if wanted is None:
        return BY_SUFFIX[suffix] if suffix in (".mtx", ".op4") else None
    suffixes = {"matrix-market": ".mtx", "abaqus": ".mtx", "mat-7.3": ".mat"}
    if wanted not in FORMATS or suffixes[wanted] != suffix:
        fitting = [name for name in FORMATS if suffixes[name] == suffix]
        raise input_error("--format", "", wanted, ", ".join(fitting) or f"nothing with {suffix}")
    return wanted


def write_matrix_files(source: Path, target: Path, file_format: str) -> tuple[str, list[Path]]:
    """Write the matrices of a reduced model; returns a summary in words and the files."""
    from rom import MatrixFileError, write_matrices

    if kind_of(source) is not Kind.model:
        raise input_error(source, "", "a response", "a reduced model (rom.h5)")
    model = single_model(source)
    content = arrays_of(model)
    if file_format == "op4":
        content = _short(content)
    elif file_format == "abaqus":
        content = {name: content[name] for name in ("stiffness", "mass")}
    try:
        files = write_matrices(target, content, file_format)
    except MatrixFileError as error:
        raise InputError(reason_of(error)) from None
    return f"a reduced model of {model.size} coordinates: {', '.join(content)}", files


def single_model(source: Path) -> ReducedModel:
    """A reduced model whose matrices are those of the whole ring."""
    model = read_given_model(source)
    if model.wave_blocks:
        allowed = "a reduced model with one pair of matrices"
        raise input_error(source, WAVES, "a superelement for each nodal diameter", allowed)
    return model


def arrays_of(model: ReducedModel) -> dict[str, NDArray[Any]]:
    """All arrays of a reduced model by name; those of a mapping as `outputs_NAME`, `output_` for short."""
    found: dict[str, NDArray[Any]] = {}
    for field in fields(model):
        value = getattr(model, field.name)
        if isinstance(value, np.ndarray):
            found[field.name] = value
        elif isinstance(value, Mapping) and field.name != "wave_blocks":
            prefix = "output" if field.name == "outputs" else field.name
            found |= {f"{prefix}_{name}": np.asarray(array) for name, array in value.items()}
    return {name: value for name, value in found.items() if value.size}


def _short(content: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """The same with names of at most 8 characters; those without a known one are numbered."""
    short: dict[str, NDArray[Any]] = {}
    for name, value in content.items():
        new = SHORT_NAMES.get(name, name.removeprefix("output_").upper())
        if len(new) > _LONGEST or new in short:
            new = f"X{len(short):03d}"
        short[new] = value
    return short


def moved(files: list[Path], beside: Path, target: Path) -> list[Path]:
    """Files written beside their target in its place, by their name."""
    placed = []
    for file in files:
        place = target.with_name(file.name.replace(beside.stem, target.stem, 1))
        os.replace(file, place)
        placed.append(place)
    return placed

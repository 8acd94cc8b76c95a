"""Reduced models as HDF5 files, an open format: models of other programs are read too (docs/outputs.md)."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rom.cyclic.reduced_model import ReducedModel
from rom.errors import ReducedModelError
from rom.files.hdf5_reading import UNREADABLE, opened, stored_array, why_unreadable
from rom.files.hdf5_writing import new_hdf5

if TYPE_CHECKING:
    import h5py

FORMAT = "1"
_HARMONIC_FORCE = "force/excitation_"  # and the number of the harmonic
LARGEST_MODEL = 20_000  # coordinates: matrices of 3 GB, all of whose modes are computed
_OPTIONAL = {
    "contact_left": "contact/left",
    "contact_area": "contact/area",
    "force_centrifugal": "force/centrifugal",
    "force_static": "force/static",
    "coriolis": "coriolis",
    "cyclic_right": "cyclic/right",
    "cyclic_left": "cyclic/left",
    "basis": "basis",
}
_CONTACT = ("contact/position", "contact/right", "contact/left")
_MATRICES = ("mass", "stiffness", *_CONTACT, "coriolis", "cyclic/right", "cyclic/left", "basis")
_REQUIRED = {
    "mass": "mass",
    "stiffness": "stiffness",
    "contact_right": "contact/right",
    "contact_position": "contact/position",
    "force_excitation": "force/excitation",
}


def write_reduced_model(path: str | os.PathLike[str], model: ReducedModel) -> None:
    """Write a reduced model to an HDF5 file, one dataset for each array that the model has.

    Parameters
    ----------
    path : str or path
        The file.
    model : ReducedModel
        The model.

    Examples
    --------
    >>> from rom import ReducedModel, opened, write_reduced_model
    >>> n, one = np.array([[0.0], [0.0], [1.0]]), np.ones(1)
    >>> model = ReducedModel(np.eye(1), 1e6 * np.eye(1), n, np.zeros((1, 3)), one, {"tip": one})
    >>> write_reduced_model("rom.h5", model)
    >>> with opened("rom.h5") as file:
    ...     print(*sorted(file))
    contact force mass output stiffness
    """
    with new_hdf5(path) as file:
        for attribute, name in (_REQUIRED | _OPTIONAL).items():
            array = getattr(model, attribute)
            if array is not None:
                file.create_dataset(name, data=array, track_times=False)
        for name, vector in model.outputs.items():
            file.create_dataset(f"output/{name}", data=vector, track_times=False)
        for h, force in model.force_harmonics.items():
            file.create_dataset(f"{_HARMONIC_FORCE}{h}", data=force, track_times=False)
        file.attrs["format"] = FORMAT
        file.attrs["producer"] = model.producer
        if model.n_blades is not None:
            file.attrs["n_blades"] = model.n_blades
        if model.speed_rpm is not None:
            file.attrs["speed_rpm"] = model.speed_rpm


def read_reduced_model(path: str | os.PathLike[str], *, with_basis: bool = True) -> ReducedModel:
    """Read a reduced model from an HDF5 file.

    Parameters
    ----------
    path : str or path
        The file.
    with_basis : bool
        False leaves out the basis, which is large and only needed to expand shapes to the mesh.

    Returns
    -------
    ReducedModel
        The model.

    Raises
    ------
    ReducedModelError
        The file cannot be read, a dataset is missing, or the model is inconsistent; the message names the file and
        the dataset.

    Examples
    --------
    >>> from rom import ReducedModel, read_reduced_model, write_reduced_model
    >>> n, one = np.array([[0.0], [0.0], [1.0]]), np.ones(1)
    >>> model = ReducedModel(np.eye(1), 1e6 * np.eye(1), n, np.zeros((1, 3)), one, {"tip": one}, n_blades=40)
    >>> write_reduced_model("rom.h5", model)
    >>> print(read_reduced_model("rom.h5").stiffness, read_reduced_model("rom.h5").n_blades)
    [[1000000.]] 40
    """
    if not Path(path).is_file():
        raise ReducedModelError(f"{path}: no such file, allowed: an HDF5 file with a reduced model")
    try:
        with opened(path) as file:
            arguments = _read_arguments(file, with_basis)
        return ReducedModel(**arguments)
    except ReducedModelError as error:
        raise ReducedModelError(f"{path}: {error}") from None
    except UNREADABLE as error:
        raise ReducedModelError(f"{path}: not readable as a reduced model: {why_unreadable(error)}") from None


def _read_arguments(file: "h5py.File", with_basis: bool) -> dict[str, Any]:
    version = _text(file.attrs.get("format", "absent"))
    if version != FORMAT:
        raise ReducedModelError(f"attribute format: {version!r}, allowed: {FORMAT!r}")
    arguments: dict[str, Any] = {
        attribute: _read_array(file, name, complex_allowed=attribute == "force_excitation")
        for attribute, name in _REQUIRED.items()
    }
    for attribute, name in _OPTIONAL.items():
        if file.get(name, getlink=True) is not None and (with_basis or attribute != "basis"):
            arguments[attribute] = _read_array(file, name)
    if "output" not in file or not hasattr(file["output"], "keys"):
        raise ReducedModelError("output: missing; group output must hold the dataset tip")
    arguments["outputs"] = {name: _read_array(file, f"output/{name}") for name in file["output"]}
    arguments["force_harmonics"] = {
        h: _read_array(file, f"{_HARMONIC_FORCE}{h}", complex_allowed=True) for h in _harmonics(file)
    }
    if "n_blades" in file.attrs:
        arguments["n_blades"] = _whole_number("n_blades", file.attrs["n_blades"])
    if "speed_rpm" in file.attrs:
        arguments["speed_rpm"] = _number("speed_rpm", file.attrs["speed_rpm"])
    arguments["producer"] = _text(file.attrs.get("producer", "unknown"))
    return arguments


def _harmonics(file: "h5py.File") -> list[int]:
    """Harmonics with a force of their own: numbers behind the name of the excitation."""
    group, _, start = _HARMONIC_FORCE.partition("/")
    names = [name for name in file[group] if name.startswith(start)]
    for name in names:
        if not name[len(start) :].isdecimal():
            raise ReducedModelError(f"{group}/{name}: allowed: {_HARMONIC_FORCE}2 and higher whole numbers")
    return sorted(int(name[len(start) :]) for name in names)


def _read_array(file: "h5py.File", name: str, complex_allowed: bool = False) -> np.ndarray:
    try:
        return _array(file, name, complex_allowed)
    except ReducedModelError:
        raise
    except UNREADABLE as error:
        raise ReducedModelError(f"{name}: not readable: {why_unreadable(error)}") from None


def _array(file: "h5py.File", name: str, complex_allowed: bool) -> np.ndarray:
    dataset = file.get(name)  # None for a broken link
    if dataset is None or not hasattr(dataset, "dtype"):
        raise ReducedModelError(f"{name}: missing dataset")
    kinds = "iufc" if complex_allowed else "iuf"
    if dataset.dtype.kind not in kinds:
        raise ReducedModelError(
            f"{name}: type {dataset.dtype}, allowed: real{' or complex' * complex_allowed} numbers"
        )
    # the shape checks of the model raise an IndexError for an array of the wrong dimension
    wanted = 2 if name in _MATRICES else 1
    if len(dataset.shape or ()) != wanted:
        raise ReducedModelError(f"{name}: shape {dataset.shape}, allowed: an array of {wanted} dimension(s)")
    if max(dataset.shape[-1:] if name == "basis" else dataset.shape) > LARGEST_MODEL:
        raise ReducedModelError(f"{name}: shape {dataset.shape}, allowed: {LARGEST_MODEL} coordinates at most")
    return stored_array(dataset).astype(np.complex128 if dataset.dtype.kind == "c" else np.float64)


def _whole_number(name: str, value: Any) -> int:
    number = _number(name, value, "a whole number")
    if number % 1 != 0:
        raise ReducedModelError(f"attribute {name}: {_text(value)[:80]!r}, allowed: a whole number")
    return int(number)


def _number(name: str, value: Any, allowed: str = "a finite number") -> float:
    number = np.asarray(value)
    if number.size != 1 or number.dtype.kind not in "iuf" or not np.isfinite(number).all():
        raise ReducedModelError(f"attribute {name}: {_text(value)[:80]!r}, allowed: {allowed}")
    return float(number.reshape(-1)[0])


def _text(value: Any) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)

"""Reduced models as HDF5 files, an open format: models of other programs are read too (docs/outputs.md)."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rom.cyclic.reduced_model import MAIN_INTERFACE, ReducedModel
from rom.cyclic.wave_superelement import WaveSuperelement, model_of_waves, superelements_of
from rom.errors import ReducedModelError
from rom.files.hdf5 import UNREADABLE, new_hdf5, opened, stored_array, why_unreadable

if TYPE_CHECKING:
    import h5py

FORMAT = "1"
_HARMONIC_FORCE = "force/excitation_"  # and the number of the harmonic
LARGEST_MODEL = 20_000  # coordinates: matrices of 3 GB, all of whose modes are computed
_OPTIONAL = {
    "contact_left": "contact/left",
    "contact_area": "contact/area",
    "contact_frame": "contact/frame",
    "force_centrifugal": "force/centrifugal",
    "force_static": "force/static",
    "coriolis": "coriolis",
    "cyclic_right": "cyclic/right",
    "cyclic_left": "cyclic/left",
    "blade_stiffness": "blade_stiffness",
    "basis": "basis",
}
_WAVE = "nodal_diameter"  # group of a superelement for each
_OF_A_WAVE = (
    "mass",
    "stiffness",
    "contact_right",
    "contact_left",
    "force_excitation",
    "force_centrifugal",
    "force_static",
    "basis",
)
_CONTACT = ("contact/position", "contact/right", "contact/left")
_MATRICES = ("mass", "stiffness", *_CONTACT, "coriolis", "cyclic/right", "cyclic/left", "blade_stiffness", "basis")
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
    >>> import h5py
    >>> from rom import ReducedModel, write_reduced_model
    >>> n, one = np.array([[0.0], [0.0], [1.0]]), np.ones(1)
    >>> model = ReducedModel(np.eye(1), 1e6 * np.eye(1), n, np.zeros((1, 3)), one, {"tip": one})
    >>> write_reduced_model("rom.h5", model)
    >>> with h5py.File("rom.h5") as file:
    ...     print(*sorted(file))
    contact force mass output stiffness
    """
    with new_hdf5(path) as file:
        if model.wave_blocks:
            _write_arrays(file, model, ("contact_position", "contact_area", "contact_frame"))
            for n, wave in superelements_of(model).items():
                _write_arrays(file.create_group(f"{_WAVE}/{n}"), wave, _OF_A_WAVE)
        else:
            _write_arrays(file, model, (*_REQUIRED, *_OPTIONAL))
        file.attrs["format"] = FORMAT
        file.attrs["producer"] = model.producer
        if model.n_blades is not None:
            file.attrs["n_blades"] = model.n_blades
        if model.speed_rpm is not None:
            file.attrs["speed_rpm"] = model.speed_rpm
        if tuple(model.interfaces) != (MAIN_INTERFACE,):
            file["contact"].attrs["interfaces"] = list(model.interfaces)
            file["contact"].attrs["nodes"] = list(model.interfaces.values())


def _write_arrays(group: "h5py.Group", model: ReducedModel | WaveSuperelement, attributes: Iterable[str]) -> None:
    """The arrays of these attributes that the model has, and with its matrices its outputs and forces by harmonic."""
    names = _REQUIRED | _OPTIONAL
    for attribute in attributes:
        array = getattr(model, attribute)
        if array is not None:
            group.create_dataset(names[attribute], data=array, track_times=False)
    if "mass" in attributes:
        for name, vector in model.outputs.items():
            group.create_dataset(f"output/{name}", data=vector, track_times=False)
        for h, force in model.force_harmonics.items():
            group.create_dataset(f"{_HARMONIC_FORCE}{h}", data=force, track_times=False)


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
        raise ReducedModelError(f"{path}: no such file")
    try:
        with opened(path) as file:
            if _WAVE in file:
                return _read_waves(file, with_basis)
            arguments = _read_arguments(file, with_basis)
        return ReducedModel(**arguments)
    except ReducedModelError as error:
        raise ReducedModelError(f"{path}: {error}") from None
    except UNREADABLE as error:
        raise ReducedModelError(f"{path}: not readable as a reduced model: {why_unreadable(error)}") from None


def _read_waves(file: "h5py.File", with_basis: bool) -> ReducedModel:
    """A model of one superelement for each nodal diameter, group nodal_diameter/N."""
    from dataclasses import replace

    _check_version(file)
    if not hasattr(file[_WAVE], "keys"):
        raise ReducedModelError(f"{_WAVE}: a dataset, allowed: a group for each nodal diameter")
    waves = {}
    for number in file[_WAVE]:
        if not number.isdecimal():
            raise ReducedModelError(f"{_WAVE}/{number}: allowed: whole numbers, 0 and up")
        where = f"{_WAVE}/{number}"
        arguments: dict[str, Any] = {"contact_left": None}
        for attribute in _OF_A_WAVE:
            name = f"{where}/{(_REQUIRED | _OPTIONAL)[attribute]}"
            if attribute in _REQUIRED or (
                file.get(name, getlink=True) is not None and (with_basis or attribute != "basis")
            ):
                arguments[attribute] = _read_array(file, name, complex_allowed=not attribute.startswith("force_s"))
        waves[int(number)] = WaveSuperelement(**arguments, **_outputs_and_harmonics(file, f"{where}/", True))
    area, frame = (_read_array(file, name) if name in file else None for name in ("contact/area", "contact/frame"))
    if "n_blades" not in file.attrs:
        raise ReducedModelError(f"attribute n_blades: missing, needed with {_WAVE}")
    n_blades = _whole_number("n_blades", file.attrs["n_blades"])
    made = model_of_waves(waves, n_blades, _read_array(file, "contact/position"), area)
    speed = _number("speed_rpm", file.attrs["speed_rpm"]) if "speed_rpm" in file.attrs else None
    producer = _text(file.attrs.get("producer", "unknown"))
    return replace(made, speed_rpm=speed, producer=producer, interfaces=_interfaces(file), contact_frame=frame)


def _outputs_and_harmonics(file: "h5py.File", where: str, complex_outputs: bool) -> dict[str, Any]:
    """Outputs, and forces of the harmonics that have their own, below a group `where` ("" or with / at its end)."""
    group = f"{where}output"
    if group not in file or not hasattr(file[group], "keys"):
        raise ReducedModelError(f"{group}: missing; group output must hold the dataset tip")
    forces = f"{where}{_HARMONIC_FORCE}"
    return {
        "outputs": {name: _read_array(file, f"{group}/{name}", complex_outputs) for name in file[group]},
        "force_harmonics": {h: _read_array(file, f"{forces}{h}", True) for h in _harmonics(file, forces)},
    }


def _check_version(file: "h5py.File") -> None:
    version = _text(file.attrs.get("format", "absent"))
    if version != FORMAT:
        raise ReducedModelError(f"attribute format: {version!r}, allowed: {FORMAT!r}")


def _read_arguments(file: "h5py.File", with_basis: bool) -> dict[str, Any]:
    _check_version(file)
    arguments: dict[str, Any] = {
        attribute: _read_array(file, name, complex_allowed=attribute == "force_excitation")
        for attribute, name in _REQUIRED.items()
    }
    for attribute, name in _OPTIONAL.items():
        if file.get(name, getlink=True) is not None and (with_basis or attribute != "basis"):
            arguments[attribute] = _read_array(file, name)
    arguments |= _outputs_and_harmonics(file, "", False)
    if "n_blades" in file.attrs:
        arguments["n_blades"] = _whole_number("n_blades", file.attrs["n_blades"])
    if "speed_rpm" in file.attrs:
        arguments["speed_rpm"] = _number("speed_rpm", file.attrs["speed_rpm"])
    arguments["producer"] = _text(file.attrs.get("producer", "unknown"))
    arguments["interfaces"] = _interfaces(file)
    return arguments


def _interfaces(file: "h5py.File") -> dict[str, int]:
    """Interfaces by name with their numbers of nodes, attributes of the group contact; one may have none."""
    given = file["contact"].attrs
    if "interfaces" not in given:
        return {}
    names = [_text(name) for name in np.atleast_1d(given["interfaces"])]
    nodes = np.atleast_1d(given.get("nodes", ()))
    if len(set(names)) != len(nodes) or nodes.dtype.kind not in "iu" or "" in names:
        raise ReducedModelError(
            f"contact/interfaces: {names[:9]} with {nodes.tolist()[:9]} nodes, allowed: names, each once, and in "
            "contact/nodes a whole number for each"
        )
    return dict(zip(names, map(int, nodes), strict=True))


def _harmonics(file: "h5py.File", names_of_forces: str) -> list[int]:
    """Harmonics with a force of their own: numbers behind the name of the excitation."""
    group, _, start = names_of_forces.rpartition("/")
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
    short = name.split("/", 2)[-1] if name.startswith(f"{_WAVE}/") else name
    wanted = 3 if short == "contact/frame" else 2 if short in _MATRICES else 1
    if len(dataset.shape or ()) != wanted:
        raise ReducedModelError(f"{name}: shape {dataset.shape}, allowed: an array of {wanted} dimension(s)")
    if max(dataset.shape[-1:] if short == "basis" else dataset.shape) > LARGEST_MODEL:
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

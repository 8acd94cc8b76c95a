"""What an HDF5 file of this program holds, in a few lines."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.curve import CurveFacts, read_facts
from pipeline.errors import InputError, input_error, one_line, reason_of
from pipeline.reading import read_apart, read_model

if TYPE_CHECKING:
    import h5py

    from rom import ReducedModel

_ALLOWED = "an HDF5 file with a response (response.h5) or a reduced model (rom.h5)"


def describe(path: Path) -> list[str]:
    """The contents of a response or of a reduced model.

    Raises
    ------
    InputError : the file cannot be read or is neither.
    """
    found = read_apart(path, _ALLOWED, lambda: _read(path))
    return found if isinstance(found, list) else _reduced_model(path, found)


def _read(path: Path) -> list[str] | ReducedModel:
    """What is to be said of a response, or the reduced model."""
    from geometry import UNREADABLE, opened, why_unreadable

    if not path.is_file():
        raise input_error(path, "", "no such file", _ALLOWED)
    try:
        with opened(path) as file:
            if "curve" in file:
                return [f"{path}: response, {len(file['curve'])} curves", *_curves(file["curve"])]
            if "mass" not in file:
                raise input_error(path, "", f"holds {', '.join(list(file)[:8]) or 'nothing'}", _ALLOWED)
    except UNREADABLE as error:
        raise input_error(path, "", f"cannot be read: {why_unreadable(error)}", _ALLOWED) from None
    return read_model(path)


def _curves(group: h5py.Group) -> Iterator[str]:
    for name in sorted(group, key=lambda n: (len(n), n)):
        attributes, facts = group[name].attrs, read_facts(group[name])
        yield one_line(f"curve/{name}: {_outcome(facts)}")
        outcome = set(CurveFacts.__dataclass_fields__)
        values = (f"{key} = {attributes[key]}" for key in sorted(attributes) if key not in outcome)
        yield one_line("  " + ", ".join(values))


def _outcome(facts: CurveFacts) -> str:
    end = "complete" if facts.complete else f"incomplete ({facts.reason})"
    return (
        f"{end}, {facts.points} points, {facts.harmonics} harmonics, "
        f"peak {facts.peak_amplitude_m:.6g} m at {facts.peak_frequency_hz:.6g} Hz"
    )


def _reduced_model(path: Path, model: ReducedModel) -> list[str]:
    from rom import ReducedModelError, natural_frequencies

    try:
        free = natural_frequencies(model, 0.0, count=min(10, model.size))
    except ReducedModelError as error:
        raise InputError(f"{path}: {reason_of(error)}") from None
    lines = [
        f"{path}: reduced model by {model.producer}, {model.size} coordinates",
        f"ring: {'single structure' if model.n_blades is None else f'{model.n_blades} blades'}",
        f"contact: {model.n_contacts} nodes {'against ground' if model.contact_left is None else 'a face'}",
        f"outputs: {', '.join(model.outputs)}",
        f"optional: {', '.join(_optional(model)) or 'none'}",
        f"free natural frequencies [Hz]: {', '.join(f'{hz:.6g}' for hz in free)}",
    ]
    return [one_line(line) for line in lines]


def _optional(model: ReducedModel) -> list[str]:
    arrays = {
        "basis": model.basis,
        "contact/area": model.contact_area,
        "force/centrifugal": model.force_centrifugal,
        "force/static": model.force_static,
    }
    return [name for name, array in arrays.items() if array is not None]

"""File of a response curve: one HDF5 file in the layout of a group of response.h5, written and read."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from pipeline.scene.loads_section import ExcitationHarmonic
from pipeline.stages.curve_summary import RESIDUAL_BOUNDS, summary_attributes

if TYPE_CHECKING:
    import h5py

    from nonlinear import ResidualBounds, ResponseCurve
    from pipeline.scene.fields import Section
    from pipeline.scene.schema import Contact, Scene

S = TypeVar("S", bound="Section")
CURVE = "curve.h5"
# Name of a column and of a dataset -> attribute of `ResponseCurve`; harmonic_1_m ... follow amplitude_m.
COLUMNS = {
    "frequency_hz": "frequency_hz",
    "amplitude_m": "amplitude_m",
    "static_m": "static_m",
    "phase_rad": "phase_rad",
    "stable": "stable",
    "sticking": "sticking",
    "slipping": "slipping",
    "separating": "separating",
    "dissipated_j": "dissipated_j",
    "iterations": "iterations",
    "arc": "arc",
    "kept_harmonics": "kept_harmonics",
    "growth_rate": "growth_rate",
    "growth_nodal_diameter": "growth_nodal_diameter",
}
HARMONICS = "excitation.harmonic"  # attribute: the harmonics of the excitation as JSON
OUTPUT, AMPLITUDE = "output_", "amplitude_"  # datasets of a further output, and its name
RESIDUAL = "residual"  # group of the bounds over residual tractions
BRANCHES = "branch"  # group of the detached branches of a curve: branch/1, branch/2, ...


def used_parameters(scene: Scene, contact: Contact, parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Every parameter that the solution used, by dotted key, and the swept ones of other stages."""
    response = scene.response.model_dump(exclude_none=True)
    values: dict[str, Any] = {f"contact.{key}": value for key, value in contact.model_dump().items()}
    values |= {f"response.{key}": value for key, value in response.items()}
    values["excitation.engine_order"] = scene.excitation.engine_order
    values["excitation.force"] = scene.excitation.force
    if scene.excitation.harmonic:
        values[HARMONICS] = json.dumps([item.model_dump() for item in scene.excitation.harmonic])
    values["load.speed_rpm"] = scene.load.speed_rpm
    return {key: value for key, value in parameters.items() if key not in values} | values


def section_from_attributes(kind: type[S], attributes: Mapping[str, Any]) -> S:
    """A section of the scene with the values that a curve was solved with, from the attributes of its file."""
    prefix = f"{kind.__name__.lower()}."
    values = {key.removeprefix(prefix): attributes[key] for key in attributes if key.startswith(prefix)}
    plain = {name: _scene_value(value) for name, value in values.items()}
    if HARMONICS in attributes:
        given = json.loads(attributes[HARMONICS])
        plain |= {"harmonic": tuple(ExcitationHarmonic(**item) for item in given)} if prefix == "excitation." else {}
    return kind.model_construct(**plain)


def _scene_value(value: Any) -> Any:
    """An attribute as the scene has it: Python numbers, lists as tuples."""
    plain = value.tolist() if hasattr(value, "tolist") else value
    return tuple(plain) if isinstance(plain, list) else plain


def write_curve(path: Path, response: ResponseCurve, parameters: Mapping[str, Any]) -> None:
    """Write columns, complex coefficients, parameters and summary of a solved curve."""
    from rom import new_hdf5

    with new_hdf5(path) as file:
        _write_points(file, response)
        for key, value in [*parameters.items(), *summary_attributes(response).items()]:
            file.attrs[key] = value
        if response.residual_bounds is not None:
            _write_residual_bounds(file.create_group(RESIDUAL), response.residual_bounds)
        for number, branch in enumerate(response.detached, start=1):
            write_branch(file.create_group(f"{BRANCHES}/{number}"), branch)


def _write_residual_bounds(group: h5py.Group, bounds: ResidualBounds) -> None:
    """Write the band, and of each bound its tractions and its curve."""
    for name in ("band_index", "band_lowest_m", "band_highest_m"):
        group.create_dataset(name, data=getattr(bounds, name), track_times=False)
    for bound in RESIDUAL_BOUNDS:
        extreme, found = getattr(bounds, bound), group.create_group(bound)
        for name in ("slider_origin", "traction"):
            found.create_dataset(name, data=getattr(extreme, name), track_times=False)
        for name in ("frequency_hz", "amplitude_m"):
            found.create_dataset(name, data=getattr(extreme, f"curve_{name}"), track_times=False)


def write_branch(group: h5py.Group, branch: ResponseCurve) -> None:
    """Write the points of a detached branch and their summary."""
    _write_points(group, branch)
    for key, value in summary_attributes(branch).items():
        group.attrs[key] = value


def _write_points(group: h5py.Group, response: ResponseCurve) -> None:
    import numpy as np

    for column, attribute in COLUMNS.items():
        group.create_dataset(column, data=np.asarray(getattr(response, attribute)), track_times=False)
    harmonics = np.asarray(response.harmonic_m)
    for h in range(harmonics.shape[1]):
        group.create_dataset(f"harmonic_{h + 1}_m", data=harmonics[:, h], track_times=False)
    for name in ("relative_displacement", "contact_force", "output", "energy_error"):
        group.create_dataset(name, data=np.asarray(getattr(response, name)), track_times=False)
    for name, values in response.outputs.items():
        data = values[:, :, 0] if values.shape[2] == 1 else values
        group.create_dataset(f"{OUTPUT}{name}", data=data, track_times=False)
        group.create_dataset(f"{AMPLITUDE}{name}", data=response.amplitude_of(name), track_times=False)


def cell_value(value: Any) -> Any:
    """A swept value as a cell of a table holds it: a number, text, or a list written in brackets."""
    return json.dumps(list(value)) if isinstance(value, tuple | list) else value

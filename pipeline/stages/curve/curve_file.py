"""File of a response curve: a `ResponseCurve` written to HDF5 in the layout of a group of response.h5, read back, and
stored again with further branches.

Arrays of the curve are datasets under their names, numbers and words the attributes of its summary.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pipeline.codec import restored
from pipeline.scene.aero_section import AeroFamily
from pipeline.scene.contact_section import OF_INTERFACE, Contact
from pipeline.scene.dotted_keys import CONTACT, INTERFACE
from pipeline.scene.loads_section import ExcitationHarmonic, Load
from pipeline.scene.mesh_section import MAIN_INTERFACE
from pipeline.scene.response_section import Response
from pipeline.stages.cache_keys import rotation_of_response
from pipeline.stages.curve.curve_summary import (
    RESIDUAL_BOUNDS,
    CurveSummary,
    bound_of,
    read_summary,
    shared_fields,
    summary_attributes,
)
from pipeline.stages.scene_to_solver import InterfaceContact, damped_modes
from pipeline.store.fingerprints import content_fingerprint

if TYPE_CHECKING:
    import h5py

    from nonlinear.response_curve import ResidualBounds, ResponseCurve
    from pipeline.scene.fields import Section
    from pipeline.scene.schema import Scene
    from rom.cyclic.reduced_model import ReducedModel
    from rom.cyclic.sector_modes import RingModes


Array = NDArray[Any]
S = TypeVar("S", bound="Section")
CURVE = "curve.h5"
# Arrays of `ResponseCurve` that are columns of the CSV file, in their order; harmonic_1_m ... follow amplitude_m.
COLUMNS = (
    "frequency_hz",
    "amplitude_m",
    "static_m",
    "phase_rad",
    "stable",
    "sticking",
    "slipping",
    "separating",
    "dissipated_j",
    "iterations",
    "arc",
    "kept_harmonics",
    "growth_rate",
    "growth_nodal_diameter",
)
INTERFACES = "interfaces"  # attribute: name and number of nodes of each contact interface, where there are several
HARMONICS = "excitation.harmonic"  # attribute: the harmonics of the excitation as JSON
FLOW = "aero.family"  # attribute: the mode families of the flow as JSON
OUTPUT, AMPLITUDE = "output_", "amplitude_"  # datasets of a further output, and its name
RESIDUAL = "residual"  # group of the bounds over residual tractions
BRANCHES = "branch"  # group of the detached branches of a curve: branch/1, branch/2, ...
HARMONIC_COLUMNS = "harmonic_m"  # array of `ResponseCurve` with a dataset for each of its columns
_BAND = ("band_index", "band_lowest_m", "band_highest_m")  # arrays of `ResidualBounds`
_OF_BOUND = {  # datasets of a bound -> arrays of `ResidualExtreme`
    "slider_origin": "slider_origin",
    "traction": "traction",
    "frequency_hz": "curve_frequency_hz",
    "amplitude_m": "curve_amplitude_m",
}
ADDED = "added"  # attribute of a branch: whether it is new in this file, and not in the one that the file extends
# What further branches change in the summary of a curve; everything else speaks of the main branch.
_CHANGED = ("detached", "outputs", "branches_left_out", "worst_", "seconds")


def used_parameters(
    scene: Scene, contacts: Sequence[InterfaceContact], parameters: Mapping[str, Any]
) -> dict[str, Any]:
    """Every parameter that the solution used, by dotted key, and the swept ones of other stages.

    Those of [contact] are of the first interface; where there are several, each has its own as well.
    """
    response = scene.response.model_dump(exclude_none=True)
    first = contacts[0].contact.model_dump(exclude={"interfaces"})
    values: dict[str, Any] = {f"{CONTACT}.{key}": value for key, value in first.items()}
    for each in contacts if len(contacts) > 1 else ():
        values |= {f"{INTERFACE}.{each.name}.{key}": getattr(each.contact, key) for key in OF_INTERFACE}
    values |= {f"response.{key}": value for key, value in response.items()}
    values["excitation.engine_order"] = scene.excitation.engine_order
    values["excitation.force"] = scene.excitation.force
    if scene.excitation.harmonic:
        values[HARMONICS] = json.dumps([item.model_dump() for item in scene.excitation.harmonic])
    if scene.aero is not None:
        values[FLOW] = json.dumps(scene.aero_inputs())
    values |= {f"load.{key}": value for key, value in rotation_of_response(scene).items()}
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


def modes_of_curve(model: ReducedModel, attributes: Mapping[str, Any]) -> RingModes:
    """The modal model with damping, speed, Coriolis forces and flow that a curve was solved with."""
    families = [AeroFamily.model_construct(**each) for each in json.loads(attributes.get(FLOW, "[]"))]
    # files of earlier versions do not speak of Coriolis forces, which were left out
    load = section_from_attributes(Load, {"load.coriolis": False, **attributes})
    response = section_from_attributes(Response, attributes)
    return damped_modes(model, response, load, families)


def contacts_of_curve(group: h5py.Group) -> tuple[InterfaceContact, ...]:
    """The contact of each interface that a curve was solved with."""
    attributes = group.attrs
    first = section_from_attributes(Contact, attributes)
    found = []
    for each in json.loads(attributes.get(INTERFACES, "[]")):
        keys = {key: f"{INTERFACE}.{each['name']}.{key}" for key in OF_INTERFACE}
        own = {key: _scene_value(attributes[name]) for key, name in keys.items() if name in attributes}
        found.append(InterfaceContact(each["name"], first.model_copy(update=own), each["nodes"]))
    nodes = group["relative_displacement"].shape[2]
    return tuple(found) or (InterfaceContact(MAIN_INTERFACE, first, nodes),)


def _scene_value(value: Any) -> Any:
    """An attribute as the scene has it: Python numbers, lists as tuples."""
    plain = value.tolist() if hasattr(value, "tolist") else value
    return tuple(plain) if isinstance(plain, list) else plain


def cell_value(value: Any) -> Any:
    """A swept value as a cell of a table holds it: a number, text, or a list written in brackets."""
    return json.dumps(list(value)) if isinstance(value, tuple | list) else value


def write_curve(
    path: Path,
    response: ResponseCurve,
    parameters: Mapping[str, Any],
    interfaces: Sequence[Mapping[str, Any]] = (),
) -> None:
    """Write columns, complex coefficients, parameters and summary of a solved curve, see `interfaces_at_peak`."""
    from rom.files.hdf5 import new_hdf5

    with new_hdf5(path) as file:
        file.attrs.update(parameters)
        write_branch(file, response, interfaces)
        if response.residual_bounds is not None:
            _write_residual_bounds(file.create_group(RESIDUAL), response.residual_bounds)
        for number, branch in enumerate(response.detached, start=1):
            write_branch(file.create_group(f"{BRANCHES}/{number}"), branch)


def write_branch(group: h5py.Group, branch: ResponseCurve, interfaces: Sequence[Mapping[str, Any]] = ()) -> None:
    """Write the points of a branch and their summary."""
    for field in fields(branch):
        value = getattr(branch, field.name)
        if field.name == HARMONIC_COLUMNS:
            for h in range(value.shape[1]):
                _write(group, f"harmonic_{h + 1}_m", value[:, h])
        elif isinstance(value, np.ndarray):
            _write(group, field.name, value)
    for name, values in branch.outputs.items():
        _write(group, f"{OUTPUT}{name}", values[:, :, 0] if values.shape[2] == 1 else values)
        _write(group, f"{AMPLITUDE}{name}", branch.amplitude_of(name))
    group.attrs.update(summary_attributes(branch, interfaces))


def _write_residual_bounds(group: h5py.Group, bounds: ResidualBounds) -> None:
    """Write the arrays of the band, and of each bound; its numbers are in the summary of the curve."""
    for name in _BAND:
        _write(group, name, getattr(bounds, name))
    for bound in RESIDUAL_BOUNDS:
        for name, field in _OF_BOUND.items():
            _write(group, f"{bound}/{name}", getattr(getattr(bounds, bound), field))


def _write(group: h5py.Group, name: str, values: Array) -> None:
    group.create_dataset(name, data=values, track_times=False)


def read_curve(path: Path) -> ResponseCurve:
    """A curve with its detached branches, from a file that `write_curve` or `write_extended` wrote."""
    import h5py

    with h5py.File(path, "r") as file:
        return curve_from(file)


def curve_from(group: h5py.Group, left_out: Sequence[str] = ()) -> ResponseCurve:
    """A curve with its detached branches; arrays `left_out` are empty, which is cheaper where they are large."""
    branches = tuple(_read(each, left_out) for each in branch_groups(group))
    return replace(_read(group, left_out), detached=branches)


def read_added(path: Path) -> ResponseCurve:
    """The branches that are new in a file, as a curve of their own: of a curve that was solved all, of an extended
    one those that were added.
    """
    import h5py

    with h5py.File(path, "r") as file:
        added = [_read(group) for group in branch_groups(file) if group.attrs.get(ADDED, False)]
    return replace(added[0], detached=tuple(added[1:])) if added else read_curve(path)


def branch_mark(frequency_hz: NDArray[np.float64]) -> str:
    """A mark by which a branch is known again in every file that holds it: a hash of its frequencies (P,), Hz."""
    return content_fingerprint(np.ascontiguousarray(frequency_hz).tobytes())


def branch_groups(file: h5py.Group) -> list[h5py.Group]:
    """The groups of the detached branches of a curve, in their order."""
    return [file[f"{BRANCHES}/{number}"] for number in sorted(file.get(BRANCHES, ()), key=int)]


def write_extended(path: Path, base: Path, before: ResponseCurve, after: ResponseCurve) -> None:
    """Write the file of a curve that has got further branches; all that speaks of the main branch is copied."""
    import h5py

    from rom.files.hdf5 import new_hdf5

    changed = {key: value for key, value in summary_attributes(after).items() if key.startswith(_CHANGED)}
    with new_hdf5(path) as file, h5py.File(base, "r") as source:
        _copy_main(source, file, changed)
        old = list(zip(before.detached, branch_groups(source), strict=True))
        for number, branch in enumerate(after.detached, start=1):
            name = f"{BRANCHES}/{number}"
            group = next((group for known, group in old if _is_same(known, branch)), None)
            if group is None:
                write_branch(file.create_group(name), branch)
            else:
                source.copy(group, file, name)
            file[name].attrs[ADDED] = group is None


def write_searched(path: Path, base: Path, after: ResponseCurve, parameters: Mapping[str, Any]) -> None:
    """Write the file of a curve whose worst motion was sought further; all else is copied."""
    import h5py

    from rom.files.hdf5 import new_hdf5

    changed = {key: value for key, value in summary_attributes(after).items() if key.startswith(_CHANGED)}
    with new_hdf5(path) as file, h5py.File(base, "r") as source:
        for name in source:
            source.copy(name, file)
        for key, value in [*source.attrs.items(), *changed.items(), *parameters.items()]:
            file.attrs[key] = value


def _copy_main(source: h5py.File, target: h5py.File, changed: Mapping[str, Any]) -> None:
    for name in source:
        if name != BRANCHES:
            source.copy(name, target)
    for key, value in [*source.attrs.items(), *changed.items()]:
        target.attrs[key] = value
    target.create_group(BRANCHES)


def _is_same(one: ResponseCurve, other: ResponseCurve) -> bool:
    """Whether two branches are one and the same, to the last digit."""
    return one is other or np.array_equal(one.frequency_hz, other.frequency_hz)


def _read(group: h5py.Group, left_out: Sequence[str] = ()) -> ResponseCurve:
    """One branch, without those beside it."""
    from nonlinear.response_curve import Bifurcation, Peak, ResponseCurve, TerminationReason

    facts = read_summary(group)
    there = dict.fromkeys(group)  # looking names up one by one, or opening what is not read, takes most of the time
    stored = [f.name for f in fields(ResponseCurve) if f.name in there]
    values: dict[str, Any] = {name: group[name][()] for name in stored if name not in left_out}
    for name, data in ((name, group[name]) for name in left_out):
        values[name] = np.empty((0, *data.shape[1:]), data.dtype)
    columns = [group[f"harmonic_{h + 1}_m"][()] for h in range(facts.harmonics)]
    values[HARMONIC_COLUMNS] = np.column_stack(columns) if columns else np.empty((facts.points, 0))
    values |= {name: getattr(facts, name) for name in shared_fields()}
    values |= {name: getattr(facts, name) for name in ("peak", "worst", "static_contact")}
    ended: Any = facts.termination
    return ResponseCurve(
        **values,
        termination=TerminationReason(ended, facts.termination_hz, facts.reason),
        peaks=restored(tuple[Peak, ...], facts.peaks),
        bifurcations=restored(tuple[Bifurcation, ...], facts.bifurcations),
        residual_bounds=_residual_bounds(group[RESIDUAL], facts) if RESIDUAL in there else None,
        branches_left_out=int(group.attrs["branches_left_out"]),
        outputs={
            name.removeprefix(OUTPUT): data[()].reshape(*data.shape[:2], -1)
            for name, data in ((name, group[name]) for name in there if name.startswith(OUTPUT))
        },
    )


def _residual_bounds(group: h5py.Group, facts: CurveSummary) -> ResidualBounds:
    from nonlinear.response_curve import ResidualBounds, ResidualExtreme

    values: dict[str, Any] = {name: group[name][()] for name in _BAND}
    for bound in RESIDUAL_BOUNDS:
        arrays: dict[str, Any] = {field: group[f"{bound}/{name}"][()] for name, field in _OF_BOUND.items()}
        values[bound] = ResidualExtreme(**arrays, **bound_of(facts, bound))
    return ResidualBounds(**values)

"""One response curve: solved from a reduced model and the numbers of a scene, kept as one HDF5 file."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.scene.schema import Scene
from pipeline.stages.scene_to_solver import contact_parameters, used_contact

if TYPE_CHECKING:
    import h5py

    from nonlinear import Bifurcation, ResponseCurve
    from rom import ModalModel, ReducedModel

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
}
BRANCHES = "branch"  # group of the detached branches of a curve: branch/1, branch/2, ...
Progress = Callable[[float, int], None]


@dataclass(frozen=True)
class CurveTask:
    """What a worker needs to solve one curve: the reduced model's file, the scene, the swept parameters."""

    rom: Path
    scene: Scene
    parameters: Mapping[str, Any]


def nonlinear_values(scene: Scene) -> dict[str, Any]:
    """The scene values that the nonlinear stage depends on, for the fingerprint of a curve."""
    values: dict[str, Any] = {
        "contact": scene.contact.model_dump(),
        "excitation": {"engine_order": scene.excitation.engine_order, "force": scene.excitation.force},
        "response": scene.response.model_dump(),
        "load": scene.load.model_dump(),
    }
    if "punch" in (scene.contact.normal_stiffness, scene.contact.tangential_stiffness):
        values["material"] = scene.material.model_dump() if scene.material else None
    return values


def face_area(model: ReducedModel) -> float | None:
    """Area of the contact face, m^2, where the model knows it."""
    return None if model.contact_area is None else float(model.contact_area.sum())


def modal_of(model: ReducedModel, scene: Scene) -> ModalModel:
    """The modes of the reduced model with the scene's damping and speed.

    Raises
    ------
    ReducedModelError : the model has no static response, or the damping does not fit it.
    """
    from rom import modal_model

    return modal_model(
        model,
        damping_ratio=scene.response.damping_ratio,
        rayleigh=scene.response.rayleigh,
        speed_rpm=scene.load.speed_rpm,
    )


def solve_curve(folder: Path, task: CurveTask, progress: Progress | None = None) -> None:
    """Solve the curve of `task` on one BLAS thread and write `curve.h5` into `folder`.

    Raises
    ------
    ReducedModelError : the model does not fit the scene.
    """
    from nonlinear import Excitation, SolverOptions, forced_response
    from rom import one_blas_thread, read_reduced_model

    scene = task.scene
    with one_blas_thread():
        model = read_reduced_model(task.rom, with_basis=False)
        modal = modal_of(model, scene)
        contact = used_contact(scene, face_area(model))
        response = forced_response(
            modal,
            contact_parameters(contact, model.n_contacts),
            Excitation(engine_order=scene.excitation.engine_order, force=scene.excitation.force),
            SolverOptions(
                frequency_hz=scene.response.frequency,
                harmonics=scene.response.harmonics,
                harmonic_tolerance=scene.response.tolerance,
                samples=scene.contact.samples,
                integration=scene.contact.integration,
                method=scene.response.method,
                stability=scene.response.stability,
                detached=scene.response.detached,
                truncation=scene.response.truncation,
            ),
            progress,
        )
    _write(folder / CURVE, response, curve_attributes(scene, contact, task.parameters))


def curve_attributes(scene: Scene, contact: Mapping[str, Any], parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Every parameter that the nonlinear stage used, by dotted key, and the swept ones of other stages."""
    response = scene.response.model_dump(exclude_none=True)
    values: dict[str, Any] = {f"contact.{key}": value for key, value in contact.items()}
    values |= {f"response.{key}": value for key, value in response.items()}
    values["excitation.engine_order"] = scene.excitation.engine_order
    values["excitation.force"] = scene.excitation.force
    values["load.speed_rpm"] = scene.load.speed_rpm
    return {key: value for key, value in parameters.items() if key not in values} | values


def _write(path: Path, response: ResponseCurve, attributes: Mapping[str, Any]) -> None:
    """Columns, complex coefficients and attributes in the layout of one group of response.h5."""
    from rom import new_hdf5

    with new_hdf5(path) as file:
        _write_points(file, response)
        for key, value in attributes.items():
            file.attrs[key] = value
        for key, value in _outcome(response).items():
            file.attrs[key] = value
        for number, branch in enumerate(response.detached, start=1):
            group = file.create_group(f"{BRANCHES}/{number}")
            _write_points(group, branch)
            group.attrs["reason"] = branch.termination.message


def _write_points(group: h5py.Group, response: ResponseCurve) -> None:
    import numpy as np

    for column, attribute in COLUMNS.items():
        group.create_dataset(column, data=np.asarray(getattr(response, attribute)), track_times=False)
    harmonics = np.asarray(response.harmonic_m)
    for h in range(harmonics.shape[1]):
        group.create_dataset(f"harmonic_{h + 1}_m", data=harmonics[:, h], track_times=False)
    for name in ("relative_displacement", "contact_force", "output", "energy_error"):
        group.create_dataset(name, data=np.asarray(getattr(response, name)), track_times=False)


def _outcome(response: ResponseCurve) -> dict[str, Any]:
    """What the summary says of a curve; nan where there is no number."""
    import numpy as np

    errors = np.asarray(response.energy_error, dtype=float)
    peak = response.peak
    return {
        "peak_frequency_hz": math.nan if peak is None else float(peak.frequency_hz),
        "peak_amplitude_m": math.nan if peak is None else float(peak.amplitude_m),
        "peak_index": -1 if peak is None else int(peak.index),
        "peak_located": peak is not None and bool(peak.located),
        "points": len(response.frequency_hz),
        "total_iterations": int(np.sum(response.iterations)),
        "seconds": float(response.seconds),
        "complete": bool(response.termination.complete),
        "reason": str(response.termination.message),
        "energy_error": float(np.nanmax(errors)) if np.any(np.isfinite(errors)) else math.nan,
        "harmonics": int(response.harmonics),
        "truncation_error": float(response.truncation_error),
        "bifurcations": json.dumps([_bifurcation(item) for item in response.bifurcations]),
        "detached": json.dumps([_detached(branch) for branch in response.detached]),
    }


def _bifurcation(item: Bifurcation) -> dict[str, Any]:
    return {"kind": item.kind.value, "frequency_hz": item.frequency_hz, "amplitude_m": item.amplitude_m}


def _detached(branch: ResponseCurve) -> dict[str, Any]:
    return {
        "from_hz": float(branch.frequency_hz.min()),
        "to_hz": float(branch.frequency_hz.max()),
        "peak_amplitude_m": float(branch.amplitude_m.max()),
        "points": branch.points,
        "stable_points": int(branch.stable.sum()),
        "reason": branch.termination.message,
    }


@dataclass(frozen=True)
class CurveSummary:
    """What the summary and the table for people say of one curve; nan where there is no number."""

    peak_frequency_hz: float
    peak_amplitude_m: float
    peak_index: int
    peak_located: bool
    points: int
    total_iterations: int
    seconds: float
    complete: bool
    reason: str
    energy_error: float
    harmonics: int
    truncation_error: float
    bifurcations: tuple[dict[str, Any], ...]
    detached: tuple[dict[str, Any], ...]


def read_summary(group: h5py.Group) -> CurveSummary:
    """The outcome of a curve from its attributes."""
    attributes = group.attrs
    return CurveSummary(
        peak_frequency_hz=float(attributes["peak_frequency_hz"]),
        peak_amplitude_m=float(attributes["peak_amplitude_m"]),
        peak_index=int(attributes["peak_index"]),
        peak_located=bool(attributes["peak_located"]),
        points=int(attributes["points"]),
        total_iterations=int(attributes["total_iterations"]),
        seconds=float(attributes["seconds"]),
        complete=bool(attributes["complete"]),
        reason=str(attributes["reason"]),
        energy_error=float(attributes["energy_error"]),
        harmonics=int(attributes["harmonics"]),
        truncation_error=float(attributes["truncation_error"]),
        bifurcations=tuple(json.loads(attributes["bifurcations"])),
        detached=tuple(json.loads(attributes["detached"])),
    )


def plain(value: Any) -> Any:
    """A swept value as the files carry it: a number, text, or a list written in brackets."""
    return json.dumps(list(value)) if isinstance(value, tuple | list) else value

"""Summary of a response curve: the numbers that tables and summary.json give, as attributes of its file."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import h5py

    from nonlinear import Bifurcation, ResidualBounds, ResponseCurve, StaticContact, WorstMotion


# attributes of the worst motion, and their values where there is none
NO_WORST: dict[str, Any] = {
    "worst_amplitude_m": math.nan,
    "worst_frequency_hz": math.nan,
    "worst_branch": -1,
    "worst_index": -1,
    "worst_motion": "",
    "worst_scatter": math.nan,
    "worst_nodal_diameter": 0,
    "worst_ring_blades": 0,
    "worst_searched": "",
    "worst_unresolved": "",
    "worst_at_end": False,
    "worst_not_counted": "",
    "worst_truncation_error": math.nan,
}
# attributes of the bounds over residual tractions, and their values where they were not asked for
_OF_DISPLACEMENT = {"m": "amplitude_m", "hz": "frequency_hz", "vibration_m": "vibration_m", "static_m": "static_m"}
_OF_VIBRATION = {"m": "vibration_m", "hz": "frequency_hz", "static_m": "static_m", "displacement_m": "amplitude_m"}
RESIDUAL_BOUNDS = {
    "lowest": _OF_DISPLACEMENT,
    "highest": _OF_DISPLACEMENT,
    "least_vibration": _OF_VIBRATION,
    "most_vibration": _OF_VIBRATION,
}
NO_RESIDUAL: dict[str, Any] = {
    f"residual_{bound}_{name}": math.nan for bound, names in RESIDUAL_BOUNDS.items() for name in names
}


# attributes of the static contact, and their values where it is not known
NO_STATIC: dict[str, Any] = {
    **{f"static_{name}": math.nan for name in ("force_n", "open_share", "lowest_m", "highest_m")},
    "static_opened": False,
}


def summary_attributes(response: ResponseCurve) -> dict[str, Any]:
    """The summary of a curve as attributes of its file; nan where there is no number."""
    import numpy as np

    errors = np.asarray(response.energy_error, dtype=float)
    peak = response.peak
    return {
        "peak_frequency_hz": math.nan if peak is None else float(peak.frequency_hz),
        "peak_amplitude_m": math.nan if peak is None else float(peak.amplitude_m),
        "peak_index": -1 if peak is None else int(peak.index),
        "peak_located": peak is not None and bool(peak.located),
        "peak_at_end": peak is not None and bool(peak.at_end),
        "points": len(response.frequency_hz),
        "total_iterations": int(np.sum(response.iterations)),
        "seconds": float(response.seconds),
        "complete": bool(response.termination.complete),
        "reason": str(response.termination.message),
        "termination": str(response.termination.kind),
        "termination_hz": float(response.termination.frequency_hz),
        "origin": str(response.origin),
        "branches_left_out": int(response.branches_left_out),
        "peaks": json.dumps([asdict(item) for item in response.peaks]),
        "energy_error": float(np.nanmax(errors)) if np.any(np.isfinite(errors)) else math.nan,
        "harmonics": int(response.harmonics),
        **truncation(response),
        "sampling_error": float(response.sampling_error),
        "sampling_frequency_error": float(response.sampling_frequency_error),
        "bifurcations": json.dumps([_bifurcation(item) for item in response.bifurcations]),
        "detached": json.dumps([_detached(branch) for branch in response.detached]),
        **_worst(response.worst),
        "free_nodes": int(response.free_nodes),
        "outputs": json.dumps([_peak_of(response, name) for name in response.outputs]),
        **_residual(response.residual_bounds),
        **_static(response.static_contact),
    }


def _peak_of(response: ResponseCurve, name: str) -> dict[str, Any]:
    """The largest amplitude of a further output on any branch; branch 0 is the main one."""
    from nonlinear import at_range_end

    branches = [response, *response.detached]
    found = [(number, branch.amplitude_of(name)) for number, branch in enumerate(branches) if branch.points]
    if not found:
        return {"name": name, "peak_amplitude": None, "peak_frequency_hz": None, "branch": None}
    number, amplitude = max(found, key=lambda each: float(each[1].max()))
    at = int(amplitude.argmax())
    frequency = float(branches[number].frequency_hz[at])
    limits = float(response.frequency_hz[0]), float(response.frequency_hz[-1])
    return {
        "name": name,
        "peak_amplitude": float(amplitude[at]),
        "peak_frequency_hz": frequency,
        "branch": number,
        "stable": bool(branches[number].stable[at]),
        "at_end": response.termination.complete and at_range_end(frequency, limits),
    }


def _residual(bounds: ResidualBounds | None) -> dict[str, Any]:
    """The bounds over residual tractions as attributes."""
    if bounds is None:
        return dict(NO_RESIDUAL)
    return {
        f"residual_{bound}_{name}": float(getattr(getattr(bounds, bound), attribute))
        for bound, names in RESIDUAL_BOUNDS.items()
        for name, attribute in names.items()
    }


def _static(found: StaticContact | None) -> dict[str, Any]:
    """The static contact as attributes."""
    if found is None:
        return dict(NO_STATIC)
    return {name: getattr(found, name.removeprefix("static_")) for name in NO_STATIC}


def stored_static(attributes: Mapping[str, Any]) -> StaticContact | None:
    """The static contact from the attributes of a curve; None where it is not known."""
    from nonlinear import StaticContact

    values = {name: type(none)(attributes.get(name, none)) for name, none in NO_STATIC.items()}
    if math.isnan(values["static_force_n"]):
        return None
    return StaticContact(**{name.removeprefix("static_"): value for name, value in values.items()})


def _worst(worst: WorstMotion | None) -> dict[str, Any]:
    """The worst motion as attributes."""
    if worst is None:
        return dict(NO_WORST)
    return {name: type(none)(getattr(worst, name.removeprefix("worst_"))) for name, none in NO_WORST.items()}


def stored_worst(attributes: Mapping[str, Any]) -> WorstMotion | None:
    """The worst motion from the attributes of a curve; None where there is none."""
    from nonlinear import WorstMotion

    values = {name: type(none)(attributes.get(name, none)) for name, none in NO_WORST.items()}
    found = WorstMotion(**{name.removeprefix("worst_"): value for name, value in values.items()})
    return found if found.searched else None


def _bifurcation(item: Bifurcation) -> dict[str, Any]:
    return asdict(item) | {"kind": item.kind.value}


def _detached(branch: ResponseCurve) -> dict[str, Any]:
    return {
        "from_hz": float(branch.frequency_hz.min()),
        "to_hz": float(branch.frequency_hz.max()),
        "peak_amplitude_m": float(branch.amplitude_m.max()),
        "peak_at_end": branch.peak is not None and branch.peak.at_end,
        "points": branch.points,
        "stable_points": int(branch.stable.sum()),
        "reason": branch.termination.message,
        "origin": branch.origin,
        "born_between": [],
        **{name: _plain(value) for name, value in truncation(branch).items()},
    }


def _plain(value: Any) -> Any:
    """A value with None in place of NaN and infinity, which JSON does not have."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def truncation(response: ResponseCurve) -> dict[str, Any]:
    """What is known of the truncation error of a branch."""
    return {
        "truncation_error": float(response.truncation_error),
        "truncation_branch": str(response.truncation_branch),
        "truncation_frequency_hz": float(response.truncation_frequency_hz),
        "motion_truncation_error": float(response.motion_truncation_error),
    }


@dataclass(frozen=True)
class CurveSummary:
    """Summary of one curve; nan where there is no number."""

    peak_frequency_hz: float
    peak_amplitude_m: float
    peak_index: int
    peak_located: bool
    peak_at_end: bool
    points: int
    total_iterations: int
    seconds: float
    complete: bool
    reason: str
    energy_error: float
    harmonics: int
    truncation_error: float
    truncation_branch: str
    truncation_frequency_hz: float
    motion_truncation_error: float
    sampling_error: float
    sampling_frequency_error: float
    termination: str
    termination_hz: float
    origin: str
    peaks: tuple[dict[str, Any], ...]
    bifurcations: tuple[dict[str, Any], ...]
    detached: tuple[dict[str, Any], ...]
    worst_amplitude_m: float
    worst_frequency_hz: float
    worst_branch: int
    worst_index: int
    worst_motion: str
    worst_scatter: float
    worst_nodal_diameter: int
    worst_ring_blades: int
    worst_searched: str
    worst_unresolved: str
    worst_at_end: bool
    worst_not_counted: str
    worst_truncation_error: float
    free_nodes: int
    residual_lowest_m: float
    residual_lowest_hz: float
    residual_lowest_vibration_m: float
    residual_lowest_static_m: float
    residual_highest_m: float
    residual_highest_hz: float
    residual_highest_vibration_m: float
    residual_highest_static_m: float
    residual_least_vibration_m: float
    residual_least_vibration_hz: float
    residual_least_vibration_static_m: float
    residual_least_vibration_displacement_m: float
    residual_most_vibration_m: float
    residual_most_vibration_hz: float
    residual_most_vibration_static_m: float
    residual_most_vibration_displacement_m: float
    static_force_n: float
    static_open_share: float
    static_lowest_m: float
    static_highest_m: float
    static_opened: bool
    outputs: tuple[dict[str, Any], ...] = ()

    @property
    def at_end(self) -> bool:
        """Whether the worst motion, or the peak where that is not known, lies at an end of the frequency range."""
        return self.worst_at_end if math.isfinite(self.worst_amplitude_m) else self.peak_at_end


def _bounds(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Bounds over residual tractions; those of earlier versions, of a vibration about another mean, are not known."""
    known = NO_RESIDUAL.keys() <= attributes.keys()
    return {name: float(attributes[name]) if known else none for name, none in NO_RESIDUAL.items()}


def read_summary(group: h5py.Group) -> CurveSummary:
    """The summary of a curve from the attributes of its group."""
    attributes = group.attrs
    return CurveSummary(
        peak_frequency_hz=float(attributes["peak_frequency_hz"]),
        peak_amplitude_m=float(attributes["peak_amplitude_m"]),
        peak_index=int(attributes["peak_index"]),
        peak_located=bool(attributes["peak_located"]),
        peak_at_end=bool(attributes.get("peak_at_end", not attributes["peak_located"])),
        points=int(attributes["points"]),
        total_iterations=int(attributes["total_iterations"]),
        seconds=float(attributes["seconds"]),
        complete=bool(attributes["complete"]),
        reason=str(attributes["reason"]),
        energy_error=float(attributes["energy_error"]),
        harmonics=int(attributes["harmonics"]),
        truncation_error=float(attributes["truncation_error"]),
        truncation_branch=str(attributes.get("truncation_branch", "")),
        truncation_frequency_hz=float(attributes.get("truncation_frequency_hz", math.nan)),
        motion_truncation_error=float(attributes.get("motion_truncation_error", math.nan)),
        sampling_error=float(attributes["sampling_error"]),
        sampling_frequency_error=float(attributes["sampling_frequency_error"]),
        termination=str(attributes.get("termination", "")),
        termination_hz=float(attributes.get("termination_hz", math.nan)),
        origin=str(attributes.get("origin", "")),
        peaks=tuple(json.loads(attributes.get("peaks", "[]"))),
        bifurcations=tuple(json.loads(attributes["bifurcations"])),
        detached=tuple(json.loads(attributes["detached"])),
        **{name: type(none)(attributes.get(name, none)) for name, none in NO_WORST.items()},
        free_nodes=int(attributes.get("free_nodes", -1)),
        **{name: type(none)(attributes.get(name, none)) for name, none in NO_STATIC.items()},
        outputs=tuple(json.loads(attributes.get("outputs", "[]"))),
        **_bounds(attributes),
    )


def keep_summary(file: Path) -> None:
    """Write the summary of a curve as JSON beside its file: thousands of curves are then compared without HDF5."""
    import h5py

    with h5py.File(file, "r") as source:
        _beside(file).write_text(json.dumps(asdict(read_summary(source))), encoding="utf-8")


def kept_summary(file: Path) -> CurveSummary:
    """The summary of a curve: as `keep_summary` wrote it beside its file, or else from the file itself."""
    beside = _beside(file)
    if not beside.is_file():
        import h5py

        with h5py.File(file, "r") as source:
            return read_summary(source)
    values = json.loads(beside.read_text(encoding="utf-8"))
    held: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in values.items()
    }
    return CurveSummary(**held)


def _beside(file: Path) -> Path:
    return file.with_suffix(".json")

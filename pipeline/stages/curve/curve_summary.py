"""Summary of a response curve: the numbers that tables and summary.json give, as attributes of its file."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.codec import attributes_of, from_attributes, of_prefix, plain, prefixed_values

if TYPE_CHECKING:
    import h5py

    from nonlinear.response_curve import Peak, ResidualBounds, ResponseCurve, StaticContact, WorstMotion


# Names of the bounds over residual tractions, of each its numbers: the field residual_BOUND_NAME, and its attribute.
LEAST_MEAN = 0.01  # of a height, from which the mean displacement in it is said
_OF_DISPLACEMENT = {"m": "amplitude_m", "hz": "frequency_hz", "vibration_m": "vibration_m", "static_m": "static_m"}
_OF_VIBRATION = {"m": "vibration_m", "hz": "frequency_hz", "static_m": "static_m", "displacement_m": "amplitude_m"}
RESIDUAL_BOUNDS = {
    "lowest": _OF_DISPLACEMENT,
    "highest": _OF_DISPLACEMENT,
    "least_vibration": _OF_VIBRATION,
    "most_vibration": _OF_VIBRATION,
}


@dataclass(frozen=True, kw_only=True)
class CurveSummary:
    """Summary of one curve, nan where there is no number.

    Its fields are attributes of the curve's file, keys of `curve.json` and columns of the table of curves. Those with
    a default are missing in files of earlier versions.
    """

    peak_frequency_hz: float = math.nan
    peak_amplitude_m: float = math.nan
    peak_index: int = -1
    peak_located: bool = False
    peak_at_end: bool = False
    peak_stable: bool = True  # whether nothing that was looked at grows there
    points: int
    total_iterations: int
    seconds: float
    complete: bool
    reason: str
    energy_error: float
    harmonics: int
    truncation_error: float
    truncation_branch: str = ""
    truncation_frequency_hz: float = math.nan
    motion_truncation_error: float = math.nan
    sampling_error: float
    sampling_frequency_error: float
    termination: str = ""
    termination_hz: float = math.nan
    origin: str = ""
    peaks: tuple[dict[str, Any], ...] = ()
    bifurcations: tuple[dict[str, Any], ...]
    detached: tuple[dict[str, Any], ...]
    worst_amplitude_m: float = math.nan
    worst_frequency_hz: float = math.nan
    worst_branch: int = -1
    worst_index: int = -1
    worst_motion: str = ""
    worst_scatter: float = math.nan
    worst_nodal_diameter: int = 0
    worst_ring_blades: int = 0
    worst_periods: int = 0
    worst_recurrence: float = math.nan
    worst_followed_hz: tuple[float, ...] = ()
    worst_followed_m: tuple[float, ...] = ()
    worst_searched: str = ""
    worst_unresolved: str = ""
    worst_open_kinds: tuple[str, ...] = ()
    worst_at_end: bool = False
    worst_not_counted: str = ""
    worst_truncation_error: float = math.nan
    worst_unstable: bool = False
    free_nodes: int = -1
    residual_lowest_m: float = math.nan
    residual_lowest_hz: float = math.nan
    residual_lowest_vibration_m: float = math.nan
    residual_lowest_static_m: float = math.nan
    residual_highest_m: float = math.nan
    residual_highest_hz: float = math.nan
    residual_highest_vibration_m: float = math.nan
    residual_highest_static_m: float = math.nan
    residual_least_vibration_m: float = math.nan
    residual_least_vibration_hz: float = math.nan
    residual_least_vibration_static_m: float = math.nan
    residual_least_vibration_displacement_m: float = math.nan
    residual_most_vibration_m: float = math.nan
    residual_most_vibration_hz: float = math.nan
    residual_most_vibration_static_m: float = math.nan
    residual_most_vibration_displacement_m: float = math.nan
    static_force_n: float = math.nan
    static_open_share: float = math.nan
    static_lowest_m: float = math.nan
    static_highest_m: float = math.nan
    static_opened: bool = False
    mean_m: float = math.nan  # mean displacement of the output at the worst motion, of its branch or the main one
    outputs: tuple[dict[str, Any], ...] = ()
    # of several contact interfaces, in the order of their nodes: name and number of nodes, at the peak of the main
    # branch those sticking, slipping and separating, and the friction work per cycle, dissipated_j; the static
    # contact, which is then not given for all of them together
    interfaces: tuple[dict[str, Any], ...] = ()

    @property
    def at_end(self) -> bool:
        """Whether the worst motion, or the peak where that is not known, lies at an end of the frequency range."""
        return self.worst_at_end if math.isfinite(self.worst_amplitude_m) else self.peak_at_end

    @property
    def height(self) -> float:
        """Amplitude of the worst motion, m; that of the peak where it is not known."""
        return self.worst_amplitude_m if math.isfinite(self.worst_amplitude_m) else self.peak_amplitude_m

    @property
    def mean(self) -> float:
        """Mean displacement in the height, m; 0 where it is not known or less than a hundredth of it."""
        mean = abs(self.mean_m)
        return mean if mean > LEAST_MEAN * self.height else 0.0

    @property
    def peak(self) -> Peak | None:
        """The highest peak of the main branch; None without points."""
        from nonlinear.response_curve import Peak

        return of_prefix(Peak, PEAK, self) if self.points and self.peak_index >= 0 else None

    @property
    def worst(self) -> WorstMotion | None:
        """The worst motion; None where there is none."""
        from nonlinear.response_curve import WorstMotion

        return of_prefix(WorstMotion, WORST, self) if self.worst_searched else None

    @property
    def static_contact(self) -> StaticContact | None:
        """The static contact; None where it is not known, and of several interfaces."""
        from nonlinear.response_curve import StaticContact

        return None if math.isnan(self.static_force_n) else of_prefix(StaticContact, STATIC, self)

    @property
    def static_contacts(self) -> dict[str, StaticContact]:
        """The static contact by interface, "" where there is one; {} where it is not known."""
        from nonlinear.response_curve import StaticContact

        if (alone := self.static_contact) is not None:
            return {"": alone}
        known = {name.removeprefix(STATIC) for name in NO_STATIC}
        return {
            each["name"]: StaticContact(**{name: each[f"{STATIC}{name}"] for name in known})
            for each in self.interfaces
            if each.get(f"{STATIC}force_n") is not None and math.isfinite(each[f"{STATIC}force_n"])
        }


def _unknown(prefix: str) -> dict[str, Any]:
    """The fields with a prefix, and their values where there is nothing to say."""
    return {field.name: field.default for field in fields(CurveSummary) if field.name.startswith(prefix)}


PEAK, WORST, RESIDUAL, STATIC = "peak_", "worst_", "residual_", "static_"
_NAMES = [field.name for field in fields(CurveSummary)]
_SUMMARISED = (
    "energy_error",
    "termination",
    "peaks",
    "bifurcations",
    "detached",
    "outputs",
)  # not as the curve has them
_TRUNCATION = [name for name in _NAMES if "truncation" in name and not name.startswith(WORST)]  # of a branch
NO_WORST, NO_RESIDUAL, NO_STATIC = _unknown(WORST), _unknown(RESIDUAL), _unknown(STATIC)


def shared_fields() -> list[str]:
    """The fields that `ResponseCurve` has too, with the same values."""
    from nonlinear.response_curve import ResponseCurve

    return [field.name for field in fields(ResponseCurve) if field.name in _NAMES and field.name not in _SUMMARISED]


def summary_attributes(response: ResponseCurve, interfaces: Sequence[Mapping[str, Any]] = ()) -> dict[str, Any]:
    """The summary of a curve as attributes of its file."""
    together: dict[str, Any] = NO_STATIC if interfaces else {}
    summary = replace(summary_of(response), interfaces=tuple(map(dict, interfaces)), **together)
    return {**attributes_of(summary), "branches_left_out": int(response.branches_left_out)}


def summary_of(response: ResponseCurve) -> CurveSummary:
    """The summary of a solved curve, or of one of its branches."""
    import numpy as np

    errors, ended = response.energy_error[np.isfinite(response.energy_error)], response.termination
    peak, stable = response.peak, checked(response).stable
    return from_attributes(
        CurveSummary,
        {name: getattr(response, name) for name in shared_fields()}
        | prefixed_values(PEAK, response.peak)
        | prefixed_values(WORST, response.worst)
        | prefixed_values(STATIC, response.static_contact)
        | _residual(response.residual_bounds)
        | {
            "peak_stable": peak is None or bool(stable[peak.index]),
            "points": response.points,
            "total_iterations": response.iterations.sum(),
            "energy_error": errors.max() if errors.size else math.nan,
            "complete": ended.complete,
            "termination": ended.kind,
            "termination_hz": ended.frequency_hz,
            "reason": ended.message,
            "peaks": plain(response.peaks),
            "bifurcations": plain(response.bifurcations),
            "detached": map(_detached, response.detached),
            "outputs": [_peak_of(response, name) for name in response.outputs],
            "mean_m": _mean(response),
        },
    )


def checked(response: ResponseCurve) -> ResponseCurve:
    """The curve with what was found at its worst motion: unstable there, where points were looked at for less."""
    worst = response.worst
    if worst is None or not worst.unstable or worst.branch < 0:
        return response
    branches = [response, *response.detached]
    branch = branches[worst.branch]
    changed = {name: getattr(branch, name).copy() for name in ("stable", "growth_nodal_diameter")}
    changed["stable"][worst.index], changed["growth_nodal_diameter"][worst.index] = False, worst.nodal_diameter
    branches[worst.branch] = replace(branch, **changed)
    main, *detached = branches
    return replace(main, detached=tuple(detached))


def _mean(response: ResponseCurve) -> float:
    """The mean displacement at the point of the worst motion, or of the peak without it; m.

    A motion on no branch has that of the main branch at its frequency.
    """
    worst, peak = response.worst, response.peak
    if worst is None or not math.isfinite(worst.amplitude_m):
        return math.nan if peak is None else float(response.static_m[peak.index])
    if worst.branch < 0:
        return float(response.static_m[abs(response.frequency_hz - worst.frequency_hz).argmin()])
    return float([response, *response.detached][worst.branch].static_m[worst.index])


def _residual(bounds: ResidualBounds | None) -> dict[str, Any]:
    """The bounds over residual tractions as fields of the summary."""
    if bounds is None:
        return {}
    return {
        f"{RESIDUAL}{bound}_{name}": getattr(getattr(bounds, bound), attribute)
        for bound, names in RESIDUAL_BOUNDS.items()
        for name, attribute in names.items()
    }


def bound_of(facts: CurveSummary, bound: str) -> dict[str, Any]:
    """The numbers of one bound over residual tractions, by their names in `ResidualExtreme`."""
    return {
        attribute: getattr(facts, f"{RESIDUAL}{bound}_{name}") for name, attribute in RESIDUAL_BOUNDS[bound].items()
    }


def _peak_of(response: ResponseCurve, name: str) -> dict[str, Any]:
    """The largest amplitude of a further output on any branch; branch 0 is the main one."""
    from nonlinear.response_curve import at_range_end

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
        **{name: plain(getattr(branch, name)) for name in _TRUNCATION},
    }


def read_summary(group: h5py.Group) -> CurveSummary:
    """The summary of a curve from the attributes of its group, which an earlier version may have written."""
    stored = group.attrs  # asked for once: each time it is made anew, which takes longer than reading it
    there = set(stored)
    attributes = {name: stored[name] for name in _NAMES if name in there}
    if "peak_located" in attributes:
        attributes.setdefault("peak_at_end", not attributes["peak_located"])
    if not NO_RESIDUAL.keys() <= attributes.keys():  # those of a vibration about another mean are not known
        attributes |= NO_RESIDUAL
    return from_attributes(CurveSummary, attributes)


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
    return from_attributes(CurveSummary, json.loads(beside.read_text(encoding="utf-8")))


def _beside(file: Path) -> Path:
    return file.with_suffix(".json")

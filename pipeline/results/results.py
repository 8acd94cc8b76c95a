"""The results of a run, read from its output folder into arrays."""

from __future__ import annotations

import hashlib
import io
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import input_error, reason_of
from pipeline.stages.curve_file import BRANCHES
from pipeline.stages.curve_summary import stored_worst

if TYPE_CHECKING:
    import h5py

    from nonlinear import Peak, WorstMotion

SUMMARY, RESPONSE = "summary.json", "response.h5"
Array = NDArray[Any]


@dataclass(frozen=True)
class DetachedBranch:
    """One detached branch of a curve.

    Attributes
    ----------
    frequency_hz, amplitude_m, stable : (P,) arrays
        As in `Curve`.
    datasets : mapping of str to array
        Every dataset of the branch by its name in `response.h5`.
    truncation_error : float
        Estimated relative error of its highest amplitude from the neglected harmonics; NaN: not known.
    truncation_branch : str
        As in `Curve`.
    """

    frequency_hz: Array
    amplitude_m: Array
    stable: Array
    datasets: Mapping[str, Array]
    truncation_error: float = float("nan")
    truncation_branch: str = ""


@dataclass(frozen=True)
class Curve:
    """One response curve of a run: P solution points in the order of the arc length.

    Attributes
    ----------
    parameters : mapping
        Swept scene keys and their values on this curve, {} without a sweep.
    frequency_hz : (P,) array
        Excitation frequency, Hz.
    amplitude_m : (P,) array
        Largest displacement of the output over a period, m.
    stable : (P,) bool array
        Whether the periodic motion is stable.
    peak : Peak or None
        The highest peak of the main branch, None without points.
    worst : WorstMotion or None
        The highest motion that can persist, on any branch; None where it is not known.
    complete : bool
        Whether the whole frequency range was covered.
    reason : str
        Why the continuation ended.
    energy_error : float
        Relative mismatch of work input and dissipation per cycle, the largest over the points; NaN: not known.
    truncation_error : float
        Estimated relative error of the peak from the neglected harmonics; NaN: not known.
    truncation_branch : str
        Where the peak lies with more harmonics: "kept" (on the main branch), "detached" (on a detached branch; the
        error compares with what the main branch reaches), "lost" (not known: the error may be larger than estimated);
        "" without an estimate.
    truncation_frequency_hz : float
        Frequency of the highest amplitude of the main branch with more harmonics, Hz; NaN: not known.
    motion_truncation_error : float
        Estimated relative error of the motion at the peak, on whatever branch it lies with more harmonics; NaN: not
        known.
    sampling_error, sampling_frequency_error : float
        Estimated relative errors of the peak's amplitude and frequency from time sampling, 0 with
        `contact.integration = "exact"`; NaN: not known.
    residual_lowest_m, residual_highest_m : float
        Lowest and highest peak over the admissible residual tractions, m; NaN unless asked for.
    harmonics : int
        Largest number of harmonics balanced at a point.
    datasets : mapping of str to array
        Every dataset of the curve by its name in `response.h5` (docs/outputs.md).
    detached : tuple of DetachedBranch
        Detached branches, numbered 1, 2, ... in this order.
    rom : Path or None
        File of its reduced model, None where that could not be computed.
    """

    parameters: Mapping[str, Any]
    frequency_hz: Array
    amplitude_m: Array
    stable: Array
    peak: Peak | None
    worst: WorstMotion | None
    complete: bool
    reason: str
    energy_error: float
    truncation_error: float
    truncation_branch: str
    truncation_frequency_hz: float
    motion_truncation_error: float
    sampling_error: float
    sampling_frequency_error: float
    residual_lowest_m: float
    residual_highest_m: float
    harmonics: int
    datasets: Mapping[str, Array]
    detached: tuple[DetachedBranch, ...]
    rom: Path | None

    @property
    def growth_nodal_diameter(self) -> Array:
        """Nodal diameter of the perturbation that grows most, beside that of the wave, (P,); -1: not known."""
        return self.datasets.get("growth_nodal_diameter", np.full(self.frequency_hz.size, -1))


@dataclass(frozen=True)
class Results:
    """The results in the output folder of a run.

    Attributes
    ----------
    folder : Path
        The output folder.
    complete : bool
        Whether everything requested was computed.
    problems : tuple of str
        What was not computed, apart from curves, one line each.
    curves : tuple of Curve
        One for each combination of the sweep, in its order.
    summary : mapping
        Content of `summary.json` (docs/outputs.md): times, natural frequencies, pictures.
    """

    folder: Path
    complete: bool
    problems: tuple[str, ...]
    curves: tuple[Curve, ...]
    summary: Mapping[str, Any]


def read_results(folder: str | os.PathLike[str]) -> Results:
    """Read the results in the output folder of a run.

    Parameters
    ----------
    folder : str or path
        The output folder.

    Returns
    -------
    Results
        Curves with their arrays, and the summary.

    Raises
    ------
    InputError
        There is no `summary.json`, or it and `response.h5` cannot be read or are not of one run.
    """
    folder = Path(folder)
    allowed = "the output folder of a run"
    try:
        summary = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
        return Results(
            folder=folder,
            complete=bool(summary["complete"]),
            problems=tuple(summary["problems"]),
            curves=tuple(_curves(folder, summary)),
            summary=summary,
        )
    except FileNotFoundError as error:
        missing = Path(error.filename).name if error.filename else RESPONSE
        raise input_error(folder, "", f"holds no {missing}", allowed) from None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise input_error(folder, "", f"cannot be read: {reason_of(error)}", allowed) from None


def _curves(folder: Path, summary: dict[str, Any]) -> list[Curve]:
    """The curves that the summary names, with their arrays from response.h5."""
    entries: list[dict[str, Any]] = summary["curves"]
    if not entries:
        return []
    import h5py

    content = (folder / RESPONSE).read_bytes()  # once: a run may replace the files meanwhile
    if hashlib.sha256(content).hexdigest() != summary["response"][RESPONSE]:
        raise ValueError(f"{SUMMARY} and {RESPONSE} are not of one run")
    with h5py.File(io.BytesIO(content), "r") as file:
        groups = file["curve"]
        return [_curve(folder, entry, groups.get(str(index))) for index, entry in enumerate(entries)]


def _curve(folder: Path, entry: dict[str, Any], group: h5py.Group | None) -> Curve:
    """One curve; without points where it has no group."""
    datasets = {} if group is None else _datasets(group)
    none = np.empty(0)
    return Curve(
        parameters=entry["parameters"],
        frequency_hz=datasets.get("frequency_hz", none),
        amplitude_m=datasets.get("amplitude_m", none),
        stable=datasets.get("stable", none.astype(bool)).astype(bool),
        peak=_peak(entry, group),
        worst=_worst(entry, group),
        complete=entry["complete"],
        reason=entry["reason"],
        energy_error=_number(entry["energy_error"]),
        truncation_error=_number(entry["truncation_error"]),
        truncation_branch=entry.get("truncation_branch") or "",
        truncation_frequency_hz=_number(entry.get("truncation_frequency_hz")),
        motion_truncation_error=_number(entry.get("motion_truncation_error")),
        sampling_error=_number(entry["sampling_error"]),
        sampling_frequency_error=_number(entry["sampling_frequency_error"]),
        residual_lowest_m=_number(entry.get("residual_lowest_m")),
        residual_highest_m=_number(entry.get("residual_highest_m")),
        harmonics=0 if group is None else int(entry["harmonics"]),
        datasets=datasets,
        detached=_detached(group),
        rom=None if entry["rom"] is None else folder / entry["rom"],
    )


def _peak(entry: dict[str, Any], group: h5py.Group | None) -> Peak | None:
    from nonlinear import Peak

    if group is None or entry["peak_amplitude_m"] is None:
        return None
    index, located = int(group.attrs["peak_index"]), bool(group.attrs["peak_located"])
    return Peak(entry["peak_frequency_hz"], entry["peak_amplitude_m"], index, located)


def _worst(entry: dict[str, Any], group: h5py.Group | None) -> WorstMotion | None:
    return None if group is None or entry.get("worst_amplitude_m") is None else stored_worst(group.attrs)


def _datasets(group: h5py.Group) -> dict[str, Array]:
    return {name: item[()] for name, item in group.items() if hasattr(item, "dtype")}


def _detached(group: h5py.Group | None) -> tuple[DetachedBranch, ...]:
    """The detached branches in the order of their numbers."""
    if group is None or BRANCHES not in group:
        return ()
    groups = [group[BRANCHES][number] for number in sorted(group[BRANCHES], key=int)]
    found = [(_datasets(each), each.attrs) for each in groups]
    return tuple(
        DetachedBranch(
            values["frequency_hz"],
            values["amplitude_m"],
            values["stable"].astype(bool),
            values,
            float(attributes.get("truncation_error", float("nan"))),
            str(attributes.get("truncation_branch", "")),
        )
        for values, attributes in found
    )


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)

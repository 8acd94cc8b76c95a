"""What the figures show of solved curves: numbers, points read from their files, and the swept keys.

A swept key has its values, their places along an axis, and the label of that axis.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.results.worst import height_mark
from pipeline.scene.labels import member_label, quantity
from pipeline.scene.schema import Contact, Scene
from pipeline.stages.curve_file import AMPLITUDE, BRANCHES, RESIDUAL, section_from_attributes
from pipeline.stages.curve_summary import CurveSummary, read_summary
from pipeline.stages.scene_to_solver import contact_parameters

if TYPE_CHECKING:
    from nonlinear import ContactParameters
    from pipeline.stages.respond import CurveResult


_AXES = {"contact.interference": "interference v0 [µm], gap below 0"}


class _Swept(Protocol):
    """The common part of `PlottedCurve` and `SweepPoint`."""

    @property
    def parameters(self) -> Mapping[str, Any]: ...


@dataclass(frozen=True)
class SweepKey:
    """One swept key with its distinct values: numbers in ascending order, others in that of the sweep."""

    name: str
    values: tuple[Any, ...]

    @cached_property
    def numeric(self) -> bool:
        """Whether all values are numbers."""
        return all(isinstance(value, int | float) and not isinstance(value, bool) for value in self.values)

    @cached_property
    def _numbers(self) -> dict[str, int]:
        return {repr(value): number for number, value in enumerate(self.values)}

    def number(self, value: Any) -> int:
        """Place of a value among the distinct ones."""
        return self._numbers[repr(value)]

    def position(self, value: Any) -> float:
        """Place of a value on an axis: in the unit of the axis, or its number where the values are no numbers."""
        return float(value) * quantity(self.name).factor if self.numeric else float(self.number(value))

    def text(self, value: Any) -> str:
        """A value without its unit."""
        named = quantity(self.name)
        shown = named.value(value)
        return shown.removesuffix(f" {named.unit}") if named.unit else shown

    @property
    def axis(self) -> str:
        """Label of an axis, with the convention of the sign where there is one."""
        return _AXES.get(self.name) or quantity(self.name).axis()


def sweep_keys(curves: Sequence[_Swept]) -> list[SweepKey]:
    """Keys with more than one value, those with the most values first."""
    found = []
    for name in curves[0].parameters if curves else ():
        distinct = {repr(curve.parameters[name]): curve.parameters[name] for curve in curves}
        key = SweepKey(name, tuple(distinct.values()))
        if key.numeric:
            key = SweepKey(name, tuple(sorted(key.values)))
        if len(key.values) > 1:
            found.append(key)
    return sorted(found, key=lambda key: -len(key.values))


def groups(curves: Sequence[Any], key: SweepKey) -> list[tuple[Any, list[Any]]]:
    """The curves by the value of a key, in the order of its values."""
    found: list[tuple[Any, list[Any]]] = [(value, []) for value in key.values]
    for curve in curves:
        found[key.number(curve.parameters[key.name])][1].append(curve)
    return found


def is_grid(curves: Sequence[_Swept], keys: Sequence[SweepKey]) -> bool:
    """Whether every combination of the values of these keys has exactly one curve."""
    places = {tuple(key.number(curve.parameters[key.name]) for key in keys) for curve in curves}
    count = 1
    for key in keys:
        count *= len(key.values)
    return len(places) == len(curves) == count


Array = NDArray[np.float64]
CLOSED = "closed"  # in the reason why a branch ended


@dataclass(frozen=True)
class SweepPoint:
    """The numbers of one curve that need no points: its place in the sweep, its peak and its worst motion."""

    index: int  # number of the curve in the sweep
    label: str  # its swept parameters
    parameters: Mapping[str, Any]  # swept keys and values
    # frequency, Hz, and amplitude, m, of the peak of the main branch and of the worst motion; nan where not known
    peak: tuple[float, float]
    # frequency, Hz, and amplitude, m, of the peak of the main branch and of the worst motion; nan where not known
    worst: tuple[float, float]
    worst_open: bool  # whether the worst motion may be higher than that
    mark: str = ""  # what is said beside the worst motion; see `height_mark`
    # whether the highest amplitude of the main branch lies at an end of the frequency range, and is no peak
    peak_at_end: bool = False

    @property
    def height(self) -> float:
        """Amplitude of the worst motion, m; that of the peak where it is not known."""
        return self.worst[1] if np.isfinite(self.worst[1]) else self.peak[1]


@dataclass(frozen=True)
class PlottedBranch:
    """Points of a detached branch; `closed`: it is known to be isolated."""

    frequency_hz: Array
    amplitude_m: Array
    stable: NDArray[np.bool_]
    nodal_diameter: NDArray[np.int64]
    closed: bool = True
    outputs: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True)
class ResidualBand:
    """Bounds of a curve over residual tractions."""

    # (P,), lowest and highest amplitude at the points of the curve, interpolated between those that were solved, m
    lowest: Array
    # (P,), lowest and highest amplitude at the points of the curve, interpolated between those that were solved, m
    highest: Array
    # frequency, Hz, and amplitude, m, of the lowest and of the highest peak
    peaks: tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True)
class PlottedCurve:
    """One response curve with P points."""

    index: int  # number of the curve in the sweep
    label: str  # its swept parameters
    scene: Scene  # its scene
    parameters: dict[str, Any]  # swept keys and values
    rom: Path  # file of its reduced model
    # (P,), frequency, amplitude, stability, nodal diameter of the least stable perturbation beside that of the wave,
    # and friction work per cycle of each point
    frequency_hz: Array
    # (P,), frequency, amplitude, stability, nodal diameter of the least stable perturbation beside that of the wave,
    # and friction work per cycle of each point
    amplitude_m: Array
    # (P,), frequency, amplitude, stability, nodal diameter of the least stable perturbation beside that of the wave,
    # and friction work per cycle of each point
    stable: NDArray[np.bool_]
    # (P,), frequency, amplitude, stability, nodal diameter of the least stable perturbation beside that of the wave,
    # and friction work per cycle of each point
    nodal_diameter: NDArray[np.int64]
    # (P,), frequency, amplitude, stability, nodal diameter of the least stable perturbation beside that of the wave,
    # and friction work per cycle of each point
    dissipated_j: Array
    peak_index: int  # row of the highest point, -1 without points
    # (H+1, n_c, 3), coefficients of the relative displacement there, m
    peak_displacement: NDArray[np.complex128] | None
    residual: ResidualBand | None  # bounds over residual tractions, where they were asked for
    contact: Contact  # contact parameters of the curve
    contact_area: Array | None  # (n_c,), areas of the contact nodes, m^2; None where the model does not know them
    branches: tuple[PlottedBranch, ...]  # detached branches
    bifurcations: tuple[dict[str, Any], ...]  # kind, frequency and amplitude of each bifurcation
    worst: tuple[float, float]  # frequency, Hz, and amplitude, m, of the worst motion; nan where it is not known
    worst_open: bool  # whether the worst motion may be higher than that, because the search left something open
    # (P,), largest values of the further outputs over a period
    outputs: Mapping[str, Array] = field(default_factory=dict)
    joined: bool = False  # whether the sector is that of a bladed disk: each wave has modes of its own
    peak_at_end: bool = False  # whether the highest point lies at an end of the frequency range, and is no peak

    def contact_parameters(self, n_contacts: int) -> ContactParameters:
        """Contact parameters of each of the contact nodes."""
        return contact_parameters(self.contact, n_contacts, self.contact_area)

    @property
    def peak(self) -> tuple[float, float]:
        """Frequency, Hz, and amplitude, m, of the highest point; nan where there is none."""
        if self.peak_index < 0:
            return float("nan"), float("nan")
        return float(self.frequency_hz[self.peak_index]), float(self.amplitude_m[self.peak_index])


def sweep_points(curves: Sequence[CurveResult]) -> list[SweepPoint]:
    """The numbers of the curves with at least one point; no file is read."""
    return [
        SweepPoint(
            index=index,
            label=member_label(curve.member),
            parameters=curve.member.parameters,
            peak=(facts.peak_frequency_hz, facts.peak_amplitude_m),
            worst=(facts.worst_frequency_hz, facts.worst_amplitude_m),
            worst_open=bool(facts.worst_unresolved),
            mark=height_mark(facts),
            peak_at_end=facts.peak_at_end,
        )
        for index, curve in enumerate(curves)
        if curve.file and curve.rom and (facts := curve.facts) and facts.points
    ]


def plotted_curves(curves: Sequence[CurveResult], only: Collection[int] | None = None) -> list[PlottedCurve]:
    """The curves with at least one point; of many, `only` those of these numbers are read."""
    models: dict[Path, tuple[Array | None, bool]] = {}
    found = []
    for index, curve in enumerate(curves):
        file, rom = curve.file, curve.rom
        if file and rom and curve.facts and curve.facts.points and (only is None or index in only):
            if rom not in models:
                models[rom] = _of_model(rom)
            found.append(_read(index, curve, file, rom, models[rom]))
    return found


def _read(index: int, curve: CurveResult, file: Path, rom: Path, model: tuple[Array | None, bool]) -> PlottedCurve:
    import h5py

    with h5py.File(file, "r") as source:
        peak, facts = int(source.attrs["peak_index"]), read_summary(source)
        return PlottedCurve(
            index=index,
            label=member_label(curve.member),
            scene=curve.member.scene,
            parameters=dict(curve.member.parameters),
            rom=rom,
            frequency_hz=source["frequency_hz"][()],
            amplitude_m=source["amplitude_m"][()],
            stable=source["stable"][()].astype(bool),
            nodal_diameter=source["growth_nodal_diameter"][()],
            dissipated_j=source["dissipated_j"][()],
            peak_index=peak,
            peak_displacement=source["relative_displacement"][peak] if peak >= 0 else None,
            branches=_branches(source, facts),
            bifurcations=facts.bifurcations,
            worst=(facts.worst_frequency_hz, facts.worst_amplitude_m),
            worst_open=bool(facts.worst_unresolved),
            residual=_residual_band(source, facts),
            contact=section_from_attributes(Contact, source.attrs),
            contact_area=model[0],
            outputs=_outputs(source),
            joined=model[1],
            peak_at_end=facts.peak_at_end,
        )


def _residual_band(source: Any, facts: CurveSummary) -> ResidualBand | None:
    """The band of a curve: its ratios to the curve are linear in the arc length between the points solved."""
    if RESIDUAL not in source:
        return None
    group, arc, amplitude = source[RESIDUAL], source["arc"][()], source["amplitude_m"][()]
    index = group["band_index"][()]
    scale = np.where(amplitude[index] > 0.0, amplitude[index], 1.0)
    lowest, highest = (
        amplitude * np.interp(arc, arc[index], group[name][()] / scale)
        for name in ("band_lowest_m", "band_highest_m")
    )
    low, high = (
        (facts.residual_lowest_hz, facts.residual_lowest_m),
        (facts.residual_highest_hz, facts.residual_highest_m),
    )
    return ResidualBand(lowest, highest, (low, high))


def _of_model(rom: Path) -> tuple[Array | None, bool]:
    """Areas of the contact nodes of a reduced model, and whether each wave has modes of its own."""
    import h5py

    with h5py.File(rom, "r") as model:
        area = model["contact/area"][()] if "contact/area" in model else None
        return area, "cyclic/right" in model or "nodal_diameter" in model


def _branches(source: Any, facts: CurveSummary) -> tuple[PlottedBranch, ...]:
    names = sorted(source.get(BRANCHES, ()), key=int)
    closed = [CLOSED in branch["reason"] for branch in facts.detached]
    return tuple(_branch(source[BRANCHES][name], isola) for name, isola in zip(names, closed, strict=False))


def _branch(group: Any, closed: bool) -> PlottedBranch:
    return PlottedBranch(
        group["frequency_hz"][()],
        group["amplitude_m"][()],
        group["stable"][()].astype(bool),
        group["growth_nodal_diameter"][()],
        closed,
        _outputs(group),
    )


def _outputs(group: Any) -> dict[str, Array]:
    """Amplitudes of the further outputs by their names."""
    names = [name for name in group if name.startswith(AMPLITUDE) and name != "amplitude_m"]
    return {name.removeprefix(AMPLITUDE): group[name][()] for name in names}

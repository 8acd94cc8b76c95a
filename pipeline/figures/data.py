"""What the figures show of solved curves: summaries, the curves read from their files, and the swept keys.

A swept key has its values, their places along an axis, and the label of that axis.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.figures.style import ordered_colours
from pipeline.results.worst import height_mark
from pipeline.scene.fields import NOTHING_MORE
from pipeline.scene.labels import member_label, quantity
from pipeline.scene.schema import MEANINGS, Scene
from pipeline.stages.curve.curve_file import AMPLITUDE, branch_groups, contacts_of_curve, curve_from
from pipeline.stages.curve.curve_summary import checked
from pipeline.stages.engine_orders import Swept
from pipeline.stages.scene_to_solver import InterfaceContact, contact_parameters

if TYPE_CHECKING:
    from nonlinear.contact.parameters import ContactParameters
    from nonlinear.response_curve import ResponseCurve
    from pipeline.scene.reading import Member
    from pipeline.stages.curve.curve_summary import CurveSummary
    from pipeline.stages.curve.respond import CurveResult


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
        known, shown = MEANINGS.get(self.name, NOTHING_MORE), quantity(self.name)
        return ", ".join(filter(None, (replace(shown, symbol=known.name or shown.symbol).axis(), known.sign)))


def sweep_keys(curves: Sequence[Swept]) -> list[SweepKey]:
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


MOST_PANELS, MOST_COLOURS = 6, 12  # for a sweep of two keys


def panel_keys(keys: Sequence[SweepKey]) -> tuple[SweepKey, SweepKey] | None:
    """The key of the colours and that of the panels of a sweep of two keys with few values."""
    if len(keys) != 2 or len(keys[0].values) > MOST_COLOURS or len(keys[1].values) > MOST_PANELS:
        return None
    return keys[0], keys[1]


def curve_colours(curves: Sequence[Swept]) -> list[Any]:
    """Colours of all curves of a run: one a curve, or one a value of the first key of `panel_keys`.

    Every figure takes them, so that a colour stands for the same value in all.
    """
    keys = panel_keys(sweep_keys(curves))
    shades = ordered_colours(len(curves) if keys is None else len(keys[0].values))
    places = range(len(curves)) if keys is None else [keys[0].number(c.parameters[keys[0].name]) for c in curves]
    return [shades[place] for place in places]


def is_grid(curves: Sequence[Swept], keys: Sequence[SweepKey]) -> bool:
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
    """A curve with at least one point: its place in the sweep, and its summary."""

    member: Member
    facts: CurveSummary

    @property
    def index(self) -> int:
        """Number of the curve in the sweep."""
        return self.member.index

    @property
    def label(self) -> str:
        """Its swept parameters in words."""
        return member_label(self.member)

    @property
    def parameters(self) -> Mapping[str, Any]:
        """Swept keys and values."""
        return self.member.parameters

    @property
    def peak(self) -> tuple[float, float]:
        """Frequency, Hz, and amplitude, m, of the highest point of the main branch."""
        return self.facts.peak_frequency_hz, self.facts.peak_amplitude_m

    @property
    def worst(self) -> tuple[float, float]:
        """Frequency, Hz, and amplitude, m, of the worst motion; nan where it is not known."""
        return self.facts.worst_frequency_hz, self.facts.worst_amplitude_m

    @property
    def worst_open(self) -> bool:
        """Whether the worst motion may be higher, because the search left something open."""
        return bool(self.facts.worst_unresolved)

    @property
    def mark(self) -> str:
        """What is said beside the worst motion."""
        return height_mark(self.facts)


@dataclass(frozen=True)
class PlottedCurve(SweepPoint):
    """A curve with its record."""

    rom: Path  # file of its reduced model
    response: ResponseCurve  # without the coefficients of the contact
    peak_displacement: NDArray[
        np.complex128
    ]  # (H+1, n_c, 3), coefficients of the relative displacement at the peak, m
    outputs: tuple[
        Mapping[str, Array], ...
    ]  # of each branch, the largest values of the further outputs over a period
    contacts: tuple[InterfaceContact, ...]  # contact parameters of the curve
    contact_area: Array | None  # (n_c,), areas of the contact nodes, m^2; None where the model does not know them
    joined: bool = False  # whether the sector is that of a bladed disk: each wave has modes of its own

    @property
    def scene(self) -> Scene:
        """Its scene."""
        return self.member.scene

    @property
    def interfaces(self) -> dict[str, range]:
        """The contact nodes of each interface, by its name."""
        ends = np.cumsum([each.nodes for each in self.contacts]).tolist()
        return {each.name: range(end - each.nodes, end) for each, end in zip(self.contacts, ends, strict=True)}

    def node_name(self, node: int) -> str:
        """`node 4`; of several interfaces `node 4 of the snubber`: each has numbers of its own."""
        if len(self.contacts) < 2:
            return f"node {node + 1}"
        name, nodes = next(each for each in self.interfaces.items() if node in each[1])
        return f"node {node - nodes.start + 1} of {name}"

    @property
    def contact_parameters(self) -> ContactParameters:
        """Contact parameters of each of the contact nodes."""
        return contact_parameters(self.contacts, self.contact_area)


def sweep_points(curves: Sequence[CurveResult]) -> list[SweepPoint]:
    """The curves with at least one point; no file is read."""
    return [SweepPoint(c.member, c.facts) for c in curves if c.file and c.rom and c.facts and c.facts.points]


def plotted_curves(curves: Sequence[CurveResult], only: Collection[int] | None = None) -> list[PlottedCurve]:
    """The curves with at least one point; of many, `only` those of these numbers are read."""
    models: dict[Path, tuple[Array | None, bool]] = {}
    found = []
    for curve in curves:
        file, rom, facts = curve.file, curve.rom, curve.facts
        if file and rom and facts and facts.points and (only is None or curve.member.index in only):
            if rom not in models:
                models[rom] = _of_model(rom)
            found.append(_read(SweepPoint(curve.member, facts), file, rom, models[rom]))
    return found


def _read(point: SweepPoint, file: Path, rom: Path, model: tuple[Array | None, bool]) -> PlottedCurve:
    import h5py

    with h5py.File(file, "r") as source:
        return PlottedCurve(
            point.member,
            point.facts,
            rom=rom,
            response=checked(curve_from(source, left_out=("relative_displacement", "contact_force"))),
            peak_displacement=source["relative_displacement"][point.facts.peak_index],
            outputs=tuple(_outputs(group) for group in (source, *branch_groups(source))),
            contacts=contacts_of_curve(source),
            contact_area=model[0],
            joined=model[1],
        )


def residual_band(response: ResponseCurve) -> tuple[Array, Array] | None:
    """Lowest and highest amplitude of a curve over residual tractions, (P,) each, m; None unless asked for.

    Their ratios to the curve are linear in the arc length between the points solved.
    """
    bounds, arc, amplitude = response.residual_bounds, response.arc, response.amplitude_m
    if bounds is None:
        return None
    index = bounds.band_index
    scale = np.where(amplitude[index] > 0.0, amplitude[index], 1.0)
    lowest, highest = (
        amplitude * np.interp(arc, arc[index], band / scale) for band in (bounds.band_lowest_m, bounds.band_highest_m)
    )
    return lowest, highest


def is_isolated(branch: ResponseCurve) -> bool:
    """Whether a detached branch is known to be isolated: it is closed."""
    return CLOSED in branch.termination.message


def _of_model(rom: Path) -> tuple[Array | None, bool]:
    """Areas of the contact nodes of a reduced model, and whether each wave has modes of its own."""
    import h5py

    with h5py.File(rom, "r") as model:
        area = model["contact/area"][()] if "contact/area" in model else None
        return area, "cyclic/right" in model or "nodal_diameter" in model


def _outputs(group: Any) -> dict[str, Array]:
    """Amplitudes of the further outputs by their names."""
    names = [name for name in group if name.startswith(AMPLITUDE) and name != "amplitude_m"]
    return {name.removeprefix(AMPLITUDE): group[name][()] for name in names}

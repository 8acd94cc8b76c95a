"""Response curves of a run, read back: numbers of the summary at once, points when they are asked for."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import NDArray

from pipeline.codec import restored
from pipeline.errors import input_error, shown
from pipeline.results.run_folder import RESPONSE, PointReader
from pipeline.results.worst import END_MARK, truncation_mark, with_unit
from pipeline.scene.labels import value_label
from pipeline.stages.curve.curve_file import BRANCHES
from pipeline.stages.curve.curve_summary import CurveSummary
from pipeline.stages.curve.curve_table import TABLE, CurveTable, LazyArrays
from pipeline.store.output_folder import path_inside

if TYPE_CHECKING:
    import h5py
    from matplotlib.axes import Axes

    from nonlinear.response_curve import Bifurcation, Peak, StaticContact, WorstMotion

Array = NDArray[Any]
_NAN = float("nan")


class _Points:
    """Points of a curve or a branch: the columns as arrays (P,)."""

    datasets: Mapping[str, Array]

    @property
    def frequency_hz(self) -> Array:
        """Excitation frequency, Hz, (P,)."""
        return self.datasets.get("frequency_hz", np.empty(0))

    @property
    def amplitude_m(self) -> Array:
        """Largest displacement of the output over a period, m, (P,)."""
        return self.datasets.get("amplitude_m", np.empty(0))

    @property
    def stable(self) -> Array:
        """Whether the periodic motion is stable, (P,) bool."""
        return self.datasets.get("stable", np.empty(0)).astype(bool)

    @property
    def growth_nodal_diameter(self) -> Array:
        """Nodal diameter of the perturbation that grows most, beside that of the wave, (P,); -1: not known."""
        return self.datasets.get("growth_nodal_diameter", np.full(self.frequency_hz.size, -1))


@dataclass(frozen=True, repr=False, eq=False)
class DetachedBranch(_Points):
    """One detached branch of a curve; its points are read when they are asked for.

    Attributes
    ----------
    datasets : mapping of str to array
        Every dataset of the branch by its name in `response.h5`.
    peak_amplitude_m : float
        Its highest amplitude, m.
    from_hz, to_hz : float
        Frequency range that it covers, Hz.
    stable_points : int
        Number of its points that are stable.
    origin : str
        How it was found.
    born_between : tuple of dict
        Where it ends between this member of a sweep and a neighbour (docs/outputs.md).
    truncation_error : float
        Estimated relative error of its highest amplitude from the neglected harmonics; NaN: not known.
    truncation_branch : str
        As in `Curve`.

    Examples
    --------
    With the names of the example of `Results`:

    >>> [branch.peak_amplitude_m for branch in results.curves[0].detached]  # a mass that only rubs has none
    []
    """

    datasets: Mapping[str, Array]
    peak_amplitude_m: float
    from_hz: float
    to_hz: float
    stable_points: int
    origin: str
    born_between: tuple[dict[str, Any], ...]
    truncation_error: float = _NAN
    truncation_branch: str = ""

    def __repr__(self) -> str:
        height = with_unit(self.peak_amplitude_m)
        return f"<DetachedBranch {self.from_hz:.6g} to {self.to_hz:.6g} Hz, up to {height}>"


@dataclass(frozen=True, repr=False, eq=False)
class Curve(_Points):
    """One response curve of a run: P solution points in the order of the arc length.

    The points (`frequency_hz`, `amplitude_m`, `stable`, `growth_nodal_diameter`, `datasets`, those of `detached`) are
    read from `response.h5` when they are asked for.

    Attributes
    ----------
    number : int
        Its number in the run, from 0.
    parameters : mapping
        Swept scene keys and their values on this curve, {} without a sweep.
    datasets : mapping of str to array
        Every dataset of the curve by its name in `response.h5` (docs/outputs.md).
    peak : Peak or None
        The highest peak of the main branch, None without points; `at_end`: an end of the range, no peak.
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
        Lowest and highest peak over the admissible residual tractions, displacement as a whole, m; NaN unless asked
        for.
    residual_least_vibration_m, residual_most_vibration_m : float
        The same of the vibration about its mean.
    harmonics : int
        Largest number of harmonics balanced at a point.
    detached : tuple of DetachedBranch
        Detached branches, numbered 1, 2, ... in this order.
    bifurcations : tuple of Bifurcation
        Bifurcations of the main branch in the order of its points.
    rom : Path or None
        File of its reduced model, None where that could not be computed.
    static_contact : StaticContact or None
        Contact in static equilibrium at speed: normal force, open share, gap; None where it is not known, and of
        several `interfaces`, which have their own.
    outputs : tuple of dict
        Name, largest value over a period (`peak_amplitude`), frequency and branch of each further output. Its values
        at the points are ``datasets["amplitude_NAME"]``, its complex coefficients ``datasets["output_NAME"]``.
    interfaces : tuple of dict
        Of several contact interfaces, in the order of their nodes: `name`, number of `nodes`, at the peak of the main
        branch those `sticking`, `slipping` and `separating`, the friction work per cycle `dissipated_j`, and the
        static contact: `static_force_n`, `static_open_share`, `static_lowest_m`, `static_highest_m`, `static_opened`.

    Examples
    --------
    With the names of the example of `Results`:

    >>> curve = results.curves[0]
    >>> print(f"{curve.peak.amplitude_m:.2f} m at {curve.peak.frequency_hz:.3f} Hz")
    1.38 m at 0.198 Hz
    >>> bool(curve.amplitude_m.max() == curve.peak.amplitude_m)
    True
    """

    number: int
    parameters: Mapping[str, Any]
    datasets: Mapping[str, Array]
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
    residual_least_vibration_m: float
    residual_most_vibration_m: float
    harmonics: int
    detached: tuple[DetachedBranch, ...]
    bifurcations: tuple[Bifurcation, ...]
    rom: Path | None
    static_contact: StaticContact | None = None
    outputs: tuple[Mapping[str, Any], ...] = ()
    interfaces: tuple[Mapping[str, Any], ...] = ()

    def plot(self, ax: Axes | None = None, *, unit: str = "µm", **look: Any) -> Axes:
        """Draw the response curve.

        Parameters
        ----------
        ax, unit, look
            As in `Results.plot`.

        Returns
        -------
        matplotlib.axes.Axes
            The axes, with labels and units.

        Examples
        --------
        With the names of the example of `Results`:

        >>> from matplotlib.figure import Figure
        >>> results[0].plot(Figure().subplots(), unit="m").get_ylabel()
        'largest displacement over a period [m]'
        """
        from pipeline.figures.quick_plots import plot_curves

        return plot_curves([self], ax, unit, look)

    def __repr__(self) -> str:
        swept = ", ".join(value_label(key, value) for key, value in self.parameters.items())
        peak = "no peak" if self.peak is None else f"peak {with_unit(self.peak.amplitude_m)}"
        peak += "" if self.peak is None else f" at {self.peak.frequency_hz:.6g} Hz{END_MARK * self.peak.at_end}"
        worst = "" if self.worst is None else f", worst motion {with_unit(self.worst.amplitude_m)}"
        worst += (
            "" if self.worst is None else END_MARK * self.worst.at_end + truncation_mark(self.worst.truncation_error)
        )
        end = "" if self.complete else f", incomplete: {self.reason}"
        return f"<Curve {self.number}{': ' if swept else ''}{swept}, {peak}{worst}{end}>"


_OTHER = ("bifurcations", "detached")  # fields of a summary that a curve has as records of their own
_IN_SUMMARY = [f.name for f in fields(Curve) if f.name in CurveSummary.__dataclass_fields__ and f.name not in _OTHER]


class Curves(Sequence[Curve]):
    """The curves of a run, each made when it is asked for."""

    def __init__(self, folder: Path, table: CurveTable, reader: PointReader) -> None:
        self._folder, self._table, self._reader = folder, table, reader

    def __len__(self) -> int:
        return len(self._table)

    @overload
    def __getitem__(self, number: int) -> Curve: ...
    @overload
    def __getitem__(self, number: slice) -> tuple[Curve, ...]: ...
    def __getitem__(self, number: int | slice) -> Curve | tuple[Curve, ...]:
        if isinstance(number, slice):
            return tuple(self[place] for place in range(*number.indices(len(self))))
        if not -len(self) <= number < len(self):
            raise IndexError(f"curve {number}: the run has {len(self)}")
        return self._curve(number % len(self))

    def __repr__(self) -> str:
        return f"<{len(self)} curves>"

    def _curve(self, number: int) -> Curve:
        """One curve; without points where there is no result."""
        from nonlinear.response_curve import Bifurcation

        facts, columns = self._table.row(number), self._table.columns
        source = _Source(self._reader, number, "")
        return Curve(
            number=number,
            parameters=self._table.parameters_of(number),
            datasets=source.datasets if columns["solved"][number] else {},
            peak=facts.peak,
            worst=facts.worst if math.isfinite(facts.worst_amplitude_m) else None,
            detached=_detached(self._reader, number, facts),
            bifurcations=restored(tuple[Bifurcation, ...], facts.bifurcations),
            rom=self._rom(str(columns["rom"][number])),
            static_contact=facts.static_contact,
            **{name: getattr(facts, name) for name in _IN_SUMMARY},
        )

    def _rom(self, text: str) -> Path | None:
        """The file of a reduced model, by its column."""
        try:
            return path_inside(self._folder, text) if text else None
        except ValueError as error:
            raise input_error(self._folder / RESPONSE, f"{TABLE}/rom", shown(text), str(error)) from None


@dataclass(frozen=True)
class _Source:
    """A group of response.h5: that of a curve, or of one of its branches."""

    reader: PointReader
    number: int
    inner: str

    @property
    def datasets(self) -> Mapping[str, Array]:
        """Its arrays by their names."""
        return _Datasets(self)

    @cached_property
    def group(self) -> h5py.Group:
        """The group."""
        curve = self.reader.curve(self.number)
        if curve is None:
            raise ValueError(f"curve {self.number} has no points")
        return curve[self.inner] if self.inner else curve


class _Datasets(Mapping[str, Array]):
    """The arrays of a group, which is opened when they are first asked for."""

    def __init__(self, source: _Source) -> None:
        self._source = source

    @cached_property
    def _arrays(self) -> LazyArrays:
        group = self._source.group
        names = [name for name, item in group.items() if hasattr(item, "dtype")]
        return LazyArrays(names, lambda name: group[name][()])

    def __reduce__(self) -> tuple[Any, ...]:
        source = self._source
        return _Datasets, (_Source(source.reader, source.number, source.inner),)

    def __getitem__(self, name: str) -> Array:
        return self._arrays[name]

    def __iter__(self) -> Any:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def __repr__(self) -> str:
        return repr(self._arrays)


def _detached(reader: PointReader, curve: int, facts: CurveSummary) -> tuple[DetachedBranch, ...]:
    """The detached branches in the order of their numbers."""
    return tuple(
        DetachedBranch(
            datasets=_Source(reader, curve, f"{BRANCHES}/{number}").datasets,
            born_between=tuple(branch["born_between"]),
            truncation_error=_NAN if branch["truncation_error"] is None else branch["truncation_error"],
            truncation_branch=branch["truncation_branch"],
            **{name: branch[name] for name in ("peak_amplitude_m", "from_hz", "to_hz", "stable_points", "origin")},
        )
        for number, branch in enumerate(facts.detached, start=1)
    )

"""The results of a run, read from its output folder into arrays."""

from __future__ import annotations

import html
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.errors import input_error, reason_of
from pipeline.results.curves import Curve, Curves
from pipeline.results.run_folder import RESPONSE, TABLE_HASH, PointReader, read_json_of_run, read_run_summary
from pipeline.scene.labels import prefixed, quantity
from pipeline.stages.curve.curve_table import TABLE, CurveTable, read_table

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes
    from pyvista import Plotter

_ALLOWED = "the output folder of a run"


@dataclass(frozen=True, repr=False, eq=False)
class Results:
    """The results in the output folder of a run; points of curves are read when they are asked for.

    Attributes
    ----------
    folder : Path
        The output folder.
    complete : bool
        Whether everything requested was computed.
    problems : tuple of str
        What was not computed, apart from curves, one line each.
    curves : sequence of Curve
        One for each point of the sweep, in its order.
    summary : mapping
        Content of `summary.json` (docs/outputs.md): times, natural frequencies, pictures.
    table : CurveTable or None
        Numbers of all curves, a column each; None where the run was not asked for curves.

    Examples
    --------
    A mass on a spring that rubs against the ground. Examples of other names of the package go on from here.

    >>> import numpy as np
    >>> from pipeline import run_scene
    >>> from rom import ReducedModel, write_reduced_model
    >>> one = np.ones(1)
    >>> parts = np.eye(1), np.eye(1), np.eye(3, 1), np.zeros((1, 3)), one, {"tip": one}  # mass, stiffness, contact
    >>> blade = ReducedModel(*parts, n_blades=12)
    >>> write_reduced_model("blade.h5", blade)
    >>> contact = {"normal_stiffness": 0.0, "tangential_stiffness": 3.0, "friction": 0.5, "preload": 2.0}
    >>> response = {"frequency": [0.1, 0.4], "harmonics": 1, "damping_ratio": 0.01}
    >>> excitation = {"engine_order": 3, "force": 1.0}
    >>> scene = {"name": "rub", "contact": contact, "excitation": excitation, "response": response}
    >>> results = run_scene(scene, "out/rub", rom="blade.h5", until="respond")
    >>> results.complete, len(results.curves), results.summary["curves"][0]["complete"]
    (True, 1, True)
    >>> len(results), results[0].complete, [curve.number for curve in results]
    (1, True, [0])
    """

    folder: Path
    complete: bool
    problems: tuple[str, ...]
    curves: Sequence[Curve]
    summary: Mapping[str, Any]
    table: CurveTable | None = None

    @property
    def stress(self) -> tuple[Mapping[str, Any], ...]:
        """Stress on the mesh of the curves that it was computed for, as in `summary.json`; empty without [stress]."""
        return tuple(self.summary.get("stress", ()))

    @property
    def studies(self) -> Mapping[str, Mapping[str, Any]]:
        """Results of the studies by their names, such as "optimum", as in their JSON files; empty without any."""
        studies = self.summary.get("studies", {}).items()
        return {name: read_json_of_run(self.folder, study["file"]) for name, study in studies}

    def __len__(self) -> int:
        return len(self.curves)

    def __getitem__(self, number: int) -> Curve:
        return self.curves[number]

    def __iter__(self) -> Iterator[Curve]:
        return iter(self.curves)

    def plot(self, ax: Axes | None = None, *, unit: str = "µm", **look: Any) -> Axes:
        """Draw the response curves.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Axes to draw on; new ones of pyplot by default.
        unit : str
            Unit of the amplitude: "m", "mm", "µm" or "nm".
        look : Any
            Further keywords of `ax.plot`.

        Returns
        -------
        matplotlib.axes.Axes
            The axes, with labels and units.

        Examples
        --------
        With the names of the example of `Results`:

        >>> from matplotlib.figure import Figure
        >>> results.plot(Figure().subplots(), unit="m").get_xlabel()
        'excitation frequency [Hz]'
        """
        from pipeline.figures.quick_plots import plot_curves

        return plot_curves(self.curves, ax, unit, look)

    def plot_peaks(self, over: str | None = None, ax: Axes | None = None, *, unit: str = "µm") -> Axes:
        """Draw peaks and worst motions over a swept key.

        Parameters
        ----------
        over : str, optional
            The swept key, such as "contact.interference"; that with the most values by default.
        ax, unit
            As in `plot`.

        Returns
        -------
        matplotlib.axes.Axes
            The axes, with labels and units.

        Raises
        ------
        InputError
            The run does not sweep the key.

        Examples
        --------
        With the names of the example of `Results`:

        >>> import shroud
        >>> try:
        ...     results.plot_peaks()
        ... except shroud.InputError as error:
        ...     print(error)
        over: None, allowed: nothing: the run sweeps no key
        """
        from pipeline.figures.quick_plots import plot_peaks

        return plot_peaks(self.curves, over, ax, unit)

    def show_mode(self, number: int = 1, *, contact: str = "free", model: int = 0, show: bool = True) -> Plotter:
        """Show a mode shape on the mesh, in a window or in a notebook.

        Parameters
        ----------
        number : int
            Number of the mode, from 1.
        contact : str
            "free", "sliding" or "stuck" shrouds.
        model : int
            Place of the reduced model in ``summary["models"]``; it has the engine order of its first curve there, and
            the contact stiffness of the face shared by area.
        show : bool
            Whether it is shown now; otherwise more can be added to the plotter first.

        Returns
        -------
        pyvista.Plotter
            The plotter.

        Raises
        ------
        InputError
            The reduced model has no mesh, or there is no such mode.
        rom.ReducedModelError
            The run was not asked for shapes: [render] in the scene.

        Examples
        --------
        >>> results = run_scene("scenes/dummy.toml", until="render")  # doctest: +SKIP
        >>> results.show_mode(1, contact="stuck")  # doctest: +SKIP
        """
        from pipeline.render.show_mode import mode_plotter

        plotter = mode_plotter(self, number, contact, model)
        if show:
            plotter.show()
        return plotter

    def to_dataframe(self, points: bool = False) -> pandas.DataFrame:
        """The results as a table of pandas: a row for each curve, or for each point.

        Parameters
        ----------
        points : bool
            Whether a row is a point, as in `response.csv`; otherwise it is a curve, as in `curves.csv`.

        Returns
        -------
        pandas.DataFrame
            Names of columns end with their units; SI units, angles in degrees.

        Raises
        ------
        InputError
            The package pandas is missing.
        """
        from pipeline.results.frames import curves_frame, points_frame

        return points_frame(self.curves, self.table) if points else curves_frame(self.table)

    def to_xarray(self) -> xarray.Dataset:
        """Numbers of the curves as labelled arrays of xarray.

        Returns
        -------
        xarray.Dataset
            Variables as in `curves.csv`. Where the sweep is a grid the dimensions are the swept keys; otherwise there
            is one dimension "curve", with the swept keys as coordinates. Attribute `units` where there is one.

        Raises
        ------
        InputError
            The package xarray is missing.
        """
        from pipeline.results.frames import curves_dataset

        return curves_dataset(self.table)

    def __repr__(self) -> str:
        return f"<Results {self.folder}: {self._said()}>"

    def _repr_html_(self) -> str:
        """A small table for notebooks: what was run, and its first curves."""
        from pipeline.results.frames import html_rows

        head = f"<b>{html.escape(str(self.folder))}</b>: {html.escape(self._said())}"
        return head if self.table is None else head + html_rows(self.table)

    def _said(self) -> str:
        """What was computed, in a few words."""
        count = len(self.curves)
        said = f"{count} curve{'s' * (count != 1)}"
        if self.table is not None and self.table.parameters:
            said += f" over {', '.join(quantity(key).symbol for key in self.table.parameters)}"
        if self.table is not None and (heights := self.table.heights)[heights == heights].size:
            highest = heights[heights == heights].max()
            factor, unit = prefixed(highest, "m")
            said += f", up to {highest * factor:.4g} {unit}"
        return said if self.complete else f"{said}, not complete"


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

    Examples
    --------
    With the names of the example of `Results`:

    >>> from pipeline import read_results
    >>> read_results("out/rub").curves[0].peak == results.curves[0].peak
    True
    """
    folder = Path(folder)
    summary = read_run_summary(folder)
    values = folder, summary["complete"], tuple(summary["problems"])
    if summary["response"] is None:
        return Results(*values, (), summary)
    try:
        reader = PointReader(folder / RESPONSE, summary[TABLE_HASH], summary["response"][RESPONSE])
        table = read_table(reader.file[TABLE])
        return Results(*values, Curves(folder, table, reader), summary, table)
    except FileNotFoundError:
        raise input_error(folder, "", f"holds no {RESPONSE}", _ALLOWED) from None
    except (OSError, ValueError, KeyError, TypeError) as error:
        if read_run_summary(folder) != summary:  # a run has replaced the files in between
            return read_results(folder)
        raise input_error(folder, "", f"{RESPONSE} cannot be read: {reason_of(error)}", _ALLOWED) from None

"""Running a scene from Python: as `shroud run` and `shroud respond`, with the results as arrays."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.errors import input_error, shown
from pipeline.output_paths import output_path
from pipeline.scene.reading import SceneFile
from pipeline.scene.schema import Scene

if TYPE_CHECKING:
    from pipeline.explore.start import Explorer
    from pipeline.process.progress import Reporter
    from pipeline.results.results import Results
    from pipeline.stages.request import Request
    from pipeline.studies.identify.result import Identification
    from rom.cyclic.reduced_model import ReducedModel

KEYWORDS = (*Scene.model_fields, "sweep")
MODEL_STAGES = ("mesh", "assemble", "reduce")


def run_scene(
    scene: SceneFile | Mapping[str, Any] | str | os.PathLike[str] | None = None,
    out: str | os.PathLike[str] | None = None,
    *,
    rom: ReducedModel | str | os.PathLike[str] | None = None,
    until: str | None = None,
    force: bool = False,
    recompute: bool = False,
    jobs: int = 1,
    quiet: bool | None = None,
    scheduler: str | None = None,
    overrides: Mapping[str, Any] | None = None,
    **tables: Any,
) -> Results:
    """Run a scene like `shroud run`, recomputing only what has changed.

    Parameters
    ----------
    scene : SceneFile, mapping, str or path
        The scene file, its tables as a dict, or the result of `read_scene`; None: `tables` alone, with a `rom`.
    out : str or path
        Output folder, by default out/NAME with the scene's name; it is created where it does not exist.
    rom : ReducedModel, str or path
        A model from elsewhere, see `ReducedModel.from_matrices`, or its file; the scene then needs no blade.
    until : str
        Last stage to run, such as "mesh"; by default everything that the scene asks for.
    force, recompute : bool
        Whether values far beyond the usual are accepted; whether everything is computed again, unchanged or not.
    jobs : int
        Curves solved at the same time, in processes of their own.
    quiet : bool
        Whether nothing is printed. By default progress is shown at a terminal and in a notebook only.
    scheduler : str
        Scheduler of dask.distributed: its address, tcp://HOST:PORT, or its file. "local:N": N processes on this
        machine, without dask; the calling script then needs the same line as with several jobs.
    overrides : mapping of str to value
        Dotted keys with values in place of the scene's, {"contact.friction": 0.3}; none is swept, None removes one.
    **tables : mapping or value
        The same by tables: `contact={"friction": 0.3}`, `accuracy="draft"`, `sweep={"shroud.angle": [70.0, 90.0]}`.

    Returns
    -------
    Results
        Curves and summary of the run. A curve that is not complete does not raise: its `reason` says why.

    Raises
    ------
    InputError
        The scene, the reduced model, the folder, `until` or the cluster is not usable.
    RuntimeError
        With `until` "mesh", "assemble" or "reduce": a model could not be made.
    ExecutorLost
        The scheduler, or every worker, is lost; what is done is kept.

    Examples
    --------
    >>> run_scene("scenes/dummy.toml", "out/try", until="mesh", overrides={"mesh.size": 0.008}).complete
    True
    """
    from pipeline.scene.reading import given_scene
    from pipeline.stages.request import Request

    _check_arguments(until, tables)
    if scene is None and rom is None:
        raise TypeError("run_scene() needs a scene, or rom with the tables of one")
    file = given_scene({"name": "model"} if scene is None else scene, overrides or {}, rom is not None, tables)
    folder = Path("out") / file.first.name if out is None else output_path(out, "out")
    work = jobs if scheduler is None else None, _file_or_model(rom), *_cluster(scheduler)
    return _results(Request(file, folder, until, force, *work, recompute), quiet)


def explore_scene(
    scene: SceneFile | Mapping[str, Any] | str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    rom: ReducedModel | str | os.PathLike[str] | None = None,
    overrides: Mapping[str, Any] | None = None,
    quiet: bool | None = None,
) -> Explorer:
    """Turn the knobs of a scene: a page on which the response follows, as `shroud explore`. Also `shroud.explore`.

    Parameters
    ----------
    scene : SceneFile, mapping, str or path
        As in `run_scene`. Of a sweep the member in the middle is where the knobs stand.
    out : str or path
        Output folder, by default out/NAME with the scene's name: models are stored there.
    rom : ReducedModel, str or path
        A model from elsewhere, as in `run_scene`.
    overrides : mapping of str to value
        Dotted keys with values that replace those of the scene.
    quiet : bool
        Whether nothing is printed while the model is built.

    Returns
    -------
    Explorer
        A notebook shows the page as the value of a cell; elsewhere open its `address`, `close` it when done.

    Raises
    ------
    InputError
        The scene or the model is not usable, or Bokeh is missing (`pip install 'shroud[explore]'`).

    Examples
    --------
    >>> page = explore_scene("scenes/dummy.toml", "out/try", overrides={"mesh.size": 0.008})
    >>> page.close()
    """
    from pipeline.explore.start import Explorer, page_server
    from pipeline.scene.reading import given_scene

    file = given_scene(scene, overrides or {}, given_model=rom is not None)
    folder = None if out is None else output_path(out, "out")
    return Explorer(page_server(file, folder, _file_or_model(rom), reporter=_reporter(quiet)))


def identify_scene(
    scene: SceneFile | Mapping[str, Any] | str | os.PathLike[str],
    data: Mapping[str, Any] | str | os.PathLike[str] | None = None,
    out: str | os.PathLike[str] | None = None,
    *,
    over: Mapping[str, tuple[float, float]] | None = None,
    rom: ReducedModel | str | os.PathLike[str] | None = None,
    jobs: int = 1,
    quiet: bool | None = None,
    overrides: Mapping[str, Any] | None = None,
) -> Identification:
    """Find keys of a scene from measured motions, as `shroud identify`. Also `shroud.identify`.

    Parameters
    ----------
    scene : SceneFile, mapping, str or path
        As in `run_scene`. Of a sweep the first values count.
    data : mapping, str or path
        Columns of measured motions by their names, arrays or those of a table of pandas, or the file that holds them;
        None: what [identify] of the scene names.
    out : str or path
        Output folder, by default out/NAME with the scene's name: identify.json, its figure, identified.toml.
    over : mapping of str to (float, float)
        Dotted keys with the ranges in which they may lie; None: those of [identify].
    rom : ReducedModel, str or path
        A model from elsewhere, as in `run_scene`.
    jobs : int
        Curves solved at the same time, in processes of their own.
    quiet : bool
        Whether nothing is printed. By default progress is shown at a terminal and in a notebook only.
    overrides : mapping of str to value
        Dotted keys with values that replace those of the scene.

    Returns
    -------
    Identification
        The values with their intervals, and what the data do not tell.

    Raises
    ------
    InputError
        The scene, the model or the data are not usable.
    RuntimeError
        There are no values under which all measured motions exist.

    Examples
    --------
    With the names of the example of `Results`: friction from three peaks.

    >>> from pipeline import identify_scene
    >>> data = {"frequency_hz": [0.26, 0.198, 0.1595], "amplitude_m": [0.61, 1.38, 37.0]}
    >>> data["excitation.force"] = [0.6, 1.0, 2.0]  # as in each row
    >>> found = identify_scene(scene, data, "out/rub", over={"contact.friction": (0.1, 1.0)}, rom="blade.h5")
    >>> [round(item.value, 1) for item in found.keys], found.fits
    ([0.5], True)
    """
    from pipeline.identify import identify
    from pipeline.scene.reading import given_scene
    from pipeline.stages.request import Request

    file = given_scene(scene, overrides or {}, given_model=rom is not None)
    folder = output_path(out if out is not None else os.path.join("out", file.first.name), "out")
    request = Request(file, folder, "respond", jobs=jobs, rom=_file_or_model(rom))
    asked = [f"{key}={float(low)!r}:{float(high)!r}" for key, (low, high) in (over or {}).items()]
    found = identify(request, data, asked, _reporter(quiet))
    if found.result is None:
        raise RuntimeError("; ".join(found.problems))
    result: Identification = found.result
    return result


def _file_or_model(rom: ReducedModel | str | os.PathLike[str] | None) -> ReducedModel | Path | None:
    return Path(rom) if isinstance(rom, str | os.PathLike) else rom


def _results(request: Request, quiet: bool | None) -> Results:
    """Run what is asked for, and read what it left."""
    from pipeline.results.results import read_results
    from pipeline.run import execute

    outcome = execute(request, _reporter(quiet))
    if outcome.problems and request.until in MODEL_STAGES:  # there are no curves that could say so
        raise RuntimeError("; ".join(outcome.problems))
    return read_results(request.out)


def _cluster(scheduler: str | None) -> tuple[str | None, str | None]:
    """The options --scheduler and --cluster."""
    started = scheduler is not None and scheduler.startswith("local:")
    return (None, scheduler) if started else (scheduler, None)


def _check_arguments(until: str | None, tables: Mapping[str, Any]) -> None:
    """Refuse a stage and tables that there are not."""
    from pipeline.stages.stage import Stage

    if until is not None and until not in tuple(Stage):
        raise input_error("until", "", shown(until), ", ".join(Stage))
    if unknown := [name for name in tables if name not in KEYWORDS]:
        raise TypeError(
            f"run_scene() got an unexpected keyword argument '{unknown[0]}'; tables: {' '.join(KEYWORDS)}"
        )


def _reporter(quiet: bool | None) -> Reporter:
    """What shows the progress: a bar at a terminal and in a notebook that can show one, lines in other notebooks."""
    from pipeline.process.progress import Reporter

    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    notebook = type(shell).__name__ == "ZMQInteractiveShell"  # a notebook's, not that of a terminal
    if quiet is None:
        quiet = not notebook and not (sys.stderr is not None and sys.stderr.isatty())
    if notebook:
        return Reporter(quiet, sys.stdout, live=find_spec("ipywidgets") is not None)
    return Reporter(quiet)

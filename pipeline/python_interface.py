"""Running a scene from Python: as `shroud run` and `shroud respond`, with the results as arrays."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.errors import input_error, shown
from pipeline.output_paths import output_path
from pipeline.scene.reading import SceneFile, read_scene

if TYPE_CHECKING:
    from pipeline.results.results import Results


def run_scene(
    scene: SceneFile | str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    rom: str | os.PathLike[str] | None = None,
    until: str | None = None,
    force: bool = False,
    jobs: int = 1,
    quiet: bool = True,
    scheduler: str | None = None,
    cluster: str | None = None,
) -> Results:
    """Run a scene like `shroud run`, recomputing only what has changed.

    Parameters
    ----------
    scene : SceneFile, str or path
        The scene file, or the result of `read_scene`.
    out : str or path
        Output folder, by default out/NAME with the scene's name; it is created where it does not exist.
    rom : str or path
        File of a reduced model from elsewhere, as `shroud respond --rom`; the scene then needs no blade.
    until : str
        Last stage to run: "mesh", "assemble", "reduce", "respond", "render", "figures" or "report"; by default
        everything that the scene asks for.
    force : bool
        Whether everything is computed again, even what has not changed.
    jobs : int
        Curves solved at the same time, in processes of their own. With more than one the calling script needs
        `if __name__ == "__main__":`.
    quiet : bool
        Whether nothing is printed; otherwise progress goes to stderr.
    scheduler : str
        A cluster of dask.distributed to solve the curves on: the address of its scheduler, tcp://HOST:PORT, or its
        scheduler file.
    cluster : str
        "local:N" starts a cluster of N workers on this machine for this run; the calling script needs the same line.

    Returns
    -------
    Results
        Curves and summary of the run.

    Raises
    ------
    InputError
        The scene or the reduced model is not usable, the folder cannot be written, `until` is no stage, or there is
        no such cluster.
    ExecutorLost
        The scheduler, or every worker, is lost; what is done is kept.

    Notes
    -----
    A curve that could not be completed does not raise: its `complete` is False and its `reason` says why.
    """
    from pipeline.process.progress import Reporter
    from pipeline.results.results import read_results
    from pipeline.run import execute
    from pipeline.stages.request import Request
    from pipeline.stages.stage_names import Stage

    if until is not None and until not in tuple(Stage):
        raise input_error("until", "", shown(until), ", ".join(Stage))
    file = scene if isinstance(scene, SceneFile) else read_scene(scene, given_model=rom is not None)
    folder = Path("out") / file.first.name if out is None else output_path(out, "out")
    given, own = None if rom is None else Path(rom), jobs if scheduler is None and cluster is None else None
    execute(Request(file, folder, until, force, own, given, scheduler, cluster), Reporter(quiet))
    return read_results(folder)

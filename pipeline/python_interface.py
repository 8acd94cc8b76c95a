"""A scene run from Python: what `shroud run` and `shroud respond` do, with the results as arrays."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.errors import input_error, shown
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
) -> Results:
    """Run a scene like `shroud run`: whatever is missing or out of date in its output folder, nothing else.

    Parameters
    ----------
    scene : the scene file, or what `read_scene` made of it.
    out : output folder, by default out/NAME with the scene's name; it is made if it is not there.
    rom : file of a reduced model from elsewhere, as `shroud respond --rom`; the scene then needs no blade.
    until : stage whose result is wanted: "mesh", "assemble", "reduce", "respond", "render", "figures" or "report";
        by default everything that the scene asks for.
    force : make everything again, whatever is there.
    jobs : curves solved at once, in processes of their own. With more than one the calling script needs
        `if __name__ == "__main__":`.
    quiet : say nothing; otherwise progress goes to stderr.

    A curve that could not be completed does not raise: its `complete` is False and its `reason` says why.

    Raises
    ------
    InputError : the scene or the reduced model is not usable, the folder cannot be written, or `until` is no stage.
    """
    from pipeline.process.progress import Reporter
    from pipeline.results.results import read_results
    from pipeline.run import execute
    from pipeline.stages.request import Request
    from pipeline.stages.stage_names import Stage

    if until is not None and until not in tuple(Stage):
        raise input_error("until", "", shown(until), ", ".join(Stage))
    file = scene if isinstance(scene, SceneFile) else read_scene(scene, given_model=rom is not None)
    folder = Path("out") / file.first.name if out is None else Path(out)
    execute(Request(file, folder, until, force, jobs, None if rom is None else Path(rom)), Reporter(quiet))
    return read_results(folder)

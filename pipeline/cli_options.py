"""Arguments and options that several commands share, and the values that options take."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from pipeline.output_paths import output_path
from pipeline.stages.stage_names import Stage

MOST_JOBS = 256
TOLERANCES = 1e-6, 0.5
ALLOWED = {  # values of options by their names
    "until": ", ".join(Stage),
    "jobs": f"a whole number, 1 to {MOST_JOBS}",
    "curve": "a whole number, 0 or more",
    "frequency": "a number, Hz",
    "branch": "a whole number, 0 or more",
    "solution": "a whole number, 1 or more",
    "tolerance": "a number, {:g} to {:g}".format(*TOLERANCES),
}


def path_parser(option: str) -> Callable[[str], Path]:
    """A parser of paths that are written to, for an option."""
    return lambda text: output_path(text, option)


# readable=False: a file that may not be read is told of by the code that reads it, like everything else about a file
SceneArgument = Annotated[Path, typer.Argument(metavar="SCENE", help="Scene file, TOML.", readable=False)]
OutOption = Annotated[
    Path | None,
    typer.Option(
        "--out", metavar="DIR", parser=path_parser("--out"), help="Output folder; out/<scene name> by default."
    ),
]
ForceOption = Annotated[bool, typer.Option("--force", help="Compute everything again, even what has not changed.")]
JobsOption = Annotated[
    int | None,
    typer.Option(
        "--jobs", min=1, max=MOST_JOBS, help="Curves solved at once; one for each core by default, if worth it."
    ),
]
SchedulerOption = Annotated[
    str | None, typer.Option("--scheduler", metavar="ADDRESS", help="A cluster to use: tcp://HOST:PORT or its file.")
]
ClusterOption = Annotated[
    str | None, typer.Option("--cluster", metavar="local:N", help="A cluster of N workers to start on this machine.")
]
QuietOption = Annotated[bool, typer.Option("--quiet", help="Print errors only.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the results as JSON, and nothing else on stdout.")]

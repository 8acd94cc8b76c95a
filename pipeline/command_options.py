"""Options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pipeline.command_usage import MOST_JOBS, output_parser

# readable=False: a file that may not be read is told of by the code that reads it, like everything else about a file
SceneArgument = Annotated[Path, typer.Argument(metavar="SCENE", help="Scene file, TOML.", readable=False)]
OutOption = Annotated[
    Path | None,
    typer.Option(
        "--out", metavar="DIR", parser=output_parser("--out"), help="Output folder; out/<scene name> by default."
    ),
]
ForceOption = Annotated[
    bool, typer.Option("--force", help="Compute everything again, and accept values far beyond the usual.")
]
AcceptOption = Annotated[bool, typer.Option("--force", help="Accept values far beyond the usual, as run --force.")]
JobsOption = Annotated[
    int | None,
    typer.Option(
        "--jobs",
        min=1,
        max=MOST_JOBS,
        help="Curves solved at once; by default one per core, unless the run is short.",
    ),
]
SchedulerOption = Annotated[
    str | None,
    typer.Option(
        "--scheduler", metavar="ADDRESS", help="An existing cluster: tcp://HOST:PORT, or its scheduler file."
    ),
]
ClusterOption = Annotated[
    str | None, typer.Option("--cluster", metavar="local:N", help="N worker processes on this machine, for this run.")
]
QuietOption = Annotated[bool, typer.Option("--quiet", help="Print errors only.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the results as JSON, and nothing else on stdout.")]
UnitOption = Annotated[str | None, typer.Option("--unit", metavar="UNIT", help="Of the mesh file: m, mm or in.")]
AxisOption = Annotated[
    str | None, typer.Option("--axis", metavar="AXIS", help="Engine axis in the mesh file: x, y, z, -x, -y or -z.")
]
BladesOption = Annotated[int | None, typer.Option("--blades", metavar="N", help="Blades of the ring of the mesh.")]
RomOption = Annotated[
    Path | None, typer.Option("--rom", metavar="FILE.h5", help="Reduced model, as in respond.", readable=False)
]
ObjectiveOption = Annotated[
    str | None,
    typer.Option(
        "--objective", metavar="WHAT", help="What is made low: displacement (largest, default) or harmonic_1."
    ),
]
OverOption = Annotated[
    list[str] | None,
    typer.Option(
        "--over", metavar="KEY=LOW:HIGH", help="A key of the scene and its range, or the key alone; several times."
    ),
]

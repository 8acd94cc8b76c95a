"""The command line `shroud`: arguments in, exit status out. Each command imports what it needs."""

from __future__ import annotations

import sys
import warnings
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from pipeline.request import Outcome, Request
    from pipeline.verify.stage import Verification

COMPUTED, NOT_REACHED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
NO_TERMINAL = 110  # characters a line of a table may have where no terminal says

app = typer.Typer(
    name="shroud",
    help="Nonlinear forced response of shrouded turbine blades, from blade geometry to response curves.",
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


class Stage(StrEnum):
    """The stages of a run, in their order."""

    mesh = "mesh"
    assemble = "assemble"
    reduce = "reduce"
    respond = "respond"
    render = "render"
    figures = "figures"
    report = "report"


SceneArgument = Annotated[Path, typer.Argument(metavar="SCENE", help="Scene file, TOML.")]
OutOption = Annotated[Path | None, typer.Option("--out", help="Output folder; out/<scene name> by default.")]
ForceOption = Annotated[bool, typer.Option("--force", help="Make everything again, whatever is there.")]
JobsOption = Annotated[int, typer.Option("--jobs", min=1, max=256, help="Curves solved at once, in processes.")]
QuietOption = Annotated[bool, typer.Option("--quiet", help="Say nothing but errors.")]


@app.command()
def run(
    scene: SceneArgument,
    out: OutOption = None,
    until: Annotated[Stage | None, typer.Option(help="Stage whose result is wanted.")] = None,
    force: ForceOption = False,
    jobs: JobsOption = 1,
    quiet: QuietOption = False,
) -> None:
    """Run a scene: whatever is missing or out of date, nothing else."""
    from pipeline.request import Request
    from pipeline.scene_file import read_scene

    file = read_scene(scene)
    target = out or Path("out") / file.first.name
    _finish(Request(file, target, until.value if until else None, force, jobs), quiet)


@app.command()
def respond(
    scene: SceneArgument,
    rom: Annotated[Path, typer.Option("--rom", metavar="FILE.h5", help="Reduced model, HDF5.")],
    out: OutOption = None,
    force: ForceOption = False,
    jobs: JobsOption = 1,
    quiet: QuietOption = False,
) -> None:
    """Run the nonlinear stage alone, on any reduced model; the scene needs no blade."""
    from pipeline.request import Request
    from pipeline.scene_file import read_scene

    file = read_scene(scene, given_model=True)
    _finish(Request(file, out or Path("out") / file.first.name, None, force, jobs, rom), quiet)


@app.command()
def verify(
    scene: SceneArgument,
    out: OutOption = None,
    tolerance: Annotated[
        float | None, typer.Option(min=1e-6, max=0.5, help="Relative error to stay within; rom.tolerance by default.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the numbers as JSON.")] = False,
    force: ForceOption = False,
    quiet: QuietOption = False,
) -> None:
    """Measure what modes left out and mesh do to the reduced models of a scene, and say which to refine."""
    from pipeline.interruption import handling_interrupts
    from pipeline.progress import Reporter
    from pipeline.scene_file import read_scene
    from pipeline.verify.stage import verify as measure

    file = read_scene(scene)
    with handling_interrupts() as interrupts:
        reporter = Reporter(quiet, interrupts=interrupts)
        found = measure(file, out or Path("out") / file.first.name, tolerance, force, reporter)
    _print_errors(found, as_json)
    for problem in found.problems:
        print(problem, file=sys.stderr)
    raise typer.Exit(NOT_REACHED if found.problems else COMPUTED)


@app.command()
def report(
    scene: SceneArgument,
    out: OutOption = None,
    force: ForceOption = False,
    jobs: JobsOption = 1,
    quiet: QuietOption = False,
) -> None:
    """Run a scene and write one self-contained page about it: report.html in the output folder."""
    run(scene, out, Stage.report, force, jobs, quiet)


@app.command()
def info(file: Annotated[Path, typer.Argument(metavar="FILE.h5", help="A response or a reduced model.")]) -> None:
    """Say what a result or a reduced model holds."""
    from pipeline.info import describe

    for line in describe(file):
        print(line)


@app.command()
def export(
    source: Annotated[Path, typer.Argument(metavar="FILE.h5", help="A response or a reduced model.")],
    to: Annotated[Path, typer.Option("--to", metavar="FILE", help="Ends with .mat, .uff, .unv or .vtu.")],
    mesh: Annotated[
        Path | None, typer.Option("--mesh", metavar="FILE", help="For .vtu: mesh.vtu of the model.")
    ] = None,
) -> None:
    """Write a response or a reduced model for other programs."""
    from pipeline.export.write import export as write

    print(f"{to}: {write(source, to, mesh)}")


@app.command()
def validate(scene: SceneArgument) -> None:
    """Check a scene and run nothing."""
    from pipeline.checks import check_scene
    from pipeline.scene_file import read_scene
    from pipeline.slips import slips

    file = read_scene(scene)
    check_scene(file)
    _warn(slips(file))
    curves = f"{len(file.members)} curve{'s' if len(file.members) > 1 else ''}"
    print(f"{scene}: valid, {curves}" + (f" over {', '.join(file.swept)}" if file.swept else ""))
    if file.accuracy is not None:
        print(file.accuracy.text())


@app.command()
def new(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to make; the scene takes its name.")],
) -> None:
    """Write a commented scene to start from, and its schema for editors."""
    from pipeline.new_scene import write_new_scene

    scene, schema = write_new_scene(folder)
    print(f"written: {scene}, {schema}")
    print(f"next: shroud run {scene}")


@app.command()
def schema() -> None:
    """Print the JSON schema of a scene, for editors."""
    import json

    from pipeline.scene_schema import scene_schema

    print(json.dumps(scene_schema(), indent=1))


def main() -> None:
    """Entry point: exit status 0 all computed, 1 something not reached, 2 bad input, 130 interrupted."""
    sys.exit(command(sys.argv[1:]))


def command(arguments: list[str]) -> int:
    """Run one command line; returns its exit status. Errors of any kind are one line on stderr."""
    from typer.exceptions import Abort, Exit, TyperException

    from pipeline.errors import InputError, one_line, reason_of

    if not sys.warnoptions:  # what libraries remark is for those who ask for it by python -W
        warnings.simplefilter("ignore")
    try:
        status = app(args=arguments or ["--help"], prog_name="shroud", standalone_mode=False)
        status = int(status) if isinstance(status, int) else COMPUTED
    except Exit as stop:
        status = stop.exit_code
    except TyperException as error:
        print(f"shroud: {one_line(error.format_message())} (shroud --help)", file=sys.stderr)
        return BAD_INPUT
    except InputError as error:
        print(error, file=sys.stderr)
        return BAD_INPUT
    except (KeyboardInterrupt, Abort):
        status = INTERRUPTED
    except BrokenPipeError:
        return NOT_REACHED
    except Exception as error:
        print(f"shroud: {type(error).__name__}: {reason_of(error)}", file=sys.stderr)
        return NOT_REACHED
    if status == INTERRUPTED:
        print("shroud: interrupted; what is done is kept, the same command goes on from there", file=sys.stderr)
    return status


def _finish(request: Request, quiet: bool) -> None:
    """Execute, tell people what came of it, and exit with the status that says so."""
    from pipeline.interruption import handling_interrupts
    from pipeline.progress import Reporter
    from pipeline.run import execute

    with handling_interrupts() as interrupts:
        outcome = execute(request, Reporter(quiet, interrupts=interrupts))
    if not quiet:
        _tell(request, outcome)
    for problem in outcome.problems:
        print(problem, file=sys.stderr)
    failed = [curve for curve in outcome.curves if not curve.complete]
    if failed:
        first = failed[0].reason
        print(f"{len(failed)} of {len(outcome.curves)} curves not completed: {first}", file=sys.stderr)
    raise typer.Exit(COMPUTED if outcome.complete else NOT_REACHED)


def _warn(lines: list[str]) -> None:
    for line in lines:
        print(f"warning: {line}", file=sys.stderr)


def _print_errors(found: Verification, as_json: bool) -> None:
    import json

    from pipeline.verify.stage import plain

    if as_json:
        print(json.dumps(plain(found), indent=1, allow_nan=False))
        return
    from rich.console import Console

    from pipeline.verify.table import error_table, heading, overview

    console = Console(width=None if sys.stdout.isatty() else NO_TERMINAL)
    for line in dict.fromkeys(heading(errors) for _, errors in found.measured):
        print(line)
    if len(found.measured) == 1:
        case, errors = found.measured[0]
        console.print(error_table(errors, case.scene.response.frequency[1]))
    elif found.measured:
        console.print(overview(found.measured))
    for each in found.advice:
        print(each.text)


def _tell(request: Request, outcome: Outcome) -> None:
    from rich.console import Console

    from pipeline.slips import range_remark
    from pipeline.tables import curve_table, harmonics_warning, mode_notes, motion_notes

    if outcome.curves:
        width = None if sys.stdout.isatty() else NO_TERMINAL
        Console(width=width).print(curve_table(outcome))
    for note in [*mode_notes(outcome), *motion_notes(outcome)]:
        print(note)
    if request.scene.accuracy is not None:
        print(request.scene.accuracy.text())
    if warning := harmonics_warning(outcome):
        print(warning, file=sys.stderr)
    if remark := range_remark(outcome, request.scene.first):
        _warn([remark])
    page = f", {outcome.report}" if outcome.report else ""
    print(f"{outcome.seconds:.2f} s, results in {request.out}{page}")

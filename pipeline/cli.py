"""The command line `shroud`: arguments in, exit status out. Each command imports what it needs."""

from __future__ import annotations

import os
import signal
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from pipeline.process.interrupts import Interrupts
    from pipeline.stages.request import Request, RunOutcome
    from pipeline.verify.stage import Verification

COMPUTED, NOT_REACHED, BAD_INPUT, BY_SIGNAL = 0, 1, 2, 128  # the last: and the number of the signal
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
JobsOption = Annotated[
    int | None,
    typer.Option("--jobs", min=1, max=256, help="Curves solved at once; one for each core by default, if worth it."),
]
QuietOption = Annotated[bool, typer.Option("--quiet", help="Say nothing but errors.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print what came out as JSON, and nothing else on stdout.")]


@app.command()
def run(
    scene: SceneArgument,
    out: OutOption = None,
    until: Annotated[Stage | None, typer.Option(help="Stage whose result is wanted.")] = None,
    force: ForceOption = False,
    jobs: JobsOption = None,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run a scene: whatever is missing or out of date, nothing else."""
    from pipeline.scene.reading import read_scene
    from pipeline.stages.request import Request

    file = read_scene(scene)
    target = out or Path("out") / file.first.name
    _finish(Request(file, target, until.value if until else None, force, jobs), quiet, as_json)


@app.command()
def respond(
    scene: SceneArgument,
    rom: Annotated[Path, typer.Option("--rom", metavar="FILE.h5", help="Reduced model, HDF5.")],
    out: OutOption = None,
    force: ForceOption = False,
    jobs: JobsOption = None,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run the nonlinear stage alone, on any reduced model; the scene needs no blade."""
    from pipeline.scene.reading import read_scene
    from pipeline.stages.request import Request

    file = read_scene(scene, given_model=True)
    _finish(Request(file, out or Path("out") / file.first.name, None, force, jobs, rom), quiet, as_json)


@app.command()
def verify(
    scene: SceneArgument,
    out: OutOption = None,
    tolerance: Annotated[
        float | None, typer.Option(min=1e-6, max=0.5, help="Relative error to stay within; rom.tolerance by default.")
    ] = None,
    as_json: JsonOption = False,
    force: ForceOption = False,
    quiet: QuietOption = False,
) -> None:
    """Measure what modes left out and mesh do to the reduced models of a scene, and say which to refine."""
    from pipeline.process.progress import Reporter
    from pipeline.scene.reading import read_scene
    from pipeline.verify.stage import verify as measure

    file = read_scene(scene)
    with _stoppable() as interrupts:
        reporter = Reporter(quiet, interrupts=interrupts)
        found = measure(file, out or Path("out") / file.first.name, tolerance, force, reporter)
    _print_errors(found, quiet, as_json)
    for problem in found.problems:
        _say(problem)
    raise typer.Exit(NOT_REACHED if found.problems else COMPUTED)


@app.command()
def report(
    scene: SceneArgument,
    out: OutOption = None,
    force: ForceOption = False,
    jobs: JobsOption = None,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run a scene and write one self-contained page about it: report.html in the output folder."""
    run(scene, out, Stage.report, force, jobs, quiet, as_json)


@app.command()
def info(
    file: Annotated[Path, typer.Argument(metavar="FILE.h5", help="A response or a reduced model.")],
    as_json: JsonOption = False,
) -> None:
    """Say what a result or a reduced model holds."""
    from pipeline.results.file_info import contents, described
    from pipeline.results.outputs import as_json as json_text

    found = contents(file)
    print(json_text(found) if as_json else "\n".join(described(found)))


@app.command()
def export(
    source: Annotated[Path, typer.Argument(metavar="FILE.h5", help="A response or a reduced model.")],
    to: Annotated[Path, typer.Option("--to", metavar="FILE", help="Ends with .mat, .uff, .unv or .vtu.")],
    mesh: Annotated[
        Path | None, typer.Option("--mesh", metavar="FILE", help="For .vtu: mesh.vtu of the model.")
    ] = None,
    quiet: QuietOption = False,
) -> None:
    """Write a response or a reduced model for other programs."""
    from pipeline.export.write import export as write

    said = write(source, to, mesh)
    if not quiet:
        print(f"{to}: {said}")


@app.command()
def validate(scene: SceneArgument, as_json: JsonOption = False) -> None:
    """Check a scene and run nothing."""
    from pipeline.errors import InputError
    from pipeline.results.outputs import as_json as json_text
    from pipeline.scene.consistency import check_scene
    from pipeline.scene.plausibility import slips
    from pipeline.scene.reading import read_scene

    try:
        file = read_scene(scene)
        check_scene(file)
    except InputError as error:
        if as_json:
            print(json_text({"valid": False, "errors": [str(error)], "warnings": []}))
        raise
    remarks = slips(file)
    if as_json:
        accuracy = None if file.accuracy is None else file.accuracy.plain()
        found = {
            "name": file.first.name,
            "curves": len(file.members),
            "swept": list(file.swept),
            "accuracy": accuracy,
        }
        print(json_text({"valid": True, "errors": [], "warnings": remarks, **found}))
        return
    _warn(remarks)
    curves = f"{len(file.members)} curve{'s' if len(file.members) > 1 else ''}"
    print(f"{scene}: valid, {curves}" + (f" over {', '.join(file.swept)}" if file.swept else ""))
    if file.accuracy is not None:
        print(file.accuracy.text())


@app.command()
def new(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to make; the scene takes its name.")],
) -> None:
    """Write a commented scene to start from, and its schema for editors."""
    from pipeline.scene.templates import write_new_scene

    scene, schema = write_new_scene(folder)
    print(f"written: {scene}, {schema}")
    print(f"next: shroud run {scene}")


@app.command()
def schema() -> None:
    """Print the JSON schema of a scene, for editors."""
    import json

    from pipeline.scene.json_schema import scene_schema

    print(json.dumps(scene_schema(), indent=1))


def main() -> None:
    """Entry point: exit status 0 all computed, 1 something not reached, 2 bad input, 128 + a signal's number."""
    status = command(sys.argv[1:])
    try:
        sys.stdout.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what cannot be said is not tried again
        if not isinstance(error, BrokenPipeError):
            _say(f"shroud: the output cannot be written: {error.strerror}")
        status = status or NOT_REACHED
    sys.exit(status)


def command(arguments: list[str]) -> int:
    """Run one command line; returns its exit status. Errors of any kind are one line on stderr."""
    from typer.exceptions import Abort, Exit, TyperException

    from pipeline.errors import InputError, one_line, reason_of
    from pipeline.process.interrupts import Stopped
    from pipeline.store.disk_errors import StorageError

    if not sys.warnoptions:  # what libraries remark is for those who ask for it by python -W
        warnings.simplefilter("ignore")
    try:
        status = app(args=arguments or ["--help"], prog_name="shroud", standalone_mode=False)
        status = int(status) if isinstance(status, int) else COMPUTED
    except Exit as stop:
        status = stop.exit_code
    except TyperException as error:
        _say(f"shroud: {one_line(error.format_message())} (shroud --help)")
        return BAD_INPUT
    except InputError as error:
        _say(str(error))
        return BAD_INPUT
    except StorageError as error:
        _say(str(error))
        return NOT_REACHED
    except (KeyboardInterrupt, Abort):
        status = BY_SIGNAL + signal.SIGINT
    except BrokenPipeError:
        return NOT_REACHED
    except Exception as error:
        _say(f"shroud: {type(error).__name__}: {reason_of(error)}")
        return NOT_REACHED
    if status > BY_SIGNAL:
        said = Stopped(status - BY_SIGNAL).said
        _say(f"shroud: {said}; what is done is kept, the same command goes on from there")
    return status


@contextmanager
def _stoppable() -> Iterator[Interrupts]:
    """Work that a signal may end; the exit status says which it was."""
    from pipeline.process.interrupts import Stopped, handling_interrupts

    with handling_interrupts() as interrupts:
        try:
            yield interrupts
        except Stopped as stop:
            raise typer.Exit(BY_SIGNAL + stop.signal) from None


def _say(text: str) -> None:
    """One line on stderr, where there still is somebody to read it."""
    with suppress(OSError):
        print(text, file=sys.stderr, flush=True)


def _finish(request: Request, quiet: bool, as_json: bool) -> None:
    """Execute, tell people what came of it, and exit with the status that says so."""
    from pipeline.process.progress import Reporter
    from pipeline.results.outputs import as_json as json_text
    from pipeline.run import execute

    with _stoppable() as interrupts:
        outcome = execute(request, Reporter(quiet, interrupts=interrupts))
    if as_json:
        print(json_text(outcome.summary))
    elif not quiet:
        _tell(request, outcome)
    for problem in outcome.problems:
        _say(problem)
    failed = [curve for curve in outcome.curves if not curve.complete]
    if failed:
        first = failed[0].reason
        _say(f"{len(failed)} of {len(outcome.curves)} curves not completed: {first}")
    raise typer.Exit(COMPUTED if outcome.complete else NOT_REACHED)


def _warn(lines: list[str]) -> None:
    for line in lines:
        _say(f"warning: {line}")


def _print_errors(found: Verification, quiet: bool, as_json: bool) -> None:
    from pipeline.results.outputs import as_json as json_text
    from pipeline.verify.stage import plain

    if as_json:
        print(json_text(plain(found)))
    if as_json or quiet:
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


def _tell(request: Request, outcome: RunOutcome) -> None:
    from rich.console import Console

    from pipeline.results.tables import curve_table, harmonics_warning, mode_notes, motion_notes
    from pipeline.scene.plausibility import range_remark

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

"""The command line `shroud`: arguments in, exit status out. Each command imports what it needs."""

from __future__ import annotations

import errno
import signal
import sys
import warnings
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pipeline.command_usage import (
    TOLERANCES,
    AxisOption,
    BladesOption,
    LifeOption,
    ObjectiveOption,
    Options,
    OutputOption,
    OverOption,
    SceneArgument,
    ToleranceOption,
    UnitOption,
    app_for,
    examples,
    output_parser,
    print_version,
    refuse_twice,
    refuse_without,
    takes,
    wrong_usage,
)
from pipeline.process.program import collect_rarely, end_program, flush_stdout, prepare_libraries, prepare_streams
from pipeline.stages.stage import Stage
from pipeline.terminal import (
    BAD_INPUT,
    BY_SIGNAL,
    COMPUTED,
    NOT_REACHED,
    print_error,
    print_info,
    print_problems,
    print_verification,
)

if TYPE_CHECKING:
    from pipeline.study_reply import StudyReply

_NO_OUTPUT = "shroud: the output cannot be written"

app = typer.Typer(
    name="shroud",
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


@app.callback()
def common(
    version: Annotated[
        bool, typer.Option("--version", callback=print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Nonlinear forced response of shrouded turbine blades, from blade geometry to response curves."""


@app.command(
    epilog=examples(
        "shroud run scenes/dummy.toml",
        "shroud run my.toml --out out/try --jobs 4",
        "shroud run my.toml --until reduce",
    )
)
@takes("out", "force", "jobs", "quiet", "as_json", "recompute", "scheduler", "cluster")
def run(
    scene: SceneArgument,
    until: Annotated[
        Stage | None, typer.Option(help="Last stage to run; by default everything that the scene asks for.")
    ] = None,
    *,
    options: Options,
) -> None:
    """Run a scene, recomputing only what has changed."""
    options.run(scene, until)


@app.command(epilog=examples("shroud respond my.toml --rom rom.h5"))
@takes("out", "force", "jobs", "quiet", "as_json", "recompute", "scheduler", "cluster")
def respond(
    scene: SceneArgument,
    rom: Annotated[Path, typer.Option("--rom", metavar="FILE.h5", help="Reduced model, HDF5.", readable=False)],
    *,
    options: Options,
) -> None:
    """Solve the response of any reduced model.

    The nonlinear stage alone; the scene needs no blade.
    """
    replace(options, rom=rom).run(scene)


@app.command(epilog=examples("shroud modes my.toml", "shroud modes my.toml --json"))
@takes("rom", "out", "force", "jobs", "quiet", "as_json", "recompute")
def modes(scene: SceneArgument, *, options: Options) -> None:
    """Print natural frequencies, crossings and static contact.

    In seconds, before any response: frequencies with free, sliding and stuck shrouds and the names of the modes, the
    normal force at speed, a frequency range. Diagrams over nodal diameters and speeds go to the folder modes of DIR.
    """
    from pipeline.mode_diagrams import find_modes
    from pipeline.terminal import print_modes

    request = options.request(scene, Stage.REDUCE)
    with options.reporter() as reporter:
        diagrams = find_modes(request, reporter)
    if options.print_text(diagrams.values):
        print_modes(diagrams.models, diagrams.values["campbell"])
        print("\n".join(map(str, diagrams.files)))
    print_problems(diagrams.problems)
    raise typer.Exit(NOT_REACHED if diagrams.problems else COMPUTED)


@app.command(epilog=examples("shroud verify my.toml", "shroud verify my.toml --tolerance 0.01 --json"))
@takes("out", "force", "quiet", "as_json", "recompute")
def verify(
    scene: SceneArgument,
    tolerance: Annotated[
        float | None,
        typer.Option(
            min=TOLERANCES[0], max=TOLERANCES[1], help="Relative error to stay within; rom.tolerance by default."
        ),
    ] = None,
    *,
    options: Options,
) -> None:
    """Measure the errors of mesh and reduced models.

    Errors of frequencies and receptances due to modes, contact dofs and mesh, and which keys to change.
    """
    from pipeline.verify.stage import verify as measure

    request = options.request(scene, Stage.REDUCE)
    with options.reporter() as reporter:
        errors = measure(request, tolerance, reporter)
    print_verification(errors, options.quiet, options.as_json)
    print_problems(errors.problems)
    raise typer.Exit(NOT_REACHED if errors.problems else COMPUTED)


@app.command(epilog=examples("shroud report scenes/dummy.toml"))
@takes("out", "force", "jobs", "quiet", "as_json", "recompute", "scheduler", "cluster")
def report(scene: SceneArgument, *, options: Options) -> None:
    """Run a scene and write a report page.

    The page is report.html in the output folder; it needs no other file.
    """
    options.run(scene, Stage.REPORT)


@app.command(epilog=examples("shroud explore scenes/dummy.toml", "shroud explore my.toml --port 5006 --no-browser"))
@takes("rom", "out", "quiet")
def explore(
    scene: SceneArgument,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port of this machine; by default a free one.")] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
    *,
    options: Options,
) -> None:
    """Turn the knobs of a scene and see its response live.

    A page in a browser of this machine, until Ctrl-C. Its address has a token: whoever does not know it sees nothing.
    """
    from pipeline.explore.start import page_server
    from pipeline.process.interrupts import Stopped

    file = options.request(scene).scene
    with (
        options.reporter() as reporter,
        page_server(file, options.out, options.rom, port, reporter) as (server, _),
    ):
        print(server.address, flush=True)
        if not options.quiet:
            print_error("Ctrl-C ends the page")
        try:
            server.run(browser)
        except Stopped as stop:
            if stop.signal != signal.SIGINT:
                raise


@app.command(
    epilog=examples(
        "shroud check my.toml",
        "shroud check my.toml --curve 3",
        "shroud check my.toml --frequency 352.8 --curve 3 --branch 1",
    )
)
@takes("rom", "out", "force", "quiet", "as_json", "recompute")
def check(
    scene: SceneArgument,
    frequency: Annotated[
        float | None,
        typer.Option(metavar="HZ", help="Excitation frequency of the motion, Hz; else the worst motions."),
    ] = None,
    curve: Annotated[
        int | None,
        typer.Option(min=0, metavar="N", help="Number of the curve, from 0; by default 0, all without a frequency."),
    ] = None,
    branch: Annotated[
        int | None, typer.Option(min=0, metavar="K", help="0: main branch, K: detached branch K; all by default.")
    ] = None,
    solution: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Which of the solutions at the frequency; 1, the highest.")
    ] = None,
    *,
    options: Options,
) -> None:
    """Check by time integration whether a motion persists.

    A ring of blades starts from a solution of a curve, slightly disturbed: it stays, or ends in another motion.
    Without --frequency: from the worst motion of each curve; what is marked >= is sought again with a larger budget,
    which may take up to ten times as long as the curve.
    """
    from pipeline.check.check_point import CheckedPoint
    from pipeline.check.check_run import run_check, run_worst_checks
    from pipeline.errors import input_error

    for name, value in (("--branch", branch), ("--solution", solution)):
        if frequency is None and value is not None:
            raise input_error("shroud check", name, str(value), "beside --frequency only")
    request = options.request(scene, Stage.RESPOND)
    with options.reporter() as reporter:
        if frequency is None:
            checks = run_worst_checks(request, curve, reporter)
        else:
            checks = run_check(request, CheckedPoint(curve or 0, frequency, branch, solution or 1), reporter)
    if options.print_text(checks.values):
        print("\n".join(checks.lines))
    print_problems(checks.problems)


@app.command(
    epilog=examples(
        "shroud optimise my.toml --over contact.interference",
        "shroud optimise my.toml --over contact.interference=-2e-5:2e-5",
        "shroud optimise my.toml --tolerance contact.interference=1e-6",
        "shroud optimise my.toml --over contact.interference --life 20000h",
        "shroud optimise my.toml --over shroud.angle=60:90 --over contact.preload",
    )
)
@takes("rom", "out", "force", "jobs", "quiet", "as_json", "recompute")
def optimise(
    scene: SceneArgument,
    over: OverOption = None,
    tolerance: ToleranceOption = None,
    objective: ObjectiveOption = None,
    life: LifeOption = None,
    output: OutputOption = None,
    *,
    options: Options,
) -> None:
    """Find the values of keys at which the worst motion is lowest.

    Without --over: over the keys of the scene's table [optimum]. A key without LOW:HIGH gets a range from the scene.
    """
    from pipeline.optimise import Asked, objective_asked
    from pipeline.optimise import optimise as search

    request = options.request(scene, Stage.RESPOND)
    asked = Asked(over or [], tolerance or [], objective_asked(objective), output, life)
    with options.reporter() as reporter:
        optimum = search(request, asked, reporter)
    _finish_reply(optimum, options, request.out)


@app.command(epilog=examples("shroud crossings my.toml", "shroud crossings my.toml --json"))
@takes("rom", "out", "force", "jobs", "quiet", "as_json", "recompute")
def crossings(scene: SceneArgument, *, options: Options) -> None:
    """Print the worst motion at every resonance crossing.

    The table [crossings] of the scene has the speed range, tables [[excitation.order]] the engine orders with their
    forces. A Campbell diagram and crossings.csv go to DIR. What is unchanged is not computed again.
    """
    from pipeline.study_reply import find_crossings

    request = options.request(scene, Stage.RESPOND)
    with options.reporter() as reporter:
        reply = find_crossings(request, reporter)
    _finish_reply(reply, options, request.out)


def _finish_reply(reply: StudyReply, options: Options, out: Path) -> None:
    """Print what a study has found, and exit."""
    if reply.lines and options.print_text(reply.values):
        print(reply.text(out))
    print_problems(reply.problems)
    if reply.stopped is not None:
        raise typer.Exit(BY_SIGNAL + reply.stopped.signal)
    raise typer.Exit(COMPUTED if reply.lines and not reply.problems else NOT_REACHED)


@app.command(
    epilog=examples(
        "shroud identify my.toml peaks.csv",
        "shroud identify my.toml peaks.csv --over contact.friction=0.1:0.8",
        "shroud identify my.toml curves.uff",
    )
)
@takes("rom", "out", "force", "jobs", "quiet", "as_json", "recompute")
def identify(
    scene: SceneArgument,
    data: Annotated[
        Path | None,
        typer.Argument(metavar="DATA", help="Measured motions, CSV, or curves, UFF; else those of the scene."),
    ] = None,
    over: OverOption = None,
    *,
    options: Options,
) -> None:
    """Find the values of keys from measured peaks and curves.

    With intervals, and what the data do not tell; the scene with these values is written to the output folder.
    Without --over: over the keys of the scene's table [identify].
    """
    from pipeline.identify import identify as find_values

    request = options.request(scene, Stage.RESPOND)
    with options.reporter() as reporter:
        reply = find_values(request, data, over or [], reporter)
    _finish_reply(reply, options, request.out)


@app.command(epilog=examples("shroud info out/dummy", "shroud info rom.h5 --json"))
@takes("as_json")
def info(
    file: Annotated[
        Path, typer.Argument(metavar="SOURCE", help="Output folder, response.h5 or rom.h5.", readable=False)
    ],
    *,
    options: Options,
) -> None:
    """Print the contents of results or a reduced model.

    With an output folder: what the run has said at its end, points and errors of each curve, and how sure they are.
    """
    from pipeline.results.file_info import contents

    values = contents(file)
    if options.print_text(values):
        print_info(values)


@app.command(
    epilog=examples(
        "shroud export out/dummy --to modes.vtu",
        "shroud export out/dummy --to motion.pvd --curve 4",
        "shroud export out/dummy --to response.mat",
        "shroud export rom.h5 --to rom.mat",
        "shroud export rom.h5 --to rom.op4",
    )
)
@takes("quiet")
def export(
    source: Annotated[
        Path, typer.Argument(metavar="SOURCE", help="Output folder, response.h5 or rom.h5.", readable=False)
    ],
    to: Annotated[
        Path,
        typer.Option(
            "--to",
            metavar="FILE",
            parser=output_parser("--to"),
            help="Ends with .mat, .uff, .unv, .vtu, .pvd, .op4 or .mtx.",
        ),
    ],
    mesh: Annotated[
        Path | None,
        typer.Option("--mesh", metavar="FILE", help="Mesh of a rom.h5 (.vtu, .pvd).", readable=False),
    ] = None,
    file_format: Annotated[
        str | None,
        typer.Option("--format", metavar="NAME", help="matrix-market or abaqus (.mtx), mat-7.3 (.mat)."),
    ] = None,
    engine_order: Annotated[
        int | None,
        typer.Option(min=0, metavar="EO", help="Wave of the mode shapes; that of the scene by default."),
    ] = None,
    curve: Annotated[
        int | None,
        typer.Option(min=0, metavar="N", help="The motion at the peak of curve N (.vtu, .pvd) in place of modes."),
    ] = None,
    mode: Annotated[int | None, typer.Option(min=1, metavar="N", help="Mode of an animation (.pvd).")] = None,
    *,
    options: Options,
) -> None:
    """Write results or a reduced model for other programs.

    With an output folder: the response, or for .vtu the mode shapes of its first reduced model on their mesh, for
    .pvd one of them, or the motion at a peak, of the whole ring over a period, for .op4 and .mtx the matrices.
    """
    from pipeline.export.motions import MotionChoice
    from pipeline.export.write import export as write

    written = write(source, to, mesh, file_format, MotionChoice(engine_order, mode, curve))
    if not options.quiet:
        print(f"{to}: {written}")


@app.command(epilog=examples("shroud validate my.toml"))
@takes("as_json", "force")
def validate(scene: SceneArgument, *, options: Options) -> None:
    """List all errors of a scene; nothing is run.

    One line for each error with the line of the file; exit status 2 where there is one.
    """
    from pipeline.terminal import print_validation

    if not print_validation(scene, options.as_json, options.force):
        raise typer.Exit(BAD_INPUT)


@app.command(
    epilog=examples(
        "shroud new my-blade",
        'shroud new my-blade --title "Stage 3"',
        "shroud new my-blade --mesh blade.inp --unit mm",
    )
)
def new(
    folder: Annotated[
        Path,
        typer.Argument(metavar="DIR", parser=output_parser("DIR"), help="Folder to make; the scene takes its name."),
    ],
    title: Annotated[
        str | None, typer.Option("--title", help="Heading of the figures; asked for at a terminal, else left out.")
    ] = None,
    mesh: Annotated[
        Path | None,
        typer.Option("--mesh", metavar="FILE", help="Mesh of a sector from another program.", readable=False),
    ] = None,
    unit: UnitOption = None,
    axis: AxisOption = None,
    blades: BladesOption = None,
) -> None:
    """Write a commented scene to start from.

    Its JSON schema, by which editors complete keys, stands beside it. With a mesh file: what is in it, a scene for
    it, and a picture with the contact faces coloured.
    """
    from pipeline.terminal import print_new_scene

    if mesh is None:
        refuse_without("--mesh", {"--unit": unit, "--axis": axis, "--blades": blades})
    print_new_scene(folder, title, mesh, (unit, axis, blades))


@app.command("warm-up")
@takes("quiet")
def warm_up(*, options: Options) -> None:
    """Compile the kernels, so that no run has to."""
    from pipeline.stages.warm_up import warm_up_all

    with options.reporter() as reporter:
        warm_up_all(reporter)


@app.command(epilog=examples("shroud schema > scene.schema.json"))
def schema() -> None:
    """Print the JSON schema of a scene, for editors."""
    import json

    from pipeline.scene.json_schema import scene_schema

    print(json.dumps(scene_schema(), indent=1))


def main() -> None:
    """Entry point: exit status 0 all computed, 1 something not reached, 2 bad input, 128 + a signal's number."""
    collect_rarely()
    prepare_libraries()
    prepare_streams()
    status = command(sys.argv[1:])
    error = flush_stdout()
    if error is not None:
        if not (isinstance(error, BrokenPipeError) or status):
            print_error(f"{_NO_OUTPUT}: {error.strerror}")
        status = status or NOT_REACHED
    end_program(status)


def command(arguments: list[str]) -> int:
    """Run one command line; returns its exit status. Errors of any kind are one line on stderr."""
    from typer.exceptions import Abort, Exit, TyperException

    from pipeline.errors import ExecutorLost, InputError, advice_on, reason_of
    from pipeline.process.interrupts import Stopped
    from pipeline.scene.toml_text import with_line_of_file
    from pipeline.store.disk_errors import StorageError

    if not sys.warnoptions:  # warnings of libraries are shown with python -W only
        warnings.simplefilter("ignore")
    try:
        refuse_twice(arguments)
        status = app_for(app, arguments)(args=arguments or ["--help"], prog_name="shroud", standalone_mode=False)
        status = int(status) if isinstance(status, int) else COMPUTED
    except Exit as stop:
        status = stop.exit_code
    except TyperException as error:
        print_error(f"shroud: {wrong_usage(error)} (shroud --help)")
        return BAD_INPUT
    except InputError as error:
        print_error(with_line_of_file(error))
        return BAD_INPUT
    except (StorageError, ExecutorLost) as error:
        print_error(str(error))
        return NOT_REACHED
    except (KeyboardInterrupt, Abort):
        status = BY_SIGNAL + signal.SIGINT
    except BrokenPipeError:
        return NOT_REACHED
    except Exception as error:
        if isinstance(error, OSError) and error.errno == errno.ENOSPC and error.filename is None:
            print_error(f"{_NO_OUTPUT}: {error.strerror}")
        else:
            kind = "" if advice_on(error) else f"{type(error).__name__}: "
            print_error(f"shroud: {kind}{reason_of(error)}")
        return NOT_REACHED
    if status > BY_SIGNAL:
        print_error(Stopped(status - BY_SIGNAL).line)
    return status

"""Command lines: options that several commands have, their values, examples of help texts, what is wrong with one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass, fields
from functools import cache
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

from pipeline.output_paths import output_path
from pipeline.stages.stage import Stage

if TYPE_CHECKING:
    from typer.exceptions import TyperException

    from pipeline.process.progress import Reporter
    from pipeline.stages.request import Request


FLAGS = (
    "--force",
    "--recompute",
    "--quiet",
    "--json",
    "--version",
    "--help",
    "--browser",
    "--no-browser",
)  # options without a value
SEVERAL = ("--over", "--tolerance")  # options that may be given several times
MOST_JOBS = 256
TOLERANCES = 1e-6, 0.5
ALLOWED = {  # values of options by their names
    "until": ", ".join(Stage),
    "port": "a whole number, 0 to 65535",
    "jobs": f"a whole number, 1 to {MOST_JOBS}",
    "curve": "a whole number, 0 or more",
    "frequency": "a number, Hz",
    "branch": "a whole number, 0 or more",
    "solution": "a whole number, 1 or more",
    "tolerance": "a number, {:g} to {:g}".format(*TOLERANCES),
}


def examples(*lines: str) -> str:
    """The end of a help text: command lines, one on each line."""
    return "\b\nExamples:\n" + "\n".join(f"  {line}" for line in lines)


def app_for(app: typer.Typer, arguments: list[str]) -> typer.Typer:
    """The app with the one command that is called, if any: typer makes the options of all commands at each call."""
    names = [info.name or getattr(info.callback, "__name__", "") for info in app.registered_commands]
    called = [info for info, name in zip(app.registered_commands, names, strict=True) if arguments[:1] == [name]]
    if not called:
        return app
    single = copy(app)
    single.registered_commands = called
    return single


def output_parser(option: str) -> Callable[[str], Path]:
    """A parser of paths that are written to."""
    return lambda text: output_path(text, option)


def print_version(asked: bool) -> None:
    """Print the version and end, where that is asked for."""
    from pipeline import __version__

    if asked:
        print(f"shroud {__version__}")
        raise typer.Exit


def wrong_usage(error: TyperException) -> str:
    """What is wrong with a command line; where that is a value, its own words and not those of the library."""
    from pydantic import ValidationError

    from pipeline.errors import one_line, shown

    name, cause = getattr(getattr(error, "param", None), "name", ""), error.__cause__
    if not isinstance(cause, ValidationError):
        return one_line(error.format_message())
    option = f"--{name}" if name in ALLOWED else str(name).upper()
    found = shown(str(cause.errors(include_url=False)[0]["input"]))
    return f"{option}: {found}, allowed: {ALLOWED.get(name, 'a path')}"


def refuse_without(option: str, given: Mapping[str, object]) -> None:
    """Refuse options that mean nothing without another one."""
    from pipeline.errors import input_error, shown

    for name, value in given.items():
        if value is not None:
            raise input_error("shroud", name, shown(value), f"nothing without {option}")


def refuse_twice(arguments: list[str]) -> None:
    """Refuse an option that is given two values, of which the last would be taken in silence."""
    from pipeline.errors import input_error

    options = arguments[: arguments.index("--")] if "--" in arguments else arguments
    names = [text.partition("=")[0] for text in options if text.startswith("--")]
    for name in names:
        if names.count(name) > 1 and name not in (*FLAGS, *SEVERAL):
            raise input_error("shroud", name, "given twice", "one value")


# readable=False: a file that may not be read is told of by the code that reads it, like everything else about a file
SceneArgument = Annotated[Path, typer.Argument(metavar="SCENE", help="Scene file, TOML.", readable=False)]
UnitOption = Annotated[str | None, typer.Option("--unit", metavar="UNIT", help="Of the mesh file: m, mm or in.")]
AxisOption = Annotated[
    str | None, typer.Option("--axis", metavar="AXIS", help="Engine axis in the mesh file: x, y, z, -x, -y or -z.")
]
BladesOption = Annotated[int | None, typer.Option("--blades", metavar="N", help="Blades of the ring of the mesh.")]
ObjectiveOption = Annotated[
    str | None,
    typer.Option(
        "--objective", metavar="WHAT", help="displacement (largest, default), harmonic_1, stress, margin or life."
    ),
]
LifeOption = Annotated[
    str | None,
    typer.Option(
        "--life",
        metavar="HOURS",
        help="As 20000h: the highest amplitude over so long a life, with [wear].",
    ),
]
OverOption = Annotated[
    list[str] | None,
    typer.Option(
        "--over", metavar="KEY=LOW:HIGH", help="A key of the scene and its range, or the key alone; several times."
    ),
]
ToleranceOption = Annotated[
    list[str] | None,
    typer.Option(
        "--tolerance",
        metavar="KEY=HALF",
        help="How far a key may be off: the highest motion within counts; several times. Or uncertainty.",
    ),
]
OutputOption = Annotated[
    str | None, typer.Option("--output", metavar="NAME", help="An [[output]] whose largest value is made low.")
]


@dataclass(frozen=True)
class Options:
    """Options that several commands have, and what these do with them."""

    rom: Annotated[
        Path | None, typer.Option("--rom", metavar="FILE.h5", help="Reduced model, as in respond.", readable=False)
    ] = None
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="DIR", parser=output_parser("--out"), help="Output folder; out/<scene name> by default."
        ),
    ] = None
    force: Annotated[bool, typer.Option("--force", help="Accept values far beyond the usual.")] = False
    jobs: Annotated[
        int | None,
        typer.Option(
            "--jobs",
            min=1,
            max=MOST_JOBS,
            help="Curves solved at once; by default one per core, unless the run is short.",
        ),
    ] = None
    quiet: Annotated[bool, typer.Option("--quiet", help="Print errors only.")] = False
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the results as JSON, and nothing else on stdout.")
    ] = False
    recompute: Annotated[
        bool, typer.Option("--recompute", help="Compute everything again, also what is unchanged.")
    ] = False
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler", metavar="ADDRESS", help="An existing cluster: tcp://HOST:PORT, or its scheduler file."
        ),
    ] = None
    cluster: Annotated[
        str | None,
        typer.Option("--cluster", metavar="local:N", help="N worker processes on this machine, for this run."),
    ] = None

    def request(self, scene: Path, until: Stage | None = None, notes: bool = True) -> Request:
        """What is asked for of a scene file; prints the notes on the file."""
        from pipeline.scene.reading import read_scene
        from pipeline.stages.request import Request
        from pipeline.terminal import print_notes

        file = read_scene(scene, given_model=self.rom is not None)
        if notes and not self.quiet:
            print_notes(file.notes)
        target, last = self.out or Path("out") / file.first.name, until.value if until else None
        where = self.rom, self.scheduler, self.cluster, self.recompute
        return Request(file, target, last, self.force, self.jobs, *where)

    def run(self, scene: Path, until: Stage | None = None) -> None:
        """Run a scene up to a stage, print its results and exit."""
        from pipeline.terminal import finish

        finish(self.request(scene, until, notes=False), self.quiet, self.as_json)

    @contextmanager
    def reporter(self) -> Iterator[Reporter]:
        """Progress of work that a signal may end."""
        from pipeline.process.progress import Reporter
        from pipeline.terminal import stoppable

        with stoppable() as interrupts:
            yield Reporter(self.quiet, interrupts=interrupts)

    def print_text(self, values: Any) -> bool:
        """Print values as JSON where that is asked for; returns whether text is to be printed in their place."""
        from pipeline.results.outputs import as_json

        if self.as_json:
            print(as_json(values))
        return not (self.as_json or self.quiet)


@cache
def _parameters() -> tuple[Parameter, ...]:
    """The options as parameters of a command."""
    types = get_type_hints(Options, include_extras=True)
    own = Parameter.KEYWORD_ONLY
    return tuple(Parameter(f.name, own, default=f.default, annotation=types[f.name]) for f in fields(Options))


def takes(*names: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Let a command take these options of `Options`; the command gets them as its argument `options`."""

    def with_options(command: Callable[..., None]) -> Callable[..., None]:
        own = [item for item in signature(command, eval_str=True).parameters.values() if item.name != "options"]
        shared = [item for item in _parameters() if item.name in names]

        def called(**given: Any) -> None:
            options = Options(**{name: given.pop(name) for name in names})
            command(**given, options=options)

        called.__name__, called.__doc__ = command.__name__, command.__doc__
        called.__signature__ = Signature([*own, *shared])  # type: ignore[attr-defined]
        return called

    return with_options

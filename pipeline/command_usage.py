"""Command lines: the values of options, examples for help texts, and what is wrong with one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import copy
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from pipeline.output_paths import output_path
from pipeline.stages.stage import Stage

if TYPE_CHECKING:
    from typer.exceptions import TyperException

FLAGS = ("--force", "--quiet", "--json", "--version", "--help")  # options without a value
SEVERAL = ("--over",)  # options that may be given several times
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

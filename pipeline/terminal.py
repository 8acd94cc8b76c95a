"""What the commands print: results and tables on stdout; errors, warnings and notes on stderr."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from contextlib import suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

    from pipeline.stages.request import Request, RunOutcome
    from pipeline.verify.stage import Verification

NO_TERMINAL = 150  # characters in a line of a table where stdout is no terminal


def print_error(text: str) -> None:
    """One line on stderr; a closed stderr is no error."""
    if sys.stderr is None:  # print() would take stdout for it
        return
    with suppress(OSError):
        print(text, file=sys.stderr, flush=True)


def print_notes(lines: Iterable[str], kind: str = "note") -> None:
    """Lines of one kind, "note" or "warning", on stderr."""
    for line in lines:
        print_error(f"{kind}: {line}")


def print_problems(problems: Iterable[str]) -> None:
    """One line for everything that could not be computed."""
    for problem in problems:
        print_error(problem)


def print_outcome(request: Request, outcome: RunOutcome, quiet: bool, as_json: bool) -> None:
    """The results of a run as JSON or as a table, and what could not be computed."""
    from pipeline.results.outputs import as_json as json_text

    if as_json:
        print(json_text(outcome.summary))
    elif not quiet:
        _print_results(request, outcome)
    print_problems(outcome.problems)
    failed = [curve for curve in outcome.curves if not curve.complete]
    if failed:
        print_error(f"{len(failed)} of {len(outcome.curves)} curves not completed: {failed[0].reason}")


def print_verification(found: Verification, quiet: bool, as_json: bool) -> None:
    """Errors of the reduced models of a scene, as JSON or as a table, and advice."""
    from pipeline.results.outputs import as_json as json_text
    from pipeline.verify.stage import plain

    if as_json:
        print(json_text(plain(found)))
    if as_json or quiet:
        return
    from pipeline.verify.table import equilibrium_lines, error_table, heading, overview

    console = _console()
    for line in dict.fromkeys(heading(errors) for _, errors in found.measured):
        print(line)
    if len(found.measured) == 1:
        case, errors = found.measured[0]
        console.print(error_table(errors, case.scene.response.frequency[1]))
    elif found.measured:
        console.print(overview(found.measured))
    for line in [*equilibrium_lines(found.measured), *(each.text for each in found.advice)]:
        print(line)


def _print_results(request: Request, outcome: RunOutcome) -> None:
    """The table of the curves, with notes and warnings on them."""
    from pipeline.results.frequency_range import held_point_warning
    from pipeline.results.overview import abbreviated
    from pipeline.results.stress import stress_lines, stress_warning
    from pipeline.results.tables import (
        branch_warning,
        coriolis_notes,
        harmonics_warning,
        measured_errors,
        mode_notes,
        motion_notes,
        opened_warning,
        residual_notes,
        sampling_warning,
        wave_notes,
    )
    from pipeline.results.worst import search_notes, worst_warning

    _print_curves(outcome)
    searches = [*residual_notes(outcome.curves), *search_notes(outcome.curves)]
    models = [*mode_notes(outcome), *wave_notes(outcome), *coriolis_notes(outcome)]
    for note in abbreviated([*models, *motion_notes(outcome), *searches]):
        print(note)
    for line in stress_lines(outcome.stress):
        print(line)
    for study in outcome.studies.values():
        print("\n".join(study.lines))
    if warning := stress_warning(outcome.stress):
        print_notes([warning], "warning")
    if request.scene.accuracy is not None:
        print(request.scene.accuracy.text(measured_errors(outcome)))
    if warning := opened_warning(outcome):
        print_notes([warning], "warning")
    if warning := worst_warning(outcome.curves):
        print_notes([warning], "warning")
    if warning := harmonics_warning(outcome):
        print_notes([warning], "warning")
    if warning := branch_warning(outcome):
        print_notes([warning], "warning")
    if warning := sampling_warning(outcome):
        print_notes([warning], "warning")
    if warning := held_point_warning(outcome, request.scene.first):
        print_notes([warning], "warning")
    page = f", {outcome.report}" if outcome.report else ""
    print(f"{outcome.seconds:.2f} s, results in {request.out}{page}")


def _print_curves(outcome: RunOutcome) -> None:
    """A row for each curve; of many curves the first, with quantiles, best and worst."""
    from pipeline.results.overview import FIRST_ROWS, MOST_ROWS, key_table, overview_lines, quantile_table
    from pipeline.results.tables import curve_table

    if outcome.curves and len(outcome.curves) <= MOST_ROWS:
        _console().print(curve_table(outcome))
    if len(outcome.curves) <= MOST_ROWS or outcome.table is None:
        return
    console = _console()
    console.print(curve_table(outcome, FIRST_ROWS))
    lines, found = overview_lines(outcome.table)
    print(f"... {lines[0]}")
    console.print(quantile_table(found))
    if found["keys"]:
        console.print(key_table(found))
    print("\n".join(lines[1:]))


def _console() -> Console:
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else NO_TERMINAL)

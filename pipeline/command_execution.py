"""What commands that compute have in common: they can be interrupted, and end with an exit status."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import typer

from pipeline.terminal import print_outcome

if TYPE_CHECKING:
    from pipeline.process.interrupts import Interrupts
    from pipeline.stages.request import Request

COMPUTED, NOT_REACHED, BAD_INPUT, BY_SIGNAL = 0, 1, 2, 128  # the last: and the number of the signal


@contextmanager
def stoppable() -> Iterator[Interrupts]:
    """Work that a signal may end; the exit status says which it was."""
    from pipeline.process.interrupts import Stopped, handling_interrupts

    with handling_interrupts() as interrupts:
        try:
            yield interrupts
        except Stopped as stop:
            raise typer.Exit(BY_SIGNAL + stop.signal) from None


def finish(request: Request, quiet: bool, as_json: bool) -> None:
    """Execute, print the results, and exit with the status that stands for them."""
    from pipeline.process.deferred_modules import defer_unused
    from pipeline.process.interrupts import Stopped
    from pipeline.process.progress import Reporter
    from pipeline.results.outputs import as_json as json_text
    from pipeline.run import execute

    defer_unused()
    with stoppable() as interrupts:
        try:
            outcome = execute(request, Reporter(quiet, interrupts=interrupts))
        except Stopped as stop:
            if as_json:
                print(json_text(stop.summary or {"complete": False, "problems": [stop.said]}))
            raise
    print_outcome(request, outcome, quiet, as_json)
    raise typer.Exit(COMPUTED if outcome.complete else NOT_REACHED)

"""Calls made one by one here, or in worker processes, counted on the progress line; one that fails stops no other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from pipeline.process.progress import Counter, Reporter
from pipeline.process.workers import Call, WorkerDied, workers


@dataclass(frozen=True)
class Work:
    """A piece of work: `function(*args, progress=None)` returns why it failed, or an empty text."""

    label: str  # what progress calls it
    function: Callable[..., str]  # A function of a module, so that a worker process finds it
    args: tuple[Any, ...]  # its arguments, which can be pickled


@dataclass(frozen=True)
class CountedCalls:
    """Does pieces of work, `at_once` at a time: with 1 in this process, otherwise in worker processes."""

    reporter: Reporter  # reports progress and notices interrupts
    text: str  # what is counted
    at_once: int  # number of processes

    def run(self, works: Mapping[str, Work], line: Callable[[str], str]) -> dict[str, str]:
        """Do all of it; the reason of every piece that failed."""
        if not works:
            return {}
        return self._one_by_one(works, line) if self.at_once == 1 else self._in_workers(works, line)

    def _one_by_one(self, works: Mapping[str, Work], line: Callable[[str], str]) -> dict[str, str]:
        reasons: dict[str, str] = {}
        with self.reporter.counting(self.text, len(works)) as counter, self.reporter.interrupts.looking():
            for key, work in works.items():
                reason = work.function(*work.args, progress=self._progress(counter, work.label))
                _done(counter, reasons, key, reason, f"{work.label}: {reason or line(key)}")
        return reasons

    def _progress(self, counter: Counter, label: str) -> Callable[[float, int], None]:
        def within(frequency_hz: float, points: int) -> None:
            self.reporter.interrupts.check()
            counter.within(f"{label} at {frequency_hz:.5g} Hz, {points} points")

        return within

    def _in_workers(self, works: Mapping[str, Work], line: Callable[[str], str]) -> dict[str, str]:
        reasons: dict[str, str] = {}
        calls = {key: Call(work.function, work.args) for key, work in works.items()}

        def retried(key: str, reason: str) -> None:
            self.reporter.line(f"{works[key].label}: {reason}; begun again in another process")

        interrupts = self.reporter.interrupts
        with (
            self.reporter.counting(self.text, len(works), self.at_once) as counter,
            interrupts.looking(),
            workers(self.at_once, interrupts.check) as pool,
        ):
            for key, future in pool.completed(calls, retried=retried):
                try:
                    reason = future.result()
                except WorkerDied as died:
                    reason = str(died)
                _done(counter, reasons, key, reason, f"{works[key].label}: {reason or line(key)}")
        return reasons


def _done(counter: Counter, reasons: dict[str, str], key: str, reason: str, detail: str) -> None:
    if reason:
        reasons[key] = reason
    counter.done(detail)

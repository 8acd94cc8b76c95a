"""What is computed for all open pages: one quick thing and one long one at a time, nothing that nobody waits for."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum
from itertools import count

Cancelled = Callable[[], bool]


class Kind(IntEnum):
    """What a page can ask for, the most urgent first; of each kind a page waits for one, the newest."""

    CURVE = 0
    POINT = 1
    EXPORT = 2
    BUILD = 3
    SEARCH = 4
    REFINE = 5


QUICK = frozenset((Kind.CURVE, Kind.POINT, Kind.EXPORT))  # which answer at once, in this process
LONG = frozenset(Kind) - QUICK  # which mostly wait for another process
OUTDATED = (Kind.CURVE, Kind.POINT, Kind.REFINE)  # what a new curve of a page makes needless


@dataclass
class Job:
    """A computation; `run` is given a function that says whether its result is no longer wanted."""

    page: object
    kind: Kind
    run: Callable[[Cancelled], None]
    failed: Callable[[Exception], None]
    number: int
    dropped: bool = False


@dataclass
class Workshop:
    """Two threads that compute what pages ask for: one what answers at once, one what takes long."""

    _waiting: dict[tuple[int, Kind], Job] = field(default_factory=dict)
    _running: list[Job] = field(default_factory=list)
    _change: threading.Condition = field(default_factory=threading.Condition)
    _numbers: count[int] = field(default_factory=count)
    _closed: bool = False

    def __post_init__(self) -> None:
        for name, kinds in (("quick", QUICK), ("long", LONG)):
            threading.Thread(target=self._work, args=(kinds,), name=name, daemon=True).start()

    @property
    def busy(self) -> bool:
        """Whether something is computed, or waits for it."""
        return bool(self._running or self._waiting)

    def ask(
        self, page: object, kind: Kind, run: Callable[[Cancelled], None], failed: Callable[[Exception], None]
    ) -> None:
        """Compute something for a page, in place of what it waits for of this kind or that a new curve outdates."""
        with self._change:
            for old in OUTDATED if kind is Kind.CURVE else (kind,):
                self._drop(page, old)
            self._waiting[id(page), kind] = Job(page, kind, run, failed, next(self._numbers))
            self._change.notify_all()

    def drop(self, page: object, *kinds: Kind) -> None:
        """What a page waits for of these kinds, by default all, is not computed, or ended where it is."""
        with self._change:
            for kind in kinds or Kind:
                self._drop(page, kind)

    def close(self) -> None:
        """End what is computed and take nothing more."""
        with self._change:
            self._closed = True
            self._waiting.clear()
            for job in self._running:
                job.dropped = True
            self._change.notify_all()

    def _drop(self, page: object, kind: Kind) -> None:
        self._waiting.pop((id(page), kind), None)
        for job in self._running:
            job.dropped |= job.page is page and job.kind is kind

    def _work(self, kinds: frozenset[Kind]) -> None:
        while True:
            with self._change:
                self._change.wait_for(
                    lambda: self._closed or any(job.kind in kinds for job in self._waiting.values())
                )
                if self._closed:
                    return
                own = [job for job in self._waiting.values() if job.kind in kinds]
                job = min(own, key=lambda job: (job.kind, job.number))
                del self._waiting[id(job.page), job.kind]
                self._running.append(job)
            try:
                job.run(lambda job=job: job.dropped)  # type: ignore[misc]
            except Exception as error:
                if not job.dropped:
                    job.failed(error)
            with self._change:
                self._running.remove(job)

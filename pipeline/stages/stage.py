"""The stages of a run: their order, what each needs, what its results are called, and the log of how they went."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from pipeline.process.progress import seconds_since


class Stage(StrEnum):
    """The stages of a run, in their order."""

    MESH = "mesh"
    ASSEMBLE = "assemble"
    REDUCE = "reduce"
    RESPOND = "respond"
    STUDY = "study"
    STRESS = "stresses"
    RENDER = "render"
    FIGURES = "figures"
    REPORT = "report"

    @property
    def with_needs(self) -> frozenset[Stage]:
        """The stage and all stages that must run before it."""
        before = _AFTER.get(self)
        return frozenset([self]) | (before.with_needs if before else frozenset())

    @property
    def results(self) -> str:
        """What its results are called in a table."""
        return _RESULTS[self]


_AFTER = {  # stage -> the stage whose results it needs
    Stage.ASSEMBLE: Stage.MESH,
    Stage.REDUCE: Stage.ASSEMBLE,
    Stage.RESPOND: Stage.REDUCE,
    Stage.STUDY: Stage.RESPOND,
    Stage.STRESS: Stage.RESPOND,
    Stage.RENDER: Stage.REDUCE,
    Stage.FIGURES: Stage.RESPOND,
    Stage.REPORT: Stage.FIGURES,
}
_RESULTS = {
    Stage.MESH: "meshing",
    Stage.ASSEMBLE: "assembling stiffness and mass",
    Stage.REDUCE: "reduced model",
    Stage.RESPOND: "response curves",
    Stage.STUDY: "studies",
    Stage.STRESS: "stress on the mesh",
    Stage.RENDER: "renders",
    Stage.FIGURES: "figures",
    Stage.REPORT: "report page",
}


@dataclass
class StageLog:
    """Counts of results made and reused, by stage, seconds spent in this run, and what making the results took."""

    ran: dict[str, int] = field(default_factory=lambda: dict.fromkeys(Stage, 0))
    reused: dict[str, int] = field(default_factory=lambda: dict.fromkeys(Stage, 0))
    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(Stage, 0.0))
    cost: dict[str, float] = field(default_factory=lambda: dict.fromkeys(Stage, 0.0))

    def note(self, stage: str, ran: bool, seconds: float = 0.0) -> None:
        """Count one result of a stage; `seconds`: what making it took, in this run or an earlier one."""
        (self.ran if ran else self.reused)[stage] += 1
        self.cost[stage] += seconds

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Add the time spent in the block to a stage."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] += seconds_since(start)

    def summary(self) -> dict[str, dict[str, Any]]:
        """As in summary.json: a stage that made anything ran, one that only found its results was reused."""
        return {
            stage: {
                "status": self.status(stage),
                "seconds": round(self.seconds[stage], 4),
                "ran": self.ran[stage],
                "reused": self.reused[stage],
            }
            for stage in Stage
        }

    def status(self, stage: str) -> str:
        """ran, reused or skipped."""
        return "ran" if self.ran[stage] else "reused" if self.reused[stage] else "skipped"

"""What a user asked for, what a run works with, and what it came to."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pipeline.process.progress import Reporter
from pipeline.scene.reading import SceneFile
from pipeline.stages.cache_keys import Versions
from pipeline.stages.respond import CurveResult
from pipeline.stages.stage_log import StageLog
from pipeline.store.content_store import Store

_NEEDS = {
    "mesh": ("mesh",),
    "assemble": ("mesh", "assemble"),
    "reduce": ("mesh", "assemble", "reduce"),
    "respond": ("mesh", "assemble", "reduce", "respond"),
    "render": ("mesh", "assemble", "reduce", "render"),
    "figures": ("mesh", "assemble", "reduce", "respond", "figures"),
    "report": ("mesh", "assemble", "reduce", "respond", "figures", "report"),
}
STAGES = tuple(_NEEDS)


@dataclass(frozen=True)
class Request:
    """What a user asked for.

    `until`: the stage whose result is wanted, None for everything that the scene asks for; `rom`: a reduced model
    from elsewhere in place of the first three stages.
    """

    scene: SceneFile
    out: Path
    until: str | None = None
    force: bool = False
    jobs: int | None = None
    rom: Path | None = None

    @property
    def wanted(self) -> frozenset[str]:
        """The stages that may run; the others are not needed."""
        if self.until is not None:
            return frozenset(_NEEDS[self.until]) | self._for_pictures(self.until)
        stages = set(_NEEDS["figures"])
        if self.rom is not None:
            stages -= {"mesh", "assemble", "reduce"}
        elif self.scene.first.render is not None:
            stages.add("render")
        return frozenset(stages)

    @property
    def expands(self) -> bool:
        """Whether shapes on the mesh are asked for, now or by the whole scene."""
        return self.scene.first.render is not None or "report" in self.wanted

    def _for_pictures(self, until: str) -> frozenset[str]:
        """What renders need and are needed for: curves for the motion at a peak, renders for the report."""
        render = self.scene.first.render
        if render is None:
            return frozenset()
        more = {"render": {"respond"} if render.operating is not False else set(), "report": {"render"}}
        return frozenset(more.get(until, ()))


@dataclass(frozen=True)
class Run:
    """What every stage of one run works with."""

    request: Request
    store: Store
    log: StageLog
    reporter: Reporter
    versions: Versions


@dataclass
class RunOutcome:
    """What a run came to.

    `problems`: what could not be made apart from curves, one line each; `report`: name of the page, None without one;
    `response`: SHA-256 of the response files by name, None where they are not this run's;
    `summary`: as in summary.json.
    """

    curves: list[CurveResult] = field(default_factory=list)
    models: list[dict[str, Any]] = field(default_factory=list)
    pictures: list[str] = field(default_factory=list)
    report: str | None = None
    response: dict[str, str] | None = None
    summary: dict[str, Any] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)
    seconds: float = 0.0

    @property
    def complete(self) -> bool:
        """Whether everything asked for was computed."""
        return not self.problems and all(curve.complete for curve in self.curves)

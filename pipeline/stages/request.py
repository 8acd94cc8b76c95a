"""Request, context and outcome of a run."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.executor.task import Executor
from pipeline.process.progress import Reporter
from pipeline.scene.reading import SceneFile
from pipeline.stages.curve.respond import CurveResult
from pipeline.stages.stage import Stage, StageLog
from pipeline.store.content_store import Store

if TYPE_CHECKING:
    from pipeline.stages.curve.curve_table import CurveTable
    from rom.cyclic.reduced_model import ReducedModel


@dataclass(frozen=True)
class Request:
    """What a user asked for."""

    scene: SceneFile  # the scene
    out: Path  # output folder
    until: str | None = None  # the stage whose result is asked for; None for everything that the scene asks for
    force: bool = False  # whether values far beyond the usual are accepted
    jobs: int | None = None  # curves solved at the same time; None: as many as the cores, where the work is worth it
    # reduced model from elsewhere, its file or itself, in place of the first three stages
    rom: Path | ReducedModel | None = None
    scheduler: str | None = None  # address of the scheduler of a cluster, or its scheduler file
    cluster: str | None = None  # worker processes to start on this machine, as `local:4`
    recompute: bool = False  # whether everything is computed again, also what is unchanged

    @property
    def wanted(self) -> frozenset[str]:
        """The stages that may run; the others are not needed."""
        if self.until is not None:
            return Stage(self.until).with_needs | self._for_pictures(self.until)
        if self.rom is not None:
            return (Stage.FIGURES.with_needs - Stage.REDUCE.with_needs) | self._studies
        rendered = {Stage.RENDER} if self.scene.first.render is not None and not self.without_mesh else set()
        return Stage.FIGURES.with_needs | rendered | self._stress | self._studies

    @property
    def rom_said(self) -> str:
        """How messages name the reduced model from elsewhere."""
        return str(self.rom) if isinstance(self.rom, Path) else "rom"

    @property
    def without_mesh(self) -> bool:
        """Whether the reduced models have no mesh, on which shapes could be drawn."""
        return self.rom is not None or self.scene.first.model is not None

    @property
    def expands(self) -> bool:
        """Whether shapes on the mesh are asked for, now or by the whole scene."""
        needed = self.wanted & {Stage.RENDER, Stage.STRESS, Stage.REPORT}
        return self.scene.first.render is not None or bool(self._stress | needed)

    @property
    def _stress(self) -> frozenset[Stage]:
        """The stage `stress` where the scene asks for it and there is a mesh."""
        return frozenset({Stage.STRESS} if self.scene.first.with_stress and not self.without_mesh else ())

    @property
    def _studies(self) -> frozenset[Stage]:
        """The stage `study` where the scene asks for one."""
        return frozenset({Stage.STUDY} if self.scene.first.studies else ())

    def _for_pictures(self, until: str) -> frozenset[str]:
        """What pictures are made of: curves for the motion at a peak, studies for figures, all for the report."""
        render = self.scene.first.render
        if until == Stage.FIGURES:
            return self._studies
        stress = self._stress | self._studies if until == Stage.REPORT else frozenset()
        if render is None or self.without_mesh:
            return stress
        if until == Stage.REPORT:
            return frozenset({Stage.RENDER}) | stress
        return frozenset({Stage.RESPOND} if until == Stage.RENDER and render.operating is not False else ())


@dataclass(frozen=True)
class Run:
    """Context of a run that every stage works with."""

    request: Request
    store: Store
    log: StageLog
    reporter: Reporter
    executor: Executor


@dataclass(frozen=True)
class StudyOutcome:
    """The result of a study."""

    name: str  # the study
    key: str  # its key in the store, a hash of all that it depends on
    result: Any  # the result, of the type that the study names
    lines: tuple[str, ...]  # what to say of it at a terminal
    file: str  # its file in the output folder
    seconds: float  # what it took, in this run or an earlier one


@dataclass
class RunOutcome:
    """Outcome of a run."""

    curves: list[CurveResult] = field(default_factory=list)  # one for every member of the sweep
    models: list[dict[str, Any]] = field(default_factory=list)  # entries of `models` in summary.json
    campbell: list[dict[str, Any]] = field(default_factory=list)  # entries of `campbell` in summary.json
    modes: list[Any] = field(default_factory=list)  # natural frequencies, where no response is asked for
    known: dict[str, Any] = field(default_factory=dict)  # `subject`, `linear` and more of each row in summary.json
    entries: list[dict[str, Any]] = field(default_factory=list)  # of `curves` in summary.json, once published
    pictures: list[str] = field(default_factory=list)  # figures and renders by their names in the output folder
    stress: list[dict[str, Any]] = field(default_factory=list)  # entries of `stress` in summary.json
    studies: dict[str, StudyOutcome] = field(default_factory=dict)  # results of the studies by their names
    report: str | None = None  # name of the report page
    table: CurveTable | None = None  # numbers of the curves, once they are published
    # SHA-256 of the response files by name; None where the files are not of this run
    response: dict[str, str] | None = None
    summary: dict[str, Any] = field(default_factory=dict)  # as in summary.json
    problems: list[str] = field(default_factory=list)  # what could not be computed apart from curves, one line each
    seconds: float = 0.0  # duration of the run

    @property
    def complete(self) -> bool:
        """Whether everything asked for was computed."""
        return not self.problems and all(curve.complete for curve in self.curves)

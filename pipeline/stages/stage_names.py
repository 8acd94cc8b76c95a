"""The stages of a run: their order, what each needs, and what its results are called."""

from __future__ import annotations

from enum import StrEnum


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

"""Views of a response: what is known of it at a stage, and one sentence on how sure it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from pipeline.results.worst import share
from pipeline.stages.curve.curve_summary import CurveSummary, summary_of

if TYPE_CHECKING:
    from nonlinear.response_curve import ResponseCurve, StaticContact
    from pipeline.figures.linear_limits import Limit
    from pipeline.scene.schema import Scene

FIRST, LAST = "at once", "worst motion"
_AGAINST = {
    "ring": "stability against every nodal diameter",
    "wave": "stability against perturbations of the wave alone",
    "folds": "stability only between folds",
}


@dataclass(frozen=True)
class LiveView:
    """A response as far as it is known."""

    stage: str  # "at once", then the stages of `nonlinear.response_stages`: "main branch" ... "worst motion"
    certainty: str  # how sure it is, in one sentence
    response: ResponseCurve  # points, contact states, peaks, bifurcations, static contact, detached branches
    limits: tuple[Limit, ...]  # linear responses with free and with stuck contacts; no free one where none exists
    solved: Scene  # the scene that was solved: at the first stage with few harmonics
    static: Mapping[str, StaticContact]  # static contact by interface; {} where it is not known

    @cached_property
    def facts(self) -> CurveSummary:
        """Its summary, as tables have it."""
        return summary_of(self.response)

    @property
    def branches(self) -> tuple[ResponseCurve, ...]:
        """The main branch, then the detached ones."""
        return self.response, *self.response.detached

    @property
    def is_last(self) -> bool:
        """Whether it is all that `shroud run` knows of this curve."""
        return self.stage == LAST


def certainty_of(stage: str, found: ResponseCurve, scene: Scene) -> str:
    """How sure a response is at a stage, in one sentence; `scene`: that was solved."""
    number = f"{found.harmonics} harmonic{'s' if found.harmonics != 1 else ''}"
    if found.points == 0 or not found.termination.complete:
        return f"Incomplete, {number}: {found.termination.message}."
    if stage == FIRST:
        contact = scene.contact
        sampled = f", contact at {contact.samples} instants" if contact.integration == "sampled" else ""
        unknown = "isolated branches, stability and truncation error are not known yet"
        return f"A first look with {number}{sampled}: {unknown}."
    known = f"{number}, {_AGAINST[scene.response.stability]}"
    error = found.truncation_error
    known += f", neglected harmonics change the peak by {share(error)}" if error == error else ""
    branches = f"{len(found.detached) or 'no'} detached branch{'es' if len(found.detached) != 1 else ''} found"
    if stage == "main branch":
        return f"Main branch with {known}; isolated branches and the worst motion are not known yet."
    if stage == "truncation error":
        return f"Main branch with {known}; isolated branches and the worst motion are not known yet."
    if stage == "detached branches":
        searched = branches if scene.response.detached else "detached branches not asked for"
        return f"{known[:1].upper()}{known[1:]}; {searched}; the worst motion is not known yet."
    said = "" if found.worst is None else f"; {found.worst.searched}"
    return f"All that the scene asks for: {known}; {branches}{said}."

"""What is computed in the process behind a page: curves stage by stage, reduced models, the search for an optimum.

Each function gets `send`, which passes a result on at once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.explore.models import build_model, stored_model
from pipeline.process.progress import Reporter

if TYPE_CHECKING:
    from pipeline.scene.reading import Member, SceneFile
    from rom.cyclic.reduced_model import ReducedModel

Send = Callable[[Any], None]


@dataclass
class _Told(Reporter):
    """Passes lines on."""

    send: Send = field(kw_only=True)

    def line(self, text: str) -> None:
        """Pass one line on."""
        self.send(text)


def solve(send: Send, out: Path, rom: Path | ReducedModel | None, file: SceneFile, member: Member) -> None:
    """The stages of the response of a member, as pairs of a name and a curve."""
    from nonlinear.response_solver import response_stages
    from pipeline.stages.scene_to_solver import nonlinear_problem
    from rom.files.reduced_model_file import read_reduced_model
    from rom.linear_algebra.threads import one_blas_thread

    place = stored_model(out, member.scene) if rom is None else None
    place = place or build_model(out, rom, file, member, Reporter(quiet=True)).rom
    with one_blas_thread():
        model = read_reduced_model(place, with_basis=False)
        for stage in response_stages(*nonlinear_problem(member.scene, model)):
            send((stage.name, stage.curve))


def build(send: Send, out: Path, rom: Path | ReducedModel | None, file: SceneFile, member: Member) -> None:
    """The reduced model of a member into the store; lines on what is done."""
    build_model(out, rom, file, member, _Told(send=send))


def search(send: Send, out: Path, rom: Path | ReducedModel | None, file: SceneFile, over: Sequence[str]) -> None:
    """The optimum of a scene over keys: lines on what is done, at the end an `StudyReply`."""
    from pipeline.optimise import Asked, optimise
    from pipeline.stages.request import Request

    send(optimise(Request(file, out, jobs=1, rom=rom), Asked(over), _Told(send=send)))

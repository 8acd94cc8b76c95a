"""What a study is, and what it computes with."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol, TypeVar, runtime_checkable

from pipeline.codec import plain, restored
from pipeline.errors import InputError, reason_of
from pipeline.results.outputs import as_json
from pipeline.scene.consistency import check_scene, check_scene_for_model
from pipeline.scene.reading import Member, SceneFile, derived_member
from pipeline.scene.schema import Scene
from pipeline.stages.cache_keys import curve_key, model_keys
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.curve.respond import CurveResult
from pipeline.stages.curve.sweep_curves import member_curves, member_models
from pipeline.stages.model.model_chain import BuiltModel
from pipeline.stages.model.sweep_models import Models
from pipeline.stages.request import Run, RunOutcome
from pipeline.stages.stage import Stage, StageLog
from pipeline.store.fingerprints import fingerprint

RESULT = "result.json"
T = TypeVar("T")
SolvedCurve = tuple[int, CurveResult, Path, Path]


class StudyError(Exception):
    """A study has no result; the message says why in one line."""


class Study(Protocol):
    """A result of a scene beside its curves."""

    name: str  # its name: that of its section in the scene and of its file in the output folder
    # A frozen dataclass that `pipeline.codec` can write and read: numbers, texts, arrays of one dimension,
    # tuples, mappings and such dataclasses
    result: type[Any]

    def key(self, context: StudyContext) -> Mapping[str, Any]:
        """What the result depends on besides its section, the first curve of the scene and the code of the study."""

    def compute(self, context: StudyContext) -> Any:
        """The result."""

    def lines(self, result: Any) -> Sequence[str]:
        """What to say of the result at a terminal."""


@runtime_checkable
class TabledStudy(Study, Protocol):
    """A study with a table of its own, NAME.csv beside its file."""

    def table(self, result: Any) -> str:
        """The text of the table; "": there is none."""


@dataclass(frozen=True)
class StudyContext:
    """What a study computes with."""

    run: Run  # the run: request, store, executor, reporter
    models: Models  # reduced model of each member of the scene
    outcome: RunOutcome  # curves of the scene, and what has been found so far
    # the stress on the mesh at the worst motion of a curve, as stress.json has it, with limits of the fatigue
    stress: Callable[[Run, CurveResult, Any], Mapping[str, Any]] | None = None
    log: StageLog = field(default_factory=StageLog)  # of all members beside those of the scene
    done: list[CurveResult] = field(default_factory=list)  # of the last members, also where a signal ended them

    @property
    def file(self) -> SceneFile:
        """The scene with its sweep."""
        return self.run.request.scene

    @property
    def scene(self) -> Scene:
        """The scene with its base values: its first member."""
        return self.file.first

    @property
    def model(self) -> BuiltModel:
        """The reduced model of the base values."""
        found = self.models[self.file.members[0].index]
        if found is None:
            raise StudyError("the reduced model of the scene could not be made")
        return found

    @property
    def base_key(self) -> str:
        """Key of the curve with the base values: a hash of all that it depends on, files and code among them."""
        found = self.models[self.file.members[0].index]
        return curve_key(self.scene, model_keys(self.scene).reduce if found is None else found.key)

    def solved_curves(self, asked: str | Sequence[int]) -> Iterator[SolvedCurve]:
        """The curves with points, of "all" or of some numbers: number, result, file and file of the model."""
        for number, curve in enumerate(self.outcome.curves):
            if curve.file and curve.rom and curve.facts and (asked == "all" or number in asked):
                yield number, curve, curve.file, curve.rom

    def progress(self, text: str) -> None:
        """Say what is being done; raises Stopped where a signal has been received."""
        self.run.reporter.interrupts.check()
        self.run.reporter.line(text)

    def member(self, values: Mapping[str, Any], place: str) -> Member:
        """The scene with other values of some keys, not swept; validated against the schema."""
        return derived_member(self.file, values, place, self.run.request.rom is not None)

    def curves(self, members: Sequence[Member]) -> list[CurveResult]:
        """The curve of each of these members, found in the store or computed as those of a sweep.

        Branches are carried between members that are neighbours by their parameters. A member whose values do not fit
        together, or whose model cannot be made, has no curve; its reason says why. Nothing is written to the output
        folder but the store.
        """
        reasons = {place: reason for place, member in enumerate(members) if (reason := self._unfit(member))}
        fit = [replace(member, index=index) for index, member in enumerate(members) if index not in reasons]
        found: dict[int, CurveResult] = {}
        if fit:
            found = {curve.member.index: curve for curve in self._solved(fit)}
        for place, reason in reasons.items():
            found[place] = CurveResult(replace(members[place], index=place), None, None, None, reason)
        return [found[place] for place in range(len(members))]

    def model_of(self, member: Member) -> BuiltModel:
        """The reduced model of a member, found in the store or made."""
        (found,) = self.models_of([member])
        return found

    def models_of(self, members: Sequence[Member]) -> list[BuiltModel]:
        """The reduced models of some members, found in the store or made."""
        for member in members:
            if reason := self._unfit(member):
                raise StudyError(reason)
        run, outcome = self._derived([replace(member, index=k) for k, member in enumerate(members)]), RunOutcome()
        try:
            models = self._models(run, outcome)
        except InputError as error:
            raise StudyError(str(error)) from None
        found = [model for k in range(len(members)) if (model := models[k]) is not None]
        if len(found) < len(members):
            raise StudyError("; ".join(outcome.problems))
        return found

    def key_of(self, member: Member, model: BuiltModel) -> str:
        """Key of the curve of a member: a hash of all that it depends on."""
        return curve_key(member.scene, model.key)

    def stored(
        self, kind: str, inputs: Mapping[str, Any], result: type[T], module: str, compute: Callable[[], T]
    ) -> T:
        """A part of a study, found in the store or computed."""
        key = fingerprint({**inputs, "code": code_fingerprint(module, plain.__module__)})

        def build(folder: Path) -> None:
            (folder / RESULT).write_text(as_json(plain(compute())) + "\n", encoding="utf-8")

        entry = self.run.store.get(kind, key, build)
        found: T = restored(result, json.loads(entry.file(RESULT).read_text(encoding="utf-8")))
        return found

    def _unfit(self, member: Member) -> str:
        """Why the values of a member do not fit together; empty where they do."""
        file = replace(self.file, members=(member,), swept=tuple(member.parameters))
        try:
            if self.run.request.rom is None:
                check_scene(file, self.run.request.force)
            else:
                facts = self.model.facts
                check_scene_for_model(file, facts["interfaces"], facts["n_blades"], has_area=True, has_frame=True)
        except InputError as error:
            return str(error)
        return ""

    def _solved(self, members: Sequence[Member]) -> list[CurveResult]:
        run, outcome = self._derived(members), RunOutcome()
        try:
            models = self._models(run, outcome)
        except InputError as error:  # none of the models could be made
            return [CurveResult(member, None, None, None, str(error)) for member in members]
        curves = self.done
        curves.clear()
        member_curves(run, models, curves)
        said = "; ".join(outcome.problems)
        return [curve if curve.rom or not said else replace(curve, reason=said) for curve in curves]

    def _derived(self, members: Sequence[Member]) -> Run:
        """The run of these members up to their curves, with the log of the study."""
        file = replace(self.file, members=tuple(members), swept=tuple(members[0].parameters))
        request = replace(self.run.request, scene=file, until=Stage.RESPOND.value)
        return replace(self.run, request=request, log=self.log)

    def _models(self, run: Run, outcome: RunOutcome) -> Models:
        """The reduced model of each member."""
        if run.request.rom is not None:
            return {member.index: self.model for member in run.request.scene.members}
        return member_models(run, outcome, None)


def said_of(error: Exception) -> str:
    """The reason why a study has no result."""
    return str(error) if isinstance(error, StudyError) else reason_of(error)

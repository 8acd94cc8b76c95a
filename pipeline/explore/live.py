"""A scene whose knobs are turned: its response at once with few harmonics, then surer views of the same settings.

All numbers come from the functions that `shroud run` uses: `nonlinear_problem` and the stages of `forced_response`.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.errors import input_error, shown
from pipeline.explore import calls
from pipeline.explore.computation import Computation
from pipeline.explore.knobs import Knob, Range, knobs_of, turned_keys
from pipeline.explore.models import LiveModels, LoadedModel
from pipeline.explore.views import FIRST, LiveView, certainty_of
from pipeline.results.closure import QUICK, ranges_of_closure
from pipeline.scene.consistency import check_scene, check_scene_for_model
from pipeline.scene.dotted_keys import split_key
from pipeline.scene.reading import Member, SceneFile, derived_member, given_scene, parsed, read_scene, toml_text
from pipeline.scene.sweep import as_in_scene, key_value, swept_keys
from pipeline.stages.cache_keys import model_keys
from pipeline.stages.curve.curve_summary import checked
from pipeline.stages.engine_orders import SPEED
from pipeline.stages.scene_to_solver import contact_on_model, nonlinear_problem, resolved_contacts
from pipeline.stages.warm_up import warm_up
from pipeline.study_reply import StudyReply

if TYPE_CHECKING:
    from nonlinear.response_curve import ResponseCurve
    from pipeline.explore.points import LivePoint, LiveShape
    from pipeline.process.progress import Reporter
    from pipeline.scene.schema import Scene
    from rom.cyclic.reduced_model import ReducedModel

PLACE = "explore"  # how messages name the place of turned values
QUICK_STEPS: dict[str, Any] = {"max_step": 0.5, "peak_tolerance": 1e-5}  # of the first look: a fifth faster
# of the friction cone in a first look, whose exact cycle takes two to four times as long
CONE = {"contact.integration": "sampled", "contact.samples": 64}
MOST_POINTS = 2000  # solved, after which a first look that is not complete is given up; one takes a tenth of them
LEAST_SECONDS = 0.1  # that another model takes
Cancelled = Callable[[], bool]
TABLE = re.compile(r"^\s*\[(?P<name>[^\[\]]+)\]\s*(#.*)?$")
VALUE = r'(?P<value>"[^"]*"|[^#"\[{]*?)'  # one line: a number, a word


def never() -> bool:
    """A computation that is not cancelled."""
    return False


@dataclass(frozen=True)
class LiveScene:
    """A scene as its knobs stand; it never changes: `turned` gives another one, and undo is keeping the old one."""

    file: SceneFile  # the scene that was opened, without its sweep
    swept: SceneFile  # with its sweep
    member: Member  # the scene as it stands
    models: LiveModels
    computation: Computation
    values: Mapping[str, Any] = field(default_factory=dict)  # turned so far, by dotted key

    @classmethod
    def open(
        cls,
        scene: SceneFile | Mapping[str, Any] | str | Path,
        out: Path | None = None,
        *,
        rom: Path | ReducedModel | None = None,
        reporter: Reporter | None = None,
    ) -> LiveScene:
        """Read a scene and build its reduced model; of a sweep the member in the middle is where the knobs stand."""
        swept = scene if isinstance(scene, SceneFile) else _read(scene, rom is not None)
        middle = swept.members[len(swept.members) // 2].parameters
        file = given_scene(swept, {"sweep": None, **middle}, rom is not None) if swept.swept else swept
        models = LiveModels(Path("out") / file.first.name if out is None else out, rom)
        if reporter is not None:
            models.reporter = reporter
        live = cls(file, swept, file.members[0], models, Computation())
        live._checked(live.member)
        kernels = tuple((law, live.scene.contact.integration) for law in sorted(live.scene.laws))
        live.computation.start(*kernels)
        live.loaded  # noqa: B018 - built now, where a terminal shows the progress
        for law, integration in kernels:
            warm_up(law, integration)
        return live

    @property
    def scene(self) -> Scene:
        """The scene as it stands."""
        return self.member.scene

    @property
    def loaded(self) -> LoadedModel:
        """Its reduced model, built where it is missing (see `is_ready`)."""
        return self.models.of(self.file, self.member)

    @property
    def is_ready(self) -> bool:
        """Whether `curve` need not build a model first."""
        return self.models.is_at_hand(self.scene)

    def turned(self, values: Mapping[str, Any]) -> LiveScene:
        """The scene with other values by dotted key; of a list node by node the mean. InputError: not allowed."""
        given = {key: self._as_in_scene(key, value) for key, value in values.items()}
        merged = {**self.values, **given}
        member = derived_member(self.file, merged, PLACE, self.models.rom is not None)
        self._checked(member)
        self._check_nodes(member, given)
        return replace(self, member=member, values=merged)

    def curve(self) -> LiveView:
        """The main branch at once, with as few harmonics as the excitation has: 1, or its highest multiple.

        One that winds, or is not found from the low end of the frequency range, is given up as far as it is solved.
        """
        from nonlinear.response_solver import response_stages
        from rom.linear_algebra.threads import one_blas_thread

        def gives_up(frequency_hz: float, points: int) -> bool:
            return points == 0 or points > MOST_POINTS  # work, not time: the same on every machine

        with one_blas_thread():  # two of them take twice the processor time, and as long
            solved = self._quick()
            modal, contact, wave, options = nonlinear_problem(solved, self.loaded.model)
            quick = replace(options, **QUICK_STEPS)
            found = next(response_stages(modal, contact, wave, quick, gives_up)).curve
            return self._view(FIRST, found, solved)

    def refined(self, cancelled: Cancelled = never) -> Generator[LiveView]:
        """Ever surer views of the scene as it stands, the last one as `shroud run` has it; ends when cancelled.

        They are computed in another process, one scene at a time: others wait until the generator has ended or is
        closed. So it is with `build` and `optimum`.
        """
        for name, found in self._call(calls.solve, cancelled):
            yield self._view(name, found, self.scene)

    def build(self, cancelled: Cancelled = never) -> Generator[str]:
        """Build the reduced model in another process; lines on what is done. If not cancelled, it then `is_ready`."""
        yield from self._call(calls.build, cancelled)

    def optimum(self, over: Sequence[str], cancelled: Cancelled = never) -> Generator[str | StudyReply]:
        """Search for the optimum from the scene as it stands: `shroud optimise` over KEY or KEY=LOW:HIGH.

        Lines on what is done, then the optimum, which optimum.json of the output folder has as well.
        """
        arguments = self.models.out, self.models.rom, self.as_file(), tuple(over)
        yield from self.computation.call(calls.search, arguments, cancelled)

    def _call(self, function: Callable[..., None], cancelled: Cancelled) -> Generator[Any]:
        arguments = self.models.out, self.models.rom, self.file, self.member
        return self.computation.call(function, arguments, cancelled)

    def point(self, view: LiveView, index: int, branch: int = 0) -> LivePoint:
        """A point of a view of this scene by its index; branch 0 is the main one, k its detached branch k."""
        from pipeline.explore.points import point_of

        return point_of(view.solved, self.loaded, view.branches[branch], index)

    def shape(self, view: LiveView, index: int, branch: int = 0) -> LiveShape | None:
        """The motion of the blade there, for a picture that turns in time; None for a model without a mesh."""
        from pipeline.explore.points import shape_of

        on_mesh = self.models.on_mesh(self.file, self.member)
        return None if on_mesh is None else shape_of(view.solved, on_mesh, view.branches[branch], index)

    def close(self) -> None:
        """End the process behind it, also for scenes turned from it or from which it was turned."""
        self.computation.close()

    def scene_text(self) -> str:
        """The scene as it stands as TOML: `shroud run` of it gives the numbers of the last refined view.

        Comments of its file are kept; it has a name of its own, so that its results lie beside those of that file.
        """
        named = given_scene(self.as_file(), {"name": self.own_name}, self.models.rom is not None)
        middle = self.swept.members[len(self.swept.members) // 2].parameters if self.swept.swept else {}
        turned = {**middle, **self.values, "name": self.own_name}
        return edited(self.swept.text, turned, parsed(named.path, named.text))

    @property
    def own_name(self) -> str:
        """The name of the scene as it stands, where it is saved."""
        return f"{self.scene.name}-explored"

    def as_file(self) -> SceneFile:
        """The scene as it stands, as one that is read from a file."""
        return given_scene(self.file, self.values, self.models.rom is not None) if self.values else self.file

    @cached_property
    def knobs(self) -> tuple[Knob, ...]:
        """The knobs with ranges about the scene that was opened, and the values as they stand."""
        opened = replace(self, member=self.file.members[0], values={})
        static = self.models.remembered("static ranges", opened._static_ranges)
        costs = self.models.remembered("costs", opened._costs)
        speeds = self.models.remembered("speeds", opened._stored_speeds)
        first = knobs_of(self.swept, opened.scene, static, opened._punch(), costs, speeds)
        now, punch = self.scene, self._punch()
        return tuple(replace(knob, value=_value_now(now, knob, punch)) for knob in first)

    def _as_in_scene(self, key: str, value: Any) -> Any:
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if not is_number or key not in swept_keys(key) or key_value(self.scene, key) is None:
            return value
        return as_in_scene(self.scene, key, value)

    def _checked(self, member: Member) -> None:
        """Refuse values that do not fit together, in the one line of a run."""
        file = replace(self.file, members=(member,), swept=())
        if self.models.rom is None:
            check_scene(file)
        else:
            model = self.models.of(file, member).model
            has_area, has_frame = model.contact_area is not None, model.contact_frame is not None
            check_scene_for_model(file, model.interfaces, model.n_blades, has_area, has_frame)

    def _check_nodes(self, member: Member, given: Mapping[str, Any]) -> None:
        """Refuse lists node by node that are not as long as the face of the model, where that is in memory."""
        from nonlinear.contact.parameters import ContactError

        if (found := self.models.in_memory(member.scene)) is None:
            return
        try:
            contact_on_model(member.scene, found.model)
        except ContactError as error:
            key = next((key for key, value in given.items() if isinstance(value, list | tuple)), PLACE)
            allowed = str(error).partition("allowed: ")[2]
            raise input_error(self.file.path, key, shown(given.get(key)), allowed) from None

    def _quick(self) -> Scene:
        """The scene, of which the main branch is asked for alone, with few harmonics."""
        few = {**QUICK, "response.harmonics": self.scene.excitation.highest_harmonic}
        if "cone" in self.scene.laws and self.scene.contact.integration == "exact":
            few |= CONE
        return derived_member(self.file, {**self.values, **few}, PLACE, self.models.rom is not None).scene

    def _view(self, stage: str, found: ResponseCurve, solved: Scene) -> LiveView:
        from nonlinear.response_curve import StaticContact

        model, displacement = self.loaded.model, found.static_displacement
        limits, contact = self.models.limits(self.scene, self.loaded), contact_on_model(solved, model)
        static = {} if displacement is None else StaticContact.by_interface(contact, displacement, model.interfaces)
        return LiveView(stage, certainty_of(stage, found, solved), checked(found), limits, solved, static)

    def _static_ranges(self) -> dict[str, Range]:
        def derived(given: Mapping[str, Any]) -> Scene:
            return derived_member(self.file, {**self.values, **given}, PLACE, self.models.rom is not None).scene

        return ranges_of_closure(self.scene, self.loaded.model, derived)

    def _costs(self) -> dict[str, float]:
        """Seconds that another model takes, by the keys that need one: what the stages before it took last time."""
        if self.models.rom is not None:
            return {}
        now = model_keys(self.scene)
        seconds, found = self.models.seconds(now), {}
        for key in turned_keys(self.scene):
            value = key_value(self.scene, key)
            if value is None:
                continue
            changed = as_in_scene(self.scene, key, int(value) + 1 if value == int(value) else value * 1.001)
            keys = model_keys(_with(self.scene, key, changed))
            if keys.blade != now.blade:
                stages = (
                    ["reduce"] + ["assemble"] * (keys.assemble != now.assemble) + ["mesh"] * (keys.mesh != now.mesh)
                )
                found[key] = max(sum(seconds[stage] for stage in stages), LEAST_SECONDS)
        return found

    def _stored_speeds(self) -> list[float]:
        """The speeds of a sweep of which there are models; none where there are not several."""
        swept = [key_value(member.scene, SPEED) for member in self.swept.members if SPEED in self.swept.swept]
        speeds = sorted({speed for speed in swept if speed is not None})
        found = [speed for speed in speeds if self.models.is_at_hand(_with(self.scene, SPEED, speed))]
        return found if len(found) > 1 else []

    def _punch(self) -> dict[str, float]:
        """Stiffnesses of whole faces that are computed from their areas, by key."""
        from rom.reduction.contact_dofs import ContactNodes

        if not self.scene.punch_key:
            return {}
        resolved = {
            each.name: each.contact for each in resolved_contacts(self.scene, ContactNodes.of(self.loaded.model))
        }
        found = {}
        for table, face in self.scene.contacts.items():
            name = table.partition(".")[2]
            contact = resolved.get(name) or next(iter(resolved.values()))
            for key in ("normal_stiffness", "tangential_stiffness"):
                if getattr(face, key) == "punch":
                    found[f"{table}.{key}"] = float(getattr(contact, key))
        return found


def _read(scene: Mapping[str, Any] | str | Path, given_model: bool) -> SceneFile:
    return given_scene(scene, {}, given_model) if isinstance(scene, Mapping) else read_scene(scene, given_model)


def _with(scene: Scene, key: str, value: Any) -> Scene:
    """The scene with another value of a key, which is not checked."""
    table, _, name = key.rpartition(".")
    if table.startswith("interface."):
        own = table.partition(".")[2]
        changed = scene.interface[own].model_copy(update={name: value})
        return scene.model_copy(update={"interface": {**scene.interface, own: changed}})
    return scene.model_copy(update={table: getattr(scene, table).model_copy(update={name: value})})


def _value_now(scene: Scene, knob: Knob, punch: Mapping[str, float]) -> Any:
    if knob.kind == "choice":
        table, _, name = knob.key.rpartition(".")
        return getattr(scene.section(table), name)
    value = punch.get(knob.key, key_value(scene, knob.key))
    return int(value) if knob.kind == "whole" and value is not None else value


def edited(text: str, values: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    """The text of a scene with other values of some dotted keys and without its sweep.

    `wanted`: what it has to say; where the text cannot be brought to that line by line, that is written anew.
    """
    lines = _without_sweep(text.splitlines())
    for key, value in values.items():
        lines = _with_value(lines, key, toml_text({"x": value}).partition("=")[2].strip())
    found = "\n".join(lines) + "\n"
    try:
        same = tomllib.loads(found) == tomllib.loads(toml_text(wanted))
    except tomllib.TOMLDecodeError:
        same = False
    return found if same else toml_text(wanted)


def _without_sweep(lines: list[str]) -> list[str]:
    kept, inside = [], False
    for line in lines:
        if line.lstrip().startswith("["):
            table = TABLE.match(line)
            inside = inside if table is None else table["name"].strip().split(".")[0] == "sweep"
        kept += [] if inside else [line]
    return kept


def _with_value(lines: list[str], key: str, value: str) -> list[str]:
    """The lines with a value in its place, or at the head of its table, or in a table of its own at the end."""
    table, name = split_key(key)
    current, head = "", 0 if not table else None
    for number, line in enumerate(lines):
        if (found := TABLE.match(line)) is not None:
            current = found["name"].strip()
            head = number + 1 if current == table else head
            continue
        own = name if current == table else key if not current else None
        if own is None:
            continue
        place = re.match(rf"^(?P<left>\s*{re.escape(own)}\s*=\s*){VALUE}(?P<right>\s*(#.*)?)$", line)
        if place is not None:
            return [*lines[:number], f"{place['left']}{value}{place['right']}", *lines[number + 1 :]]
    if head is None:
        return [*lines, "", f"[{table}]", f"{name} = {value}"]
    return [*lines[:head], f"{name} = {value}", *lines[head:]]

"""One open page: what its knobs ask for and what it shows of the answers."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from pipeline.errors import one_line
from pipeline.explore.charts import PIN_COLOURS, THEME, ResponseChart, TrailChart
from pipeline.explore.point_charts import PointCharts, shape_plain
from pipeline.explore.saved import figure_text, table_text
from pipeline.explore.words import KnobWords, about, in_groups, readouts, steps, trail_title
from pipeline.explore.workshop import Cancelled, Kind, Workshop

if TYPE_CHECKING:
    from bokeh.document import Document

    from pipeline.explore.knobs import Knob
    from pipeline.explore.live import LiveScene
    from pipeline.explore.views import LiveView
    from pipeline.study_reply import StudyReply

TEMPLATES = Path(__file__).parent / "templates"
VIEWER = Path(__file__).parents[1] / "report" / "templates"
CALM, STILL = 250, 400  # milliseconds without a turn after which a motion, and a surer view, are computed
ONE_GESTURE = 1.0  # seconds between two turns of one knob that are undone together
MOST_UNDONE, MOST_PINS, MOST_TRAIL = 200, len(PIN_COLOURS), 400
DEFORMATION = 0.08  # largest displacement as it is drawn, of the height of the blade
SAVED = {"scene": ("toml", "text/plain"), "csv": ("csv", "text/csv"), "figure": ("svg", "image/svg+xml")}
PEAK = None  # the point whose motion is shown where none is picked


@dataclass(frozen=True)
class Stand:
    """A scene as it stood, with the key that was turned last to get there, and when."""

    scene: LiveScene
    key: str = ""
    at: float = 0.0


@dataclass(frozen=True)
class Opening:
    """What all pages of a server begin with."""

    scene: LiveScene
    view: LiveView
    workshop: Workshop
    pages: set[Page] = field(default_factory=set)  # that are open

    def __call__(self, doc: Document) -> None:
        """Make a page."""
        self.pages.add(Page(doc, self))

    def left(self, doc: Document) -> None:
        """A page has lost its browser, for a while or for good: what it waits for is not computed."""
        for page in self.pages:
            if page.doc is doc:
                page.leave()


def _read_turn(change: Mapping[str, Mapping[str, Any]]) -> dict[str, tuple[str, str]]:
    """How knobs are turned: by key "position", "shown" or "choice" and its value."""
    found = {}
    for key, how in change.items():
        ((kind, value),) = how.items()
        if kind != "shown":
            float(value)
        found[key] = kind, str(value)
    return found


def _read_place(place: list[float]) -> tuple[float, float]:
    x, y = place
    return float(x), float(y)


def _read_node(text: str) -> int | None:
    return None if text == "all" else max(int(text), 0)


@dataclass
class Pin:
    """A curve that is kept beside the next ones."""

    number: int
    label: str
    colour: str
    view: LiveView


@dataclass(eq=False)
class Page:
    """An open page; all but `_compute...` runs in the loop of the server."""

    doc: Document
    opening: Opening
    stand: Stand = field(init=False)
    view: LiveView = field(init=False)
    undone: list[Stand] = field(default_factory=list)
    redone: list[Stand] = field(default_factory=list)
    waiting: dict[str, Any] = field(default_factory=dict)  # values of knobs that remesh, until they are built
    pins: list[Pin] = field(default_factory=list)
    trail: dict[float, float] = field(default_factory=dict)
    picked: int | None = PEAK
    closed: bool = False
    _pinned: int = 0
    _later: dict[Kind, Any] = field(default_factory=dict)  # callbacks that wait for calm

    def __post_init__(self) -> None:
        from bokeh.models import TextInput
        from bokeh.themes import Theme
        from tornado.ioloop import IOLoop

        opening = self.opening
        self._loop = IOLoop.current()
        self.stand, self.view = Stand(opening.scene), opening.view
        self.response = ResponseChart.of(self.view)
        self.trails = TrailChart.of(self.response.unit)
        self.point = PointCharts.of()
        self.asked, self.told, self.shape = (TextInput(name=name) for name in ("asked", "told", "shape"))
        charts = [*self.response.figures, *self.trails.figures, *self.point.figures]
        with self.doc.models.freeze():  # which looks through all of them once
            for root in (*charts, self.asked, self.told, self.shape):
                self.doc.add_root(root)
        self.doc.theme = Theme(json=THEME)
        self.doc.template, texts = _template()
        self.doc.template_variables.update(texts)
        self.doc.title = _heading(self.stand.scene)
        self.asked.on_change("value", lambda name, old, new: self._hear(new))
        self.doc.on_session_destroyed(lambda context: self._close())
        self.response.show_view(self.view, [])

    # what the page asks for

    def _hear(self, text: str) -> None:
        """Do what the page asks for; what is not understood is passed over."""
        try:
            asked = json.loads(text)
            number = int(asked.pop("number"))
            ((name, value),) = asked.items()
            read, act = self._ACTS[name]
            value = read(value)
        except (ValueError, KeyError, TypeError, AttributeError):
            return
        try:
            act(self, value, number)
        except Exception as error:  # whatever was typed has an answer
            self._refuse(error, number)

    def _open(self, value: object, number: int) -> None:
        self._tell_all(number)
        self._refine_later()

    def _turn(self, change: Mapping[str, tuple[str, str]], number: int) -> None:
        """Turn knobs; those that remesh wait for their button."""
        knobs = {knob.key: knob for knob in self.stand.scene.knobs}
        values = {key: KnobWords(knobs[key]).value_of(*how) for key, how in change.items() if key in knobs}
        self.waiting |= {key: value for key, value in values.items() if knobs[key].remeshes}
        at_once = {key: value for key, value in values.items() if not knobs[key].remeshes}
        if at_once:
            self._ask_curve(self.stand, at_once, number)
        else:
            self._tell(number=number, values=self._values(), error=None)

    def _build(self, value: object, number: int) -> None:
        """Build the model with the values that wait for it, then turn to them."""
        scene, values = self.stand.scene, dict(self.waiting)

        def compute(cancelled: Cancelled) -> None:
            for line in scene.turned(values).build(cancelled):
                self._then(lambda line=line: self._tell(working=f"Building the model: {line}"))  # type: ignore[misc]
            self._then(lambda: self._end_work(number, {} if cancelled() else values))

        self._work(Kind.BUILD, compute, number, "Building the model ...")

    def _search(self, value: object, number: int) -> None:
        """Search for the optimum over the knob that was turned last, then turn to it."""
        knob, scene = self._trail_knob(), self.stand.scene
        if knob is None or knob.remeshes or knob.choices:
            self._tell(number=number)
            return

        def compute(cancelled: Cancelled) -> None:
            for found in scene.optimum([knob.key], cancelled):
                if isinstance(found, str):
                    self._then(lambda line=found: self._tell(working=f"Optimum: {line}"))  # type: ignore[misc]
                else:
                    self._then(lambda found=found: self._show_optimum(knob, found, number))  # type: ignore[misc]
            if cancelled():
                self._then(lambda: self._end_work(number, {}))

        self._work(Kind.SEARCH, compute, number, "Searching for the optimum ...")

    def _show_optimum(self, knob: Knob, found: StudyReply, number: int) -> None:
        values = {key: value for key, value in found.values.get("values", {}).items() if key == knob.key}
        if values and found.values["amplitude_m"] is not None:
            at = KnobWords(replace(knob, value=values[knob.key])).shown_number
            self.trails.show_best(at, found.values["amplitude_m"] * self.response.factor)
        self._tell(found=" ".join([*found.lines[:1], *found.problems]))
        self._end_work(number, values)

    def _work(self, kind: Kind, compute: Callable[[Cancelled], None], number: int, said: str) -> None:
        """Ask for something that takes long; the surer views wait for it."""
        self._forget_later()
        self.opening.workshop.drop(self, Kind.REFINE)
        self._tell(working=said)
        self._ask(kind, compute, number)

    def _end_work(self, number: int, values: Mapping[str, Any]) -> None:
        self._tell(working=None, number=number)
        if values:
            self.waiting = {key: value for key, value in self.waiting.items() if key not in values}
            self._ask_curve(self.stand, values, number)
        else:
            self._refine_later()

    def _stop(self, value: object, number: int) -> None:
        """End what takes long."""
        self.opening.workshop.drop(self, Kind.BUILD, Kind.SEARCH)
        self._end_work(number, {})

    def _undo(self, value: object, number: int) -> None:
        if self.undone:
            self.redone.append(self.stand)
            self._return_to(self.undone.pop(), number)

    def _redo(self, value: object, number: int) -> None:
        if self.redone:
            self.undone.append(self.stand)
            self._return_to(self.redone.pop(), number)

    def _reset(self, value: object, number: int) -> None:
        self._remember()
        self._return_to(Stand(self.opening.scene), number)

    def _return_to(self, stand: Stand, number: int) -> None:
        if stand.key != self.stand.key:
            self.trail.clear()
        self.stand, self.waiting = stand, {}
        self._ask_curve(stand, {}, number)

    def _pin(self, value: object, number: int) -> None:
        if len(self.pins) == MOST_PINS:
            del self.pins[0]
        free = next(colour for colour in PIN_COLOURS if colour not in {pin.colour for pin in self.pins})
        self._pinned += 1
        self.pins.append(Pin(self._pinned, self._pin_label(), free, self.view))
        self._show_pins(number)

    def _unpin(self, value: int, number: int) -> None:
        self.pins = [pin for pin in self.pins if pin.number != value]
        self._show_pins(number)

    def _fit(self, value: object, number: int) -> None:
        self.response.show_all()
        self._tell(number=number)

    def _step(self, value: int, number: int) -> None:
        """Go along the curve by some points."""
        self._pick(self._place() + value)
        self._tell(number=number)

    def _pick_place(self, value: tuple[float, float], number: int) -> None:
        """Show the motion at the point of the curve next to a place of the chart."""
        self._pick(self.response.nearest(*value))
        self._tell(number=number)

    def _pick_peak(self, value: object, number: int) -> None:
        self._pick(PEAK)
        self._tell(number=number)

    def _node(self, value: int | None, number: int) -> None:
        self.point.choose(value)
        self._tell(number=number)

    def _save(self, what: tuple[str, str], number: int) -> None:
        scene, view, (ending, kind) = self.stand.scene, self.view, what
        pins = [(pin.label, pin.view) for pin in self.pins]
        heading = f"{_heading(scene)}: {self._pin_label()}"
        texts: dict[str, Callable[[], str]] = {
            "toml": scene.scene_text,
            "csv": lambda: table_text(view),
            "svg": lambda: figure_text(heading, view, pins, bool(self.response.figures[0].visible)),
        }

        def make(cancelled: Cancelled) -> None:
            file = {"name": f"{scene.own_name}.{ending}", "type": kind, "text": texts[ending]()}
            self._then(lambda: self._tell(save=file, number=number))

        self._ask(Kind.EXPORT, make, number)

    # what is computed for it, in the thread of the workshop

    def _ask(self, kind: Kind, run: Callable[[Cancelled], None], number: int | None = None) -> None:
        def failed(error: Exception) -> None:
            self._then(lambda: self._refuse(error, number))

        self.opening.workshop.ask(self, kind, run, failed)

    def _then(self, show: Callable[[], None]) -> None:
        """Show something, from another thread, if the page is still open then."""

        def in_the_loop() -> None:
            if not self.closed:
                self.doc.add_next_tick_callback(lambda: None if self.closed else show())

        self._loop.add_callback(in_the_loop)

    def _ask_curve(self, base: Stand, values: Mapping[str, Any], number: int) -> None:
        """The curve of a stand with other values, at once; what was computed for older values ends."""
        self._forget_later()

        def compute(cancelled: Cancelled) -> None:
            scene = base.scene.turned(values) if values else base.scene
            view = scene.curve()
            if not cancelled() or not values:
                self._then(lambda: self._show_curve(base, scene, view, tuple(values), number))

        self._ask(Kind.CURVE, compute, number)

    def _refine_later(self) -> None:
        """Compute a motion and surer views once no knob is turned."""
        self._forget_later()
        self._later = {
            Kind.POINT: self.doc.add_timeout_callback(lambda: self._calm(Kind.POINT, self._ask_point), CALM),
            Kind.REFINE: self.doc.add_timeout_callback(lambda: self._calm(Kind.REFINE, self._ask_refined), STILL),
        }

    def _calm(self, kind: Kind, ask: Callable[[], None]) -> None:
        self._later.pop(kind, None)
        if not self.closed:
            ask()

    def _forget_later(self) -> None:
        for callback in self._later.values():
            self.doc.remove_timeout_callback(callback)
        self._later.clear()

    def _ask_refined(self) -> None:
        scene, seen = self.stand.scene, self.view

        def compute(cancelled: Cancelled) -> None:
            for view in scene.refined(cancelled):
                if cancelled():
                    return
                self._then(lambda view=view: self._show_refined(scene, view))  # type: ignore[misc]

        if not seen.is_last:
            self._ask(Kind.REFINE, compute)

    def _ask_point(self) -> None:
        view, place, scene = self.view, self._place(), self.stand.scene
        if not view.response.points:
            return
        self.response.show_picked(float(view.response.frequency_hz[place]), float(view.response.amplitude_m[place]))

        def compute(cancelled: Cancelled) -> None:
            found = scene.point(view, place)
            self._then(lambda: self._show_point(view, found))
            if cancelled():
                return
            shape = scene.shape(view, place)
            shown = None if shape is None else shape_plain(shape, DEFORMATION)
            self._then(lambda: self._show_shape(view, shown))

        self._ask(Kind.POINT, compute)

    # what is shown of it

    def _show_curve(self, base: Stand, scene: LiveScene, view: LiveView, keys: tuple[str, ...], number: int) -> None:
        if keys:
            self._remember(keys[0])
            self.redone.clear()
            if keys[0] != base.key:
                self.trail.clear()
            self.stand = Stand(scene, keys[0], time.monotonic())
        self.picked = PEAK
        self._show(view)
        self._tell(number=number, error=None, **self._words(), values=self._values(), can=self._can())
        self._then(lambda: self._add_to_trail(view))  # which may come a frame later
        self._refine_later()

    def _show_refined(self, scene: LiveScene, view: LiveView) -> None:
        if scene is not self.stand.scene:
            return
        kept = self._frequency()
        self._show(view)
        if kept is not None and view.response.points:  # the same place on the new curve
            self.picked = self.response.nearest(kept[0], kept[1] * self.response.factor)
        self._tell(**self._words())
        self._ask_point()  # its marker, motion and loops are of the curve that is shown

    def _show(self, view: LiveView) -> None:
        self.view = view
        self.response.show_view(view, [(pin.view, pin.colour) for pin in self.pins])

    def _show_point(self, view: LiveView, found: Any) -> None:
        if view is not self.view:
            return
        self._tell(**self.point.show_point(found, self.response.unit, self.response.factor))

    def _show_shape(self, view: LiveView, shown: dict[str, Any] | None) -> None:
        if view is self.view and shown is not None:
            self.shape.value = json.dumps(shown)
        elif shown is None:
            self._tell(no_shape="This model has no mesh to show.")

    def _show_pins(self, number: int) -> None:
        self._show(self.view)
        pins = [{"number": pin.number, "label": pin.label, "colour": pin.colour} for pin in self.pins]
        self._tell(number=number, pins=pins, can=self._can())

    def _add_to_trail(self, view: LiveView) -> None:
        knob = self._trail_knob()
        if knob is None:
            self.trails.hide()
            self._tell(trailed=False)
        if (
            view is not self.view
            or knob is None
            or not view.response.points
            or not view.response.termination.complete
        ):
            return  # the highest point of an incomplete curve says nothing
        words = KnobWords(knob)
        self.trail[words.shown_number] = view.facts.peak_amplitude_m * self.response.factor
        if len(self.trail) > MOST_TRAIL:
            del self.trail[next(iter(self.trail))]
        self.trails.show_trail(knob.label, knob.log, self.trail, words.shown_number)
        if len(self.trail) == 1:
            self._tell(trailed=True)

    def _refuse(self, error: Exception, number: int | None) -> None:
        """Say what is wrong, in the units of the page, and show the knobs as they stand."""
        parts: dict[str, Any] = {} if number is None else {"number": number}
        key = getattr(error, "key", "")
        named = [knob for knob in self.stand.scene.knobs if knob.key in key]
        knob = max(named, key=lambda each: len(each.key), default=None)
        said = str(error) if knob is None or knob.choices else KnobWords(knob).refusal(str(error))
        self._tell(error=one_line(said), values=self._values(), working=None, **parts)

    def _tell_all(self, number: int) -> None:
        scene = self.stand.scene
        knobs = in_groups([KnobWords(knob).plain() for knob in scene.knobs])
        self._tell(
            number=number, title=_heading(scene), knobs=knobs, values=self._values(),
            can=self._can(), pins=[], **self._words(),
        )  # fmt: skip

    def _tell(self, **parts: Any) -> None:
        if not self.closed:
            self.told.value = json.dumps(parts)

    def _words(self) -> dict[str, Any]:
        view = self.view
        return {
            "about": about(self.stand.scene),
            "readouts": readouts(view, self.response),
            "sure": view.certainty,
            "steps": steps(view),
            "trail": trail_title(self._trail_knob()),
        }

    def _values(self) -> dict[str, Any]:
        opened = {knob.key: knob.value for knob in self.opening.scene.knobs}
        return {
            knob.key: KnobWords(knob).now(opened.get(knob.key), self.waiting.get(knob.key))
            for knob in self.stand.scene.knobs
        }

    def _can(self) -> dict[str, bool]:
        changed = bool(self.stand.scene.values)
        knob = self._trail_knob()
        searched = knob is not None and not knob.remeshes and not knob.choices
        return {"undo": bool(self.undone), "redo": bool(self.redone), "reset": changed, "search": searched}

    # where it stands

    def _remember(self, key: str = "") -> None:
        """Keep the stand for undo; turns of one knob without a pause are one."""
        if key and key == self.stand.key and time.monotonic() - self.stand.at < ONE_GESTURE and self.undone:
            return
        self.undone.append(self.stand)
        del self.undone[:-MOST_UNDONE]

    def _pick(self, place: int | None) -> None:
        if place is not None:
            place = min(max(place, 0), self.view.response.points - 1)
        self.picked = place
        self._ask_point()

    def _place(self) -> int:
        """The point whose motion is shown."""
        points = self.view.response.points
        if self.picked is None:
            return max(self.view.facts.peak_index, 0)
        return min(self.picked, points - 1)

    def _frequency(self) -> tuple[float, float] | None:
        """Frequency and amplitude of the picked point."""
        if self.picked is None:
            return None
        curve, place = self.view.response, self._place()
        return float(curve.frequency_hz[place]), float(curve.amplitude_m[place])

    def _trail_knob(self) -> Knob | None:
        return next((knob for knob in self.stand.scene.knobs if knob.key == self.stand.key), None)

    def _pin_label(self) -> str:
        """The values that differ from those of the scene file."""
        turned = [knob for knob in self.stand.scene.knobs if knob.key in self.stand.scene.values]
        return ", ".join(KnobWords(knob).said for knob in turned) or "as in the file"

    def leave(self) -> None:
        """End what is computed for the page."""
        self._forget_later()
        self.opening.workshop.drop(self)

    def _close(self) -> None:
        self.closed = True
        self.opening.pages.discard(self)
        self.opening.workshop.drop(self)

    # what can be asked for: how its value is read, which fails for what the page never sends, and what is done
    _ACTS: ClassVar[dict[str, tuple[Callable[[Any], Any], Callable[[Page, Any, int], None]]]] = {
        "ready": (bool, _open),
        "turn": (_read_turn, _turn),
        "build": (str, _build),
        "search": (bool, _search),
        "stop": (bool, _stop),
        "undo": (bool, _undo),
        "redo": (bool, _redo),
        "reset": (bool, _reset),
        "pin": (bool, _pin),
        "unpin": (int, _unpin),
        "fit": (bool, _fit),
        "step": (int, _step),
        "pick": (str, _pick_peak),
        "place": (_read_place, _pick_place),
        "node": (_read_node, _node),
        "save": (SAVED.__getitem__, _save),
    }


def _heading(scene: LiveScene) -> str:
    return scene.scene.title or scene.scene.name


def _template() -> tuple[Any, dict[str, str]]:
    """The page around the charts, and the texts that are put into it."""
    from jinja2 import Environment, FileSystemLoader

    loader = FileSystemLoader([TEMPLATES, VIEWER])
    environment = Environment(loader=loader, autoescape=False, trim_blocks=True, lstrip_blocks=True)
    read = {"style": TEMPLATES / "explore.css", "script": TEMPLATES / "explore.js", "viewer": VIEWER / "viewer.js"}
    texts = {name: path.read_text(encoding="utf-8") for name, path in read.items()}
    return environment.get_template("explore.html"), texts

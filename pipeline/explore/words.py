"""What the page says: knobs, numbers and stages as plain values for its script."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pipeline.errors import input_error, shown
from pipeline.explore.views import FIRST, LAST
from pipeline.results.worst import END_MARK, UNSTABLE_MARK
from pipeline.scene.labels import prefixed

if TYPE_CHECKING:
    from pipeline.explore.charts import ResponseChart
    from pipeline.explore.knobs import Knob
    from pipeline.explore.live import LiveScene
    from pipeline.explore.views import LiveView

GROUPS = {
    "contact": "Contact",
    "excitation": "Excitation",
    "response": "Response",
    "damper": "Damper",
    "load": "Load",
}
STAGES = (FIRST, "main branch", "truncation error", "detached branches", LAST)  # of views, in their order
SHORT_STEPS = 200  # of a scale that has no steps of its own


@dataclass(frozen=True)
class KnobWords:
    """A knob as the page shows it: numbers in the unit of its label."""

    knob: Knob

    @property
    def group(self) -> str:
        """The heading that it stands under."""
        table = self.knob.key.rpartition(".")[0]
        kind, _, name = table.partition(".")
        return f"Contact: {name}" if kind == "interface" else GROUPS.get(kind, kind.capitalize())

    @property
    def shown_number(self) -> float:
        """Its value in the unit of its label."""
        return self._scaled(self.knob.value)

    @property
    def said(self) -> str:
        """Its name and value: "v0 = 5 µm"."""
        name = self.knob.label.partition(" [")[0]
        return f"{name} = {self._text(self.knob.value)}{' ' * bool(self.knob.unit)}{self.knob.unit}"

    def plain(self) -> dict[str, Any]:
        """What does not change while it is turned."""
        knob = self.knob
        numeric = not knob.choices
        return {
            "key": knob.key,
            "label": knob.label,
            "group": self.group,
            "choices": None if numeric else [str(choice) for choice in knob.choices],
            "range": f"{self._text(knob.low)} to {self._text(knob.high)} {knob.unit}".strip() if numeric else "",
            "step": self._step() if numeric else 0,
            "remeshes": knob.remeshes,
        }

    def now(self, opened: Any, waits: Any) -> dict[str, Any]:
        """What changes: its value, or the one that waits for a new model; `opened`: that of the scene file."""
        knob = self.knob
        value = knob.value if waits is None else waits
        changed = value != opened
        if knob.choices:
            at = [str(choice) for choice in knob.choices].index(str(value)) if str(value) in self._names() else -1
            return {"choice": at, "changed": changed, "waits": waits not in (None, knob.value), "cost": self._cost()}
        return {
            "shown": self._text(value),
            "text": f"{self._text(value)} {knob.unit}".strip(),
            "position": knob.position(value),
            "changed": changed,
            "waits": waits is not None and waits != knob.value,
            "cost": self._cost(),
        }

    def value_of(self, how: str, text: str) -> Any:
        """The value at a "position" of the scale, of a number "shown" in the unit, or a "choice" by its number."""
        knob = self.knob
        if how == "choice" and knob.choices:
            return knob.choices[min(max(int(text), 0), len(knob.choices) - 1)]
        if how == "position":
            return knob.at(min(max(float(text), 0.0), 1.0))
        try:
            number = float(Decimal(text) / Decimal(str(knob.factor)))  # the number nearest to what was typed
        except (ArithmeticError, ValueError):
            raise input_error("explore", knob.key, shown(text), "a number") from None
        return int(number) if knob.kind == "whole" and math.isfinite(number) and number == int(number) else number

    def refusal(self, error: str) -> str:
        """Why a value is not taken: the allowed ones of the message, those of the page in its unit where it has them
        in SI or asks for an option of the command line.
        """
        allowed = error.partition("allowed: ")[2]
        plain = self.knob.factor == 1.0 and "--force" not in allowed and allowed
        name, usual = self.knob.label.partition(" [")[0], f"{self.plain()['range']} are usual"
        now = f"{self._text(self.knob.value)} {self.knob.unit}".strip()
        return f"{name}: not taken, {f'allowed: {allowed}' if plain else usual}; it stays at {now}"

    def _names(self) -> list[str]:
        return [str(choice) for choice in self.knob.choices]

    def _scaled(self, value: Any) -> float:
        return float(f"{float(value) * self.knob.factor:.10g}")

    def _text(self, value: Any) -> str:
        return f"{float(value) * self.knob.factor:.6g}" if isinstance(value, int | float) else str(value)

    def _step(self) -> float:
        knob = self.knob
        length = knob.high - knob.low
        if knob.log or not length > 0.0:
            return 1.0 / SHORT_STEPS
        return min(max((knob.step or length / SHORT_STEPS) / length, 1e-4), 1.0)

    def _cost(self) -> str:
        return f"takes about {self.knob.seconds:.2g} s" if self.knob.seconds else "takes some seconds"


def in_groups(knobs: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
    """Plain knobs with those of one heading next to each other, in the order in which headings come first."""
    found: dict[tuple[bool, str], list[dict[str, Any]]] = {}
    for knob in knobs:
        found.setdefault((knob["remeshes"], knob["group"]), []).append(knob)
    return [knob for group in found.values() for knob in group]


def about(scene: LiveScene) -> str:
    """One line on what is computed."""
    now = scene.scene
    blades = "" if now.n_blades is None else f"{now.n_blades} blades · "
    low, high = now.response.frequency
    speed = f" · {now.load.speed_rpm:.6g} rev/min" if now.load.speed_rpm else ""
    return f"{blades}engine order {now.excitation.engine_order} · {low:.6g} to {high:.6g} Hz{speed}"


def readouts(view: LiveView, chart: ResponseChart) -> list[dict[str, Any]]:
    """The numbers above the chart, each with its exact value for who reads the page by a program."""
    facts, curve = view.facts, view.response
    many = f"{curve.harmonics} harmonic{'s' * (curve.harmonics != 1)}"
    limits = [f"{limit.kind} {limit.resonance[0]:.4g}" for limit in view.limits if limit.resonance]
    where = "main branch" if curve.termination.complete else "incomplete curve"
    end = END_MARK if facts.peak_at_end else ""
    peak = facts.peak_index
    found = [
        _number("peak", facts.peak_amplitude_m, chart.factor, chart.unit, f"{where}, {many}{end}"),
        _number("at", facts.peak_frequency_hz, 1.0, "Hz", f"{' · '.join(limits)} Hz" if limits else ""),
    ]
    if peak >= 0:
        counts = {"stick": curve.sticking[peak], "slip": curve.slipping[peak], "open": curve.separating[peak]}
        number = max(int(sum(counts.values())), 1)
        states = [f"{int(count)} {name}" for name, count in counts.items() if count]
        found.append(
            {
                "name": "contact at the peak",
                "value": _contact(counts),
                "unit": "",
                "of": f"nodes: {', '.join(states)}",
                "shares": [(name, int(count) / number) for name, count in counts.items()],
                "exact": " ".join(str(int(count)) for count in counts.values()),
            }
        )
    found.extend(_static(view))
    found.append(_worst(view, chart))
    return found


def _contact(counts: Mapping[str, Any]) -> str:
    if counts["open"]:
        return "opens"
    return "slips" if counts["slip"] else "sticks"


def _number(name: str, value: float, factor: float, unit: str, of: str) -> dict[str, Any]:
    text = f"{value * factor:.5g}" if math.isfinite(value) else "-"
    return {"name": name, "value": text, "unit": unit, "of": of, "exact": repr(float(value))}


def _static(view: LiveView) -> Iterator[dict[str, Any]]:
    if not view.static:
        yield _number("static normal force", math.nan, 1.0, "", "not known yet")
    known = {0.0: "all closed", 1.0: "all open"}
    for interface, static in view.static.items():
        factor, unit = prefixed(abs(static.force_n), "N")
        apart = known.get(static.open_share, f"{100.0 * static.open_share:.3g} % open")
        name = f"static normal force, {interface}" if len(view.static) > 1 else "static normal force"
        yield _number(name, static.force_n, factor, unit, apart)


def _worst(view: LiveView, chart: ResponseChart) -> dict[str, Any]:
    facts = view.facts
    if not facts.worst_searched:
        return _number("worst motion", math.nan, 1.0, "", "not searched for yet")
    if not math.isfinite(facts.worst_amplitude_m):
        return _number("worst motion", math.nan, 1.0, "", "not known")
    branch = {-1: "on no branch", 0: "main branch"}.get(facts.worst_branch, f"detached branch {facts.worst_branch}")
    marks = UNSTABLE_MARK * facts.worst_unstable + END_MARK * facts.worst_at_end
    kind = "" if facts.worst_motion == "periodic" else f", {facts.worst_motion}"
    found = _number("worst motion", facts.worst_amplitude_m, chart.factor, chart.unit, "")
    found["of"] = f"{facts.worst_frequency_hz:.5g} Hz, {branch}{kind}{marks}"
    if facts.worst_unresolved:
        found["value"] = f"≥ {found['value']}"
    return found


def steps(view: LiveView) -> list[dict[str, str]]:
    """The stages, done, being computed or to come."""
    at = STAGES.index(view.stage)
    found = []
    for number, name in enumerate(STAGES):
        state = "done" if number <= at else "now" if number == at + 1 else "waits"
        found.append({"name": name, "state": state, "said": view.certainty if number == at else ""})
    return found


def trail_title(knob: Knob | None) -> str:
    """Heading of the trail."""
    return "Peak over the knob that is turned" if knob is None else f"Peak over {knob.label.partition(' [')[0]}"

"""What the screen says at the end of a run: scene, modes, a row for each curve, the lowest, what is open.

`shroud info` says the same of an output folder. Every number stands in summary.json.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from nonlinear.options import TRUNCATION_TOLERATED
from pipeline.results.best_design import (
    BestDesign,
    DesignPoint,
    best_design,
    compares_designs,
    condition_keys,
    values_label,
)
from pipeline.results.certainty import coriolis_said
from pipeline.results.frequency_range import MOST, linear_modes, stored_resonances
from pipeline.results.overview import FEW_ROWS, MOST_ROWS
from pipeline.results.tables import (
    TOLERATED_SAMPLING,
    has_bounds,
    has_static_load,
    listed,
    measured_errors,
    screen_table,
    short_value,
    static_cells,
    static_text,
    truncation_cell,
)
from pipeline.results.worst import (
    CONTACT_SAID,
    END_MARK,
    FREE,
    NOTICEABLE,
    STUCK,
    UNSTABLE_SAID,
    contact_state,
    number_error,
    share,
    worst_cells,
)
from pipeline.scene.labels import fixed_values, prefixed, quantity, value_label, values_said
from pipeline.scene.reading import SceneFile
from pipeline.stages.curve.curve_summary import CurveSummary
from pipeline.stages.curve.curve_table import NOT_COMPUTED
from pipeline.stages.model.natural_frequencies import stored_frequencies

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from nonlinear.response_curve import StaticContact
    from pipeline.stages.curve.respond import CurveResult
    from pipeline.stages.model.sweep_models import Models
    from pipeline.stages.request import Run, RunOutcome

_SHAPE: dict[str, Any] = {"box": None, "padding": (0, 2, 0, 0)}  # of the tables
_BEST = "highest of the best design"  # over the conditions
ROW = ("contact", "free_blade_m")  # what summary.json adds to the entry of a curve that has a row
ALL_SAID = {1: "", 2: "both "}  # of so many frequencies inside the range
MOST_MODES = 3  # modes in the line about them


@dataclass(frozen=True)
class ShownCurve:
    """One curve as the screen shows it."""

    number: int  # from 0, as in files and in Python
    parameters: Mapping[str, Any]  # swept keys and their values
    facts: CurveSummary | None  # None where the curve failed
    reason: str  # how it ended, or why there is none
    contact: str | None = None  # contact at the worst motion; None where it was not looked at
    free_blade_m: float | None = None  # amplitude of the free blade at its resonance, m

    @property
    def height(self) -> float:
        """Amplitude of the worst motion, m, or of the peak where that is not known; NaN without either."""
        return math.nan if self.facts is None else self.facts.height

    @property
    def mean(self) -> float:
        """Mean displacement in the height, m; 0 where it is not worth saying."""
        return 0.0 if self.facts is None else self.facts.mean

    @property
    def waits(self) -> bool:
        """Whether a run that was interrupted, or goes on, has not come to it."""
        return self.facts is None and self.reason == NOT_COMPUTED

    @property
    def closed(self) -> bool:
        """Whether nothing was left open that may be higher."""
        facts = self.facts
        known = facts is not None and facts.complete and math.isfinite(facts.worst_amplitude_m)
        return known and facts is not None and not facts.worst_unresolved and not facts.at_end

    @property
    def label(self) -> str:
        """Its swept values."""
        return ", ".join(value_label(key, value) for key, value in self.parameters.items())


def known_of(run: Run, models: Models, outcome: RunOutcome) -> dict[str, Any]:
    """What summary.json has beside the curves: `subject`, `linear`, and by number of a curve what its row adds.

    The rows are those of `shown_numbers`: contact at the worst motion, amplitude of the free blade.
    """
    members = run.request.scene.members
    sampled = [*members[:: -(-len(members) // MOST)]]
    resonances, blades = {}, None
    shown = shown_numbers([math.nan if c.facts is None else c.facts.height for c in outcome.curves])
    for member in {member.index: member for member in [*sampled, *(members[number] for number in shown)]}.values():
        model = models.get(member.index)
        if model is not None:
            resonances[member.index] = stored_resonances(run.store, model.key, member.scene, model.rom)
            blades = blades or stored_frequencies(run.store, model, member.scene)["n_blades"]
    linear, free_m = linear_modes([member for member in members if member.index in resonances], resonances)
    for entry in linear:
        for name, state in (("name", "free"), ("stuck_name", "stuck")):
            names = {order: each for m in outcome.models for order, each in m.get(f"{state}_names", {}).items()}
            entry[name] = (names.get(str(entry["engine_order"])) or [""] * entry["mode"])[entry["mode"] - 1]
    rows, loads = {}, any(map(has_static_load, outcome.curves))
    for number in shown:
        curve = outcome.curves[number]
        contact = None if curve.file is None or curve.facts is None else contact_state(curve.file, curve.facts)
        rows[number] = {"contact": contact, "free_blade_m": free_m.get(members[number].index)}
    return {"subject": _subject(run.request.scene, blades, loads), "linear": linear, "rows": rows}


def _subject(file: SceneFile, n_blades: int | None, loads: bool) -> dict[str, Any]:
    """What all curves have in common; null: swept, or not known."""
    from rom.cyclic.resonance_crossings import excited_nodal_diameter

    scene, swept = file.first, set(file.swept)
    found = fixed_values(scene, swept)
    known = n_blades is not None and not swept & {"blade.n_blades", "excitation.engine_order"}
    order = scene.excitation.engine_order
    found |= {
        "n_blades": None if "blade.n_blades" in swept else n_blades,
        "nodal_diameter": excited_nodal_diameter(order, n_blades) if known and n_blades is not None else None,
    }
    return {
        "title": scene.title or scene.name,
        "frequency_hz": list(scene.response.frequency),
        "static_loads": loads,
        **found,
    }


def screen_curves(curves: Sequence[CurveResult], rows: Mapping[int, Mapping[str, Any]]) -> list[ShownCurve]:
    """The curves of a run with what `known_of` adds to the rows."""
    return [
        ShownCurve(number, curve.member.parameters, curve.facts, curve.reason, **rows.get(number, {}))
        for number, curve in enumerate(curves)
    ]


def heading(subject: Mapping[str, Any]) -> str:
    """Title, blades, excitation, speed, shroud angle and friction, as far as they are not swept."""
    blades = [] if subject["n_blades"] is None else [f"{subject['n_blades']} blades"]
    return f"{subject['title']}: {', '.join([*blades, values_said(subject)])}"


def modes_line(linear: Sequence[Mapping[str, Any]], limits: Sequence[float]) -> str:
    """Resonances with free and with stuck shrouds of the modes that the range is about; "" where none is known."""
    modes: dict[tuple[int, str, str], list[Mapping[str, Any]]] = {}
    for entry in linear:  # files of earlier versions name the free shape alone
        names = entry["name"], entry.get("stuck_name", entry["name"])
        modes.setdefault((entry["mode"], *names), []).append(entry)
    if not modes:
        return ""
    said, outside, count = [], [], 0
    for (number, free_name, stuck_name), entries in list(modes.items())[:MOST_MODES]:
        name = free_name if free_name == stuck_name else ""
        states = []
        for state in ("free", "stuck"):
            if f"{state}_hz" not in entries[0]:
                continue
            low = min(entry[f"{state}_hz"][0] for entry in entries)
            high = max(entry[f"{state}_hz"][1] for entry in entries)
            text = " to ".join(dict.fromkeys(map(_hertz, (low, high)))) + " Hz"
            shape = "" if name else {"free": free_name, "stuck": stuck_name}[state]
            states.append(f"{text} {state}{f' ({shape})' if shape else ''}")
            count += 1
            if low < limits[0] or high > limits[1]:
                outside.append(text)
        said.append(f"mode {number}{f' ({name})' if name else ''}: {', '.join(states)}")
    within = f"the range {limits[0]:g} to {limits[1]:g} Hz"
    end = f"{' and '.join(outside)} outside {within}" if outside else f"{ALL_SAID.get(count, 'all ')}inside {within}"
    return "; ".join([*said, end])


def _hertz(value: float) -> str:
    return f"{value:.0f}" if value >= 100.0 else f"{value:.3g}"


def shown_numbers(heights: Sequence[float]) -> list[int]:
    """Places of the curves that have a row: all, or of many the lowest and the highest, in their order."""
    if len(heights) <= MOST_ROWS:
        return list(range(len(heights)))
    order = sorted((k for k, height in enumerate(heights) if math.isfinite(height)), key=lambda k: heights[k])
    half = FEW_ROWS // 2
    return sorted({*order[:half], *order[-half:]})


def amplitude_unit(curves: Sequence[ShownCurve]) -> tuple[float, str]:
    """Factor and unit of the amplitudes of all curves."""
    return prefixed(max((c.height for c in curves if math.isfinite(c.height)), default=0.0), "m")


def conclusion_table(curves: Sequence[ShownCurve], shown: Sequence[int], static: bool) -> Table:
    """One row a curve: swept values, worst motion, contact there, static contact where it acts, remark in words."""
    factor, unit = amplitude_unit(curves)
    swept = list(curves[0].parameters) if curves else []
    means = static and any(curve.mean for curve in curves)
    together = static and not any(curve.facts.interfaces for curve in curves if curve.facts is not None)
    headings = ["#", *(quantity(key).axis() for key in swept), f"worst [{unit}]", *(f"mean [{unit}]",) * means]
    headings += ["at [Hz]", "contact", *("static open",) * together, "remark"]
    best = lowest(curves)
    marked = {}
    if isinstance(best, BestDesign) and compares_designs(swept):
        marked = {curves[best.highest].number: _BEST if condition_keys(swept) else "lowest"}
    rows = []
    for curve in (curves[number] for number in shown):
        values = [short_value(key, value) for key, value in curve.parameters.items()]
        said = "; ".join(_remarks(curve, factor, marked.get(curve.number, "") if len(curves) > 1 else ""))
        height, at = _motion(curve.facts, factor)
        cells = [height, *(_mean(curve.facts, factor),) * means, at]
        open_share = [] if not together else [static_cells(_static(curve))[1]]
        contact = CONTACT_SAID.get(curve.contact or "", "-")
        rows.append([str(curve.number), *values, *cells, contact, *open_share, said])
    table = screen_table(headings, rows, ("contact", "remark"), **_SHAPE)
    for column in table.columns[: -1 - together]:
        column.no_wrap = True
    return table


INTERFACES_SAID = "Friction work per cycle by contact interface, and its nodes, at the peak of the main branch"
STATIC_SAID = "Static contact by interface, before the excitation acts (v < 0: gap)"
_STATES = {"sticking": "stick", "slipping": "slip", "separating": "open"}


def interface_rows(curves: Sequence[ShownCurve]) -> tuple[list[str], list[list[str]]]:
    """Headings and a row for each curve: friction work and states of each interface; none with one interface."""
    known = [curve for curve in curves if curve.facts is not None and curve.facts.interfaces]
    found = {curve.number: {each["name"]: each for each in curve.facts.interfaces} for curve in known if curve.facts}
    names = list(dict.fromkeys(name for entries in found.values() for name in entries))
    factor, unit = prefixed(max((_work(each) for of in found.values() for each in of.values()), default=0.0), "J")
    headings = ["#", *(quantity(key).axis() for key in curves[0].parameters)] if curves else []
    rows = []
    for curve in known:
        values = [short_value(key, value) for key, value in curve.parameters.items()]
        cells = [_of_interface(found[curve.number].get(name, {}), factor) for name in names]
        rows.append([str(curve.number), *values, *cells])
    return [*headings, *(f"{name} [{unit}]" for name in names)], rows


def _work(entry: Mapping[str, Any]) -> float:
    """Friction work of an interface, J; nodes that stick all the time have none but round-off."""
    return 0.0 if entry.get("sticking") == entry.get("nodes") else entry.get("dissipated_j", 0.0)


def _of_interface(entry: Mapping[str, Any], factor: float) -> str:
    """Friction work and states of an interface: `1.43, 3 stick, 6 slip`; "-" where it is not known."""
    if "dissipated_j" not in entry:
        return "-"
    states = [f"{entry[name]} {said}" for name, said in _STATES.items() if entry[name]]
    return ", ".join([f"{_work(entry) * factor:.3g}", *states])


def static_rows(curves: Sequence[ShownCurve]) -> tuple[list[str], list[list[str]]]:
    """Headings and a row for each curve: static contact of each interface; none with one interface."""
    known = {curve.number: curve.facts.static_contacts for curve in curves if curve.facts and curve.facts.interfaces}
    names = list(dict.fromkeys(name for found in known.values() for name in found))
    headings = ["#", *(quantity(key).axis() for key in curves[0].parameters), *names] if curves else []
    rows = []
    for curve in (curve for curve in curves if known.get(curve.number)):
        values = [short_value(key, value) for key, value in curve.parameters.items()]
        found = known[curve.number]
        cells = [static_text(found[name]) if name in found else "-" for name in names]
        rows.append([str(curve.number), *values, *cells])
    return headings, rows


def interface_lines(curves: Sequence[ShownCurve], width: int, static: bool) -> list[str]:
    """`interface_rows`, and under `static` loads `static_rows`, as lines of text; none with one interface."""
    lines = _lines(INTERFACES_SAID, *interface_rows(curves), width)
    return lines + (_lines(STATIC_SAID, *static_rows(curves), width) if static else [])


def _lines(title: str, headings: Sequence[str], rows: Sequence[Sequence[str]], width: int) -> list[str]:
    """A table with its title as lines of text; none without rows."""
    return [f"{title}:", *table_lines(screen_table(headings, rows, **_SHAPE), width)] if rows else []


def technical_table(curves: Sequence[ShownCurve], static: bool) -> Table:
    """One row a curve: peak of the main branch, static contact where loads act, errors, points, seconds."""
    factor, unit = amplitude_unit(curves)
    sampled = any(curve.facts is not None and curve.facts.sampling_error > 0.0 for curve in curves)
    static = static and not any(curve.facts.interfaces for curve in curves if curve.facts is not None)
    headings = ["#", *(quantity(key).axis() for key in curves[0].parameters), "worst on\nbranch"]
    headings += ["main\npeak [Hz]", f"main\npeak [{unit}]", *("static normal\nforce [N]", "static\nv [µm]") * static]
    headings += [
        "har-\nmonics",
        "trunc.\nerror",
        *("sampling\nerror",) * sampled,
        "energy\nerror",
        "points",
        "seconds",
    ]
    rows = [
        [
            str(curve.number),
            *(short_value(key, value) for key, value in curve.parameters.items()),
            *_technical(curve.facts, factor, sampled, static),
        ]
        for curve in curves
        if curve.facts is not None
    ]
    return screen_table(headings, rows, **_SHAPE)


def _technical(facts: CurveSummary, factor: float, sampled: bool, static: bool) -> list[str]:
    force, _, span = static_cells(facts.static_contact)
    sampling = max(facts.sampling_error, facts.sampling_frequency_error)
    known = math.isfinite(facts.peak_frequency_hz)
    return [
        worst_cells(facts, factor)[2],
        f"{facts.peak_frequency_hz:.6g}{END_MARK * facts.peak_at_end}" if known else "-",
        f"{facts.peak_amplitude_m * factor:.4g}" if known else "-",
        *((force, span) * static),
        str(facts.harmonics),
        truncation_cell(facts.truncation_error, facts.truncation_branch),
        *((share(sampling),) * sampled),
        f"{facts.energy_error:.0e}" if math.isfinite(facts.energy_error) else "-",
        str(facts.points),
        f"{facts.seconds:.2f}",
    ]


def table_lines(table: Table, width: int, console: Console | None = None) -> list[str]:
    """A table as lines of text without spaces at their ends; a console gives them its colours."""
    from rich.console import Console

    console = console or Console(width=width, color_system=None)
    with console.capture() as captured:
        console.print(table)
    return [line.rstrip() for line in captured.get().splitlines()]


def wrapped(lines: Iterable[str], width: int) -> list[str]:
    """Lines of text, broken between words where they are longer; no path is broken."""
    shape: dict[str, Any] = {"subsequent_indent": "  ", "break_long_words": False, "break_on_hyphens": False}
    return [textwrap.fill(line, width, **shape) for line in lines]


def _motion(facts: CurveSummary | None, factor: float) -> tuple[str, str]:
    """Height of a curve, with its mark, and its frequency."""
    if facts is None or not math.isfinite(facts.height):
        return "-", "-"
    known = math.isfinite(facts.worst_amplitude_m)
    at = facts.worst_frequency_hz if known else facts.peak_frequency_hz
    least = ">= " * (not facts.worst_unstable and (not known or bool(facts.worst_unresolved) or facts.at_end))
    return f"{least}{facts.height * factor:.4g}", f"{at:.1f}" if at >= 100.0 else f"{at:.4g}"


def _mean(facts: CurveSummary | None, factor: float) -> str:
    return "-" if facts is None or not math.isfinite(facts.mean_m) else f"{abs(facts.mean_m) * factor:.4g}"


def _static(curve: ShownCurve) -> StaticContact | None:
    return None if curve.facts is None else curve.facts.static_contact


def _remarks(curve: ShownCurve, factor: float, compared: str) -> Iterator[str]:
    """What a reader must know of the number of a curve, in words; the most important first."""
    facts = curve.facts
    if facts is None:
        yield curve.reason if curve.waits else f"FAILED: {curve.reason}"
        return
    if not facts.complete:
        yield f"INCOMPLETE: {curve.reason}"
    if compared:
        yield compared
    if "grows" in facts.worst_open_kinds:
        yield "FLUTTER, can grow without bound"
    elif facts.at_end:
        yield "end of the range, no peak; may be higher"
    elif facts.worst_unstable:
        yield UNSTABLE_SAID
    elif facts.worst_unresolved:
        yield f"{'NOT SETTLED, ' * ('effort' in facts.worst_open_kinds)}may be higher"
    elif not math.isfinite(facts.worst_amplitude_m):
        yield "peak of the response curve; the worst motion is not known"
    yield from _beside_peak(facts, factor)
    if number_error(facts) > TRUNCATION_TOLERATED:
        yield f"too few harmonics: truncation error {share(number_error(facts))}"
    elif facts.truncation_branch in ("detached", "lost"):
        yield {"detached": "on a detached branch with more harmonics", "lost": "truncation error not known"}[
            facts.truncation_branch
        ]
    if (error := max(facts.sampling_error, facts.sampling_frequency_error)) > TOLERATED_SAMPLING:
        yield f"sampling error {share(error)}"
    if has_bounds(facts):
        low, high = (f"{bound * factor:.4g}" for bound in (facts.residual_lowest_m, facts.residual_highest_m))
        yield f"peak {low} to {high} by residual tractions"


def _beside_peak(facts: CurveSummary, factor: float) -> Iterator[str]:
    """Kind of the worst motion, and the peak of the response curve where that says something else."""
    worst, peak, settled = facts.worst_amplitude_m, facts.peak_amplitude_m, not facts.worst_unresolved
    if settled and facts.worst_motion not in ("", "periodic"):
        yield facts.worst_motion
    if facts.worst_branch > 0:
        yield f"detached branch {facts.worst_branch}"
    elif facts.worst_branch < 0 and math.isfinite(worst):
        solved = facts.worst_truncation_error > 0.0
        yield f"neighbouring blades move differently{' (time integration)' * (not solved)}"
    if worst > NOTICEABLE * peak:
        yield f"{'the response curve alone peaks at' if settled else 'peak only'} {peak * factor:.4g}"
    elif worst * NOTICEABLE < peak:
        yield f"peak {peak * factor:.4g} is unstable"


def lowest(curves: Sequence[ShownCurve]) -> BestDesign | str:
    """The design whose highest motion over the conditions is lowest, or why it is not known."""
    return best_design([DesignPoint(c.parameters, c.height, c.closed) for c in curves])


def lowest_line(curves: Sequence[ShownCurve]) -> str:
    """The best design, its ratio to the free blade, and what to do next; of a single curve its worst motion."""
    if not any(math.isfinite(c.height) for c in curves):
        return ""
    best, factor_unit = lowest(curves), amplitude_unit(curves)
    if len(curves) == 1:
        curve = curves[0]
        least = "" if curve.closed else "at least "
        text = f"worst motion: {least}{_height(curve, factor_unit)}{_below_free(curve, factor_unit)}"
        return f"{text}; compare values with [sweep] or shroud optimise"
    swept, so_far = curves[0].parameters, " so far" * any(c.waits for c in curves)
    if not compares_designs(swept):
        return _highest_line(curves, factor_unit, so_far)
    if isinstance(best, str):
        return f"{'best design' if condition_keys(swept) else 'lowest'}{so_far}: {best}"
    shown, mildest = curves[best.highest], curves[best.lowest]
    height = f"{_height(shown, factor_unit)}{_below_free(shown, factor_unit)}"
    if condition_keys(swept):
        at = values_label(shown.parameters, design=False)
        parts = [f"best design{so_far}: {values_label(shown.parameters, design=True)}, at most {height}, with {at}"]
        parts.append(f"lowest of single curves: {mildest.label}, {_height(mildest, factor_unit)}")
    else:
        parts = [f"lowest{so_far}: {shown.label}, {height}"]
        lower = [c.number for c in curves if not c.closed and c.height < shown.height]
        parts += [f"perhaps lower, but not settled: {listed(lower)}"] * bool(lower)
    if not so_far:
        parts.insert(1, _end_of_sweep(shown, best.design, curves) or "refine with shroud optimise")
    return "; ".join(parts)


def _highest_line(curves: Sequence[ShownCurve], factor_unit: tuple[float, str], so_far: str) -> str:
    """The highest curve where conditions alone are swept, of which none is best."""
    highest = max((c for c in curves if math.isfinite(c.height)), key=lambda c: c.height)
    least = "at least " * (not all(c.closed for c in curves))
    height = f"{least}{_height(highest, factor_unit)}{_below_free(highest, factor_unit)}"
    return f"highest over the conditions{so_far}: {highest.label}, {height}; compare designs with shroud optimise"


def _end_of_sweep(best: ShownCurve, design: Mapping[str, Any], curves: Sequence[ShownCurve]) -> str:
    """What to do where a design has the smallest or largest value of the one number that is swept; "" elsewhere."""
    keys, values = list(design), list(design.values())
    if len(values) != 1 or not isinstance(values[0], int | float):
        return ""
    numbers = sorted({curve.parameters[keys[0]] for curve in curves})
    if len(numbers) <= 2 or values[0] not in (min(numbers), max(numbers)):
        return ""
    linear = {max(numbers): STUCK, min(numbers): FREE}[values[0]]
    if keys == ["contact.interference"] and best.contact == linear:
        return f"end of the sweep; the contact {CONTACT_SAID[linear]}, and going further changes nothing"
    return "end of the sweep, go further"


def _height(curve: ShownCurve, factor_unit: tuple[float, str]) -> str:
    return f"{curve.height * factor_unit[0]:.4g} {factor_unit[1]}"


def _below_free(curve: ShownCurve, factor_unit: tuple[float, str]) -> str:
    """How far a curve is below the free blade."""
    if not curve.free_blade_m or not curve.height > curve.mean:
        return ""
    ratio = curve.free_blade_m / (curve.height - curve.mean)
    vibration = f"vibration {(curve.height - curve.mean) * factor_unit[0]:.4g}, " * bool(curve.mean)
    below = f"{float(f'{ratio:.2g}'):g} times below" if ratio >= 1.05 else "no lower than"
    return f" ({vibration}{below} the free blade)"


def open_lines(
    summary: Mapping[str, Any], curves: Sequence[ShownCurve], search: str | None, details: str = ""
) -> Iterator[str]:
    """What was left open, with the response.search of the curves, and what the numbers do not include."""
    waiting = [c.number for c in curves if c.waits]
    failed = [c.number for c in curves if not c.waits and (c.facts is None or not c.facts.complete)]
    parts = [f"{NOT_COMPUTED}: {listed(waiting)}"] * bool(waiting) + [f"not complete: {listed(failed)}"] * bool(
        failed
    )
    open_ = [c for c in curves if not c.closed and c.number not in (*waiting, *failed)]
    if open_:
        more = any(c.facts and "effort" in c.facts.worst_open_kinds for c in open_)
        which = "them" if len(open_) > 1 else "it"
        hint = f' (response.search = "thorough" may settle {which})' * (more and search in ("quick", "standard"))
        parts.append(f"not settled: {listed([c.number for c in open_])}{hint}")
    if parts:
        yield "; ".join(parts)
    left = list(_not_included(summary))
    parts = [f"not included: {', '.join(left)}"] * bool(left) + [f"details: {details}"] * bool(details)
    if parts:
        yield "; ".join(parts)


def _not_included(summary: Mapping[str, Any]) -> Iterator[str]:
    if "mistuning" not in summary.get("studies", {}):
        yield "mistuning"
    models = summary.get("models", ())
    if any(model.get("mesh") is not None for model in models):
        yield "mesh error (shroud verify)"
    if said := coriolis_said(models, TRUNCATION_TOLERATED):
        yield f"Coriolis forces ({said})"
    if (accuracy := summary.get("accuracy")) is not None:
        expected, found = accuracy["expected_error"]["peak_amplitude"], measured_errors(models) or (0.0,)
        said = f"{share(expected)} of a peak of the default blade"
        if found[0] > expected:
            said += f"; here the modes left out alone change a receptance by {share(found[0])}"
        yield f'accuracy "{accuracy["preset"]}" ({said})'


def lines_of(summary: Mapping[str, Any]) -> list[str]:
    """The lines above the table."""
    subject = summary.get("subject")
    if subject is None:  # written by an earlier version
        return []
    modes = modes_line(summary.get("linear", ()), subject["frequency_hz"])
    return [heading(subject), *([modes] if modes else [])]

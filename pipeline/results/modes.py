"""What is known of a scene before its response: natural frequencies of its waves, crossings, static contact.

Frequencies with free and with stuck shrouds enclose those of any linear springs between (Rayleigh). The frequency
range that is proposed holds both of the modes that the force excites in the present range, or of the first one.
`shroud modes` and `shroud run --until reduce` print the tables.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.codec import plain
from pipeline.errors import reason_of
from pipeline.results.contact_advice import ContactAdvice, stored_advice
from pipeline.results.frequency_range import proposed_range, stored_resonances
from pipeline.results.tables import screen_table
from pipeline.scene.dotted_keys import NO_INTERFACE
from pipeline.scene.labels import member_label
from pipeline.stages.cache_keys import contact_inputs, modal_inputs, stiffness_inputs
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.stages.engine_orders import excited_orders
from pipeline.stages.model.flutter import LinearFlutter, stored_flutter
from pipeline.stages.model.natural_frequencies import stored_frequencies
from pipeline.stages.scene_to_solver import STATES
from pipeline.store.disk_errors import StorageError
from pipeline.store.fingerprints import fingerprint

if TYPE_CHECKING:
    from rich.table import Table

    from pipeline.scene.reading import Member
    from pipeline.scene.schema import Scene
    from pipeline.stages.model.model_chain import BuiltModel
    from pipeline.stages.model.sweep_models import Models
    from pipeline.stages.request import Run
    from pipeline.store.content_store import Store

MOST = 40  # members of a sweep whose static contact is computed, evenly spread
KIND, FILE = "static-contact", "static.json"


@dataclass(frozen=True)
class NamedMode:
    """One mode of a wave with free, sliding and stuck shrouds."""

    number: int  # from 1, by ascending frequency
    frequency_hz: tuple[float, float, float]
    names: tuple[str, str, str]  # by shape; "" where shapes are not known
    in_range: bool  # whether a part of free to stuck lies in the frequency range of the response
    speeds_rpm: tuple[float, float] | None  # at which the engine order meets free and stuck; None for order 0
    margin: float | None  # of free to stuck from the excitation frequency, relative to that; None at rest


@dataclass(frozen=True)
class WaveModes:
    """The lowest modes of the wave of one engine order."""

    engine_order: int
    nodal_diameter: int
    wave: str  # "backward", "forward" or "standing"
    range_hz: tuple[float, float]  # frequency range of the response
    excitation_hz: float | None  # EO n / 60 at a steady speed; None at rest
    modes: tuple[NamedMode, ...]


@dataclass(frozen=True)
class StaticCase:
    """Contact of one member of a sweep in static equilibrium at speed, before the excitation acts."""

    label: str  # its swept keys
    interface: str  # its name; "" where there is one
    force_n: float  # normal force of the interface, N
    open_share: float  # share of the interface that is open
    lowest_m: float  # smallest and largest v = v0 + d_n of the nodes, m: above 0 pressed together, below 0 a gap
    highest_m: float
    size_m: float | None = None  # of the body; None: not known

    @property
    def warning(self) -> str:
        """What is wrong where the body moves further than it is large; empty otherwise."""
        motion = max(abs(self.lowest_m), abs(self.highest_m))
        if self.size_m is None or motion <= self.size_m:
            return ""
        told = (
            f"{self.label}: a contact is {motion:.3g} m open in the static state, the body {self.size_m:.3g} m large"
        )
        return f"{told}: nothing holds the body there; its loads must press the contact together"


@dataclass(frozen=True)
class ModelModes:
    """What is known of one reduced model with one contact stiffness and its engine order."""

    label: str  # swept keys of the first member that has it
    speed_rpm: float
    n_blades: int | None
    waves: tuple[WaveModes, ...]  # of the engine order and its multiples that are excited
    static: tuple[StaticCase, ...]
    proposed_hz: tuple[float, float] | None  # frequency range; None where nothing is excited
    flutter: LinearFlutter | None = None  # damping of all waves in the flow; None without [aero]
    coriolis: bool = False  # whether the frequencies include Coriolis forces, as the response does
    helps: tuple[str, ...] = ()  # what helps with the contacts, a line each


def modes_of_scene(run: Run, models: Models, problems: list[str]) -> list[ModelModes]:
    """The modes of the reduced models of a run; what cannot be computed goes to `problems`."""
    members = [member for member in run.request.scene.members if models[member.index] is not None]
    shown = {member.index for member in members[:: max(1, -(-len(members) // MOST))]}
    groups: dict[str, list[Member]] = {}
    for member in members:
        groups.setdefault(_case(member.scene, models[member.index]), []).append(member)
    found = []
    for group in groups.values():
        first, model = group[0], models[group[0].index]
        assert model is not None
        try:
            chosen = [member for member in group if member.index in shown]
            static = [case for member in chosen for case in static_cases(run.store, model, member)]
            found.append(_model_modes(run, model, first, static))
        except StorageError:
            raise
        except Exception as error:  # the models stand without them
            problems.append(f"modes: {reason_of(error)}")
    return found


def _case(scene: Scene, model: BuiltModel | None) -> str:
    """What the natural frequencies of a member and their damping in the flow depend on."""
    assert model is not None
    inputs = {"model": model.key, "springs": stiffness_inputs(scene), "waves": excited_orders(scene)}
    return fingerprint(inputs if scene.aero is None else {**inputs, "modal": modal_inputs(scene)})


def _model_modes(run: Run, model: BuiltModel, member: Member, static: Sequence[StaticCase]) -> ModelModes:
    scene, store = member.scene, run.store
    advice = advice_of(run, model, member)
    values = [
        (order, limits, stored_frequencies(store, model, scene, order)) for order, limits in excited_orders(scene)
    ]
    return ModelModes(
        member_label(member),
        scene.load.speed_rpm,
        values[0][2]["n_blades"],
        tuple(_wave(order, limits, found, scene.load.speed_rpm) for order, limits, found in values),
        tuple(static),
        proposed_range(stored_resonances(store, model.key, scene, model.rom), scene.response.frequency),
        stored_flutter(store, model, scene),
        values[0][2]["coriolis"],
        tuple(advice.lines(scene)),
    )


def advice_of(run: Run, model: BuiltModel, member: Member) -> ContactAdvice:
    """What helps with the contacts of a member."""
    from pipeline.scene.reading import derived_member

    def derived(given: Mapping[str, Any]) -> Scene:
        values = {**member.parameters, **given}
        return derived_member(run.request.scene, values, "modes", run.request.rom is not None).scene

    return stored_advice(run.store, model, member.scene, derived)


def _wave(order: int, limits: tuple[float, float], found: dict[str, Any], speed_rpm: float) -> WaveModes:
    from rom.cyclic.resonance_crossings import excited_nodal_diameter, signed_distance, wave_direction

    excitation = order * speed_rpm / 60.0 if order and speed_rpm else None
    modes = []
    unnamed = [""] * len(found["free_hz"])
    hertz = zip(*(found[f"{state}_hz"] for state in STATES), strict=True)
    names = zip(*(found.get(f"{state}_names", unnamed) for state in STATES), strict=True)
    for number, (hz, called) in enumerate(zip(hertz, names, strict=True), start=1):
        inside = hz[0] <= limits[1] and hz[2] >= limits[0]
        speeds = (60.0 * hz[0] / order, 60.0 * hz[2] / order) if order else None
        margin = None if excitation is None else signed_distance((hz[0], hz[2]), (excitation, excitation))
        modes.append(NamedMode(number, hz, called, inside, speeds, margin))
    blades = found["n_blades"]
    where = excited_nodal_diameter(order, blades), wave_direction(order, blades)
    return WaveModes(order, *where, limits, excitation, tuple(modes))


def static_cases(store: Store, model: BuiltModel, member: Member) -> list[StaticCase]:
    """The static contact of a member by interface, from the store or computed."""
    scene = member.scene
    response, load = scene.response.model_dump(), scene.load.model_dump(exclude={"coriolis"})
    sections = {"response": response, "load": load, **contact_inputs(scene)}
    material = scene.material.model_dump() if scene.material else None
    key = fingerprint({"reduce": model.key, **sections, "material": material, "code": code_fingerprint(__name__)})
    entry = store.get(KIND, key, lambda folder: _write_static(folder / FILE, model.rom, scene))
    found = json.loads(entry.file(FILE).read_text(encoding="utf-8"))
    return [StaticCase(member_label(member), **each) for each in found]


def _write_static(path: Path, rom: Path, scene: Scene) -> None:
    import numpy as np

    from nonlinear.harmonic_balance.initial_solution import static_contact
    from pipeline.stages.scene_to_solver import contact_on_model, scene_modes, size_of_body, solver_options
    from rom.files.reduced_model_file import read_reduced_model
    from rom.linear_algebra.threads import one_blas_thread

    model, found, first = read_reduced_model(rom, with_basis=False), [], 0
    with one_blas_thread():
        problem = scene_modes(scene, model), contact_on_model(scene, model), solver_options(scene)
        size = size_of_body(scene, model)
        known = size if math.isfinite(size) else None
        for name, count in model.interfaces.items():
            values = plain(static_contact(*problem, np.arange(first, first + count)))
            del values["opened"]
            said = {"interface": name if len(model.interfaces) > 1 else "", "size_m": known}
            found += [] if name == NO_INTERFACE else [{**said, **values}]
            first += count
    path.write_text(json.dumps(found), encoding="utf-8")


ROWS = 6  # modes of a wave that the table shows, or more that are in the frequency range
MOST_MODELS = 8  # reduced models of a sweep that have tables


_TRAVELS = {"backward": " (travels against the rotation)", "forward": " (travels with the rotation)"}


def wave_heading(model: ModelModes, wave: WaveModes, several: bool) -> str:
    """The model where there are several, engine order, wave, speed."""
    parts = [model.label] if several else []
    if model.n_blades is not None:
        parts.append(f"{model.n_blades} blades, EO {wave.engine_order}: nodal diameter {wave.nodal_diameter}")
        parts.append(f"{wave.wave} wave{_TRAVELS.get(wave.wave, '')}")
    at = f"{model.speed_rpm:g} rev/min"
    parts.append(at if wave.excitation_hz is None else f"{at}: excitation at {wave.excitation_hz:.4g} Hz")
    return ", ".join(parts)


def wave_table(wave: WaveModes) -> Table:
    """One row a mode: frequencies with names for free, sliding and stuck shrouds, speeds of resonance, margin."""
    headings = ["mode", *(f"{state} [Hz]" for state in STATES), "resonance at [rev/min]", "margin [%]", "in range"]
    rows = []
    shown = max([ROWS, *(mode.number for mode in wave.modes if mode.in_range)])
    for mode in wave.modes[:shown]:
        hertz = [f"{hz:.4g} {name}".rstrip() for hz, name in zip(mode.frequency_hz, mode.names, strict=True)]
        speeds = "-" if mode.speeds_rpm is None else " to ".join(f"{speed:.0f}" for speed in mode.speeds_rpm)
        margin = "-" if mode.margin is None else f"{100.0 * mode.margin:+.0f}"
        rows.append([str(mode.number), *hertz, speeds, margin, "yes" if mode.in_range else "no"])
    return screen_table(headings, rows, box=None)


def flutter_line(flutter: LinearFlutter) -> str:
    """The margin: the least damping of all waves in each contact state."""
    margins = [min(found[place][0] for _, found in flutter.least()) for place in range(len(STATES))]
    said = ", ".join(f"{state} {100.0 * least:+.3g} %" for state, least in zip(STATES, margins, strict=True))
    return f"flutter margin, the least damping of all waves in the flow: {said} (below 0: the motion grows)"


def flutter_table(flutter: LinearFlutter) -> Table:
    """One row a mode: the least damping of its waves in the flow with free, sliding and stuck shrouds, and where."""
    rows = [
        [str(mode), *(f"{100.0 * ratio:+.3g} % at {n:+d}, {hertz:.4g} Hz" for ratio, n, hertz in least)]
        for mode, least in flutter.least()
        if mode <= max(flutter.families) + 1
    ]
    return screen_table(["mode", *(f"{state}: least damping, nodal diameter" for state in STATES)], rows, box=None)


def static_table(cases: Sequence[StaticCase], speed_rpm: float) -> Table:
    """One row a member of the sweep and interface: static contact, before the excitation acts."""
    title = f"static contact, {speed_rpm:g} rev/min"
    rows = []
    for case in cases:
        ends = (1e6 * case.lowest_m, 1e6 * case.highest_m)
        ends_said = " to ".join(dict.fromkeys(f"{value:.4g}" for value in ends))
        label = f"{case.label}, {case.interface}" if case.interface else case.label
        rows.append([label, f"{case.force_n:.4g}", f"{100.0 * case.open_share:.3g}", ends_said])
    return screen_table([title, "normal force [N]", "open [%]", "v [µm]"], rows, (title,), box=None)


def range_line(model: ModelModes) -> str:
    """The frequency range that is proposed."""
    if model.proposed_hz is None:
        return "response.frequency: the force excites none of these modes"
    proposed, present = (f"[{low:g}, {high:g}]" for low, high in (model.proposed_hz, model.waves[0].range_hz))
    return f"response.frequency = {present}; suggested: {proposed}, covers the excited modes from free to stuck"


def table_notes(models: Sequence[ModelModes]) -> list[str]:
    """What the headings of the tables mean, a line each; once below all tables."""
    waves = [wave for model in models for wave in model.waves]
    named = any(name for wave in waves for mode in wave.modes for name in mode.names)
    lines = ["1F, 1E, 1T, 1R, 1D: first flap, edge, torsion, radial, disk mode, named by shape"] * named
    if any(len({*mode.names}) > 1 for wave in waves for mode in wave.modes):
        lines.append("different names in a row: modes change their order from free to stuck shrouds")
    if any(mode.speeds_rpm for wave in waves for mode in wave.modes):
        speeds = {model.speed_rpm for model in models}
        at = f"at {next(iter(speeds)):g} rev/min" if len(speeds) == 1 else "at the speed of its table"
        lines.append(f"resonance at: speeds where EO meets the free and the stuck frequency, with the stiffness {at}")
    if any(wave.excitation_hz for wave in waves):
        included = any(model.coriolis for model in models)
        lines += ["frequencies include Coriolis forces, as the response does"] * included
        lines.append("margin: distance of the excitation from the nearest of free and stuck; 0: it lies between them")
    lines += ["open: share of the contact; v: overlap left under static load, negative: gap"] * bool(models)
    return lines


def crossing_lines(campbell: Sequence[dict[str, Any]]) -> list[str]:
    """Where the engine order meets modes over the speeds of the sweep."""
    return [
        f"EO {each['engine_order']} meets mode {each['mode']} with {each['contact']} shrouds at "
        f"{each['speed_rpm']:.0f} rev/min, {each['frequency_hz']:.4g} Hz"
        for each in campbell
    ]


def left_out(models: Sequence[ModelModes]) -> str:
    """A line on models without a table; empty where there are none."""
    rest = len(models) - MOST_MODELS
    return f"... {rest} more reduced models, in modes.json" if rest > 0 else ""

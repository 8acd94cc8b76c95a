"""Whether a run can show its resonances: a frequency range that holds them, a force that excites them."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.codec import plain, restored
from pipeline.results.resonances import FREE, STUCK, Resonance, modes_about, resonances_of_problem
from pipeline.scene.contact_section import FaceField
from pipeline.stages.cache_keys import modal_inputs, stiffness_inputs
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.store.fingerprints import fingerprint

if TYPE_CHECKING:
    from pipeline.scene.contact_section import Contact
    from pipeline.scene.reading import Member
    from pipeline.scene.schema import Scene
    from pipeline.store.content_store import Store

ROOM = 0.05  # part of a frequency by which the proposed range goes beyond it
NAMED = 4  # resonances in a line
MOST = 100  # members of a sweep that are looked at, evenly spread
KIND, FILE = "resonances", "resonances.json"

_HELD_FROM = 20.0  # free over stuck: the force at the point works on 5 % of what it does in the free mode


def missing_warnings(members: Sequence[Member], resonances: Callable[[Member], Sequence[Resonance]]) -> list[str]:
    """A line for each frequency range of a sweep that leaves out resonances between which peaks of its curves lie."""
    found: dict[tuple[float, float], dict[tuple[str, int, str], Resonance]] = {}
    step = -(-len(members) // MOST)
    for member in members[::step]:
        for each in missing(member.scene, resonances(member)):
            name = each.state, each.engine_order, f"{each.frequency_hz:.4g}"
            found.setdefault(member.scene.response.frequency, {}).setdefault(name, each)
    return [missing_said(limits, list(outside.values())) for limits, outside in found.items()]


def missing_said(limits: tuple[float, float], outside: Sequence[Resonance]) -> str:
    """The line on resonances outside a frequency range (Hz), with the range that would hold them."""
    outside = sorted(outside, key=lambda each: each.frequency_hz)
    named = [f"{each.frequency_hz:.4g} Hz ({each.state}, engine order {each.engine_order})" for each in outside]
    if len(named) > NAMED:
        named = [*named[:2], "...", *named[-2:]]
    low = min(limits[0], _rounded(outside[0].frequency_hz * (1.0 - ROOM), math.floor))
    high = max(limits[1], _rounded(outside[-1].frequency_hz * (1.0 + ROOM), math.ceil))
    several = len(outside) > 1
    return (
        f"response.frequency, {limits[0]:g} to {limits[1]:g} Hz, leaves out the resonance{'s' * several} at "
        f"{', '.join(named)}: peaks may lie outside, and the end of the range is no peak; "
        f"[{low:g}, {high:g}] holds {'them' if several else 'it'}"
    )


def missing(scene: Scene, resonances: Sequence[Resonance]) -> list[Resonance]:
    """Resonances outside the frequency range between which peaks lie that the range is about.

    With a gap everywhere a peak begins at the free resonance, with an interference everywhere at the stuck one; else
    at either. A natural frequency counts where the range holds a part of the way from its free to its stuck value;
    where it holds nothing of any, the first one that is excited counts.
    """
    low, high = scene.response.frequency
    states = dict.fromkeys(state for face in scene.contacts.values() for state in contact_states(face))
    about = modes_about(resonances, (low, high))
    ends = (way[state] for way in about for state in states if state in way)
    return [end for end in ends if not low <= end.frequency_hz <= high]


def proposed_range(resonances: Sequence[Resonance], limits: tuple[float, float]) -> tuple[float, float] | None:
    """The frequency range, Hz, from free to stuck contacts of the modes that the range `limits` is about.

    None where the excitation moves no mode.
    """
    about = modes_about(resonances, limits)
    if not about:
        return None
    low = min(way.get(FREE, way[STUCK]).frequency_hz for way in about) * (1.0 - ROOM)
    high = max(way[STUCK].frequency_hz for way in about) * (1.0 + ROOM)
    return _rounded(low, math.floor), _rounded(high, math.ceil)


def linear_modes(
    members: Sequence[Member], resonances: Mapping[int, Sequence[Resonance]]
) -> tuple[list[dict[str, Any]], dict[int, float]]:
    """The modes that the range is about, and the amplitude of the free blade at its resonance, m, of each member.

    `resonances` and the amplitudes by index of the member. Entries of `linear` in summary.json, one for each engine
    order and mode: least and largest frequency with free and with stuck shrouds over the members.
    """
    found: dict[tuple[int, int], dict[str, Any]] = {}
    free_m = {}
    for member in members:
        about = modes_about(resonances[member.index], member.scene.response.frequency)
        if any(FREE in way for way in about):
            free_m[member.index] = max(way[FREE].amplitude_m for way in about if FREE in way)
        for way in about:
            order, mode = way[STUCK].engine_order, way[STUCK].number
            entry = found.setdefault((order, mode), {"engine_order": order, "mode": mode})
            for state, end in way.items():
                hertz = [end.frequency_hz, *entry.get(f"{state}_hz", ())]
                entry[f"{state}_hz"] = [min(hertz), max(hertz)]
    return list(found.values()), free_m


def held_said(worst: float | None) -> str:
    """That stuck shrouds hold the loaded point, from `HELD` of a model, and what helps; "" where they do not."""
    if worst is None or worst < _HELD_FROM:
        return ""
    return (
        "excitation.at: with stuck shrouds the loaded point hardly moves: a force there excites the first stuck mode "
        f"{_times(worst)} times less than the free one; load the airfoil instead, as gas does: [[excitation.load]] "
        'with surface = "pressure_side"'
    )


def _times(ratio: float) -> str:
    """A ratio with two digits, never with a power of ten."""
    return f"{float(f'{ratio:.2g}'):.10g}"


def contact_states(contact: Contact) -> tuple[str, ...]:
    """The linear states that curves with these contacts come near to."""
    given = contact.interference
    listed = given.ends if isinstance(given, FaceField) else given
    values = [float(value) for value in (listed if isinstance(listed, tuple | list) else (listed,))]
    if contact.preload:
        return (STUCK,)
    states = [FREE] * (min(values) <= 0.0) + [STUCK] * (max(values) >= 0.0)
    return tuple(states)


def resonance_key(reduced_model: str, scene: Scene) -> str:
    """Key in the store of the resonances of a scene on a reduced model."""
    return fingerprint(
        {
            "reduce": reduced_model,
            "excitation": scene.excitation.model_dump(),
            "modal": modal_inputs(scene),
            "stiffness": stiffness_inputs(scene),
            "material": scene.material.model_dump() if scene.material else None,
            "code": code_fingerprint(__name__),
        }
    )


def stored_resonances(store: Store, reduced_model: str, scene: Scene, rom: Path | None) -> list[Resonance]:
    """The resonances in the store; computed on the reduced model `rom` where they are not there, none without one."""
    key = resonance_key(reduced_model, scene)
    if rom is None:
        entry = store.find(KIND, key)
    else:
        entry = store.get(KIND, key, lambda folder: _write(folder / FILE, rom, scene))
    values = [] if entry is None else json.loads(entry.file(FILE).read_text(encoding="utf-8"))
    found: list[Resonance] = [restored(Resonance, item) for item in values]
    return found


def _write(path: Path, rom: Path, scene: Scene) -> None:
    path.write_text(json.dumps(plain(resonances_of(rom, scene))), encoding="utf-8")


def resonances_of(rom: Path, scene: Scene) -> list[Resonance]:
    """First resonances of a reduced model with free and with stuck contacts, for every excited harmonic."""
    from pipeline.stages.scene_to_solver import contact_on_model, excitation, scene_modes
    from rom.files.reduced_model_file import read_reduced_model

    model = read_reduced_model(rom, with_basis=False)
    problem = scene_modes(scene, model), contact_on_model(scene, model), excitation(scene)
    return resonances_of_problem(model, problem, scene.excitation.engine_order)


def _rounded(frequency_hz: float, towards: Callable[[float], int]) -> float:
    """A frequency with two digits, rounded in one direction."""
    unit = 10.0 ** (math.floor(math.log10(frequency_hz)) - 1)
    return float(f"{towards(frequency_hz / unit) * unit:.6g}")

"""Resonances of the linear structure with free and with stuck contacts, and those that a frequency range is about."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nonlinear.contact.parameters import ContactParameters
    from nonlinear.options import Excitation
    from rom.cyclic.reduced_model import ReducedModel
    from rom.cyclic.sector_modes import RingModes

FREE, STUCK = "free", "stuck"
COUNT = 10  # natural frequencies of each state that are looked at
EXCITED = 0.05  # of the highest resonance: lower ones are not excited


@dataclass(frozen=True)
class Resonance:
    """A resonance of the linear structure with free or stuck contacts under one harmonic of the excitation.

    `number` counts the natural frequencies of its wave: whatever the contacts do, that of a number lies between its
    free and its stuck value. `frequency_hz` is the excitation frequency, `amplitude_m` that of the output there.
    """

    state: str
    engine_order: int
    number: int
    frequency_hz: float
    amplitude_m: float


def modes_about(resonances: Sequence[Resonance], limits: tuple[float, float]) -> list[dict[str, Resonance]]:
    """Free and stuck resonance of each excited mode that has a part in a range, Hz; else of the first excited one.

    A blade that contacts alone hold has stuck ones only.
    """
    strongest = max((each.amplitude_m for each in resonances), default=0.0)
    ways: dict[tuple[int, int], dict[str, Resonance]] = {}
    states = len({each.state for each in resonances})
    for each in resonances:
        ways.setdefault((each.engine_order, each.number), {})[each.state] = each
    excited = {
        key: way
        for key, way in ways.items()
        if len(way) == states and max(each.amplitude_m for each in way.values()) >= EXCITED * strongest > 0.0
    }
    low, high = limits
    about = [
        way
        for way in excited.values()
        if way.get(FREE, way[STUCK]).frequency_hz <= high and way[STUCK].frequency_hz >= low
    ]
    return about or [excited[key] for key in sorted(excited)[:1]]


def resonances_of_problem(
    model: ReducedModel, problem: tuple[RingModes, ContactParameters, Excitation], engine_order: int
) -> list[Resonance]:
    """First resonances with free and with stuck contacts, for every excited harmonic."""
    from rom.cyclic.natural_frequencies import gyroscopic_frequencies, linear_response, natural_frequencies
    from rom.cyclic.receptance import RelativeReceptance

    modal, contact, wave = problem
    phase = modal.phase(wave.engine_order)
    given: dict[str, Any] = {"phase": phase, "force": wave.force, "harmonic_factors": wave.factors}
    springs = {"normal": contact.normal_stiffness, "tangential": contact.tangential_stiffness}
    states: dict[str, dict[str, Any]] = {FREE: {}, STUCK: springs}
    frequencies = gyroscopic_frequencies if modal.turns else natural_frequencies
    found = []
    receptance = RelativeReceptance(modal, phase, (1,), wave.force, wave.factors)
    if receptance.pushes_floating_bodies:
        del states[FREE]
    for h in receptance.excited_harmonics:
        for state, stiffness in states.items():
            own = frequencies(model, h * phase, count=min(COUNT, model.size), **stiffness) / h
            amplitude = abs(linear_response(modal, own, harmonic=h, **given, **stiffness))
            order = h * engine_order
            found += [
                Resonance(state, order, number, float(hz), float(height))
                for number, (hz, height) in enumerate(zip(own, amplitude, strict=True), start=1)
                if hz > 0.0
            ]
    return found

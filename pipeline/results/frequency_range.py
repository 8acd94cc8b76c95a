"""Whether a run can show a resonance: a natural frequency in the range, a force that excites it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pipeline.scene.schema import Scene
from pipeline.stages.modal_truncation import HELD
from pipeline.stages.request import RunOutcome

_HELD_FROM = 20.0  # free over stuck: the force at the point works on 5 % of what it does in the free mode


def range_warning(outcome: RunOutcome, scene: Scene) -> str:
    """A line where no natural frequency, free, sliding or stuck, lies in the frequency range; otherwise empty.

    Such a curve has no resonance, which is seldom what the range was chosen for.
    """
    low, high = scene.response.frequency
    known = [hz for model in outcome.models for hz in _natural_frequencies(model)]
    if not known or any(low <= hz <= high for hz in known):
        return ""
    below = max((hz for hz in known if hz < low), default=None)
    above = min((hz for hz in known if hz > high), default=None)
    nearest = " and ".join(f"{hz:.6g} Hz" for hz in (below, above) if hz is not None)
    return f"no natural frequency lies in response.frequency, {low:g} to {high:g} Hz; the nearest: {nearest}"


def held_point_warning(outcome: RunOutcome, scene: Scene) -> str:
    """A line where the force acts at a point that stuck shrouds hold, so that it hardly excites them; else empty."""
    worst = max((model[HELD] for model in outcome.models if model.get(HELD) is not None), default=0.0)
    if worst < _HELD_FROM or scene.excitation.load:
        return ""
    return (
        f"excitation.at: the stuck shrouds hold the loaded point, which moves {worst:.2g} times less in their first "
        "mode than in that of the free blade (mode at the force times mode at the output); gas loads act on the "
        'whole airfoil: [[excitation.load]] with surface = "pressure_side" excites the stuck blade too'
    )


def _natural_frequencies(model: dict[str, Any]) -> Iterator[float]:
    """All natural frequencies of an entry of `models` in the summary, Hz."""
    yield from model["free_hz"]
    for state in ("free_at_order_hz", "sliding_hz", "stuck_hz"):
        for values in model.get(state, {}).values():
            yield from values

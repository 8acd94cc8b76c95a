"""Natural frequencies of the ring for the diagrams: shrouds free, sliding on each other, and stuck together."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.data import Array, PlottedCurve

if TYPE_CHECKING:
    from rom import ReducedModel

MODES = 4  # lowest ones that a diagram shows
CLOSE = 0.025  # of the height of the diagram: names nearer than this would overlap
LOOKS: dict[str, dict[str, Any]] = {
    "free": {"color": "0.0", "linestyle": (0, (1, 1.2)), "linewidth": 1.0},
    "sliding": {"color": "#0072B2", "linestyle": (0, (5, 1.5)), "linewidth": 1.2},
    "stuck": {"color": "#D55E00", "marker": "o", "markersize": 2.0, "linewidth": 0.8},
}


def spectrum(
    model: ReducedModel,
    curve: PlottedCurve,
    nodal_diameter: int,
    states: Collection[str] = tuple(LOOKS),
    modes: int = MODES,
) -> dict[str, Array]:
    """Lowest natural frequencies (Hz) by state of the shrouds: normal springs only when sliding, all when stuck."""
    from rom import natural_frequencies

    phase = 0.0 if model.n_blades is None else 2.0 * np.pi * nodal_diameter / model.n_blades
    contact = curve.contact_parameters(model.n_contacts)
    springs: dict[str, dict[str, Array]] = {
        "free": {},
        "sliding": {"normal": contact.normal_stiffness},
        "stuck": {"normal": contact.normal_stiffness, "tangential": contact.tangential_stiffness},
    }
    count = min(modes, model.size)
    return {name: natural_frequencies(model, phase, count=count, **springs[name]) for name in states}


def apart(heights: Array, names: Sequence[str], top: float) -> list[tuple[float, str]]:
    """Names of modes with their heights in a diagram up to `top`; those too near to the last one join it."""
    found: list[tuple[float, str]] = []
    for height, name in zip(heights, names, strict=True):
        if found and height - found[-1][0] < CLOSE * top:
            found[-1] = (0.5 * (found[-1][0] + float(height)), f"{found[-1][1]}, {name}")
        else:
            found.append((float(height), name))
    return found

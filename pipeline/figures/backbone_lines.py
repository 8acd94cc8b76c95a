"""Nonlinear modes as lines: pieces, colours, marks of their contact states."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from pipeline.figures.style import ordered_colours
from pipeline.studies.backbone.backbone_result import BackboneResult, CurveBackbones, ModeBackbone

DASHES = ("-", (0, (5, 1.5)), (0, (1, 1.2)), (0, (6, 1.5, 1, 1.5)))  # by the number of the mode


def pieces(mode: ModeBackbone) -> Iterator[slice]:
    """Parts of a mode between internal resonances."""
    edges = [0, *(np.flatnonzero(np.diff(mode.piece)) + 1).tolist(), len(mode.piece)]
    for start, stop in pairwise(edges):
        if stop > start:
            yield slice(start, stop)


def broken(mode: ModeBackbone, values: np.ndarray) -> np.ndarray:
    """Values (P,) with NaN between the pieces, (P + pieces - 1,): one line that is not joined across them."""
    parts: list[np.ndarray] = []
    for part in pieces(mode):
        parts += [np.array([np.nan]), values[part]] if parts else [values[part]]
    return np.concatenate(parts) if parts else np.empty(0)


def mode_numbers(result: BackboneResult) -> list[tuple[int, int]]:
    """Number and nodal diameter of every mode with points, in their order; -1 stands for the engine order."""
    found = [own_number(curve, mode) for curve in result.curves for mode in curve.modes if len(mode.amplitude_m)]
    return list(dict.fromkeys(found))


def own_number(curve: CurveBackbones, mode: ModeBackbone) -> tuple[int, int]:
    """Number and nodal diameter of a mode; -1 for the engine order of the curve."""
    return mode.number, -1 if mode.nodal_diameter == curve.engine_order else mode.nodal_diameter


def mode_name(number: int, nodal_diameter: int) -> str:
    """`mode 1`, `mode 1, nodal diameter 3`."""
    return f"mode {number}" + ("" if nodal_diameter < 0 else f", nodal diameter {nodal_diameter}")


def curve_colours(curves: Sequence[CurveBackbones]) -> dict[int, Any]:
    """Colours of the curves by their number."""
    return dict(zip([curve.curve for curve in curves], ordered_colours(len(curves)), strict=True))


def contact_changes(mode: ModeBackbone) -> Iterator[tuple[str, int]]:
    """Last points before the first slip and before the first lift-off, where the mode starts in another state."""
    found = {}
    for kind, mask in (("first slip", mode.slipping > 0), ("first lift-off", mode.separating > 0)):
        if len(mask) and not mask[0] and mask.any():
            found[int(np.argmax(mask)) - 1] = kind  # where both begin together: the lift-off
    for at, kind in found.items():
        yield kind, at

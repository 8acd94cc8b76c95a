"""Modes followed over nodal diameters or speeds by their shapes, through crossings and veering.

Modes of neighbouring places belong together where their modal assurance criterion is largest,

    MAC = |a^H b|^2 / (a^H a  b^H b).

Of one model a and b are the modes with the mass as inner product; of models at several speeds, whose reduced
coordinates differ, they are the motions of the airfoil and the contact nodes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.cyclic.mode_families import ModeFamilies
from rom.cyclic.natural_frequencies import natural_modes
from rom.cyclic.reduced_model import ReducedModel

SPARE = 4  # modes beyond those asked for, from which a mode may come down

Shapes = NDArray[Any]


@dataclass(frozen=True)
class FollowedModes:
    """Natural frequencies at K places, nodal diameters or speeds, with the modes followed from place to place."""

    places: NDArray[np.float64]  # (K,) nodal diameters, or speeds in rev/min
    frequency_hz: NDArray[np.float64]  # (K, m) natural frequencies, ascending at each place, Hz
    names: tuple[tuple[str, ...], ...]  # their names by shape, such as 1F; "mode 1" where no shapes are known
    # (K, m) number of the followed mode that each one belongs to: its number at the first place, from 1
    lines: NDArray[np.int64]

    def curves(self) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Places and frequencies of each followed mode."""
        found = []
        for line in np.unique(self.lines):
            place, mode = np.nonzero(self.lines == line)
            found.append((self.places[place], self.frequency_hz[place, mode]))
        return found


def modal_assurance(first: Shapes, second: Shapes) -> NDArray[np.float64]:
    """Modal assurance criterion of each mode of one set with each of another.

    `first`, `second` (r, b): modes as columns, real or complex. Returns (a, b): 0 (orthogonal) to 1 (the same shape).
    """
    squares = [np.maximum(np.sum(np.abs(each) ** 2, axis=0), np.finfo(float).tiny) for each in (first, second)]
    agreement: NDArray[np.float64] = np.abs(first.conj().T @ second) ** 2 / np.outer(*squares)
    return agreement


def follow_modes(shapes: Sequence[Shapes]) -> NDArray[np.int64]:
    """Which mode of each place is which mode of the first place.

    From place to place modes are paired by descending MAC. Two modes that exchange their shapes between two places
    cross; where they do so over several places (veering), each keeps its line, and its shape changes along it.

    `shapes` (r, m): the modes at each place by ascending frequency, in coordinates that are the same at every place.
    Returns (K, m): at place k the mode number i, from 0, is that of number [k, i] at the first place.
    """
    found = [np.arange(shapes[0].shape[1])]
    for first, second in pairwise(shapes):
        agreement, line = modal_assurance(first, second), np.empty_like(found[0])
        for _ in line:
            row, column = np.unravel_index(np.argmax(agreement), agreement.shape)
            line[column] = found[-1][row]
            agreement[row], agreement[:, column] = -1.0, -1.0
        found.append(line)
    return np.array(found)


def modes_over_diameters(
    model: ReducedModel,
    diameters: Sequence[int],
    families: ModeFamilies | None = None,
    *,
    normal: ArrayLike = 0.0,
    tangential: ArrayLike = 0.0,
    count: int = 10,
) -> FollowedModes:
    """Lowest modes of a ring at nodal diameters, named and followed.

    `normal`, `tangential` (n_c,): contact springs, N/m, as in `natural_frequencies`.
    """
    assert model.n_blades is not None
    pitch = 2.0 * np.pi / model.n_blades
    springs: dict[str, Any] = {"normal": normal, "tangential": tangential, "count": min(count + SPARE, model.size)}
    found = [natural_modes(model, pitch * diameter, **springs) for diameter in diameters]
    rows = _observation(model)
    lines = follow_modes([rows @ modes for _, modes in found]) + 1
    return _modes_at(np.array(diameters, dtype=float), found, [families] * len(found), lines, count)


def modes_over_speeds(
    models: Sequence[ReducedModel],
    speeds_rpm: ArrayLike,
    families: Sequence[ModeFamilies | None],
    phase: float,
    *,
    normal: ArrayLike = 0.0,
    tangential: ArrayLike = 0.0,
    count: int = 10,
) -> FollowedModes:
    """Lowest modes of a ring at one nodal diameter over speeds, named and followed.

    `speeds_rpm` (K,): speeds, rev/min, ascending.
    """
    least = min(model.size for model in models)
    springs: dict[str, Any] = {"normal": normal, "tangential": tangential, "count": min(count + SPARE, least)}
    found = [natural_modes(model, phase, **springs) for model in models]
    observed = [
        np.vstack([*([] if rows is None else [rows.airfoil]), model.contact_right]) @ modes
        for model, rows, (_, modes) in zip(models, families, found, strict=True)
    ]
    lines = follow_modes(observed) + 1
    return _modes_at(np.asarray(speeds_rpm, dtype=float), found, families, lines, count)


def _observation(model: ReducedModel) -> NDArray[np.float64]:
    """Rows (r, n) in which modes of several nodal diameters are compared: L^T, with M = L L^T.

    A model with coordinates for each nodal diameter has the contact nodes and the outputs in common.
    """
    if model.wave_blocks:
        return np.vstack([model.contact_right, *model.outputs.values()])
    factor: NDArray[np.float64] = np.linalg.cholesky(model.mass).T.astype(float)
    return factor


def _modes_at(
    places: NDArray[np.float64],
    found: Sequence[tuple[NDArray[np.float64], Shapes]],
    families: Sequence[ModeFamilies | None],
    lines: NDArray[np.int64],
    count: int,
) -> FollowedModes:
    """The lowest `count` of the modes at each place."""
    names = tuple(
        tuple([f"mode {i + 1}" for i in range(count)] if rows is None else rows.names(hz, modes)[0])[:count]
        for rows, (hz, modes) in zip(families, found, strict=True)
    )
    return FollowedModes(places, np.array([hz[:count] for hz, _ in found]), names, lines[:, :count])

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
    """Natural frequencies at K places, nodal diameters or speeds, with the modes followed from place to place.

    Attributes
    ----------
    places : (K,) array
        Nodal diameters, or speeds in rev/min.
    frequency_hz : (K, m) array
        Natural frequencies, ascending at each place, Hz.
    names : tuple of K tuples of str
        Their names by shape, such as 1F; "mode 1" where no shapes are known.
    lines : (K, m) array
        Number of the followed mode that each one belongs to: its number at the first place, from 1.

    Examples
    --------
    >>> from rom import FollowedModes
    >>> names = (("1F", "1T"), ("1T", "1F"))
    >>> modes = FollowedModes(np.array([0.0, 3000.0]), np.array([[90.0, 100.0], [101.0, 120.0]]), names,
    ...                       np.array([[1, 2], [2, 1]]))
    >>> [(places.tolist(), hz.tolist()) for places, hz in modes.curves()]
    [([0.0, 3000.0], [90.0, 120.0]), ([0.0, 3000.0], [100.0, 101.0])]
    """

    places: NDArray[np.float64]
    frequency_hz: NDArray[np.float64]
    names: tuple[tuple[str, ...], ...]
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

    Parameters
    ----------
    first, second : (r, a), (r, b) array
        Modes as columns, real or complex.

    Returns
    -------
    (a, b) array
        0 (orthogonal) to 1 (the same shape).

    Examples
    --------
    >>> from rom import modal_assurance
    >>> modal_assurance(np.eye(2), np.array([[1.0, 1j], [1.0, 0.0]])).round(3).tolist()
    [[0.5, 1.0], [0.5, 0.0]]
    """
    squares = [np.maximum(np.sum(np.abs(each) ** 2, axis=0), np.finfo(float).tiny) for each in (first, second)]
    agreement: NDArray[np.float64] = np.abs(first.conj().T @ second) ** 2 / np.outer(*squares)
    return agreement


def follow_modes(shapes: Sequence[Shapes]) -> NDArray[np.int64]:
    """Which mode of each place is which mode of the first place.

    From place to place modes are paired by descending MAC. Two modes that exchange their shapes between two places
    cross; where they do so over several places (veering), each keeps its line, and its shape changes along it.

    Parameters
    ----------
    shapes : sequence of K (r, m) arrays
        The modes at each place by ascending frequency, in coordinates that are the same at every place.

    Returns
    -------
    (K, m) array
        At place k the mode number i, from 0, is that of number [k, i] at the first place.

    Examples
    --------
    >>> from rom import follow_modes
    >>> turned = lambda x: np.array([[np.cos(x), -np.sin(x)], [np.sin(x), np.cos(x)]])
    >>> follow_modes([turned(0.0), turned(0.1), turned(1.5)]).tolist()
    [[0, 1], [0, 1], [1, 0]]
    >>> follow_modes([turned(0.5 * x) for x in range(4)])[-1].tolist()
    [0, 1]
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

    Parameters
    ----------
    model : ReducedModel
        The reduced model of a ring.
    diameters : sequence of int
        Nodal diameters, ascending.
    families : ModeFamilies, optional
        Rows that name the modes.
    normal, tangential : float or (n_c,) array
        Contact springs, N/m, as in `natural_frequencies`.
    count : int
        Number of modes.

    Returns
    -------
    FollowedModes
        The modes at the nodal diameters.

    Examples
    --------
    Two blades' modes of 100 and 110 rad/s; springs between the tips lift the lower one above the other:

    >>> from rom import ReducedModel, modes_over_diameters
    >>> n, one = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.01]]), np.ones(2)
    >>> model = ReducedModel(
    ...     np.eye(2), np.diag([100.0**2, 110.0**2]), n, np.zeros((1, 3)), one, {"tip": one}, n, n_blades=8)
    >>> modes = modes_over_diameters(model, range(5), normal=2e3, count=2)
    >>> modes.lines.tolist()
    [[1, 2], [1, 2], [2, 1], [2, 1], [2, 1]]
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

    Parameters
    ----------
    models : sequence of K ReducedModel
        The reduced models at the speeds, of the same mesh and contact nodes.
    speeds_rpm : (K,) array
        Speeds, rev/min, ascending.
    families : sequence of K ModeFamilies or None
        Rows that name their modes; without them the modes are told apart by the motion of the contact nodes alone.
    phase, normal, tangential, count
        As in `natural_frequencies`.

    Returns
    -------
    FollowedModes
        The modes at the speeds.

    Examples
    --------
    A flap mode that speed stiffens passes an edge mode:

    >>> from rom import ModeFamilies, ReducedModel, modes_over_speeds
    >>> n, one = np.zeros((3, 2)), np.ones(2)
    >>> models = [ReducedModel(np.eye(2), np.diag([w**2, 1e4]), n, np.zeros((1, 3)), one, {"tip": one})
    ...           for w in (90.0, 99.0, 108.0)]
    >>> rows = ModeFamilies(np.vstack([np.eye(2), np.zeros((2, 2))]), np.zeros((0, 2)))
    >>> modes = modes_over_speeds(models, [0.0, 1e3, 2e3], [rows] * 3, phase=0.0)
    >>> modes.names, modes.lines[-1].tolist()
    ((('1F', '1E'), ('1F', '1E'), ('1E', '1F')), [2, 1])
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

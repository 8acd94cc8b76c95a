"""Superelements of a sector, one for each nodal diameter, as other programs write them.

A complex Hermitian matrix K of a wave stands in the real matrix A = [[Re K, -Im K], [Im K, Re K]]: K = T^H A T with
T = (I; -i I) / sqrt(2). So several superelements make one real reduced model, of which a wave takes the coordinates
of its own block, q = T z.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rom.cyclic.reduced_model import Array, ReducedModel, WaveBlock
from rom.errors import ReducedModelError

HERMITIAN = 1e-8  # of the largest entry: what a matrix may differ from its conjugate transpose
ROOT = np.sqrt(0.5)


@dataclass(frozen=True)
class WaveSuperelement:
    """The reduced model of a sector in the waves of one nodal diameter n, in m coordinates z of its own.

    The sector is joined to its neighbours: u_R = exp(i n phi) Q u_L at its cut faces, with the pitch phi and the
    rotation Q by it. In this phase the following blade is ahead.

    Attributes
    ----------
    mass, stiffness : (m, m) array
        Hermitian matrices; real for n = 0 and half the number of blades.
    contact_right, contact_left : (3 n_c, m) array
        Displacement of the right and left contact nodes, rows t1, t2, n of each node; left None: contact against
        ground.
    force_excitation : (m,) array
        Generalised force of 1 N of excitation. In the wave of -n, which a load that is real on the blade excites
        alike, it is the conjugate.
    outputs : mapping of str to (m,) array
        Displacement NAME = outputs[NAME] @ z; "tip" is the default output.
    force_harmonics : mapping of int to (m,) array
        Generalised forces of 1 N in harmonics 2 and more that have a pattern of their own.
    force_static, force_centrifugal : (m,) array or None
        Static force, N, and centrifugal force at 1 rad/s; those of n = 0.
    basis : (N, m) array or None
        Displacements of the mesh nodes for unit coordinates.

    Examples
    --------
    >>> from rom import WaveSuperelement
    >>> n, one = np.array([[0.0], [0.0], [1.0]]), np.ones(1)
    >>> wave = WaveSuperelement(np.eye(1), 1e6 * np.eye(1), n, n, one, {"tip": one})
    >>> sorted(wave.outputs)
    ['tip']
    """

    mass: NDArray[Any]
    stiffness: NDArray[Any]
    contact_right: NDArray[Any]
    contact_left: NDArray[Any] | None
    force_excitation: NDArray[Any]
    outputs: Mapping[str, NDArray[Any]]
    force_harmonics: Mapping[int, NDArray[Any]] = field(default_factory=dict)
    force_static: Array | None = None
    force_centrifugal: Array | None = None
    basis: NDArray[Any] | None = None


def model_of_waves(
    waves: Mapping[int, WaveSuperelement],
    n_blades: int,
    position: Array,
    area: Array | None = None,
    *,
    vibration_only: bool = False,
) -> ReducedModel:
    """One reduced model from superelements of several nodal diameters.

    Parameters
    ----------
    waves : mapping of int to WaveSuperelement
        By nodal diameter n = 0 .. n_blades / 2. n = 0 is needed: it holds the static displacement.
    n_blades : int
        Number of blades.
    position : (n_c, 3) array
        Positions of the right contact nodes, m.
    area : (n_c,) array, optional
        Tributary areas of the contact nodes, m^2.
    vibration_only : bool
        Whether n = 0 may be missing: the model has linear vibration in the waves given, and no static displacement.

    Returns
    -------
    ReducedModel
        The model; it has the waves given and those of -n, no others.

    Raises
    ------
    ReducedModelError
        n = 0 is missing, there is no such nodal diameter, a matrix is not Hermitian, or one of n = 0 or half the
        number of blades is not real; outputs or contacts differ.

    Examples
    --------
    One mass whose stiffness grows with the nodal diameter:

    >>> from rom import WaveSuperelement, model_of_waves, natural_frequencies
    >>> n, one = np.array([[0.0], [0.0], [1.0]]), np.ones(1)
    >>> parts = {k: WaveSuperelement(np.eye(1), np.eye(1) * (1 + k) * 1e6, n, n, one, {"tip": one}) for k in (0, 3)}
    >>> model = model_of_waves(parts, 12, np.zeros((1, 3)))
    >>> [natural_frequencies(model, k * np.pi / 6).round(3).tolist() for k in (0, 3, 9)]
    [[159.155], [318.31], [318.31]]
    """
    _check(waves, n_blades, vibration_only)
    blocks, first = {}, 0
    for n, wave in sorted(waves.items()):
        real = 2 * n % n_blades == 0
        blocks[n] = WaveBlock(first, len(wave.mass), real)
        first += (1 if real else 2) * len(wave.mass)
    ordered = [(waves[n], blocks[n]) for n in blocks]
    still = waves[min(waves)]
    without_bases = any(wave.basis is None for wave, _ in ordered)
    return ReducedModel(
        mass=_diagonal([wave.mass for wave, _ in ordered], blocks),
        stiffness=_diagonal([wave.stiffness for wave, _ in ordered], blocks),
        contact_right=_rows([wave.contact_right for wave, _ in ordered], blocks),
        contact_left=None if still.contact_left is None else _rows([w.contact_left for w, _ in ordered], blocks),
        contact_position=position,
        contact_area=area,
        force_excitation=_force([wave.force_excitation for wave, _ in ordered], blocks),
        outputs={name: _rows([wave.outputs[name] for wave, _ in ordered], blocks) for name in still.outputs},
        force_harmonics=_harmonics([wave for wave, _ in ordered], blocks),
        force_static=_static(still.force_static, first) if 0 in waves else None,
        force_centrifugal=_static(still.force_centrifugal, first) if 0 in waves else None,
        basis=None if without_bases else _rows([wave.basis for wave, _ in ordered], blocks),
        n_blades=n_blades,
        wave_blocks=blocks,
    )


def superelements_of(model: ReducedModel) -> dict[int, WaveSuperelement]:
    """The superelements that a model was made of by `model_of_waves`."""
    found = {}
    for n, block in model.wave_blocks.items():
        own, part = slice(block.first, block.first + block.length), block.coordinates
        adjoint = part.conj().T
        found[n] = WaveSuperelement(
            mass=adjoint @ model.mass[own, own] @ part,
            stiffness=adjoint @ model.stiffness[own, own] @ part,
            contact_right=model.contact_right[:, own] @ part,
            contact_left=None if model.contact_left is None else model.contact_left[:, own] @ part,
            force_excitation=adjoint @ model.force_excitation[own],
            outputs={name: row[own] @ part for name, row in model.outputs.items()},
            force_harmonics={h: adjoint @ row[own] for h, row in model.force_harmonics.items()},
            force_static=model.force_static[own] if n == 0 and model.force_static is not None else None,
            force_centrifugal=(
                model.force_centrifugal[own] if n == 0 and model.force_centrifugal is not None else None
            ),
            basis=None if model.basis is None else model.basis[:, own] @ part,
        )
    return found


def _check(waves: Mapping[int, WaveSuperelement], n_blades: int, vibration_only: bool) -> None:
    if 0 not in waves and not (vibration_only and waves):
        raise ReducedModelError("nodal_diameter/0: missing; it holds the static displacement")
    least = min(waves)
    still = waves[least]
    for n, wave in waves.items():
        name = f"nodal_diameter/{n}"
        if not 0 <= n <= n_blades // 2:
            raise ReducedModelError(f"{name}: allowed: 0 to {n_blades // 2} with {n_blades} blades")
        for part in ("mass", "stiffness"):
            matrix = np.asarray(getattr(wave, part))
            if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
                raise ReducedModelError(f"{name}/{part}: shape {matrix.shape}, allowed: as many rows as columns")
            scale = HERMITIAN * np.abs(matrix).max(initial=0.0)
            if np.abs(matrix - matrix.conj().T).max(initial=0.0) > scale:
                raise ReducedModelError(f"{name}/{part}: not Hermitian, allowed: equal to its conjugate transpose")
            if 2 * n % n_blades == 0 and np.abs(np.imag(matrix)).max(initial=0.0) > scale:
                raise ReducedModelError(f"{name}/{part}: complex, allowed: real in a wave of {n} nodal diameters")
        if set(wave.outputs) != set(still.outputs):
            raise ReducedModelError(f"{name}/output: other names than in nodal_diameter/{least}, allowed: the same")
        if (wave.contact_left is None) != (still.contact_left is None):
            raise ReducedModelError(f"{name}/contact/left: allowed: in all nodal diameters, or in none")
        _check_shapes(name, wave)


def _check_shapes(name: str, wave: WaveSuperelement) -> None:
    size = len(wave.mass)
    rows: dict[str, Any] = {
        "stiffness": wave.stiffness,
        "contact/right": wave.contact_right,
        "contact/left": wave.contact_left,
        "force/excitation": wave.force_excitation,
        "force/static": wave.force_static,
        "force/centrifugal": wave.force_centrifugal,
        "basis": wave.basis,
        **{f"output/{key}": row for key, row in wave.outputs.items()},
        **{f"force/excitation_{h}": row for h, row in wave.force_harmonics.items()},
    }
    for part, values in rows.items():
        if values is not None and np.shape(values)[-1] != size:
            raise ReducedModelError(f"{name}/{part}: shape {np.shape(values)}, allowed: {size} columns, as mass")


def _diagonal(matrices: list[NDArray[Any]], blocks: Mapping[int, WaveBlock]) -> Array:
    """The block diagonal real matrix of Hermitian ones."""
    last = list(blocks.values())[-1]
    found = np.zeros((last.first + last.length,) * 2)
    for matrix, block in zip(matrices, blocks.values(), strict=True):
        own = slice(block.first, block.first + block.length)
        found[own, own] = (
            np.real(matrix)
            if block.real
            else np.block([[np.real(matrix), -np.imag(matrix)], [np.imag(matrix), np.real(matrix)]])
        )
    return found


def _rows(parts: list[Any], blocks: Mapping[int, WaveBlock]) -> Array:
    """Real rows (..., n) of which those in a wave, times T, are the rows (..., m) given."""
    found = [
        np.real(part) if block.real else np.concatenate([np.real(part) / ROOT, -np.imag(part) / ROOT], axis=-1)
        for part, block in zip(parts, blocks.values(), strict=True)
    ]
    return np.concatenate(found, axis=-1)


def _force(parts: list[NDArray[Any]], blocks: Mapping[int, WaveBlock]) -> NDArray[Any]:
    """Forces (n,) of which those in a wave, times T^H, are the forces (m,) given; in that of -n their conjugates."""
    found = [
        np.asarray(part) if block.real else 2.0 * np.real(block.coordinates @ part)
        for part, block in zip(parts, blocks.values(), strict=True)
    ]
    whole: NDArray[Any] = np.concatenate(found)
    return whole if np.any(np.imag(whole)) else np.real(whole)


def _harmonics(waves: list[WaveSuperelement], blocks: Mapping[int, WaveBlock]) -> dict[int, NDArray[Any]]:
    """Forces (n,) of the harmonics of the excitation; none in a wave that does not name one."""
    named = sorted({h for wave in waves for h in wave.force_harmonics})
    return {
        h: _force([wave.force_harmonics.get(h, np.zeros(len(wave.mass))) for wave in waves], blocks) for h in named
    }


def _static(force: Array | None, size: int) -> Array | None:
    """A force (m,) of n = 0, whose block comes first, on all coordinates."""
    return None if force is None else np.pad(np.real(force), (0, size - len(force)))

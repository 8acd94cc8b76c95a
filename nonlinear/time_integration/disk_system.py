"""Arrays of the compiled kernels of sectors joined at a disk, wave by wave.

The q real waves are the wave 0, the cosine and the sine of the waves 1, 2, ..., and the wave q / 2. With the cosine a
and the sine b of a wave l, z = (a - i b) / 2^(1/2), a matrix M of the wave takes a to Re M a + Im M b and b to
Re M b - Im M a. Matrices are kept transposed, real and imaginary part by themselves.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.parameters import Array


class WaveMatrices(NamedTuple):
    """Matrices of the J = q // 2 + 1 waves, from n values to p."""

    real: Array  # (J, n, p)
    imaginary: Array  # (J, n, p)


class DiskSystem(NamedTuple):
    """What a step of joined sectors needs besides `RingSystem`, for k retained modes in a wave.

    `RingSystem` has the flexibility of a pair of faces under the forces on itself and on both neighbours; `far` is
    that under the forces on all others.
    """

    turn: Array  # (q, q): real waves from values of the sectors
    turn_back: Array  # (q, q): its transpose
    motion: WaveMatrices  # k to r: relative displacement of the modes
    force: WaveMatrices  # r to k: modal forces of contact forces
    far: WaveMatrices  # r to r, m/N
    output: WaveMatrices  # k to 1: output of the modes
    residual_output: WaveMatrices  # r to 1: residual flexibility of the output, m/N
    is_far: bool  # whether any pair of faces is no neighbour: q > 3


class DiskWork(NamedTuple):
    """Scratch arrays, by real waves but for the last one; the first two are those of `RingWork`, seen by waves."""

    coordinates: Array  # (q, k)
    modal_force: Array  # (q, k)
    motion: Array  # (q, r)
    force: Array  # (q, r)
    output: Array  # (q, 1)
    change: Array  # (q, r): of the forces on the pairs of faces in a visit


def wave_matrices(values: NDArray[Any]) -> WaveMatrices:
    """From matrices (J, p, n) of the waves."""
    transposed = values.transpose(0, 2, 1)
    return WaveMatrices(np.ascontiguousarray(transposed.real), np.ascontiguousarray(transposed.imag))

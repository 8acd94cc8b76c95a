"""Blade-tip timing: when the tips of vibrating blades pass probes in the casing, and what that tells.

A blade at the angle beta of a rotor that has turned by psi passes a probe at the angle alpha when

    psi + beta + u / r = alpha + 2 pi n,

u its circumferential displacement at the tip, r the radius of the tip. The excitation of engine order E has the phase
E psi. A probe reads u once a revolution: a vibration of the frequency f is seen at its distance from the nearest
multiple of the speed, and one of engine order E not at all by a single probe, but as the same displacement again and
again; from three probes or more follows its amplitude, by least squares

    u_p = c + a cos(E alpha_p) + b sin(E alpha_p).
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.parameters import Array

ITERATIONS = 4  # of the angle of a passage: the tip moves by a small part of the radius
LARGEST_CONDITION = 1e3  # of the least squares, beyond which the probes see too few phases of the vibration


@dataclass(frozen=True)
class Passages:
    """Passages of blades at probes, one each, (K,)."""

    revolution: NDArray[np.int64]
    probe: NDArray[np.int64]
    blade: NDArray[np.int64]
    time_s: Array  # as read
    speed: Array  # of the rotor, rad/s
    displacement_m: Array  # as the time tells


@dataclass
class TipTiming:
    """Reads passages from the output of a ring whose excitation frequency changes; called with each part in time."""

    angles: Array  # (P,), of the probes, rad
    radius: float  # of the tips, m
    engine_order: int  # 0: the speed is constant
    n_blades: int  # of the whole ring
    blades: int  # whose passages are read, the first ones
    speed: float = 0.0  # rad/s, with engine order 0
    turned: float = 0.0  # by which the rotor has turned, rad
    rows: list[Array] = field(default_factory=list)
    _last: Array | None = None  # output at the end of the part before

    def __call__(self, time: float, omega: float, output: Array) -> None:
        """Read a part: `output` (P, n, q) at the ends of the n equal steps of each of P periods, from `time` on."""
        from scipy.interpolate import CubicSpline

        steps, output = 2.0 * np.pi / output.shape[1], output.reshape(-1, output.shape[2])
        before = output[:1] if self._last is None else self._last
        theta = steps * np.arange(len(output) + 1)
        spline = CubicSpline(theta, np.concatenate([before, output]))
        ratio = 1.0 / self.engine_order if self.engine_order else self.speed / omega
        offsets = self.angles[:, None] - 2.0 * np.pi * np.arange(self.blades) / self.n_blades
        end = self.turned + ratio * theta[-1]
        first = np.ceil((self.turned - offsets) / (2.0 * np.pi)).astype(int)
        last = np.ceil((end - offsets) / (2.0 * np.pi)).astype(int)
        for probe, blade in np.ndindex(offsets.shape):
            turns = np.arange(int(first[probe, blade]), int(last[probe, blade]))
            if turns.size:
                ideal = (offsets[probe, blade] + 2.0 * np.pi * turns - self.turned) / ratio
                own = blade % output.shape[1]
                at, moved = ideal, spline(ideal)[:, own]
                for _ in range(ITERATIONS):
                    at = ideal - moved / (self.radius * ratio)
                    moved = spline(at)[:, own]
                columns = turns, np.full(turns.size, probe), np.full(turns.size, blade), time + at / omega
                self.rows.append(np.column_stack([*columns, np.full(turns.size, ratio * omega), moved]))
        self.turned, self._last = end, output[-1:]

    def passages(self, resolution: float = 0.0, noise: float = 0.0, seed: int = 0) -> Passages:
        """All passages in the order of time, by a timer of a resolution and with normal noise, s."""
        rows = np.concatenate(self.rows) if self.rows else np.empty((0, 6))
        rows = rows[np.argsort(rows[:, 3], kind="stable")]
        read = rows[:, 3] + noise * np.random.default_rng(seed).normal(size=len(rows))
        read = np.round(read / resolution) * resolution if resolution > 0.0 else read
        displacement = rows[:, 5] - (read - rows[:, 3]) * self.radius * rows[:, 4]
        revolution, probe, blade = rows[:, :3].astype(np.int64).T
        return Passages(revolution, probe, blade, read, rows[:, 4], displacement)


def fit_matrix(angles: Array, engine_order: int) -> Array:
    """The matrix of mean, cosine and sine at the probes, (P, 3)."""
    phases = engine_order * angles
    return np.column_stack([np.ones_like(phases), np.cos(phases), np.sin(phases)])


def tells_amplitude(angles: Array, engine_order: int) -> bool:
    """Whether the probes see enough phases of a vibration of this engine order."""
    matrix = fit_matrix(angles, engine_order)
    return len(angles) >= 3 and bool(np.linalg.cond(matrix) < LARGEST_CONDITION)


def fitted_amplitudes(passages: Passages, angles: Array, engine_order: int) -> tuple[Array, Array]:
    """Frequencies, Hz, and amplitudes, m, (R,), of the vibration in each revolution that all probes have seen: the
    largest of the blades.
    """
    found: dict[int, tuple[float, float]] = {}
    inverse = np.linalg.pinv(fit_matrix(angles, engine_order))
    keys = passages.revolution * (passages.blade.max(initial=0) + 1) + passages.blade
    for key in np.unique(keys):
        chosen = np.flatnonzero(keys == key)
        if chosen.size == len(angles):
            order = chosen[np.argsort(passages.probe[chosen])]
            _, cosine, sine = inverse @ passages.displacement_m[order]
            height = float(np.hypot(cosine, sine))
            turn = int(passages.revolution[order[0]])
            frequency = engine_order * float(passages.speed[order].mean()) / (2.0 * np.pi)
            if height > found.get(turn, (0.0, -1.0))[1]:
                found[turn] = frequency, height
    rows = np.array([found[turn] for turn in sorted(found)]).reshape(-1, 2)
    return rows[:, 0], rows[:, 1]

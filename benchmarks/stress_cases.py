"""The test matrix: its factors, and a designed subset of their product."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

Law = Literal["two_sliders", "cone"]
BLOCK = 200  # every block is a Latin hypercube of its own: case INDEX of a seed is the same however many are drawn
SCALES = tuple(np.logspace(-8.0, -3.0, 10).tolist())  # m/N; the free peak moves 3e-4 m/N at zeta 1e-4

LEVELS: dict[str, tuple[Any, ...]] = {
    "angle": (45.0, 70.0, 110.0, 150.0, 180.0),
    "order_ratio": (0.0, 1 / 12, 1 / 4, 1 / 3, 1 / 2),
    "interference": (*(-value for value in reversed(SCALES)), 0.0, *SCALES),
    "friction": (0.0, 0.1, 0.5, 1.0, 10.0),
    "damping_ratio": (1e-4, 3e-3, 2e-2),
    "harmonics": (1, 3, 7),
}
STIFFNESS_RANGE = (1e5, 1e9)
# The corner where curves have turning points: stiff contacts, neighbours out of phase, lift-off in part of the cycle.
HARD_STIFFNESS_RANGE = (1e7, 1e9)
HARD_LEVELS = LEVELS | {
    "order_ratio": (1 / 12, 1 / 4, 1 / 3, 1 / 2),
    "interference": tuple(value for value in LEVELS["interference"] if -1.5e-4 < value < 1e-5),
    "damping_ratio": (1e-4, 3e-3),
}
TANGENTIAL_RATIO = 0.75


@dataclass(frozen=True)
class StressCase:
    """One curve of the matrix. SI units, angle in degrees.

    Attributes
    ----------
    order_ratio : float
        EO / N_b.
    normal_stiffness : float
        N/m of the whole face; the tangential stiffness is 0.75 of it.
    interference : float
        v0 over the force amplitude, m/N, negative for a gap. The force is 1 N: the problem is homogeneous.
    law : str
        Friction law, the same for all cases of a draw.
    """

    seed: int
    index: int
    hard: bool
    angle: float
    order_ratio: float
    normal_stiffness: float
    interference: float
    friction: float
    damping_ratio: float
    harmonics: int
    law: Law = "two_sliders"

    @property
    def replay(self) -> str:
        """The command that solves this case again and draws its curve."""
        draw = (" --hard" if self.hard else "") + (f" --law {self.law}" if self.law != "two_sliders" else "")
        return f"python benchmarks/stress.py --replay {self.index} --seed {self.seed}{draw} --draw"

    @property
    def stiffness_decade(self) -> str:
        """Class of the stiffness for tables."""
        decade = min(int(np.floor(np.log10(self.normal_stiffness))), 8)
        return f"1e{decade} .. 1e{decade + 1}"

    def shown(self) -> tuple[object, ...]:
        """Angle, EO / N_b, kn, v0 / F, mu, zeta and H for tables."""
        numbers = (self.order_ratio, self.normal_stiffness, self.interference)
        shown = (f"{number:.4g}" for number in numbers)
        return f"{self.angle:g}", *shown, f"{self.friction:g}", f"{self.damping_ratio:g}", self.harmonics

    def values(self) -> dict[str, Any]:
        """Column with its unit -> value."""
        return {UNITS.get(name, name): value for name, value in asdict(self).items()}

    def level(self, factor: str) -> str:
        """The factor's level as a table shows it."""
        if factor == "normal_stiffness":
            return self.stiffness_decade
        value = getattr(self, factor)
        return f"{value:.3g}" if isinstance(value, float) else str(value)


UNITS = {"angle": "angle_deg", "normal_stiffness": "normal_stiffness_n_per_m", "interference": "interference_m_per_n"}
FACTORS = tuple(field.name for field in fields(StressCase) if field.name not in ("seed", "index", "hard", "law"))


def draw_cases(count: int, seed: int, hard: bool = False, law: Law = "two_sliders") -> list[StressCase]:
    """The first `count` cases of a seed: Latin hypercubes of 200, every level of a factor equally frequent in each.

    Equally to within two cases; the stiffness is spread log-uniformly. `hard`: from the hard corner only.
    """
    cases: list[StressCase] = []
    for block in range(-(-count // BLOCK)):
        hypercube = qmc.LatinHypercube(d=len(FACTORS), rng=np.random.default_rng((seed, block)))
        rows = hypercube.random(BLOCK)
        cases.extend(_case(seed, block * BLOCK + row, sample, hard) for row, sample in enumerate(rows))
    return [replace(case, law=law) for case in cases[:count]]


def _case(seed: int, index: int, sample: NDArray[np.float64], hard: bool) -> StressCase:
    values: dict[str, Any] = {}
    levels = HARD_LEVELS if hard else LEVELS
    low, high = np.log10(HARD_STIFFNESS_RANGE if hard else STIFFNESS_RANGE)
    for name, share in zip(FACTORS, sample, strict=True):
        if name == "normal_stiffness":
            values[name] = float(10.0 ** (low + (high - low) * share))
        else:
            values[name] = levels[name][int(share * len(levels[name]))]
    return StressCase(seed=seed, index=index, hard=hard, **values)

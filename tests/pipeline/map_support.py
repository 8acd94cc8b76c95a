"""A mass with a dry-friction damper: worst motion in closed form, for one harmonic."""

import math

import numpy as np

from pipeline.results.worst import SLIPPING, STUCK
from pipeline.studies.map.grid import MapGrid, MapPoint
from rom import ReducedModel

STIFFNESS, DAMPING = 1.0, 0.02  # of a unit mass: frequency 1 / (2 pi) Hz, damping ratio 0.01
KT, FORCE = 0.3, 1.0


def one_mass(direction: int) -> ReducedModel:
    """A unit mass on springs along t1, t2 and n against the ground, excited and observed in one of them."""
    force = np.zeros(3)
    force[direction] = 1.0
    return ReducedModel(
        mass=np.eye(3),
        stiffness=STIFFNESS * np.eye(3),
        contact_right=np.eye(3),
        contact_position=np.zeros((1, 3)),
        force_excitation=force,
        outputs={"tip": force},
        producer="a test",
    )


def damper(amplitude: float, limit: float) -> tuple[float, float]:
    """Stiffness of a friction damper at one harmonic, and its loss per amplitude (imaginary part of the stiffness).

    limit: friction limit mu N. A textbook formula: Griffin, J. Eng. Power 102 (1980).
    """
    slip = limit / KT
    if amplitude <= slip:
        return KT, 0.0
    angle = math.acos(1.0 - 2.0 * slip / amplitude)
    stiffness = KT / math.pi * (angle - 0.5 * math.sin(2.0 * angle))
    return stiffness, 4.0 * limit * (amplitude - slip) / (math.pi * amplitude**2)


def peak(limit: float, force: float = FORCE) -> tuple[float, float]:
    """Angular frequency and amplitude at the peak: the largest amplitude that some frequency has.

    At each amplitude |dynamic stiffness|^2 = (k + k_d - x)^2 + (c sqrt(x) + l)^2 is smallest over x = omega^2 where
    x = k + k_d - c^2 / 2 - c l / (2 sqrt(x)).
    """

    def smallest(amplitude: float) -> tuple[float, float]:
        spring, loss = damper(amplitude, limit)
        square = STIFFNESS + spring
        for _ in range(12):
            square = STIFFNESS + spring - DAMPING**2 / 2.0 - DAMPING * loss / (2.0 * math.sqrt(square))
        return square, math.hypot(STIFFNESS + spring - square, DAMPING * math.sqrt(square) + loss)

    low, high = 1e-3 * force, 1.2 * force / DAMPING
    for _ in range(50):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if smallest(middle)[1] < force / middle else (low, middle)
    return math.sqrt(smallest(low)[0]), low


def exact_point(grid: MapGrid, place: tuple[float, float]) -> MapPoint:
    """The point of a map over preload and friction coefficient."""
    load, friction = grid.values_at(place)
    omega, amplitude = peak(load * friction)
    state = STUCK if amplitude <= load * friction / KT * (1.0 + 1e-9) else SLIPPING
    hz = omega / (2.0 * math.pi)
    return MapPoint(place, (load, friction), amplitude, hz, state, 0, "periodic", "", ((hz, amplitude),))

"""What is measured of a state: cases by name, the dear ones apart."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from before_after.command_cases import fresh_clone, from_nothing, one_and_two_workers
from before_after.state import State

GRIDS = (5, 7, 10, 15)
HARMONICS = (1, 3, 5, 7, 11, 15, 31)
SCENES = ("dummy", "figure5", "figure6", "figure7")
PEERS = ("A1", "A5", "V1", "V5", "S1")
SMALL, MIDDLE, LARGE = 4.0, 1.9, 1.17  # mm: 26 000, 142 000 and 484 000 dofs
SLOW_CASE = 189  # of `stress.py --hard --seed 1`


@dataclass(frozen=True)
class Settings:
    """Where the models are; most seconds of a curve of the hard corner, of a dear curve and of a whole case; which
    cases of the hard corner."""

    models: Path
    curve_limit: float = 30.0
    dear_limit: float = 120.0
    limit: float = 1200.0
    hard_cases: tuple[int, ...] = (0, 5, 20, 25, 30, 55)


Case = Callable[[State, Settings], dict[str, Any]]


def measured(name: str, **arguments: Any) -> Case:
    """A case of `measured_process.py`."""
    return lambda state, settings: state.measured(name, settings.models, settings.limit, **arguments)


def reduction(*sizes: float) -> Case:
    """From the blade to the reduced model for each size, mm, each in a process of its own."""

    def run(state: State, settings: Settings) -> dict[str, Any]:
        rows = [state.measured("reduction", settings.models, settings.limit, size_mm=size) for size in sizes]
        return {"rows": rows}

    return run


def hard_corner(state: State, settings: Settings) -> dict[str, Any]:
    """Cases spread over the first 60 of the hard corner."""
    cases, most = list(settings.hard_cases), settings.curve_limit
    return state.measured("hard", settings.models, settings.limit, cases=cases, most=most)


CASES: dict[str, Case] = {
    "fresh": lambda state, settings: fresh_clone(state, "dummy", settings.limit),
    "default": lambda state, settings: from_nothing(state, "dummy", settings.limit),
    "figure5": lambda state, settings: from_nothing(state, "figure5", settings.limit),
    "machine": lambda state, settings: from_nothing(state, "machine", settings.limit),
    "workers": lambda state, settings: one_and_two_workers(state, settings.limit),
    "peers": measured("peers", cases=PEERS),
    "growth": measured("growth", nodes=GRIDS, harmonics=HARMONICS),
    "dofs": reduction(SMALL, MIDDLE),
    "auto dummy": measured("automatic", scene="dummy", values=(-20e-6, 0.0, 5e-6)),
    "auto dummy180": measured("automatic", scene="dummy180", values=(-20e-6,)),
    "auto figure6": measured("automatic", scene="figure6", values=(40e-6,)),
    **{f"extras {scene}": measured("extras", scene=scene, steps=scene != "dummy") for scene in SCENES},
    "hard": hard_corner,
}
DEAR: dict[str, Case] = {
    "case 189": lambda state, settings: state.measured(
        "hard", settings.models, settings.limit, cases=[SLOW_CASE], most=settings.dear_limit
    ),
    "stiff": lambda state, settings: state.measured(
        "stiff", settings.models, settings.limit, most=settings.dear_limit
    ),
    "large": reduction(LARGE),
}

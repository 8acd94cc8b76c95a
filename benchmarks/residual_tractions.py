"""Bounds over residual tractions against brute force: random starts of the sliders on random coupled structures.

    python benchmarks/residual_tractions.py                  # ten problems with 40 starts each, some 5 minutes
    python benchmarks/residual_tractions.py --first 3 --problems 1 --starts 10 --law cone

Each problem is a random structure of eleven dofs with three contacts against ground. A start places each slider at
random; the whole curve is solved, and its largest displacement as a whole and its largest vibration are compared with
the two pairs of bounds. Prints a table; exit status 1 if a start leaves the bounds.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass, replace

import numpy as np

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from rom import ModalModel, ReducedModel, modal_model

SIZE, CONTACTS = 11, 3
TOLERANCE = 1e-5  # by which a start may exceed the upper bound
UNRESOLVED = 2e-4  # by which the largest of the points of a curve may lie below its peak
OPTIONS = SolverOptions((0.05, 0.2), detached=False, truncation=False, stability="folds", search="off")


@dataclass(frozen=True)
class Outcome:
    """One problem: bounds and peaks from random starts relative to the projected peak, times of curve and bounds."""

    name: str
    free_nodes: int
    lowest: float
    highest: float
    starts: tuple[float, ...]
    curve_seconds: float
    bounds_seconds: float

    @property
    def inside(self) -> bool:
        """Whether every start is inside the bounds."""
        return self.lowest - UNRESOLVED <= min(self.starts) and max(self.starts) <= self.highest + TOLERANCE

    @property
    def row(self) -> str:
        """Row of the table."""
        values = f"{self.lowest:.4f} | {min(self.starts):.4f} | {max(self.starts):.4f} | {self.highest:.4f}"
        ratio = self.bounds_seconds / self.curve_seconds
        return f"| {self.name} | {self.free_nodes} of {CONTACTS} | {values} | {len(self.starts)} | {ratio:.0f} |"


def random_problem(seed: int, law: str) -> tuple[ModalModel, ContactParameters, Excitation]:
    """A coupled structure with contacts against ground; some slip and some stick at the peak."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(SIZE, SIZE))
    unit = np.eye(SIZE)
    model = ReducedModel(
        mass=np.diag(np.r_[rng.uniform(0.1, 0.3, SIZE)[:-2], 1.0, 1.0]),
        stiffness=root @ root.T / SIZE + 0.3 * unit,
        contact_right=unit[: 3 * CONTACTS],
        contact_position=np.zeros((CONTACTS, 3)),
        force_excitation=unit[-1],
        outputs={"tip": unit[-2]},
        producer="benchmark",
    )
    contact = ContactParameters(
        normal_stiffness=rng.uniform(0.5, 2.0, CONTACTS),
        tangential_stiffness=rng.uniform(0.5, 2.0, CONTACTS),
        friction=rng.uniform(0.2, 0.6, CONTACTS),
        interference=rng.uniform(0.5, 2.0, CONTACTS),
        preload=np.zeros(CONTACTS),
        law=law,  # type: ignore[arg-type]
    )
    return modal_model(model, damping_ratio=0.01), contact, Excitation(0, float(rng.uniform(0.02, 0.08)))


def compared(seed: int, law: str, starts: int) -> tuple[Outcome, Outcome]:
    """Bounds and random starts of one problem: of the displacement as a whole, and of the vibration (H = 1)."""
    modal, contact, excitation = random_problem(seed, law)
    curve = forced_response(modal, contact, excitation, OPTIONS)
    bounded = forced_response(modal, contact, excitation, replace(OPTIONS, residual_tractions="bounds"))
    bounds, peak = bounded.residual_bounds, curve.peak
    assert bounds is not None
    assert peak is not None
    rng = np.random.default_rng(1000 + seed)
    reach = 3.0 * float(np.abs(curve.relative_displacement[peak.index]).max())
    found = []
    for _ in range(starts):
        origin = rng.uniform(-reach, reach, (CONTACTS, 2)) * rng.choice([0.3, 1.0, 2.0])
        other = forced_response(modal, replace(contact, slider_origin=origin), excitation, OPTIONS)
        if other.termination.complete:
            found.append((other.amplitude_m.max(), other.harmonic_m[:, 0].max()))
    whole, vibration = (curve.amplitude_m.max(), curve.harmonic_m[:, 0].max())
    extremes = (
        ("displacement", whole, bounds.lowest.amplitude_m, bounds.highest.amplitude_m),
        ("vibration", vibration, bounds.least_vibration.vibration_m, bounds.most_vibration.vibration_m),
    )
    first, second = (
        Outcome(
            name=f"{seed}, {name}",
            free_nodes=bounded.free_nodes,
            lowest=lowest / projected,
            highest=highest / projected,
            starts=tuple(float(each[number] / projected) for each in found),
            curve_seconds=curve.seconds,
            bounds_seconds=bounded.seconds - curve.seconds,
        )
        for number, (name, projected, lowest, highest) in enumerate(extremes)
    )
    return first, second


def main() -> int:
    """Compare, print the table, and say whether every start is inside."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--problems", type=int, default=10)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--starts", type=int, default=40)
    parser.add_argument("--law", choices=("two_sliders", "cone"), default="two_sliders")
    arguments = parser.parse_args()
    print("| problem | free nodes | lower bound | lowest start | highest start | upper bound | starts | time |")
    print("|---|---|---|---|---|---|---|---|")
    inside, began = True, time.perf_counter()
    for seed in range(arguments.first, arguments.first + arguments.problems):
        for outcome in compared(seed, arguments.law, arguments.starts):
            print(outcome.row, flush=True)
            inside = inside and outcome.inside
    print(f"{'all inside' if inside else 'NOT all inside'}, {time.perf_counter() - began:.0f} s", file=sys.stderr)
    return 0 if inside else 1


if __name__ == "__main__":
    sys.exit(main())

"""States, largest force and friction work of every contact node over the cycle at the peak of a curve."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pipeline.figures.data import PlottedCurve

Array = NDArray[np.float64]
SAMPLES = 720
NOTHING = 1e-9  # of the largest tangential force times the range of the motion


@dataclass(frozen=True)
class NodeCycle:
    """One contact node over one period."""

    number: int  # number of the node, from 1
    row: int  # place in the grid of the face, along the radius and along the segment, from 0
    column: int  # place in the grid of the face, along the radius and along the segment, from 0
    # stick, slip and separation intervals: state, start and end as shares of the period
    intervals: tuple[tuple[str, float, float], ...]
    shares: dict[str, float]  # share of the period in each state
    work_j: float  # friction work per cycle, J
    largest_normal_n: float  # largest normal force, N


@dataclass(frozen=True)
class FaceCycle:
    """The nodes of a contact face at the peak of one curve; `work_j` is their friction work per cycle, J."""

    curve: PlottedCurve
    columns: int
    rows: int
    nodes: tuple[NodeCycle, ...]
    work_j: float

    @property
    def shares(self) -> dict[str, float]:
        """Share of nodes and time in each state."""
        return {name: float(np.mean([node.shares[name] for node in self.nodes])) for name in self.nodes[0].shares}


def face_cycle(curve: PlottedCurve, grid: tuple[int, int] | None) -> FaceCycle | None:
    """The cycle at the peak of a curve on a face of `grid` nodes (along segment, radius); None without a peak.

    Without a grid the nodes stand in one row.
    """
    from nonlinear import LIFT_OFF, SLIP, STICK, contact_cycle

    if curve.peak_displacement is None:
        return None
    names = {STICK: "stick", SLIP: "slip", LIFT_OFF: "open"}
    grid = grid or (curve.peak_displacement.shape[1], 1)
    contact = curve.contact_parameters(curve.peak_displacement.shape[1])
    cycle = contact_cycle(curve.peak_displacement, contact, samples=SAMPLES)
    velocity = np.roll(cycle.displacement, -1, axis=0) - np.roll(cycle.displacement, 1, axis=0)
    work = np.sum(cycle.force[:, :, :2] * velocity[:, :, :2] / 2.0, axis=(0, 2))
    # the path of a node that only sticks is a line in force and displacement: its work is round-off
    line = np.abs(cycle.force[:, :, :2]).max(axis=(0, 2)) * np.ptp(cycle.displacement[:, :, :2], axis=0).max(axis=1)
    work = np.where(work > NOTHING * line, work, 0.0)
    nodes = []
    for k, done in enumerate(work):
        states = [names[int(value)] for value in cycle.state[:, k]]
        shares = {name: states.count(name) / SAMPLES for name in names.values()}
        nodes.append(
            NodeCycle(
                number=k + 1,
                row=k // grid[0],
                column=k % grid[0],
                intervals=_intervals(states),
                shares=shares,
                work_j=float(done),
                largest_normal_n=float(cycle.force[:, k, 2].max()),
            )
        )
    return FaceCycle(curve, grid[0], grid[1], tuple(nodes), sum(node.work_j for node in nodes))


def _intervals(states: list[str]) -> tuple[tuple[str, float, float], ...]:
    """Intervals of equal state over the period."""
    changes = [0, *(k for k in range(1, len(states)) if states[k] != states[k - 1]), len(states)]
    return tuple((states[a], a / len(states), b / len(states)) for a, b in pairwise(changes))

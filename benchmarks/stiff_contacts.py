"""Stiff contacts, the default blade at 70 degrees: cost, convergence to rigid contact, truncation, stuck motion.

    python benchmarks/stiff_contacts.py                    # all parts
    python benchmarks/stiff_contacts.py --only rigid       # one: curves, rigid, truncation, stuck

Writes a table of each part into out/bench/stiff.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import numba as nb
import numpy as np
from problems import cached_model, scene_with
from stress_solving import OutOfTimeError
from tables import options_of, table_of, write_results

from nonlinear import ContactParameters, ResponseCurve, forced_response
from nonlinear.contact.fourier import to_real
from nonlinear.time_integration.ring import Ring
from nonlinear.time_integration.ring_motion import RingLimits, integrate_ring
from pipeline.scene.schema import Scene
from pipeline.stages.scene_to_solver import nonlinear_problem
from rom import ModalModel, ReducedModel, read_reduced_model
from rom.linear_algebra.threads import one_blas_thread

MICRO = 1e6
TANGENTIAL = 0.75  # kt / kn
WITHOUT_SEARCH = {"response.search": "off"}
ALONE = WITHOUT_SEARCH | {"response.stability": "folds", "response.detached": False, "response.truncation": False}
# of the rigid contact: steps a period; periods, the last of them measured
STEPS, PERIODS, MEASURED = (1000, 2000, 4000), 100, 10
THETA = 0.55  # damps vibrations faster than a step; at the excitation frequency by 1e-4 of critical damping
SWEEPS, CONVERGED = 200, 1e-10  # of projected Gauss-Seidel
AT_HZ = 230.0
Row = dict[str, Any]
Solve = Callable[..., tuple[ResponseCurve | None, float]]


def main(arguments: list[str] | None = None) -> int:
    """Measure the parts asked for."""
    parser = options_of(__doc__, "stiff")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS), help="parts to measure (all)")
    parser.add_argument("--limit", type=float, default=100.0, help="processor seconds of a curve (100)")
    options = parser.parse_args(arguments)
    base = scene_with(options.scene, {})
    model = read_reduced_model(cached_model(options.out / "models", base), with_basis=False)

    def solved(v0: float, kn: float | str, **more: Any) -> tuple[ResponseCurve | None, float]:
        """A curve, v0 in micrometres, and its processor seconds; no curve where these are over the limit."""
        kt = kn if isinstance(kn, str) else TANGENTIAL * kn
        stiffness = {"contact.normal_stiffness": kn, "contact.tangential_stiffness": kt}
        scene = scene_with(base, {"contact.interference": v0 / MICRO} | stiffness | more)
        began = time.process_time()

        def watch(frequency_hz: float, points: int) -> None:
            if time.process_time() - began > options.limit:
                raise OutOfTimeError

        try:
            curve = forced_response(*nonlinear_problem(scene, model), watch)
        except OutOfTimeError:
            return None, time.process_time() - began
        return curve, time.process_time() - began

    with one_blas_thread():
        for part in options.only:
            rows: list[Row] = []
            for row in PARTS[part](solved, model, base):
                rows.append(row)
                print(*row.values(), sep="  ", file=sys.stderr, flush=True)
                write_results(options.out, part, rows, table_of(rows) + "\n")
    return 0


def curves(solved: Solve, _model: ReducedModel, _base: Scene) -> Iterator[Row]:
    """Processor seconds of single curves, with and without the search for worst motions."""
    for kn in (2e5, 1e6, 1e7, 1e8, "punch"):
        for v0 in (-20.0, -5.0, 0.0, 5.0, 60.0):
            row: Row = {"kn": kn, "v0": v0}
            for harmonics in (3, "auto"):
                for search in ("off", "standard"):
                    more = {"response.harmonics": harmonics, "response.tolerance": 1e-2, "response.search": search}
                    curve, seconds = solved(v0, kn, **more)
                    row[f"H = {harmonics}, search {search}"] = f"{'>= ' if curve is None else ''}{seconds:.2f}"
            yield row


def rigid(solved: Solve, model: ReducedModel, base: Scene) -> Iterator[Row]:
    """The peak with a gap of 5 um over kn, and the upper branch at one frequency, there also with rigid contact."""
    for kn in (1e6, 1e7, 1e8, 1e9, 1e10):
        curve, seconds = solved(-5.0, kn, **ALONE, **{"response.harmonics": 3})
        assert curve is not None
        frequency, height = curve.frequency_hz, MICRO * curve.amplitude_m
        first = int(np.flatnonzero(frequency > AT_HZ)[0])  # the curve comes from below, on the upper branch
        there = float(np.interp(AT_HZ, frequency[first - 1 : first + 1], height[first - 1 : first + 1]))
        yield {
            "kn": f"{kn:.0e}",
            "peak, um": f"{MICRO * curve.peak.amplitude_m:.3f}",
            "Hz": f"{curve.peak.frequency_hz:.1f}",
            f"at {AT_HZ:g} Hz, um": f"{there:.3f}",
            "s": f"{seconds:.1f}",
        }
    modal, contact, excitation, _ = nonlinear_problem(scene_with(base, {"contact.interference": -5e-6}), model)
    for steps in STEPS:
        pair, began = RigidPair(modal.at(0), contact, excitation.force, steps), time.process_time()
        pair.amplitude(AT_HZ - 5.0)  # on the upper branch
        there = MICRO * pair.amplitude(AT_HZ)
        yield {
            "kn": f"rigid, in time, {steps} steps",
            "peak, um": "",
            "Hz": "",
            f"at {AT_HZ:g} Hz, um": f"{there:.3f}",
            "s": f"{time.process_time() - began:.1f}",
        }


class RigidPair:
    """Two blades that vibrate against each other, with rigid contacts at both pairs of faces.

    Moreau-Jean time stepping in modal coordinates: impulses of a step by projected Gauss-Seidel, no restitution, one
    slider along each tangent. Nothing of the program but the modes is used.

    References: M. Jean, The non-smooth contact dynamics method, Computer Methods in Applied Mechanics and Engineering
    177, 1999.
    """

    def __init__(self, modal: ModalModel, contact: ContactParameters, force: float, steps: int) -> None:
        assert modal.left is not None
        self.steps = steps  # a period
        self.motion = np.block([[modal.right, -modal.left], [-modal.left, modal.right]])
        self.squared, self.damping = np.tile(modal.angular_frequency**2, 2), np.tile(modal.damping, 2)
        self.force = force * np.concatenate([modal.force, -modal.force]).real
        self.output = np.concatenate([modal.outputs["tip"], 0.0 * modal.outputs["tip"]])
        self.gap, self.friction = -np.tile(contact.interference, 2), np.tile(contact.friction, 2)
        self.state = np.zeros((2, self.squared.size))

    def amplitude(self, frequency_hz: float) -> float:
        """Largest displacement of the tip after transients, from the state of the last call, m."""
        step = 1.0 / frequency_hz / self.steps
        effective = 1.0 + step * THETA * self.damping + (step * THETA) ** 2 * self.squared
        compliance = (self.motion / effective) @ self.motion.T
        forces = np.cos(2.0 * np.pi * (np.arange(self.steps) + THETA) / self.steps)[:, None] * self.force
        parts = self.motion, compliance, self.gap, self.friction
        heights = _stepped(self.state, forces, step, effective, (self.damping, self.squared), parts, self.output)
        return float(heights[-MEASURED:].max())


@nb.njit(cache=False)
def _stepped(state, forces, step, effective, structure, contact, output):  # type: ignore[no-untyped-def]
    """Largest displacement in each period; `state` is left at the end."""
    damping, squared = structure
    motion, compliance, gap, friction = contact
    q, v = state[0], state[1]
    heights, impulse = np.zeros(PERIODS), np.zeros(len(motion))
    for period in range(PERIODS):
        for n in range(len(forces)):
            free = v + step * (forces[n] - damping * v - squared * (q + step * THETA * v)) / effective
            closing, moved = motion @ free, motion @ q + 0.5 * step * (motion @ v)
            active = moved[2::3] >= gap
            if active.any():
                _solve_impulses(impulse, closing, compliance, active, friction)
                free -= (motion.T @ impulse) / effective
            else:
                impulse[:] = 0.0
            q += step * (THETA * free + (1.0 - THETA) * v)
            v[:] = free
            heights[period] = max(heights[period], abs(output @ q))
    return heights


@nb.njit(cache=False)
def _solve_impulses(impulse, closing, compliance, active, friction):  # type: ignore[no-untyped-def]
    """Impulses that stop closing nodes and hold back sliding ones, by projected Gauss-Seidel from the last ones."""
    for node in range(len(active)):
        if not active[node]:
            impulse[3 * node : 3 * node + 3] = 0.0
    velocity = closing - compliance @ impulse
    scale = np.abs(closing).max() + 1e-30
    for _ in range(SWEEPS):
        largest = 0.0
        for node in range(len(active)):
            if not active[node]:
                continue
            for row in (3 * node + 2, 3 * node, 3 * node + 1):
                wanted = impulse[row] + velocity[row] / compliance[row, row]
                if row % 3 == 2:
                    wanted = max(0.0, wanted)
                else:
                    bound = friction[node] * impulse[3 * node + 2]
                    wanted = min(max(wanted, -bound), bound)
                change = wanted - impulse[row]
                if change != 0.0:
                    impulse[row] = wanted
                    velocity -= compliance[:, row] * change
                    largest = max(largest, abs(change) * compliance[row, row])
        if largest <= CONVERGED * scale:
            break


def truncation(solved: Solve, _model: ReducedModel, _base: Scene) -> Iterator[Row]:
    """The estimate of the truncation error beside the difference from 31 harmonics, of the main branch."""
    for v0 in (-20.0, -30.0, -40.0):
        for kn in (1e6, 1e7, 3e7, 1e8):
            few, _ = solved(v0, kn, **WITHOUT_SEARCH, **{"response.harmonics": 5, "response.stability": "folds"})
            many, _ = solved(v0, kn, **ALONE, **{"response.harmonics": 31})
            if few is None or many is None:
                continue
            error = abs(few.peak.amplitude_m / many.peak.amplitude_m - 1.0)
            yield {
                "kn": f"{kn:.0e}",
                "v0": v0,
                "um, H = 5": MICRO * few.peak.amplitude_m,
                "um, H = 31": MICRO * many.peak.amplitude_m,
                "estimate": few.truncation_error,
                "error": error,
                "estimate / error": few.truncation_error / error,
            }


def stuck(solved: Solve, model: ReducedModel, base: Scene) -> Iterator[Row]:
    """The curve that sticks everywhere at 3e6 N/m, and the ring of 72 blades in time at some of its points."""
    kn = 3e6
    curve, seconds = solved(5.0, kn, **WITHOUT_SEARCH, **{"response.harmonics": 3})
    assert curve is not None
    stiffness = {"contact.normal_stiffness": kn, "contact.tangential_stiffness": TANGENTIAL * kn}
    scene = scene_with(base, {"contact.interference": 5e-6} | stiffness)
    ring = Ring(*nonlinear_problem(scene, model)[:3])
    peak = int(np.argmax(curve.amplitude_m))
    for index in (0, peak, curve.points - 1):
        omega = 2.0 * np.pi * float(curve.frequency_hz[index])
        start = to_real(curve.relative_displacement[index])
        motion = integrate_ring(ring, omega, start, nodal_diameter=5, limits=RingLimits(most_periods=400))
        yield {
            "Hz": float(curve.frequency_hz[index]),
            "stable points": f"{int(curve.stable.sum())} of {curve.points}",
            "exponent 1/s": float(curve.growth_rate[index]),
            "ring 1/s": motion.growth_rate,
            "blades": ring.blades(5),
            "stays": "yes" if motion.stays else "no",
            "seconds of the curve": seconds,
        }


PARTS: dict[str, Callable[[Solve, ReducedModel, Scene], Iterator[Row]]] = {
    "curves": curves,
    "rigid": rigid,
    "truncation": truncation,
    "stuck": stuck,
}

if __name__ == "__main__":
    sys.exit(main())

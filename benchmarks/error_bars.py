"""Printed errors beside true ones: peaks, growth rates and heights of small rings that are solved exactly.

    python benchmarks/error_bars.py --cases 60     # out/bench/error_bars: a table and a picture

Rings of one to four masses with springs that open or with sliders between them, contacts 0.1 to 1000 times as stiff
as the blades. The truth is the motion from event to event (`tests/nonlinear/exact_ring.py`).
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from tables import ROOT, options_of, table_of, write_results

sys.path.append(str(ROOT / "tests" / "nonlinear"))

from exact_ring import ExactRing

if TYPE_CHECKING:
    from nonlinear import ResponseCurve, SolverOptions
    from nonlinear.contact.parameters import Array

RANGE = (0.5, 2.2)  # of the frequencies, relative to that of a blade alone
KINDS = ("peak", "growth rate", "height in time")
SLACK = 1e-6  # relative to the value: tolerance of peaks and of the balance
OTHER = 0.05  # relative difference from which an exact motion is another one
STEP, LAST_STEP = 2e-4, 1e-7  # in frequency, to the exact peak


@dataclass(frozen=True)
class Case:
    """A ring with unit masses and unit stiffness."""

    blades: int  # 1: contact with the ground
    engine_order: int
    stiffness: float
    damping_ratio: float
    interference: float  # below 0: gap
    force: float
    limit: float  # of a slider; 0: contact that opens

    @classmethod
    def drawn(cls, seed: int) -> Case:
        """One of a seed."""
        rng = np.random.default_rng(seed)
        blades, stiffness, damping = int(rng.integers(1, 5)), 10 ** rng.uniform(-1, 3), 10 ** rng.uniform(-2.5, -1.5)
        interference, slides = float(rng.choice([-1, 1])) * rng.uniform(0.02, 0.3), rng.random() < 0.35
        order, force = 0 if blades == 1 else int(rng.integers(1, blades)), 10 ** rng.uniform(-2, -0.5)
        interference /= stiffness**0.5 if interference > 0.0 else 1.0
        limit = float(force * 10 ** rng.uniform(-1, 0.5)) if slides else 0.0
        return cls(blades, order, stiffness, damping, interference, force, limit)

    def posed(self) -> tuple[Any, Any, Any]:
        """Modal model, contact and excitation."""
        from nonlinear import ContactParameters, Excitation
        from rom import ReducedModel, modal_model

        one, alone = np.ones(1), self.blades == 1
        face = np.eye(3)[:, :1] if self.limit else np.eye(3)[:, 2:]
        other, number = (None, None) if alone else (face, self.blades)
        model = ReducedModel(np.eye(1), np.eye(1), face, np.zeros((1, 3)), one, {"tip": one}, other, n_blades=number)
        if self.limit:
            contact = ContactParameters.shared(
                1,
                normal_stiffness=1.0,
                tangential_stiffness=self.stiffness,
                friction=0.5,
                interference=2.0 * self.limit,
            )
        else:
            contact = ContactParameters.shared(
                1,
                normal_stiffness=self.stiffness,
                tangential_stiffness=0.0,
                friction=0.0,
                interference=self.interference,
            )
        return (
            modal_model(model, damping_ratio=self.damping_ratio),
            contact,
            Excitation(engine_order=self.engine_order, force=self.force),
        )

    def exact(self, omega: float) -> ExactRing:
        """The exact ring."""
        return ExactRing(
            np.ones(self.blades),
            2.0 * self.damping_ratio,
            self.stiffness,
            self.interference,
            self.force,
            omega,
            self.engine_order,
            limit=self.limit,
        )


@dataclass(frozen=True)
class Comparison:
    """A printed value with its error, and the exact one."""

    seed: int
    kind: str
    value: float
    error: float  # printed, absolute; NaN or infinite: marked as not known
    exact: float

    @property
    def contained(self) -> bool:
        """Whether the error contains the truth, or the number is marked."""
        return not abs(self.value - self.exact) > self.error + SLACK * max(abs(self.exact), abs(self.value))

    def row(self) -> dict[str, object]:
        """For the table."""
        return {
            "case": self.seed,
            "value": self.kind,
            "printed": f"{self.value:.7g}",
            "+-": f"{self.error:.1e}",
            "exact": f"{self.exact:.7g}",
            "off": f"{abs(self.value - self.exact):.1e}",
            "contained": "yes" if self.contained else "no",
        }


def compared(seed: int) -> Iterator[Comparison]:
    """Peak of the main branch, growth rate at a random point with contact events, motion from an unstable point."""
    from nonlinear import SolverOptions, forced_response
    from nonlinear.worst_motion.ring_integration import RingPatterns

    case = Case.drawn(seed)
    problem = case.posed()
    options = SolverOptions(
        (RANGE[0] / (2.0 * np.pi), RANGE[1] / (2.0 * np.pi)), harmonics="auto", detached=False, search="off"
    )
    curve = forced_response(*problem, options)
    omega, motion = _solution(curve, curve.peak.index)
    if not curve.peak.at_end and (start := _exact_near(case, omega, motion)) is not None:
        height = _exact_peak(case, omega, start)
        yield Comparison(seed, KINDS[0], curve.peak.amplitude_m, curve.truncation_error * height, height)
    nonlinear = np.flatnonzero(curve.slipping + curve.separating)
    if nonlinear.size:
        omega, motion = _solution(curve, int(np.random.default_rng(seed + 1000).choice(nonlinear)))
        patterns = RingPatterns(_ring(problem), options, omega, motion)
        worst = patterns.worst()
        start = _exact_near(case, omega, motion)
        if start is not None:
            rate = float(case.exact(omega).periodic(start)[1].real.max())
            error = patterns.rate_error(worst.nodal_diameter)
            yield Comparison(seed, KINDS[1], worst.exponent.real, error, rate)
    yield from _in_time(seed, case, curve, options)


def _in_time(seed: int, case: Case, curve: ResponseCurve, options: SolverOptions) -> Iterator[Comparison]:
    """The height of a motion that repeats, from where perturbations grow fastest."""
    from nonlinear.worst_motion.ring_integration import RingIntegration, Solution

    growing = np.where(curve.stable, -np.inf, np.nan_to_num(curve.growth_rate))
    if not growing.max() > 0.0:
        return
    integration = RingIntegration(_ring(case.posed()), options)
    solution = Solution.of(curve, int(np.argmax(growing)))
    motion = integration(solution, 4000, 0.0).motion
    if motion is None or motion.stays:
        return
    motion, _ = integration.confirmed(solution.omega, motion, 0.0)
    if not motion.repeats_after or motion.n_blades % case.blades:
        return
    ring, state = case.exact(solution.omega), motion.final
    parts = [state.coordinates[: case.blades].ravel(), state.rates[: case.blades].ravel()]
    start = np.concatenate([*parts, state.force[: case.blades, 0, 0]] if case.limit else parts)
    exact = _newton(ring, start, motion.repeats_after)
    if exact is not None:
        height = ring.height(exact, motion.repeats_after)
        yield Comparison(seed, KINDS[2], motion.amplitude_m, motion.height_error * height, height)


def _ring(problem: tuple[Any, Any, Any]) -> Any:
    from nonlinear.time_integration.ring import Ring

    return Ring(*problem)


def _solution(curve: ResponseCurve, index: int) -> tuple[float, Array]:
    """Frequency, rad/s, and real coefficients of the relative displacement of a point."""
    from nonlinear.contact.fourier import to_real

    kept = int(curve.kept_harmonics[index]) + 1
    return 2.0 * np.pi * float(curve.frequency_hz[index]), to_real(curve.relative_displacement[index, :kept])


def _exact_near(case: Case, omega: float, motion: Array) -> Array | None:
    """The exact periodic motion near a solution; None where Newton's method finds none there."""
    from nonlinear.time_integration.ring_integrator import RingIntegrator

    ring = _ring(case.posed())
    of_wave = RingIntegrator.of(ring, omega)
    state = RingIntegrator(ring, omega, case.blades, of_wave.steps, of_wave.modes).on_wave(motion)
    parts = [state.coordinates.ravel(), state.rates.ravel()]
    if not case.limit:
        return _newton(case.exact(omega), np.concatenate(parts))
    force = np.clip(state.force[:, 0, 0], -case.limit, case.limit)
    starts = [np.concatenate([*parts, sign * force]) for sign in (1.0, -1.0)]
    exact = case.exact(omega)
    return _newton(exact, min(starts, key=lambda start: float(np.abs(exact.over_period(start)[0] - start).max())))


def _newton(ring: ExactRing, start: Array, periods: int = 1) -> Array | None:
    try:
        state, _ = ring.periodic(start, periods)
    except (ArithmeticError, np.linalg.LinAlgError):
        return None
    return None if np.abs(state - start).max() > OTHER * np.abs(start).max() else state


def _exact_peak(case: Case, omega: float, start: Array) -> float:
    """Height of the exact peak, climbed from a motion near it."""
    known = {omega: start}

    def height(at: float) -> float:
        if at not in known:
            near = min(known, key=lambda other: abs(other - at))
            state = _newton(case.exact(at), known[near])
            if state is None:
                return -math.inf
            known[at] = state
        return case.exact(at).height(known[at])

    at, best, step = omega, height(omega), STEP * omega
    while step > LAST_STEP * omega:
        higher = [(height(at + way), at + way) for way in (step, -step)]
        if max(higher)[0] > best:
            best, at = max(higher)
        else:
            step *= 0.3
    return best


def draw(comparisons: list[Comparison], path: Path) -> None:
    """Errors over printed errors, and the line above which an error contains the truth."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, len(KINDS), figsize=(9.6, 3.6), sharey=True, layout="constrained")
    for axis, kind in zip(axes, KINDS, strict=True):
        own = [item for item in comparisons if item.kind == kind]
        known = [item for item in own if math.isfinite(item.error)]
        relative: Callable[[Comparison, float], float] = lambda item, part: max(part / abs(item.exact), 1e-8)  # noqa: E731
        for inside, colour in ((True, "tab:blue"), (False, "tab:red")):
            part = [item for item in known if item.contained == inside]
            axis.loglog(
                [relative(item, item.error) for item in part],
                [relative(item, abs(item.value - item.exact)) for item in part],
                "o",
                color=colour,
                markersize=4,
            )
        axis.plot([1e-8, 1.0], [1e-8, 1.0], color="0.5", linewidth=0.8)
        axis.set_title(f"{kind}: {sum(item.contained for item in own)} of {len(own)}", fontsize=10)
        axis.set_xlabel("printed error")
    axes[0].set_ylabel("true error")
    figure.savefig(path, dpi=150)
    pyplot.close(figure)


def main() -> int:
    """Compare the cases; exit status 1 where fewer than 48 of 50 errors of a kind contain the truth."""
    parser = options_of(__doc__, "error_bars")
    parser.add_argument("--cases", type=int, default=60)
    options = parser.parse_args()
    comparisons: list[Comparison] = []
    for seed in range(options.cases):
        comparisons += compared(seed)
        print(f"{seed + 1} of {options.cases}", file=sys.stderr)
    rows = [item.row() for item in comparisons]
    write_results(options.out, "error_bars", rows, table_of(rows))
    draw(comparisons, options.out / "error_bars.png")
    shares = [np.mean([item.contained for item in comparisons if item.kind == kind]) for kind in KINDS]
    return 0 if min(shares) >= 48 / 50 else 1


if __name__ == "__main__":
    sys.exit(main())

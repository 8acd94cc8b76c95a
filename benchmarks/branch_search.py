"""The search for branches against random starts of Newton's method, on hard cases of the test matrix.

    python benchmarks/branch_search.py                       # 30 cases with 3 harmonics, some 20 minutes on one core
    python benchmarks/branch_search.py --cases 10 --jobs 2   # fewer, two processes
    python benchmarks/branch_search.py --replay 17           # one of them again

Each case is solved with its detached branches. At 10 frequencies Newton's method starts from random contact forces;
a solution that lies on no branch found was missed. Writes branch_search.csv and branch_search.md into
out/bench/branch_search. Exit status 1 if a stable motion above all known ones was missed.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from problems import models_by_angle
from stress_cases import StressCase, draw_cases
from stress_solving import NAN, OutOfTimeError, each, frequency_range, posed, positive
from tables import markdown_table, options_of, write_results

if TYPE_CHECKING:
    from nonlinear import ResponseCurve
    from nonlinear.branches.branch_collection import KnownBranch
    from nonlinear.contact.parameters import Array
    from nonlinear.continuation.arclength_continuation import Continuation
    from nonlinear.continuation.solution_point import SolutionPoint

HARMONICS = 3
FREQUENCIES = 10
STARTS = 40  # at each frequency
FORCE_RANGE = 1e-2, 1e2  # of the random contact forces, relative to the excitation
MAX_ITERATIONS = 25
SAME = 1e-5  # relative distance of two solutions that count as one
NOTABLE = 1.02  # ratio to the highest known stable amplitude above which a missed motion changes the conclusion


@dataclass(frozen=True)
class Comparison:
    """One case: what random starts find, and what of it the search missed; amplitudes in m, times in s."""

    case: StressCase
    message: str
    detached: int = 0
    solutions: int = 0
    on_detached: int = 0
    missed: int = 0
    missed_stable: int = 0
    known_height: float = NAN
    missed_height: float = NAN
    curve_seconds: float = NAN
    search_seconds: float = NAN
    random_seconds: float = NAN
    missed_at: str = ""

    @property
    def changes_conclusion(self) -> bool:
        """Whether a missed stable motion is higher than all known ones."""
        return bool(self.missed_height > NOTABLE * self.known_height)

    def row(self) -> dict[str, Any]:
        """Column -> value, the parameters first."""
        values = asdict(self)
        del values["case"]
        return self.case.values() | values


def main(arguments: list[str] | None = None) -> int:
    """Compare, or replay one case; the exit status."""
    parser = options_of(__doc__, "branch_search", "figure5.toml")
    parser.add_argument("--cases", type=positive, default=30, help="how many to draw (30)")
    parser.add_argument("--seed", type=int, default=17, help="another seed draws other cases (17)")
    parser.add_argument("--jobs", type=positive, default=1, help="worker processes, one BLAS thread each (1)")
    parser.add_argument("--limit", type=float, default=120.0, help="seconds that a case may take (120)")
    parser.add_argument("--replay", type=int, metavar="INDEX", help="this case of the seed only")
    options = parser.parse_args(arguments)
    cases = [replace(case, harmonics=HARMONICS) for case in draw_cases(options.cases, options.seed, hard=True)]
    if options.replay is not None:
        cases = [cases[options.replay]]
    models = models_by_angle(options.scene, (case.angle for case in cases), options.out / "models")
    results: list[Comparison] = []
    for result in each(compare, cases, [models[case.angle] for case in cases], options.limit, options.jobs):
        results.append(result)
        found = f"{result.solutions} solutions, {result.on_detached} on {result.detached} detached branches"
        text = f"{found}, {result.missed} missed, {result.missed_stable} of them stable"
        print(f"{len(results)} of {len(cases)}, case {result.case.index}: {text}", file=sys.stderr)
    results.sort(key=lambda result: result.case.index)
    if options.replay is not None:
        for name, value in results[0].row().items():
            print(f"{name:>18}  {value}")
    else:
        write_results(options.out, "branch_search", [result.row() for result in results], report_text(results))
    return 1 if any(result.changes_conclusion for result in results) else 0


def compare(case: StressCase, model: Path, limit: float) -> Comparison:
    """Solve a case with the search, and by random starts; `limit`: seconds for each curve."""
    from nonlinear import forced_response
    from nonlinear.response_solver import build_continuation
    from rom.linear_algebra.threads import one_blas_thread

    with one_blas_thread():
        posed_problem = posed(case, model, frequency_range(case, model))
        problem = *posed_problem[:3], replace(posed_problem[3], stability="wave", search="off")
        began = time.process_time()

        def watch(frequency_hz: float, points: int) -> None:
            if time.process_time() - began > limit:
                raise OutOfTimeError(f"given up at {frequency_hz:.6g} Hz after {limit:g} s")

        try:
            forced_response(*problem[:3], replace(problem[3], detached=False), watch)
            alone_seconds, began = time.process_time() - began, time.process_time()
            curve = forced_response(*problem, watch)
        except OutOfTimeError as error:
            return Comparison(case, str(error))
        curve_seconds = time.process_time() - began
        found = Comparison(case, curve.termination.message, detached=len(curve.detached))
        began = time.process_time()
        continuation = build_continuation(*problem)[0]
        solutions = list(random_solutions(continuation, np.random.default_rng((case.seed, case.index))))
        found = replace(found, random_seconds=time.process_time() - began)
        found = replace(found, curve_seconds=alone_seconds, search_seconds=curve_seconds - alone_seconds)
        return _compared(found, continuation, curve, solutions)


def _compared(
    found: Comparison, continuation: Continuation, curve: ResponseCurve, solutions: list[SolutionPoint]
) -> Comparison:
    """The comparison with the solutions of random starts counted."""
    from nonlinear.branches.branch_collection import lies_on
    from nonlinear.continuation.response_quantities import output_amplitude

    main, *detached = [known_branch(continuation, branch) for branch in (curve, *curve.detached)]
    on_detached, missed = 0, []
    for point in solutions:
        if lies_on(continuation, main, point):
            continue
        if any(lies_on(continuation, branch, point) for branch in detached):
            on_detached += 1
        else:
            missed.append(continuation.recorder.record(point))
    heights = [branch.amplitude_m[branch.stable].max(initial=0.0) for branch in (curve, *curve.detached)]
    stable = [point for point in missed if point.stable]
    output = continuation.options.output
    return replace(
        found,
        solutions=len(solutions),
        on_detached=on_detached,
        missed=len(missed),
        missed_stable=len(stable),
        known_height=float(max(heights)),
        missed_height=max((output_amplitude(point, output) for point in stable), default=NAN),
        missed_at="; ".join(
            f"{point.omega / (2.0 * np.pi):.5g} Hz {output_amplitude(point, output):.3g} m"
            + (" stable" if point.stable else "")
            for point in missed
        ),
    )


def known_branch(continuation: Continuation, branch: ResponseCurve) -> KnownBranch:
    """The solutions of a branch of a response curve."""
    from nonlinear.branches.branch_collection import KnownBranch
    from nonlinear.contact.fourier import to_real

    rows = np.stack([continuation.balance.unknown(to_real(row)) for row in branch.relative_displacement])
    return KnownBranch(2.0 * np.pi * branch.frequency_hz, rows)


def random_solutions(continuation: Continuation, rng: np.random.Generator) -> Iterator[SolutionPoint]:
    """Distinct solutions at evenly spaced frequencies, from random contact forces."""
    from nonlinear.harmonic_balance.initial_solution import solve_at

    balance, options = continuation.balance, continuation.options
    for omega in np.linspace(*options.omega_range, FREQUENCIES + 2)[1:-1]:
        distinct: list[Array] = []
        for _ in range(STARTS):
            guess = random_motion(continuation, float(omega), rng)
            solved = solve_at(balance, float(omega), guess, options, MAX_ITERATIONS)
            metric = continuation.solver.metric(solved.solution)
            if solved.converged and all(metric.norm(solved.solution - other, 0.0) > SAME for other in distinct):
                distinct.append(solved.solution)
                towards = 0.0 * solved.solution, 1.0
                yield continuation.solver.point(solved.solution, float(omega), towards, 0, 0.0, options.step)


def random_motion(continuation: Continuation, omega: float, rng: np.random.Generator) -> Array:
    """The motion under the excitation and random contact forces, (n,): mean loads that press, harmonics that fall."""
    from nonlinear.contact.fourier import to_complex, to_real

    balance = continuation.balance
    shape = (2 * balance.n_harmonics + 1, balance.n_contacts, 3)
    scale = balance.receptance.force * 10.0 ** rng.uniform(*np.log10(FORCE_RANGE)) / balance.n_contacts
    common, own = rng.normal(size=(shape[0], 1, 3)), rng.normal(size=shape)
    order = np.maximum(np.arange(1, shape[0] + 1) // 2, 1)
    force = scale * (common + 0.3 * own) / order[:, None, None] ** 2
    force[0, :, 2] = -np.abs(force[0, :, 2])
    response, _ = balance.receptance.response(omega, to_complex(force.reshape(shape[0], -1)))
    return balance.unknown(to_real(response).reshape(shape))


def report_text(results: list[Comparison]) -> str:
    """The table of all cases, and what it amounts to."""
    header = ["Case", "Angle", "EO / N_b", "kn", "v0 / F", "mu", "zeta", "Branches", "Solutions", "on them"]
    header += ["Missed", "stable", "higher", "Curve, s", "Search, s", "Random, s"]
    rows = []
    for item in results:
        numbers = (item.curve_seconds, item.search_seconds, item.random_seconds)
        counts = (item.detached, item.solutions, item.on_detached, item.missed, item.missed_stable)
        higher = f"{item.missed_height / item.known_height:.2f}" if item.changes_conclusion else ""
        times = tuple(f"{number:.1f}" for number in numbers)
        rows.append((item.case.index, *item.case.shown()[:-1], *counts, higher, *times))
    lost = sum(item.changes_conclusion for item in results)
    total = sum(item.missed for item in results), sum(item.solutions for item in results)
    text = f"{total[0]} of {total[1]} distinct solutions missed; in {lost} of {len(results)} cases a stable motion "
    return markdown_table(header, rows) + f"\n\n{text}above all known ones was missed.\n"


if __name__ == "__main__":
    raise SystemExit(main())

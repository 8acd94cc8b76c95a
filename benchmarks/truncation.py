"""The truncation error estimate against 31 harmonics, on cases from the hard corner of the test matrix.

    python benchmarks/truncation.py                        # 100 cases, some 40 minutes on one core
    python benchmarks/truncation.py --seed 3 --jobs 2      # other cases, two processes
    python benchmarks/truncation.py --replay 17            # one of them again

Case i is solved with 1, 3, 5 harmonics in turn. The true error is that of the highest peak, see
`truncation_truth.py`. Writes truncation.csv and truncation.md into out/bench/truncation. Exit status
1 if the estimate bounds the true error within a factor of 3 in less than 95 % of the cases.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from problems import models_by_angle
from stress_cases import StressCase, draw_cases
from stress_report import PARAMETERS
from stress_solving import NAN, OutOfTimeError, each, positive
from tables import markdown_table, options_of, write_results
from truncation_truth import Truth, estimate_of, problem_of, truth_of

HARMONICS = (1, 3, 5)
REQUIRED = 0.95  # part of the cases that must be bounded
FACTOR, MUCH = 3.0, 10.0
FLOOR = 1e-6  # smaller errors are those of the peak's location
ENOUGH_TRUTH = 0.1  # last change of the truth, relative to the true error, that does not matter


@dataclass(frozen=True)
class Validation:
    """One case: the peak (Hz, m), its estimated errors, the truth, seconds, and why it was left out, if it was."""

    case: StressCase
    left_out: str
    frequency_hz: float = NAN
    height: float = NAN
    estimate: float = NAN
    motion_estimate: float = NAN
    branch: str = ""
    truth: Truth = field(default_factory=Truth)
    curve_seconds: float = NAN
    estimate_seconds: float = NAN

    @property
    def error(self) -> float:
        """True relative error of the highest amplitude of the main branch."""
        return abs(self.height / self.truth.curve - 1.0)

    @property
    def motion_error(self) -> float:
        """True relative error of the motion at the peak, on whatever branch it lies with more harmonics."""
        return abs(self.height / self.truth.height - 1.0)

    @property
    def known(self) -> bool:
        """Whether the estimate is a number."""
        return bool(np.isfinite(self.estimate))

    @property
    def bounded(self) -> bool:
        """Whether the true error is at most three times the estimate; unknown is no bound."""
        return self.known and self.error <= FACTOR * self.estimate + FLOOR

    @property
    def motion_bounded(self) -> bool:
        """The same of the motion at the peak."""
        return bool(self.motion_error <= FACTOR * self.motion_estimate + FLOOR)

    @property
    def lost(self) -> bool:
        """Whether the program says that the branch was not followed to more harmonics."""
        return self.branch == "lost"

    @property
    def far_over(self) -> bool:
        """Whether the estimate is more than ten times the true error."""
        return self.known and self.estimate > MUCH * (self.error + FLOOR)

    def row(self) -> dict[str, Any]:
        """Column -> value, the parameters first."""
        values = asdict(self)
        truth = {f"truth_{name}": value for name, value in values.pop("truth").items()}
        del values["case"]
        return self.case.values() | values | truth | {"error": self.error, "bounded": self.bounded}


def main(arguments: list[str] | None = None) -> int:
    """Validate, or replay one case; the exit status."""
    parser = options_of(__doc__, "truncation", "figure5.toml")
    parser.add_argument("--cases", type=positive, default=100, help="how many to draw (100)")
    parser.add_argument("--seed", type=int, default=1, help="another seed draws other cases (1)")
    parser.add_argument("--jobs", type=positive, default=1, help="worker processes, one BLAS thread each (1)")
    parser.add_argument("--limit", type=float, default=60.0, help="seconds that a curve may take (60)")
    parser.add_argument("--replay", type=int, metavar="INDEX", help="this case of the seed only")
    options = parser.parse_args(arguments)
    cases = [
        replace(c, harmonics=HARMONICS[c.index % len(HARMONICS)])
        for c in draw_cases(options.cases, options.seed, hard=True)
    ]
    if options.replay is not None:
        cases = [cases[options.replay]]
    models = models_by_angle(options.scene, (case.angle for case in cases), options.out / "models")
    results: list[Validation] = []
    for result in each(validate, cases, [models[case.angle] for case in cases], options.limit, options.jobs):
        results.append(result)
        found = result.left_out or f"error {result.error:.2g}, estimate {result.estimate:.2g}, {result.branch}"
        print(f"{len(results)} of {len(cases)}, case {result.case.index}: {found}", file=sys.stderr)
        results.sort(key=lambda result: result.case.index)
        if options.replay is None and any(
            not done.left_out for done in results
        ):  # after each case: a run that is cut short leaves what it has
            write_results(options.out, "truncation", [done.row() for done in results], report_text(results))
    if options.replay is not None:
        for name, value in results[0].row().items():
            print(f"{name:>18}  {value}")
        return 0 if results[0].bounded else 1
    return 0 if share_bounded(results) >= REQUIRED else 1


def validate(case: StressCase, model: Path, limit: float) -> Validation:
    """Solve a case, estimate its truncation error and find the truth; `limit`: seconds for each whole curve."""
    from rom.linear_algebra.threads import one_blas_thread

    with one_blas_thread():
        try:
            problem = problem_of(case, model)
            began = time.perf_counter()
            branch = problem.branch(case.harmonics, limit)
            solved = time.perf_counter()
            if not branch.termination.complete or not branch.peak_indices:
                return Validation(case, f"no peak: {branch.termination.message}")
            peak = max((branch.points[place] for place in branch.peak_indices), key=problem.height)
            if max(problem.height(end) for end in (branch.points[0], branch.points[-1])) > problem.height(peak):
                return Validation(case, "no peak: the amplitude is higher at an end of the range")
            estimate = estimate_of(problem, branch)
            estimated = time.perf_counter()
            truth = truth_of(problem, branch, limit)
        except OutOfTimeError as error:
            return Validation(case, str(error))
    hertz = peak.omega / (2.0 * np.pi)
    seconds = (solved - began, estimated - solved)
    estimates = (estimate.error, estimate.motion_error, estimate.branch)
    return Validation(case, "", hertz, problem.height(peak), *estimates, truth, *seconds)


def share_bounded(results: Sequence[Validation]) -> float:
    """Part of the cases with a truth whose error is bounded."""
    return float(np.mean([result.bounded for result in results if not result.left_out]))


def report_text(results: Sequence[Validation]) -> str:
    """Counts by H, convergence of the truth, cost, and every case that is not bounded, far over or left out."""
    judged = [result for result in results if not result.left_out]
    header = ("case", *PARAMETERS, "peak m", "true m", "error", "estimate", "branch")
    odd = []
    for r in judged:
        if not r.bounded or r.far_over:
            numbers = (f"{r.height:.4g}", f"{r.truth.curve:.4g}", f"{r.error:.2g}", f"{r.estimate:.2g}", r.branch)
            odd.append((r.case.index, *r.case.shown(), *numbers))
    left_out = [f"* case {r.case.index}, H = {r.case.harmonics}: {r.left_out}" for r in results if r.left_out]
    parts = [
        f"# Truncation error, hard cases of seed {results[0].case.seed}",
        f"{len(results)} cases, {len(judged)} with a truth. True error at most {FACTOR:g} times the estimate in "
        f"{sum(r.bounded for r in judged)} of {len(judged)}; estimate over {MUCH:g} times the true error in "
        f"{sum(r.far_over for r in judged)}; unknown in {sum(not r.known for r in judged)}. Of the motion at the "
        f"peak, on whatever branch: {sum(r.motion_bounded for r in judged)} bounded.",
        _by_branch(judged),
        _by_harmonics(judged),
        _about_the_truth(judged),
        _cost(judged),
        "## Not bounded, unknown or far over",
        markdown_table(header, odd) if odd else "None.",
        "## Left out",
        "\n".join(left_out) or "None.",
    ]
    return "\n\n".join(parts) + "\n"


def _by_harmonics(judged: Sequence[Validation]) -> str:
    header = ("H", "cases", "bounded", "far over", "unknown", "median true error", "median estimate / true error")
    rows = []
    for harmonics in sorted({result.case.harmonics for result in judged}):
        chosen = [result for result in judged if result.case.harmonics == harmonics]
        ratios = [r.estimate / r.error for r in chosen if r.known and r.error > FLOOR]
        counts = (sum(r.bounded for r in chosen), sum(r.far_over for r in chosen), sum(not r.known for r in chosen))
        median = f"{np.median([r.error for r in chosen]):.1e}"
        rows.append((harmonics, len(chosen), *counts, median, f"{np.median(ratios):.2f}" if ratios else ""))
    return markdown_table(header, rows)


def _by_branch(judged: Sequence[Validation]) -> str:
    header = ("truncation_branch", "cases", "bounded", "far over", "motion bounded")
    rows = []
    for branch in ("kept", "detached", "lost"):
        chosen = [result for result in judged if result.branch == branch]
        counts = (
            sum(r.bounded for r in chosen),
            sum(r.far_over for r in chosen),
            sum(r.motion_bounded for r in chosen),
        )
        rows.append((branch, len(chosen), *counts))
    return markdown_table(header, rows)


def _about_the_truth(judged: Sequence[Validation]) -> str:
    truths = [r.truth for r in judged]
    steps = sorted({truth.harmonics for truth in truths}, reverse=True)
    solved = ", ".join(f"{sum(truth.harmonics == n for truth in truths)} with {n}" for n in steps)
    changes = [abs(r.truth.before / r.truth.height - 1.0) / r.error for r in judged if r.error > FLOOR]
    off = sum(truth.curve < (1.0 - FLOOR) * truth.height for truth in truths)
    seen = sum(r.branch != "kept" for r in judged if r.truth.curve < (1.0 - FLOOR) * r.truth.height)
    converged = sum(value <= ENOUGH_TRUTH for value in changes)
    return (
        f"Harmonics of the truth: {solved}. Its last change is below {ENOUGH_TRUTH:g} of the true error in "
        f"{converged} of {len(changes)} cases (median {np.median(changes):.1e}; errors below {FLOOR:g} not counted). "
        f"In {off} cases the branch of the peak has detached from the curve with more harmonics and is higher than "
        f"that curve; {seen} of them are said to be detached or lost."
    )


def _cost(judged: Sequence[Validation]) -> str:
    shares = np.array([result.estimate_seconds / result.curve_seconds for result in judged])
    return (
        f"Cost: median {np.median(shares):.0%} of the time of the curve, at most {np.quantile(shares, 0.9):.0%} in "
        f"90 % of the cases; {sum(r.estimate_seconds for r in judged):.0f} s for curves of "
        f"{sum(r.curve_seconds for r in judged):.0f} s in all."
    )


if __name__ == "__main__":
    sys.exit(main())

"""The estimate of the truncation error against 31 harmonics, on cases from the hard corner of the stability matrix.

    python benchmarks/truncation.py                        # 100 cases, some 40 minutes on one core
    python benchmarks/truncation.py --seed 3 --jobs 2      # other cases, two processes
    python benchmarks/truncation.py --replay 17            # one of them again

Case i is solved with 1, 3, 5, 7 harmonics in turn. The true error is that of the highest peak: with a wider curve
traced over the whole range, its highest peaks and the peak at hand are carried to 31 harmonics in steps, each located
again; the higher of the two is the truth. Writes truncation.csv, truncation.md and truncation.png into
out/bench/truncation. Exit status 1 if the estimate bounds the true error within a factor of 3 in less than 95 % of
the cases.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from stress_cases import StressCase, draw_cases
from stress_models import reduced_models
from stress_running import each, positive, write_csv
from stress_solving import OutOfTimeError
from truncation_report import Validation, draw, report_text, share_bounded
from truncation_truth import problem_of, truth_of

from pipeline.process.progress import Reporter

HOUSE = Path(__file__).resolve().parents[1]
HARMONICS = (1, 3, 5, 7)
REQUIRED = 0.95  # part of the cases that must be bounded


def main(arguments: list[str] | None = None) -> int:
    """Validate, or replay one case; the exit status."""
    options = _parser().parse_args(arguments)
    cases = [replace(c, harmonics=HARMONICS[c.index % 4]) for c in draw_cases(options.cases, options.seed, hard=True)]
    if options.replay is not None:
        cases = [cases[options.replay]]
    models = reduced_models(options.scene, (case.angle for case in cases), options.out / "models")
    results = sorted(_validated(cases, models, options), key=lambda result: result.case.index)
    if options.replay is not None:
        for name, value in results[0].row().items():
            print(f"{name:>18}  {value}")
        return 0 if results[0].bounded else 1
    write_csv(options.out / "truncation.csv", results)
    report = report_text(results)
    (options.out / "truncation.md").write_text(report, encoding="utf-8")
    draw(options.out / "truncation.png", [result for result in results if not result.left_out])
    print(report)
    return 0 if share_bounded(results) >= REQUIRED else 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="The estimate of the truncation error against 31 harmonics.")
    parser.add_argument("--cases", type=positive, default=100, help="how many to draw (100)")
    parser.add_argument("--seed", type=int, default=1, help="another seed draws other cases (1)")
    parser.add_argument("--jobs", type=positive, default=1, help="worker processes, one BLAS thread each (1)")
    parser.add_argument("--limit", type=float, default=60.0, help="seconds that a curve may take (60)")
    parser.add_argument("--scene", type=Path, default=HOUSE / "scenes" / "figure5.toml", help="whose blade to use")
    parser.add_argument("--out", type=Path, default=HOUSE / "out" / "bench" / "truncation", help="output folder")
    parser.add_argument("--replay", type=int, metavar="INDEX", help="this case of the seed only")
    return parser


def _validated(
    cases: list[StressCase], models: dict[float, Path], options: argparse.Namespace
) -> Iterator[Validation]:
    """Results as they come, behind a progress bar."""
    with Reporter().counting("cases", len(cases)) as counter:
        for result in each(validate, cases, models, options.limit, options.jobs):
            said = result.left_out or f"error {result.error:.2g}, estimate {result.estimate:.2g}"
            counter.done(f"case {result.case.index}, H = {result.case.harmonics}: {said}")
            yield result


def validate(case: StressCase, model: Path, limit: float) -> Validation:
    """Solve a case, estimate its truncation error and find the truth; `limit`: seconds for each whole curve."""
    from threadpoolctl import threadpool_limits

    from nonlinear.harmonic_selection.truncation_error import TruncationErrorEstimator

    with threadpool_limits(1):
        try:
            problem = problem_of(case, model)
            began = time.perf_counter()
            trace = problem.trace(case.harmonics, limit)
            traced = time.perf_counter()
            if not trace.termination.complete or not trace.peak_indices:
                return Validation(case, f"no peak: {trace.termination.message}")
            peak = max((trace.points[place] for place in trace.peak_indices), key=problem.height)
            if max(problem.height(end) for end in (trace.points[0], trace.points[-1])) > problem.height(peak):
                return Validation(case, "no peak: the amplitude is higher at an end of the range")
            estimator = TruncationErrorEstimator(problem.continuation, problem.balances)
            estimate = estimator.at_peak(trace.points, trace.peak_indices)
            estimated = time.perf_counter()
            truth = truth_of(problem, trace, limit)
        except OutOfTimeError as error:
            return Validation(case, str(error))
    return Validation(
        case=case,
        left_out="",
        frequency_hz=peak.omega / (2.0 * np.pi),
        height=problem.height(peak),
        estimate=estimate,
        truth=truth.height,
        truth_harmonics=truth.harmonics,
        truth_before=truth.before,
        truth_of_curve=truth.curve,
        reference=truth.reference,
        curve_seconds=traced - began,
        estimate_seconds=estimated - traced,
        truth_seconds=time.perf_counter() - estimated,
    )


if __name__ == "__main__":
    sys.exit(main())

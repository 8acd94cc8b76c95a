"""The stability matrix: many hard cases solved, every one written down.

    make stress                                     # 200 cases, out/stress
    make stress STRESS="--full --seed 5 --jobs 2"   # 1000 cases
    python benchmarks/stress.py --replay 17 --seed 5 --draw   # one of them again, with its curve as a picture

Exit status 1 if a curve is incomplete.
"""

from __future__ import annotations

import argparse
import sys
from bisect import insort
from collections.abc import Iterator
from pathlib import Path

from stress_cases import StressCase, draw_cases
from stress_models import reduced_models
from stress_report import print_summary, summary_text
from stress_running import each, positive, write_csv
from stress_solving import StressResult, attempt, solve_case

from pipeline.process.progress import Reporter

HOUSE = Path(__file__).resolve().parents[1]
FULL = 1000


def main(arguments: list[str] | None = None) -> int:
    """Run the matrix, or replay one case; the exit status."""
    options = _parser().parse_args(arguments)
    if options.replay is not None:
        return _replay(options)
    cases = draw_cases(FULL if options.full else options.cases, options.seed, options.hard, options.law)
    models = reduced_models(options.scene, (case.angle for case in cases), options.out / "models")
    results: list[StressResult] = []
    for result in _solved(cases, models, options):
        insort(results, result, key=lambda done: done.case.index)
        write_csv(options.out / "cases.csv", results)  # what is done is kept if the run is stopped
    (options.out / "summary.md").write_text(summary_text(results), encoding="utf-8")
    from stress_picture import draw_matrix

    draw_matrix(options.out / "matrix.png", results)
    print_summary(results)
    print(f"written: {', '.join(str(options.out / name) for name in ('cases.csv', 'summary.md', 'matrix.png'))}")
    return 0 if all(result.complete for result in results) else 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="The stability matrix: hard cases solved, every one written down.")
    parser.add_argument("--cases", type=positive, default=200, help="how many to draw (200)")
    parser.add_argument("--full", action="store_true", help=f"draw {FULL}")
    parser.add_argument("--seed", type=int, default=1, help="another seed draws other cases (1)")
    parser.add_argument("--hard", action="store_true", help="from the corner where curves have turning points")
    parser.add_argument("--law", choices=("two_sliders", "cone"), default="two_sliders", help="of the friction")
    parser.add_argument("--jobs", type=positive, default=1, help="worker processes, one BLAS thread each (1)")
    parser.add_argument("--limit", type=float, default=600.0, help="seconds that a case may take (600)")
    parser.add_argument("--scene", type=Path, default=HOUSE / "scenes" / "figure5.toml", help="whose blade to use")
    parser.add_argument("--out", type=Path, default=HOUSE / "out" / "stress", help="output folder")
    parser.add_argument("--replay", type=int, metavar="INDEX", help="solve this case of the seed only")
    parser.add_argument("--draw", action="store_true", help="with --replay: draw its curve")
    return parser


def _solved(
    cases: list[StressCase], models: dict[float, Path], options: argparse.Namespace
) -> Iterator[StressResult]:
    """Results as they come, behind a progress bar."""
    with Reporter().counting("cases", len(cases)) as counter:
        for result in each(solve_case, cases, models, options.limit, options.jobs):
            counter.done(f"case {result.case.index}: {result.message}, {result.seconds:.2f} s")
            yield result


def _replay(options: argparse.Namespace) -> int:
    case = draw_cases(options.replay + 1, options.seed, options.hard, options.law)[options.replay]
    model = reduced_models(options.scene, [case.angle], options.out / "models")[case.angle]
    result, curve = attempt(case, model, options.limit)
    for name, value in result.row().items():
        print(f"{name:>18}  {value}")
    if options.draw and curve is not None:
        from stress_picture import draw_curve

        path = options.out / f"replay_{options.seed}_{case.index}.png"
        draw_curve(path, curve, result)
        print(f"written: {path}")
    return 0 if result.complete else 1


if __name__ == "__main__":
    sys.exit(main())

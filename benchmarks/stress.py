"""The test matrix: many hard cases solved, every one recorded.

    make stress                                     # 200 cases, out/stress
    make stress STRESS="--full --seed 5 --jobs 2"   # 1000 cases
    make stress STRESS="--interfaces --cases 100"   # random blades with one to three contact interfaces
    python benchmarks/stress.py --replay 17 --seed 5 --draw   # one of them again, with a picture of its curve

Writes cases.csv and summary.md. Exit status 1 if a curve is incomplete.
"""

from __future__ import annotations

import argparse
import sys
from bisect import insort
from collections.abc import Sequence
from pathlib import Path

from problems import models_by_angle
from stress_cases import draw_cases
from stress_interfaces import draw_interface_cases
from stress_report import draw_curve, interfaces_text, summary_text
from stress_solving import Case, StressResult, attempt, each, positive, solve_case
from tables import ROOT, options_of, write_rows

FULL = 1000


def main(arguments: list[str] | None = None) -> int:
    """Run the matrix, or replay one case; the exit status."""
    parser = options_of(__doc__, "stress", "figure5.toml")
    parser.set_defaults(out=ROOT / "out" / "stress")
    parser.add_argument("--cases", type=positive, default=200, help="how many to draw (200)")
    parser.add_argument("--full", action="store_true", help=f"draw {FULL}")
    parser.add_argument("--seed", type=int, default=1, help="another seed draws other cases (1)")
    parser.add_argument("--interfaces", action="store_true", help="random blades with several contact interfaces")
    parser.add_argument("--hard", action="store_true", help="from the corner where curves have turning points")
    parser.add_argument("--law", choices=("two_sliders", "cone"), default="two_sliders", help="of the friction")
    parser.add_argument("--jobs", type=positive, default=1, help="worker processes, one BLAS thread each (1)")
    parser.add_argument("--limit", type=float, default=600.0, help="seconds that a case may take (600)")
    parser.add_argument("--replay", type=int, metavar="INDEX", help="solve this case of the seed only")
    parser.add_argument("--draw", action="store_true", help="with --replay: draw its curve")
    options = parser.parse_args(arguments)
    return _run(options) if options.replay is None else _replay(options)


def _run(options: argparse.Namespace) -> int:
    cases, models = _drawn(options, FULL if options.full else options.cases)
    results: list[StressResult] = []
    for result in each(solve_case, cases, models, options.limit, options.jobs):
        insort(results, result, key=lambda done: done.case.index)
        write_rows(options.out / "cases.csv", [done.row() for done in results])  # also for a run that is stopped
        place = f"{len(results)} of {len(cases)}, case {result.case.index}"
        print(f"{place}: {result.message}, {result.seconds:.2f} s", file=sys.stderr)
    text = interfaces_text(results) if options.interfaces else summary_text(results)
    (options.out / "summary.md").write_text(text, encoding="utf-8")
    print(text)
    return 0 if all(result.complete for result in results) else 1


def _drawn(options: argparse.Namespace, count: int, first: int = 0) -> tuple[Sequence[Case], list[Path | None]]:
    """The cases of a seed, and the models of those from a first one on that have none of their own."""
    if options.interfaces:
        cases = draw_interface_cases(count, options.seed)
        return cases, [None] * (count - first)
    drawn = draw_cases(count, options.seed, options.hard, options.law)
    models = models_by_angle(options.scene, (case.angle for case in drawn[first:]), options.out / "models")
    return drawn, [models[case.angle] for case in drawn[first:]]


def _replay(options: argparse.Namespace) -> int:
    cases, models = _drawn(options, options.replay + 1, options.replay)
    case = cases[options.replay]
    result, curve = attempt(case, models[-1], options.limit)
    for name, value in result.row().items():
        print(f"{name:>18}  {value}")
    if options.draw and curve is not None:
        path = options.out / f"replay_{options.seed}_{case.index}.png"
        draw_curve(path, curve, result)
        print(f"written: {path}")
    return 0 if result.complete else 1


if __name__ == "__main__":
    sys.exit(main())

"""What people wait for, before and after, in one table: `python benchmarks/run_times.py` from the project folder.

    python benchmarks/run_times.py                              # this state beside the stored one: some minutes
    python benchmarks/run_times.py --only default extras        # cases whose names begin so
    python benchmarks/run_times.py --dear --without fresh       # also those that take minutes each, but not these
    python benchmarks/run_times.py --project ../older --store benchmarks/before_after/before.json
    python benchmarks/run_times.py --before out/older.json      # beside another state, measured before
    python benchmarks/run_times.py --report                     # measure nothing: the table of what was measured

Every case runs in a process of its own. Answers are added to out/bench/run_times/run_times.json, the tables of both
states are run_times.csv and run_times.md there. Times of two states compare only on the same machine. pyHarm is
measured where `make bench-peers` has installed it. Exit status 1 if a case failed.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from before_after.plan import CASES, DEAR, GRIDS, SCENES, Settings
from before_after.pyharm import pyharm_points
from before_after.report import page, report, table
from before_after.state import State
from tables import OUT, ROOT, load, machine_facts, write_results

BEFORE = Path(__file__).parent / "before_after" / "before.json"
Stored = dict[str, Any]


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure a state, add it to its file and write the table; the exit status."""
    options = _parser().parse_args(arguments)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # by an exception, which ends the process of a case too
    options.out.mkdir(parents=True, exist_ok=True)
    target = options.store or options.out / "run_times.json"
    state = read(target)
    if not options.report:
        names = chosen(options.only, options.dear, options.without)
        settings = Settings(
            options.out / "models", options.curve_limit, options.dear_limit, options.limit, tuple(options.hard_cases)
        )
        measure(State(options.project.resolve()), settings, names, state, target)
    if options.store is None:
        before = read(options.before)
        write_results(options.out, "run_times", table(before, state), report(before, state))
        (options.out / "page.md").write_text(page(before, state), encoding="utf-8")
    return 1 if state["failures"] else 0


def _parser() -> argparse.ArgumentParser:
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=form)
    names = ", ".join([*CASES, *DEAR])
    parser.add_argument("--only", nargs="+", metavar="NAME", help=f"cases whose names begin so: {names}")
    parser.add_argument("--without", nargs="+", default=[], metavar="NAME", help="not those whose names begin so")
    parser.add_argument("--dear", action="store_true", help=f"also {', '.join(DEAR)}")
    parser.add_argument("--project", type=Path, default=ROOT, help="root of the state to measure (this one)")
    parser.add_argument("--store", type=Path, help="JSON file of the state; no table is written then")
    parser.add_argument("--before", type=Path, default=BEFORE, help="JSON file of the state before")
    parser.add_argument("--report", action="store_true", help="only the table")
    parser.add_argument("--hard-cases", type=int, nargs="+", default=list(Settings.hard_cases), metavar="INDEX")
    parser.add_argument("--curve-limit", type=float, default=30.0, help="seconds of a curve of the hard corner (30)")
    parser.add_argument("--dear-limit", type=float, default=120.0, help="seconds of a curve of the dear cases (120)")
    parser.add_argument("--limit", type=float, default=1200.0, help="seconds of a case (1200)")
    parser.add_argument("--out", type=Path, default=OUT / "run_times", help="output folder")
    return parser


def chosen(only: Sequence[str] | None, dear: bool, without: Sequence[str] = ()) -> list[str]:
    """Names of the cases: all but the dear ones, or those that begin with one of `only`; not those of `without`.

    Raises
    ------
    SystemExit
        Nothing begins so.
    """
    names = [*CASES, *(DEAR if dear or only else ())]
    names = [name for name in names if name.startswith(tuple(only or "")) or not only]
    names = [name for name in names if not name.startswith(tuple(without))]
    if not names:
        raise SystemExit(f"--only: no case begins with {' or '.join(only or ())}")
    return names


def read(file: Path) -> Stored:
    """What was measured of a state so far."""
    empty: Stored = {"cases": {}, "failures": {}}
    return json.loads(file.read_text(encoding="utf-8")) if file.exists() else empty


def measure(state: State, settings: Settings, names: Sequence[str], found: Stored, target: Path) -> None:
    """Run the cases one after another; the file holds each as soon as it is measured."""
    facts = machine_facts()
    found |= {"commit": state.commit(), "machine": f"{facts['machine']}, {facts['system']}"}
    grids = list(GRIDS) if any(name == "growth" for name in names) else []
    peers = "peers" in names
    state.measured("prepare", settings.models, 3600.0, scenes=list(SCENES), grids=grids, peers=peers)
    for name in names:
        start, before = time.perf_counter(), load()
        try:
            found["cases"][name] = (CASES | DEAR)[name](state, settings)
            found["failures"].pop(name, None)
            if name == "peers" and state.root == ROOT:
                found["cases"]["pyharm"] = pyharm_points(found["cases"][name]["cases"], settings.models)
        except Exception as error:  # a case that breaks is a finding, not the end of the run
            found["cases"].pop(name, None)
            found["failures"][name] = f"{type(error).__name__}: {error}"
        seconds = time.perf_counter() - start
        when = {
            "commit": found["commit"],
            "date": facts["date"],
            "load": round(before, 1),
            "seconds": round(seconds, 1),
        }
        found.setdefault("measured", {})[name] = when
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(json.dumps(found, indent=1), encoding="utf-8")
        said = found["failures"].get(name, "measured")
        print(f"{name}: {said}, {seconds:.0f} s", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())

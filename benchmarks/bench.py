"""Run time against error: `make bench`, or `python benchmarks/bench.py` from the project folder.

    python benchmarks/bench.py                  # every study, some ten minutes: out/bench
    python benchmarks/bench.py --only modes     # one of them; may be given several times
    python benchmarks/bench.py --full           # more points and finer meshes, about an hour and 12 GB
    python benchmarks/bench.py --draw           # measure nothing: tables and figures again from the CSV files
    python benchmarks/bench.py --docs           # measure nothing: docs/performance.md from the CSV files

A study leaves NAME.csv, NAME.md, NAME.png and NAME.svg. References on fine meshes are kept in out/bench/store.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from machine import this_machine
from work_precision.curves import CurveCase
from work_precision.document import update_document, with_block
from work_precision.figure import save_figure
from work_precision.study import Study
from work_precision.summary import summary
from work_precision.tables import markdown, read_csv, write_csv

HOUSE = Path(__file__).resolve().parents[1]
SCENE = HOUSE / "scenes" / "dummy.toml"
LIFT_OFF = (  # contacts that open in a part of the period: the hardest for harmonics and integration
    CurveCase(SCENE, -20e-6, "default, v0 = -20 µm"),
    CurveCase(HOUSE / "scenes" / "figure6.toml", 40e-6, "figure 6, v0 = 40 µm"),
)
REPORTS = ("family", "reduction", "skipping", "parallel", "scaling", "peers", "linear")  # of the other benchmarks
THREADS = 1  # the pipeline asks for one as well: its matrices are small


def main(arguments: list[str] | None = None) -> int:
    """Measure, draw or write the document; the exit status."""
    options = _parser().parse_args(arguments)
    names = options.only or list(STUDIES)
    if not (options.docs or options.draw):
        _measure(names, options.full, options.out)
    if options.draw:
        for name in names:
            _write(read_csv(options.out / f"{name}.csv"), options.out)
    if options.docs:
        reports = {name: options.out / name / f"{name}.md" for name in REPORTS}
        written = update_document(HOUSE / "docs", options.out, list(STUDIES), reports)
        readme = HOUSE / "README.md"
        block = f"{this_machine(THREADS).short()}\n\n{summary(options.out)}"
        readme.write_text(with_block(readme.read_text(encoding="utf-8"), "summary", block), encoding="utf-8")
        print(f"written: {', '.join(str(path) for path in (*written, readme))}")
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Run time against error of every stage and of the whole pipeline.")
    parser.add_argument("--only", action="append", choices=list(STUDIES), metavar="NAME", help=", ".join(STUDIES))
    parser.add_argument("--full", action="store_true", help="more points, finer meshes and references")
    parser.add_argument("--draw", action="store_true", help="only tables and figures, from what was measured")
    parser.add_argument("--docs", action="store_true", help="only docs/performance.md, from what was measured")
    parser.add_argument("--out", type=Path, default=HOUSE / "out" / "bench", help="output folder")
    return parser


def _measure(names: list[str], full: bool, out: Path) -> None:
    from threadpoolctl import threadpool_limits

    out.mkdir(parents=True, exist_ok=True)
    with threadpool_limits(limits=THREADS):
        warm_up(LIFT_OFF[0])
        for name in names:
            start = time.perf_counter()
            study = STUDIES[name](full, out / "store")
            _write(replace(study, facts=this_machine(THREADS).facts()), out)
            print(f"{name}: {len(study.rows)} settings in {time.perf_counter() - start:.0f} s", file=sys.stderr)


def _write(study: Study, out: Path) -> None:
    text = f"# {study.title}\n\n{markdown(study)}\n"
    write_csv(out / f"{study.name}.csv", study)
    (out / f"{study.name}.md").write_text(text, encoding="utf-8")
    save_figure(study, out)
    print(text)


def warm_up(case: CurveCase) -> None:
    """Load the libraries and compile the kernels, on a mesh that is too coarse for anything else."""
    from work_precision.curves import problem_on
    from work_precision.stages import built_mesh, with_values

    from pipeline.scene.reading import read_scene

    coarse = {"mesh.size": 0.01, "mesh.element": "hex8", "rom.modes": 5, "contact.interference": case.interference}
    scene = with_values(read_scene(case.scene).first, coarse)
    with built_mesh(scene) as mesh:
        problem = problem_on(mesh.reduced({}).file, scene)
    problem.solve(harmonics=3, stability="floquet", truncation=True)
    problem.solve(integration="sampled", samples=32)


def _mesh(full: bool, store: Path) -> Study:
    from work_precision import mesh

    return mesh.mesh_study(SCENE, mesh.FULL if full else mesh.USUAL, store)


def _modes(full: bool, store: Path) -> Study:
    from work_precision import modes

    return modes.modes_study(SCENE, modes.FULL if full else modes.USUAL)


def _harmonics(full: bool, store: Path) -> Study:
    from work_precision import harmonics

    return harmonics.harmonics_study(LIFT_OFF, harmonics.FULL if full else harmonics.USUAL, store)


def _integration(full: bool, store: Path) -> Study:
    from work_precision import integration

    return integration.integration_study(LIFT_OFF, integration.FULL if full else integration.USUAL, store)


def _continuation(full: bool, store: Path) -> Study:
    from work_precision import continuation

    return continuation.continuation_study(LIFT_OFF, continuation.FULL if full else continuation.USUAL, store)


def _whole(full: bool, store: Path) -> Study:
    from work_precision import whole

    return whole.whole_study(SCENE, whole.FULL if full else whole.USUAL, store)


STUDIES: dict[str, Callable[[bool, Path], Study]] = {
    "mesh": _mesh,
    "modes": _modes,
    "harmonics": _harmonics,
    "integration": _integration,
    "continuation": _continuation,
    "whole": _whole,
}

if __name__ == "__main__":
    sys.exit(main())

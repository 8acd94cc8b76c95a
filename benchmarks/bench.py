"""Run time against error: `make bench`, or `python benchmarks/bench.py` from the project folder.

    python benchmarks/bench.py                  # every study, some minutes: out/bench
    python benchmarks/bench.py --only modes     # one of them; may be given several times
    python benchmarks/bench.py --docs           # measure nothing: docs/developers/performance.md from the CSV files

A study leaves NAME.csv, NAME.md and NAME.png. References on fine meshes are cached in out/bench/store.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from document import update_document
from problems import built_mesh, curve_problem, scene_with
from tables import OUT, ROOT, machine_facts
from work_precision import curve_studies, mesh, modes, whole
from work_precision.curve_studies import CurveCase
from work_precision.figure import save_figure
from work_precision.study import Study, markdown, write_csv

SCENE = ROOT / "scenes" / "dummy.toml"
LIFT_OFF = (  # contacts that open in a part of the period: the hardest for harmonics and integration
    CurveCase(SCENE, -20e-6, "default, v0 = -20 µm"),
    CurveCase(ROOT / "scenes" / "figure6.toml", 40e-6, "figure 6, v0 = 40 µm"),
)
STUDIES = ("mesh", "modes", "harmonics", "integration", "continuation", "whole")
# of the other benchmarks
REPORTS = (
    "run_times",
    "family",
    "reduction",
    "own_mesh",
    "parallel",
    "scaling",
    "linear",
    "optimum",
    "explore_latency",
)
PLANS = {
    "harmonics": curve_studies.harmonics_plan((1, 2, 3, 5, 7, 9, 11, 15), (1e-1, 1e-2, 1e-3), 17, 21),
    "integration": curve_studies.integration_plan(3, [2**n for n in (5, 7, 9, 11, 12)]),
    "continuation": curve_studies.continuation_plan(
        3, (1.0, 0.5, 0.25, 0.125, 0.06, 0.03), (1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-13), 0.02, 0.01
    ),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure or write the document; the exit status."""
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=form)
    parser.add_argument("--only", action="append", choices=STUDIES, metavar="NAME", help=", ".join(STUDIES))
    parser.add_argument(
        "--docs", action="store_true", help="only docs/developers/performance.md, from what was measured"
    )
    parser.add_argument("--out", type=Path, default=OUT, help="output folder")
    options = parser.parse_args(arguments)
    if options.docs:
        written = update_document(ROOT / "docs" / "developers" / "performance.md", options.out, STUDIES, REPORTS)
        print(f"written: {', '.join(str(path) for path in written)}")
    else:
        measure(options.only or STUDIES, options.out)
    return 0


def measure(names: Sequence[str], out: Path) -> None:
    """Run the studies with one BLAS thread, as the pipeline does, and write each."""
    from rom.linear_algebra.threads import one_blas_thread

    out.mkdir(parents=True, exist_ok=True)
    with one_blas_thread():
        warm_up(LIFT_OFF[0])
        for name in names:
            start = time.perf_counter()
            made = replace(study(name, out / "store"), facts=machine_facts())
            write(made, out)
            print(f"{name}: {len(made.rows)} settings in {time.perf_counter() - start:.0f} s", file=sys.stderr)


def study(name: str, store: Path) -> Study:
    """One of `STUDIES`."""
    if name == "mesh":
        return mesh.mesh_study(SCENE, mesh.DEFAULT, store)
    if name == "modes":
        return modes.modes_study(SCENE, modes.DEFAULT)
    if name == "whole":
        return whole.whole_study(SCENE, whole.DEFAULT, store)
    return curve_studies.curve_study(LIFT_OFF, PLANS[name], store)


def write(made: Study, out: Path) -> None:
    """The study as CSV, Markdown and figure."""
    text = f"# {made.title}\n\n{markdown(made)}\n"
    write_csv(out / f"{made.name}.csv", made)
    (out / f"{made.name}.md").write_text(text, encoding="utf-8")
    save_figure(made, out / f"{made.name}.png")
    print(text)


def warm_up(case: CurveCase) -> None:
    """Load the libraries and compile the kernels, on a mesh that is too coarse for anything else."""
    coarse = {"mesh.size": 0.01, "mesh.element": "hex8", "rom.modes": 5, "contact.interference": case.interference}
    scene = scene_with(case.scene, coarse)
    with built_mesh(scene) as built:
        problem = curve_problem(built.reduced().file, scene)
    problem.solve(harmonics=3, stability="ring", truncation=True)
    problem.solve(integration="sampled", samples=32)


if __name__ == "__main__":
    sys.exit(main())

"""What a designer concludes from a sweep of main branches, and from the optimum of the worst motion, on three blades.

    python benchmarks/design_conclusions.py                        # all blades: out/bench/design_conclusions
    python benchmarks/design_conclusions.py --blades straight      # one of them, the others as measured before
    python benchmarks/design_conclusions.py --docs                 # and the table into docs/design_conclusions.md

"Sweep": eight values of the interference, of each the peak of the main branch, stable or not; the lowest is chosen.
"Optimum": `find_optimum` over the same range with all options of the scene. Of each choice the response is solved
with all options: isolated branches, stability against all nodal diameters, time integration where no periodic motion
is stable. From its worst motion the ring is integrated in time once more, with steps half as long.
"""

from __future__ import annotations

import csv
import math
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from document import with_block
from problems import cached_model, scene_with
from tables import ROOT, machine_line, markdown_table, options_of, write_results
from worst_motions import SolvedCurve, in_time

if TYPE_CHECKING:
    from nonlinear import Optimum
    from nonlinear.problem import Problem

NAME = "design_conclusions"
PAGE = ROOT / "docs" / f"{NAME}.md"
UM = 1e-6
ALONE: dict[str, Any] = {"detached": False, "stability": "folds", "truncation": False, "search": "off"}
TOLERANCE = 2.0 * UM  # of the interference in manufacture


@dataclass(frozen=True)
class Blade:
    """A blade with the interferences that a designer would try.

    Attributes
    ----------
    title : str
        What it is.
    scene : Path
        Scene file.
    changes : mapping of str to value
        Values of dotted keys in place of those of the scene.
    swept : tuple of float
        Interferences, m; their ends are the range of the optimum.
    """

    title: str
    scene: Path
    changes: Mapping[str, Any]
    swept: tuple[float, ...]


_DUMMY, _FIGURE5 = (ROOT / "scenes" / f"{name}.toml" for name in ("dummy", "figure5"))
_SWEPT = tuple(value * UM for value in (-5.0, -2.0, 0.0, 2.0, 5.0, 10.0, 20.0, 60.0))
BLADES = {
    "default": Blade("default blade, 70°, EO 36", _DUMMY, {"response.harmonics": 3}, _SWEPT),
    "straight": Blade("default blade, 180°, EO 36", _DUMMY, {"response.harmonics": 3, "shroud.angle": 180.0}, _SWEPT),
    "figure5": Blade(
        "blade of figure 5, 70°, EO 60",
        _FIGURE5,
        {},
        tuple(value * UM for value in (-8.0, 0.0, 1.0, 2.0, 3.0, 5.0, 15.0, 100.0)),
    ),
}


def main(arguments: list[str] | None = None) -> int:
    """Measure, write the table; the exit status."""
    from rom.linear_algebra.threads import one_blas_thread

    parser = options_of(__doc__, NAME)
    parser.add_argument("--blades", nargs="*", choices=tuple(BLADES), default=list(BLADES), help="which to measure")
    parser.add_argument("--docs", action="store_true", help="write the table into docs/design_conclusions.md")
    options = parser.parse_args(arguments)
    rows = read_rows(options.out / f"{NAME}.csv")
    with one_blas_thread():
        for name in options.blades:
            rows = [row for row in rows if row["name"] != name] + rows_of(name, options.out.parent / "store")
    rows.sort(key=lambda row: list(BLADES).index(row["name"]))
    text = f"{machine_line()}\n\n{table(rows)}\n"
    write_results(options.out, NAME, rows, text)
    if options.docs:
        PAGE.write_text(with_block(PAGE.read_text(encoding="utf-8"), NAME, text), encoding="utf-8")
    return 0


def rows_of(name: str, store: Path) -> list[dict[str, Any]]:
    """Both conclusions on a blade."""
    from nonlinear import find_optimum
    from pipeline.stages.scene_to_solver import nonlinear_problem
    from rom import read_reduced_model

    blade = BLADES[name]
    scene = scene_with(blade.scene, blade.changes)
    model = read_reduced_model(cached_model(store, scene), with_basis=False)
    problem = nonlinear_problem(scene, model)
    start = time.process_time()
    chosen, promised = best_of_sweep(problem, blade.swept)
    swept_seconds = time.process_time() - start
    start = time.process_time()
    found = find_optimum(problem, "interference", min(blade.swept), max(blade.swept), _say)
    seconds = time.process_time() - start
    head = {"name": name, "blade": blade.title}
    return [
        head
        | {
            "conclusion": "sweep",
            "interference_m": chosen,
            "promised_m": promised,
            "seconds": round(swept_seconds, 1),
        }
        | {"kind": "lowest of eight", "within_low_m": math.nan, "within_high_m": math.nan, "harmonics": 0}
        | really(problem, chosen, blade.title)
        | {"tolerance_m": highest_near(found, chosen)},
        head
        | {"conclusion": "optimum", "interference_m": found.value, "promised_m": found.amplitude_m}
        | {"seconds": round(seconds, 1), "kind": found.kind, "harmonics": found.harmonics}
        | {"within_low_m": found.within[0], "within_high_m": found.within[1]}
        | really(problem, found.value, blade.title)
        | {"tolerance_m": highest_near(found, found.value)},
    ]


def best_of_sweep(problem: Problem, values: Sequence[float]) -> tuple[float, float]:
    """The value with the lowest peak of the main branch, and that peak, m."""
    from nonlinear import forced_response
    from nonlinear.peak_curves.parameter_family import with_parameter

    peaks = []
    for value in values:
        modal, contact, wave, options = with_parameter(problem, "interference", value)
        peak = forced_response(modal, contact, wave, replace(options, **ALONE)).peak
        peaks.append(math.inf if peak is None else float(peak.amplitude_m))
        _say(f"sweep, {value:.3g} m: {peaks[-1]:.4g} m")
    lowest = int(np.argmin(peaks))
    return values[lowest], peaks[lowest]


def really(problem: Problem, value: float, title: str) -> dict[str, Any]:
    """The worst motion at a value by a response with all options, and what the ring does from there in time."""
    from nonlinear import forced_response
    from nonlinear.peak_curves.parameter_family import with_parameter
    from nonlinear.time_integration.ring import Ring

    modal, contact, wave, options = with_parameter(problem, "interference", value)
    curve = forced_response(modal, contact, wave, options)
    ring = Ring(modal, contact, wave, options.output)
    motion = in_time(SolvedCurve(title, f"{value:.4g} m", ring, options, curve))
    worst = curve.worst
    assert worst is not None  # the curve has points
    return {
        "persists_m": float(worst.amplitude_m),
        "at_hz": float(worst.frequency_hz),
        "branch": worst.branch,
        "motion": worst.motion,
        "open": worst.unresolved,
        "in_time_m": math.nan if motion is None else float(motion.amplitude_m),
        "truncation": float(curve.truncation_error),
    }


def highest_near(found: Optimum, value: float) -> float:
    """Highest worst motion over the range within the tolerance of a value, m."""
    near = np.linspace(max(found.low, value - TOLERANCE), min(found.high, value + TOLERANCE), 201)
    heights = found.envelope.at(near)
    return float(np.nanmax(heights)) if np.isfinite(heights).any() else math.nan


def read_rows(file: Path) -> list[dict[str, Any]]:
    """Rows of an earlier run, numbers as numbers."""
    if not file.exists():
        return []
    texts = ("name", "blade", "conclusion", "kind", "motion", "open")
    with file.open(encoding="utf-8", newline="") as source:
        found = csv.DictReader(source)
        return [{key: value if key in texts else float(value) for key, value in row.items()} for row in found]


def table(rows: Sequence[Mapping[str, Any]]) -> str:
    """The conclusions, amplitudes and interferences in micrometres."""
    head = ("blade", "conclusion", "v0 [µm]", "promised [µm]", "persists [µm]", "factor", "in time [µm]", "motion")
    return markdown_table(
        (*head, f"within ±{TOLERANCE / UM:g} µm [µm]", "10 % range [µm]", "processor time [s]"),
        [_line(row) for row in rows],
    )


def _line(row: Mapping[str, Any]) -> list[str]:
    at_least = ">= " if row["open"] else ""
    branch = "main branch" if int(row["branch"]) == 0 else "detached branch"
    within = [row[f"within_{side}_m"] / UM for side in ("low", "high")]
    return [
        row["blade"],
        f"{row['conclusion']}: {row['kind']}",
        f"{row['interference_m'] / UM:.4g}",
        f"{row['promised_m'] / UM:.4g}",
        f"{at_least}{row['persists_m'] / UM:.4g}",
        f"{row['persists_m'] / row['promised_m']:.3g}",
        f"{row['in_time_m'] / UM:.4g}" if math.isfinite(row["in_time_m"]) else "-",
        f"{row['motion']}, {branch}",
        f"{row['tolerance_m'] / UM:.4g}",
        f"{within[0]:.4g} to {within[1]:.4g}" if math.isfinite(within[0]) else "-",
        f"{row['seconds']:.3g}",
    ]


def _say(line: str) -> None:
    print(line, file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())

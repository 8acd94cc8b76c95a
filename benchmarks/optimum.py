"""The optimum of a parameter beside a sweep of single responses: `python benchmarks/optimum.py`.

    python benchmarks/optimum.py                                   # 200 values of the interference, 0 to 20 um
    python benchmarks/optimum.py --values 40 --harmonics 3         # fewer, each with 3 harmonics
    python benchmarks/optimum.py --angle 180 --over friction --low 0.05 --high 1

`find_optimum` and the sweep solve the same problem with all options of the scene: stability against all nodal
diameters, isolated branches, truncation error, time integration. The sweep has evenly spaced values, both ends
included; its worst motions are what the envelope is compared with. Processor seconds of one process, kernels compiled
beforehand. The sweep is kept in optimum_values.csv of the output folder and goes on where it was stopped.
"""

from __future__ import annotations

import csv
import math
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from problems import cached_model, scene_with
from tables import machine_line, markdown_table, options_of, table_of, write_results, write_rows

if TYPE_CHECKING:
    from nonlinear import Optimum
    from nonlinear.peak_curves.parameter_family import ParameterFamily

NAME = "optimum"
VALUES = f"{NAME}_values.csv"
AGREES = 0.01  # relative deviation of the envelope that counts as none
SWEEP = 200  # values of the sweep that the costs are compared with


@dataclass(frozen=True)
class SweptValue:
    """The worst motion at one value of the sweep.

    Attributes
    ----------
    value : float
        The parameter, SI units.
    worst_m, worst_hz : float
        Amplitude, m, and frequency, Hz, of the worst motion; NaN where none is known.
    motion : str
        "periodic" or "quasi-periodic".
    branch : int
        Its branch, 0: the main one.
    is_open : bool
        Whether it may be higher.
    peak_m : float
        Highest peak of the main branch, stable or not, m.
    harmonics : int
        Number of harmonics.
    seconds : float
        Processor time, s.
    """

    value: float
    worst_m: float
    worst_hz: float
    motion: str
    branch: int
    is_open: bool
    peak_m: float
    harmonics: int
    seconds: float


def main(arguments: list[str] | None = None) -> int:
    """Measure both and write the table; the exit status."""
    from rom.linear_algebra.threads import one_blas_thread

    options = _options(arguments)
    changes: dict[str, Any] = {} if options.angle is None else {"shroud.angle": options.angle}
    if options.harmonics:
        changes["response.harmonics"] = options.harmonics
    with one_blas_thread():
        family = family_of(options, changes)
        solved(family, 0.5 * (family.low + family.high))  # libraries loaded, kernels compiled
        swept = sweep(family, options.values, options.out)
        start = time.process_time()
        found = optimum_of(family)
        seconds = time.process_time() - start
        alone = solved(family, found.value)
    rows = [row_of(found, seconds, alone, swept)]
    write_results(options.out, NAME, rows, report(rows[0], found, swept, options.scene.name))
    return 0


def _options(arguments: list[str] | None) -> Any:
    parser = options_of(__doc__, NAME)
    parser.add_argument("--over", default="interference", help="the parameter, as of find_optimum")
    parser.add_argument("--low", type=float, default=0.0, help="its range, SI units")
    parser.add_argument("--high", type=float, default=20e-6)
    parser.add_argument("--values", type=int, default=SWEEP, help=f"of the sweep ({SWEEP})")
    parser.add_argument("--angle", type=float, help="shroud angle in place of that of the scene, degrees")
    parser.add_argument("--harmonics", type=int, help="in place of those of the scene")
    return parser.parse_args(arguments)


def family_of(options: Any, changes: dict[str, Any]) -> ParameterFamily:
    """The problems of a scene over the range."""
    from nonlinear.peak_curves.parameter_family import ParameterFamily
    from pipeline.stages.scene_to_solver import nonlinear_problem
    from rom import read_reduced_model

    scene = scene_with(options.scene, changes)
    model = read_reduced_model(cached_model(options.out.parent / "store", scene), with_basis=False)
    return ParameterFamily.over(nonlinear_problem(scene, model), options.over, options.low, options.high)


def optimum_of(family: ParameterFamily) -> Optimum:
    """The optimum over the range, with a line to stderr on each step."""
    from nonlinear import find_optimum

    return find_optimum(
        family.problem, family.name, family.low, family.high, lambda line: print(line, file=sys.stderr)
    )


def sweep(family: ParameterFamily, count: int, out: Path) -> list[SweptValue]:
    """Worst motions at evenly spaced values; those that the file of an earlier sweep has are read from it."""
    file = out / VALUES
    known = {swept.value: swept for swept in read_sweep(file)} if file.exists() else {}
    found: list[SweptValue] = []
    for value in np.linspace(family.low, family.high, count):
        found.append(known.get(float(value)) or solved(family, float(value)))
        print(f"{family.name} = {value:.6g}: {found[-1].worst_m:.4g} m, {found[-1].seconds:.2f} s", file=sys.stderr)
        write_rows(file, [vars(swept) for swept in found])
    return found


def solved(family: ParameterFamily, value: float) -> SweptValue:
    """The response at one value with all options."""
    from nonlinear import forced_response

    start = time.process_time()
    curve = forced_response(*family.at((value - family.low) / (family.high - family.low)))
    seconds = time.process_time() - start
    worst, peak = curve.worst, curve.peak
    nan = float("nan")
    return SweptValue(
        value=value,
        worst_m=nan if worst is None else float(worst.amplitude_m),
        worst_hz=nan if worst is None else float(worst.frequency_hz),
        motion="" if worst is None else worst.motion,
        branch=0 if worst is None else worst.branch,
        is_open=worst is None or bool(worst.unresolved),
        peak_m=nan if peak is None else float(peak.amplitude_m),
        harmonics=curve.harmonics,
        seconds=round(seconds, 4),
    )


def read_sweep(file: Path) -> list[SweptValue]:
    """The values of an earlier sweep."""
    with file.open(encoding="utf-8", newline="") as source:
        return [_read_value(row) for row in csv.DictReader(source)]


def _read_value(row: dict[str, str]) -> SweptValue:
    numbers = {name: float(row[name]) for name in ("value", "worst_m", "worst_hz", "peak_m", "seconds")}
    return SweptValue(
        **numbers,
        motion=row["motion"],
        branch=int(row["branch"]),
        is_open=row["is_open"] == "True",
        harmonics=int(row["harmonics"]),
    )


def deviations(found: Optimum, swept: list[SweptValue]) -> np.ndarray:
    """Relative deviation of the envelope from the worst motion at each value, NaN where one of them is not known."""
    worst = np.array([each.worst_m for each in swept])
    return found.envelope.at(np.array([each.value for each in swept])) / worst - 1.0


def row_of(found: Optimum, seconds: float, alone: SweptValue, swept: list[SweptValue]) -> dict[str, Any]:
    """Both results and costs, SI units; `alone`: the response at the optimum."""
    worst = np.array([each.worst_m for each in swept])
    lowest = swept[int(np.nanargmin(worst))]
    deviation = np.abs(deviations(found, swept))
    known = np.isfinite(deviation)
    sure = known & np.array([each.motion == "periodic" and not each.is_open for each in swept])
    total = sum(each.seconds for each in swept)
    return {
        "parameter": found.name,
        "low": found.low,
        "high": found.high,
        "kind": found.kind,
        "optimum": found.value,
        "amplitude_m": found.amplitude_m,
        "solved_there_m": alone.worst_m,
        "within_low": found.within[0],
        "within_high": found.within[1],
        "values": len(swept),
        "lowest_of_sweep": lowest.value,
        "lowest_amplitude_m": lowest.worst_m,
        "values_compared": int(known.sum()),
        "values_sure": int(sure.sum()),
        "sure_median": _largest(np.sort(deviation[sure])[: (sure.sum() + 1) // 2]),
        "sure_largest": _largest(deviation[sure]),
        "sure_within": int((deviation[sure] < AGREES).sum()),
        "other_largest": _largest(deviation[known & ~sure]),
        "values_open": sum(each.is_open for each in swept),
        "seconds": round(seconds, 2),
        "responses": len(found.responses),
        "sweep_seconds": round(total, 2),
        "ratio": round(total * SWEEP / len(swept) / seconds, 2),
    }


def _largest(values: np.ndarray) -> float:
    return float(values.max()) if values.size else math.nan


def report(row: dict[str, Any], found: Optimum, swept: list[SweptValue], scene: str) -> str:
    """The page: both results side by side, and where the envelope deviates most."""
    um = 1e6 if found.name == "interference" else 1.0
    unit = " um" if found.name == "interference" else ""
    scaled = f"{row['sweep_seconds'] * SWEEP / row['values']:.1f} s of {SWEEP} values"
    cost = f"{row['sweep_seconds']:.1f} s" + (f" ({scaled})" if row["values"] != SWEEP else "")
    lines = [
        ("value", f"{row['optimum'] * um:.5g}{unit}, {row['kind']}", f"{row['lowest_of_sweep'] * um:.5g}{unit}"),
        (
            "worst motion there",
            f"{row['amplitude_m'] * 1e6:.5g} um (a response there: {row['solved_there_m'] * 1e6:.5g} um)",
            f"{row['lowest_amplitude_m'] * 1e6:.5g} um",
        ),
        ("at most 10 % higher", " to ".join(f"{edge * um:.5g}" for edge in found.within) + unit, within(swept, um)),
        ("responses solved", row["responses"], row["values"]),
        ("processor time", f"{row['seconds']:.1f} s", cost),
    ]
    deviation = (
        f"Envelope against the sweep at {row['values_compared']} values. At {row['values_sure']} of them the worst "
        f"motion is periodic and nothing was left open: deviation {100 * row['sure_median']:.2g} % in the median, "
        f"below {100 * AGREES:g} % at {row['sure_within']}, {100 * row['sure_largest']:.3g} % at most. At the others "
        f"it comes from time integration or may be higher ({row['values_open']} values): "
        f"{100 * row['other_largest']:.3g} % at most. The optimum costs {row['ratio']:.3g} times less than {SWEEP} "
        "responses."
    )
    harmonics = sorted({each.harmonics for each in swept})
    said = " to ".join(f"{number}" for number in dict.fromkeys((harmonics[0], harmonics[-1])))
    head = f"{machine_line()}, one process, one thread. {scene}, {found.name} from {found.low:g} to {found.high:g}; "
    head += f"number of harmonics: {said} in the sweep, {found.harmonics} in the optimum."
    table = markdown_table(("what", "optimum", "sweep"), lines)
    return (
        f"# Optimum\n\n{head}\n\n{table}\n\n{deviation}\n\nWhere it deviates most:\n\n{worst_places(found, swept)}\n"
    )


def within(swept: list[SweptValue], factor: float) -> str:
    """First and last value of the sweep around its lowest, up to 10 % higher."""
    heights = np.array([each.worst_m for each in swept])
    place = int(np.nanargmin(heights))
    low = heights <= 1.1 * heights[place]
    first = place - int(np.argmin(np.r_[low[place::-1], False])) + 1
    last = place + int(np.argmin(np.r_[low[place:], False])) - 1
    return f"{swept[first].value * factor:.5g} to {swept[last].value * factor:.5g}"


def worst_places(found: Optimum, swept: list[SweptValue], count: int = 5) -> str:
    """The values with the largest deviations."""
    deviation = deviations(found, swept)
    order = np.argsort(-np.nan_to_num(np.abs(deviation), nan=-1.0))[:count]
    rows = [
        {
            "value": f"{swept[k].value:.5g}",
            "deviation": f"{100 * deviation[k]:+.2g} %",
            "worst motion [um]": f"{swept[k].worst_m * 1e6:.4g}",
            "at [Hz]": f"{swept[k].worst_hz:.5g}",
            "motion": swept[k].motion,
            "branch": swept[k].branch,
            "may be higher": "yes" if swept[k].is_open else "no",
        }
        for k in order
    ]
    return table_of(rows)


if __name__ == "__main__":
    sys.exit(main())

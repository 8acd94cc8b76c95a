"""The worst motion of every curve of some scenes beside the peak of its main branch, and the ring in time from it.

    python benchmarks/worst_motions.py                                     # all scenes that ship
    python benchmarks/worst_motions.py --scenes scenes/dummy.toml --angle 180
    python benchmarks/worst_motions.py --other-seed 1                      # a search with other random states beside
    python benchmarks/worst_motions.py --scene scenes/dummy.toml --hard 10 # cases drawn from the hard corner
    python benchmarks/worst_motions.py --brute 20                          # cases drawn at random, brute force beside

Each scene is run up to its curves. From every worst motion the ring is integrated in time with steps half as long,
disturbed in the pattern that decays least: what it reaches has to be as high again, to a tenth. A periodic motion is
left a little below its top, which is a fold: with more harmonics it lies elsewhere.
With --brute the rings of 4 to 8 blades start from random states at ten frequencies, 500 periods each, and are swept
slowly up and down: what recurs there is to be no more than 5 % above the worst motion.
With --other-seed the lower of two worst motions has to be within 2 % of the higher one, or to have the mark ">=".
Writes worst_motions.csv and worst_motions.md into out/bench/worst_motions. Exit status 1 if one of them fails.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from problems import models_by_angle
from stress_cases import StressCase, draw_cases
from stress_solving import OutOfTimeError, frequency_range, posed
from tables import ROOT, machine_line, options_of, table_of, write_results

if TYPE_CHECKING:
    from nonlinear import ResponseCurve, SolverOptions, WorstMotion
    from nonlinear.contact.parameters import Array
    from nonlinear.time_integration.ring import Ring
    from nonlinear.time_integration.ring_motion import RingMotion

SCENES = tuple(ROOT / "scenes" / f"{name}.toml" for name in ("dummy", "figure5", "figure6", "figure7", "campbell"))
PERIODS = 1500
BESIDE = 0.99  # of the amplitude of a stable peak, below which the ring starts
SAME = 0.1  # relative difference of the amplitudes
SAME_SEEDS = 0.02  # the same of two searches with other random states
HARMONICS = 3  # of the hard cases
PLACES, LONG, LAST = 10, 500, 200  # brute force: frequencies, periods from a random state and those that count
STEPS, STEP, SETTLED = 60, 30, 3  # frequencies of a sweep, periods of each, and frequencies that a height rests on
DECAYED = 8  # frequencies in which the random state of the first one has decayed
WINDOW, LOW, ABOVE = 40, 0.25, 0.05  # periods; least share of the highest solution; allowed height above the worst
LIMIT = 400.0  # seconds of a curve, after which a case is given up


@dataclass(frozen=True)
class SolvedCurve:
    """A curve with its ring and options, and where it is from."""

    scene: str
    label: str
    ring: Ring
    options: SolverOptions
    curve: ResponseCurve


def main(arguments: list[str] | None = None) -> int:
    """Run the scenes, integrate, write the table; the exit status."""
    parser = options_of(__doc__, "worst_motions")
    parser.add_argument("--scenes", type=Path, nargs="*", default=SCENES, help="scenes to run")
    parser.add_argument("--angle", type=float, help="shroud angle in place of that of the scenes, degrees")
    parser.add_argument("--hard", type=int, default=0, metavar="N", help="cases of the hard corner instead of scenes")
    parser.add_argument("--brute", type=int, default=0, metavar="N", help="cases drawn at random, with brute force")
    parser.add_argument("--first", type=int, default=0, help="number of the first of these cases (0)")
    parser.add_argument("--search", default="standard", help="response.search of these cases")
    parser.add_argument("--seed", type=int, default=17, help="another seed draws other cases (17)")
    parser.add_argument("--other-seed", type=int, help="response.seed of a second search of every curve")
    options = parser.parse_args(arguments)
    if options.brute:
        return _with_brute_force(options)
    if options.hard:
        solved = hard_curves(options.scene, options.hard, options.seed, options.out / "models")
    else:
        solved = scene_curves(options.scenes, options.angle, options.out)
    rows = []
    for each in solved:
        rows.append(row_of(each))
        if options.other_seed is not None:
            rows[-1] |= beside(each, options.other_seed)
        print(f"{each.scene}, {each.label}: {rows[-1]['in time']}", file=sys.stderr)
    write_results(options.out, "worst_motions", rows, f"{machine_line()}\n\n{table_of(rows)}\n")
    return 1 if any("no" in (row["agrees"], row.get("same")) for row in rows) else 0


def _with_brute_force(options: Any) -> int:
    """Cases drawn at random, one by one; the exit status."""
    rows: list[dict[str, Any]] = []
    cases = random_cases(options.brute, options.seed)[options.first :]
    for case in cases:
        model = models_by_angle(options.scene, [case.angle], options.out / "models")[case.angle]
        rows.append(brute_row(case, model, options.search))
        print(" | ".join(map(str, rows[-1].values())), file=sys.stderr, flush=True)
        write_results(options.out, "brute_force", rows, f"{machine_line()}\n\n{table_of(rows)}\n")
    return 1 if sum(row["higher"] == "yes" for row in rows) > len(rows) // 20 else 0


def random_cases(count: int, seed: int) -> list[StressCase]:
    """Cases with gaps that vibrations close, most of them, for the blade of the default scene under 1 N."""
    import numpy as np

    cases = []
    for index in range(count):
        rng = np.random.default_rng((seed, index))
        gap = -1e-3 * float(rng.uniform(0.03, 0.5)) if rng.uniform() < 0.9 else 1e-5 * float(rng.uniform(0.0, 2.0))
        values: dict[str, Any] = {
            "angle": float(rng.choice([60.0, 90.0, 120.0, 150.0, 180.0])),
            "order_ratio": float(rng.choice([0.0, 1 / 12, 1 / 6, 1 / 4, 1 / 3, 5 / 12, 1 / 2])),
            "normal_stiffness": float(10.0 ** rng.uniform(5.3, np.log10(3e7))),
            "interference": gap,
            "friction": float(rng.choice([0.1, 0.2, 0.4, 0.6])),
            "damping_ratio": 3e-3,
            "harmonics": [3, 7, "auto"][int(rng.integers(3))],
            "law": ["two_sliders", "cone"][int(rng.integers(2))],
        }
        cases.append(StressCase(seed=seed, index=index, hard=True, **values))
    return cases


def brute_row(case: StressCase, model: Path, search: str) -> dict[str, Any]:
    """The worst motion of a case beside the highest of brute force."""
    from dataclasses import replace

    from nonlinear import forced_response
    from nonlinear.time_integration.ring import Ring
    from rom.linear_algebra.threads import one_blas_thread

    row: dict[str, Any] = {"case": case.index, "angle": f"{case.angle:g}", "EO/N": f"{case.order_ratio:.3g}"}
    row |= {"kn": f"{case.normal_stiffness:.2g}", "v0 [um]": f"{case.interference * 1e6:.3g}"}
    row |= {"mu": case.friction, "law": case.law, "H": case.harmonics}
    names = ("peak [um]", "worst [um]", "at [Hz]", "motion", "brute [um]", "where", "higher", "said")
    modal, contact, wave, options = posed(case, model, frequency_range(case, model))
    options = replace(options, search=search)
    began = time.process_time()

    def watch(frequency_hz: float, points: int) -> None:
        if time.process_time() - began > LIMIT:
            raise OutOfTimeError(f"given up at {frequency_hz:.6g} Hz")

    try:
        curve = forced_response(modal, contact, wave, options, watch)
    except (OutOfTimeError, ArithmeticError) as error:
        return row | dict.fromkeys(names, "-") | {"said": str(error), "s": "-", "brute s": "-"}
    seconds = time.process_time() - began
    worst, peak = curve.worst, curve.peak
    assert worst is not None
    assert peak is not None
    ring = Ring(modal, contact, wave, options.output)
    with one_blas_thread():
        height, where = brute_force(ring, curve)
    higher = height > (1.0 + ABOVE) * worst.amplitude_m
    said = (f"{peak.amplitude_m * 1e6:.4g}", marked(worst))
    said += (f"{worst.frequency_hz:.5g}", worst.motion, f"{height * 1e6:.4g}", where, "yes" if higher else "no")
    row |= dict(zip(names, (*said, worst.unresolved), strict=True))
    return row | {"s": f"{seconds:.0f}", "brute s": f"{time.process_time() - began - seconds:.0f}"}


def brute_force(ring: Ring, curve: ResponseCurve) -> tuple[float, str]:
    """The highest motion that recurs from random states, or in slow sweeps, m, and where it was seen."""
    import numpy as np

    from nonlinear.time_integration.ring_integrator import RingIntegrator
    from nonlinear.worst_motion.candidates import branches_of
    from nonlinear.worst_motion.ring_integration import Solution
    from nonlinear.worst_motion.ring_starts import random_state

    branches = branches_of(curve)
    top = max(branches, key=lambda branch: branch.amplitude_m.max())
    highest = Solution.of(top, int(top.amplitude_m.argmax())).displacement
    frequency = np.concatenate([branch.frequency_hz for branch in branches])
    height = np.concatenate([branch.amplitude_m for branch in branches])
    high = frequency[height > LOW * height.max()]
    rings = {ring.blades(k): k for k in range((ring.modal.n_blades or 0) // 2 + 1)}
    sizes = [size for size in sorted(rings) if 4 <= size <= 8][-2:] or [min(rings)]
    rng = np.random.default_rng(17)
    found = [(0.0, "-")]
    for size in sizes:
        for place in np.linspace(high.min(), high.max(), PLACES).tolist():
            integrator = RingIntegrator.of(ring, 2.0 * np.pi * place, nodal_diameter=rings[size])
            try:
                envelope = integrator.march(random_state(integrator, highest, 1.5, rng), LONG).envelope_m
            except ArithmeticError:
                continue
            found.append((recurs(envelope[-LAST:]), f"{size} blades, {place:.4g} Hz"))
    for way in (1, -1):
        state, envelopes = None, []
        for number, place in enumerate(np.linspace(high.min(), high.max(), STEPS)[::way].tolist()):
            integrator = RingIntegrator.of(ring, 2.0 * np.pi * place, nodal_diameter=rings[sizes[-1]])
            try:
                record = integrator.march(state or random_state(integrator, highest, 1.5, rng), STEP)
            except ArithmeticError:
                break
            state = record.final
            envelopes = [*envelopes, record.envelope_m][-SETTLED:]
            if number >= DECAYED:
                height_m = recurs(np.concatenate(envelopes[1:]))
                found.append((height_m, f"sweep {'up' if way > 0 else 'down'}, {place:.4g} Hz"))
    return max(found)


def recurs(envelope: Array) -> float:
    """The largest displacement that at least two windows reach, m; shapes: `envelope` (P, q)."""
    import numpy as np

    parts = np.array_split(envelope, max(len(envelope) // WINDOW, 2))
    return float(np.sort([part.max() for part in parts])[-2])


def scene_curves(scenes: Sequence[Path], angle: float | None, out: Path) -> Iterator[SolvedCurve]:
    """All curves of the scenes, as `shroud run` solves them."""
    from nonlinear.time_integration.ring import Ring
    from pipeline.process.progress import Reporter
    from pipeline.run import solved_curves
    from pipeline.scene.labels import member_label
    from pipeline.scene.reading import read_scene
    from pipeline.stages.curve.curve_file import read_curve
    from pipeline.stages.request import Request
    from pipeline.stages.scene_to_solver import nonlinear_problem
    from rom import read_reduced_model

    for path in scenes:
        name = path.stem if angle is None else f"{path.stem}_{angle:g}"
        source = path if angle is None else _with_angle(path, angle, out / f"{name}.toml")
        request = Request(read_scene(source), out / name, "respond")
        with solved_curves(request, Reporter(quiet=True)) as (_, outcome):
            for result in outcome.curves:
                if result.file is None or result.rom is None:
                    continue
                model = read_reduced_model(result.rom, with_basis=False)
                modal, contact, wave, options = nonlinear_problem(result.member.scene, model)
                ring = Ring(modal, contact, wave, options.output)
                yield SolvedCurve(name, member_label(result.member), ring, options, read_curve(result.file))


def hard_curves(scene: Path, count: int, seed: int, store: Path) -> Iterator[SolvedCurve]:
    """Curves of cases drawn from the hard corner of the test matrix."""
    from dataclasses import replace

    from nonlinear import forced_response
    from nonlinear.time_integration.ring import Ring

    cases = [replace(case, harmonics=HARMONICS) for case in draw_cases(count, seed, hard=True)]
    models = models_by_angle(scene, (case.angle for case in cases), store)
    for case in cases:
        modal, contact, wave, options = posed(case, models[case.angle], frequency_range(case, models[case.angle]))
        curve = forced_response(modal, contact, wave, options)
        ring = Ring(modal, contact, wave, options.output)
        yield SolvedCurve("hard", f"case {case.index}", ring, options, curve)


def row_of(solved: SolvedCurve) -> dict[str, Any]:
    """One line of the table; amplitudes in micrometres."""
    curve, worst = solved.curve, solved.curve.worst
    peak = curve.peak
    row: dict[str, Any] = {
        "scene": solved.scene,
        "curve": solved.label,
        "main peak [um]": "-" if peak is None else f"{peak.amplitude_m * 1e6:.4g}",
        "stable": "-" if peak is None else "yes" if curve.stable[peak.index] else "no",
    }
    names = ("worst [um]", "at [Hz]", "branch", "motion", "nodal diameter", "blades")
    if worst is None or not worst.amplitude_m > 0.0:
        return row | dict.fromkeys((*names, "in time", "agrees", "seconds"), "-")
    values = (marked(worst), f"{worst.frequency_hz:.6g}", worst.branch, worst.motion)
    row |= dict(zip(names, (*values, worst.nodal_diameter, worst.ring_blades), strict=True))
    start = time.perf_counter()
    motion = in_time(solved)
    if motion is None:
        return row | {"in time": "not integrated", "agrees": "-", "seconds": "-"}
    agrees = abs(motion.amplitude_m / height_at_start(curve) - 1.0) < SAME
    said = f"{'stays' if motion.stays else 'leaves'}, {motion.amplitude_m * 1e6:.4g}"
    seconds = f"{time.perf_counter() - start:.1f}"
    return row | {"in time": said, "agrees": "yes" if agrees else "no", "seconds": seconds}


def beside(solved: SolvedCurve, seed: int) -> dict[str, Any]:
    """The worst motion of a curve with other random states, in micrometres, and whether the lower one may stand."""
    from dataclasses import replace

    from nonlinear.worst_motion.worst_motion import find_worst_motion

    ring, first = solved.ring, solved.curve.worst
    options = replace(solved.options, seed=seed)
    second = find_worst_motion((ring.modal, ring.contact, ring.excitation, options), solved.curve)
    assert first is not None
    assert second is not None
    low, high = sorted((first, second), key=lambda worst: worst.amplitude_m)
    same = bool(low.unresolved) or not low.amplitude_m < (1.0 - SAME_SEEDS) * high.amplitude_m
    return {"other seed [um]": marked(second), "same": "yes" if same else "no"}


def marked(worst: WorstMotion) -> str:
    """Height in micrometres, with the mark that the program gives it."""
    at_least = ">= " * bool(worst.unresolved and not worst.unstable)
    return f"{at_least}{worst.amplitude_m * 1e6:.4g}{' (unstable)' * worst.unstable}"


def height_at_start(curve: ResponseCurve) -> float:
    """Height of the worst motion where the ring starts: one that was followed in frequency is lower there."""
    import numpy as np

    from nonlinear.worst_motion.candidates import branches_of

    worst = curve.worst
    assert worst is not None
    start_hz = branches_of(curve)[worst.branch].frequency_hz[worst.index]
    return float(np.interp(start_hz, worst.followed_hz, worst.followed_m)) if worst.followed_hz else worst.amplitude_m


def in_time(solved: SolvedCurve) -> RingMotion | None:
    """The ring in time from the solution of the worst motion; None where that is on no branch or cannot be done."""
    from nonlinear.time_integration.ring_motion import RingLimits, integrate_ring
    from nonlinear.worst_motion.candidates import branches_of
    from nonlinear.worst_motion.ring_integration import RingIntegration, Solution
    from rom.linear_algebra.threads import one_blas_thread

    worst = solved.curve.worst
    if worst is None or worst.branch < 0:
        return None
    branch = branches_of(solved.curve)[worst.branch]
    solution = Solution.of(branch, worst.index if worst.ring_blades else beside_top(branch, worst.index))
    with one_blas_thread():
        pattern = worst.nodal_diameter or RingIntegration(solved.ring, solved.options).pattern(solution)
        try:
            return integrate_ring(
                solved.ring,
                solution.omega,
                solution.displacement,
                nodal_diameter=pattern,
                limits=RingLimits(most_periods=PERIODS, finer=2),
            )
        except ArithmeticError:
            return None


def beside_top(branch: ResponseCurve, top: int) -> int:
    """Index of a stable point a little below a stable one on its side of the fold, else of that itself.

    At the fold itself the motion with more harmonics may no longer exist at that frequency.
    """
    for step in (-1, 1):
        index = top
        while 0 <= index + step < branch.points and branch.stable[index + step]:
            index += step
            if branch.amplitude_m[index] < BESIDE * branch.amplitude_m[top]:
                return index
    return top


def _with_angle(scene: Path, angle: float, target: Path) -> Path:
    """The scene with another shroud angle, written to a file."""
    import re

    text, count = re.subn(r"(?m)^angle = .*$", f"angle = {angle}", scene.read_text(encoding="utf-8"))
    assert count == 1
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(text, encoding="utf-8")
    return target


if __name__ == "__main__":
    sys.exit(main())

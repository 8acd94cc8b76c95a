"""The command `shroud check`: curves from the store or solved, the check, and its files in OUT/check."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.check.answer import answer_lines, plain
from pipeline.check.check_point import Check, CheckedPoint, check_point, refuse
from pipeline.process.progress import Reporter
from pipeline.results.outputs import as_json
from pipeline.run import solved_curves
from pipeline.scene.labels import member_label
from pipeline.stages.request import Request, Run

FOLDER = "check"


@dataclass(frozen=True)
class CheckOutcome:
    """What a check prints: lines of text, values for JSON, and problems of the run, one line each."""

    lines: list[str]
    values: dict[str, Any]
    problems: list[str]


def run_check(request: Request, point: CheckedPoint, reporter: Reporter) -> CheckOutcome:
    """Check one motion of a scene, computing what is missing of its results."""
    refuse(request, point)
    with solved_curves(request, reporter) as (run, outcome):
        curve = outcome.curves[point.curve]
        with reporter.working("integrating the ring in time"):
            check = check_point(point, curve, member_label(curve.member) if curve.member.parameters else "")
        files = _written(run, check)
    values = plain(check) | {"files": [path.relative_to(request.out).as_posix() for path in files]}
    return CheckOutcome([*answer_lines(check), f"{files[0]}"], values, outcome.problems)


def _written(run: Run, check: Check) -> list[Path]:
    """Write the picture and the values, replaced together."""
    from pipeline.check.envelope_figure import envelope_figure
    from pipeline.figures.style import save, styled

    point, first, out = check.point, run.request.scene.first, run.request.out
    name = f"curve_{point.curve}_{point.frequency_hz:.10g}_Hz_solution_{point.solution}"
    if point.branch is not None:
        name += f"_branch_{point.branch}"
    heading = f"{first.title or first.name}: curve {point.curve}{f', {check.label}' if check.label else ''}"
    targets = [out / FOLDER / f"{name}.{suffix}" for suffix in ("png", "svg", "json")]
    with run.store.replacing(*targets) as paths:
        with styled():
            save(
                envelope_figure(check, f"{heading}, {point.frequency_hz:.6g} Hz"),
                paths[0].parent,
                name,
                ("png", "svg"),
            )
        paths[2].write_text(as_json(plain(check)) + "\n", encoding="utf-8")
    return targets

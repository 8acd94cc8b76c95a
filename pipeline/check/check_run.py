"""The command `shroud check`: results as `shroud run` leaves them, the check, and its files in OUT/check."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.check.answer import answer_lines, plain
from pipeline.check.check_point import Check, CheckedPoint, check_point, refuse
from pipeline.process.progress import Reporter
from pipeline.results.outputs import as_json
from pipeline.run import execute
from pipeline.scene.labels import member_label
from pipeline.stages.request import Request
from pipeline.store.output_folder import working_store

FOLDER = "check"


@dataclass(frozen=True)
class CheckOutcome:
    """What a check prints and writes: lines of text, values for JSON, problems of the run, files."""

    lines: list[str]
    values: dict[str, Any]
    problems: list[str]
    files: list[Path]


def run_check(request: Request, point: CheckedPoint, reporter: Reporter) -> CheckOutcome:
    """Check one motion of a scene, computing what is missing of its results.

    Parameters
    ----------
    request : Request
        Scene and output folder.
    point : CheckedPoint
        Which motion.
    reporter : Reporter
        Says what is going on.

    Raises
    ------
    InputError
        The scene is not usable, or it has no such curve, frequency, branch or solution.
    StorageError
        There is no room for the results.
    """
    refuse(request, point)
    outcome = execute(request, reporter)
    curve = outcome.curves[point.curve]
    with reporter.working("integrating the ring in time"):
        check = check_point(point, curve, member_label(curve.member) if curve.member.parameters else "")
    files = _written(request, check, reporter)
    values = plain(check) | {"files": [path.relative_to(request.out).as_posix() for path in files]}
    return CheckOutcome([*answer_lines(check), f"{files[0]}"], values, outcome.problems, files)


def _written(request: Request, check: Check, reporter: Reporter) -> list[Path]:
    """Write the picture and the values, each in one step."""
    from pipeline.check.envelope_figure import envelope_figure
    from pipeline.figures.style import save, styled

    point, first = check.point, request.scene.first
    name = f"curve_{point.curve}_{point.frequency_hz:.10g}_Hz_solution_{point.solution}"
    if point.branch is not None:
        name += f"_branch_{point.branch}"
    title = first.title or first.name
    heading = f"{title}: curve {point.curve}{f', {check.label}' if check.label else ''}, {point.frequency_hz:.6g} Hz"
    targets = [request.out / FOLDER / f"{name}.{suffix}" for suffix in ("png", "svg", "json")]
    with working_store(request.out, False, reporter) as store, store.replacing(*targets) as paths:
        with styled():
            save(envelope_figure(check, heading), paths[0].parent, name)
        paths[2].write_text(as_json(plain(check)) + "\n", encoding="utf-8")
    return targets

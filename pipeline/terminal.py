"""What the commands print: results and tables on stdout; errors, warnings and notes on stderr.

Commands that compute can be interrupted, and end with an exit status (`stoppable`, `finish`).
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from pipeline.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console

    from pipeline.process.interrupts import Interrupts
    from pipeline.results.conclusion import ShownCurve
    from pipeline.results.modes import ModelModes
    from pipeline.scene.reading import Member, SceneFile
    from pipeline.stages.request import Request, RunOutcome
    from pipeline.verify.stage import Verification


NO_TERMINAL = 120  # characters in a line of a table where stdout is no terminal


def print_error(text: str) -> None:
    """One line on stderr; a closed stderr is no error."""
    if sys.stderr is None:  # print() would take stdout for it
        return
    with suppress(OSError):
        print(text, file=sys.stderr, flush=True)


def print_notes(lines: Iterable[str], kind: str = "note") -> None:
    """Lines of one kind, "note" or "warning", on stderr."""
    for line in lines:
        print_error(f"{kind}: {line}")


def print_problems(problems: Iterable[str]) -> None:
    """One line for everything that could not be computed."""
    for problem in problems:
        print_error(problem)


def print_outcome(request: Request, outcome: RunOutcome, quiet: bool, as_json: bool) -> None:
    """The results of a run as JSON or as a table, and what could not be computed."""
    from pipeline.results.outputs import as_json as json_text

    if as_json:
        print(json_text(outcome.summary))
    elif not quiet:
        _print_results(request, outcome)
    print_problems(outcome.problems)
    failed = [curve for curve in outcome.curves if not curve.complete]
    if failed:
        print_error(f"{len(failed)} of {len(outcome.curves)} curves not completed: {failed[0].reason}")


def print_verification(found: Verification, quiet: bool, as_json: bool) -> None:
    """Errors of the reduced models of a scene, as JSON or as a table, and advice."""
    from pipeline.results.outputs import as_json as json_text
    from pipeline.verify.stage import printed

    if as_json:
        print(json_text(printed(found)))
    if as_json or quiet:
        return
    from pipeline.verify.table import equilibrium_lines, error_table, heading, overview

    console = _console()
    for line in dict.fromkeys(heading(errors) for _, errors in found.measured):
        print(line)
    if len(found.measured) == 1:
        case, errors = found.measured[0]
        console.print(error_table(errors, case.scene.response.frequency[1]))
    elif found.measured:
        console.print(overview(found.measured))
    for line in [*equilibrium_lines(found.measured), *(each.text for each in found.advice)]:
        print(line)


def print_modes(models: Sequence[ModelModes], campbell: Sequence[dict[str, Any]]) -> None:
    """Tables of the natural frequencies of some models, static contact, frequency range, crossings over the speed."""
    from pipeline.results import modes as table

    console = _console()
    for model in models[: table.MOST_MODELS]:
        for wave in model.waves:
            print(table.wave_heading(model, wave, len(models) > 1))
            console.print(table.wave_table(wave))
        if model.flutter is not None:
            print(table.flutter_line(model.flutter))
            console.print(table.flutter_table(model.flutter))
        if model.static:
            console.print(table.static_table(model.static, model.speed_rpm))
        print_notes([case.warning for case in model.static if case.warning], "warning")
        print(table.range_line(model))
        for line in model.helps:
            print(line)
    for line in [*table.crossing_lines(campbell), table.left_out(models), *table.table_notes(models)]:
        if line:
            print(line)


def _print_results(request: Request, outcome: RunOutcome) -> None:
    """What a reader can say aloud of a run; `shroud info` of its folder says the rest."""
    from pipeline.results.conclusion import screen_curves
    from pipeline.results.stress import stress_lines, stress_warning

    page = f", {outcome.report}" if outcome.report else ""
    if outcome.curves:
        entries = outcome.known.get("rows", {})
        _print_conclusion(request, outcome, screen_curves(outcome.curves, entries))
    print_modes(outcome.modes, outcome.campbell if outcome.modes else [])
    unstable = {n for n, curve in enumerate(outcome.curves) if curve.facts is not None and curve.facts.worst_unstable}
    for line in stress_lines(outcome.stress, unstable):
        print(line)
    for study in outcome.studies.values():
        print("\n".join(study.lines))
    if warning := stress_warning(outcome.stress):
        print_notes([warning], "warning")
    print(f"{outcome.seconds:.2f} s, results in {request.out}{page}")


def _print_conclusion(request: Request, outcome: RunOutcome, curves: Sequence[ShownCurve]) -> None:
    """Scene and modes, a row for each curve, the lowest, what is open; of many curves quantiles and best values."""
    from pipeline.results import conclusion
    from pipeline.results.overview import key_table, overview_lines, quantile_table
    from pipeline.results.tables import has_static_load

    console, shown = _console(), conclusion.shown_numbers([curve.height for curve in curves])
    loads = any(map(has_static_load, outcome.curves))
    table = conclusion.conclusion_table(curves, shown, loads)
    lines = conclusion.wrapped(conclusion.lines_of(outcome.summary), console.width)
    print("\n".join([*lines, *conclusion.table_lines(table, console.width, console)]))
    for line in conclusion.interface_lines([curves[number] for number in shown], console.width, loads):
        print(line)
    if len(shown) < len(curves) and outcome.table is not None:
        lines, found = overview_lines(outcome.table)
        print(f"... {lines[0]}")
        console.print(quantile_table(found))
        if found["keys"]:
            console.print(key_table(found))
        print("\n".join(lines[1:]))
    search, details = request.scene.first.response.search, f"shroud info {request.out}"
    open_lines = conclusion.open_lines(outcome.summary, curves, search, details)
    said = [line for line in (conclusion.lowest_line(curves), *open_lines) if line]
    print("\n".join(conclusion.wrapped(said, console.width)))


def print_info(found: dict[str, Any]) -> None:
    """The contents of a file or an output folder."""
    from pipeline.results.file_info import described

    print("\n".join(described(found, _console().width)))


def _console() -> Console:
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else NO_TERMINAL)


COMPUTED, NOT_REACHED, BAD_INPUT, BY_SIGNAL = 0, 1, 2, 128  # the last: and the number of the signal


@contextmanager
def stoppable() -> Iterator[Interrupts]:
    """Work that a signal may end; the exit status says which it was."""
    from pipeline.process.interrupts import Stopped, handling_interrupts

    with handling_interrupts() as interrupts:
        try:
            yield interrupts
        except Stopped as stop:
            raise typer.Exit(BY_SIGNAL + stop.signal) from None


def finish(request: Request, quiet: bool, as_json: bool) -> None:
    """Execute, print the results, and exit with the status that stands for them."""
    from pipeline.process.interrupts import Stopped
    from pipeline.process.program import defer_unused
    from pipeline.process.progress import Reporter
    from pipeline.results.outputs import as_json as json_text
    from pipeline.run import execute

    defer_unused()
    with stoppable() as interrupts:
        try:
            outcome = execute(request, Reporter(quiet, interrupts=interrupts))
        except Stopped as stop:
            if as_json:
                print(json_text(stop.summary or {"complete": False, "problems": [stop.said]}))
            raise
    print_outcome(request, outcome, quiet, as_json)
    raise typer.Exit(COMPUTED if outcome.complete else NOT_REACHED)


Told = tuple[str | None, str | None, int | None]  # unit, axis, number of blades


def print_validation(scene: Path, as_json: bool, force: bool = False) -> bool:
    """Print all errors of a scene, or its warnings; returns whether it is valid."""
    from pipeline.scene.consistency import all_errors
    from pipeline.scene.plausibility import plausibility_warnings

    found_in_mesh: list[str] = []
    try:
        file, errors = all_errors(scene, force)
        if file is not None and file.first.mesh_file is not None:
            from pipeline.stages.model.check_meshes import check_meshes

            errors, found_in_mesh = check_meshes(file, force)
            file = None if errors else file
        if file is not None and file.first.model is not None:
            from pipeline.stages.model.build_from_matrices import check_matrices

            errors = check_matrices(file)
            file = None if errors else file
    except InputError as error:
        file, errors = None, [str(error)]
    if file is None:
        if as_json:
            print(_json({"valid": False, "errors": errors, "warnings": []}))
        for line in errors:
            print_error(line)
        return False
    remarks = [*plausibility_warnings(file), *found_in_mesh, *_left_out(file), *_advice(file)]
    if as_json:
        accuracy = None if file.accuracy is None else file.accuracy.plain()
        found = {
            "name": file.first.name,
            "curves": len(file.members),
            "swept": list(file.swept),
            "accuracy": accuracy,
        }
        print(_json({"valid": True, "errors": [], "warnings": [*file.notes, *remarks], **found}))
        return True
    print_notes(file.notes)
    print_notes(remarks, "warning")
    curves = f"{len(file.members)} curve{'s' if len(file.members) > 1 else ''}"
    print(f"{scene}: valid, {curves}" + (f" over {', '.join(file.swept)}" if file.swept else ""))
    if file.accuracy is not None:
        print(file.accuracy.text())
    return True


def _left_out(file: SceneFile) -> list[str]:
    """Lines on resonances outside the frequency range, as far as an earlier run of the scene has found them."""
    folder = Path("out") / file.first.name / "store"
    if not folder.is_dir():
        return []
    from pipeline.results.frequency_range import missing_warnings, stored_resonances
    from pipeline.results.resonances import Resonance
    from pipeline.stages.cache_keys import model_keys
    from pipeline.store.content_store import Store

    store = Store(folder)

    def of(member: Member) -> list[Resonance]:
        return stored_resonances(store, model_keys(member.scene).reduce, member.scene, None)

    try:
        return missing_warnings(file.members, of)
    except Exception:  # a hint from files that anything may have happened to: the scene is as valid without it
        return []


def _advice(file: SceneFile) -> list[str]:
    """What helps with the contacts of the first member, as far as `shroud modes` or a run has found it."""
    folder = Path("out") / file.first.name / "store"
    if not folder.is_dir():
        return []
    from pipeline.results.contact_advice import known_advice
    from pipeline.stages.cache_keys import model_keys
    from pipeline.store.content_store import Store

    try:
        found = known_advice(Store(folder), model_keys(file.first).reduce, file.first)
        return [] if found is None else found.lines(file.first)
    except Exception:  # a hint from files that anything may have happened to
        return []


def print_new_scene(folder: Path, title: str | None, mesh: Path | None, told: Told) -> None:
    """Write a scene to start from, for a mesh file where there is one, and print what was written and found."""
    from pipeline.new_scene.templates import check_title, write_new_scene

    if title is None:
        at_terminal = sys.stdin is not None and sys.stdin.isatty() and sys.stdout.isatty()
        asked = "Heading of the figures (Enter: the name of the folder)"
        title = typer.prompt(asked, default="", show_default=False) if at_terminal else ""
    title = check_title(title.strip())
    if mesh is not None:
        _new_of_mesh(folder, title, mesh, told)
        return
    scene, schema = write_new_scene(folder, title)
    print(f"written: {scene}, {schema}")
    print(f"next: shroud run {scene}")


def _new_of_mesh(folder: Path, title: str, mesh: Path, told: Told) -> None:
    from pipeline.new_scene.new_from_mesh import MeshOptions, new_scene_of_mesh

    new = new_scene_of_mesh(folder, title, mesh, MeshOptions(*told))
    print("\n".join(new.found))
    print(f"written: {', '.join(map(str, new.files))}")
    if new.problem:
        print_notes([new.problem], "to be changed")
        print(f"next: change {new.files[0]}, then shroud validate {new.files[0]}")
    else:
        print(f"next: shroud run {new.files[0]}")


def _json(values: dict[str, object]) -> str:
    """JSON text of plain values; NumPy, which the writer of results imports, is not needed without `--json`."""
    from pipeline.results.outputs import as_json

    return as_json(values)

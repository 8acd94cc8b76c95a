"""The commands `shroud validate` and `shroud new`: what they print."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from pipeline.errors import InputError
from pipeline.terminal import print_error, print_notes

if TYPE_CHECKING:
    from pipeline.scene.reading import Member, SceneFile

Told = tuple[str | None, str | None, int | None]  # unit, axis, number of blades


def print_validation(scene: Path, as_json: bool, force: bool = False) -> bool:
    """Print all errors of a scene, or its warnings; returns whether it is valid."""
    from pipeline.scene.consistency import all_errors
    from pipeline.scene.plausibility import plausibility_warnings

    found_in_mesh: list[str] = []
    try:
        file, errors = all_errors(scene, force)
        if file is not None and file.first.mesh_file is not None:
            from pipeline.stages.build_mesh import check_meshes

            errors, found_in_mesh = check_meshes(file, force)
            file = None if errors else file
        if file is not None and file.first.model is not None:
            from pipeline.stages.build_from_matrices import check_matrices

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
    remarks = [*plausibility_warnings(file), *found_in_mesh, *_left_out(file)]
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
    from pipeline.results.frequency_range import Resonance, missing_warnings, stored_resonances
    from pipeline.stages.cache_keys import model_keys
    from pipeline.store.content_store import Store

    store = Store(folder)

    def of(member: Member) -> list[Resonance]:
        return stored_resonances(store, model_keys(member.scene).reduce, member.scene, None)

    try:
        return missing_warnings(file.members, of)
    except Exception:  # a hint from files that anything may have happened to: the scene is as valid without it
        return []


def print_new_scene(folder: Path, title: str | None, mesh: Path | None, told: Told) -> None:
    """Write a scene to start from, for a mesh file where there is one, and print what was written and found."""
    from pipeline.scene.templates import check_title, write_new_scene

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

"""Checks of a scene with a bladed disk beyond the schema."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from pipeline.errors import InputError, input_error, shown
from pipeline.scene.reading import Member, SceneFile, key_in_file
from pipeline.scene.schema import Scene


def unfit_beside_disk(file: SceneFile) -> Iterator[InputError]:
    """A disk that nothing holds has no static response, which stresses need."""
    scene, name = file.first, free_bore(file.first)
    if name and scene.with_stress:
        section = "fatigue" if scene.stress is None else "stress"
        yield input_error(file.path, section, f'given with {name}.bore = "free"', f'{name}.bore = "clamped"')


def free_bore(scene: Scene) -> str | None:
    """Section of the disk that nothing holds; None where there is no such disk."""
    parts = (("disk", scene.disk), ("mesh", scene.mesh))
    return next((name for name, part in parts if part is not None and part.bore == "free"), None)


def unfit_disk_keys(path: Path, member: Member) -> Iterator[InputError]:
    """Keys of a member that do not fit a disk."""
    scene = member.scene
    waves = scene.rom.nodal_diameters
    if waves is None:
        return
    place = key_in_file(member, "rom.nodal_diameters")
    if scene.disk is None and scene.mesh_file is None:
        yield input_error(path, place, shown(list(waves)), "nothing without a disk")
    elif scene.n_blades is not None and max(waves) > scene.n_blades // 2:
        allowed = f"whole numbers, 0 to {scene.n_blades // 2} with {scene.n_blades} blades"
        yield input_error(path, place, shown(list(waves)), allowed)

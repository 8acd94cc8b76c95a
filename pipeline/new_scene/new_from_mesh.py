"""`shroud new DIR --mesh FILE`: a look at a mesh file, a scene to start from, and a picture with coloured faces."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.errors import input_error, reason_of
from pipeline.new_scene.mesh_picture import mesh_picture
from pipeline.new_scene.mesh_survey import Guess, guess, set_nodes, survey
from pipeline.new_scene.scene_of_mesh import StartingValues, scene_of_mesh
from pipeline.scene.given_in_python import given_scene
from pipeline.scene.reading import Member, parameter_error
from pipeline.scene.templates import SCENE, new_files
from pipeline.stages.build_full_model import FULL_MODEL, make_full_model
from pipeline.stages.build_mesh import SECTOR, findings_of, read_mesh_file, sector_choice, write_findings
from pipeline.stages.build_reduced_model import make_reduced_model
from pipeline.stages.model_files import REDUCED_MODEL
from pipeline.stages.scene_materials import check_materials, materials_of_file

if TYPE_CHECKING:
    from geometry import ImportedMesh, OwnSector
    from pipeline.scene.schema import Scene

PICTURE = "mesh.png"
MOST_POINTS = 12_000  # nodes of a mesh of which the first natural frequency is computed
MODES = 10
BELOW, ABOVE = 0.6, 1.4  # of the frequency range, over the lowest free and stuck frequency


@dataclass(frozen=True)
class MeshOptions:
    """What the command line says about a mesh file; None: to be told from the file."""

    unit: str | None = None  # as in [mesh]
    axis: str | None = None  # as in [mesh]
    n_blades: int | None = None  # number of blades


@dataclass(frozen=True)
class NewScene:
    """What was written, and what was found."""

    files: tuple[Path, ...]  # scene, schema and picture
    found: tuple[str, ...]  # what is in the file, a line each
    problem: str  # why the file does not make a sector yet, with what to change; empty where it does


def new_scene_of_mesh(folder: Path, title: str, file: Path, options: MeshOptions) -> NewScene:
    """Look at a mesh file, write a scene for it and a picture into a folder."""
    if not file.is_file():
        raise input_error(file, "", "no such file", "a mesh file (.inp, .bdf, .cdb, .msh, .vtu, .med)")
    mesh = read_mesh_file(str(file))
    told = guess(mesh, options.unit, options.axis, options.n_blades)
    name = os.path.relpath(file.resolve(), folder.resolve()).replace(os.sep, "/")
    heading = folder.resolve().name
    text = partial(scene_of_mesh, heading, title, name, told)
    own, problem, values, materials = _tried(folder, text, mesh, told)
    picture = mesh_picture(*_drawn(mesh, told, own), f"{file.name}: {_heading(own, told)}")
    files = new_files(folder, text(values), {PICTURE: picture})
    lines = [*survey(mesh), *told.why]
    lines += [] if own is None else [line for line in own.findings.lines if not {line, f"note: {line}"} & {*lines}]
    lines += [line for line in materials if f"note: {line}" not in lines]
    return NewScene(tuple(files), tuple(lines), problem)


def _tried(
    folder: Path, text: Callable[[StartingValues], str], mesh: ImportedMesh, told: Guess
) -> tuple[OwnSector | None, str, StartingValues, list[str]]:
    """The sector that the guess makes of the mesh, what is wrong, numbers to start with, its materials in words."""
    from geometry import ParameterError, sector_from_mesh

    if told.n_blades is None:
        return (
            None,
            f"{folder / SCENE}: mesh.n_blades: missing, allowed: a whole number, 3 to 10000",
            StartingValues(),
            [],
        )
    import tomllib

    scene = given_scene(tomllib.loads(text(StartingValues())), {}).first
    assert scene.mesh is not None
    try:
        own = sector_from_mesh(mesh, sector_choice(scene.mesh))
    except ParameterError as error:
        return None, f"{folder / SCENE}: {reason_of(error)}", StartingValues(), []
    found = findings_of(own)
    materials = materials_of_file(scene, found)
    complete = [m.numbers for m in materials.values() if m.name and not m.missing and not m.unread and m.of_file]
    incomplete = {m.name: m.missing for m in materials.values() if m.name and m.missing and (m.unread or m.numbers)}
    modulus = next((m.numbers["young_modulus"] for m in materials.values() if "young_modulus" in m.of_file), None)
    area = float(own.sector.right.area.sum())
    general = any(not m.name or not (m.numbers or m.unread) for m in materials.values())
    values = StartingValues(complete[0] if complete else None, area, None, general, incomplete, modulus)
    scene = given_scene(tomllib.loads(text(values)), {}).first
    lines = [m.line for m in materials.values() if m.numbers]
    try:
        lines += [line for line in check_materials(scene, found, force=False) if line not in mesh.notes]
    except ParameterError as error:
        return own, str(parameter_error(folder / SCENE, Member(0, scene, {}), error)), values, lines
    return own, "", replace(values, frequency=_frequency_range(scene, own)), lines


def _frequency_range(scene: Scene, own: OwnSector) -> tuple[float, float] | None:
    """A range around the first natural frequency with free and stuck shrouds; None for a large mesh."""
    if len(own.sector.points) > MOST_POINTS:
        return None
    from rom import inter_blade_phase, natural_frequencies, read_reduced_model, save_sector

    rom = scene.rom.model_copy(update={"modes": MODES, "frequency_limit": None})
    scene = scene.model_copy(update={"rom": rom})
    with tempfile.TemporaryDirectory() as name, suppress(Exception):  # the range is only to start with
        place = Path(name)
        save_sector(place / SECTOR, own.sector)
        write_findings(place, own)
        full = make_full_model(place, place / SECTOR, scene)
        make_reduced_model(place, place / SECTOR, place / FULL_MODEL, scene, store_basis=False, assembled=[full])
        model = read_reduced_model(place / REDUCED_MODEL, with_basis=False)
        phase = inter_blade_phase(scene.excitation.engine_order, model.n_blades)
        stiff = {"normal": scene.contact.normal_stiffness, "tangential": scene.contact.tangential_stiffness}
        free = float(natural_frequencies(model, phase, count=1)[0])
        shared = {key: float(value) / model.n_contacts for key, value in stiff.items()}  # type: ignore[arg-type]
        stuck = float(natural_frequencies(model, phase, count=1, **shared)[0])
        return float(f"{BELOW * free:.2g}"), float(f"{ABOVE * stuck:.2g}")
    return None


def _drawn(mesh: ImportedMesh, told: Guess, own: OwnSector | None) -> tuple[Any, Any, dict[str, Any]]:
    """Points, elements and marked nodes of the picture: of the sector, or of the file as it is."""
    if own is not None:
        sets = own.sector.node_sets
        marked = {"contact_right": "face_right", "contact_left": "face_left", "root": "root"}
        return own.sector.points, own.sector.blocks, {role: sets[name] for role, name in marked.items()}
    roles = ("contact_right", "contact_left", "root")
    return mesh.points, mesh.blocks, {role: set_nodes(mesh, told.sets[role]) for role in roles if role in told.sets}


def _heading(own: OwnSector | None, told: Guess) -> str:
    if own is None:
        return "as in the file"
    return f"{told.n_blades} blades, unit {told.unit}, axis {told.axis}; x engine axis, z radial"

"""Reduced model of the matrices of another program, written as the files of one store entry."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from pipeline.errors import InputError, reason_of
from pipeline.process.isolated_reading import MEMORY, MEMORY_PER_BYTE, read_apart
from pipeline.scene.input_files import copies, file_size
from pipeline.scene.reading import parameter_error
from pipeline.stages.model.model_files import REDUCED_MODEL
from pipeline.stages.model.scene_loads import scene_loads, with_modal_excitation
from pipeline.stages.scene_to_solver import interface_facts, linear_operation, touching

if TYPE_CHECKING:
    from pipeline.scene.reading import SceneFile
    from pipeline.scene.schema import Scene
    from rom.cyclic.reduced_model import ReducedModel
    from rom.matrix_files.matrix_choice import MatrixChoice
    from rom.matrix_files.matrix_model import MatrixModel
    from rom.reduction.boundary_dofs import BoundaryChoice


T = TypeVar("T")
AUGMENTED_MODEL = "augmented.h5"
FACTS = "facts.json"
READER = "the reader of matrices"
ALLOWED = "files with stiffness, mass and nodes"


def matrix_choice(scene: Scene, files: Mapping[str, str]) -> MatrixChoice:
    """What [model] says about its files, or about these copies of them."""
    from rom.matrix_files.matrix_choice import MatrixChoice

    assert scene.model is not None
    values = scene.model.model_dump() | dict(files)
    values["sets"] = {role: name for role, name in values["sets"].items() if name is not None}
    return MatrixChoice(**values)


def read_matrices(scene: Scene) -> MatrixModel:
    """The full model in the files of [model], read in isolation."""
    from rom.matrix_files.matrix_model import model_from_matrices

    return _read(scene, model_from_matrices)


def read_superelement(scene: Scene) -> tuple[ReducedModel, tuple[str, ...]]:
    """The reduced model in the files of [model], read in isolation, and what was found. Raises as `read_matrices`."""
    from rom.matrix_files.superelement import model_from_superelement

    return _read(scene, lambda choice: model_from_superelement(choice, nodal_choice(scene)))


def check_matrices(file: SceneFile) -> list[str]:
    """Read the files of [model] of a scene; a line for each model that cannot be made of them."""
    lines: dict[str, None] = {}
    known: set[object] = set()
    for member in file.members:
        if member.scene.model is None or member.scene.model in known:
            continue
        known.add(member.scene.model)
        try:
            (read_superelement if member.scene.model.reduced else read_matrices)(member.scene)
        except InputError as error:
            lines[str(error)] = None
        except ValueError as error:
            lines[str(parameter_error(file.path, member, error))] = None
    return list(lines)


def _read(scene: Scene, read: Callable[[MatrixChoice], T]) -> T:
    from rom.errors import MatrixFileError, ReducedModelError

    assert scene.model is not None
    files = scene.model.files
    largest = max(files.values(), key=file_size)
    memory = MEMORY + MEMORY_PER_BYTE * sum(map(file_size, files.values()))
    try:
        with copies(list(files.values()), scene.contents) as copy:
            choice = matrix_choice(scene, {name: copy(file) for name, file in files.items()})
            return read_apart(Path(largest), ALLOWED, partial(read, choice), READER, memory)
    except (MatrixFileError, ReducedModelError) as error:
        raise InputError(reason_of(error)) from None


def make_reduced_of_matrices(folder: Path, matrices: MatrixModel, scene: Scene, *, store_basis: bool = True) -> None:
    """Reduce the full model of another program to `rom.h5` and write its sizes into `facts.json`."""
    from rom.reduction.craig_bampton import ReductionOptions, reduce_sector
    from rom.reduction.mode_selection import reduce_to_tolerance

    full, sector = matrices.full, matrices.sector
    modes, limit = scene.rom.fixed_interface_modes, scene.rom.frequency_limit
    boundary = replace(nodal_choice(scene), loads=scene_loads(scene, sector, None))
    if modes == "auto":
        operations = [linear_operation(scene, sector)]
        made = reduce_to_tolerance(full, sector, scene.rom.tolerance, operations, boundary, store_basis=store_basis)
    else:
        made = reduce_sector(full, sector, ReductionOptions(modes, limit, store_basis), boundary, augment=True)
    _write_model(folder / REDUCED_MODEL, made.model, scene)
    if made.augmented is not None:
        _write_model(folder / AUGMENTED_MODEL, made.augmented, scene)
    facts = {"dofs": made.dofs, "modes": made.modes, "highest_mode_hz": made.highest_mode_hz}
    _write_facts(folder, made.model, facts, matrices.notes, scene)


def make_superelement(folder: Path, model: ReducedModel, notes: tuple[str, ...], scene: Scene) -> None:
    """Write a reduced model of another program to `rom.h5` and its sizes into `facts.json`."""
    _write_model(folder / REDUCED_MODEL, model, scene)
    dofs = model.size if model.basis is None else len(model.basis)
    _write_facts(folder, model, {"dofs": dofs, "modes": None}, notes, scene)


def _write_model(path: Path, model: ReducedModel, scene: Scene) -> None:
    """Write a reduced model with the excitation and the contact interfaces of a scene."""
    from rom.files.reduced_model_file import write_reduced_model

    write_reduced_model(path, touching(scene, with_modal_excitation(scene, model)))


def nodal_choice(scene: Scene) -> BoundaryChoice:
    """Excitation of a scene; the contact dofs are displacements of nodes, for averages there are no elements."""
    from rom.reduction.boundary_dofs import BoundaryChoice

    return BoundaryChoice(scene.excitation.unit_direction, scene.excitation.at, "nodal")


def _write_facts(
    folder: Path, model: ReducedModel, facts: dict[str, Any], notes: tuple[str, ...], scene: Scene
) -> None:
    sizes = {"reduced_dofs": model.size, **interface_facts(scene, model), "notes": list(notes)}
    (folder / FACTS).write_text(json.dumps({**facts, **sizes}), encoding="utf-8")

"""Errors of the reduced model of a scene: against the full model on its own mesh, and on another mesh.

The mesh error is Richardson's estimate from two meshes [1]_.

References
----------
.. [1] P. J. Roache, "Perspective: a method for uniform reporting of grid refinement studies", Journal of Fluids
   Engineering 116 (1994) 405-413.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.errors import reason_of
from pipeline.scene.schema import Scene
from pipeline.stages.build_reduced_model import at_speed, boundary_choice
from pipeline.stages.scene_to_solver import linear_operation
from pipeline.verify.model_errors import JointErrors, ModelErrors, OtherMesh
from pipeline.verify.other_mesh import other_sector

if TYPE_CHECKING:
    from geometry import SectorMesh
    from rom import FullModel, FullReference, LinearError, LinearOperation, LinearResponse

# Order of the error of the frequencies in the element size. Quadratic elements have fourth order on smooth solutions;
# the singularities at re-entrant corners reduce it to little more than one.
ORDER = 1.0


@dataclass(frozen=True)
class BladeFiles:
    """Files in the store: mesh and full model at rest of a blade."""

    sector: Path
    full: Path


@dataclass(frozen=True)
class OtherReference:
    """Full model on the other mesh."""

    mesh: OtherMesh
    sector: SectorMesh
    reference: FullReference


@dataclass(frozen=True)
class BladeReference:
    """Full models of one blade.

    Attributes
    ----------
    sector : SectorMesh
        Mesh of the scene.
    dofs : int
        Its degrees of freedom.
    reference : FullReference
        Full model on this mesh.
    nonlinear : FullReference or None
        The same about the nonlinear equilibrium, where the scene has the linear one.
    other : OtherReference or None
        Full model on another mesh, None where there is none.
    reason : str
        Why there is none, otherwise "".
    """

    sector: SectorMesh
    dofs: int
    reference: FullReference
    nonlinear: FullReference | None
    other: OtherReference | None
    reason: str


def blade_reference(scene: Scene, files: BladeFiles) -> BladeReference:
    """The full models of a scene's blade for its frequency range.

    Raises
    ------
    RomParameterError
        The range holds too many modes.
    """
    sector, full = _loaded(scene, files)
    reference = _reference(scene, sector, full)
    try:
        other, reason = _other_reference(scene, len(sector.hexahedra)), ""
    except Exception as error:  # the modal truncation error needs no other mesh
        other, reason = None, reason_of(error)
    return BladeReference(sector, full.n_dofs, reference, _nonlinear_reference(scene, files), other, reason)


def model_errors(scene: Scene, blade: BladeReference, rom: Path, modes: int) -> ModelErrors:
    """Errors of a reduced model in the operation of a scene.

    Parameters
    ----------
    scene : Scene
        Operation: frequency range, damping, engine order, contact stiffness.
    blade : BladeReference
        Full models of its blade.
    rom : Path
        File of the reduced model.
    modes : int
        Its fixed-interface modes.
    """
    from rom import linear_errors, linear_responses, read_reduced_model, static_error

    assert scene.mesh is not None
    model = read_reduced_model(rom, with_basis=False)
    operation = linear_operation(scene, blade.sector)
    exact = linear_responses(blade.reference.model, operation)
    found = linear_responses(model, operation, exact)
    errors = linear_errors(found, exact, operation.frequency_hz)
    elsewhere: Sequence[LinearResponse | None] = [None] * len(exact)
    if blade.other is not None:
        there = linear_operation(scene, blade.other.sector)
        elsewhere = linear_responses(blade.other.reference.model, there, exact)
    return ModelErrors(
        modes=modes,
        dofs=blade.dofs,
        size=scene.mesh.size,
        element=scene.mesh.element,
        other=None if blade.other is None else blade.other.mesh,
        reason=blade.reason,
        convergence=_convergence(scene, blade.other),
        static=static_error(model, blade.reference.flexibility),
        equilibrium=_equilibrium_error(blade, operation, exact),
        joints=tuple(_joint(*each) for each in zip(errors, exact, found, elsewhere, strict=True)),
    )


def _equilibrium_error(
    blade: BladeReference, operation: LinearOperation, found: Sequence[LinearResponse]
) -> float | None:
    """Largest relative error of a natural frequency by the linear equilibrium at speed, None without it."""
    from rom import linear_errors, linear_responses

    if blade.nonlinear is None:
        return None
    exact = linear_responses(blade.nonlinear.model, operation, found)
    return max(error.frequency for error in linear_errors(found, exact, operation.frequency_hz))


def needed_modes(scenes: Sequence[Scene], files: BladeFiles, tolerance: float) -> int | None:
    """Fixed-interface modes that a tolerance needs in the operations of scenes with one blade; None: over 1000."""
    from rom import RomParameterError, reduce_to_tolerance

    first = scenes[0]
    sector, full = _loaded(first, files)
    try:
        return reduce_to_tolerance(
            full,
            sector,
            tolerance,
            [linear_operation(scene, sector) for scene in scenes],
            boundary_choice(first),
            store_basis=False,
        ).modes
    except RomParameterError:
        return None


def _loaded(scene: Scene, files: BladeFiles) -> tuple[SectorMesh, FullModel]:
    """Mesh and full model at the scene's speed."""
    from rom import load_full_model, load_sector

    sector = load_sector(files.sector)
    return sector, at_speed(load_full_model(files.full), sector, scene)


def _nonlinear_reference(scene: Scene, files: BladeFiles) -> FullReference | None:
    if scene.load.speed_rpm == 0.0 or scene.load.equilibrium == "nonlinear":
        return None
    load = scene.load.model_copy(update={"equilibrium": "nonlinear"})
    other = scene.model_copy(update={"load": load})
    return _reference(other, *_loaded(other, files))


def _reference(scene: Scene, sector: SectorMesh, full: FullModel) -> FullReference:
    from rom import full_reference

    return full_reference(full, sector, scene.response.frequency[1], boundary_choice(scene))


def _other_reference(scene: Scene, elements: int) -> OtherReference:
    from rom import Material, assemble

    assert scene.material is not None
    size, element, sector = other_sector(scene, elements)
    at_rest = assemble(sector, Material(**scene.material.model_dump()), element)
    full = at_speed(at_rest, sector, scene)
    return OtherReference(OtherMesh(size, element, full.n_dofs), sector, _reference(scene, sector, full))


def _convergence(scene: Scene, other: OtherReference | None) -> float:
    """Error of this mesh over its difference from the other one, by Richardson extrapolation."""
    assert scene.mesh is not None
    if other is None:
        return math.nan
    if other.mesh.element != scene.mesh.element:  # so much more accurate that it stands for the limit
        return 1.0
    return 1.0 / (1.0 - (other.mesh.size / scene.mesh.size) ** ORDER)


def _joint(
    error: LinearError, exact: LinearResponse, found: LinearResponse, other: LinearResponse | None
) -> JointErrors:
    return JointErrors(
        joint=error.condition,
        first_mode=exact.first_mode,
        full_hz=tuple(exact.natural_hz.tolist()),
        reduced_hz=tuple(found.natural_hz.tolist()),
        within=tuple(error.within.tolist()),
        contact=error.contact,
        output=error.output,
        other_hz=None if other is None else tuple(other.natural_hz.tolist()),
    )

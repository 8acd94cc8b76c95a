"""Errors of the reduced model of a scene: against the full model on its own mesh, and on another mesh.

The error of the contact dofs is measured against springs spread over the face of the full model. The mesh error is
Richardson's estimate from two meshes [1]_, with springs spread over the face on both: under a nodal force the local
compliance grows without limit as the mesh is refined. The other mesh is finer, or coarser where a finer one would be
too large; a mesh from a file has no coarser one, and its elements are cut into eight each.

References
----------
.. [1] P. J. Roache, "Perspective: a method for uniform reporting of grid refinement studies", Journal of Fluids
   Engineering 116 (1994) 405-413.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.errors import reason_of
from pipeline.scene.geometry_parameters import sector_of
from pipeline.scene.schema import Scene
from pipeline.stages.model.build_reduced_model import at_speed, boundary_choice, with_interface
from pipeline.stages.model.model_files import is_joined
from pipeline.stages.model.scene_materials import elements_by_kind, mean_size, scene_materials
from pipeline.stages.scene_to_solver import (
    linear_operation,
    linear_operation_on_face,
    linear_operation_on_model,
    touching_sector,
)
from pipeline.verify.model_errors import JointErrors, ModelErrors, OtherMesh, fitted_order

if TYPE_CHECKING:
    from geometry.sector import SectorMesh
    from rom.cyclic.reduced_model import ReducedModel
    from rom.finite_elements.full_model import FullModel
    from rom.reduction.model_comparison import LinearError, LinearOperation, LinearResponse
    from rom.reduction.reference_model import FullReference


_STEP = 0.7  # from one element size to the next
_MOST_STEPS = 4
_LEAST_GAIN = 1.5  # in elements: different sizes may give the same mesh
_MOST_POINTS = 60_000  # of a finer mesh of a file
_MOST_OF_THIRD = 150_000  # of one whose free natural frequencies alone are computed
_MOST_ELEMENTS = 6_000  # some 90 000 dofs, so that verifying takes about as long as the run itself
_OF_DISK = 0.5  # of these numbers with a disk: its waves are complex


def other_sector(scene: Scene, elements: int) -> tuple[float, str, SectorMesh]:
    """Element size [m], element and mesh to compare the scene's mesh of `elements` elements with."""
    assert scene.mesh is not None
    assert scene.mesh.size is not None
    element, own = scene.mesh.element, scene.mesh.size
    most = _MOST_ELEMENTS if scene.disk is None else _OF_DISK * _MOST_ELEMENTS
    for steps in range(1, _MOST_STEPS + 1):
        size = own * _STEP**steps
        sector = touching_sector(scene, sector_of(scene, size=size))
        if sector.n_elements > most:
            break
        if sector.n_elements >= _LEAST_GAIN * elements:
            # Compared with linear hexahedra, quadratic ones of nearly the same size are as good as exact.
            return size, "hex20" if element == "hex8" else element, sector
    for steps in range(1, _MOST_STEPS + 1):
        size = own / _STEP**steps
        sector = touching_sector(scene, sector_of(scene, size=size))
        if _LEAST_GAIN * sector.n_elements <= elements:
            return size, element, sector
    raise RuntimeError("element sizes nearby give the same mesh")


def finer_sector(own: SectorMesh, parts: int = 2) -> tuple[float, str, SectorMesh]:
    """Mean edge [m], kinds of elements and mesh with 8 or 27 elements in place of each of a mesh from a file."""
    from geometry.subdivision import subdivided

    growth, most = parts**3 * len(own.points), _MOST_POINTS if parts == 2 else _MOST_OF_THIRD
    if is_joined(own):
        most = round(_OF_DISK * most)
    if growth > most:
        part = "half" if parts == 2 else "a third of"
        raise RuntimeError(f"one with {part} the element size would have some {growth} nodes, {most} at most")
    finer = subdivided(own, parts)
    return mean_size(finer), kinds_of(finer), finer


def mesh_of(scene: Scene, sector: SectorMesh) -> tuple[float, str]:
    """Element size, m, and element of the mesh of a scene; of a file the mean edge and the kinds of elements."""
    assert scene.mesh is not None
    if scene.mesh.size is not None:
        return scene.mesh.size, scene.mesh.element
    return mean_size(sector), kinds_of(sector)


def kinds_of(sector: SectorMesh) -> str:
    """The kinds of elements of a mesh: "tet10", "wedge15, hex20"."""
    return ", ".join(elements_by_kind(sector))


Frequencies = tuple[float, ...]  # natural, Hz
# Grids of contact nodes that are tried for a tolerance. An odd number in a direction is hardly better than the even
# one below: the projection gains where it can follow the next odd deformation of the face.
_GRIDS = ((2, 2), (3, 3), (4, 3), (4, 4), (6, 4), (6, 6))
_MARGIN = 0.8  # the other grid comes with another mesh


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
    """Full models of one blade."""

    sector: SectorMesh  # mesh of the scene
    dofs: int  # its degrees of freedom
    reference: FullReference  # full model on this mesh
    nonlinear: FullReference | None  # the same about the nonlinear equilibrium, where the scene has the linear one
    other: OtherReference | None  # full model on another mesh, None where there is none
    reason: str  # why there is none, otherwise ""


def blade_reference(scene: Scene, files: BladeFiles) -> BladeReference:
    """The full models of a scene's blade for its frequency range."""
    sector, full = _loaded(scene, files)
    reference = _reference(scene, files, sector, full)
    try:
        other, reason = _other_reference(scene, sector, files), ""
    except Exception as error:  # the modal truncation error needs no other mesh
        other, reason = None, reason_of(error)
    return BladeReference(sector, full.n_dofs, reference, _nonlinear_reference(scene, files), other, reason)


def model_errors(scene: Scene, blade: BladeReference, rom: Path, modes: int) -> ModelErrors:
    """Errors of a reduced model in the operation of a scene."""
    from rom.files.reduced_model_file import read_reduced_model
    from rom.reduction.model_comparison import linear_errors, linear_responses

    assert scene.mesh is not None
    size, element = mesh_of(scene, blade.sector)
    model = read_reduced_model(rom, with_basis=False)
    operation = linear_operation(scene, blade.sector)
    exact = linear_responses(blade.reference.model, operation)
    found = linear_responses(model, linear_operation_on_model(scene, model), exact)
    errors = linear_errors(found, exact, operation.frequency_hz)
    on_face = _on_face(scene, blade.reference, exact)
    elsewhere: Sequence[Frequencies | None] = [None] * len(exact)
    if blade.other is not None and None not in on_face:
        elsewhere = _on_face(scene, blade.other.reference, exact)
    elif blade.other is not None:
        there = blade.other.reference.model
        elsewhere = _frequencies_like(exact, there, linear_operation_on_model(scene, there))
    return ModelErrors(
        modes=modes,
        dofs=blade.dofs,
        size=size,
        element=element,
        contact_grid=scene.mesh.contact_grid,
        other=None if blade.other is None else blade.other.mesh,
        reason=blade.reason,
        static=_static_error(model, blade.reference, operation.phase),
        equilibrium=_equilibrium_error(blade, operation, exact),
        joints=tuple(_joint(*each) for each in zip(errors, exact, found, on_face, elsewhere, strict=True)),
    )


def with_orders(scene: Scene, files: BladeFiles, errors: ModelErrors) -> ModelErrors:
    """The errors with the order of convergence of each mode, from the natural frequencies on a third mesh.

    Of contacts that are free: the full model alone, without springs on its faces. The meshes of a file are nested:
    size, half and a third of it. Unchanged where there is no such mesh, and for meshes that are made here: they
    change in steps, and frequencies on three of them show no clean rate.
    """
    from rom.finite_elements.full_model import assemble
    from rom.reduction.reference_model import held_frequencies

    free = errors.joints[0]
    if scene.mesh_file is None or errors.other is None or free.other_hz is None:
        return errors
    own = _loaded(scene, files)[0]
    if is_joined(own):  # its waves would take a model of their own
        return errors
    try:
        size, element, sector = finer_sector(own, parts=3)
    except RuntimeError:  # too large: the order stays assumed
        return errors
    materials = scene_materials(scene, files.sector, sector)
    full = at_speed(assemble(sector, materials, None), sector, scene, materials)
    there = held_frequencies(full, free.first_mode - 1 + len(free.full_hz))[free.first_mode - 1 :].tolist()
    sizes = errors.size, errors.other.size, size
    here = free.full_hz if free.face_hz is None else free.face_hz
    fitted = [fitted_order(sizes, each) for each in zip(here, free.other_hz, there, strict=True)]
    orders = (min(fitted),) * (free.first_mode - 1) + tuple(fitted)
    return replace(errors, orders=orders, third=OtherMesh(size, element, full.n_dofs))


def _static_error(model: ReducedModel, reference: FullReference, phase: float) -> float:
    """Relative error of the contact flexibility; NaN where nothing holds the disk."""
    from rom.reduction.reference_model import static_error

    if reference.flexibility is None:
        return math.nan
    return static_error(model, reference.flexibility, min(phase, 2.0 * math.pi - phase))


def _equilibrium_error(
    blade: BladeReference, operation: LinearOperation, found: Sequence[LinearResponse]
) -> float | None:
    """Largest relative error of a natural frequency by the linear equilibrium at speed, None without it."""
    from rom.reduction.model_comparison import linear_errors, linear_responses

    if blade.nonlinear is None:
        return None
    exact = linear_responses(blade.nonlinear.model, operation, found)
    return max(error.frequency for error in linear_errors(found, exact, operation.frequency_hz))


def needed_grid(
    scene: Scene, blade: BladeReference, errors: ModelErrors, tolerance: float
) -> tuple[tuple[int, int], float]:
    """The fewest contact nodes of a mortar that a tolerance needs in the operation of a scene, and their error.

    Where none of the grids tried is enough, the finest of them.
    """
    assert scene.mesh is not None
    own = scene.mesh.contact_grid
    finer = [grid for grid in _GRIDS if math.prod(grid) > math.prod(own)]
    tried = [own, *finer] if scene.rom.contact_dofs != "mortar" else finer
    best = own, errors.contact_frequency
    for grid in tried:
        if not all(n <= most for n, most in zip(grid, blade.reference.face_grid, strict=True)):
            continue
        model = blade.reference.with_mortar(grid)
        operation = linear_operation_on_face(scene, model)
        assert operation is not None  # as the error that was measured
        worst = 0.0
        for joint, springs in zip(errors.joints, operation.contact_conditions().values(), strict=True):
            assert joint.face_hz is not None
            found = _frequencies(model, operation.phase, springs, joint.first_mode, len(joint.face_hz))
            pairs = zip(found, joint.face_hz, joint.within, strict=True)
            worst = max(worst, *(abs(here / exact - 1.0) for here, exact, counts in pairs if counts), 0.0)
        best = grid, worst
        if worst <= _MARGIN * tolerance:
            break
    return best


def needed_modes(scenes: Sequence[Scene], files: BladeFiles, tolerance: float) -> int | None:
    """Fixed-interface modes that a tolerance needs in the operations of scenes with one blade; None: over 1000."""
    from rom.errors import RomParameterError
    from rom.reduction.mode_selection import reduce_to_tolerance

    first = scenes[0]
    sector, full = _loaded(first, files)
    materials = scene_materials(first, files.sector, sector)
    boundary = boundary_choice(first, sector, materials)
    if is_joined(sector):
        boundary = with_interface(full, sector, first, boundary)
    try:
        return reduce_to_tolerance(
            full,
            sector,
            tolerance,
            [linear_operation(scene, sector) for scene in scenes],
            boundary,
            store_basis=False,
        ).modes
    except RomParameterError:
        return None


def _loaded(scene: Scene, files: BladeFiles) -> tuple[SectorMesh, FullModel]:
    """Mesh and full model at the scene's speed."""
    from rom.files.full_model_file import load_full_model
    from rom.files.sector_file import load_sector

    sector = touching_sector(scene, load_sector(files.sector))
    materials = scene_materials(scene, files.sector, sector)
    return sector, at_speed(load_full_model(files.full), sector, scene, materials)


def _nonlinear_reference(scene: Scene, files: BladeFiles) -> FullReference | None:
    if scene.load.speed_rpm == 0.0 or scene.load.equilibrium == "nonlinear":
        return None
    load = scene.load.model_copy(update={"equilibrium": "nonlinear"})
    other = scene.model_copy(update={"load": load})
    return _reference(other, files, *_loaded(other, files))


def _reference(scene: Scene, files: BladeFiles, sector: SectorMesh, full: FullModel) -> FullReference:
    from rom.cyclic.resonance_crossings import excited_nodal_diameter
    from rom.cyclic_sector.wave_reference import wave_reference
    from rom.reduction.reference_model import full_reference

    choice = boundary_choice(scene, sector, scene_materials(scene, files.sector, sector))
    highest, with_face = scene.response.frequency[1], not node_by_node(scene)
    if is_joined(sector):  # of the wave that the engine order excites
        diameter = excited_nodal_diameter(scene.excitation.engine_order, sector.n_blades)
        return wave_reference(full, sector, diameter, highest, choice, with_face=with_face)
    return full_reference(full, sector, highest, choice, with_face=with_face)


def node_by_node(scene: Scene) -> bool:
    """Whether a contact stiffness is given node by node, so that it has no value between the nodes."""
    stiffness = [(face.normal_stiffness, face.tangential_stiffness) for face in scene.contacts.values()]
    return any(isinstance(value, tuple) for both in stiffness for value in both)


def _on_face(scene: Scene, reference: FullReference, exact: Sequence[LinearResponse]) -> Sequence[Frequencies | None]:
    """Natural frequencies, Hz, in each contact condition with springs spread over the face; None: not known."""
    operation = None if reference.face is None else linear_operation_on_face(scene, reference.face)
    if reference.face is None or operation is None:
        return [None] * len(exact)
    return _frequencies_like(exact, reference.face, operation)


def _frequencies_like(
    exact: Sequence[LinearResponse], model: ReducedModel, operation: LinearOperation
) -> list[Frequencies]:
    """Natural frequencies, Hz, of a model in each contact condition, those of the modes of `exact`."""
    return [
        _frequencies(model, operation.phase, springs, response.first_mode, len(response.natural_hz))
        for response, springs in zip(exact, operation.contact_conditions().values(), strict=True)
    ]


def _frequencies(
    model: ReducedModel, phase: float, springs: tuple[Any, Any], first_mode: int, count: int
) -> Frequencies:
    """`count` natural frequencies, Hz, from the mode number `first_mode` on; infinite where the model has none."""
    from rom.cyclic.natural_frequencies import natural_frequencies

    last = first_mode - 1 + count
    found = natural_frequencies(model, phase, normal=springs[0], tangential=springs[1], count=last)
    return (*found.tolist(), *[math.inf] * (last - len(found)))[first_mode - 1 :]


def _other_reference(scene: Scene, own: SectorMesh, files: BladeFiles) -> OtherReference:
    from rom.finite_elements.full_model import assemble

    made_here = scene.mesh_file is None
    size, element, sector = other_sector(scene, own.n_elements) if made_here else finer_sector(own)
    materials = scene_materials(scene, files.sector, sector)
    full = at_speed(assemble(sector, materials, element if made_here else None), sector, scene, materials)
    return OtherReference(OtherMesh(size, element, full.n_dofs), sector, _reference(scene, files, sector, full))


def _joint(
    error: LinearError,
    exact: LinearResponse,
    found: LinearResponse,
    on_face: Frequencies | None,
    other: Frequencies | None,
) -> JointErrors:
    return JointErrors(
        joint=error.condition,
        first_mode=exact.first_mode,
        full_hz=tuple(exact.natural_hz.tolist()),
        reduced_hz=tuple(found.natural_hz.tolist()),
        within=tuple(error.within.tolist()),
        contact=error.contact,
        output=error.output,
        face_hz=on_face,
        other_hz=other,
    )

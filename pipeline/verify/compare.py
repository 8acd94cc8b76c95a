"""The reduced model of a scene measured against the full model on its own mesh and on another one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.checks import geometry_parameters
from pipeline.errors import reason_of
from pipeline.fingerprint import fingerprint
from pipeline.making import at_speed
from pipeline.operation import linear_operation
from pipeline.scene import Scene
from pipeline.verify.model_errors import JointErrors, ModelErrors, OtherMesh

if TYPE_CHECKING:
    from geometry import SectorMesh
    from rom import FullModel, FullReference, LinearAnswer, LinearError

STEP = 0.7  # from one element size to the next
MOST_STEPS = 4
LEAST_GAIN = 1.5  # in elements: sizes that differ may make the same mesh
MOST_ELEMENTS = 10_000  # of the other mesh (some 150 000 dofs): it is not to take much longer than the run itself
# Order of the frequencies' error in the element size: straight element edges, re-entrant corners and forces on single
# nodes leave second order of the fourth that quadratic elements have on smooth solutions.
ORDER = 2.0


@dataclass(frozen=True)
class Meshed:
    """A full model with its mesh."""

    sector: SectorMesh
    full: FullModel


@dataclass(frozen=True)
class Files:
    """Mesh, full model at rest and reduced model of a scene in the store."""

    sector: Path
    full: Path
    rom: Path


@dataclass
class OtherMeshes:
    """Answers on other meshes, kept while cases that share their blade follow each other."""

    found: dict[str, tuple[OtherMesh, SectorMesh, FullReference]] = field(default_factory=dict)


def model_errors(scene: Scene, files: Files, modes: int, tolerance: float, others: OtherMeshes) -> ModelErrors:
    """Errors of the reduced model of a scene with so many fixed-interface modes.

    Raises RomParameterError where the frequency range holds too many modes, and whatever reading the files raises.
    """
    from geometry import load_sector
    from rom import linear_answers, linear_errors, load_full_model, read_reduced_model, static_error

    assert scene.mesh is not None
    model = read_reduced_model(files.rom, with_basis=False)
    sector = load_sector(files.sector)
    here = Meshed(sector, at_speed(load_full_model(files.full), sector, scene))
    operation = linear_operation(scene, sector)
    reference = _reference(scene, here)
    exact = linear_answers(reference.model, operation)
    found = linear_answers(model, operation, exact)
    errors = linear_errors(found, exact, operation.frequency)
    needed = _needed_modes(scene, here, tolerance) if max(e.worst for e in errors) > tolerance else None
    other, elsewhere, reason = _other_answers(scene, here, exact, others)
    size = scene.mesh.size
    return ModelErrors(
        modes=modes,
        needed_modes=needed,
        dofs=here.full.n_dofs,
        size=size,
        element=scene.mesh.element,
        other=other,
        reason=reason,
        convergence=_convergence(scene.mesh.element, size, other),
        static=static_error(model, reference.flexibility),
        joints=tuple(_joint(*each) for each in zip(errors, exact, found, elsewhere, strict=True)),
    )


def _joint(error: LinearError, exact: LinearAnswer, found: LinearAnswer, other: LinearAnswer | None) -> JointErrors:
    return JointErrors(
        joint=error.joint,
        first_mode=exact.first_mode,
        full_hz=tuple(exact.natural_hz.tolist()),
        reduced_hz=tuple(found.natural_hz.tolist()),
        within=tuple(error.within.tolist()),
        contact=error.contact,
        output=error.output,
        other_hz=None if other is None else tuple(other.natural_hz.tolist()),
    )


def _reference(scene: Scene, meshed: Meshed) -> FullReference:
    from rom import full_reference

    return full_reference(
        meshed.full,
        meshed.sector,
        scene.response.frequency[1],
        excitation_direction=scene.excitation.unit_direction,
        excitation_at=scene.excitation.at,
    )


def _needed_modes(scene: Scene, here: Meshed, tolerance: float) -> int | None:
    """Fixed-interface modes that the tolerance needs; None where as many as may be kept are too few."""
    from rom import RomParameterError, reduce_within

    try:
        return reduce_within(
            here.full,
            here.sector,
            tolerance,
            linear_operation(scene, here.sector),
            excitation_direction=scene.excitation.unit_direction,
            excitation_at=scene.excitation.at,
            store_basis=False,
        ).modes
    except RomParameterError:
        return None


def _convergence(element: str, size: float, other: OtherMesh | None) -> float:
    """Error of the mesh at hand over its difference from the other mesh, by Richardson's extrapolation."""
    if other is None:
        return math.nan
    if other.element != element:  # so much better that it stands for the limit
        return 1.0
    return 1.0 / (1.0 - (other.size / size) ** ORDER)


def _other_answers(
    scene: Scene, here: Meshed, exact: Sequence[LinearAnswer], others: OtherMeshes
) -> tuple[OtherMesh | None, Sequence[LinearAnswer | None], str]:
    """The other mesh with its answers; without them the reason why there are none."""
    from rom import linear_answers

    key = fingerprint(
        {
            "scene": scene.model_dump(include={"blade", "shroud", "material", "mesh", "load"}),
            "direction": scene.excitation.unit_direction,
            "at": scene.excitation.at,
            "highest": scene.response.frequency[1],
        }
    )
    if key not in others.found:
        others.found.clear()  # one at a time: they are large
        try:
            mesh, meshed = _other_mesh(scene, here)
            others.found[key] = mesh, meshed.sector, _reference(scene, meshed)
        except Exception as error:  # what the modes left out do is known without it
            return None, [None] * len(exact), reason_of(error)
    mesh, sector, reference = others.found[key]
    return mesh, linear_answers(reference.model, linear_operation(scene, sector), exact), ""


def _other_mesh(scene: Scene, here: Meshed) -> tuple[OtherMesh, Meshed]:
    """A finer mesh; a coarser one where that would be too large.

    Raises RuntimeError when sizes nearby make the same mesh, GeometryError or MeshingError when they make none.
    """
    from rom import Material, assemble

    assert scene.mesh is not None
    assert scene.material is not None
    size, element, sector = _other_sector(scene, len(here.sector.hexahedra))
    full = assemble(sector, Material(**scene.material.model_dump()), element)
    meshed = Meshed(sector, at_speed(full, sector, scene))
    return OtherMesh(size, element, full.n_dofs), meshed


def _other_sector(scene: Scene, elements: int) -> tuple[float, str, SectorMesh]:
    """Element size, element and mesh to compare a mesh of so many elements with."""
    from geometry import build_sector

    blade, shroud, mesh = geometry_parameters(scene)
    assert scene.mesh is not None
    element = scene.mesh.element
    for steps in range(1, MOST_STEPS + 1):
        sector = build_sector(blade, shroud, replace(mesh, size=mesh.size * STEP**steps))
        if len(sector.hexahedra) > MOST_ELEMENTS:
            break
        if len(sector.hexahedra) >= LEAST_GAIN * elements:
            # Against hexahedra of first order quadratic ones of nearly the same size are as good as exact.
            return mesh.size * STEP**steps, "hex20" if element == "hex8" else element, sector
    for steps in range(1, MOST_STEPS + 1):
        sector = build_sector(blade, shroud, replace(mesh, size=mesh.size / STEP**steps))
        if LEAST_GAIN * len(sector.hexahedra) <= elements:
            return mesh.size / STEP**steps, element, sector
    raise RuntimeError("element sizes nearby make the same mesh")

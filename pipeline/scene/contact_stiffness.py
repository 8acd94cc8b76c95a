"""Estimate, without a mesh, of what the contact dofs of a scene cost where its contacts are stiff.

Two things make stuck frequencies too low. Equal springs at n equal parts of an edge lose 1/n^2 of the rotational
stiffness of the face. And the face deforms between contact nodes, the more the stiffer the springs are against the
elastic stiffness of the face, some E sqrt(A). The numbers are fitted to measured errors of the first five stuck
frequencies of three blades at 70 to 180 degrees, the largest over several engine orders.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pipeline.scene.mesh_section import Mesh
from pipeline.scene.reading import Member, key_in_file
from pipeline.scene.schema import Contact, Material, Rom, Scene

LARGEST = 0.01  # relative error of a stuck frequency without a warning
GRIDS = ((3, 3), (4, 4), (6, 6))  # that are proposed
CURVE_81_NODES = 37.0  # processor time of a curve of the default blade with 9 x 9 contact nodes and 3 harmonics, s
LONG = 1.5  # minutes of processor time from which a curve is said to take long


@dataclass(frozen=True)
class StiffContact:
    """A stiffness that the contact dofs resolve badly: its key, its value in N/m, the estimated error, the cure."""

    key: str
    stiffness: float
    error: float
    cure: str


def stiff_contact(scene: Scene) -> StiffContact | None:
    """The stiffness of a scene that its contact dofs resolve worst, if above 1 %; None also without a blade."""
    if scene.blade is None or scene.shroud is None or scene.material is None or scene.mesh is None:
        return None
    sides = scene.shroud.contact_length, scene.shroud.thickness
    punch = _punch(scene.material, sides)
    normal, tangential = _whole_face(scene.contact, punch)
    key = "normal_stiffness" if normal >= tangential else "tangential_stiffness"
    stiffness = max(normal, tangential)
    ratio = stiffness / (scene.material.young_modulus * math.sqrt(sides[0] * sides[1]))
    error = estimated_error(scene.rom.contact_dofs, scene.mesh.contact_grid, sides, ratio)
    if error <= LARGEST:
        return None
    return StiffContact(f"contact.{key}", stiffness, error, _cure(scene.rom, scene.mesh, sides, ratio, max(punch)))


def estimated_error(kind: str, grid: tuple[int, int], sides: tuple[float, float], ratio: float) -> float:
    """Largest relative error of a stuck frequency, as a rule."""
    longest = max(sides)
    errors = []
    for count, side in zip(grid, sides, strict=True):
        if kind != "mortar" or count == 1:  # lost rotational stiffness, and what it can do at most
            most = 1.6 if kind == "nodal" else 0.45
            errors.append((side / longest / count) ** 2 * min(25.0 * ratio, most))
        else:  # polynomials of degree 1 and 2 do equally well, so do 3 and 4
            even = 2.0 * (count // 2) * longest / side
            errors.append(min(0.01 * ratio / 10.0 ** (even / 2.0 - 1.0), 0.16 / even))
    return max(errors)


def stiff_contact_warning(member: Member) -> tuple[str, str] | None:
    """Key and text of the warning about a stiffness that the contact dofs resolve badly."""
    scene = member.scene
    found = stiff_contact(scene)
    if found is None:
        return None
    assert scene.mesh is not None
    along, radial = scene.mesh.contact_grid
    kind, percent = scene.rom.contact_dofs, float(f"{100.0 * found.error:.1g}")
    text = (
        f"{key_in_file(member, found.key)}: {found.stiffness:.3g} N/m is stiff for {along} x {radial} contact nodes "
        f"({kind}): stuck natural frequencies up to some {percent:g} % too low "
        f"(an estimate, shroud verify measures it); {found.cure}"
    )
    return found.key, text


def many_nodes_warning(member: Member) -> tuple[str, str] | None:
    """Key and text of the warning about contact nodes that are so many that a curve takes long."""
    mesh = member.scene.mesh
    if mesh is None:
        return None
    along, radial = mesh.contact_grid
    minutes = CURVE_81_NODES * (along * radial / 81.0) ** 3 / 60.0
    if minutes < LONG:
        return None
    key = "mesh.contact_grid"
    nodal = member.scene.rom.contact_dofs == "nodal"
    enough = "" if nodal else "; [5, 5] has the same peaks unless contacts are stiff"
    return key, (
        f"{key_in_file(member, key)}: with {along} x {radial} contact nodes a curve takes some {minutes:.0f} minutes "
        f"of processor time (it grows with the third power of their number), the model some minutes too{enough}"
    )


def _cure(rom: Rom, mesh: Mesh, sides: tuple[float, float], ratio: float, punch: float) -> str:
    """What to change in the scene; `punch` is the stiffness of a punch, N/m, the rest as in `estimated_error`."""
    changes = [] if rom.contact_dofs == "mortar" else ['rom.contact_dofs = "mortar"']
    for grid in (mesh.contact_grid, *GRIDS):
        if estimated_error("mortar", grid, sides, ratio) <= LARGEST:
            if grid != mesh.contact_grid:
                changes.append(f"mesh.contact_grid = [{grid[0]}, {grid[1]}]")
            return f"set {' and '.join(changes)}"
    return f"lower it: the deformation of the blades is in the mesh, and a punch has {punch:.2g} N/m"


def _punch(material: Material, sides: tuple[float, float]) -> tuple[float, float]:
    """Stiffness kn, kt of a punch of the size of the face, N/m."""
    from nonlinear import punch_stiffness

    return punch_stiffness(material.young_modulus, material.poisson_ratio, sides[0] * sides[1])


def _whole_face(contact: Contact, punch: tuple[float, float]) -> tuple[float, float]:
    """Stiffness kn, kt of the whole face, N/m."""
    values = []
    for given, computed in zip((contact.normal_stiffness, contact.tangential_stiffness), punch, strict=True):
        values.append(sum(given) if isinstance(given, tuple) else computed if isinstance(given, str) else given)
    return values[0], values[1]

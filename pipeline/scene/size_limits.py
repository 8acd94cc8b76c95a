"""Size limits: values that each key allows and that would take too long together; speeds that no blade stands."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from nonlinear.options import MOST_UNKNOWNS
from pipeline.errors import input_error, shown
from pipeline.scene.blade_section import Platform, Snubber
from pipeline.scene.geometry_parameters import airfoil_of, geometry_parameters
from pipeline.scene.input_files import file_size
from pipeline.scene.reading import Member, SceneFile
from pipeline.scene.schema import Scene

if TYPE_CHECKING:
    from pathlib import Path


LARGEST_STRAIN = 0.05  # beyond it no material of a blade is elastic
USUAL_STRAIN = 0.005  # about the yield strain of alloys for blades


def centrifugal_strain(scene: Scene, radii: tuple[float, float] | None = None) -> float:
    """Strain at the root of a uniform blade, rho Omega^2 (r_tip^2 - r_hub^2) / (2 E); 0 for a scene without a blade.

    The platform and the taper of the airfoil are left out: an estimate that tells a mistyped speed from a real one.
    """
    if radii is None and scene.blade is not None:
        radii = scene.blade.hub_radius, scene.blade.hub_radius + scene.blade.length
    if radii is None or scene.material is None:
        return 0.0
    hub, tip = radii
    per_square = scene.material.density * (tip**2 - hub**2) / (2.0 * scene.material.young_modulus)
    return per_square * _omega(scene) ** 2


def check_speed(path: Path, member: Member) -> None:
    """Refuse a speed at which the centrifugal strain is above `LARGEST_STRAIN`."""
    strain = centrifugal_strain(member.scene)
    if strain > LARGEST_STRAIN:
        speed = member.scene.load.speed_rpm
        raise input_error(path, member.key_in_file("load.speed_rpm"), shown(speed), allowed_speed(speed, strain))


def allowed_speed(speed: float, strain: float) -> str:
    """What is allowed in place of a speed, rev/min, with a strain above `LARGEST_STRAIN`."""
    most = speed * math.sqrt(LARGEST_STRAIN / strain)
    said = f"the centrifugal strain of this blade is above {100.0 * LARGEST_STRAIN:g} %"
    return f"0 to {_rounded_down(most):g} rev/min: faster, {said}"


def speed_warning(member: Member) -> str:
    """The part of a warning after the key where the strain is above `USUAL_STRAIN`; otherwise an empty text."""
    strain = centrifugal_strain(member.scene)
    if strain <= USUAL_STRAIN:
        return ""
    speed = shown(member.scene.load.speed_rpm)
    return f"{speed} is unusual; the centrifugal strain of this blade is about {100.0 * strain:.2g} %"


def tip_speed(scene: Scene) -> float:
    """Speed of the tip of a blade made here, m/s; 0 at rest and where the radius is not known."""
    return 0.0 if scene.blade is None else _omega(scene) * (scene.blade.hub_radius + scene.blade.length)


def _omega(scene: Scene) -> float:
    from rom.units import angular_speed

    return float(angular_speed(scene.load.speed_rpm))


def _rounded_down(value: float) -> float:
    """A positive number with two digits, not larger than the value."""
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.floor(value / step) * step


LARGEST_MODEL = 400_000  # elements; ten times what takes a comfortable time
LARGEST_SWEEP = 100 * LARGEST_MODEL  # elements of all models of a sweep
AUTO_HARMONICS = 5  # that "auto" must be able to use; it stops before the balance gets too large
BYTES_OF_AN_ELEMENT = 100.0  # of a mesh file, its nodes included
COARSER = 3.0  # layers of the disk than elements of the blade
MARGIN = 0.1  # of the blade's length: how far from the blade a point may lie that is meant to be on it


def check_size(path: Path, member: Member) -> None:
    """Refuse a mesh of too many elements and a loaded point off the blade."""
    scene = member.scene
    if scene.mesh_file is not None:
        return  # what is in the file is known when it has been read
    assert scene.mesh is not None  # a scene that describes a blade has one
    elements = estimated_elements(scene)
    if elements > LARGEST_MODEL:
        allowed = f"larger elements (these are about {float(f'{elements:.2g}'):.0f}, at most {LARGEST_MODEL})"
        raise input_error(path, member.key_in_file("mesh.size"), shown(scene.mesh.size), allowed)
    at = scene.excitation.at
    if not isinstance(at, str) and not _near_the_blade(scene, at):
        raise input_error(
            path, member.key_in_file("excitation.at"), shown(list(at)), f"a point of {_extent(scene)}, m"
        )


def check_balance(path: Path, member: Member, n_contacts: int) -> None:
    """Refuse more unknowns than a balance can be solved for: three directions, contact nodes, harmonics."""
    harmonics = member.scene.response.harmonics
    kept = AUTO_HARMONICS if harmonics == "auto" else harmonics
    unknowns = 3 * n_contacts * (2 * kept + 1)
    if unknowns > MOST_UNKNOWNS:
        most = (MOST_UNKNOWNS // (3 * n_contacts) - 1) // 2
        fewer = f"{most} at most" if most >= 1 else "fewer contact nodes"
        allowed = f"{fewer} with {n_contacts} contact nodes a face (this makes {unknowns} unknowns)"
        raise input_error(path, member.key_in_file("response.harmonics"), shown(harmonics), allowed)


def check_modes(path: Path, member: Member, n_contacts: int) -> None:
    """Refuse more damping ratios or mode shapes than the reduced model has modes, as far as that is known."""
    scene = member.scene
    if scene.rom.frequency_limit is not None:
        return
    points = 1 if scene.excitation.at == "tip" else 2
    modes = scene.rom.fixed_interface_modes
    chosen = modes == "auto"  # then a list may have no more ratios than there are modes whatever is chosen
    inside = modes if isinstance(modes, int) else 0
    most = 6 * n_contacts + 3 * points + inside
    ratios = scene.response.damping_ratio
    if isinstance(ratios, tuple) and len(ratios) > most:
        raise input_error(
            path, member.key_in_file("response.damping_ratio"), f"a list of {len(ratios)}", f"{most} at most"
        )
    if scene.render is not None and not chosen and max(scene.render.modes) > most:
        allowed = f"1 to {most}: the reduced model has no more"
        raise input_error(path, "render.modes", shown(list(scene.render.modes)), allowed)


def check_sweep(file: SceneFile) -> None:
    """Refuse a sweep whose models would take too long."""
    models = {_behind_the_model(member.scene): member.scene for member in file.members}
    # one that is too large by itself is a matter of its own
    elements = sum(min(estimated_elements(scene), LARGEST_MODEL) for scene in models.values())
    if elements > LARGEST_SWEEP:
        found = f"{len(models)} different models of some {elements:.2g} elements in all"
        raise input_error(file.path, "sweep", found, f"{LARGEST_SWEEP:.2g} elements at most")


def estimated_elements(scene: Scene) -> float:
    """Elements of airfoil, platform and disk, one in each direction at least: a guard against a mistyped size.

    Of a mesh from a file as many as a file of its size has at most.
    """
    if scene.mesh_file is not None:
        return file_size(scene.mesh_file) / BYTES_OF_AN_ELEMENT
    assert scene.blade is not None
    assert scene.mesh is not None
    assert scene.mesh.size is not None
    blade, shroud, size = airfoil_of(scene), scene.shroud, scene.mesh.size
    airfoil = [max(side / size, 1.0) for side in (blade.chord, blade.thickness, blade.length)]
    width, thickness = (blade.chord, 0.0) if shroud is None else (shroud.axial_width, shroud.thickness)
    platform = [max(side / size, 1.0) for side in (_pitch(scene), width, thickness)]
    wings = sum(_wing_elements(scene, wing, size) for wing in (scene.snubber, scene.platform) if wing is not None)
    layers = _disk_layers(scene, size)
    return math.prod(airfoil) + math.prod(platform) + math.prod(platform[:2]) * layers + wings


def _wing_elements(scene: Scene, wing: Snubber | Platform, size: float) -> float:
    """Elements of a snubber or a platform, one pitch long."""
    assert scene.blade is not None
    sides = 2.0 * math.pi * wing.radius / scene.blade.n_blades, wing.width or airfoil_of(scene).chord, wing.thickness
    return math.prod(max(side / size, 1.0) for side in sides)


def _disk_layers(scene: Scene, size: float) -> float:
    """Layers of elements of the disk along the radius, each with the quadrilaterals of the platform."""
    if scene.disk is None or scene.blade is None:
        return 0.0
    height = max(scene.blade.hub_radius - scene.disk.bore_radius, 0.0)
    return height / min(scene.disk.size or COARSER * size, COARSER * size)


def _behind_the_model(scene: Scene) -> tuple[object, ...]:
    excitation = scene.excitation.direction, scene.excitation.at
    materials = tuple(sorted(scene.materials.items()))
    blade = scene.blade, scene.shroud, scene.snubber, scene.platform, scene.disk
    return *blade, scene.material, materials, scene.mesh, scene.rom, scene.load, excitation


def _pitch(scene: Scene) -> float:
    assert scene.blade is not None
    return 2.0 * math.pi * (scene.blade.hub_radius + scene.blade.length) / scene.blade.n_blades


def _half_extents(scene: Scene) -> tuple[float, float]:
    """Half extents of the blade along the axis and around it, m, with room for twist and the Z of the shroud."""
    from geometry.blade.fitting import side_edge_angle

    assert scene.blade is not None
    parameters = geometry_parameters(scene)
    blade, shroud = parameters["blade"], parameters["shroud"]
    if shroud is None:
        return blade.chord / 2.0, _pitch(scene) + blade.chord
    wide = max(shroud.axial_width, blade.chord)
    slant = math.radians(side_edge_angle(blade, shroud))
    return wide / 2.0, _pitch(scene) + wide + shroud.axial_width / 2.0 * abs(math.tan(slant))


def _near_the_blade(scene: Scene, at: tuple[float, float, float]) -> bool:
    assert scene.blade is not None
    blade, margin, (along, around) = scene.blade, MARGIN * scene.blade.length, _half_extents(scene)
    radius = math.hypot(at[1], at[2])
    return (
        _inner_radius(scene) - margin <= radius <= blade.hub_radius + blade.length + margin
        and abs(at[0]) <= along + margin
        and abs(at[1]) <= around + margin
        and at[2] > 0.0
    )


def _inner_radius(scene: Scene) -> float:
    assert scene.blade is not None
    return scene.blade.hub_radius if scene.disk is None else scene.disk.bore_radius


def _extent(scene: Scene) -> str:
    assert scene.blade is not None
    low, high, (along, around) = (
        _inner_radius(scene),
        scene.blade.hub_radius + scene.blade.length,
        _half_extents(scene),
    )
    return f"the blade: radius {low:g} to {high:g}, x within {along:g} and y within {around:g} of the stacking axis"

"""Strain of the blade by rotation: speeds that no blade stands are refused, those that few stand are warned of."""

from __future__ import annotations

import math
from pathlib import Path

from pipeline.errors import input_error, shown
from pipeline.scene.reading import Member, key_in_file
from pipeline.scene.schema import Scene

LARGEST_STRAIN = 0.05  # beyond it no material of a blade is elastic
USUAL_STRAIN = 0.005  # about the yield strain of alloys for blades


def centrifugal_strain(scene: Scene) -> float:
    """Strain at the root of a uniform blade, rho Omega^2 (r_tip^2 - r_hub^2) / (2 E); 0 for a scene without a blade.

    The platform and the taper of the airfoil are left out: an estimate that tells a mistyped speed from a real one.
    """
    return _strain_per_square(scene) * _omega(scene) ** 2


def check_speed(path: Path, member: Member) -> None:
    """Refuse a speed at which the centrifugal strain is above `LARGEST_STRAIN`.

    Raises
    ------
    InputError
        With `load.speed_rpm` and the largest speed for this blade.
    """
    scene = member.scene
    if centrifugal_strain(scene) <= LARGEST_STRAIN:
        return
    speed = scene.load.speed_rpm
    most = speed * math.sqrt(LARGEST_STRAIN / centrifugal_strain(scene))
    strain = f"the centrifugal strain of this blade is above {100.0 * LARGEST_STRAIN:g} %"
    allowed = f"0 to {_rounded_down(most):g} rev/min: faster, {strain}"
    raise input_error(path, key_in_file(member, "load.speed_rpm"), shown(speed), allowed)


def speed_warning(member: Member) -> str:
    """The part of a warning after the key where the strain is above `USUAL_STRAIN`; otherwise an empty text."""
    strain = centrifugal_strain(member.scene)
    if strain <= USUAL_STRAIN:
        return ""
    speed = shown(member.scene.load.speed_rpm)
    return f"{speed} is unusual; the centrifugal strain of this blade is about {100.0 * strain:.2g} %"


def _strain_per_square(scene: Scene) -> float:
    """Strain over the square of the angular speed, s^2."""
    if scene.blade is None or scene.material is None:
        return 0.0
    hub, tip = scene.blade.hub_radius, scene.blade.hub_radius + scene.blade.length
    return scene.material.density * (tip**2 - hub**2) / (2.0 * scene.material.young_modulus)


def _omega(scene: Scene) -> float:
    from rom import angular_speed

    return float(angular_speed(scene.load.speed_rpm))


def _rounded_down(value: float) -> float:
    """A positive number with two digits, not larger than the value."""
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.floor(value / step) * step

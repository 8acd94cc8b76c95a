"""Strain of the blade by rotation: speeds that no blade stands are refused, those that few stand are warned of."""

from __future__ import annotations

import math
from pathlib import Path

from pipeline.errors import input_error, shown
from pipeline.scene.reading import Member, key_in_file
from pipeline.scene.schema import Scene

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
        raise input_error(path, key_in_file(member, "load.speed_rpm"), shown(speed), allowed_speed(speed, strain))


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


def _omega(scene: Scene) -> float:
    from rom import angular_speed

    return float(angular_speed(scene.load.speed_rpm))


def _rounded_down(value: float) -> float:
    """A positive number with two digits, not larger than the value."""
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.floor(value / step) * step

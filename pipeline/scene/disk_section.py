"""[disk] of a scene: the disk under the blades."""

from __future__ import annotations

from typing import Literal

from pipeline.scene.fields import LENGTH, Length, Section, key


class Disk(Section):
    """[disk]: the disk that carries the blades; without it each blade is clamped at its root."""

    bore_radius: Length = key("inner radius, m", LENGTH)
    rim_width: Length = key("axial width at the hub radius, m; the airfoil stands on it", LENGTH)
    bore_width: Length | None = key(
        "axial width at the bore, m; by default that of the rim, linear between them", LENGTH, None
    )
    profile: tuple[tuple[Length, Length], ...] = key(
        "[radius, axial width], m, at further radii between bore and rim",
        "a list of [radius, width], two numbers above 0, 1e-6 to 1000, with ascending radii",
        (),
    )
    bore: Literal["clamped", "free"] = key("whether the bore is held", '"clamped" or "free"', "clamped")
    size: Length | None = key(
        "length of the elements along the radius at the bore, m; by default three times mesh.size", LENGTH, None
    )

"""Random blades of proportions that turbines have; what the package may not refuse, it must mesh."""

import numpy as np

from geometry import BladeParameters, MeshParameters, ShroudParameters

ELEMENTS_ALONG_CHORD = 8


def random_blade(seed):
    """Blade, shroud and mesh of solidity 0.8 to 1.6, stagger up to 65 degrees, thickness 4 to 15 % of the chord."""
    random = np.random.default_rng([16, seed])
    draw = random.uniform
    n_blades = int(random.integers(20, 121))
    tip = draw(0.2, 0.8)
    hub = tip * draw(0.4, 0.85)
    pitch = 2 * np.pi * tip / n_blades
    chord = draw(0.8, 1.6) * pitch
    side = random.choice([-1.0, 1.0])
    stagger, twist = side * draw(0.0, 65.0), side * draw(0.0, 35.0)
    thickness = chord * draw(0.04, 0.15)
    width = chord * np.cos(np.radians(stagger)) + thickness * abs(np.sin(np.radians(stagger)))
    width *= draw(1.1, 1.5)
    blade = BladeParameters(
        n_blades=n_blades,
        hub_radius=round(hub, 4),
        length=round(tip - hub, 4),
        chord=round(chord, 5),
        thickness=round(thickness, 5),
        tip_thickness=round(thickness * draw(0.6, 1.0), 5),
        twist=float(round(twist, 1)),
        root_stagger=float(round(stagger - twist, 1)),
        section=str(random.choice(["rectangle", "lens"])),
        fillet_radius=round(thickness * draw(0.1, 0.6), 5) if draw() < 0.5 else 0.0,
    )
    shroud = ShroudParameters(
        angle=round(draw(30.0, 180.0), 1),
        thickness=round(chord * draw(0.08, 0.2), 5),
        axial_width=float(round(width, 5)),
        contact_length=round(min(width, pitch) * draw(0.15, 0.5), 5),
        fillet_radius=round(thickness * draw(0.1, 0.4), 5) if draw() < 0.5 else 0.0,
        gap=round(pitch * 0.002 * float(random.integers(0, 2)), 6),
    )
    return blade, shroud, MeshParameters(round(chord / ELEMENTS_ALONG_CHORD, 5))

"""Random blades of proportions that turbines have; what the package may not refuse, it must mesh."""

import numpy as np

from geometry import BladeParameters, MeshParameters, ShroudParameters

ELEMENTS_ALONG_CHORD = 8


def random_blade(seed):
    """Blade, shroud and mesh of solidity 0.8 to 1.6, stagger up to 65 degrees, thickness 4 to 15 % of the chord.

    Half of them have fillets, and half camber, as far as no end of the camber line turns beyond 80 degrees.
    """
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
    camber = draw(0.0, min(90.0, 160.0 - 2 * abs(stagger))) if draw() < 0.5 else 0.0
    root_fillet, fillet = (thickness * draw(0.1, 0.5) if draw() < 0.5 else 0.0 for _ in range(2))
    width = axial_extent(chord, thickness, camber, stagger, fillet) * draw(1.1, 1.5)
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
        fillet_radius=round(root_fillet, 5),
        camber=round(camber, 1),
    )
    shroud = ShroudParameters(
        angle=round(draw(30.0, 180.0), 1),
        thickness=round(chord * draw(0.08, 0.2), 5),
        axial_width=float(round(width, 5)),
        contact_length=float(round(min(width, pitch) * draw(0.15, 0.5), 5)),
        gap=round(pitch * 0.002 * float(random.integers(0, 2)), 6),
        fillet_radius=round(fillet, 5),
    )
    return blade, shroud, MeshParameters(round(min(chord / ELEMENTS_ALONG_CHORD, (tip - hub) / 4), 5))


def axial_extent(chord, thickness, camber, stagger, fillet):
    """Axial width that the section needs on both sides of its centre, from points of a cambered strip, m."""
    turn = np.radians(camber) / 2 * np.linspace(-1, 1, 41) if camber else np.zeros(2)
    radius = chord / 2 / np.sin(np.radians(camber) / 2) if camber else 0.0
    along = radius * np.sin(turn) if camber else chord / 2 * np.array([-1.0, 1.0])
    across = radius * (np.cos(turn) - np.mean(np.cos(turn)))
    x = along * np.cos(np.radians(stagger)) - across * np.sin(np.radians(stagger))
    return 2 * np.abs(x).max() + thickness + 2 * fillet

"""Sections of an airfoil as points, written without looking at how the package takes them."""

import numpy as np


def outline(chord, thickness, camber=0.0, count=30, edge=0.25):
    """Points (n, 2) round a section with parabolic sides, about a circular arc, counterclockwise; centroid near 0."""
    along = np.linspace(-1.0, 1.0, count)
    half = thickness / 2 * (edge + (1 - edge) * (1 - along**2))
    turn = np.radians(camber) / 2
    if turn == 0.0:
        middle, normal = np.stack([along * chord / 2, 0 * along], axis=1), np.tile([0.0, 1.0], (count, 1))
    else:
        radius = chord / 2 / np.sin(turn)
        middle = radius * np.stack([np.sin(along * turn), np.cos(along * turn) - np.sin(turn) / turn], axis=1)
        normal = np.stack([np.sin(along * turn), np.cos(along * turn)], axis=1)
    return np.vstack([middle - half[:, None] * normal, (middle + half[:, None] * normal)[::-1]])


def naca(chord, share, count=30, sharp=True):
    """Points (n, 2) of a four-digit NACA section without camber, `share` thick, with a sharp or a blunt edge."""
    x = (1 - np.cos(np.linspace(0.0, np.pi, count))) / 2
    last = 0.1036 if sharp else 0.1015
    y = 5 * share * (0.2969 * np.sqrt(x) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - last * x**4)
    upper, lower = np.stack([x, y], axis=1), np.stack([x, -y], axis=1)[1:]
    return chord * (np.vstack([lower, upper[::-1]]) - [0.42, 0.0])


def placed(section, stagger, radius, shift=(0.0, 0.0)):
    """Points (n, 3): x, arc length, radius of a section turned by a stagger, degrees."""
    c, s = np.cos(np.radians(stagger)), np.sin(np.radians(stagger))
    xy = section @ np.array([[c, s], [-s, c]]) + np.asarray(shift)
    return np.column_stack([xy, np.full(len(xy), radius)])


def sections_of(blade, tip, heights=(0.0, 0.5, 1.0), count=30):
    """Those of a parametric lens at relative heights up to the radius `tip`."""
    ends = blade.thickness, blade.tip_thickness or blade.thickness
    return [
        placed(
            outline(blade.chord, ends[0] + h * (ends[1] - ends[0]), blade.camber, count),
            blade.root_stagger + h * blade.twist,
            blade.hub_radius + h * (tip - blade.hub_radius),
        )
        for h in heights
    ]

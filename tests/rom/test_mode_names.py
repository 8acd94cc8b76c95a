"""Names of mode shapes: of beams whose modes are known, and of the default blade's first modes."""

import numpy as np
import pytest

from rom.cyclic.mode_families import mode_names


def airfoil(twist: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices of a thin rectangular blade turned by `twist` rad from root to tip, and its chord and normal there."""
    x, y, z = np.meshgrid(np.linspace(-0.02, 0.02, 7), np.linspace(-0.003, 0.003, 3), np.linspace(0.3, 0.45, 31))
    angle = twist * (z.ravel() - 0.3) / 0.15
    cosine, sine = np.cos(angle), np.sin(angle)
    points = np.column_stack(
        [x.ravel() * cosine - y.ravel() * sine, x.ravel() * sine + y.ravel() * cosine, z.ravel()]
    )
    zero = np.zeros_like(cosine)
    return points, np.column_stack([cosine, sine, zero]), np.column_stack([-sine, cosine, zero])


@pytest.mark.parametrize("twist", [0.0, 0.6])
def test_flap_edge_torsion_and_radial_motions_are_counted(twist: float) -> None:
    points, chord, normal = airfoil(twist)
    s = ((points[:, 2] - 0.3) / 0.15)[:, None]
    first, second = s**2, s**2 - 1.4 * s**3 + 0.1 * s
    torsion = np.column_stack([-points[:, 1], points[:, 0], 0.0 * points[:, 0]]) * 60.0
    radial = np.array([0.0, 0.0, 1.0]) * s
    shapes = [first * normal, 0.2 * first * normal + first * chord, second * normal, np.sin(s) * torsion]
    shapes += [np.sin(3.0 * s) * torsion + 0.1 * first * normal, radial, second * chord]
    phases = np.exp(1j * np.arange(len(shapes)))[:, None, None]  # a travelling wave has any phase
    assert mode_names(points, np.array(shapes) * phases) == ["1F", "1E", "2F", "1T", "2T", "1R", "2E"]
    assert mode_names(points, np.array(shapes)) == mode_names(points, np.array(shapes) * phases)

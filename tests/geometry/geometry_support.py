"""Blades, and measures of a mesh written without looking at how the package takes them."""

from functools import lru_cache

import numpy as np

from geometry import BladeParameters, MeshParameters, SectorMesh, ShroudParameters, build_sector

# the blade of the three figures, and a slender twisted one
FIGURE = BladeParameters(n_blades=120, hub_radius=0.540, length=0.060, chord=0.050, thickness=0.016)
SLENDER = BladeParameters(n_blades=72, hub_radius=0.30, length=0.15, chord=0.034, thickness=0.004, twist=25.0)


def figure_shroud(angle, **changes):
    return ShroudParameters(
        **{"thickness": 0.006, "axial_width": 0.056, "contact_length": 0.012, "angle": angle} | changes
    )


def slender_shroud(angle, **changes):
    return ShroudParameters(
        **{"thickness": 0.005, "axial_width": 0.040, "contact_length": 0.012, "angle": angle} | changes
    )


@lru_cache(maxsize=64)
def sector(blade, shroud, size=0.004, grid=(3, 3)) -> SectorMesh:
    return build_sector(blade, shroud, MeshParameters(size, grid))


def polar(points):
    """x, angle from z towards y (rad), radius."""
    return points[:, 0], np.arctan2(points[:, 1], points[:, 2]), np.hypot(points[:, 1], points[:, 2])


def next_blade(vectors, angle):
    """Vectors (..., 3) turned from z towards y: where the neighbour on the +y side stands."""
    turn = np.array([[1, 0, 0], [0, np.cos(angle), np.sin(angle)], [0, -np.sin(angle), np.cos(angle)]])
    return vectors @ turn.T


def mid_radius(blade, shroud):
    return blade.hub_radius + blade.length - shroud.thickness / 2


# trilinear hexahedron on [-1, 1]^3, corners as VTK numbers them
CORNERS = np.array(
    [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]
)


def jacobians(mesh, abscissae):
    """Determinants of the trilinear map at the tensor product of ``abscissae``, (E, len**3)."""
    values = []
    for point in np.stack(np.meshgrid(*[abscissae] * 3, indexing="ij"), -1).reshape(-1, 3):
        factor = 1 + CORNERS * point
        gradient = np.stack([CORNERS[:, i] * factor[:, i - 1] * factor[:, i - 2] / 8 for i in range(3)], axis=-1)
        values.append(np.linalg.det(np.einsum("eki,kj->eij", mesh.points[mesh.hexahedra], gradient)))
    return np.stack(values, axis=-1)


def volume(mesh):
    """Exact volume of the trilinear hexahedra (its integrand is quadratic at most in each direction)."""
    abscissae, weights = np.polynomial.legendre.leggauss(2)
    return float((jacobians(mesh, abscissae) * np.einsum("i,j,k->ijk", *[weights] * 3).ravel()).sum())


FACES = np.array([(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)])


def boundary_quads(mesh):
    """Faces (k, 4) that belong to one hexahedron alone, outward; asserts that none belongs to more than two."""
    quads = mesh.hexahedra[:, FACES].reshape(-1, 4)
    _, inverse, counts = np.unique(np.sort(quads, axis=1), axis=0, return_inverse=True, return_counts=True)
    assert counts.max() <= 2
    return quads[counts[inverse.ravel()] == 1]


def face_quads(mesh, nodes):
    """Boundary quads all of whose corners are among ``nodes``."""
    quads = boundary_quads(mesh)
    return quads[np.isin(quads, nodes).all(axis=1)]


def quad_vectors(mesh, quads):
    """Vector areas (k, 3) of quads."""
    p = mesh.points[quads]
    return np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]) / 2

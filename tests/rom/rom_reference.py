"""Slow, plain reference computations, written without the code under test."""

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.sparse import csr_matrix, diags
from scipy.sparse.linalg import eigsh
from scipy.spatial import cKDTree


def lowest_hz(stiffness, mass, count, fixed=(), shift=0.0):
    """Lowest natural frequencies in Hz of sparse matrices, real or complex, some dofs fixed (plain SciPy)."""
    free = np.setdiff1d(np.arange(stiffness.shape[0]), fixed)
    k, m = stiffness[free][:, free].tocsc(), mass[free][:, free].tocsc()
    squared = eigsh(k, k=count, M=m, sigma=shift, which="LM", return_eigenvectors=False)
    return np.sort(np.sqrt(np.abs(squared))) / (2 * np.pi)


def spring_stiffness(full, sector, phase, normal, tangential):
    """Contact springs of the full model under cyclic symmetry, (N, N) complex Hermitian, spring by spring."""
    size = full.stiffness.shape[0]
    total = csr_matrix((size, size), dtype=complex)
    for right, left, right_frame, left_frame in zip(
        sector.right.nodes, sector.left.nodes, sector.right.frame, sector.left.frame, strict=True
    ):
        for row, value in ((0, tangential), (1, tangential), (2, normal)):
            motion = np.concatenate([right_frame[row], -np.exp(1j * phase) * left_frame[row]])
            dofs = [3 * full.vertex_node[node] + axis for node in (right, left) for axis in range(3)]
            column = csr_matrix((motion.conj(), (dofs, [0] * 6)), shape=(size, 1))
            total = total + value * (column @ column.conj().T)
    return total


def spread_springs(full, sector, phase, normal, tangential):
    """Springs of a whole face spread over it, int d^H diag(kt, kt, kn) d dA / A, (N, N) complex Hermitian, for hex20.

    Quadrature over the element sides of the right face; those of the left face are the same ones turned back by a
    pitch. The frame is that of the cylinder about x at each point.
    """
    pitch = 2 * np.pi / sector.n_blades
    back = np.array([[1, 0, 0], [0, np.cos(pitch), np.sin(pitch)], [0, -np.sin(pitch), np.cos(pitch)]])
    nearest, tangent = cKDTree(full.positions), sector.right.frame[0, 0]
    axial = tangent[0]
    line, weight = np.polynomial.legendre.leggauss(4)
    motion, areas = [], []
    for quad in _sides_on(sector, "right"):
        corners = sector.points[quad]
        local = np.vstack([corners, (corners + np.roll(corners, -1, axis=0)) / 2])
        distance, pair = nearest.query([local, local @ back])
        assert distance.max() < 1e-9
        for i, xi in enumerate(line):
            for j, eta in enumerate(line):
                slope = np.array([[eta - 1, 1 - eta, 1 + eta, -1 - eta], [xi - 1, -1 - xi, 1 + xi, 1 - xi]]) / 4
                areas.append(weight[i] * weight[j] * np.linalg.norm(np.cross(*(slope @ corners))))
                shape = _serendipity(xi, eta)
                angle = np.arctan2(*(shape @ local)[1:])
                around = np.array([0.0, np.cos(angle), -np.sin(angle)])
                side = np.sign(tangent @ around) * np.sqrt(1.0 - axial**2)
                frame = np.array(
                    [[axial, 0, 0] + side * around, [0, np.sin(angle), np.cos(angle)], [-side, 0, 0] + axial * around]
                )
                for nodes, turned, factor in ((pair[0], frame, 1.0), (pair[1], frame @ back, -np.exp(1j * phase))):
                    row = 3 * (len(areas) - 1) + np.arange(3)
                    place = np.meshgrid(row, (3 * nodes[:, None] + np.arange(3)).ravel(), indexing="ij")
                    motion.append([part.ravel() for part in (*place, factor * np.kron(shape, turned))])
    rows, columns, values = (np.concatenate([part[k] for part in motion]) for k in range(3))
    jump = csr_matrix(
        (values, (rows.real.astype(int), columns.real.astype(int))), shape=(3 * len(areas), full.n_dofs)
    )
    springs = np.outer(np.array(areas) / np.sum(areas), [tangential, tangential, normal]).ravel()
    return jump.conj().T @ diags(springs) @ jump


def _sides_on(sector, side):
    """Corners (q, 4) of the element sides on a face, in order round each of them."""
    on = np.zeros(len(sector.points), dtype=bool)
    on[sector.node_sets[f"face_{side}"]] = True
    sides = np.array([[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
    quads = sector.hexahedra[:, sides].reshape(-1, 4)
    return quads[on[quads].all(axis=1)]


def _serendipity(xi, eta):
    """The eight shape functions of a quadratic side at a point of [-1, 1]^2: four corners, four mid-sides."""
    around = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    corners = [(1 + a * xi) * (1 + b * eta) * (a * xi + b * eta - 1) / 4 for a, b in around]
    middles = [(1 - xi**2) * (1 - eta), (1 + xi) * (1 - eta**2), (1 - xi**2) * (1 + eta), (1 - xi) * (1 - eta**2)]
    return np.array([*corners, *(m / 2 for m in middles)])


def timoshenko_cantilever_hz(length, width, height, material, count=3):
    """Bending frequencies in Hz of a clamped-free Timoshenko beam (shear factor 5/6), by transfer matrix."""
    young, density = material.young_modulus, material.density
    shear = young / (2 * (1 + material.poisson_ratio))
    area, inertia = width * height, width * height**3 / 12

    def free_end(omega):
        # States deflection, rotation, moment, shear force; scaled to one order of magnitude.
        system = np.array(
            [
                [0, 1, 0, 1 / (5 / 6 * shear * area)],
                [0, 0, 1 / (young * inertia), 0],
                [0, -density * inertia * omega**2, 0, -1],
                [-density * area * omega**2, 0, 0, 0],
            ]
        )
        scale = np.array([length, 1, young * inertia / length, young * inertia / length**2])
        return np.linalg.det(expm(length * system * scale / scale[:, None])[2:, 2:])

    slender = np.sqrt(young * inertia / (density * area)) / length**2
    roots = [root**2 * slender for root in (1.8751041, 4.6940911, 7.8547574)[:count]]
    return np.array([brentq(free_end, 0.85 * omega, 1.001 * omega) for omega in roots]) / (2 * np.pi)


def rotating_beam_ratio(speed, hub, count=1, terms=14):
    """Flap frequencies of a rotating cantilever over sqrt(EI / (m L^4)), by Ritz with polynomials.

    speed = W L^2 sqrt(m / EI), hub = hub radius / L. Strain energy of bending and of the tension
    T = m W^2 ((R + L)^2 - (R + x)^2) / 2 in the slope.
    """
    point, weight = np.polynomial.legendre.leggauss(60)
    x, weight = (point + 1) / 2, weight / 2
    shapes = [
        np.polynomial.Polynomial([0, 0, 1])
        * np.polynomial.Chebyshev.basis(k, domain=[0, 1]).convert(kind=np.polynomial.Polynomial)
        for k in range(terms)
    ]
    value, slope, curve = (np.array([s.deriv(n)(x) if n else s(x) for s in shapes]) for n in range(3))
    tension = speed**2 * ((hub + 1) ** 2 - (hub + x) ** 2) / 2
    stiffness = (curve * weight) @ curve.T + (slope * weight * tension) @ slope.T
    mass = (value * weight) @ value.T
    from scipy.linalg import eigh

    return np.sqrt(eigh(stiffness, mass, eigvals_only=True)[:count])

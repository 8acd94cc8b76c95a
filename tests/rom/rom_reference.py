"""Slow, plain reference computations, written without the code under test."""

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import eigsh


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

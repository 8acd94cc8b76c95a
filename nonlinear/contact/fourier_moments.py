"""Products of the Fourier basis functions phi_i, summed or integrated over an interval of the period (compiled).

The basis is phi = 1, cos, -sin, cos 2, -sin 2, ... of theta. An interval enters by its trigonometric moments
C_m = sum cos(m theta), S_m = sum sin(m theta), m = 0 .. 2H: sums over samples or integrals over angles alike. All
that is linear in the displacement on the interval follows from them.
"""

import math

import numpy as np

from nonlinear.contact.numba_cache import inner
from nonlinear.contact.parameters import Array
from nonlinear.contact.trigonometric_roots import cosine_sine


@inner
def integrate_basis(
    angle: float, length: float, factor: float, here: Array, there: Array, moments: Array, total: Array
) -> None:
    """Integrals of phi_i / (2 pi) over an interval of `length` that ends at `angle`.

    All arrays (4H+1,). Given: `here`, phi at its beginning. Written: `there`, phi at its end, and `moments`, the
    integrals; these times `factor` are added to `total`.
    """
    c, s = cosine_sine(angle)
    ch, sh = 1.0, 0.0
    moments[0], there[0] = length / (2.0 * math.pi), 1.0
    total[0] += factor * moments[0]
    h, k, end = 1.0, 1, 0.5 * here.shape[0]
    while h < end:
        ch, sh = ch * c - sh * s, sh * c + ch * s
        rate = 1.0 / (2.0 * math.pi * h)
        even, odd = (here[k + 1] + sh) * rate, (ch - here[k]) * rate
        there[k], there[k + 1], moments[k], moments[k + 1] = ch, -sh, even, odd
        total[k] += factor * even
        total[k + 1] += factor * odd
        h += 1.0
        k += 2


@inner
def subtract_products(matrix: Array, moments: Array) -> None:
    """Subtract integrals of phi_i phi_j from `matrix` (2H+1, 2H+1), twice in rows i > 0: coefficients of a reaction.

    `moments` (4H+1,): integrals of phi. With g <= h, cos h cos g = (C- + C+) / 2, sin h sin g = (C- - C+) / 2,
    -cos h sin g = (S+ - S-) / 2, -sin h cos g = (S+ + S-) / 2, C and S standing for cos and -sin of h +- g.
    """
    for j in range(matrix.shape[0]):
        matrix[0, j] -= moments[j]
    for h in range(1, matrix.shape[0], 2):  # row of cos h, before that of -sin h
        matrix[h, 0] -= 2.0 * moments[h]
        matrix[h + 1, 0] -= 2.0 * moments[h + 1]
        for g in range(1, h, 2):
            c_plus, s_plus, c_minus, s_minus = (
                moments[h + g + 1],
                moments[h + g + 2],
                moments[h - g - 1],
                moments[h - g],
            )
            matrix[h, g] -= c_minus + c_plus
            matrix[g, h] -= c_minus + c_plus
            matrix[h + 1, g + 1] -= c_minus - c_plus
            matrix[g + 1, h + 1] -= c_minus - c_plus
            matrix[h, g + 1] -= s_plus - s_minus
            matrix[g + 1, h] -= s_plus - s_minus
            matrix[h + 1, g] -= s_plus + s_minus
            matrix[g, h + 1] -= s_plus + s_minus
        c_plus, s_plus = moments[2 * h + 1], moments[2 * h + 2]
        matrix[h, h] -= moments[0] + c_plus
        matrix[h + 1, h + 1] -= moments[0] - c_plus
        matrix[h, h + 1] -= s_plus
        matrix[h + 1, h] -= s_plus


@inner
def add_gram(gram: Array, cosine: Array, sine: Array, factor: float) -> None:
    """Add factor * sum phi_i phi_j to `gram` (2H+1, 2H+1) for phi = 1, cos, -sin, cos 2, -sin 2, ..."""
    n_harmonics = (gram.shape[0] - 1) // 2
    gram[0, 0] += factor * cosine[0]
    for h in range(1, n_harmonics + 1):
        gram[0, 2 * h - 1] += factor * cosine[h]
        gram[2 * h - 1, 0] += factor * cosine[h]
        gram[0, 2 * h] -= factor * sine[h]
        gram[2 * h, 0] -= factor * sine[h]
        for g in range(1, n_harmonics + 1):
            plus = h + g
            minus = abs(h - g)
            sine_minus = sine[minus] if h >= g else -sine[minus]  # sum of sin((h - g) theta)
            gram[2 * h - 1, 2 * g - 1] += 0.5 * factor * (cosine[minus] + cosine[plus])
            gram[2 * h, 2 * g] += 0.5 * factor * (cosine[minus] - cosine[plus])
            gram[2 * h - 1, 2 * g] -= 0.5 * factor * (sine[plus] - sine_minus)
            gram[2 * h, 2 * g - 1] -= 0.5 * factor * (sine[plus] + sine_minus)


@inner
def mean_basis(vector: Array, cosine: Array, sine: Array) -> None:
    """Write sum phi_i into `vector` (2H+1,)."""
    vector[0] = cosine[0]
    for h in range(1, (vector.shape[0] - 1) // 2 + 1):
        vector[2 * h - 1] = cosine[h]
        vector[2 * h] = -sine[h]


@inner
def add_scaled(total: Array, factor: float, vector: Array) -> None:
    """Add factor * vector to `total`; a loop, since array expressions take long to compile."""
    for i in range(total.shape[0]):
        total[i] += factor * vector[i]


@inner
def finish_node(
    node: int, direction: int, law: tuple[Array, Array, Array], displacement: Array, force: Array, jacobian: Array
) -> None:
    """Turn the accumulated linear law of one force component into its coefficients and Jacobian.

    `law` = (own, normal, constant): sums over the period of phi_i times the component of the reaction as a linear
    function of the displacement along `direction` and along n, (2H+1, 2H+1) each, and of its constant part, (2H+1,),
    already divided by the length of the period. The reaction acts on the right node with a minus sign.
    """
    own, normal, constant = law
    size = own.shape[0]
    for i in range(size):
        weight = -1.0 if i == 0 else -2.0
        value = constant[i]
        for j in range(size):
            value += own[i, j] * displacement[j, node, direction]
            jacobian[node, direction, direction, i, j] = weight * own[i, j]
            if direction != 2:
                value += normal[i, j] * displacement[j, node, 2]
                jacobian[node, direction, 2, i, j] = weight * normal[i, j]
        force[i, node, direction] = weight * value


def prefix_moments(n_harmonics: int, n_samples: int) -> Array:
    """Running means over samples of cos(m theta_k) and sin(m theta_k), m = 0 .. 2H: (n+1, 2, 2H+1)."""
    angles = np.outer(2.0 * np.pi * np.arange(n_samples) / n_samples, np.arange(2 * n_harmonics + 1))
    prefix = np.zeros((n_samples + 1, 2, 2 * n_harmonics + 1))
    prefix[1:] = np.cumsum(np.stack([np.cos(angles), np.sin(angles)], axis=1), axis=0) / n_samples
    return prefix


@inner
def write_moments(prefix: Array, start: int, stop: int, moments: Array) -> None:
    """Write the moments of the samples start .. stop - 1 over their number in the cycle, (2, 2H+1), from `prefix`."""
    for part in range(2):
        for m in range(moments.shape[1]):
            moments[part, m] = prefix[stop, part, m] - prefix[start, part, m]

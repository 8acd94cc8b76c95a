"""Outputs besides the one whose peaks are located: components by name, and the largest length over a period."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.options import OptionsError

SAMPLES_PER_HARMONIC = 64
NEWTON_STEPS = 6


def output_components(outputs: Iterable[str], name: str) -> tuple[str, ...]:
    """The outputs of a model that make an output: one, or NAME_x, NAME_y, NAME_z of a vector.

    Parameters
    ----------
    outputs : iterable of str
        Names of the outputs of the model.
    name : str
        Name of the output, or of the vector.

    Raises
    ------
    OptionsError
        The model has neither.

    Examples
    --------
    >>> from nonlinear import output_components
    >>> output_components(("tip", "tip_x", "tip_y", "tip_z"), "tip")
    ('tip',)
    """
    outputs = tuple(outputs)
    if name in outputs:
        return (name,)
    parts = tuple(f"{name}_{axis}" for axis in "xyz")
    if all(part in outputs for part in parts):
        return parts
    raise OptionsError(f"outputs: {name!r}, allowed: {', '.join(outputs)}, or the name in front of _x, _y and _z")


def largest_lengths(harmonics: ComplexArray) -> Array:
    """Largest length over a period of a vector x(theta) = x_0 + Re sum_h x_h exp(i h theta), at each of P points.

    The largest of 64 H samples, improved by Newton's method on the derivative of its square.

    Parameters
    ----------
    harmonics : (P, H+1, c) complex array
        Fourier coefficients of its c components.

    Returns
    -------
    (P,) array
        Lengths; of one component the largest abs(x).

    Examples
    --------
    A point on a circle of radius 2:

    >>> from nonlinear import largest_lengths
    >>> print(largest_lengths(np.array([[[0.0, 0.0], [2.0, 2.0j]]])).round(9))
    [2.]
    """
    if harmonics.shape[0] == 0:
        return np.zeros(0)
    order = np.arange(harmonics.shape[1])
    samples = SAMPLES_PER_HARMONIC * max(len(order) - 1, 1)
    theta = np.linspace(0.0, 2.0 * np.pi, samples, endpoint=False)
    found = [_largest(each, order, theta) for each in harmonics]
    return np.array(found)


def _largest(harmonics: ComplexArray, order: NDArray[np.int64], theta: Array) -> float:
    squares = ((np.exp(1j * np.outer(theta, order)) @ harmonics).real ** 2).sum(axis=1)
    angle, largest = theta[squares.argmax()], float(squares.max())
    for _ in range(NEWTON_STEPS):
        turn = np.exp(1j * order * angle)
        x, dx, ddx = (((1j * order) ** power * turn @ harmonics).real for power in range(3))
        curvature = dx @ dx + x @ ddx
        if curvature >= 0.0:
            break
        angle -= (x @ dx) / curvature
        x = (np.exp(1j * order * angle) @ harmonics).real
        largest = max(largest, float(x @ x))
    return float(np.sqrt(largest))

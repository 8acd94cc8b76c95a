"""Amplification factor of a mistuned ring: the largest amplitude of any blade over the tuned peak."""

from __future__ import annotations

import math


def whitehead_bound(n_blades: int) -> float:
    """Bound of the amplification factor of a linear ring, (1 + sqrt(N_b)) / 2.

    It holds for one family of modes with the same damping in all blades (Whitehead 1966): at most, the vibration
    energy of all nodal diameters meets in one blade. Friction contacts and several families may exceed it.

    Parameters
    ----------
    n_blades : int
        Number of blades N_b.

    Returns
    -------
    float
        The bound.

    References
    ----------
    D. S. Whitehead, "Effect of mistuning on the vibration of turbo-machine blades induced by wakes", Journal of
    Mechanical Engineering Science 8(1), 1966, pp. 15-21.

    Examples
    --------
    >>> from nonlinear import whitehead_bound
    >>> whitehead_bound(9)
    2.0
    """
    return 0.5 * (1.0 + math.sqrt(n_blades))

"""The stick intervals of all sliders of a cycle, compiled."""

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.numba_cache import compiled
from nonlinear.contact.parameters import STICK, Array
from nonlinear.contact.return_map import Integers, jenkins_return_map


@compiled
def stick_intervals(
    motion: Array,
    limit: Array,
    stiffness: Array,
    slides: NDArray[np.bool_],
    found: tuple[Integers, Integers, Integers],
) -> None:
    """Write the steady cycles of two sliders a node, and the stick intervals in which an earlier sample has set them.

    Given: `motion` (n_c, 3, n), slip limits (n_c, n) and kt (n_c,); `slides` (n_c,): nodes that are looked at.
    Found, (n_c, 2, n) each: state and sign of the slip as of `jenkins_return_map`, and for each sample the number of
    samples of stick whose slider it has set; the last must be zero before.
    """
    state, sign, count = found
    samples = motion.shape[2]
    source = np.empty(samples, np.int64)
    for node in range(motion.shape[0]):
        if not slides[node]:
            continue
        for a in range(2):
            jenkins_return_map(motion[node, a], limit[node], stiffness[node], state[node, a], source, sign[node, a])
            for k in range(samples):
                if state[node, a, k] == STICK and source[k] >= 0:
                    count[node, a, source[k]] += 1

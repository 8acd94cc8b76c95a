"""March of an elastic Coulomb slider over the samples of a cycle (compiled).

With the limit mu N (0 where the contact is open) the slider position obeys one rule at every sample,
w_k = clamp(w_{k-1}, u_k - mu N_k / kt, u_k + mu N_k / kt), and T_k = kt (u_k - w_k): stick, slip and lift-off in one.
Clamps compose to a clamp, so a march from w = 0 reaches its steady cycle after one period whatever the motion, and
in full stick ends with the static force projected on its admissible range (paper eqs. 10 to 16).
"""

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.numba_cache import lean
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array

Integers = NDArray[np.int64]
NEVER = -1
ROUND_OFF = 1e-13  # excess over the limit, relative, that does not count as slip


@lean
def march(motion: Array, limit: Array, stiffness: float, state: Integers, source: Integers, sign: Integers) -> None:
    """Record the steady cycle of a 1D slider of `stiffness` kt > 0.

    motion u and limit mu N: (n,). Written, each (n,): `state` of each sample, `source`, the sample that last moved
    the slider (NEVER: it still stands at w = 0), and `sign`, +1 or -1: w = u[source] - sign limit[source] / kt.
    """
    n_samples = motion.shape[0]
    position = 0.0
    last, direction = NEVER, 0
    for turn in range(2):
        for k in range(n_samples):
            reach = limit[k] / stiffness
            slack = ROUND_OFF * (abs(motion[k]) + reach)
            moved = True
            if limit[k] <= 0.0:
                position, last, direction = motion[k], k, 0
            elif motion[k] - position > reach + slack:
                position, last, direction = motion[k] - reach, k, 1
            elif motion[k] - position < -reach - slack:
                position, last, direction = motion[k] + reach, k, -1
            else:
                moved = False
            if turn == 1:
                state[k] = (LIFT_OFF if direction == 0 else SLIP) if moved else STICK
                source[k], sign[k] = last, direction


@lean
def march_plane(
    motion: Array, limit: Array, stiffness: float, max_turns: int, tolerance: float, state: Integers, force: Array
) -> int:
    """March a slider in the plane with the friction cone |T| <= mu N until its cycle repeats.

    motion (n, 2), limit (n,); written: `state` (n,) and `force` T (n, 2) of the last turn. The slider follows the
    radial return of each sample. Returns the number of turns marched; the cycle counts as repeated when the slider
    comes back to its place within `tolerance` (metres), and never after more than `max_turns`.
    """
    n_samples = motion.shape[0]
    x, y = 0.0, 0.0
    for turn in range(max_turns):
        x_start, y_start = x, y
        for k in range(n_samples):
            tx = stiffness * (motion[k, 0] - x)
            ty = stiffness * (motion[k, 1] - y)
            magnitude = np.sqrt(tx * tx + ty * ty)
            if limit[k] <= 0.0:
                state[k], tx, ty = LIFT_OFF, 0.0, 0.0
            elif magnitude > limit[k] * (1.0 + ROUND_OFF):
                state[k] = SLIP
                tx *= limit[k] / magnitude
                ty *= limit[k] / magnitude
            else:
                state[k] = STICK
            if state[k] != STICK:
                x = motion[k, 0] - tx / stiffness
                y = motion[k, 1] - ty / stiffness
            force[k, 0], force[k, 1] = tx, ty
        if turn > 0 and abs(x - x_start) <= tolerance and abs(y - y_start) <= tolerance:
            return turn + 1
    return max_turns

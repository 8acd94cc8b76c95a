"""Return mapping of an elastic Coulomb slider over the samples of a period (compiled).

One slider is a Jenkins element: a spring kt in series with a friction link of slip limit mu N (0 where the contact is
open). Its position w obeys one rule at every sample,

    w_k = clamp(w_{k-1}, u_k - mu N_k / kt, u_k + mu N_k / kt),     T_k = kt (u_k - w_k),

which holds stick, slip and lift-off in one (Gulisano et al. 2011, eq. 9). A composition of clamps is a clamp, so
marching from w = 0 reaches the steady cycle after one period whatever the motion. In full stick the static force is
then kt u^(0) projected on its admissible range (eqs. 10 to 16).

References
----------
J. H. Griffin, Friction damping of resonant stresses in gas turbine engine airfoils, Journal of Engineering for Power
102 (1980) 329-333.

B. D. Yang, M. L. Chu, C. H. Menq, Stick-slip-separation analysis and non-linear stiffness and damping
characterization of friction contacts having variable normal load, Journal of Sound and Vibration 210 (1998) 461-481.
"""

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.numba_cache import lean
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array

Integers = NDArray[np.int64]
NEVER = -1
ROUND_OFF = 1e-13  # excess over the slip limit, relative, that does not count as slip
MAX_PERIODS = 200  # periods after which a cone slider that creeps to its shakedown state is left where it is
REPEAT_TOLERANCE = 1e-13  # of the largest motion: a cone slider that returns this near has reached its steady cycle


@lean
def jenkins_return_map(
    motion: Array, limit: Array, kt: float, state: Integers, source: Integers, sign: Integers
) -> None:
    """Write the steady cycle of a Jenkins element with kt > 0.

    Given, each (n,): `motion` u and slip limit mu N. Written, each (n,): `state` of each sample; `source`, the sample
    that last moved the slider (NEVER: it still stands at w = 0); `sign` of the slip, 0 in lift-off:
    w = u[source] - sign limit[source] / kt.
    """
    n_samples = motion.shape[0]
    position = 0.0
    last, direction = NEVER, 0
    for period in range(2):
        for k in range(n_samples):
            elastic_limit = limit[k] / kt
            tolerance = ROUND_OFF * (abs(motion[k]) + elastic_limit)
            moved = True
            if limit[k] <= 0.0:
                position, last, direction = motion[k], k, 0
            elif motion[k] - position > elastic_limit + tolerance:
                position, last, direction = motion[k] - elastic_limit, k, 1
            elif motion[k] - position < -elastic_limit - tolerance:
                position, last, direction = motion[k] + elastic_limit, k, -1
            else:
                moved = False
            if period == 1:
                state[k] = (LIFT_OFF if direction == 0 else SLIP) if moved else STICK
                source[k], sign[k] = last, direction


@lean
def cone_return_map(
    motion: Array, limit: Array, kt: float, max_periods: int, tolerance: float, state: Integers, force: Array
) -> int:
    """Radial return of a slider in the plane with the friction cone |T| <= mu N, until its cycle repeats.

    Given: `motion` (n, 2) and slip limit mu N, (n,). Written: `state` (n,) and `force` T (n, 2) of the last period.
    Returns the number of periods: the cycle repeats where the slider comes back to its place within `tolerance`
    (metres); `max_periods` at most.
    """
    n_samples = motion.shape[0]
    x, y = 0.0, 0.0
    for period in range(max_periods):
        x_start, y_start = x, y
        for k in range(n_samples):
            tx = kt * (motion[k, 0] - x)
            ty = kt * (motion[k, 1] - y)
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
                x = motion[k, 0] - tx / kt
                y = motion[k, 1] - ty / kt
            force[k, 0], force[k, 1] = tx, ty
        if period > 0 and abs(x - x_start) <= tolerance and abs(y - y_start) <= tolerance:
            return period + 1
    return max_periods

"""The exact monodromy matrix of a small ring of masses with unilateral springs between them, from event to event.

    x_j'' + c x_j' + (1 + delta_j)^2 x_j = F cos(w t + j psi) - N_j + N_(j-1)
    N_j = max(kn (v0 + x_j - x_(j+1)), 0)

Between events the motion is linear: matrix exponentials. The contact force is continuous where a contact opens or
closes, so nothing but these has to be multiplied. An independent check of stability.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq


@dataclass(frozen=True)
class ImpactingRing:
    """A ring of N blades."""

    frequency_ratio: np.ndarray  # (N,), 1 + delta_j
    damping: float
    stiffness: float  # kn
    interference: float  # v0
    force: float
    omega: float
    engine_order: int = 1
    steps: int = 400  # a period, in which events are looked for

    @property
    def blades(self):
        """Number of blades."""
        return self.frequency_ratio.size

    @property
    def period(self):
        """Of the excitation."""
        return 2.0 * np.pi / self.omega

    @cached_property
    def pairs(self):
        """v - v0 = pairs @ x."""
        return np.eye(self.blades) - np.roll(np.eye(self.blades), 1, axis=1)

    @cached_property
    def generators(self):
        """Of the states (x, x', 1, cos w t, sin w t) by closed pairs."""
        return {}

    def generator(self, closed):
        """The linear system with some pairs closed."""
        if closed not in self.generators:
            n, pairs = self.blades, self.pairs
            springs = self.stiffness * np.array(closed, dtype=float)
            matrix = np.zeros((2 * n + 3, 2 * n + 3))
            matrix[:n, n : 2 * n] = np.eye(n)
            matrix[n : 2 * n, :n] = -np.diag(self.frequency_ratio**2) - pairs.T @ (springs[:, None] * pairs)
            matrix[n : 2 * n, n : 2 * n] = -self.damping * np.eye(n)
            matrix[n : 2 * n, 2 * n] = -pairs.T @ springs * self.interference
            angle = 2.0 * np.pi * self.engine_order * np.arange(n) / n
            matrix[n : 2 * n, 2 * n + 1], matrix[n : 2 * n, 2 * n + 2] = (
                self.force * np.cos(angle),
                -self.force * np.sin(angle),
            )
            matrix[2 * n + 1, 2 * n + 2], matrix[2 * n + 2, 2 * n + 1] = -self.omega, self.omega
            step = self.period / self.steps
            self.generators[closed] = matrix, expm(matrix * step)
        return self.generators[closed]

    def over_period(self, state):
        """State (2 N,) after a period, and the derivative, the monodromy matrix."""
        n, step = self.blades, self.period / self.steps
        now, matrix = np.concatenate([state, [1.0, 1.0, 0.0]]), np.eye(2 * n + 3)
        for _ in range(self.steps):
            left = step
            while left > 0.0:
                closed = self.closed(now)
                generator, whole = self.generator(closed)
                after = whole if left == step else expm(generator * left)
                taken = self.first_event(now, generator, after, left, closed)
                after = after if taken == left else expm(generator * taken)
                now, matrix, left = after @ now, after @ matrix, left - taken
        return now[: 2 * n], matrix[: 2 * n, : 2 * n]

    def closed(self, now):
        """Whether the pairs are closed; of those that just touch their velocity tells."""
        n = self.blades
        value, rate = self.interference + self.pairs @ now[:n], self.pairs @ now[n : 2 * n]
        return tuple((np.where(np.abs(value) > 1e-11, value, rate) > 0.0).tolist())

    def first_event(self, now, generator, after, left, closed):
        """Time to the first change of a pair within `left`."""
        n = self.blades
        sign = np.where(closed, 1.0, -1.0)
        end = sign * (self.interference + self.pairs @ (after @ now)[:n])
        times = [left]
        for pair in np.flatnonzero(end < -1e-11):

            def value(time, pair=pair):
                return float(sign[pair] * (self.interference + self.pairs[pair] @ (expm(generator * time) @ now)[:n]))

            low = 1e-9 * left
            if value(low) > 0.0:
                times.append(brentq(value, low, left, xtol=1e-15))
        return min(times)

    def periodic(self, state):
        """The periodic motion near a state (x, x'), which Newton's method finds, and its Floquet exponents."""
        for _ in range(20):
            after, matrix = self.over_period(state)
            change = np.linalg.solve(np.eye(len(matrix)) - matrix, after - state)
            state = state + change
            if np.abs(change).max() < 1e-12:
                return state, np.log(np.linalg.eigvals(self.over_period(state)[1]).astype(complex)) / self.period
        raise ArithmeticError("no periodic motion")

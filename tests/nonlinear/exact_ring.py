"""Small rings of masses with unilateral springs or sliders between them, solved exactly from event to event.

    x_j'' + c x_j' + (1 + delta_j)^2 x_j = F cos(w t + j psi) - N_j + N_(j-1)

with u_j = x_j - x_(j+1), or x_0 to the ground of a single mass, and N_j = max(k_c (v0 + u_j), 0), or of a slider
k_c times the change of u_j, as far as abs(N_j) stays below its limit. Between events the motion is linear: matrix
exponentials; where its right hand side jumps the derivative is multiplied by the saltation matrix.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

NOTHING = 1e-11  # of a margin to the next event


@dataclass(frozen=True)
class ExactRing:
    """A ring of N blades; one blade alone has its contact to the ground."""

    frequency_ratio: np.ndarray  # (N,), 1 + delta_j
    damping: float
    stiffness: float  # k_c
    interference: float  # v0
    force: float
    omega: float
    engine_order: int = 1
    steps: int = 400  # a period, in which events are looked for
    limit: float = 0.0  # of the friction force; 0: unilateral springs

    @property
    def blades(self):
        """Number of blades."""
        return self.frequency_ratio.size

    @property
    def period(self):
        """Of the excitation."""
        return 2.0 * np.pi / self.omega

    @property
    def size(self):
        """Of the state (x, x'), with the forces of the sliders."""
        return (3 if self.limit else 2) * self.blades

    @cached_property
    def pairs(self):
        """u = pairs @ x."""
        one = np.eye(self.blades)
        return one if self.blades == 1 else one - np.roll(one, 1, axis=1)

    @cached_property
    def generators(self):
        """Of the states (x, x', [N], 1, cos w t, sin w t) by the states of the contacts."""
        return {}

    def generator(self, mode):
        """The linear system of a mode, that of a step, and rows of margins that are positive as long as it lasts.

        Of unilateral springs 1 is closed and 0 open; of sliders 0 sticks, 1 and -1 slide.
        """
        if mode not in self.generators:
            n, size, pairs = self.blades, self.size, self.pairs
            matrix = np.zeros((size + 3, size + 3))
            matrix[:n, n : 2 * n] = np.eye(n)
            matrix[n : 2 * n, :n] = -np.diag(self.frequency_ratio**2)
            matrix[n : 2 * n, n : 2 * n] = -self.damping * np.eye(n)
            angle = 2.0 * np.pi * self.engine_order * np.arange(n) / n
            matrix[n : 2 * n, -2], matrix[n : 2 * n, -1] = self.force * np.cos(angle), -self.force * np.sin(angle)
            matrix[-1, -2], matrix[-2, -1] = self.omega, -self.omega
            margins = []
            for j, state in enumerate(mode):
                row = np.zeros(size + 3)
                if self.limit:
                    matrix[n : 2 * n, 2 * n + j] -= pairs[j]
                    if state == 0:
                        matrix[2 * n + j, n : 2 * n] = self.stiffness * pairs[j]
                        for sign in (1.0, -1.0):
                            row = np.zeros(size + 3)
                            row[2 * n + j], row[-3] = -sign, self.limit
                            margins.append((row, j, int(sign)))
                    else:
                        row[n : 2 * n] = state * pairs[j]
                        margins.append((row, j, 0))
                else:
                    row[:n], row[-3] = pairs[j], self.interference
                    margins.append((row if state else -row, j, 1 - state))
                    if state:
                        matrix[n : 2 * n] -= self.stiffness * np.outer(pairs[j], row)
            self.generators[mode] = matrix, expm(matrix * self.period / self.steps), margins
        return self.generators[mode]

    def mode(self, now):
        """States of the contacts; of those at an event their rate tells."""
        n = self.blades
        rate = self.pairs @ now[n : 2 * n]
        if self.limit:
            force = now[2 * n : 3 * n]
            slides = (np.abs(force) >= self.limit - NOTHING) & (force * rate > 0.0)
            return tuple(np.where(slides, np.sign(force), 0.0).astype(int).tolist())
        value = self.interference + self.pairs @ now[:n]
        return tuple((np.where(np.abs(value) > NOTHING, value, rate) > 0.0).astype(int).tolist())

    def over_period(self, state, history=None):
        """State after a period, and the derivative, the monodromy matrix; `history` takes the states at the steps."""
        step = self.period / self.steps
        now, derivative = np.concatenate([state, [1.0, 1.0, 0.0]]), np.eye(self.size + 3)
        mode = self.mode(now)
        for _ in range(self.steps):
            left = step
            while left > 0.0:
                generator, whole, margins = self.generator(mode)
                after = whole if left == step else expm(generator * left)
                taken, event = self.first_event(now, generator, after, left, margins)
                after = after if event is None else expm(generator * taken)
                now, derivative, left = after @ now, after @ derivative, left - taken
                if event is not None:
                    row, j, state = event
                    mode = (*mode[:j], state, *mode[j + 1 :])
                    jump = (self.generator(mode)[0] - generator) @ now
                    derivative = derivative + np.outer(jump, row @ derivative) / (row @ generator @ now)
            if history is not None:
                history.append(now[: self.size])
        return now[: self.size], derivative[: self.size, : self.size]

    @staticmethod
    def first_event(now, generator, after, left, margins):
        """Time to the first event within `left`, and that event (None: none)."""
        first = left, None
        end = after @ now
        for event in margins:
            row = event[0]
            if row @ end < -NOTHING:

                def value(time, row=row):
                    return float(row @ (expm(generator * time) @ now))

                low = 1e-9 * left
                if value(low) <= 0.0:
                    if row @ generator @ now < -1e-6:  # at once, as where two come together
                        return 0.0, event
                else:
                    first = min(first, (brentq(value, low, left, xtol=1e-15), event), key=lambda item: item[0])
        return first

    def periodic(self, state, periods=1):
        """The periodic motion near a state (x, x'), which Newton's method finds, and its Floquet exponents."""
        for _ in range(20):
            after, matrix = self.over_periods(state, periods)
            change = np.linalg.lstsq(np.eye(len(matrix)) - matrix, after - state, rcond=1e-12)[0]
            state = state + change
            if self.limit:
                state[2 * self.blades :] = np.clip(state[2 * self.blades :], -self.limit, self.limit)
            if np.abs(change).max() < 1e-9 * np.abs(state).max():
                multipliers = np.linalg.eigvals(self.over_periods(state, periods)[1]).astype(complex)
                return state, np.log(np.where(multipliers == 0.0, 1e-300, multipliers)) / (periods * self.period)
        raise ArithmeticError("no periodic motion")

    def over_periods(self, state, periods):
        """The same as `over_period` after some periods."""
        derivative = np.eye(self.size)
        for _ in range(periods):
            state, matrix = self.over_period(state)
            derivative = matrix @ derivative
        return state, derivative

    def height(self, state, periods=1):
        """Largest abs(x) of any blade over a period from a state."""
        history = [state]
        for _ in range(periods):
            self.over_period(history[-1], history)
        x = np.abs(np.array(history)[:, : self.blades])
        place, blade = np.unravel_index(np.argmax(x), x.shape)
        if not 0 < place < len(x) - 1:
            before, top, after = x[-2, blade], x[0, blade], x[1, blade]
        else:
            before, top, after = x[place - 1 : place + 2, blade]
        bend = before - 2.0 * top + after
        return float(top - (after - before) ** 2 / (8.0 * bend)) if bend < 0.0 else float(top)

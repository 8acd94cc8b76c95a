"""The friction cone integrated by SciPy: phi solves an initial value problem, events are found by its root finder."""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

GRID = 4001  # samples between which the ends of stick and of contact are sought


class PlaneSlider:
    """One node under real coefficients (2H+1, 3): kt, mu and the load N = load + kn d_n as numbers."""

    def __init__(self, rows, *, kn, kt, mu, load, rtol=1e-12):
        self.kt, self.rtol, self.order = kt, rtol, np.arange(1, (rows.shape[0] + 1) // 2)
        self.u = rows[:, :2].T
        self.r = mu / kt * kn * rows[:, 2]
        self.r[0] += mu / kt * load
        self.largest = np.abs(self.r[0]) + np.hypot(self.r[1::2], self.r[2::2]).sum()
        angles = np.linspace(0.0, 2.0 * np.pi, 20 * GRID)
        limit = self.at(self.r, angles)
        cut = np.flatnonzero((limit[1:] > 0.0) != (limit[:-1] > 0.0))
        self.roots = [brentq(lambda t: float(self.at(self.r, t)), *angles[k : k + 2], xtol=1e-15) for k in cut]
        self.pressed_first = bool(limit[0] > 0.0)

    def basis(self, angle, derivative=0):
        phase = np.multiply.outer(np.asarray(angle, float), self.order) + derivative * np.pi / 2.0
        both = np.stack([np.cos(phase), -np.sin(phase)], axis=-1) * (self.order**derivative)[:, None]
        both = both.reshape(*both.shape[:-2], -1)
        return np.concatenate([np.full((*both.shape[:-1], 1), float(derivative == 0)), both], axis=-1)

    def at(self, rows, angle, derivative=0):
        return self.basis(angle, derivative) @ rows.T

    def margin(self, angle, phi):
        return float(self.at(self.u, angle, 1) @ [np.cos(phi), np.sin(phi)] - self.at(self.r, angle, 1))

    def excess(self, angle, w):
        return float(np.hypot(*(self.at(self.u, angle) - w)) - self.at(self.r, angle))

    def stick(self, angle, end, w):
        """Angle at which |u - w| rises above r (None: it does not) and the integral of (u - w) phi_i."""
        grid = np.linspace(angle, end, GRID)
        over = np.hypot(*(self.at(self.u, grid) - w).T) - self.at(self.r, grid)
        over[0] = -1.0
        met = None
        if np.any(over > 0.0):
            k = int(np.argmax(over > 0.0))
            met = brentq(self.excess, *grid[k - 1 : k + 1], args=(w,), xtol=1e-15) if k > 1 else angle
        stop = end if met is None else met
        points, weights = np.polynomial.legendre.leggauss(60)
        t = angle + 0.5 * (stop - angle) * (1.0 + points)
        deflection = (self.at(self.u, t) - w) * (0.5 * (stop - angle) * weights)[:, None]
        return met, self.basis(t).T @ deflection

    def slip(self, angle, end, phi):
        """Angle at which slip ends (None: it does not), phi, integrals of r e phi_i and of r times the slip."""

        def rate(t, y):
            e, r = np.array([np.cos(y[0]), np.sin(y[0])]), max(float(self.at(self.r, t)), 1e-300)
            velocity = self.at(self.u, t, 1)
            dphi = (velocity[1] * e[0] - velocity[0] * e[1]) / r
            work = r * (velocity @ e - self.at(self.r, t, 1))
            return np.concatenate([[dphi, work], np.outer(self.basis(t), r * e).ravel()])

        def margin(t, y):
            return self.margin(t, y[0])

        margin.terminal, margin.direction = True, -1.0
        start = np.concatenate([[phi, 0.0], np.zeros(2 * self.u.shape[1])])
        solved = solve_ivp(
            rate, (angle, end), start, method="DOP853", rtol=self.rtol, atol=1e-14, events=margin, max_step=0.05
        )
        met = solved.t[-1] if solved.status == 1 else None
        return met, solved.y[0, -1], solved.y[2:, -1].reshape(-1, 2), solved.y[1, -1]

    def march(self, angle, end, w, phi=None):
        """From `angle` to `end`, in slip along phi if given: w, phi, integrals of (u - w) phi_i, r times slip."""
        total, work = np.zeros((self.u.shape[1], 2)), 0.0
        while angle is not None:
            if phi is None:
                angle, part = self.stick(angle, end, w)
                if angle is not None:
                    phi = np.arctan2(*(self.at(self.u, angle) - w)[::-1])
            else:
                angle, last, part, more = self.slip(angle, end, phi)
                stop = end if angle is None else angle
                w = self.at(self.u, stop) - self.at(self.r, stop) * np.array([np.cos(last), np.sin(last)])
                phi, work = (last if angle is None else None), work + more
            total += part
        return w, phi, total, work

    def steady(self, periods=60):
        """Coefficients (2H+1, 2) of the force -T on the right node and the work of slip in a period."""
        total, work = np.zeros((self.u.shape[1], 2)), 0.0
        if self.roots:
            rises = self.roots[1 if self.pressed_first else 0 :: 2]
            falls = self.roots[0 if self.pressed_first else 1 :: 2]
            for left in rises:
                right = min(t + 2.0 * np.pi * (t < left) for t in falls if t > left or t + 2.0 * np.pi > left)
                velocity, phi, start = self.at(self.u, left, 1), None, left
                if np.hypot(*velocity) > self.at(self.r, left, 1):  # e attracts: a start just after contact will do
                    start = left + 1e-9
                    phi = np.arctan2(*self.at(self.u, start, 1)[::-1])
                *_, part, more = self.march(start, right - 1e-8, self.at(self.u, start), phi)
                total, work = total + part, work + more
        elif self.pressed_first:
            w = np.zeros(2)
            for _ in range(periods):
                x, phi = self.at(self.u, 0.0) - w, None
                if np.hypot(*x) > self.at(self.r, 0.0) * (1.0 - 1e-12):
                    phi = float(np.arctan2(x[1], x[0]))
                    w = w + x - self.at(self.r, 0.0) * x / np.hypot(*x)
                    if self.margin(0.0, phi) <= 0.0:
                        phi = None
                before = w
                w, _, total, work = self.march(0.0, 2.0 * np.pi, w, phi)
                if np.hypot(*(w - before)) < 1e-13 * self.largest:
                    break
            else:
                raise ArithmeticError("no steady cycle")
        weight = np.where(np.arange(self.u.shape[1]) == 0, 1.0, 2.0)[:, None]
        return -self.kt * weight * total / (2.0 * np.pi), self.kt * work

"""Harmonic balance beside SciPy's time integration: a mass that hits a stop.

The same equation of motion by DOP853, until the motion repeats; harmonic balance with 15 harmonics is there at once.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_ivp

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from rom import ReducedModel, modal_model

gap, stop, damping, force, frequency = 1.0, 2.0, 0.1, 0.3, 0.18
model = ReducedModel.from_matrices([[1.0]], [[1.0]], [[0.0], [0.0], [1.0]], load=[1.0])
contact = ContactParameters.shared(
    1, normal_stiffness=stop, tangential_stiffness=0.0, friction=0.0, interference=-gap
)
options = SolverOptions((0.05, 0.3), harmonics=15)
curve = forced_response(modal_model(model, damping_ratio=damping / 2.0), contact, Excitation(0, force), options)
balance = float(np.interp(frequency, curve.frequency_hz, curve.amplitude_m))

w = 2.0 * np.pi * frequency
period = 2.0 * np.pi / w


def rate(t, state):
    x, v = state
    return v, force * np.cos(w * t) - x - damping * v - stop * max(x - gap, 0.0)


late = np.linspace(199.0 * period, 200.0 * period, 4001)
motion = solve_ivp(rate, (0.0, late[-1]), (0.0, 0.0), "DOP853", late, rtol=1e-9, atol=1e-11)
exact = np.abs(motion.y[0]).max()
plt.plot(curve.frequency_hz, curve.amplitude_m, label="harmonic balance")
plt.plot(frequency, exact, "o", label="time integration")
plt.xlabel("frequency [Hz]")
plt.ylabel("amplitude [m]")
plt.legend()
plt.savefig("time_integration_beside.png", dpi=100)
print(f"time integration {exact:.5f} m, harmonic balance {balance:.5f} m")
print(f"difference: {100.0 * abs(balance / exact - 1.0):.3f} %")

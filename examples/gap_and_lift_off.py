"""A contact that opens in every period: the frequency of a free motion on a one-sided stop.

Half a period on one spring, half a period on two: f = 2 f1 f2 / (f1 + f2), whatever the amplitude.
"""

import matplotlib.pyplot as plt
import numpy as np

from nonlinear import ContactParameters, SolverOptions, nonlinear_mode
from rom import ReducedModel, modal_model

model = ReducedModel.from_matrices([[1.0]], [[10.0]], [[0.0], [0.0], [1.0]], load=[1.0])
stop = ContactParameters.shared(1, normal_stiffness=50.0, tangential_stiffness=0.0, friction=0.0)
options = SolverOptions((0.2, 2.0), harmonics=31)
mode = nonlinear_mode(modal_model(model, damping_ratio=1e-4), stop, 0, (0.01, 0.1), options)
plt.plot(mode.frequency_hz, mode.amplitude_m)
plt.xlabel("frequency [Hz]")
plt.ylabel("amplitude [m]")
plt.savefig("gap_and_lift_off.png", dpi=100)
book = 2.0 / (1.0 / np.sqrt(10.0) + 1.0 / np.sqrt(60.0)) / (2.0 * np.pi)
print(f"in the book {book:.5f} Hz")
print(f"nonlinear mode {mode.frequency_hz[-1]:.5f} Hz")

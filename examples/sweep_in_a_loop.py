"""A sweep in a loop: the preload that makes the peak lowest.

Too little preload and the contact slides without friction, too much and it sticks; `find_optimum` finds what lies
between.
"""

import matplotlib.pyplot as plt
import numpy as np

from nonlinear import ContactParameters, Excitation, SolverOptions, find_optimum, forced_response
from rom import ReducedModel, modal_model

model = ReducedModel.from_matrices([[1.0]], [[1.0]], [[1.0], [0.0], [0.0]], load=[1.0])
modal = modal_model(model, damping_ratio=0.01)
options = SolverOptions((0.1, 0.4), harmonics=1, stability="folds", detached=False, search="off")


def problem(preload):
    values = {"normal_stiffness": 0.0, "tangential_stiffness": 3.0, "friction": 0.5, "preload": preload}
    return modal, ContactParameters.shared(1, **values), Excitation(0, 1.0), options


preloads = np.linspace(0.5, 4.0, 8)
peaks = [forced_response(*problem(preload)).peak.amplitude_m for preload in preloads]
plt.plot(preloads, peaks, "o-")
plt.xlabel("preload [N]")
plt.ylabel("peak [m]")
plt.savefig("sweep_in_a_loop.png", dpi=100)
print("lowest of the loop:", preloads[int(np.argmin(peaks))], "N")
print(f"optimum: {find_optimum(problem(2.0), 'preload', 0.5, 4.0).value:.3f} N")

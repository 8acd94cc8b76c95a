"""A hysteresis loop: force over displacement of a contact node in one period.

Its area is the friction work of the cycle, which the curve has too.
"""

import matplotlib.pyplot as plt
import numpy as np

from nonlinear import ContactParameters, Excitation, SolverOptions, contact_cycle, forced_response
from rom import ReducedModel, modal_model

model = ReducedModel.from_matrices([[1.0]], [[1.0]], [[1.0], [0.0], [0.0]], load=[1.0])
contact = ContactParameters.shared(1, normal_stiffness=0.0, tangential_stiffness=3.0, friction=0.5, preload=2.0)
options = SolverOptions((0.1, 0.4), harmonics=1)
curve = forced_response(modal_model(model, damping_ratio=0.01), contact, Excitation(0, 1.0), options)
top = curve.peak.index
cycle = contact_cycle(curve.relative_displacement[top], contact, 4096)
x, force = cycle.displacement[:, 0, 0], cycle.force[:, 0, 0]
plt.plot(x, force)
plt.xlabel("displacement [m]")
plt.ylabel("friction force [N]")
plt.savefig("hysteresis_loop.png", dpi=100)
area = abs(np.sum(0.5 * (force + np.roll(force, -1)) * (np.roll(x, -1) - x)))
print(f"work of the curve: {curve.dissipated_j[top]:.4f} J")
print(f"area of the loop: {area:.4f} J")

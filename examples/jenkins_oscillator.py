"""A mass that rubs against the ground: friction work at the peak.

One slider, 3 N/m stiff, slips at 1 N. In a cycle of amplitude X it dissipates 4 x 1 N x (X - 1 N / 3 N/m).
"""

import matplotlib.pyplot as plt

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from rom import ReducedModel, modal_model
from shroud import plot_curve

rows = [[1.0], [0.0], [0.0]]  # the mass moves along t1, the first direction in the face
model = ReducedModel.from_matrices([[1.0]], [[1.0]], rows, load=[1.0])
contact = ContactParameters.shared(1, normal_stiffness=0.0, tangential_stiffness=3.0, friction=0.5, preload=2.0)
options = SolverOptions((0.1, 0.4), harmonics=1)
curve = forced_response(modal_model(model, damping_ratio=0.01), contact, Excitation(0, 2.0), options)
axes = plt.gca()
plot_curve(axes, curve, unit="m")
axes.set(xlabel="excitation frequency [Hz]", ylabel="largest displacement over a period [m]")
plt.savefig("jenkins_oscillator.png", dpi=100)
peak = curve.peak
print(f"peak {peak.amplitude_m:.4f} m at {peak.frequency_hz:.4f} Hz")
print(f"friction work a cycle: {curve.dissipated_j[peak.index]:.5f} J")

"""A nonlinear mode: how frequency and damping change from stuck to slipping, and which force has its resonance where.

The damping ratio is highest where half of the energy that one cycle could lose is lost, not where contacts slip most.
"""

import matplotlib.pyplot as plt
import numpy as np

from nonlinear import ContactParameters, SolverOptions, nonlinear_mode
from rom import ReducedModel, modal_model

model = ReducedModel.from_matrices([[1.0]], [[1.0]], [[1.0], [0.0], [0.0]], load=[1.0])
contact = ContactParameters.shared(1, normal_stiffness=0.0, tangential_stiffness=3.0, friction=0.5, preload=2.0)
mode = nonlinear_mode(
    modal_model(model, damping_ratio=0.001), contact, 0, (0.05, 30.0), SolverOptions((0.1, 0.4), harmonics=1)
)
plt.semilogx(mode.amplitude_m, mode.damping_ratio)
plt.xlabel("amplitude [m]")
plt.ylabel("damping ratio")
plt.savefig("nonlinear_mode.png", dpi=100)
best = int(np.argmax(mode.damping_ratio))
print(f"stuck {mode.frequency_hz[0]:.4f} Hz, sliding {mode.frequency_hz[-1]:.4f} Hz")
print(f"most damped at {mode.amplitude_m[best]:.3f} m: damping ratio {mode.damping_ratio[best]:.4f}")

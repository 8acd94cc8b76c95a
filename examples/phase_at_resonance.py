"""Your own picture: amplitude and phase of a response with matplotlib.

A curve is arrays. At a resonance the tip is a quarter of a period behind the force.
"""

import matplotlib.pyplot as plt
import numpy as np

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from rom import ReducedModel, modal_model

model = ReducedModel.from_matrices([[1.0]], [[1.0]], [[1.0], [0.0], [0.0]], load=[1.0])
contact = ContactParameters.shared(1, normal_stiffness=0.0, tangential_stiffness=3.0, friction=0.5, preload=2.0)
options = SolverOptions((0.1, 0.4), harmonics=1)
curve = forced_response(modal_model(model, damping_ratio=0.01), contact, Excitation(0, 1.0), options)
figure, (above, below) = plt.subplots(2, 1, sharex=True)
above.plot(curve.frequency_hz, curve.amplitude_m)
above.set_ylabel("amplitude [m]")
below.plot(curve.frequency_hz, np.degrees(np.unwrap(curve.phase_rad)))
below.set(xlabel="frequency [Hz]", ylabel="phase [degrees]")
figure.savefig("phase_at_resonance.png", dpi=100)
print(f"phase at the peak: {np.degrees(curve.phase_rad[curve.peak.index]):.1f} degrees")

"""A wave that does not last: four blades with gaps, and the nodal diameter that breaks it up.

Along the response of the travelling wave a perturbation of another nodal diameter grows. What the ring does
instead, the worst motion, is irregular and higher than the peak of any wave.
"""

import numpy as np

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from rom import ReducedModel, modal_model

normal = [[0.0], [0.0], [1.0]]
model = ReducedModel.from_matrices([[1.0]], [[1.0]], normal, load=[1.0], contact_left=normal, n_blades=4)
contact = ContactParameters.shared(
    1, normal_stiffness=15.0, tangential_stiffness=0.0, friction=0.0, interference=-0.2
)
options = SolverOptions((0.15, 0.17), harmonics=31, search="off")
curve = forced_response(modal_model(model, damping_ratio=0.01), contact, Excitation(1, 0.08), options)
growing = np.nanargmax(curve.growth_rate)
print(f"fastest: nodal diameter {curve.growth_nodal_diameter[growing]} at {curve.frequency_hz[growing]:.4f} Hz")
at = 1.0035 / (2.0 * np.pi)
rate = np.interp(at, curve.frequency_hz, curve.growth_rate)
print(f"growth rate at {at:.5f} Hz: {rate:.5f} 1/s")

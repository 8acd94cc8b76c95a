"""What a measurement at one load says of another: everything scales with force and preload together.

Without gaps the equations have no length of their own: three times the force on three times the preload is the same
motion, three times as large. A rig may run at a tenth of the loads of the engine.
"""

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from rom import ReducedModel, modal_model

model = ReducedModel.from_matrices([[1.0]], [[1.0]], [[1.0], [0.0], [0.0]], load=[1.0])
modal, options = modal_model(model, damping_ratio=0.01), SolverOptions((0.1, 0.4), harmonics=5)


def peak(factor):
    values = {"normal_stiffness": 0.0, "tangential_stiffness": 3.0, "friction": 0.5, "preload": 2.0 * factor}
    contact = ContactParameters.shared(1, **values)
    return forced_response(modal, contact, Excitation(0, factor), options).peak.amplitude_m


print(f"peak at three times the loads over the peak: {peak(3.0) / peak(1.0):.9f}")

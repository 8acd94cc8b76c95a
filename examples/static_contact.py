"""From interference to normal load: what two faces press with before anything vibrates.

In series with the blade: a spring of 1 N/m pressed by kn = 3 N/m that is 0.4 m too long carries 0.4 x 3 / (1 + 3) N.
"""

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from rom import ReducedModel, modal_model

model = ReducedModel.from_matrices([[1.0]], [[1.0]], [[0.0], [0.0], [1.0]], load=[1.0])
contact = ContactParameters.shared(1, normal_stiffness=3.0, tangential_stiffness=0.0, friction=0.0, interference=0.4)
options = SolverOptions((0.1, 0.5), harmonics=1)
curve = forced_response(modal_model(model, damping_ratio=0.01), contact, Excitation(0, 1e-3), options)
print(f"open: {curve.static_contact.open_share:.0%} of the face")
print(f"normal force: {curve.static_contact.force_n:.6f} N")

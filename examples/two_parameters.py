"""Two parameters at once: the lowest peak over stiffness and preload of a slider.

A softer slider than its best one loses less; the stiffest allowed one is best here, with its own preload.
"""

from nonlinear import ContactParameters, Excitation, SolverOptions, find_joint_optimum
from rom import ReducedModel, modal_model

model = ReducedModel.from_matrices([[1.0]], [[1.0]], [[1.0], [0.0], [0.0]], load=[1.0])
contact = ContactParameters.shared(1, normal_stiffness=0.0, tangential_stiffness=2.0, friction=0.5, preload=2.0)
options = SolverOptions((0.1, 0.4), harmonics=1, stability="folds", detached=False, search="off")
problem = modal_model(model, damping_ratio=0.01), contact, Excitation(0, 1.0), options
optimum = find_joint_optimum(problem, {"tangential_stiffness": (1.0, 3.0), "preload": (0.5, 4.0)})
print(optimum.message)
print(f"lowest peak: {optimum.amplitude_m:.4f} m")

"""Wear over a life: friction work times a coefficient.

Archard: the worn depth is coefficient times work over area. Here the preload does not wear off, so that each cycle
is as the first.
"""

from nonlinear import (
    ContactParameters,
    Excitation,
    OperatingPoint,
    SolverOptions,
    forced_response,
    wear_history,
)
from rom import ReducedModel, modal_model

model = ReducedModel.from_matrices([[1.0]], [[1.0]], [[1.0], [0.0], [0.0]], load=[1.0])
contact = ContactParameters.shared(1, normal_stiffness=0.0, tangential_stiffness=3.0, friction=0.5, preload=2.0)
options = SolverOptions((0.1, 0.4), harmonics=1, stability="folds", detached=False, search="off")
problem = modal_model(model, damping_ratio=0.01), contact, Excitation(0, 1.0), options
curve = forced_response(*problem)
history = wear_history([OperatingPoint(problem, curve=curve)], coefficient=1e-13, area=1e-4, cycles=1e6)
archard = 1e-13 * 1e6 * curve.dissipated_j[curve.peak.index] / 1e-4
print(f"depth by hand {archard * 1e3:.6f} mm")
print(f"worn depth {history.depth_m[-1, 0] * 1e3:.6f} mm")

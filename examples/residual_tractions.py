"""One load, many peaks: where a contact sticks, its history decides on the peak.

In the wedge damper of Balaji and Ferhatoglu (2025) one contact slips, the other sticks with a traction that nobody
knows. The published peaks lie between 3.371e-4 and 4.487e-4 m; the program gives both ends from one curve.
"""

import numpy as np

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from rom import ReducedModel, modal_model

mass = np.diag([10.0, 10.0, 10.0, 10.0, 0.1, 0.1])  # x1, y1, x2, y2 of the masses, x, y of the damper
stiffness = np.diag([1e5, 1e5, 1e5, 1e5, 0.0, 0.0])
for first, value in ((0, 9e5), (2, 3e5), (4, 1e6)):
    stiffness[first : first + 2, first : first + 2] += value * np.array([[1.0, -1.0], [-1.0, 1.0]])
c, s = np.cos(np.radians(40.0)), np.sin(np.radians(40.0))
rows = np.zeros((6, 6))  # t1, t2, n of both contacts: the damper less a mass
for node, (body, frame) in enumerate([(0, [[c, s], [-s, c]]), (2, [[c, -s], [s, c]])]):
    rows[3 * node : 3 * node + 3 : 2, 4:] = frame
    rows[3 * node : 3 * node + 3 : 2, body : body + 2] = -np.array(frame)
load, static = np.array([0.0, -20.0, 5.0, 0.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 0.0, 0.0, 240.0])
model = ReducedModel.from_matrices(mass, stiffness, rows, load, np.eye(6)[3], force_static=static)
contact = ContactParameters(
    normal_stiffness=np.full(2, 3e5),
    tangential_stiffness=np.full(2, 3e5),
    friction=np.full(2, 0.9),
    interference=np.zeros(2),
    preload=np.zeros(2),
)
options = SolverOptions((48.0, 51.0), harmonics=5, residual_tractions="bounds")
curve = forced_response(modal_model(model, rayleigh=(2.0, 0.0)), contact, Excitation(0, 1.0), options)
bounds = curve.residual_bounds
print(f"lowest vibration {bounds.least_vibration.vibration_m:.4e} m")
print(f"highest vibration {bounds.most_vibration.vibration_m:.4e} m")

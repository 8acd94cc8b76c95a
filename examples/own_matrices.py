"""Your own matrices: a beam of two masses, stuck and free.

A ReducedModel takes any mass and stiffness matrix, the rows that give the motion of the contact, and a load.
"""

import numpy as np

from rom import ReducedModel, natural_frequencies

mass, stiffness = np.diag([1.0, 0.5]), np.array([[1.5, -0.5], [-0.5, 0.5]])
rows = np.array([[0.0, 1.0], [0.0, 0.0], [0.0, 0.0]])  # the second mass slides along t1
model = ReducedModel.from_matrices(mass, stiffness, rows, load=[1.0, 0.0], output=[0.0, 1.0])
free = natural_frequencies(model, 0.0)
stuck = natural_frequencies(model, 0.0, tangential=0.4)
print("free", free.round(4), "Hz, stuck", stuck.round(4), "Hz")
print(f"first frequency, stuck: {stuck[0]:.6f} Hz")

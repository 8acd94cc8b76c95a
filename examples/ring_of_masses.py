"""Nodal diameters: the frequency of a wave that runs around a ring of blades.

With springs kc between the blades a wave of n nodal diameters has w^2 = (k + 4 kc sin(pi n / N)^2) / m.
"""

import matplotlib.pyplot as plt

from rom import ReducedModel, inter_blade_phase, natural_frequencies

blades = 12
normal = [[0.0], [0.0], [1.0]]  # neighbours press on each other along n, the normal of the right face
model = ReducedModel.from_matrices([[1.0]], [[1.0]], normal, load=[1.0], contact_left=normal, n_blades=blades)
for n in range(blades // 2 + 1):
    (frequency,) = natural_frequencies(model, inter_blade_phase(n, blades), normal=0.5)
    plt.plot(n, frequency, "o", color="C0")
    print(f"{n} nodal diameters: {frequency:.6f} Hz")
plt.xlabel("nodal diameters")
plt.ylabel("natural frequency [Hz]")
plt.savefig("ring_of_masses.png", dpi=100)

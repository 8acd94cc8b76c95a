"""Flutter margin: damping of every travelling wave from influence coefficients of a flow solver, as CSV.

Each coefficient is the force on one blade by the motion of another. A wave sees their sum with its phase angle.
"""

import csv

import matplotlib.pyplot as plt
import numpy as np

from rom import InfluenceCoefficients, inter_blade_phase

with open("flow.csv", "w") as file:  # offset of the blade that feels the force; real and imaginary part
    file.write("offset,real,imag\n-1,-0.003,0.0\n0,0.0,-0.004\n1,0.003,0.0\n")
with open("flow.csv") as file:
    lines = list(csv.DictReader(file))
offsets = np.array([int(line["offset"]) for line in lines])
values = np.array([float(line["real"]) + 1j * float(line["imag"]) for line in lines])
flow, blades = InfluenceCoefficients(1, offsets, values), 24
phases = np.array([inter_blade_phase(n, blades) for n in range(blades)])
damping = -0.5 * flow.in_wave(phases).imag
plt.plot(damping, "o-")
plt.axhline(0.0, color="0.5")
plt.xlabel("nodal diameters")
plt.ylabel("aerodynamic damping ratio")
plt.savefig("flutter_margin.png", dpi=100)
worst = int(np.argmin(damping))
print(f"least damped: {worst} nodal diameters, {np.degrees(phases[worst]):.0f} degrees between the blades")
print(f"aerodynamic damping ratio there: {damping[worst]:.6f}")

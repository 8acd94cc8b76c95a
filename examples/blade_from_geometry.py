"""From geometry to a reduced model: mesh, matrices, Craig-Bampton, and what the reduction costs.

The first frequency of the free reduced blade beside that of the whole mesh: always a little above.
"""

import numpy as np
from scipy.sparse.linalg import eigsh

from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
from rom import Material, ReductionOptions, assemble, natural_frequencies, reduce_sector

blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
sector = build_sector(blade, shroud, MeshParameters(size=0.02))
full = assemble(sector, Material(2e11, 0.3, 7800.0), element="hex8")
reduced = reduce_sector(full, sector, ReductionOptions(modes=8)).model
free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
stiffness, mass = full.stiffness[free][:, free], full.mass[free][:, free]
(eigenvalue,) = eigsh(stiffness, 1, mass, sigma=0.0, return_eigenvectors=False)
whole, first = np.sqrt(eigenvalue) / (2.0 * np.pi), natural_frequencies(reduced, 0.0)[0]
print(f"{full.n_dofs} degrees of freedom: {whole:.4f} Hz; {reduced.size}: {first:.4f} Hz")
print(f"reduction error: {1e6 * (first / whole - 1.0):.2f} parts in a million")

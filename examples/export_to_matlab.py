"""Into another program: a response and the matrices as MATLAB files.

`shroud export` does the same on the command line, also to universal files and to ParaView.
"""

import subprocess

from scipy.io import loadmat

import shroud

model = shroud.ReducedModel.from_matrices([[1.0]], [[1.0]], [[1.0], [0.0], [0.0]], load=[1.0])
results = shroud.run_scene(
    out="exported",
    until="respond",
    rom=model,
    quiet=True,
    contact={"normal_stiffness": 0.0, "tangential_stiffness": 3.0, "friction": 0.5, "preload": 2.0},
    excitation={"engine_order": 0, "force": 1.0},
    response={"frequency": [0.1, 0.4], "damping_ratio": 0.01, "harmonics": 1},
)
subprocess.run(["shroud", "export", "exported/response.h5", "--to", "response.mat"], check=True)
print(sorted(name for name in loadmat("response.mat", simplify_cells=True) if not name.startswith("__")))
print(f"peak {results[0].peak.amplitude_m:.4f} m")

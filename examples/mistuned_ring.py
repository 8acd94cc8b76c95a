"""Mistuning: how much higher the highest blade of a real ring vibrates.

Whitehead's bound for N blades in one mode family is (1 + sqrt(N)) / 2; friction and weak coupling stay below.
"""

import shroud

normal = [[0.0], [0.0], [1.0]]
blades = 12
model = shroud.ReducedModel.from_matrices([[1.0]], [[1.0]], normal, load=[1.0], contact_left=normal, n_blades=blades)
results = shroud.run_scene(
    out="mistuned",
    until="study",
    rom=model,
    quiet=True,
    contact={"normal_stiffness": 0.02, "tangential_stiffness": 0.0, "friction": 0.0, "preload": 50.0},
    excitation={"engine_order": 3, "force": 0.01},
    response={"frequency": [0.155, 0.165], "damping_ratio": 0.002, "harmonics": 1, "search": "off"},
    mistuning={"samples": 10, "frequency_deviation": 0.01},
)
study = results.studies["mistuning"]
print(f"Whitehead's bound {study['bound']:.3f}")
print(f"highest amplification of 10 rings: {max(ring['factor'] for ring in study['rings']):.3f}")

"""What do we know if friction is not known? Quantiles of the worst motion from a distribution.

The samples are curves, and cached: twice as many solve only the new half.
"""

import shroud

model = shroud.ReducedModel.from_matrices([[1.0]], [[1.0]], [[1.0], [0.0], [0.0]], load=[1.0])
quick = {"stability": "folds", "detached": False, "truncation": False, "search": "off"}
results = shroud.run_scene(
    out="uncertain",
    until="study",
    rom=model,
    quiet=True,
    contact={"normal_stiffness": 0.0, "tangential_stiffness": 3.0, "friction": 0.5, "preload": 3.0},
    excitation={"engine_order": 0, "force": 1.0},
    response={"frequency": [0.1, 0.4], "damping_ratio": 0.01, "harmonics": 3, **quick},
    uncertainty={
        "samples": 16,
        "parameter": [{"key": "contact.friction", "distribution": "uniform", "low": 0.3, "high": 0.7}],
    },
)
study = results.studies["uncertainty"]
print(study["message"])
print(f"median of the worst motion: {study['amplitude']['quantiles'][1]['value']:.4f} m")

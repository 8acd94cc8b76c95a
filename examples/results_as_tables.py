"""Results as tables: a run of the whole program on your own matrices, read with pandas and xarray.

`run_scene` takes the tables of a scene as arguments; a swept key gives a curve for each value.
"""

import shroud

model = shroud.ReducedModel.from_matrices([[1.0]], [[1.0]], [[1.0], [0.0], [0.0]], load=[1.0])
results = shroud.run_scene(
    out="tables",
    until="respond",
    rom=model,
    quiet=True,
    contact={"normal_stiffness": 0.0, "tangential_stiffness": 3.0, "friction": 0.5, "preload": 2.0},
    excitation={"engine_order": 0, "force": 1.0},
    response={"frequency": [0.1, 0.4], "damping_ratio": 0.01, "harmonics": 1, "detached": False, "search": "off"},
    sweep={"contact.preload": [1.0, 2.0, 3.0, 4.0]},
)
results.plot(unit="m").figure.savefig("results_as_tables.png", dpi=100)
table = results.to_dataframe()
print(table[["contact.preload_n", "peak_amplitude_m", "peak_frequency_hz"]].round(4).to_string(index=False))
space = results.to_xarray()
print("dimensions:", dict(space.sizes))
print(f"lowest peak: {table.peak_amplitude_m.min():.4f} m")

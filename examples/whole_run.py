"""A whole run from a scene file: coarse, in seconds, and what it says.

`overrides` changes any key; results are cached in the output folder, so that a second call is immediate.
"""

from pathlib import Path

import shroud

scene = Path(__file__).parents[1] / "scenes" / "dummy.toml"
changed = {"accuracy": "draft", "contact.interference": 20e-6, "response.harmonics": 1, "response.search": "off"}
results = shroud.run_scene(scene, "coarse", until="respond", quiet=True, overrides=changed)
curve = results[0]
results.plot().figure.savefig("whole_run.png", dpi=100)
print(f"stuck and slipping: {curve.peak.amplitude_m * 1e6:.2f} µm at {curve.peak.frequency_hz:.1f} Hz")

#!/usr/bin/env bash
# bladesight 0.17.0 (which does not ask for, but needs, a duckdb below 2), blade-tip timing: an arrival at the very
# instant of a once-per-revolution pulse is counted in both revolutions, with the angles 2 pi and 0, and one row more
# than arrivals; data made on a computer, or a blade that stands under the probe when the pulse comes, shift every
# count after it. And `get_correction_values` gives the value meant for the highest speed to the lowest one.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q --disable-pip-version-check bladesight==0.17.0 duckdb==1.4.4
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import numpy as np
from bladesight.btt.aoa import transform_ToAs_to_AoAs
from bladesight.btt.infer.sdof import get_correction_values

pulses = np.array([0.0, 0.5, 1.0, 1.5])
arrivals = np.array([0.125, 0.5, 0.75, 1.25])  # the second at the instant of a pulse
table = transform_ToAs_to_AoAs(pulses, arrivals)
angles = [float(angle) for time, angle in zip(table["ToA"], table["AoA"]) if time == 0.5]
print(len(arrivals), "arrivals,", len(table), "rows; angles of that at a pulse:", sorted(angles))
assert len(table) == len(arrivals) + 1, "an arrival at a pulse is counted once now"
assert np.allclose(sorted(angles), [0.0, 2.0 * np.pi])

speed = np.array([100.0, 150.0, 200.0])
values = get_correction_values(speed, 0.0, 7.0)
print("correction of 0 at the median speed and 7 at the highest:", dict(zip(speed.tolist(), values.tolist())))
assert np.allclose(values, [7.0, 0.0, -7.0]), "the value belongs to the highest speed now"
PY

#!/usr/bin/env bash
# pyuff 2.5.8, universal files of measured frequency responses: a binary dataset 58 that is written with the mode
# "overwrite" leaves a file that holds only "-1", without an error (with "add" it is there); and before anything is
# written NaN becomes 0 and infinity 1.8e308, also in the array of the caller: a line that a rig did not measure reads
# as an antiresonance.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q --disable-pip-version-check pyuff==2.5.8
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import numpy as np
import pyuff


def dataset(values, binary):
    names = ("id1", "id2", "id3", "id4", "id5", "rsp_ent_name", "ref_ent_name")
    axes = ("abscissa", "ordinate", "orddenom")
    labels = {f"{axis}_axis_{kind}": "NONE" for axis in axes for kind in ("lab", "units_lab")}
    kinds = {f"{axis}_spec_data_type": 0 for axis in axes}
    numbers = dict(type=58, func_type=4, rsp_node=1, rsp_dir=3, ref_node=2, ref_dir=3, load_case_id=0, ver_num=0)
    x = np.linspace(200.0, 204.0, len(values))
    return {**dict.fromkeys(names, "NONE"), **labels, **kinds, **numbers, "x": x, "data": values, "binary": binary}


for mode in ("overwrite", "add"):
    pyuff.UFF(f"{mode}.uff").write_sets([dataset(np.array([1.0, 2.0, 3.0, 4.0, 5.0]), 1)], mode)
sizes = {mode: len(pyuff.UFF(f"{mode}.uff").get_set_types()) for mode in ("overwrite", "add")}
values = np.array([1.0, np.nan, 3.0, np.inf, 5.0])
pyuff.UFF("missing.uff").write_sets([dataset(values, 0)], "overwrite")
read = pyuff.UFF("missing.uff").read_sets()["data"]
print("datasets in a binary file:", sizes, "- 1, NaN, 3, infinity, 5 read as", read.tolist())
assert sizes == {"overwrite": 0, "add": 1}, "binary files are written with overwrite now"
assert read[1] == 0.0 and read[3] > 1e300, "missing samples are kept now"
PY

#!/usr/bin/env bash
# mapdl-archive 0.4.2, its published Ansys archives (.cdb): the uniform temperature that CDWRITE writes where none was
# given is no number but the name of a parameter of the program, `BFUNIF,TEMP,_TINY`, which the archive does not define.
# A reader that takes the field for a number fails on most archives, and one that takes an unknown name for 0 gives a
# blade a temperature that it has not; the reference temperature beside it, `TREF`, is a number in the same files.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q --disable-pip-version-check mapdl-archive==0.4.2
"$folder/venv/bin/python" - <<'PY'
from mapdl_archive import examples

for name, path in (("hexahedra", examples.hexarchivefile), ("tetrahedra", examples.tetarchivefile)):
    lines = [line.strip() for line in open(path)]
    (uniform,) = [line for line in lines if line.upper().startswith("BFUNIF")]
    (reference,) = [line for line in lines if line.upper().startswith("TREF")]
    defined = [line for line in lines if "_TINY" in line and line != uniform]
    print(f"{name}: {uniform}; {reference}; lines that define _TINY: {len(defined)}")
    assert uniform.split(",") == ["BFUNIF", "TEMP", "_TINY"], "the temperature is a number now"
    assert not defined
    float(reference.split(",")[1])
PY

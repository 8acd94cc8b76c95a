"""pyHarm on the peers' problems in its shortest form, where `make bench-peers` has installed it."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from peers import CASES, TOLERANCE, Bench, ProgramError
from peers_programs import Request
from tables import OUT

ENVIRONMENT = OUT / "peers" / "env"
FASTEST = {  # the variant that `peers.py` finds fastest
    "A1": "Jenkins x",
    "A5": "Jenkins x",
    "V1": "Penalty3D, hybrid",
    "V5": "Penalty3D",
    "S1": "Penalty3D",
}


def pyharm_points(ours: Mapping[str, Mapping[str, Any]], models: Path) -> dict[str, float]:
    """Milliseconds of processor time a point by case, with as many points as ours; empty without pyHarm."""
    python = ENVIRONMENT / "bin" / "python"
    if not python.exists():
        print("pyHarm is not installed (make bench-peers): not measured", file=sys.stderr)
        return {}
    bench = Bench(python.absolute(), ENVIRONMENT, 1, False)
    found = {}
    for case, row in ours.items():
        kind, harmonics = CASES[case]
        request = Request("pyHarm", FASTEST[case], kind, harmonics, TOLERANCE, curves=1, points=row["points"])
        try:
            answer = bench.run(Request(**{**vars(request), "file": str(models / "blade.npz")}))
        except ProgramError as error:
            print(f"{case}: {error}", file=sys.stderr)
            continue
        found[case] = 1e3 * answer["timed"][0][1] / answer["curve"]["points"]
    return found

"""From a turn of a knob to the first look at the response: `python benchmarks/explore_latency.py` from the project.

Random turns of the knobs that need no other mesh, each fifth one back to the scene as it was opened: median, 95 %
and longest time from the values to a view with all that it shows (curve, states, linear limits), processor time of
this process; curves given up before the end of the range, errors, and memory before and after.
"""

from __future__ import annotations

import random
import resource
import time
from pathlib import Path
from typing import Any

import numpy as np
from tables import ROOT, markdown_table, options_of, write_results

from pipeline.explore.live import LiveScene
from pipeline.process.progress import Reporter

NAME = "explore_latency"
SCENES = ("dummy", "machine", "damper", "shroud_and_damper")
BACK = 5  # turns from the scene as it was opened
LEFT_OUT = ("law",)  # of knobs: the friction cone takes several times as long, see --cone


def resident_mb() -> float:
    """Memory of this process now, MB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


def turned(live: LiveScene, turns: int, seed: int, cone: bool) -> dict[str, Any]:
    """Times of random turns, seconds, and what went wrong."""
    chance, now = random.Random(seed), live
    knobs = [knob for knob in live.knobs if not knob.remeshes and knob.key.rpartition(".")[2] not in LEFT_OUT]
    start = live.turned({"contact.law": "cone"}) if cone else live
    times, given_up, errors = [], 0, []
    for turn in range(turns):
        now = start if turn % BACK == 0 else now
        knob = chance.choice(knobs)
        value = chance.choice(knob.choices) if knob.kind == "choice" else knob.at(chance.random())
        began = time.process_time()
        try:
            now = now.turned({knob.key: value})
            view = now.curve()
        except Exception as error:  # counted, and shown
            errors.append(f"{knob.key} = {value}: {error}")
            continue
        times.append(time.process_time() - began)
        given_up += not view.response.termination.complete
    return {"times": times, "given up": given_up, "errors": errors}


def measure(scene: Path, out: Path, turns: int, seed: int, cone: bool) -> dict[str, Any]:
    """The row of a scene."""
    live = LiveScene.open(scene, out, reporter=Reporter(quiet=True))
    try:
        turned(live, 2 * BACK, seed + 1, cone)  # what is loaded once
        before = resident_mb()
        found = turned(live, turns, seed, cone)
        after = resident_mb()
    finally:
        live.close()
    for error in found["errors"][:3]:
        print(error)
    milliseconds = 1e3 * np.array(found["times"])
    median, most, longest = np.quantile(milliseconds, [0.5, 0.95, 1.0]) if len(milliseconds) else [np.nan] * 3
    return {
        "scene": scene.stem + " (cone)" * cone,
        "contact nodes": live.loaded.model.n_contacts,
        "turns": turns,
        "median ms": round(float(median), 1),
        "95 % ms": round(float(most), 1),
        "longest ms": round(float(longest), 1),
        "given up": found["given up"],
        "errors": len(found["errors"]),
        "memory before MB": round(before, 1),
        "memory after MB": round(after, 1),
    }


def main(arguments: list[str] | None = None) -> None:
    """Print and write the table."""
    parser = options_of(__doc__, NAME)
    parser.set_defaults(scene=None)
    parser.add_argument("--turns", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cone", action="store_true", help="with the friction cone")
    options = parser.parse_args(arguments)
    scenes = [options.scene] if options.scene else [ROOT / "scenes" / f"{name}.toml" for name in SCENES]
    rows = []
    for scene in scenes:
        folder = options.out / "scenes" / scene.stem
        rows.append(measure(scene, folder, options.turns, options.seed, options.cone))
        print(markdown_table([], [rows[-1].values()]).splitlines()[-1], flush=True)
    table = markdown_table(rows[0], (row.values() for row in rows))
    write_results(options.out, NAME, rows, f"# From a turn to the first look\n\n{__doc__}\n\n{table}\n")


if __name__ == "__main__":
    main()

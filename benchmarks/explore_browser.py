"""How soon the page of `shroud explore` shows what a turned knob changes, and what many turns leave behind.

    python benchmarks/explore_browser.py                   # 200 turns of three scenes
    python benchmarks/explore_browser.py --turns 1000 dummy

Sliders of a page in Chromium get random places one after the other. A time goes from the event of the slider to the
frame that shows the new curve: program, browser and drawing without a graphics card share the cores of this machine.
Memory is that of the program before the turns and after them.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import statistics
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks")]

from browser import browser  # noqa: E402

SCENES = ("dummy", "machine", "damper")
OUT = ROOT / "out" / "explore"
TURN = """(key, position) => { const slider = document.querySelector(`[data-key="${key}"] input[type=range]`);
slider.value = position; slider.dispatchEvent(new Event("input")); }"""
KNOBS = """[...document.querySelectorAll("#knobs > .knob")].filter((knob) => knob.querySelector("[type=range]"))
.map((knob) => knob.dataset.key)"""


@dataclass(frozen=True)
class Measured:
    """Times of one scene, ms, and memory, MB."""

    scene: str
    turns: int
    shown_ms: list[float]
    answered_ms: list[float]
    refused: int  # turns that the scene does not allow
    errors: list[str]  # of the page
    program_ms: float  # processor time of the program for each turn
    before_mb: float
    after_mb: float

    def row(self) -> str:
        """A row of the table."""
        median, late = statistics.median(self.shown_ms), statistics.quantiles(self.shown_ms, n=20)[-1]
        answer = statistics.median(self.answered_ms)
        cells = [
            self.scene,
            self.turns,
            f"{self.program_ms:.0f}",
            f"{answer:.0f}",
            f"{median:.0f}",
            f"{late:.0f}",
            self.refused,
            len(self.errors),
        ]
        return "| " + " | ".join(map(str, [*cells, f"{self.before_mb:.0f}", f"{self.after_mb:.0f}"])) + " |"


HEADING = (
    "| scene | turns | processor time [ms] | answered, median [ms] | shown, median [ms] | shown, 95 % [ms] | refused "
    "| errors | MB before | after |\n|---|---|---|---|---|---|---|---|---|---|"
)


def memory_mb(process: int) -> float:
    """Resident memory of a process."""
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    return next(float(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024.0


def processor_ms(process: int) -> float:
    """Processor time that a process has taken, without those that it has started."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return 1000.0 * (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def measured(scene: str, turns: int, seed: int) -> Measured:
    """Open the page of a scene and turn its knobs."""
    command = [sys.executable, "-m", "pipeline", "explore", f"scenes/{scene}.toml", "--out", str(OUT / scene)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    server = subprocess.Popen(
        [*command, "--no-browser"], cwd=ROOT, stdout=subprocess.PIPE, text=True, env=environment
    )
    try:
        assert server.stdout is not None
        address = server.stdout.readline().strip()
        with browser(webgl=False) as running:
            tab = running.open(address, 1280, 800)
            tab.wait("window.explore && explore.answered > 0")
            time.sleep(5.0)
            before, began = memory_mb(server.pid), processor_ms(server.pid)
            found = turned(tab, turns, random.Random(seed))
            each = (processor_ms(server.pid) - began) / turns
            time.sleep(5.0)
            errors = [line for line in tab.console if not line.startswith("warning")]
            return Measured(scene, turns, *found, errors, each, before, memory_mb(server.pid))
    finally:
        server.send_signal(signal.SIGINT)
        server.wait()


def turned(tab: Any, turns: int, chance: random.Random) -> tuple[list[float], list[float], int]:
    """Times until turns are shown and answered, and how many the scene refuses; now and then all are undone."""
    keys = tab.evaluate(KNOBS)
    tab.evaluate("explore.latencies.length = explore.answers.length = 0")
    shown, answered, refused = [], [], 0
    for number in range(turns):
        tab.evaluate(f"({TURN})({chance.choice(keys)!r}, {chance.random()})")
        tab.wait("explore.answered === explore.sent && explore.latencies.length")
        shown += tab.evaluate("explore.latencies.splice(0)")
        answered += tab.evaluate("explore.answers.splice(0)")
        refused += tab.evaluate("!document.getElementById('error').hidden")
        if number % 20 == 19:
            tab.evaluate("document.getElementById('reset').click()")
            tab.wait("explore.answered === explore.sent && explore.latencies.length")
            tab.evaluate("explore.latencies.length = explore.answers.length = 0")
    return shown, answered, refused


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=SCENES, help="names of scenes in the folder scenes")
    parser.add_argument("--turns", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    print(HEADING, flush=True)
    for scene in asked.scenes:
        found = measured(scene, asked.turns, asked.seed)
        print(found.row(), flush=True)
        print(*found.errors, sep="\n", end="", file=sys.stderr)


if __name__ == "__main__":
    main()

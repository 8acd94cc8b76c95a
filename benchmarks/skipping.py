"""What a change of a scene makes run again, and what a command costs before it does anything.

    python benchmarks/skipping.py                      # the default scene, some minutes: out/bench/skipping
    python benchmarks/skipping.py --scene scenes/figure6.toml

The scene is run into an empty folder, again without a change, and then with one change at a time, each time from the
state after the first run. Writes skipping.csv, commands.csv and skipping.md.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from machine import hardware, load, today
from markdown_table import markdown_table
from results import write_results, write_rows

HOUSE = Path(__file__).resolve().parents[1]
STAGES = ("mesh", "assemble", "reduce", "respond", "render", "figures")
DONE, KEPT, LEFT_OUT = "ran", "reused", "skipped"


@dataclass(frozen=True)
class Change:
    """A change of a scene: its name, the key `table.key`, and what its value becomes, from what it is."""

    name: str
    key: str
    factor: float = 1.0
    value: Any = None

    def of(self, scene: Mapping[str, Any]) -> dict[str, Any]:
        """The changed scene; a swept key changes in the first of its values."""
        changed = {name: dict(table) if isinstance(table, Mapping) else table for name, table in scene.items()}
        sweep = changed.get("sweep", {})
        if self.key in sweep:
            first, *others = sweep[self.key]
            sweep[self.key] = [self._new(first), *others]
            return changed
        table, _, key = self.key.partition(".")
        changed.setdefault(table, {})
        changed[table][key] = self._new(changed[table].get(key))
        return changed

    def _new(self, old: Any) -> Any:
        if self.value is not None:
            return self.value
        return type(old)(old * self.factor)


CHANGES = (
    Change("interference of one curve", "contact.interference", 1.1),
    Change("friction", "contact.friction", 1.25),
    Change("contact stiffness", "contact.normal_stiffness", 1.1),
    Change("engine order", "excitation.engine_order", 0.5),
    Change("force", "excitation.force", 2.0),
    Change("damping", "response.damping_ratio", 1.5),
    Change("another rendered mode", "render.modes", value=[1, 2]),
    Change("modes kept", "rom.modes", 1.5),
    Change("Young's modulus", "material.young_modulus", 1.02),
    Change("speed", "load.speed_rpm", value=3000.0),
    Change("shroud angle", "shroud.angle", 1.1),
    Change("mesh size", "mesh.size", 1.25),
)
COMMANDS = (
    ("python -c pass", ["-c", "pass"]),
    ("shroud --help", ["-m", "pipeline", "--help"]),
    ("shroud validate SCENE", ["-m", "pipeline", "validate", "SCENE"]),
    ("shroud info SUMMARY", ["-m", "pipeline", "info", "SUMMARY"]),
    ("shroud run SCENE, nothing changed", ["-m", "pipeline", "run", "SCENE", "--out", "OUT"]),
)


@dataclass(frozen=True)
class Run:
    """One run of the pipeline: seconds that the user waits, and stage -> ran, reused or skipped."""

    name: str
    seconds: float
    status: dict[str, str]

    def row(self) -> dict[str, Any]:
        """For the table."""
        return {"change": self.name, "seconds": round(self.seconds, 2), **self.status}


def main(arguments: list[str] | None = None) -> int:
    """Measure and write the tables; the exit status."""
    parser = argparse.ArgumentParser(description="What a change makes run again; what a command costs.")
    parser.add_argument("--scene", type=Path, default=HOUSE / "scenes" / "dummy.toml")
    parser.add_argument("--repeats", type=int, default=5, help="of each command, the median counts")
    parser.add_argument("--out", type=Path, default=HOUSE / "out" / "bench" / "skipping", help="output folder")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        runs, commands = measure(options.scene, options.repeats, Path(folder))
    write_results(options.out, "skipping", [run.row() for run in runs], report(runs, commands))
    write_rows(options.out / "commands.csv", commands)
    return 0


def measure(scene: Path, repeats: int, folder: Path) -> tuple[list[Run], list[dict[str, Any]]]:
    """The runs and the times of the commands, in an empty `folder`."""
    content = tomllib.loads(scene.read_text(encoding="utf-8"))
    base, out = folder / "scene.toml", folder / "out"
    base.write_text(to_toml(content), encoding="utf-8")
    runs = [run(f"nothing there yet, {scene.name}", base, out), run("nothing", base, out)]
    commands = time_commands(base, out, repeats)
    for change in CHANGES:
        changed = folder / "changed.toml"
        changed.write_text(to_toml(change.of(content)), encoding="utf-8")
        beside = folder / "beside"
        shutil.copytree(out, beside)
        runs.append(run(change.name, changed, beside))
        shutil.rmtree(beside)
    return runs, commands


def run(name: str, scene: Path, out: Path) -> Run:
    """Run a scene and read from its summary what was done."""
    print(f"{name} ...", file=sys.stderr)
    start = time.perf_counter()
    call(["-m", "pipeline", "run", str(scene), "--out", str(out), "--quiet"])
    seconds = time.perf_counter() - start
    stages = json.loads((out / "summary.json").read_text(encoding="utf-8"))["stages"]
    return Run(name, seconds, {stage: stages.get(stage, {}).get("status", LEFT_OUT) for stage in STAGES})


def time_commands(scene: Path, out: Path, repeats: int) -> list[dict[str, Any]]:
    """Median seconds of the commands that do little, each in a process of its own."""
    places = {"SCENE": str(scene), "OUT": str(out), "SUMMARY": str(out / "response.h5")}
    rows = []
    for name, arguments in COMMANDS:
        times = []
        for _ in range(repeats):
            start = time.perf_counter()
            call([places.get(argument, argument) for argument in arguments])
            times.append(time.perf_counter() - start)
        rows.append({"command": name, "seconds": round(statistics.median(times), 3), "least": round(min(times), 3)})
    return rows


def call(arguments: Sequence[str]) -> None:
    """Run Python on the project; exit status 1, a curve that was not completed, is no error here."""
    environment = os.environ | {"PYTHONPATH": str(HOUSE)}
    done = subprocess.run([sys.executable, *arguments], cwd=HOUSE, env=environment, capture_output=True, text=True)
    if done.returncode not in (0, 1):
        raise RuntimeError(f"{' '.join(arguments)}: exit status {done.returncode}\n{done.stderr}")


def to_toml(scene: Mapping[str, Any]) -> str:
    """A scene of plain tables as TOML: JSON writes names, texts, numbers and lists of these alike."""
    lines = [f"{key} = {json.dumps(value)}" for key, value in scene.items() if not isinstance(value, Mapping)]
    for name, table in scene.items():
        if isinstance(table, Mapping):
            lines += [f"[{name}]", *(f"{json.dumps(key)} = {json.dumps(value)}" for key, value in table.items())]
    return "\n".join(lines) + "\n"


def report(runs: Sequence[Run], commands: Sequence[Mapping[str, Any]]) -> str:
    """Both tables in Markdown, with the machine."""
    mark = {DONE: "runs", KEPT: "reused", LEFT_OUT: "-"}
    changes = markdown_table(
        ("change", *STAGES, "seconds"),
        [(item.name, *(mark[item.status[stage]] for stage in STAGES), f"{item.seconds:.2f}") for item in runs],
    )
    costs = markdown_table(("command", "seconds, median", "least"), [tuple(row.values()) for row in commands])
    where = f"{today()}, {hardware()}, load of the machine {load():.1f} at the end, compiled kernels there."
    return f"# What a change makes run again\n\n{where}\n\n{changes}\n\n# What a command costs\n\n{costs}\n"


if __name__ == "__main__":
    sys.exit(main())

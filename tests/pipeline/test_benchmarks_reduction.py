"""The timing of the reduction: every phase and the memory of each mesh size written down."""

import csv
import subprocess
import sys
from pathlib import Path

from pipeline_support import small_scene, write_scene

BENCHMARK = Path(__file__).parents[2] / "benchmarks" / "reduction.py"


def test_a_row_for_every_size_and_number_of_modes(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "small.toml", small_scene())
    command = [sys.executable, str(BENCHMARK), "--scene", str(scene), "--out", str(tmp_path / "out")]
    done = subprocess.run(
        [*command, "--sizes", "12", "9", "--modes", "5"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    with (tmp_path / "out" / "reduction.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row["size_mm"]) for row in rows] == [12.0, 9.0]
    assert int(rows[1]["dofs"]) > int(rows[0]["dofs"])
    for row in rows:
        assert int(row["reduced"]) == 5 + 2 * 3 * 4 + 3  # modes, 2 x 2 contact nodes a side, the tip
        phases = ("mesh", "assembly", "ordering", "factorisation", "constraint modes", "fixed-interface modes")
        taken = sum(float(row[phase]) for phase in (*phases, "projection"))
        assert abs(taken - float(row["total"])) < 0.01
        assert 0.05 < float(row["memory_gb"]) < 4.0
    assert (tmp_path / "out" / "reduction.md").read_text() in done.stdout

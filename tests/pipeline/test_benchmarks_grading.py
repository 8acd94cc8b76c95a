"""The benchmark of graded meshes: a row for every mesh, errors against the reference that it says."""

import csv
import subprocess
import sys
from pathlib import Path

from pipeline_support import small_scene, write_scene

BENCHMARK = Path(__file__).parents[2] / "benchmarks" / "grading.py"


def test_a_row_for_every_size_and_grading(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "small.toml", small_scene(mesh__element="hex20"))
    command = [sys.executable, str(BENCHMARK), "--scene", str(scene), "--out", str(tmp_path / "out")]
    command += ["--sizes", "15", "9", "--gradings", "1", "4", "--reference", "9"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    with (tmp_path / "out" / "grading.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(float(row["grading"]), float(row["size_mm"])) for row in rows] == [(1, 15), (1, 9), (4, 15), (4, 9)]
    for row in rows[:3]:
        errors = [abs(float(row[f"mode_{k}"])) for k in range(1, 11)]
        assert 0.0 < float(row["rms"]) <= max(errors) == float(row["largest"]) < 0.2
        assert 0.0 < float(row["tip"]) < 0.5
    assert float(rows[3]["largest"]) == float(rows[3]["tip"]) == 0.0  # the reference itself
    assert (tmp_path / "out" / "grading.md").read_text() in done.stdout

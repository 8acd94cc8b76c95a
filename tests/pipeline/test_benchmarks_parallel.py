"""Worker processes: every number of them solves all curves."""

import csv
from pathlib import Path

import pytest
from pipeline_support import small_scene, write_scene

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


def test_a_row_for_each_number_of_processes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import parallel

    scene = write_scene(tmp_path / "small.toml", small_scene())
    command = ["--scene", str(scene), "--curves", "2", "--jobs", "1", "2", "--out", str(tmp_path / "out")]
    assert parallel.main(command) == 0
    with (tmp_path / "out" / "parallel.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["curves"], row["processes"], row["complete"]) for row in rows] == [("2", "1", "2"), ("2", "2", "2")]
    assert float(rows[0]["speed-up"]) == 1.0
    assert float(rows[1]["speed-up"]) == pytest.approx(
        float(rows[0]["seconds"]) / float(rows[1]["seconds"]), rel=0.05, abs=0.01
    )

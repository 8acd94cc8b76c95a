"""Natural frequencies by different programs: a row for each that is installed, and they agree."""

import csv
from pathlib import Path

import pytest
from pipeline_support import small_scene, write_scene

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


def test_the_programs_agree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import peers_linear

    scene = write_scene(tmp_path / "small.toml", small_scene(mesh__element="hex20"))
    assert peers_linear.main(["--scene", str(scene), "--sizes", "12", "--out", str(tmp_path / "out")]) == 0
    with (tmp_path / "out" / "linear.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["program"] for row in rows[:2]] == ["this program, CHOLMOD", "this program, SciPy alone"]
    assert all(float(row["off"]) < 1e-6 for row in rows)
    assert len({row["dofs"] for row in rows}) == 1

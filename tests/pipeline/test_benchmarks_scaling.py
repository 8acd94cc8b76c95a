"""Time and memory against contact nodes and harmonics: a row for each, exponents, table and figure."""

import csv
from pathlib import Path
from typing import Any

import pytest
from pipeline_support import small_scene, write_scene

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def scaling(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import scaling

    return scaling


def test_tables_and_figure(scaling: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = write_scene(tmp_path / "small.toml", small_scene())
    monkeypatch.setattr(scaling, "_in_a_process", scaling.measure)  # the processes are there for the memory only
    command = ["--scene", str(scene), "--out", str(tmp_path / "out"), "--grids", "1", "2", "--harmonics", "1", "2"]
    assert scaling.main(command) == 0
    with (tmp_path / "out" / "scaling.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["contact nodes"], row["harmonics"]) for row in rows] == [
        ("1", "1"),
        ("4", "1"),
        ("1", "1"),
        ("1", "2"),
    ]
    assert [int(row["reduced dofs"]) for row in rows[:2]] == [6 + 3 + 6, 24 + 3 + 6]
    assert all(float(row["ms a point"]) > 0.0 and int(row["points"]) > 1 for row in rows)
    text = (tmp_path / "out" / "scaling.md").read_text()
    assert "Exponents over the larger half" in text
    assert (tmp_path / "out" / "scaling.png").stat().st_size > 10_000


def test_exponents(scaling: Any) -> None:
    assert scaling.exponent([1.0, 2.0, 4.0], [3.0, 12.0, 48.0]) == pytest.approx(2.0)
    assert scaling.exponent([1, 10, 100, 1000], [5.0, 5.0, 5.0, 50.0]) == pytest.approx(0.5)

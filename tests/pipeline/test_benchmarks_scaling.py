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
    assert "Where it stops being practical" in text
    assert (tmp_path / "out" / "scaling.png").stat().st_size > 10_000


def test_exponents(scaling: Any) -> None:
    from scaling_report import exponent, power_law

    assert power_law([1.0, 2.0, 4.0], [3.0, 12.0, 48.0]) == pytest.approx((3.0, 2.0))
    assert exponent([1, 10, 100, 1000], [5.0, 5.0, 5.0, 50.0]) == pytest.approx(0.5)


def test_where_sizes_stop_being_practical(scaling: Any, tmp_path: Path) -> None:
    from scaling_limits import measured_limits

    folder = tmp_path / "reduction"
    folder.mkdir()
    (folder / "reduction.csv").write_text("dofs,total,memory_gb,backend\n1000,6,0.24,a\n10000,60,2.4,a\n")
    by_nodes = [
        {"contact nodes": n, "model s": n, "ms a point": 0.06 * n**2, "memory GB": 0.1 * n} for n in (1, 10, 100)
    ]
    by_harmonics = [{"contact nodes": 9, "harmonics": h, "ms a point": 6.0 * h} for h in (1, 10)]
    limits = measured_limits(tmp_path, by_nodes, by_harmonics)
    found = [(limit.size, round(limit.reached_at)) for limit in limits]
    assert found == [
        ("dofs", 100_000),
        ("dofs", 100_000),
        ("contact nodes", 600),
        ("contact nodes", 240),
        ("contact nodes", 100),
        ("harmonics", 100),
    ]
    assert limits[0].row()[:6] == ("dofs", limits[0].cost, "10000", "1.00", "10 minutes", "100 000 dofs")

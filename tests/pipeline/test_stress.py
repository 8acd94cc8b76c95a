"""The stability matrix: how its cases are drawn, and a small run from the command line to its files."""

import csv
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pipeline_support import small_scene, write_scene

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def stress_cases(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import stress_cases

    return stress_cases


def test_every_level_is_equally_frequent_in_each_block(stress_cases: Any) -> None:
    cases = stress_cases.draw_cases(400, seed=3)
    for block in (cases[:200], cases[200:]):
        for factor, levels in stress_cases.LEVELS.items():
            counts = Counter(getattr(case, factor) for case in block)
            assert set(counts) == set(levels)
            assert all(abs(count - 200 / len(levels)) < 2.0 for count in counts.values()), factor
        decades = Counter(case.stiffness_decade for case in block)
        assert list(decades.values()) == [50] * 4
        stiffness = np.array([case.normal_stiffness for case in block])
        assert stiffness.min() >= 1e5
        assert stiffness.max() <= 1e9
    assert cases[:200] != cases[200:]


def test_a_case_is_known_by_seed_and_index_alone(stress_cases: Any) -> None:
    many = stress_cases.draw_cases(250, seed=3)
    assert stress_cases.draw_cases(203, seed=3) == many[:203]
    other = stress_cases.draw_cases(3, seed=4)
    assert [case.values() for case in other] != [{**case.values(), "seed": 4} for case in many[:3]]
    assert [case.index for case in many] == list(range(250))


def stress(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(BENCHMARKS / "stress.py"), *(str(argument) for argument in arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_a_run_writes_every_case_down_and_one_can_be_replayed(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "small.toml", small_scene())
    common = ("--seed", 1, "--scene", scene, "--out", tmp_path / "out")
    result = stress("--cases", 2, *common)
    assert result.returncode == 0, result.stderr
    assert "2 curves, 2 complete, 0 incomplete" in result.stdout
    assert (tmp_path / "out" / "summary.md").read_text() in result.stdout
    assert (tmp_path / "out" / "matrix.png").stat().st_size > 10_000
    with (tmp_path / "out" / "cases.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["index"] for row in rows] == ["0", "1"]
    assert all(float(row["energy_error"]) < 1e-8 and int(row["points"]) > 10 for row in rows)

    again = stress("--replay", 1, "--draw", *common)
    assert again.returncode == 0, again.stderr
    shown = dict(line.split(maxsplit=1) for line in again.stdout.splitlines() if ":" not in line)
    assert {name: shown[name] for name in ("points", "iterations", "energy_error")} == {
        name: rows[1][name] for name in ("points", "iterations", "energy_error")
    }
    assert (tmp_path / "out" / "replay_1_1.png").exists()


def test_a_case_out_of_time_is_an_incomplete_curve(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "small.toml", small_scene())
    result = stress("--cases", 1, "--limit", 0, "--scene", scene, "--out", tmp_path / "out")
    assert result.returncode == 1
    text = (tmp_path / "out" / "summary.md").read_text()
    assert "| out of time | 1 |" in text
    assert "--replay 0 --seed 1" in text
    assert "given up at" in text

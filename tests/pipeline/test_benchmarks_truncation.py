"""The benchmark of the truncation error: what it counts as bounded, and a small run to its files."""

import csv
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from pipeline_support import small_scene, write_scene

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def report(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import truncation_report

    return truncation_report


@pytest.fixture
def validation(report: Any) -> Any:
    """A result with a true error of 10 % and the estimate to be judged."""
    from stress_cases import draw_cases

    case = draw_cases(1, seed=1, hard=True)[0]
    common = {"truth_harmonics": 31, "truth_before": 1.0, "truth_of_curve": 1.0, "reference": 7}
    common |= {"curve_seconds": 2.0, "estimate_seconds": 1.0, "truth_seconds": 9.0}
    return lambda estimate: report.Validation(case, "", 100.0, 1.1, estimate, 1.0, **common)


def test_within_a_factor_of_three_is_bounded_and_unknown_is_not(report: Any, validation: Any) -> None:
    judged = {estimate: validation(estimate) for estimate in (0.033, 0.034, 0.99, 1.01, float("inf"), float("nan"))}
    assert [result.bounded for result in judged.values()] == [False, True, True, True, False, False]
    assert [result.far_over for result in judged.values()] == [False, False, False, True, False, False]
    assert [result.known for result in judged.values()] == [True, True, True, True, False, False]
    left_out = report.Validation(judged[0.033].case, "no peak")
    assert report.share_bounded([*judged.values(), left_out]) == 0.5
    text = report.report_text([*judged.values(), left_out])
    assert "at most 3 times the estimate in 3 of 6" in text
    assert "over 10 times the true error in 1; unknown in 2" in text
    assert "no peak" in text.split("## Left out")[1]


def test_a_small_run_and_one_case_of_it_again(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "small.toml", small_scene())

    def truncation(*arguments: object) -> subprocess.CompletedProcess[str]:
        common = ("--seed", 6, "--scene", scene, "--out", tmp_path / "out", "--cases", 1)
        command = [sys.executable, str(BENCHMARKS / "truncation.py"), *(str(part) for part in (*common, *arguments))]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    result = truncation()
    assert (tmp_path / "out" / "truncation.md").read_text() in result.stdout, result.stderr
    assert (tmp_path / "out" / "truncation.png").stat().st_size > 10_000
    with (tmp_path / "out" / "truncation.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["index"], row["harmonics"]) for row in rows] == [("0", "1")]
    (row,) = rows
    error = abs(float(row["height"]) / float(row["truth"]) - 1.0)
    assert float(row["error"]) == pytest.approx(error)
    assert (error <= 3.0 * float(row["estimate"]) + 1e-6) == (row["bounded"] == "True")
    assert result.returncode == (0 if row["bounded"] == "True" else 1)

    again = truncation("--replay", 0)
    shown = {name: value for name, *value in map(str.split, again.stdout.splitlines())}
    assert float(*shown["error"]) == pytest.approx(float(row["error"]))
    assert float(*shown["estimate"]) == pytest.approx(float(row["estimate"]))


def test_a_case_out_of_time_is_left_out(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "small.toml", small_scene())
    command = [sys.executable, str(BENCHMARKS / "truncation.py"), "--replay", "0", "--limit", "0"]
    command += ["--scene", str(scene), "--out", str(tmp_path / "out")]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 1
    assert "given up at" in result.stdout

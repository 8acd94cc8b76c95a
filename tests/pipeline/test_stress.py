"""The test matrix and the truncation errors of its hard cases: how they are drawn, judged and replayed."""

import csv
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


@pytest.fixture
def stress(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Runs the command line of the test matrix; its exit status."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import stress

    return lambda *arguments: stress.main([str(argument) for argument in arguments])


def test_every_case_is_recorded_and_one_can_be_replayed(
    stress: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = write_scene(tmp_path / "small.toml", small_scene())
    common = ("--seed", 19, "--scene", scene, "--out", tmp_path / "out")  # a seed of which two cases are soon solved
    assert stress("--cases", 2, *common) == 0
    assert "2 curves, 2 complete, 0 incomplete" in (tmp_path / "out" / "summary.md").read_text()
    with (tmp_path / "out" / "cases.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["index"] for row in rows] == ["0", "1"]
    assert all(float(row["energy_error"]) < 1e-8 and int(row["points"]) > 10 for row in rows)

    capsys.readouterr()
    assert stress("--replay", 1, "--draw", *common) == 0
    shown = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines() if ":" not in line)
    assert {name: shown[name] for name in ("points", "iterations", "energy_error")} == {
        name: rows[1][name] for name in ("points", "iterations", "energy_error")
    }
    assert (tmp_path / "out" / "replay_19_1.png").exists()


def test_a_case_out_of_time_is_an_incomplete_curve(stress: Any, tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "small.toml", small_scene())
    assert stress("--cases", 1, "--limit", 0, "--scene", scene, "--out", tmp_path / "out") == 1
    text = (tmp_path / "out" / "summary.md").read_text()
    assert "| out of time | 1 |" in text
    assert "--replay 0 --seed 1" in text
    assert "given up at" in text


@pytest.fixture
def truncation(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import truncation

    return truncation


def test_a_truncation_error_within_a_factor_of_three_is_bounded_and_unknown_is_not(
    truncation: Any, stress_cases: Any
) -> None:
    """True error 10 %."""
    case = stress_cases.draw_cases(1, seed=1, hard=True)[0]
    truth = truncation.Truth(1.0, 31, 1.0, 1.0, 7)
    judged = [
        truncation.Validation(case, "", 100.0, 1.1, estimate, estimate, "kept", truth, 2.0, 1.0)
        for estimate in (0.033, 0.034, 0.99, 1.01, float("inf"), float("nan"))
    ]
    assert [result.bounded for result in judged] == [False, True, True, True, False, False]
    assert [result.far_over for result in judged] == [False, False, False, True, False, False]
    assert [result.known for result in judged] == [True, True, True, True, False, False]
    results = [*judged, truncation.Validation(case, "no peak")]
    assert truncation.share_bounded(results) == 0.5
    text = truncation.report_text(results)
    assert "at most 3 times the estimate in 3 of 6" in text
    assert "over 10 times the true error in 1; unknown in 2" in text
    assert "no peak" in text.split("## Left out")[1]


def test_a_curve_out_of_time_leaves_a_truncation_error_without_a_truth(
    truncation: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = write_scene(tmp_path / "small.toml", small_scene())
    command = ["--replay", "0", "--limit", "0", "--scene", str(scene), "--out", str(tmp_path / "out")]
    assert truncation.main(command) == 1
    assert "given up at" in capsys.readouterr().out


def test_random_interfaces_are_known_by_seed_and_index_and_have_all_kinds(stress_cases: Any) -> None:
    import stress_interfaces

    cases = stress_interfaces.draw_interface_cases(60, seed=1)
    assert stress_interfaces.draw_interface_cases(3, seed=1) == cases[:3]
    drawn = [case.drawn() for case in cases]
    assert {each.kind for case in drawn for each in case.interfaces} == set(stress_interfaces.KINDS)
    assert {len(case.interfaces) for case in drawn} == {1, 2, 3}
    modal, contact, _, options = cases[0].posed()
    assert contact.n_contacts == sum(each.nodes for each in drawn[0].interfaces)
    assert options.frequency_hz[0] < options.frequency_hz[1]
    assert modal.n_blades == drawn[0].n_blades

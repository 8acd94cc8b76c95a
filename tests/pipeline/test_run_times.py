"""The table of run times before and after: which cases are timed, and what the rows read."""

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
PROCESS = BENCHMARKS / "before_after"


@pytest.fixture(scope="module")
def run_times() -> Iterator[Any]:
    """The benchmark."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(PROCESS))
        patch.syspath_prepend(str(BENCHMARKS))
        import run_times

        yield run_times


def curves(factor: float, peak: float, detached: int = 0) -> dict[str, Any]:
    """Answers of a state that takes `factor` seconds for everything."""
    used = {"wall": factor, "cpu": 2.0 * factor, "memory": 0.5}
    found = {"0 m": {"peak": peak, "worst": 2.0 * peak, "detached": detached, "complete": True, "points": 9}}
    names = ("alone", "truncation", "detached", "ring stability", "time integration")
    hard = {
        "case": 1,
        "harmonics": 7,
        "seconds": 8.0 * factor,
        "points": 1000,
        "limited": factor > 1,
        "complete": True,
    }
    sizes = [(nodes, 1) for nodes in (25, 100, 225)] + [(9, number) for number in (1, 7, 15, 31)]
    growth = [
        {"nodes": n, "harmonics": h, "unknowns": 3 * n * (2 * h + 1), "ms": factor * n**2 * h} for n, h in sizes
    ]
    auto = {"auto": 3.0, "harmonics": 5, "error": 1e-4}
    return {
        "fresh": {"whole": used, "setup": None, "compiled": 3 if factor > 1 else 0},
        "default": {"whole": used, "unchanged": used, "validate": used, "stages": {"mesh": factor}},
        "extras dummy": {"seconds": dict(zip(names, (1.0, 1.2, 1.5, 3.5, 4.0), strict=True)), "found": found},
        "auto dummy": {
            "curves": {"0 m": {**auto, "fixed": {"harmonics": 3, "seconds": 2.0}}, "1 m": {**auto, "fixed": None}}
        },
        "peers": {"cases": {name: {"ms": factor * i} for i, name in enumerate(("A1", "V1", "A5", "V5"), 1)}},
        "growth": {"rows": growth},
        "hard": {"rows": [hard]},
        "workers": {"loss": 0.25 * factor, "identical": True},
    }


def test_rows_read_the_answers_and_compare_both_states(run_times: Any) -> None:
    before, after = {"cases": curves(4.0, 1e-3)}, {"cases": curves(0.5, 1e-3) | {"pyharm": {"A1": 40.0, "V1": 120.0}}}
    rows = {row["what"]: row for row in run_times.table(before, after)}
    default = rows["default scene from nothing"]
    assert (default["before"], default["after"], default["times better"]) == ("4 (8)", "0.5 (1)", "8 (8)")
    assert default["reached"] == "yes"
    compiled = rows["kernels that the run on the fresh clone compiled"]
    assert (compiled["before"], compiled["after"], compiled["reached"]) == ("3", "0", "yes")
    assert rows["all extras over curves alone, dummy"]["after"] == "4"
    assert rows["all extras over curves alone, dummy"]["reached"] == "no"
    assert rows['"auto" over the cheapest fixed H, largest']["after"] == "1.5"  # of the curve that has a fixed H
    assert rows["peers' problem, a point, H = 1"]["before"] == "8"  # the slower of both problems
    beside = rows["the same beside pyHarm, the least of five problems"]
    assert (beside["before"], beside["after"], beside["times better"], beside["reached"]) == ("10", "80", "8", "no")
    assert rows["a point with 9 nodes, H = 31"]["after"] == f"{0.5 * 81 * 31:.3g}"
    assert rows["the hard corner, a curve"]["before"] == ">= 32"
    assert rows["the hard corner, H = 7, median point"]["after"] == "4"
    assert rows["a sweep of 8 on 2 cores, lost to the pool"]["after"] == "12.5"
    assert rows["largest memory of a run, default scene"]["reached"] == "yes"  # no more than before
    assert rows["484 000 dofs to reduced model"] | {"what": "", "unit": "", "target": ""} == {
        **dict.fromkeys(("what", "unit", "target"), ""),
        **dict.fromkeys(("before", "after", "times better", "reached"), "-"),
    }


def test_the_report_says_exponents_peers_and_changed_answers(run_times: Any) -> None:
    before = {"cases": curves(4.0, 1.0e-3), "failures": {}}
    before["cases"]["hard"]["rows"].append({"case": 2, "harmonics": 7, "seconds": 1e9, "points": 1, "limited": False})
    before["measured"] = {"hard": {"commit": "1b0", "date": "2026-01-02", "load": 0.25}}
    solved = curves(1.0, 1.001e-3, detached=1) | {"pyharm": {"A1": 100.0}}
    after = {"cases": solved, "failures": {"stiff": "over 9 s"}}
    text = run_times.report(before, after)
    assert "| A1 | 100 | 4 | 1 | 25 | 100 |" in text
    assert "| the hard corner, a curve | s | >= 32 | 8 |" in text  # the case that both have
    assert "before: commit 1b0; date 2026-01-02; -; load at most 0.2" in text
    assert "| default | before | 4.00 | 0.00 |" in text
    assert "| dummy, 0 m | after | 5 | 1.0e-04 | 3 | 3 | 2 | 1.5 |" in text
    assert "| ms a point over contact nodes, H = 1 | 2.00 | 2.00 |" in text
    assert "| ms a point over harmonics, 9 nodes | 1.00 | 1.00 |" in text
    assert "| extras dummy | 1 | 1.0e-03 | 1.0e-03 | 1 |" in text
    assert "| dummy | after | 1 | 0.20 | 0.30 | 2.00 | 0.50 | 4 | 4 |" in text
    assert "**Not measured after: stiff: over 9 s**" in text


def test_a_case_runs_on_the_state_that_is_named(run_times: Any, tmp_path: Path) -> None:
    """The processes import the benchmarks and packages of the state, not those beside them."""
    from before_after.state import CaseError, State

    state = State(tmp_path)
    (tmp_path / "benchmarks").mkdir()
    modules = {"problems": "class CurveProblem: ...\ncurve_problem = scene_with = None", "rom": "", "scaling": ""}
    modules["peers"] = "CASES, TOLERANCE = {'A1': ('A', 1)}, 1e-9"
    modules["peers_programs"] = (
        "from types import SimpleNamespace as S\n"
        "def Request(*values, **_): return values\n"
        "def answer(request): return S(curve=S(points=10), timed=[S(cpu=0.02)] * 3)\n"
    )
    for name, text in modules.items():
        (tmp_path / "benchmarks" / f"{name}.py").write_text(text)
    found = state.measured("peers", tmp_path / "models", 60.0, cases=["A1"])
    assert found == {"cases": {"A1": {"ms": pytest.approx(2.0), "points": 10}}}
    with pytest.raises(CaseError, match="no_such_case"):
        state.measured("no_such_case", tmp_path / "models", 60.0)


def test_pyharm_takes_as_many_points_as_this_program(
    run_times: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A stand-in for its environment answers with the points that it is asked for."""
    from before_after import pyharm

    ours = {"A1": {"ms": 0.5, "points": 79}}
    monkeypatch.setattr(pyharm, "ENVIRONMENT", tmp_path)
    assert pyharm.pyharm_points(ours, tmp_path) == {}
    python = tmp_path / "bin" / "python"
    python.parent.mkdir()
    asked = "import json, sys; asked = json.loads(sys.argv[2]); assert asked['variant'] == 'Jenkins x'"
    said = "print(json.dumps({'timed': [[9.0, 7.9]], 'curve': {'points': asked['points']}}))"
    python.write_text(f"#!{sys.executable}\n{asked}; {said}\n")
    python.chmod(0o755)
    assert pyharm.pyharm_points(ours, tmp_path) == {"A1": pytest.approx(100.0)}


def test_cases_are_chosen_by_the_beginning_of_their_names(run_times: Any) -> None:
    assert run_times.chosen(["extras", "stiff"], dear=False)[-1] == "stiff"
    assert run_times.chosen(["extras"], dear=False, without=["extras f"]) == ["extras dummy"]
    assert "large" not in run_times.chosen(None, dear=False)
    assert "large" in run_times.chosen(None, dear=True)
    with pytest.raises(SystemExit, match="no case begins with x"):
        run_times.chosen(["x"], dear=False)


def test_the_stored_state_before_can_be_shown(run_times: Any, tmp_path: Path) -> None:
    stored = json.loads(run_times.BEFORE.read_text())
    assert stored["commit"].startswith("1b0eb4f")
    assert run_times.main(["--report", "--out", str(tmp_path)]) == 0
    text = (tmp_path / "run_times.md").read_text()
    assert "| default scene from nothing | s |" in text
    assert (tmp_path / "run_times.csv").exists()

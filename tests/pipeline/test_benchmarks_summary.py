"""The table of the README comes from the tables of the benchmarks; the family of curves that is one line of it."""

import csv
import json
from pathlib import Path
from typing import Any

import pytest
from pipeline_support import small_scene, write_scene

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def on_path(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))


def write(path: Path, rows: list[dict[str, Any]]) -> None:
    path.parent.mkdir(parents=True)
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


@pytest.mark.usefixtures("on_path")
def test_what_was_measured_is_said_and_nothing_else(tmp_path: Path) -> None:
    from work_precision.summary import summary

    assert len(summary(tmp_path).splitlines()) == 2  # nothing measured, only the head of the table
    stages = dict.fromkeys(("mesh", "assemble"), "ran")
    runs = [
        {"change": name, "seconds": 1.234, **stages} for name in ("nothing there yet, x.toml", "force", "nothing")
    ]
    write(tmp_path / "skipping" / "skipping.csv", runs)
    rows = [{"curves": 4, "processes": n, "seconds": 8 / n, "speed-up": n} for n in (1, 2)]
    write(tmp_path / "parallel" / "parallel.csv", rows)
    (tmp_path / "peers").mkdir()
    row = {"case": "V5", "program": "shroud", "variant": "exact", "ms_a_point": [3.0, 2.0], "faster": [70.0, 81.4]}
    other = {**row, "program": "pyHarm"}
    (tmp_path / "peers" / "peers.json").write_text(json.dumps({"rows": [row, other]}))
    text = summary(tmp_path)
    assert len(text.splitlines()) == 2 + 2 + 1 + 1
    assert "| 1.23 s |" in text.replace("1.2 s", "1.23 s")
    assert "variable normal load, H = 5" in text
    assert "| 2 ms, 81 times faster than pyHarm |" in text
    assert "4 curves in 2 processes" in text
    assert "| 2 times as fast as in one |" in text


@pytest.mark.usefixtures("on_path")
def test_a_block_of_the_readme_is_replaced(tmp_path: Path) -> None:
    from work_precision.document import with_block

    readme = (BENCHMARKS.parent / "README.md").read_text()
    changed = with_block(readme, "summary", "new\n")
    before, _, rest = changed.partition("<!-- bench: summary -->\n")
    assert rest.startswith("new\n<!-- end -->\n")
    assert readme.startswith(before)
    assert readme.endswith(rest.partition("<!-- end -->\n")[2])


@pytest.mark.usefixtures("on_path")
def test_a_family(tmp_path: Path) -> None:
    import family

    scene = write_scene(tmp_path / "small.toml", small_scene())
    out = tmp_path / "bench" / "family"
    command = ["--scene", str(scene), "--interferences", "-0.00001", "0.00001", "--repeats", "1", "--out", str(out)]
    assert family.main(command) == 0
    with (out / "family.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["what"] for row in rows] == list(family.VARIANTS)
    assert all(row["complete"] == "2" and float(row["ms a point, median"]) > 0.0 for row in rows)

"""What a change makes run again: the scenes changed as said, the stages read from the summaries."""

import csv
import tomllib
from pathlib import Path
from typing import Any

import pytest
from pipeline_support import small_scene, write_scene

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def skipping(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import skipping

    return skipping


def test_a_change_is_the_only_one(skipping: Any) -> None:
    scene = small_scene(sweep={"contact.interference": [1e-5, 2e-5]})
    for change in skipping.CHANGES:
        changed = change.of(scene)
        assert changed != scene
        table, _, key = change.key.partition(".")
        if change.key == "contact.interference":
            assert changed["sweep"]["contact.interference"][1] == 2e-5
            assert changed["contact"] == scene["contact"]
        else:
            assert {k: v for k, v in changed[table].items() if k != key} == {
                k: v for k, v in scene.get(table, {}).items() if k != key
            }
        assert tomllib.loads(skipping.to_toml(changed)) == changed


def test_the_tables(skipping: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    changes = [change for change in skipping.CHANGES if change.key in ("contact.friction", "rom.modes")]
    monkeypatch.setattr(skipping, "CHANGES", changes)
    scene = write_scene(tmp_path / "small.toml", small_scene())
    assert skipping.main(["--scene", str(scene), "--repeats", "1", "--out", str(tmp_path / "out")]) == 0
    with (tmp_path / "out" / "skipping.csv").open() as file:
        first, again, friction, modes = csv.DictReader(file)
    assert {first[stage] for stage in ("mesh", "assemble", "reduce", "respond", "figures")} == {"ran"}
    assert {again[stage] for stage in ("mesh", "assemble", "reduce", "respond", "figures")} == {"reused"}
    assert (friction["reduce"], friction["respond"], friction["render"]) == ("reused", "ran", "skipped")
    assert (modes["assemble"], modes["reduce"]) == ("reused", "ran")
    with (tmp_path / "out" / "commands.csv").open() as file:
        assert [row["command"] for row in csv.DictReader(file)] == [name for name, _ in skipping.COMMANDS]
    assert "What a command costs" in (tmp_path / "out" / "skipping.md").read_text()

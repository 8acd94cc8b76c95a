"""Studies of a run: computed once, published, removed with the curves that they are about."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from pipeline_support import ground_scene, write_ground_model

from pipeline import run_scene
from pipeline.results.results import Results


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The output folder of a run with a study."""
    folder = tmp_path_factory.mktemp("studies")
    run(folder / "out")
    return folder


def run(
    out: Path, over: tuple[float, float] | None = (0.2, 4.0), until: str | None = None, **contact: Any
) -> Results:
    """A mass on springs that rubs, with the optimum of its preload."""
    scene = ground_scene(**contact)
    scene["response"]["harmonics"] = 1
    if over is not None:
        scene["optimum"] = {"over": {"contact.preload": list(over)}}
    rom = out.parent / "ground.h5"
    if not rom.exists():
        write_ground_model(rom)
    return run_scene(scene, out, rom=rom, until=until)


def test_a_study_is_computed_once_and_published(done: Path) -> None:
    again = run(done / "out", until="study")
    assert again.complete
    assert again.summary["stages"]["study"]["status"] == "reused"
    written = json.loads((done / "out" / "optimum.json").read_text())
    assert again.studies["optimum"] == written
    assert written["ranges"] == {"contact.preload": [0.2, 4.0]}


def test_a_study_is_removed_with_the_curve_that_it_is_about(done: Path) -> None:
    out = done / "other"
    shutil.copytree(done / "out", out)
    assert run(out, over=None, until="respond").studies == {}
    assert (out / "optimum.json").is_file()  # still about the first curve of the scene
    run(out, over=None, until="respond", friction=[0.3, 0.3, 0.3])
    assert not (out / "optimum.json").exists()

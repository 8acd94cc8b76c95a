"""One small run that the tests of a worker share; tests that change it work on a copy."""

import shutil
from pathlib import Path

import pytest
from pipeline_support import shroud, small_scene, write_scene


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Output folder of the small scene run to its figures, over two interferences."""
    folder = tmp_path_factory.mktemp("finished")
    scene = write_scene(folder / "small.toml", small_scene(sweep={"contact.interference": [1e-5, 1e-3]}))
    status, _, error = shroud("run", scene, "--out", folder / "out", "--quiet")
    assert (status, error) == (0, "")
    return folder / "out"


@pytest.fixture
def copied(finished: Path, tmp_path: Path) -> Path:
    """A copy of the finished run to do things to."""
    return Path(shutil.copytree(finished, tmp_path / "out"))

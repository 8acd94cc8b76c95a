"""One small run that the tests of a worker share, copies of it to change, and figures of one pixel for most tests."""

import io
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pipeline_support import drawing, shroud, small_scene, write_scene

import pipeline.figures.style
import pipeline.new_scene.new_from_mesh
import pipeline.report.charts

SVG = b'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1 1"/>'


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Output folder of the small scene run to its figures, which are drawn, over two interferences."""
    folder = tmp_path_factory.mktemp("finished")
    scene = write_scene(folder / "small.toml", small_scene(sweep={"contact.interference": [1e-5, 1e-3]}))
    with drawing():
        status, _, error = shroud("run", scene, "--out", folder / "out", "--quiet")
    assert (status, error) == (0, "")
    return folder / "out"


@pytest.fixture
def copied(finished: Path, tmp_path: Path) -> Path:
    """A copy of the finished run to do things to."""
    return Path(shutil.copytree(finished, tmp_path / "out"))


@pytest.fixture(scope="module", autouse=True)
def blank_figures() -> Iterator[pytest.MonkeyPatch]:
    """Figures are made but not drawn in this process: laying out and drawing takes longer than many a run."""
    from PIL import Image

    Image.new("RGB", (1, 1)).save(pixel := io.BytesIO(), format="png")
    kinds = {"png": pixel.getvalue(), "svg": SVG}

    def blank(_: Any, form: str) -> bytes:
        return kinds[form]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pipeline.figures.style, "drawn", blank)
        patch.setattr(pipeline.report.charts, "drawn", blank)
        yield patch


@pytest.fixture
def drawn_figures() -> Iterator[None]:
    """Figures are drawn in a test that asks for this."""
    with drawing():
        yield

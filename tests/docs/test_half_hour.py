"""The first half hour: every command of it, in a copy of the sources whose scenes are small ones.

Then the README's Python and the recipe for results in Python, on what that has left.
"""

import os
import re
import shutil
import sys
from pathlib import Path

import pytest
from numba.core import caching

from docs.execute import HALF_HOUR, check, run_page

ROOT = Path(__file__).parents[2]
QUICK = {
    r"^size = 0\.004 ": "size = 0.009 ",
    r"^modes = 30 ": "modes = 6 ",
    r'^harmonics = "auto" ': "harmonics = 3 ",
    r'^"contact.interference" = .*\]': '"contact.interference" = [-250e-6, 5e-6, 400e-6]',
    r"^\[render\].*\nmodes = .*\n": "",
    r"^tolerance = 0\.01 ": 'tolerance = 0.01\nstability = "folds"\ntruncation = false ',
}


def take_kernels_over(copy: Path) -> None:
    """Let the copy find the kernels that are compiled: numba keeps them by the folder of their source.

    Where they are kept elsewhere, or differently, the copy compiles its own, which takes 20 s.
    """
    locator = caching._CacheLocator.get_suitable_cache_subpath  # type: ignore[attr-defined]
    for source in {path.parent for path in (ROOT / "nonlinear").rglob("*.py")}:
        file = source.relative_to(ROOT) / "__init__.py"
        for folder in copy.glob(f"nonlinear/__pycache__/compiled-*/{locator(str(ROOT / file))}"):
            folder.rename(folder.with_name(locator(str(copy / file))))


@pytest.fixture
def copied_repository(tmp_path: Path) -> Path:
    """The sources with small scenes, an environment that is set up, and nothing of earlier runs."""
    ignored = shutil.ignore_patterns(".venv", ".git", "out", "build", "*.egg-info", "*_cache", "tests")
    copy = Path(shutil.copytree(ROOT, tmp_path / "shroud", ignore=ignored))
    (copy / ".venv").symlink_to(sys.prefix)
    for name in ("pyproject.toml", "requirements.lock"):
        os.utime(copy / name, (0, 0))  # older than the environment: there is nothing to set up
    for scene in (copy / "scenes" / "dummy.toml", copy / "pipeline" / "scene" / "template" / "scene.toml"):
        text = scene.read_text()
        for old, new in QUICK.items():
            text, count = re.subn(old, new, text, count=1, flags=re.MULTILINE)
            assert count == 1, old
        scene.write_text(text)
    take_kernels_over(copy)
    templates = copy / "pipeline" / "new_scene" / "templates.py"
    text = templates.read_text()
    assert 'PRESET = "standard"' in text
    templates.write_text(text.replace('PRESET = "standard"', 'PRESET = "draft"'))
    return copy


@pytest.mark.long
def test_the_first_half_hour(copied_repository: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(copied_repository))  # the copy's own packages and templates
    pieces = run_page(HALF_HOUR, copied_repository)
    assert len(pieces) == 10
    check(HALF_HOUR, pieces, numbers=False)
    for name in ("figures/response.png", "figures/peaks.png"):
        assert (copied_repository / "out" / "dummy" / name).is_file()
    assert (copied_repository / "out" / "mine" / "report.html").is_file()
    (said,) = run_page(ROOT / "README.md", copied_repository)
    assert re.fullmatch(
        r"(v0 .* m: peak .* Hz\n(  but .* m can occur.*\n)?){3}lowest: .*interference.*\n", said.printed
    )
    run_page(ROOT / "docs" / "howto.md", copied_repository)
    assert (copied_repository / "one_curve.png").is_file()
    assert "angle = 180.0" in (copied_repository / "scenes" / "mine" / "scene.toml").read_text()

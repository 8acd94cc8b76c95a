"""The cache of compiled kernels: which sources are in its key."""

from pathlib import Path

import pytest

from nonlinear.contact import numba_cache
from nonlinear.contact.numba_cache import source_digest

KERNEL = "from nonlinear.contact.numba_cache import compiled\nfrom nonlinear.data.types import SIZE\n"
FILES = {
    "contact/kernel.py": KERNEL,
    "stability/deeper/kernel.py": KERNEL,
    "data/types.py": "from nonlinear.data.constants import SIZE\n",
    "data/constants.py": "SIZE = 1\n",
}


@pytest.fixture
def package(tmp_path: Path) -> Path:
    for name, text in {**FILES, "data/figure.py": "import math\n"}.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


@pytest.mark.parametrize("name", FILES)
def test_a_kernel_in_any_folder_and_what_it_imports_change_the_key(package: Path, name: str) -> None:
    before = source_digest(package)
    assert source_digest(package) == before
    (package / name).write_text(FILES[name] + "# changed\n")
    assert source_digest(package) != before


def test_a_new_kernel_changes_the_key_and_other_files_do_not(package: Path) -> None:
    before = source_digest(package)
    (package / "data/figure.py").write_text("import cmath\n")
    assert source_digest(package) == before
    (package / "stability/deeper/another.py").write_text(KERNEL)
    assert source_digest(package) != before


def test_all_kernels_of_the_package_are_found() -> None:
    """Every file that uses a compiling decorator imports it in the form that the key looks for."""
    root = Path(numba_cache.__file__).parent.parent
    users = [p for p in root.rglob("*.py") if any(f"\n@{name}\n" in p.read_text() for name in ("compiled", "lean"))]
    assert {"contact", "stability"} <= {p.parent.name for p in users}
    for path in users:
        assert "from nonlinear.contact.numba_cache import" in path.read_text(), path

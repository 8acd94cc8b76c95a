"""gmsh uses no file of the user's or the system's, and the mesh depends on none."""

import os
import subprocess
import sys
from pathlib import Path

from test_determinism import CASES, digest

from geometry import build_sector

PROJECT = Path(__file__).parents[2]
SYSTEM = Path("/etc/fltk")
HERE = str(Path(__file__).parent)
PROGRAM = (
    "import sys; sys.path[:0] = sys.argv[1:];"
    "from test_determinism import CASES, digest; from geometry import build_sector;"
    "import os; before = dict(os.environ);"
    "print(digest(build_sector(*CASES['figure'])));"
    "assert dict(os.environ) == before"
)
# Settings that gmsh, FLTK and PETSc look for. As pipes: a reader of one would wait for ever.
SETTINGS = (".gmshrc", ".gmsh-options", ".petscrc", ".fltk/fltk.org/fltk.prefs", ".config/fltk.org/fltk.prefs")


def digest_with(home: Path, folder: Path) -> str:
    """Of a mesh built in a process of its own, with the given home and working folder."""
    environment = {**os.environ, "HOME": str(home), "XDG_CONFIG_HOME": str(home / ".config")}
    command = [sys.executable, "-c", PROGRAM, HERE, str(PROJECT)]
    run = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=True, timeout=30)
    assert run.stderr == ""
    return run.stdout.strip()


def times(folder: Path) -> dict[str, tuple[int, int]]:
    """Modification and status times of a folder and all below it."""
    found = [folder, *folder.rglob("*")] if folder.exists() else []
    return {str(path): (path.lstat().st_mtime_ns, path.lstat().st_ctime_ns) for path in found}


def test_nothing_is_written(tmp_path: Path) -> None:
    """Neither in the home nor in the working folder nor, as root, in /etc."""
    home, folder = tmp_path / "home", tmp_path / "work"
    home.mkdir()
    folder.mkdir()
    before = times(tmp_path), times(SYSTEM)
    digest_with(home, folder)
    assert (times(tmp_path), times(SYSTEM)) == before


def test_settings_of_the_user_are_not_read(tmp_path: Path) -> None:
    home, folder = tmp_path / "home", tmp_path / "work"
    for place in (home, folder):
        for name in SETTINGS:
            (place / name).parent.mkdir(parents=True, exist_ok=True)
            os.mkfifo(place / name)
    assert digest_with(home, folder) == digest(build_sector(*CASES["figure"]))

"""System libraries that the wheels need: found missing, installed where that is allowed, otherwise named.

Runs before the virtual environment exists, so it uses nothing but the standard library:
`python3 pipeline/bootstrap.py`. With `--test-programs` it brings the programs that some tests compare with; without
them these tests are skipped.
"""

import ctypes
import importlib.util
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence

# Debian package -> shared libraries of which any one will do; gmsh needs all but the last, rendering needs libegl1.
PACKAGES: dict[str, tuple[str, ...]] = {
    "libglu1-mesa": ("libGLU.so.1",),
    "libgl1": ("libGL.so.1",),
    "libxrender1": ("libXrender.so.1",),
    "libxcursor1": ("libXcursor.so.1",),
    "libxft2": ("libXft.so.2",),
    "libxinerama1": ("libXinerama.so.1",),
    "libgomp1": ("libgomp.so.1",),
    "libegl1": ("libEGL.so.1", "libOSMesa.so.8", "libOSMesa.so.6"),
}

# Debian package -> programs of which any one will do.
TEST_PROGRAMS: dict[str, tuple[str, ...]] = {
    "calculix-ccx": ("ccx",),
    "chromium": ("chromium", "chromium-browser", "google-chrome"),
}


def missing_test_programs() -> list[str]:
    """Debian packages of the test programs that are not on the path."""
    return [package for package, names in TEST_PROGRAMS.items() if not any(map(shutil.which, names))]


def missing_packages() -> list[str]:
    """Debian packages whose libraries cannot be loaded, and python3-venv where Python came without it."""
    missing = [package for package, names in PACKAGES.items() if not any(_loads(name) for name in names)]
    if importlib.util.find_spec("ensurepip") is None:
        missing.append("python3-venv")
    return missing


def install_commands(packages: Sequence[str]) -> list[list[str]]:
    """The apt-get commands that install the packages, as root or through sudo."""
    rights = [] if _is_root() else ["sudo"]
    quiet = ["apt-get", "-qq"]
    return [
        [*rights, *quiet, "update"],
        [*rights, *quiet, "install", "-y", "--no-install-recommends", *packages],
    ]


def main(arguments: Sequence[str] = ()) -> int:
    """Install what is missing; 0 if nothing is missing in the end, otherwise 1 and the command that mends it."""
    return bring(missing_test_programs if "--test-programs" in arguments else missing_packages)


def bring(look: Callable[[], list[str]]) -> int:
    """Install the packages that `look` finds missing; 0 if it finds none in the end, otherwise 1 and a command."""
    missing = look()
    if not missing:
        return 0
    commands = install_commands(missing)
    print(f"missing system packages: {' '.join(missing)}", file=sys.stderr)
    if shutil.which("apt-get") and (_is_root() or _sudo_without_password()):
        for command in commands:
            if subprocess.run(
                command, env={**os.environ, "DEBIAN_FRONTEND": "noninteractive"}, check=False
            ).returncode:
                break
        missing = look()
        if not missing:
            return 0
    by_hand = " && ".join(
        " ".join(part for part in command if part != "-qq") for command in install_commands(missing)
    )
    print(f"install them with: {by_hand}", file=sys.stderr)
    return 1


def _loads(name: str) -> bool:
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True


def _is_root() -> bool:
    return os.geteuid() == 0


def _sudo_without_password() -> bool:
    if shutil.which("sudo") is None:
        return False
    return subprocess.run(["sudo", "-n", "true"], capture_output=True, check=False).returncode == 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

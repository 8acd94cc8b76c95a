"""Versions of the libraries: `lock` prints the exact ones of this environment, `lowest` the lowest of pyproject.toml.

Both are constraints for `pip install -c`; `make lock`, `make test-lowest` and `make test-newest` use them.
"""

from __future__ import annotations

import sys
import tomllib
from importlib.metadata import distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

PROJECT = Path(__file__).resolve().parents[1] / "pyproject.toml"
HEADER = "# Exact versions of all libraries, theirs included: `make setup` installs these, `make lock` renews them."


def required(extras: bool = True) -> list[Requirement]:
    """What pyproject.toml asks for; without `extras` the tools of tests and site are left out."""
    project = tomllib.loads(PROJECT.read_text())["project"]
    optional = project["optional-dependencies"]
    names = [*project["dependencies"]]
    names += [name for extra in optional if extras or extra not in ("dev", "docs") for name in optional[extra]]
    return [Requirement(name) for name in names]


def lowest() -> list[str]:
    """Constraints to the lowest version of each range, development tools excepted."""
    bounds = ((entry.name, spec) for entry in required(extras=False) for spec in entry.specifier)
    return [f"{name}=={bound.version}" for name, bound in bounds if bound.operator == ">="]


def locked() -> list[str]:
    """Name and version of every library that pyproject.toml asks for, directly or not, as installed here.

    Raises
    ------
    PackageNotFoundError
        A library is not installed.
    """
    waiting, seen, versions = required(), set(), {}
    while waiting:
        entry = waiting.pop()
        name, extras = canonicalize_name(entry.name), {"", *entry.extras}
        if (name, *sorted(extras)) in seen:
            continue
        seen.add((name, *sorted(extras)))
        found = distribution(name)
        versions[name] = found.version
        for needed in map(Requirement, found.requires or ()):
            if needed.marker is None or any(needed.marker.evaluate({"extra": extra}) for extra in extras):
                waiting.append(needed)
    return [f"{name}=={versions[name]}" for name in sorted(versions)]


if __name__ == "__main__":
    print("\n".join([HEADER, *locked()] if sys.argv[1:] == ["lock"] else lowest()))

"""Prints the lowest versions of the libraries of pyproject.toml, as constraints of `make test-lowest`."""

from __future__ import annotations

import tomllib
from pathlib import Path

from packaging.requirements import Requirement

PROJECT = Path(__file__).resolve().parents[1] / "pyproject.toml"


def lowest() -> list[str]:
    """Constraints to the lowest version of each range; tools of tests and site are left out."""
    project = tomllib.loads(PROJECT.read_text())["project"]
    optional = project["optional-dependencies"]
    names = [*project["dependencies"]]
    names += [name for extra in optional if extra not in ("dev", "docs") for name in optional[extra]]
    bounds = ((entry.name, spec) for entry in map(Requirement, names) for spec in entry.specifier)
    return [f"{name}=={bound.version}" for name, bound in bounds if bound.operator == ">="]


if __name__ == "__main__":
    print("\n".join(lowest()))

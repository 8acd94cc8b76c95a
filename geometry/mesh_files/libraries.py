"""Libraries that read mesh files, some of them optional."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import Any

from geometry.errors import MeshFileError


def optional_library(name: str, path: object) -> Any:
    """A module of the extra "meshes"."""
    if find_spec(name) is None:
        package = name.replace("_", "-")
        raise MeshFileError(path, f"needs the package {package}: pip install 'shroud[meshes]', or another format")
    return import_module(name)


def vtk_library() -> Any:
    """meshlane, or else meshio, which has no 15-node wedges."""
    return import_module("meshlane" if find_spec("meshlane") is not None else "meshio")

"""Nastran."""

from __future__ import annotations

from pathlib import Path

from geometry.errors import MeshFileError
from geometry.mesh_files.file_mesh import FileMesh


def read_nastran(path: str | Path) -> FileMesh:
    raise MeshFileError(path, "not yet")

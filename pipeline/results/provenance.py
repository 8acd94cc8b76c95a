"""Where results come from: version of the program, date, host, and the scene as it was run."""

from __future__ import annotations

import platform
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version

from pipeline.scene.reading import SceneFile


def origin() -> dict[str, str]:
    """Version, date (UTC) and host of the moment."""
    return {
        "program": f"shroud {_version()}",
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "host": platform.node(),
    }


def provenance(scene: SceneFile) -> dict[str, str]:
    """Version, date (UTC), host, name of the scene file and its text, for files that a run publishes.

    They are no inputs of a result, so nothing is computed again because of them.
    """
    return origin() | {"scene_file": scene.path.name, "scene": scene.text}


def _version() -> str:
    try:
        return version("shroud")
    except PackageNotFoundError:  # a copy of the source that is not installed
        return "of unknown version"

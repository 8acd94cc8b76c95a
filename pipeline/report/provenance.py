"""Where a page comes from: version of the program, date and host."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version


def provenance() -> str:
    """`shroud 0.1.0, 2026-11-22 20:15 UTC, on the host NAME`, of the moment in which the page is made."""
    import platform
    from datetime import UTC, datetime

    try:
        program = f"shroud {version('shroud')}"
    except PackageNotFoundError:  # run from a copy of the repository that is not installed
        program = "shroud"
    return f"{program}, {datetime.now(UTC):%Y-%m-%d %H:%M} UTC, host {platform.node() or 'unknown'}"

"""Versions of the program and of the packages that decide numbers, to be compared between machines."""

from __future__ import annotations

from pipeline.stages.cache_keys import CURVE_CODE, EXTENSION_CODE, REDUCED_MODEL_CODE
from pipeline.stages.code_fingerprint import code_versions

MODULES = "pipeline.stages.build_mesh", "pipeline.stages.build_full_model"
TRANSPORT = "distributed"  # decides no number, but two versions of it may not understand each other


def versions() -> dict[str, str]:
    """Versions by name: `program` (a hash of its source), `Python`, `processor`, and the packages."""
    return code_versions(CURVE_CODE, EXTENSION_CODE, REDUCED_MODEL_CODE, *MODULES, further=(TRANSPORT,))

"""What the numbers depend on beside the program: Python, installed libraries, the processor and its settings.

Sums are formed in another order by the kernels for another processor, so that results differ in their last digits.
"""

from __future__ import annotations

import os
import platform
import re
import sys
from collections.abc import Iterable
from functools import cache
from importlib import metadata

_DISTRIBUTIONS = {"skfem": "scikit-fem", "PIL": "pillow"}  # where the name to install is another one
_VERSION = re.compile(r"^Version: *(\S+)", re.MULTILINE)
_NEEDED = re.compile(r"^Requires-Dist: *([\w.-]+)(?!.*\bextra *==)", re.MULTILINE)
# Of a processor: what libraries choose their kernels by. Other flags come and go with updates of the system.
_IDENTITY = ("vendor_id", "cpu family", "model", "CPU implementer", "CPU part")
_ARITHMETIC = re.compile(r"(pni|s?sse|avx|amx|fma|f16c|xop|fp|neon|asimd|sve|sme(?!p)|bf16|i8mm)\w*")
# Settings of the libraries that choose other kernels or compile otherwise.
_SETTINGS = re.compile(
    r"OPENBLAS_CORETYPE|MKL_(CBWR|ENABLE_INSTRUCTIONS)|NPY_\w*CPU_FEATURES|GLIBC_TUNABLES"
    r"|NUMBA_(CPU_\w+|ENABLE_AVX|OPT|LOOP_VECTORIZE|SLP_VECTORIZE|DISABLE_JIT)"
)


@cache
def machine() -> str:
    """Python, the C library with its functions, the processor as libraries see it, and their settings, as text."""
    from rom import processor

    described = processor()
    flags = (described.get("flags") or described.get("Features") or "").split()
    parts = {
        "python": f"{sys.implementation.name} {platform.python_version()}",
        "system": f"{sys.platform} {platform.machine()} {_c_library()}",
        "processor": [described.get(name, "") for name in _IDENTITY],
        "instructions": sorted(flag for flag in flags if _ARITHMETIC.fullmatch(flag)),
        "settings": sorted(f"{name}={value}" for name, value in os.environ.items() if _SETTINGS.fullmatch(name)),
    }
    return repr(parts)


def versions(libraries: Iterable[str]) -> dict[str, str]:
    """Versions of libraries, by their import names, and of all distributions that these need; "absent" if missing."""
    found: dict[str, str] = {}
    waiting = [_DISTRIBUTIONS.get(library, library) for library in libraries]
    while waiting:
        name = _normal(waiting.pop())
        if name not in found:
            found[name], needed = _installed(name)
            waiting.extend(needed)
    return found


@cache
def _installed(name: str) -> tuple[str, tuple[str, ...]]:
    """Version of a distribution, and the names of those that it needs without its extras."""
    try:
        distribution = metadata.distribution(name)
    except metadata.PackageNotFoundError:
        return "absent", ()
    text = distribution.read_text("METADATA") or distribution.read_text("PKG-INFO") or ""
    head = text.partition("\n\n")[0]  # what follows is the description
    version = _VERSION.search(head)
    return version[1] if version else "unknown", tuple(_NEEDED.findall(head))


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def _c_library() -> str:
    try:
        return os.confstr("CS_GNU_LIBC_VERSION") or ""
    except (AttributeError, OSError, ValueError):
        return ""

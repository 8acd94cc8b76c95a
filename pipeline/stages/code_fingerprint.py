"""Fingerprint of all that computes a result: every module that its maker imports, their data files, the libraries
that these use, Python, and the machine.

The imports are read from the source text, those inside functions included, so that no list of files is kept by hand.
Imports for type checking only do not count. Reading them by regular expressions takes a few milliseconds for a
hundred modules; `ast` takes a hundred times as long. The processor counts because its kernels form sums in an order
of their own, so that results differ in their last digits.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cache
from importlib import metadata
from pathlib import Path

from pipeline.store.fingerprints import LENGTH

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
    from rom.linear_algebra.blas_kernels import processor

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


REPOSITORY = Path(__file__).resolve().parents[2]
PACKAGES = ("geometry", "rom", "nonlinear", "pipeline")
# They carry results from place to place and have no part in what is in them.
CARRIERS = ("pipeline.errors", "pipeline.process", "pipeline.store", "pipeline.executor")
_TYPE_CHECKING = re.compile(r"^if TYPE_CHECKING:\n(?:[ \t]+.*\n|\n)+", re.MULTILINE)
_IMPORT = re.compile(r"^[ \t]*(?:import ([\w., \t]+)|from ([\w.]+) import (\([^)]*\)|[^\n(]+))", re.MULTILINE)
_BY_NAME = re.compile(r"\bimport_module\(\"([\w.]+)\"\)")
_DATA = re.compile(r"__file__\)\.parent / \"([\w./-]+)\"")
_COMMENT = re.compile(r"#.*")
Import = tuple[str, str]  # module, and the name imported from it ("" for the module itself)


def imports(text: str) -> Iterator[Import]:
    """What a source text imports when it runs, at the top or in a function."""
    for modules, module, names in _IMPORT.findall(_TYPE_CHECKING.sub("", text)):
        for part in _COMMENT.sub("", modules or names).strip("()").split(","):
            if name := part.split(" as ")[0].strip():
                yield (module, name) if module else (name, "")
    if "import_module" in text:
        yield from ((name, "") for name in _BY_NAME.findall(text))


@dataclass
class SourceTree:
    """The source of the four packages under `root`, each file read once."""

    root: Path = REPOSITORY  # folder that holds the packages
    _files: dict[str, str] = field(default_factory=dict)
    _texts: dict[str, str] = field(default_factory=dict)
    _contents: dict[str, dict[str, bytes]] = field(default_factory=dict)
    _imports: dict[str, tuple[set[str], set[str]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Find the files of the packages."""
        for package in PACKAGES:
            for folder, _, names in os.walk(self.root / package):
                dotted = os.path.relpath(folder, self.root).replace(os.sep, ".")
                modules = (name.removesuffix(".py") for name in names if name.endswith(".py"))
                for name in modules:
                    place = dotted if name == "__init__" else f"{dotted}.{name}"
                    self._files[place] = os.path.join(folder, f"{name}.py")

    def fingerprint(self, *modules: str) -> str:
        """Hash of the modules, of all that they import of the four packages, of the libraries and the machine."""
        sources, libraries = self.reached(*modules)
        digest = hashlib.sha256(machine().encode())
        self._hash_sources(sources, digest.update)
        for library, version in sorted(versions(libraries).items()):
            digest.update(f"{library} {version}\n".encode())
        return digest.hexdigest()[:LENGTH]

    def versions(self, *modules: str, further: Iterable[str] = ()) -> dict[str, str]:
        """What `fingerprint` is a hash of, apart: a hash of the source, Python, the processor, each library."""
        sources, libraries = self.reached(*modules)
        digest = hashlib.sha256()
        self._hash_sources(sources, digest.update)
        processor = hashlib.sha256(machine().encode()).hexdigest()[:LENGTH]
        own = {"program": digest.hexdigest()[:LENGTH], "Python": platform.python_version(), "processor": processor}
        return own | dict(sorted(versions({*libraries, *further}).items()))

    def _hash_sources(self, sources: Iterable[str], update: Callable[[bytes], None]) -> None:
        """Hand over the text of the modules, and the data files that they read."""
        for module in sorted(sources):
            update(f"{module}\0{self._text(module)}\0".encode())
            for name, content in self._data(module).items():
                update(f"{name}\0".encode() + content + b"\0")

    def reached(self, *modules: str) -> tuple[set[str], set[str]]:
        """The modules themselves with all that they import, directly or not; and top-level names of libraries."""
        sources: set[str] = set()
        libraries: set[str] = set()
        waiting = list(modules)
        while waiting:
            module = waiting.pop()
            if module not in sources and not module.startswith(CARRIERS):
                sources.add(module)
                inner, outer = self._imported(module)
                waiting.extend(inner)
                libraries |= outer
        return sources, libraries

    def read_all(self) -> None:
        """Read all files now: later changes have no effect on the fingerprints."""
        for module in self._files:
            self._text(module)
            self._data(module)

    def _data(self, module: str) -> dict[str, bytes]:
        """Files beside a module that it reads, or all in a folder there: named after `Path(__file__).parent /`."""
        if module not in self._contents:
            found: list[Path] = []
            text = self._text(module)
            for named in _DATA.findall(text) if "__file__" in text else ():
                place = Path(self._path(module)).parent / named
                found += sorted(path for path in place.rglob("*") if path.is_file()) if place.is_dir() else [place]
            self._contents[module] = {path.name: path.read_bytes() for path in found}
        return self._contents[module]

    def _imported(self, module: str) -> tuple[set[str], set[str]]:
        """What one module imports: modules of the packages, and top-level names of libraries."""
        if module not in self._imports:
            inner, outer = set(), set()
            for imported, name in imports(self._text(module)):
                top = imported.partition(".")[0]
                if top in PACKAGES:
                    inner.add(self._defining(imported, name))
                elif top not in sys.stdlib_module_names:
                    outer.add(top)
            self._imports[module] = inner, outer
        return self._imports[module]

    def _defining(self, module: str, name: str) -> str:
        """The module that an import leads to: what is imported from a folder may be a file in it."""
        return f"{module}.{name}" if f"{module}.{name}" in self._files else module

    def _text(self, module: str) -> str:
        if module not in self._texts:
            self._texts[module] = Path(self._path(module)).read_text(encoding="utf-8")
        return self._texts[module]

    def _path(self, module: str) -> str:
        if module not in self._files:
            raise FileNotFoundError(f"no module {module} in {self.root}")
        return self._files[module]


@cache
def code_fingerprint(*modules: str) -> str:
    """Fingerprint of the code that the given modules run, as it was when this process first asked for any."""
    return _tree().fingerprint(*modules)


def code_versions(*modules: str, further: Iterable[str] = ()) -> dict[str, str]:
    """Versions of what computes the results of the given modules by name, see `SourceTree.versions`."""
    return _tree().versions(*modules, further=further)


def remember_code() -> None:
    """Take the source as it is now for all fingerprints of this process.

    A run calls this first: it may wait for its folder, and run for hours, while the program is updated.
    """
    _tree()


@cache
def _tree() -> SourceTree:
    tree = SourceTree()
    tree.read_all()
    return tree

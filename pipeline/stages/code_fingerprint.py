"""Fingerprint of the code behind a result: every module that its maker imports, and the libraries these use.

The imports are read from the source text, those inside functions included, so that no list of files is kept by hand.
Imports for type checking only do not count. Reading them by regular expressions takes a few milliseconds for a
hundred modules; `ast` takes a hundred times as long.
"""

from __future__ import annotations

import ast
import hashlib
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from importlib import metadata
from pathlib import Path

from pipeline.store.fingerprints import LENGTH

REPOSITORY = Path(__file__).resolve().parents[2]
PACKAGES = ("geometry", "rom", "nonlinear", "pipeline")
# They carry results from place to place and have no part in what is in them.
CARRIERS = ("pipeline.errors", "pipeline.process", "pipeline.store")
_DISTRIBUTIONS = {"skfem": "scikit-fem", "PIL": "pillow"}  # where the name to install is another one
_TYPE_CHECKING = re.compile(r"^if TYPE_CHECKING:\n(?:[ \t]+.*\n|\n)+", re.MULTILINE)
_IMPORT = re.compile(r"^[ \t]*import ([\w., \t]+)", re.MULTILINE)
_FROM = re.compile(r"^[ \t]*from ([\w.]+) import (\([^)]*\)|[^\n(]+)", re.MULTILINE)
_PLACES = re.compile(r"^_PLACES = (\{.*?^\})", re.MULTILINE | re.DOTALL)
Import = tuple[str, str]  # module, and the name imported from it ("" for the module itself)


def imports(text: str) -> Iterator[Import]:
    """What a source text imports when it runs, at the top or in a function."""
    text = _TYPE_CHECKING.sub("", text)
    for found in _IMPORT.finditer(text):
        for part in found[1].split(","):
            yield part.split(" as ")[0].strip(), ""
    for found in _FROM.finditer(text):
        for part in re.sub(r"#.*", "", found[2]).strip("()").split(","):
            if name := part.split(" as ")[0].strip():
                yield found[1], name


@dataclass
class SourceTree:
    """The source of the four packages under `root`, each file read once.

    Attributes
    ----------
    root : Path
        Folder that holds the packages.
    """

    root: Path = REPOSITORY
    _texts: dict[str, str] = field(default_factory=dict)
    _imports: dict[str, tuple[set[str], set[str]]] = field(default_factory=dict)

    def fingerprint(self, *modules: str) -> str:
        """Hash of the modules, of all that they import of the four packages, and of the versions of libraries.

        Raises
        ------
        FileNotFoundError
            There is no such module.
        """
        sources, libraries = self.reached(*modules)
        digest = hashlib.sha256()
        for module in sorted(sources):
            digest.update(f"{module}\0{self._text(module)}\0".encode())
        for library in sorted(libraries):
            digest.update(f"{library} {_version(library)}\n".encode())
        return digest.hexdigest()[:LENGTH]

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
        """The module that an import leads to: packages hand on names from their files, some by a table."""
        if self._path(module).name != "__init__.py":
            return module
        if self._file(f"{module}.{name}").exists() or self._file(f"{module}.{name}.__init__").exists():
            return f"{module}.{name}"
        table = _PLACES.search(self._text(module))
        places: dict[str, str] = ast.literal_eval(table[1]) if table else {}
        return places.get(name, module)

    def _text(self, module: str) -> str:
        if module not in self._texts:
            self._texts[module] = self._path(module).read_text(encoding="utf-8")
        return self._texts[module]

    def _path(self, module: str) -> Path:
        package = self._file(f"{module}.__init__")
        return package if package.exists() else self._file(module)

    def _file(self, module: str) -> Path:
        return self.root.joinpath(*module.split(".")).with_suffix(".py")


@cache
def code_fingerprint(*modules: str) -> str:
    """Fingerprint of the code that the given modules run, as it was when this process first asked for it.

    Raises
    ------
    FileNotFoundError
        There is no such module.
    """
    return _tree().fingerprint(*modules)


@cache
def _tree() -> SourceTree:
    return SourceTree()


@cache
def _version(library: str) -> str:
    try:
        return metadata.version(_DISTRIBUTIONS.get(library, library))
    except metadata.PackageNotFoundError:
        return "absent"

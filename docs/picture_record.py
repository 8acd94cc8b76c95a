"""What the pictures of README and pages were made from: a record beside them, and which of them are older than that.

`docs/images/made_from.json` holds for each picture the hash of its file and a fingerprint of every source: the values
of a scene, the code that draws (comments aside), a table or the code of a page; and for each scene shown its peaks. A
test fails where a picture is old.
"""

from __future__ import annotations

import ast
import hashlib
import json
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
IMAGES = DOCS / "images"
RECORD = IMAGES / "made_from.json"


Maker = Callable[[Path], bool]  # writes the file given; False: could not, the file stays as it is


@dataclass(frozen=True)
class Picture:
    """A picture, what it is made from, and how.

    Attributes
    ----------
    name : str
        Its file in docs/images, without `.png`.
    sources : tuple of str
        Files or folders of the repository.
    make : callable
        How it is made.
    """

    name: str
    sources: tuple[str, ...]
    make: Maker

    @property
    def path(self) -> Path:
        """The file in docs/images."""
        return IMAGES / f"{self.name}.png"


def fingerprint(source: str) -> str:
    """Hash of what a source says: values of a scene, code without comments and docstrings, the code of a page."""
    place = ROOT / source
    if place.suffix == ".toml":
        return _hash(json.dumps(tomllib.loads(place.read_text(encoding="utf-8")), sort_keys=True))
    if place.suffix == ".ipynb":
        return _hash(code_cells(place))
    if place.suffix == ".md":
        text = place.read_text(encoding="utf-8")
        code = re.findall(r"^```(?:python|toml)\n(.*?)^```", text, re.M | re.S)
        return _hash("".join([*code, *re.findall(r"^\$ .*$", text, re.M)]))
    files = [place] if place.is_file() else sorted(place.rglob("*"))
    return _hash("".join(_code(file) for file in files if file.is_file()))


def code_cells(notebook: Path) -> str:
    """The Python of a notebook."""
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    return "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")


def _code(file: Path) -> str:
    if file.suffix == ".py":
        return ast.dump(_without_docstrings(ast.parse(file.read_text(encoding="utf-8"))))
    return file.read_text(encoding="utf-8") if file.suffix in (".html", ".css", ".js", ".csv") else ""


def _without_docstrings(tree: ast.Module) -> ast.Module:
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node) is not None:
            node.body = node.body[1:] or [ast.Pass()]
    return tree


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def record_of(picture: Picture) -> dict[str, Any]:
    """What the record says of a picture that is made now."""
    content = hashlib.sha256(picture.path.read_bytes()).hexdigest()[:16]
    return {"file": content, "from": {source: fingerprint(source) for source in picture.sources}}


def read_record() -> dict[str, Any]:
    """The record: `pictures`, and `peaks` of the scenes shown, curve by curve."""
    return dict(json.loads(RECORD.read_text(encoding="utf-8"))) if RECORD.exists() else {"pictures": {}, "peaks": {}}


def write_record(record: dict[str, Any]) -> None:
    """Write the record, keys in order."""
    RECORD.write_text(json.dumps(record, indent=1, sort_keys=True) + "\n", encoding="utf-8")


def stale(pictures: Iterable[Picture]) -> Iterator[str]:
    """One line for each picture that is missing, is not the one recorded, or has a source that changed since."""
    recorded = read_record()["pictures"]
    for picture in pictures:
        if picture.name not in recorded or not picture.path.exists():
            yield f"{picture.name}: not made yet"
            continue
        now, then = record_of(picture), recorded[picture.name]
        if now["file"] != then["file"]:
            yield f"{picture.name}: the file is not the one recorded"
        changed = [source for source in now["from"] if now["from"][source] != then["from"].get(source)]
        yield from (f"{picture.name}: {source} has changed since" for source in changed)

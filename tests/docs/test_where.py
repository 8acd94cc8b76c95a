"""The tables of docs/developers/where.md and the files that the pages name: every name is where they say."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
LAST_EQUATION = 18  # of the paper
PATH = re.compile(r"`((?:geometry|rom|nonlinear|pipeline|benchmarks|docs|tests|scenes)/[\w./]+\.\w+)`")
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]


def rows(section: str) -> list[list[str]]:
    """Cells of the table rows in a section of docs/developers/where.md."""
    text = (DOCS / "developers" / "where.md").read_text().split(f"## {section}\n")[1].split("\n## ")[0]
    lines = [line for line in text.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines[1:]]


def defined(path: Path) -> Iterator[str]:
    """Functions and classes of a file, methods as Class.method."""
    for item in ast.parse(path.read_text()).body:
        if isinstance(item, ast.FunctionDef | ast.ClassDef):
            yield item.name
        if isinstance(item, ast.ClassDef):
            yield from (f"{item.name}.{inner.name}" for inner in item.body if isinstance(inner, ast.FunctionDef))


def wrong(cells: list[str]) -> str | None:
    """What is wrong with a row that ends with names and a file."""
    names, path = re.findall(r"`([\w.]+)`", cells[-2]), ROOT / cells[-1].strip("` ")
    if not names or not path.is_file():
        return f"{cells}: no name" if not names else f"{cells}: no such file"
    missing = sorted(set(names) - set(defined(path)))
    return f"{cells}: not defined there: {', '.join(missing)}" if missing else None


def equations(cell: str) -> set[int]:
    """The equations of a cell such as "3", "10-16" or "after 6", which has no number of its own."""
    found = re.fullmatch(r"(\d+)(?:-(\d+))?", cell)
    return set(range(int(found[1]), int(found[2] or found[1]) + 1)) if found else set()


@pytest.mark.parametrize("section", ["Equations of the paper", "Algorithms"])
def test_every_name_is_defined_in_its_file(section: str) -> None:
    found = [fault for fault in map(wrong, rows(section)) if fault]
    assert found == [], "\n".join(["wrong rows of docs/developers/where.md:", *found])


def test_every_equation_of_the_paper_stands_somewhere() -> None:
    covered = set().union(*(equations(cells[0]) for cells in rows("Equations of the paper")))
    assert covered == set(range(1, LAST_EQUATION + 1))


def test_every_algorithm_of_the_method_is_listed() -> None:
    parts = (DOCS / "developers" / "method.md").read_text().split("\n## ")
    described = [re.findall(r"^### (.*)$", part, re.MULTILINE) for part in parts if part.startswith("Algorithms")]
    assert {cells[0] for cells in rows("Algorithms")} == {name for names in described for name in names}


def test_every_folder_of_code_is_explained() -> None:
    named = {name for cells in rows("Folders") for name in re.findall(r"`([\w/]+)/`", cells[0])}
    packages = ("geometry", "rom", "nonlinear", "pipeline")
    folders = {
        path.parent.relative_to(ROOT).as_posix() for package in packages for path in (ROOT / package).rglob("*.py")
    }
    assert named == folders - {"rom", "nonlinear", "pipeline"}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_files_named_on_a_page_exist(page: Path) -> None:
    named = set(PATH.findall(page.read_text()))
    assert sorted(path for path in named if not (ROOT / path).exists()) == []


def test_a_wrong_row_is_noticed() -> None:
    here = "`tests/docs/test_where.py`"
    assert wrong(["1", "`rows`, `test_a_wrong_row_is_noticed`", here]) is None
    assert (
        wrong(["1", "`rows`, `columns`", here]) == f"['1', '`rows`, `columns`', '{here}']: not defined there: columns"
    )
    assert str(wrong(["1", "`rows`", "`tests/docs/nothing.py`"])).endswith("no such file")
    assert str(wrong(["1", "rows", here])).endswith("no name")

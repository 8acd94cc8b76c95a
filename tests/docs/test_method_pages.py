"""The pages say where the code stands: sections of the method, equations of the paper, folders; all files exist."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
LAST_EQUATION = 18  # of the paper
PATH = re.compile(r"`((?:geometry|rom|nonlinear|pipeline|benchmarks|docs|tests|scenes)/[\w./]+\.\w+)`")
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
METHOD = sorted((DOCS / "developers" / "method").glob("*.md"))


def first_cells(page: str, section: str) -> list[str]:
    """First cells of the table in a section of a developers' page."""
    text = (DOCS / "developers" / page).read_text().split(f"## {section}\n")[1].split("\n## ")[0]
    return [line.strip("|").split(" | ")[0].strip() for line in text.splitlines() if line.startswith("| ")][1:]


@pytest.mark.parametrize("page", METHOD, ids=lambda page: page.stem)
def test_every_section_of_the_method_says_where_its_code_stands(page: Path) -> None:
    sections = page.read_text().split("\n## ")[1:]
    assert sections
    for section in sections:
        assert re.search(r"^Code: `[\w/]+\.py`", section, flags=re.MULTILINE), section.splitlines()[0]


def test_every_equation_of_the_paper_stands_somewhere() -> None:
    covered: set[int] = set()
    for cell in first_cells("method.md", "Equations of the paper"):
        for first, last in re.findall(r"(\d+)(?: to (\d+))?", cell):
            covered |= set(range(int(first), int(last or first) + 1))
    assert covered == set(range(1, LAST_EQUATION + 1))


def test_every_folder_of_code_is_explained() -> None:
    named = {name for cell in first_cells("architecture.md", "Folders") for name in re.findall(r"`([\w/]+)/`", cell)}
    packages = ("geometry", "rom", "nonlinear", "pipeline")
    folders = {
        path.parent.relative_to(ROOT).as_posix() for package in packages for path in (ROOT / package).rglob("*.py")
    }
    assert named == folders - {"rom", "nonlinear", "pipeline"}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_files_named_on_a_page_exist(page: Path) -> None:
    named = set(PATH.findall(page.read_text()))
    assert sorted(path for path in named if not (ROOT / path).exists()) == []

"""The documentation site builds without a warning, asks nothing of a network, and leaves no public name out."""

import html
import importlib
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from docs.site_text import short_signature

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
LINK = re.compile(r"\]\(([^)\s]+)\)")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built as `make docs` does."""
    out = tmp_path_factory.mktemp("site")
    asked = ["--fail-on-warning", "--quiet", "-d", str(out / "trees"), str(ROOT / "docs"), str(out / "html")]
    done = subprocess.run([sys.executable, "-m", "sphinx", *asked], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return out / "html"


def test_every_page_is_there_and_none_needs_a_network(site: Path) -> None:
    made = {page.relative_to(site).with_suffix("") for page in site.rglob("*.html")}
    assert {page.relative_to(ROOT / "docs").with_suffix("") for page in PAGES[1:]} <= made
    for page in site.rglob("*.html"):
        asked = re.findall(r'<(?:script|link|img|iframe)\b[^>]*(?:src|href)="(?:https?:)?//[^"]*"', page.read_text())
        assert asked == [], page.name
    assert "shroud" in (site / "searchindex.js").read_text()


def test_the_reference_has_every_public_name_once(site: Path) -> None:
    for package in ("geometry", "rom", "nonlinear", "pipeline"):
        page = (site / "api" / f"{package}.html").read_text()
        for name in importlib.import_module(package).__all__:
            assert page.count(f'id="{package}.{name}"') == 1, f"docs/api/{package}.md: {name}"


def test_a_long_page_begins_with_the_list_of_its_sections(site: Path) -> None:
    for name in ("outputs", "developers/method/ring", "developers/method"):  # many sections, many words
        page = (site / f"{name}.html").read_text()
        listed = re.findall(r'href="#([\w-]+)"', page.partition('<nav class="contents')[2].partition("</nav>")[0])
        sections = re.findall(r"^## ", (ROOT / "docs" / f"{name}.md").read_text(), flags=re.MULTILINE)
        assert len(listed) == len(sections)
        assert all(f'<section id="{anchor}">' in page for anchor in listed)
    assert '<nav class="contents' not in (site / "developers" / "dependencies.html").read_text()


def test_pages_made_from_the_program(site: Path) -> None:
    commands = (site / "command_line.html").read_text()
    assert 'id="shroud-export"' in commands
    assert "out/&lt;scene name&gt; by default" in commands
    assert "The same command again takes a second" in (site / "tutorials" / "half_hour.html").read_text()


def links() -> Iterator[tuple[Path, str]]:
    """Links of all pages to files and headings of the repository."""
    for page in PAGES:
        text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)
        yield from ((page, link) for link in LINK.findall(text) if "://" not in link)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_work_in_a_plain_browser_of_the_repository(page: Path) -> None:
    for where, link in links():
        if where == page:
            name, _, anchor = link.partition("#")
            target = (page.parent / name).resolve() if name else page
            assert target.is_file(), link
            headings = re.findall(r"^#+ (.*)$", target.read_text(), flags=re.MULTILINE) if anchor else []
            assert not anchor or anchor in {re.sub(r"[^\w -]", "", h).lower().replace(" ", "-") for h in headings}


def test_no_signature_shows_a_private_type(site: Path) -> None:
    for page in (site / "api").glob("*.html"):
        for found in re.findall(r'<dt class="sig.*?</dt>', page.read_text(), flags=re.DOTALL):
            shown = html.unescape(re.sub(r"<[^>]+>", "", found))
            assert not re.search(r"\b_[a-zA-Z]|<factory>", shown), f"{page.name}: {shown}"


def test_parameters_become_a_list(site: Path) -> None:
    page = (site / "api" / "nonlinear.html").read_text()
    assert re.search(r"<li><p><strong>friction</strong>", page)


@pytest.mark.parametrize(
    ("found", "shown"),
    [
        ("(x: numpy.ndarray[tuple[Any, ...], numpy.dtype[numpy.float64]]) -> None", "(x: Array) -> None"),
        ("~numpy.ndarray[tuple[~typing.Any, ...], ~numpy.dtype[~numpy.complex128]]", "ComplexArray"),
        (
            "(path: str | pathlib.Path, full: rom.finite_elements.full_model.FullModel)",
            "(path: str | Path, full: FullModel)",
        ),
        (None, None),
    ],
)
def test_signatures_are_short(found: str | None, shown: str | None) -> None:
    assert short_signature(found) == shown

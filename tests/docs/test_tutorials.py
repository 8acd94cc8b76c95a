"""The tutorials run, print what they show, and draw the pictures that they show."""

import re
from pathlib import Path

import pytest

from docs.execute import TUTORIALS, PageError, agrees, blocks, check, commands, pictures, run_page, updated

PAGES = {page.stem: page for page in TUTORIALS if "```python" in page.read_text()}
(DESIGN,) = (page for page in TUTORIALS if page.stem == "designing_a_shroud")
COARSE = {
    r"^accuracy = .*\n": "",
    r"^\[contact\]\n": "[mesh]\nsize = 0.02\n[rom]\nmodes = 5\n[contact]\n",
    r"^damping_ratio = 0.002\n": 'damping_ratio = 0.002\nharmonics = 1\nstability = "folds"\ndetached = false\n'
    "truncation = false\nsearch = 'off'\n",
    r"^\"contact.interference\" = .*\n": '"contact.interference" = [0.0, 120e-6]\n',
    r"=40e-6:300e-6": "=110e-6:150e-6",
    r"=60:120 (.*)=0:300e-6": r"=68:72 \1=110e-6:130e-6",
    r"^\[stress\].*\n": "[stress]\ncheck = false\nhot_spots = 1\n",
}
IMAGES = Path(__file__).parents[2] / "docs" / "images"


@pytest.mark.parametrize("name", PAGES)
def test_a_tutorial_is_true(name: str, tmp_path: Path) -> None:
    page = PAGES[name]
    check(page, run_page(page, tmp_path))
    shown = pictures(page)
    assert shown or name == "own_reduced_model", "a tutorial without a picture of its own"
    for picture in shown:
        assert (tmp_path / picture).stat().st_size > 10_000
        assert (IMAGES / picture).is_file(), "python docs/execute.py --update"


@pytest.mark.long
def test_the_design_is_true(tmp_path: Path) -> None:
    check(DESIGN, run_page(DESIGN, tmp_path))


@pytest.mark.long
def test_a_design_in_commands(tmp_path: Path) -> None:
    text = DESIGN.read_text()
    for old, new in COARSE.items():
        text, count = re.subn(old, new, text, count=1, flags=re.MULTILINE)
        assert count == 1, old
    page = tmp_path / DESIGN.name
    page.write_text(text)
    pieces = run_page(page, tmp_path)
    assert len(pieces) == 9
    for picture in pictures(page):
        assert (tmp_path / picture).stat().st_size > 10_000
    assert all("within ±10 µm" in piece.printed for piece in pieces[5:7])
    assert (tmp_path / "out" / "final" / "report.html").is_file()


@pytest.mark.parametrize(
    ("shown", "printed", "same"),
    [
        ("peak 1.67 um", "peak 1.68 um\n", True),
        ("peak 1.67 um", "peak 1.97 um\n", False),
        ("9 nodes", "9 nodes", True),
        ("9 nodes", "8 nodes", False),
        ("error 5.3e-03", "error 5.4e-03", True),
        ("error 5.3e-03", "error 5.3e-02", False),
        ("204.300 Hz", "204.315 Hz", True),
        ("free: [ 204.3  802.2]", "free: [204.3 802.2]", True),
        ("in ... s, done", "in 0.31 s, done", True),
        ("in ... s, done", "in 0.31 s, failed", False),
        ("...\nlast", "first\nsecond\nlast", True),
        ("│ 1 │ 2.5 │", "┃ 1 ┃   2.5 ┃", True),
        ("", "unasked for", False),
        ("promised", "", False),
        ("hex20", "hex27", False),
        ("... # v0", "0 1 # v0", True),
    ],
)
def test_what_counts_as_the_same_output(shown: str, printed: str, same: bool) -> None:
    assert agrees(shown, printed) is same


PAGE = """# A page

```python
x = 2
print(x)
```

```text
3
```

Words between.

```python
print(x + 1)
```

```toml
# a.toml
x = 1
```

More words, so the next block is nobody's output.

```text
free
```

```console
$ tail -1 a.toml
x = 1
$ false  # exit status 1
```
"""


def test_a_page_that_lies_is_caught_and_can_be_put_right(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(PAGE)
    pieces = run_page(page, tmp_path)
    with pytest.raises(PageError, match=r"page\.md:8: the page shows\n3"):
        check(page, pieces)
    page.write_text(updated(PAGE, pieces))
    check(page, run_page(page, tmp_path))
    assert page.read_text() == PAGE.replace("```text\n3\n", "```text\n2\n").replace(
        "print(x + 1)\n```\n", "print(x + 1)\n```\n\n```text\n3\n```\n"
    )


@pytest.mark.parametrize("inside", ["```python\n1 / 0\n```", "```console\n$ exit 3\n```"])
def test_a_block_that_fails_names_its_line(tmp_path: Path, inside: str) -> None:
    page = tmp_path / "page.md"
    page.write_text(f"# A page\n\n{inside}\n")
    with pytest.raises(PageError, match=r"page\.md:[34]: "):
        run_page(page, tmp_path)


def test_commands_and_what_they_show() -> None:
    (block,) = blocks("```console\n$ one\nshown\n$ two\n```\n")
    assert list(commands(block)) == [(2, "one", "shown\n"), (4, "two", "")]

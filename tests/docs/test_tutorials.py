"""The tutorials run, print what they show, and draw the pictures that they show."""

from pathlib import Path

import pytest

from docs.execute import TUTORIALS, PageError, agrees, blocks, check, commands, pictures, run_page, updated

PAGES = {page.stem: page for page in TUTORIALS if "```python" in page.read_text()}
IMAGES = Path(__file__).parents[2] / "docs" / "images"


@pytest.mark.parametrize("name", PAGES)
def test_a_tutorial_is_true(name: str, tmp_path: Path) -> None:
    page = PAGES[name]
    check(page, run_page(page, tmp_path))
    shown = pictures(page)
    assert shown, "a tutorial without a picture of its own"
    for picture in shown:
        assert (tmp_path / picture).stat().st_size > 10_000
        assert (IMAGES / picture).is_file(), "python docs/execute.py --update"


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

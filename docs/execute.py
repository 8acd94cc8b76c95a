"""Pages that run: their Python blocks in one namespace, their commands in a shell, against the output they show.

    python docs/execute.py            # run every tutorial and say where a page is not true
    python docs/execute.py --update   # write what was printed and drawn into docs/tutorials and docs/images

Without a page named the scripts of examples/ run too, and leave their pictures in docs/images/examples.

A block of Python followed at once by a block of text prints that text; one that is not prints nothing. In a block
marked `console`, lines that begin with "$ " are commands, the others what they print; a line "..." stands for any
lines, "..." within a line for anything. A block of TOML that begins with "# NAME.toml" is that file; a picture
with the comment "from PATH" is a copy of a file that a command wrote. Numbers with decimals may differ by two units
of the last digit, or by one part in a thousand; counts may not.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import re
import runpy
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent
HALF_HOUR = DOCS / "tutorials" / "half_hour.md"  # needs a copy of the repository: tests/docs/test_half_hour.py
TUTORIALS = sorted(page for page in (DOCS / "tutorials").glob("*.md") if page != HALF_HOUR)
EXAMPLES = sorted((DOCS.parent / "examples").glob("*.py"))
RELATIVE = 1e-3
_FENCE = re.compile(r"^```(\w*)\s*$")
_FILE = re.compile(r"# ([\w/-]+\.toml)\n")
_COPIED = re.compile(r"images/([\w.-]+)\) <!-- from ([\w/.-]+) -->")
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


class PageError(AssertionError):
    """A page that is not true; the message names the page, the line, what it shows and what came."""


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, its text, and the numbers (from 1) of its fences' lines."""

    language: str
    text: str
    first: int
    last: int


@dataclass(frozen=True)
class Piece:
    """A block that runs, what the page shows of its output (None: nothing), and what it printed."""

    block: Block
    shown: Block | None
    printed: str


def blocks(text: str) -> list[Block]:
    """The fenced blocks of a Markdown text."""
    found, begun, lines = [], None, text.splitlines()
    for number, line in enumerate(lines, start=1):
        if begun is None and (fence := _FENCE.match(line)):
            begun = number, fence[1]
        elif begun is not None and line.rstrip() == "```":
            inside = "\n".join(lines[begun[0] : number - 1])
            found.append(Block(begun[1], inside + "\n", begun[0], number))
            begun = None
    return found


def run_page(page: Path, folder: Path) -> list[Piece]:
    """Run the Python blocks and the commands of a page in `folder`; what each of them printed.

    Raises PageError where a block raises or a command fails.
    """
    lines = page.read_text(encoding="utf-8").splitlines()
    found = blocks("\n".join(lines))
    namespace: dict[str, Any] = {"__name__": "__main__"}
    pieces = []
    for index, block in enumerate(found):
        if block.language == "python":
            following = found[index + 1] if index + 1 < len(found) else None
            joined = following is not None and not any(
                line.strip() for line in lines[block.last : following.first - 1]
            )
            shown = following if joined and following is not None and following.language == "text" else None
            pieces.append(Piece(block, shown, _execute(page, block, namespace, folder)))
        elif block.language == "toml" and (named := _FILE.match(block.text)):
            (folder / named[1]).write_text(block.text, encoding="utf-8")
        elif block.language == "console":
            pieces.extend(run_commands(page, block, folder))
    for picture, source in _COPIED.findall("\n".join(lines)):
        shutil.copy(folder / source, folder / picture)
    return pieces


def _execute(page: Path, block: Block, namespace: dict[str, Any], folder: Path) -> str:
    """Run Python in `folder`; what it printed."""
    code = compile("\n" * block.first + block.text, str(page), "exec")
    printed = io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(printed):
        try:
            exec(code, namespace)
        except Exception as error:
            raise PageError(f"{page}:{block.first}: {type(error).__name__}: {error}") from error
    return printed.getvalue()


def run_example(script: Path, folder: Path) -> str:
    """Run a script of examples/ in `folder`, where it leaves a picture of its name; what it printed."""
    printed, before = io.StringIO(), os.environ["PATH"]
    os.environ["PATH"] = programs_first()
    try:
        with contextlib.chdir(folder), contextlib.redirect_stdout(printed):
            runpy.run_path(str(script), run_name="__main__")
    finally:
        os.environ["PATH"] = before
    return printed.getvalue()


def programs_first() -> str:
    """PATH with the programs of this environment first."""
    return f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"


def run_commands(page: Path, block: Block, folder: Path) -> Iterator[Piece]:
    """Run the commands of a console block, one after the other, with the programs of this environment first.

    A command may fail where the page says so by a comment `# exit status N`.
    """
    # A reader's make is not called by another one, which would say so in its output.
    reader = {name: value for name, value in os.environ.items() if name not in ("MAKEFLAGS", "MAKELEVEL", "MFLAGS")}
    environment = reader | {"PATH": programs_first()}
    for number, command, shown in commands(block):
        status = re.search(r"# exit status (\d+)", command)
        done = subprocess.run(
            command,
            shell=True,
            cwd=folder,
            env=environment,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        if done.returncode != int(status[1] if status else 0):
            raise PageError(f"{page}:{number}: {command}: exit status {done.returncode}\n{done.stdout}")
        yield Piece(block, Block("text", shown, number, number) if shown else None, done.stdout if shown else "")


def commands(block: Block) -> Iterator[tuple[int, str, str]]:
    """Line, command and the output shown, of each command of a console block."""
    number, command, shown = 0, "", ""
    for offset, line in enumerate([*block.text.splitlines(), "$ "], start=1):
        if line.startswith("$ "):
            if command:
                yield number, command, shown
            number, command, shown = block.first + offset, line[2:], ""
        else:
            shown += line + "\n"


def check(page: Path, pieces: list[Piece], numbers: bool = True) -> None:
    """Raise PageError for the first piece whose output is not what the page shows (see `agrees`)."""
    for piece in pieces:
        shown = piece.shown.text if piece.shown else ""
        if not agrees(shown, piece.printed, numbers):
            line = (piece.shown or piece.block).first
            raise PageError(f"{page}:{line}: the page shows\n{shown}\nbut this was printed:\n{piece.printed}")


def agrees(shown: str, printed: str, numbers: bool = True) -> bool:
    """Whether a printed text is the one shown, word by word, numbers by value, boxes aside, "..." for any words.

    numbers: whether their values count, or only that there is a number ("at least" 5 is one too).
    """
    ignored = () if numbers else (">=",)
    found = [word for word in _words(printed) if word not in ignored]
    reached = {0}  # how many of the printed words the page's words so far may have used up
    for wanted in (word for word in _words(shown) if word not in ignored):
        if wanted == "...":
            reached = set(range(min(reached), len(found) + 1))
        else:
            reached = {at + 1 for at in reached if at < len(found) and _same(wanted, found[at], numbers)}
        if not reached:
            return False
    return len(found) in reached


def _words(text: str) -> list[str]:
    """The words; lines that draw boxes are no words."""
    return re.sub(r"[─-╿]+", " ", text).replace("[", " [ ").split()


def _same(wanted: str, word: str, numbers: bool) -> bool:
    """Whether two words are the same but for the last digits of the numbers in them."""
    if _NUMBER.sub("\0", wanted) != _NUMBER.sub("\0", word):
        return False
    return not numbers or all(
        _near(*pair) for pair in zip(_NUMBER.findall(wanted), _NUMBER.findall(word), strict=True)
    )


def _near(shown: str, printed: str) -> bool:
    mantissa, _, exponent = shown.partition("e")
    digits = len(mantissa.partition(".")[2])
    last = 10.0 ** (int(exponent or 0) - digits)
    if digits == 0 and not exponent:
        last = 0.0  # a count is exact
    expected = float(shown)
    return abs(float(printed) - expected) <= max(2.0 * last, RELATIVE * abs(expected) if last else 0.0) * (1 + 1e-9)


def updated(text: str, pieces: list[Piece]) -> str:
    """The page with what its Python blocks printed in place of what it showed."""
    lines = text.splitlines()
    for piece in reversed(pieces):
        if piece.block.language != "python":
            continue
        output = ["```text", *piece.printed.rstrip().splitlines(), "```"] if piece.printed else []
        if piece.shown is not None:
            lines[piece.shown.first - 1 : piece.shown.last] = output
        elif output:
            lines[piece.block.last : piece.block.last] = ["", *output]
    return "\n".join(lines) + "\n"


def pictures(page: Path) -> list[str]:
    """Names of the pictures that a page shows of those it draws itself: they begin with the page's own name."""
    return [
        name
        for name in re.findall(r"images/([\w.-]+)\)", page.read_text(encoding="utf-8"))
        if name.startswith(page.stem)
    ]


def main() -> int:
    """Run the tutorials named, or all; exit status 1 where a page is not true."""
    parser = argparse.ArgumentParser(description="Run the tutorials.")
    parser.add_argument("--update", action="store_true", help="write output and pictures into the pages")
    parser.add_argument("pages", nargs="*", type=Path, help="all of docs/tutorials by default")
    chosen = parser.parse_args()
    for page in chosen.pages or TUTORIALS:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            try:
                pieces = run_page(page, folder)
                if chosen.update:
                    page.write_text(updated(page.read_text(encoding="utf-8"), pieces), encoding="utf-8")
                    for picture in pictures(page):
                        shutil.copy(folder / picture, DOCS / "images" / picture)
                else:
                    check(page, pieces)
            except PageError as error:
                print(error, file=sys.stderr)
                return 1
        print(f"{page.name}: {'written' if chosen.update else 'true'}, {len(pieces)} pieces")
    for script in () if chosen.pages else EXAMPLES:
        with tempfile.TemporaryDirectory() as name:
            print(f"{script.name}: {run_example(script, Path(name)).splitlines()[-1]}")
            if chosen.update:
                for picture in Path(name).glob("*.png"):
                    shutil.copy(picture, DOCS / "images" / "examples" / picture.name)
    return 0


if __name__ == "__main__":
    sys.exit(main())

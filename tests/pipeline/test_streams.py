"""Streams that are closed, full, or cannot write every character: no traceback, and the status of the work itself."""

import io
import os
import subprocess
import sys
from pathlib import Path

import pytest
from pipeline_support import RAW_TEXT, small_scene, write_scene

from pipeline import read_results
from pipeline.process.program import prepare_streams
from pipeline.process.progress import Reporter
from pipeline.terminal import print_error

REPOSITORY = Path(__file__).parents[2]
C_LOCALE = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}


def shell(line: str, folder: Path, **environment: str) -> tuple[int, bytes, bytes]:
    """Status, stdout and stderr of a line of a shell in which $S is the program."""
    whole = {**os.environ, "PYTHONPATH": str(REPOSITORY), "S": f"{sys.executable} -m pipeline", **environment}
    done = subprocess.run(["bash", "-c", line], capture_output=True, check=False, cwd=folder, env=whole)
    assert not RAW_TEXT.search(done.stderr.decode(errors="replace")), done.stderr
    return done.returncode, done.stdout, done.stderr


@pytest.fixture
def given(tmp_path: Path) -> Path:
    write_scene(tmp_path / "s.toml", small_scene(contact__friction=3.0))
    return tmp_path


WARNED = b"warning: s.toml: contact.friction: 3.0 is unusual; a friction coefficient is 0.1 to 1 or so\n"
REFUSED = b"no.toml: no such file\n"
VALID = b"s.toml: valid, 1 curve\n"


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("$S validate s.toml >&-", (0, b"", WARNED)),
        ("$S validate s.toml 2>&-", (0, VALID, b"")),
        ("$S validate no.toml 2>&-", (2, b"", b"")),
        ("$S validate no.toml <&- >&- 2>&-", (2, b"", b"")),
        ("$S validate no.toml 2>/dev/full", (2, b"", b"")),
        ("$S validate s.toml 2>/dev/full >/dev/full", (1, b"", b"")),
        (
            "$S validate s.toml >/dev/full",
            (1, b"", WARNED + b"shroud: the output cannot be written: No space left on device\n"),
        ),
        ("$S schema >/dev/full", (1, b"", b"shroud: the output cannot be written: No space left on device\n")),
        ("$S schema | head -1; exit ${PIPESTATUS[0]}", (1, b"{\n", b"")),
    ],
)
def test_streams_that_cannot_be_written(given: Path, line: str, expected: tuple[int, bytes, bytes]) -> None:
    assert shell(line, given) == expected


def test_a_run_with_no_streams_at_all_writes_its_results_and_nothing_else(copied: Path, finished: Path) -> None:
    """No file that a library opens gets the number of a stream."""
    write_scene(copied.parent / "s.toml", small_scene(sweep={"contact.interference": [1e-5, 1e-3]}))
    names = ("response.csv", "curves.csv")
    for name in (*names, "response.h5", "summary.json"):
        (copied / name).unlink()
    assert shell("$S run s.toml --out out <&- >&- 2>&-", copied.parent) == (0, b"", b"")
    assert read_results(copied).complete
    for name in names:
        assert (copied / name).read_bytes() == (finished / name).read_bytes()


def test_a_locale_of_ascii_shows_similar_characters(copied: Path) -> None:
    """A run with a unit of Greek letters in its table, in a folder and with a title beyond ASCII."""
    scene = small_scene(sweep={"contact.interference": [1e-5, 1e-3]})
    write_scene(copied.parent / "ü.toml", scene)
    copied.rename(copied.parent / "é")
    status, said, error = shell("$S run ü.toml --out é", copied.parent, **C_LOCALE)
    assert status == 0, error
    assert b"v0 [um]" in said
    assert "results in é\n".encode() in said
    assert b"\n0       10 " in said
    missing = shell("$S validate ä.toml", copied.parent, PYTHONIOENCODING="ascii")
    assert missing == (2, b"", b"\\xe4.toml: no such file\n")
    strange = b"a\xff.toml"
    (Path(os.fsdecode(os.path.join(os.fsencode(copied.parent), strange)))).write_bytes(b"")
    status, _, error = shell("$S validate a$'\\xff'.toml", copied.parent)
    assert status == 2
    assert error.startswith(b"a\\xff.toml: name: missing")


def test_without_streams_nothing_is_printed_anywhere_else(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Where stderr is None, as in a program without a console, print() would write to stdout."""
    monkeypatch.setattr(sys, "stderr", None)
    print_error("an error")
    reporter = Reporter()
    reporter.line("a line")
    with reporter.working("work"), reporter.counting("pieces", 1) as counter:
        counter.done("one")
    assert capsys.readouterr().out == ""


def test_characters_that_a_stream_lacks(monkeypatch: pytest.MonkeyPatch) -> None:
    written = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(written, encoding="ascii", errors="strict"))
    prepare_streams()
    print("µm °C ┏━┓ – é \udcff \ud800", end="", flush=True)
    assert written.getvalue() == b"um  degC +-+ - \\xe9 \xff \\ud800"

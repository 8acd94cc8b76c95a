"""What commands say: progress with the time left, nothing when quiet, JSON alone where a script reads."""

import io
import json
from pathlib import Path

import pytest
from faults_support import wait_until
from pipeline_support import ground_scene, shroud, small_scene, summary_of, write_ground_model, write_scene

import pipeline.process.progress
from pipeline.process.progress import Reporter, duration, time_left
from pipeline.stages.curve.sweep_curves import COMPILING


class Terminal(io.StringIO):
    """A stream that claims to be one."""

    def isatty(self) -> bool:
        return True


class Closed(io.StringIO):
    """A stream that nobody reads any more."""

    def write(self, text: str) -> int:
        raise BrokenPipeError


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """A clock that shows what the list holds."""
    shown = [0.0]
    monkeypatch.setattr(pipeline.process.progress.time, "perf_counter", lambda: shown[0])
    return shown


@pytest.mark.parametrize("at_once", [1, 2, 5])
def test_time_left_of_equal_pieces(at_once: int) -> None:
    """12 pieces of 10 s each in so many processes: the estimate is exact."""
    total = 10.0 * -(-12 // at_once)
    for done in range(1, 13):
        elapsed = 10.0 * -(-done // at_once)
        assert time_left(elapsed, done, 12, at_once) == pytest.approx(total - elapsed, abs=1e-9)


def test_lines_elsewhere_than_at_a_terminal_tell_the_time_left(clock: list[float]) -> None:
    stream = io.StringIO()
    with Reporter(stream=stream).counting("curves", 3) as counter:
        for seconds in (4.0, 10.0, 12.0):
            clock[0] = seconds
            counter.done("one")
    lines = stream.getvalue().splitlines()
    done = "curves, {} of 3 done: one"
    assert lines == [done.format(1) + "; about 8 s left", done.format(2) + "; about 5 s left", done.format(3)]


@pytest.mark.parametrize(("seconds", "text"), [(0.44, "0.4 s"), (12.3, "12 s"), (200.0, "3 min"), (9000.0, "2.5 h")])
def test_durations(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_a_long_single_piece_says_that_it_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pipeline.process.progress, "_FIRST_LINE", 0.001)
    stream = io.StringIO()
    with Reporter(stream=stream).working("reducing"):
        wait_until(lambda: "so far" in stream.getvalue(), "a word on the way")
    assert stream.getvalue().startswith("reducing: 0 s so far\n")
    assert stream.getvalue().splitlines()[-1].endswith(" s")
    quiet = io.StringIO()
    with Reporter(quiet=True, stream=quiet).working("reducing"):
        pass
    assert quiet.getvalue() == ""


def test_the_work_that_goes_on_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """ "8 of 8 done" stood there for minutes, while branches of neighbours were sought."""
    monkeypatch.setattr(pipeline.process.progress, "_PAUSE_OF_LINES", 0.001)
    stream = io.StringIO()
    with Reporter(stream=stream).counting_several({"curves": 1, "branches of neighbours": 3}) as counters:
        counters["curves"].within(COMPILING)
        wait_until(lambda: "warm-up" in stream.getvalue(), "what takes so long at first")
        counters["curves"].done("one")
        counters["branches of neighbours"].within("at 352 Hz")
        wait_until(lambda: "at 352 Hz" in stream.getvalue(), "what goes on then")
    last = [line for line in stream.getvalue().splitlines() if "so far" in line][-1]
    assert last.startswith("branches of neighbours, 0 of 3 done: ")


def test_a_terminal_shows_bars(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = Terminal()
    reporter = Reporter(stream=stream)
    with reporter.working("reducing"):
        pass
    with reporter.counting("curves", 2) as counter:
        counter.within("at 3 Hz")
        counter.done("one")
    assert "reducing" in stream.getvalue()
    assert "1/2" in stream.getvalue()


def test_a_closed_stream_does_not_stop_the_work() -> None:
    reporter = Reporter(stream=Closed())
    reporter.line("to nobody")
    with reporter.working("something"), reporter.counting("curves", 1) as counter:
        counter.done("one")
    assert counter.count == 1


def test_json_of_a_run(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "s.toml", ground_scene() | {"sweep": {"contact.friction": [0.1, 0.5]}})
    arguments = (
        "respond",
        scene,
        "--rom",
        write_ground_model(tmp_path / "g.h5"),
        "--out",
        tmp_path / "out",
        "--json",
    )
    status, said, error = shroud(*arguments)
    assert status == 0
    assert json.loads(said) == summary_of(tmp_path / "out")
    assert "curves, 1 of 2 done: " in error
    assert " left" in error
    status, said, error = shroud(*arguments, "--quiet")
    assert (status, error) == (0, "")
    assert json.loads(said)["stages"]["respond"]["status"] == "reused"


def test_json_of_a_check(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "s.toml", small_scene(sweep={"contact.friction": [0.1, 0.5]}))
    status, said, error = shroud("validate", scene, "--json")
    assert (status, error) == (0, "")
    assert json.loads(said) == {
        "valid": True,
        "errors": [],
        "warnings": [f"{scene}: contact.friction = 0.4 is not used: [sweep] gives the values"],
        "name": "small",
        "curves": 2,
        "swept": ["contact.friction"],
        "accuracy": None,
    }
    scene = write_scene(tmp_path / "s.toml", small_scene(contact__friction=-1.0))
    status, said, error = shroud("validate", scene, "--json")
    assert status == 2
    assert json.loads(said) == {"valid": False, "errors": [error.rstrip("\n")], "warnings": []}
    assert "contact.friction" in error


def test_json_of_what_files_hold(finished: Path) -> None:
    status, said, error = shroud("info", finished / "response.h5", "--json")
    assert (status, error) == (0, "")
    found = json.loads(said)
    assert found["kind"] == "response"
    for curve, told in zip(summary_of(finished)["curves"], found["curves"], strict=True):
        assert told["peak_amplitude_m"] == curve["peak_amplitude_m"]
        assert told["points"] == curve["points"]
        assert told["parameters"]["contact.interference"] == curve["parameters"]["contact.interference"]
    model = finished / summary_of(finished)["models"][0]["rom"]
    status, said, _ = shroud("info", model, "--json")
    found = json.loads(said)
    assert (status, found["kind"], found["n_blades"], found["contact_nodes"]) == (0, "reduced model", 72, 4)
    for name in ("response.h5", summary_of(finished)["models"][0]["rom"]):
        status, said, error = shroud("info", finished / name)
        assert (status, error) == (0, "")
        assert said.startswith(f"{finished / name}: re")


def test_quiet_commands_say_nothing(copied: Path) -> None:
    scene = write_scene(copied.parent / "s.toml", small_scene(sweep={"contact.interference": [1e-5, 1e-3]}))
    for arguments in (
        ("run", scene, "--out", copied, "--recompute", "--until", "respond"),
        ("report", scene, "--out", copied),
        ("export", copied / "response.h5", "--to", copied / "x.mat"),
    ):
        assert shroud(*arguments, "--quiet") == (0, "", "")


def test_a_page_about_other_results_goes_away(copied: Path) -> None:
    scene = copied.parent / "s.toml"
    page, sweep = copied / "report.html", {"contact.interference": [1e-5, 1e-3]}
    write_scene(scene, small_scene(sweep=sweep))
    assert shroud("report", scene, "--out", copied, "--quiet") == (0, "", "")
    made = page.read_bytes()
    write_scene(scene, small_scene(sweep=sweep, title="Another title"))  # the same numbers
    assert shroud("run", scene, "--out", copied, "--until", "respond", "--quiet") == (0, "", "")
    assert page.read_bytes() == made
    write_scene(scene, small_scene(contact__interference=1e-5))
    status, _, error = shroud("run", scene, "--out", copied, "--until", "respond")
    assert status == 0
    assert f"{page}: was about other results, removed" in error
    assert not page.exists()
    write_scene(scene, small_scene(sweep=sweep))
    assert shroud("report", scene, "--out", copied, "--quiet") == (0, "", "")
    assert page.read_bytes() == made

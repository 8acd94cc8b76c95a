"""The comparison with the peer, without the peer: what it writes, and what it does where nothing can be installed."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def peers(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import peers

    return peers


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The output folder of a run of this program only."""
    folder = tmp_path_factory.mktemp("peers")
    command = [sys.executable, str(BENCHMARKS / "peers.py"), "--skip-pyharm", "--no-first-use", "--out", str(folder)]
    result = subprocess.run([*command, "--cases", "V1", "--curves", "1"], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    assert (folder / "peers.md").read_text() in result.stdout
    return folder


@pytest.mark.xdist_group("peers")
def test_this_program_alone_meets_the_published_values(out: Path) -> None:
    found = json.loads((out / "peers.json").read_text())
    reference = found["references"]["V1"]
    rows = {row["variant"]: row for row in found["rows"]}
    # with 128 samples what others publish with 128, with very many what the exact element gives
    assert rows["sampled"]["response"] == pytest.approx(reference["agreed"], abs=2e-9)
    many, exact = [*reference["check"], reference["check_peak"]], [*reference["response"], reference["peak"]]
    assert many == pytest.approx(exact, rel=1e-6)
    assert rows["exact"]["curve"]["peak"] == pytest.approx(reference["peak"], rel=1e-9)
    for row in rows.values():
        assert row["curve"]["complete"]
        (seconds,) = row["timed"]
        assert row["ms_a_point"] == pytest.approx([1e3 * value / row["curve"]["points"] for value in seconds])


@pytest.mark.xdist_group("peers")
def test_where_the_peer_cannot_be_installed_one_line_says_so(
    peers: Any, out: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    solved = json.loads((out / "peers.json").read_text())
    monkeypatch.setattr(peers, "compare", lambda bench, cases: solved)
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    assert peers.main(["--env", str(tmp_path / "env"), "--out", str(tmp_path)]) == 1
    printed = capsys.readouterr()
    (line,) = (line for line in printed.err.splitlines() if "not installed" in line)
    assert "pyHarm-os 1.2.2" in line
    assert "Without pyHarm: it could not be installed" in printed.out


def test_the_environment_of_this_program_is_left_alone(peers: Any) -> None:
    with pytest.raises(peers.ProgramError, match="is the environment of this program"):
        peers.peer_python(Path(sys.prefix))

"""`make fuzz`: what a fuzzer says becomes counts, findings and an exit status; the seeds are files that are read."""

import importlib.util
from pathlib import Path
from typing import Any

import pytest

from pipeline.results.file_info import contents
from rom import load_full_model, load_sector, read_reduced_model

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
FUZZER = """
import sys
from pathlib import Path
options = dict(part.lstrip("-").split("=", 1) for part in sys.argv[2:])
assert Path(sys.argv[1]).is_dir()
print("#2\\tINITED cov: 3")
print("handled: file: cannot be read")
print(f"#17\\tDONE {options['max_total_time']}")
"""
FINDS = """
Path(options["artifact_prefix"] + "crash-1").write_bytes(b"x")
print("ValueError: something")
sys.exit(77)
"""


@pytest.fixture
def fuzz(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import fuzz

    return fuzz


@pytest.mark.parametrize("finds", [False, True])
def test_what_is_found_is_saved_and_said(
    fuzz: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], finds: bool
) -> None:
    (tmp_path / "fuzz_scene.py").write_text(FUZZER + FINDS * finds)
    monkeypatch.setattr(fuzz, "HERE", tmp_path)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: name)
    out = tmp_path / "out"
    assert fuzz.main(["--only", "scene", "--seconds", "60", "--out", str(out)]) == int(finds)
    said = capsys.readouterr().out
    assert said.startswith("scene: 17 executions in ")
    assert f" s, {int(finds)} findings\n" in said
    assert "1 files that the HDF5 library crashes or hangs on" in said
    assert (f"{out / 'scene-crash-1'}" in said) == finds
    assert ("ValueError: something" in said) == finds


def test_a_fuzzer_that_does_not_start_is_no_success(
    fuzz: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "fuzz_hdf5.py").write_text("raise ImportError('nothing there')\n")
    monkeypatch.setattr(fuzz, "HERE", tmp_path)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: name)
    assert fuzz.main(["--only", "hdf5", "--seconds", "3", "--out", str(tmp_path / "out")]) == 1
    assert "ImportError: nothing there" in capsys.readouterr().out


def test_without_atheris_it_says_so_in_one_line(
    fuzz: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert fuzz.main([]) == 2
    said, error = capsys.readouterr()
    assert (said, error.count("\n")) == ("", 1)
    assert "atheris" in error


@pytest.mark.usefixtures("fuzz")
def test_the_seeds_are_read(tmp_path: Path) -> None:
    from fuzz_seeds import write_seeds

    write_seeds(tmp_path)
    assert read_reduced_model(tmp_path / "seed-model").n_blades == 9
    assert read_reduced_model(tmp_path / "seed-least").contact_left is None
    assert load_sector(tmp_path / "seed-sector").hexahedra.shape == (1, 8)
    assert load_full_model(tmp_path / "seed-full").n_dofs == 24
    assert len(contents(tmp_path / "seed-response")["curves"]) == 1

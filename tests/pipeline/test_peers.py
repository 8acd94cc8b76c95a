"""The comparison with pyHarm, without pyHarm: published values, and what is said where it cannot be installed."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pipeline_support import small_scene, write_scene

from rom import linear_response, modal_model, read_reduced_model

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def peers(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import peers

    return peers


@pytest.mark.long  # the ordinary case: tests/nonlinear/test_peers_problem.py
def test_this_program_alone_meets_the_published_values(
    peers: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(peers, "CHECK_SAMPLES", 4096)
    command = ["--cases", "V1", "--curves", "1", "--no-first-use", "--out", str(tmp_path)]
    assert peers.main([*command, "--skip-pyharm"]) == 0
    found = json.loads((tmp_path / "peers.json").read_text())
    reference = found["references"]["V1"]
    rows = {row["variant"]: row for row in found["rows"]}
    # with 128 samples what others publish with 128, with very many what the exact element gives
    assert rows["sampled"]["response"] == pytest.approx(reference["agreed"], abs=2e-9)
    many, exact = [*reference["check"], reference["check_peak"]], [*reference["response"], reference["peak"]]
    assert many == pytest.approx(exact, rel=1e-6)
    assert rows["exact"]["curve"]["peak"] == pytest.approx(reference["peak"], rel=1e-9)
    for row in rows.values():
        assert row["curve"]["complete"]
        assert row["seconds"] == row["timed"][0]

    monkeypatch.setattr(peers, "compare", lambda bench, cases: found)
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    capsys.readouterr()
    assert peers.main([*command, "--env", str(tmp_path / "env")]) == 1
    printed = capsys.readouterr()
    (line,) = (line for line in printed.err.splitlines() if "not installed" in line)
    assert "pyHarm-os 1.2.2" in line
    assert "Without pyHarm: it could not be installed" in printed.out


def test_the_blade_against_ground_is_the_blade_in_its_ring(peers: Any, tmp_path: Path) -> None:
    """Stuck, in relative coordinates and units of its own, it responds as the ring at engine order N_b / 2."""
    import peers_blade
    import peers_programs
    from problems import cached_model, scene_with

    scene_file, file = write_scene(tmp_path / "small.toml", small_scene()), tmp_path / "blade.npz"
    peers_blade.write_blade(file, scene_file, tmp_path / "store")
    with np.load(file) as arrays:
        np.savez(file, **{**arrays, "load": 1e6 * arrays["load"]})
    request = peers_programs.Request("shroud", "exact", "S", 1, 1e-12, file=str(file))
    given, program = peers_programs.problem(request), peers_programs.shroud(request)
    scene = scene_with(scene_file, {"rom.modes": peers_blade.MODES, "rom.contact_dofs": "nodal"})
    model = read_reduced_model(cached_model(tmp_path / "store", scene))
    force, per_length = peers_blade.FORCE, peers_blade.FORCE / peers_blade.LENGTH
    modal = modal_model(model, rayleigh=(0.0, peers_blade.DAMPING_RATIO / (np.pi * peers_blade.HERTZ)))
    springs = {"normal": given.normal * per_length, "tangential": given.tangential * per_length}
    for w in np.linspace(*given.span, 5):
        hertz = [w * peers_blade.HERTZ]
        (expected,) = linear_response(modal, hertz, phase=modal.phase(36), force=force, **springs)
        assert program.at(w) == pytest.approx(abs(expected) / peers_blade.LENGTH, rel=1e-7)


def test_the_environment_of_this_program_is_left_alone(peers: Any) -> None:
    with pytest.raises(peers.ProgramError, match="is the environment of this program"):
        peers.peer_python(Path(sys.prefix))

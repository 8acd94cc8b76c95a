"""The sampling error of a peak (AFT) in what a run writes and prints; the report: test_report.py."""

from pathlib import Path

import h5py
import pytest
from pipeline_support import ground_scene, shroud, summary_of, write_ground_model, write_scene

from pipeline import read_results


def test_few_samples_are_told_of(tmp_path: Path) -> None:
    """Estimated and true error of 16 samples, the truth being the same curve with event-driven integration."""
    rom = write_ground_model(tmp_path / "ground.h5")
    scene = ground_scene(samples=16) | {"sweep": {"contact.integration": ["sampled", "exact"]}}
    path = write_scene(tmp_path / "scene.toml", scene)
    status, said, _ = shroud("respond", path, "--rom", rom, "--out", tmp_path / "out")
    assert status == 0
    sampled, exact = summary_of(tmp_path / "out")["curves"]
    for key, peak in (("sampling_error", "peak_amplitude_m"), ("sampling_frequency_error", "peak_frequency_hz")):
        assert exact[key] == 0.0
        assert sampled[key] == pytest.approx(abs(sampled[peak] / exact[peak] - 1.0), abs=1e-6)
    worst = max(sampled["sampling_error"], sampled["sampling_frequency_error"])
    assert worst > 0.01
    assert sampled["energy_error"] < 1e-8  # which tells nothing of it
    assert f"sampling error {100.0 * worst:.2g} %" in said
    told = " ".join(shroud("info", tmp_path / "out")[1].split())
    assert f"Time samples of the contact force change a peak by at most {100.0 * worst:.2g} %" in told
    assert "raise contact.samples" in told
    curve = read_results(tmp_path / "out").curves[0]
    with h5py.File(tmp_path / "out" / "response.h5") as file:
        for key in ("sampling_error", "sampling_frequency_error"):
            assert file["curve/0"].attrs[key] == sampled[key] == getattr(curve, key)

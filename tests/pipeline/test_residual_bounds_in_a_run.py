"""`response.residual_tractions` in a run: files, summary, notes and figure; what is refused."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5py
import numpy as np
import pytest
from pipeline_support import drawing, ground_scene, shroud, summary_of, without_lines, write_ground_model, write_scene

from pipeline import run_scene
from pipeline.results.certainty import residual_sentences
from pipeline.results.tables import bounds_text
from pipeline.stages.curve.curve_summary import read_summary


def scene(**response: Any) -> dict[str, Any]:
    values = ground_scene(integration="exact")
    values["response"] |= {"detached": False, "stability": "folds", "truncation": False, "search": "off", **response}
    return values


@pytest.fixture(scope="module")
def bounded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Output folder of a run with bounds, and what it printed."""
    folder = tmp_path_factory.mktemp("bounds")
    path, rom = (
        write_scene(folder / "s.toml", scene(residual_tractions="bounds") | {"figures": {"formats": ["svg"]}}),
        write_ground_model(folder / "g.h5"),
    )
    with drawing():
        status, printed, _ = shroud("respond", path, "--rom", rom, "--out", folder / "out")
    assert status == 0
    return folder / "out", printed


def test_files_and_summary_have_the_bounds(bounded: tuple[Path, str]) -> None:
    folder, _ = bounded
    found = summary_of(folder)["curves"][0]
    assert found["free_nodes"] > 0
    assert found["residual_least_vibration_m"] <= found["residual_highest_vibration_m"] * (1.0 + 1e-6)
    assert found["residual_least_vibration_displacement_m"] >= found["residual_lowest_m"] * (1.0 - 1e-6)
    assert found["residual_lowest_m"] <= found["peak_amplitude_m"] <= found["residual_highest_m"]
    with h5py.File(folder / "response.h5") as file:
        curve, group = file["curve/0"], file["curve/0/residual"]
        assert curve.attrs["residual_highest_m"] == found["residual_highest_m"]
        assert curve.attrs["response.residual_tractions"] == "bounds"
        amplitude = curve["amplitude_m"][()][group["band_index"][()]]
        assert np.all(group["band_lowest_m"][()] <= amplitude * (1.0 + 1e-12))
        assert np.all(amplitude <= group["band_highest_m"][()] * (1.0 + 1e-12))
        for bound in ("lowest", "highest"):
            vibration, mean = found[f"residual_{bound}_vibration_m"], abs(found[f"residual_{bound}_static_m"])
            assert max(vibration, mean) <= found[f"residual_{bound}_m"] <= (vibration + mean) * (1.0 + 1e-12)
            extreme = group[bound]
            assert extreme["slider_origin"].shape == extreme["traction"].shape == (3, 2)
            highest = extreme["amplitude_m"][()].max()
            assert highest == pytest.approx(found[f"residual_{bound}_m"], rel=1e-3)


def test_notes_and_figure_show_the_bounds(bounded: tuple[Path, str]) -> None:
    folder, printed = bounded
    with h5py.File(folder / "response.h5") as file:
        facts = read_summary(file["curve/0"])
        old = {name: value for name, value in file["curve/0"].attrs.items() if "vibration" not in name}
    assert "by residual tractions" in printed
    told = " ".join(shroud("info", folder)[1].split())
    assert bounds_text(facts) in told
    assert f"vibration {1e3 * facts.residual_highest_vibration_m:.4g}, mean" in bounds_text(facts)
    earlier = read_summary(SimpleNamespace(attrs=old))  # type: ignore[arg-type]
    assert np.isnan([earlier.residual_lowest_m, earlier.residual_highest_m]).all()
    assert "residual tractions" in (folder / "figures" / "response.svg").read_text()


def test_a_run_without_bounds_says_what_friction_leaves_open(tmp_path: Path) -> None:
    path, rom = write_scene(tmp_path / "s.toml", scene()), write_ground_model(tmp_path / "g.h5")
    run_scene(path, tmp_path / "out", rom=rom, until="respond")
    found = summary_of(tmp_path / "out")["curves"][0]
    assert found["free_nodes"] > 0
    assert found["residual_lowest_m"] is None
    with h5py.File(tmp_path / "out" / "response.h5") as file:
        assert "residual" not in file["curve/0"]
        facts = read_summary(file["curve/0"])

    open_, unique = replace(facts, free_nodes=3), replace(facts, free_nodes=0)
    (note,) = residual_sentences({0: open_, 1: unique, 2: open_}, asked=False, cone=False)
    assert note.startswith("Curves 0, 2: ")
    assert "along t1 or t2" in note  # a node that slips along one of them has a free traction along the other
    assert 'response.residual_tractions = "bounds"' in note
    assert residual_sentences({0: unique}, asked=False, cone=False) == []
    (failed,) = residual_sentences({0: unique, 1: open_}, asked=True, cone=False)
    assert failed == "Curve 1: no bounds over residual tractions were found."

    bounded = replace(
        facts, residual_lowest_m=0.9 * facts.peak_amplitude_m, residual_highest_m=facts.peak_amplitude_m
    )
    for cone in (False, True):
        (note,) = residual_sentences({0: bounded}, asked=True, cone=cone)
        assert ("estimate" in note) == cone


def test_bounds_are_refused_with_a_static_analysis_first(tmp_path: Path) -> None:
    path = write_scene(tmp_path / "s.toml", scene(residual_tractions="bounds", method="static-first"))
    rom = write_ground_model(tmp_path / "g.h5")
    status, _, error = shroud("respond", path, "--rom", rom, "--out", tmp_path / "out")
    expected = '"bounds", allowed: "projected" with response.method = "static-first"'
    assert (status, without_lines(error)) == (2, f"{path}: response.residual_tractions: {expected}\n")

"""The study `backbone` in a run: resonances beside the peaks, files, figures, what is said, what is refused."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pipeline_support import ground_scene, overlapping_texts, shroud, to_toml, write_ground_model

from pipeline import run_scene
from pipeline.codec import plain, restored
from pipeline.results.results import Results
from pipeline.studies.backbone.figure import backbone_figure
from pipeline.studies.backbone.report import backbone_section
from pipeline.studies.backbone.result import BackboneResult
from pipeline.studies.backbone.study import BackboneStudy


def scene_of(**section: Any) -> dict[str, Any]:
    """A mass on springs that rubs, at three preloads."""
    scene = ground_scene()
    scene["response"] |= {"harmonics": 1, "stability": "folds", "truncation": False, "detached": False}
    scene["sweep"] = {"contact.preload": [0.5, 1.0, 2.0]}
    return scene | {"backbone": section}


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Results]:
    """A run with two modes of each curve, and its folder."""
    folder = tmp_path_factory.mktemp("backbone")
    write_ground_model(folder / "ground.h5")
    return folder, run_scene(scene_of(modes=[1, 2]), folder / "out", rom=folder / "ground.h5")


@pytest.fixture(scope="module")
def result(done: tuple[Path, Results]) -> BackboneResult:
    """Its result, read from the file."""
    values = json.loads((done[0] / "out" / "backbone.json").read_text())
    return restored(BackboneResult, {name: values[name] for name in ("tolerance", "curves")})


def test_resonances_agree_with_the_peaks_of_the_curves(done: tuple[Path, Results], result: BackboneResult) -> None:
    run = done[1]
    assert run.complete
    assert [curve.curve for curve in result.curves] == [0, 1, 2]
    for curve, traced in zip(result.curves, run.curves, strict=True):
        first = curve.modes[0]
        assert curve.parameters == dict(traced.parameters)
        paired = [each for each in first.resonances if each.peak is not None]
        assert len(paired) == 1
        assert paired[0].peak.amplitude_m in curve.traced_m.tolist()
        assert abs(paired[0].amplitude_deviation) < 0.02 or paired[0].reasons
        assert first.complete
        assert 0.0 < first.free_hz <= first.frequency_hz.min() * (1.0 + 1e-5)
        assert first.frequency_hz.max() <= first.stuck_hz * (1.0 + 1e-5)


def test_twice_the_preload_is_twice_the_amplitude_and_force(result: BackboneResult) -> None:
    """The laws are positively homogeneous: the frequency over amplitude/preload is the same on all curves."""
    one, two = result.curves[0].modes[0], result.curves[1].modes[0]
    inside = (two.amplitude_m > 2.0 * one.amplitude_m.min()) & (two.amplitude_m < 2.0 * one.amplitude_m.max())
    assert inside.sum() > 5
    frequency = np.interp(two.amplitude_m[inside], 2.0 * one.amplitude_m, one.frequency_hz)
    np.testing.assert_allclose(two.frequency_hz[inside], frequency, rtol=2e-3)


def test_a_second_run_computes_nothing_and_draws_the_same(done: tuple[Path, Results]) -> None:
    folder, run = done
    out = folder / "out"
    assert {"figures/backbone.png", "figures/response.png"} <= set(run.summary["pictures"])
    again = run_scene(scene_of(modes=[1, 2]), out, rom=folder / "ground.h5")
    assert {again.summary["stages"][name]["status"] for name in ("respond", "study", "figures")} == {"reused"}
    bare = scene_of()
    del bare["backbone"]
    without = run_scene(bare, out, rom=folder / "ground.h5")
    assert without.summary["stages"]["figures"]["status"] == "ran"  # the modes were drawn into the response


def test_a_figure_without_any_mode(result: BackboneResult) -> None:
    none = np.empty(0)
    empty = dict.fromkeys(("frequency_hz", "damping_ratio", "amplitude_m", "force_n", "piece"), none)
    curve = result.curves[0]
    missing = replace(curve.modes[0], **empty, resonances=(), complete=False, message="no motion of mode 1")
    one = replace(result, curves=(replace(curve, modes=(missing, curve.modes[1])),))
    none_at_all = replace(result, curves=(replace(curve, modes=(missing,)),))
    figure = backbone_figure(result, "title")
    assert len(figure.axes) == 6
    assert overlapping_texts(figure) == []
    assert len(backbone_figure(one, "title").axes) == 3
    assert "no nonlinear mode" in backbone_figure(none_at_all, "title").axes[0].texts[0].get_text()
    assert any("no motion of mode 1" in line for line in backbone_section(one).conclusion)


def test_the_definition_of_the_modes_is_named(done: tuple[Path, Results], result: BackboneResult) -> None:
    said = {"first_harmonic": "damping compensated in harmonic 1", "all_harmonics": "all harmonics (Krack 2015)"}
    assert json.loads((done[0] / "out" / "backbone.json").read_text())["damping"] == "first_harmonic"
    for damping, text in said.items():
        given = replace(result, damping=damping)
        assert text in BackboneStudy().lines(given)[0]
        assert text in backbone_section(given).caption
        assert text in backbone_figure(given, "title").get_suptitle()


def test_the_report_tells_every_resonance(result: BackboneResult) -> None:
    section = backbone_section(result)
    assert {len(row) for row in section.rows} == {len(section.headings)}
    told = " ".join(cell for row in section.rows for cell in row)
    for curve in result.curves:
        assert curve.label in told
        for each in curve.modes[0].resonances:
            assert f"{each.frequency_hz:.5g}" in told
    assert plain(restored(BackboneResult, plain(result))) == plain(result)


@pytest.mark.parametrize(
    ("section", "response", "said"),
    [
        ({"modes": [1, 1]}, {}, "backbone.modes: [1, 1], allowed: a list of 1 to 20 different whole numbers"),
        ({"nodal_diameters": [2, 2]}, {}, "backbone.nodal_diameters: [2, 2], allowed:"),
        ({"amplitudes": [1.0, 0.5]}, {}, "backbone.amplitudes: [1.0, 0.5], allowed: a list of two numbers"),
        ({"curves": [3]}, {}, 'backbone.curves: [3], allowed: "all" or a list of numbers of curves, 0 to 2'),
        ({"damping": "all"}, {}, 'backbone.damping: "all", allowed: "first_harmonic" or "all_harmonics"'),
        ({"tolerance": 0.0}, {}, "backbone.tolerance: 0.0, allowed: a number above 0, 1e-6 to 1"),
        ({}, {"method": "static-first"}, 'response.method: "static-first", allowed: "coupled", with [backbone]'),
    ],
)
def test_what_does_not_fit_is_refused(
    tmp_path: Path, section: dict[str, Any], response: dict[str, Any], said: str
) -> None:
    scene = scene_of(**section)
    scene["response"] |= response
    (tmp_path / "scene.toml").write_text(to_toml(scene))
    rom = write_ground_model(tmp_path / "ground.h5")
    status, _, error = shroud("respond", tmp_path / "scene.toml", "--rom", rom, "--out", tmp_path / "out")
    assert status == 2
    assert said in error
    assert len(error.splitlines()) == 1

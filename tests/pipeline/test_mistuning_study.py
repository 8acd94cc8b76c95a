"""The study `mistuning` in a run: its numbers, files, figure, report, and what is refused."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pipeline_support import overlapping_texts, shroud, small_scene, to_toml, write_scene

from pipeline import run_scene
from pipeline.codec import plain, restored
from pipeline.results.results import Results
from pipeline.studies.mistuning.figure import mistuning_figure
from pipeline.studies.mistuning.report import mistuning_section
from pipeline.studies.mistuning.result import MistuningResult
from pipeline.studies.mistuning.study import MistuningStudy, factor_quantiles
from rom import ReducedModel, write_reduced_model

SLIPS = {"preload": 0.2}


def ring_scene(*, contact: dict[str, Any] | None = None, **section: Any) -> dict[str, Any]:
    """Six masses on springs with sliders between them."""
    return {
        "name": "ring",
        "contact": {"normal_stiffness": 0.0, "tangential_stiffness": 0.1, "friction": 1.0} | (contact or SLIPS),
        "excitation": {"engine_order": 1, "force": 0.1},
        "response": {
            "frequency": [0.15, 0.18],
            "damping_ratio": 0.005,
            "harmonics": 1,
            "stability": "folds",
            "truncation": False,
            "detached": False,
        },
        "mistuning": section,
    }


def ring_model(path: Path, n_blades: int | None = 6) -> Path:
    """A mass on a spring as a reduced model, with a contact node on either side."""
    one, face = np.ones(1), np.eye(3, 1)
    place = np.zeros((1, 3))
    write_reduced_model(
        path, ReducedModel(np.eye(1), np.eye(1), face, place, one, {"tip": one}, face, n_blades=n_blades)
    )
    return path


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Results]:
    """A run with three rings."""
    folder = tmp_path_factory.mktemp("mistuning")
    scene = ring_scene(samples=3, linear_samples=12, seed=5, stiffness_deviation=0.05)
    return folder, run_scene(scene, folder / "out", rom=ring_model(folder / "ring.h5"))


@pytest.fixture(scope="module")
def result(done: tuple[Path, Results]) -> MistuningResult:
    """Its result, read from the file."""
    return read_result(done[0] / "out")


def read_result(out: Path) -> MistuningResult:
    """The result in an output folder."""
    values = json.loads((out / "mistuning.json").read_text())
    del values["study"], values["curve_key"]
    found: MistuningResult = restored(MistuningResult, values)
    return found


def test_factors_are_those_of_the_solver(done: tuple[Path, Results], result: MistuningResult) -> None:
    """The rings again from Python: same seeds, same deviations, same peaks."""
    from nonlinear import ContactParameters, Excitation, SolverOptions
    from nonlinear.mistuned_ring.linear_sectors import LinearSectors
    from nonlinear.mistuned_ring.mistuning import Mistuning
    from nonlinear.mistuned_ring.ring_response import mistuned_response
    from rom import modal_model, read_reduced_model

    assert done[1].complete
    modal = modal_model(read_reduced_model(done[0] / "ring.h5"), damping_ratio=0.005)
    values = {"normal_stiffness": 0.0, "tangential_stiffness": 0.1, "friction": 1.0, "preload": 0.2}
    problem = modal, ContactParameters.shared(1, **values), Excitation(engine_order=1, force=0.1)
    options, spread = SolverOptions((0.15, 0.18)), {"frequency": 0.01, "stiffness": 0.05}
    tuned = mistuned_response(*problem, options).peak
    assert tuned is not None
    assert done[1].summary["curves"][0]["peak_amplitude_m"] == pytest.approx(tuned.amplitude_m, rel=1e-9)
    assert result.tuned.peak_m == pytest.approx(tuned.amplitude_m, rel=1e-9)
    assert [ring.seed for ring in result.rings] == [5, 6, 7]
    for ring in result.rings:
        peak = mistuned_response(*problem, options, Mistuning.sampled(6, ring.seed, **spread)).peak
        assert peak is not None
        assert ring.complete
        assert ring.factor == pytest.approx(peak.amplitude_m / tuned.amplitude_m, rel=1e-9)
        assert ring.blade == peak.blade
    assert max(ring.factor for ring in result.rings) > 1.02
    highest = max(result.rings, key=lambda ring: ring.factor)
    assert result.highest.seed == highest.seed
    assert result.highest.envelope_m.max() == highest.amplitude_m == result.highest.blade_amplitude_m.max()
    linear = result.linear
    assert linear is not None
    assert linear.state == "stuck"
    first, none = (
        LinearSectors.of(*problem, pattern, highest_hz=0.25).peak((0.16, 0.2))
        for pattern in (Mistuning.sampled(6, 5, **spread), Mistuning.of(6))
    )
    assert linear.factor[0] == pytest.approx(first.amplitude_m / none.amplitude_m, rel=1e-6)
    assert linear.factor.size == 12
    assert 1.0 < linear.factor.max() < result.bound


def test_report_and_figure_tell_what_was_found(done: tuple[Path, Results], result: MistuningResult) -> None:
    section = mistuning_section(result)
    assert {len(row) for row in section.rows} == {len(section.headings)}
    assert section.rows[0][1] == f"{max(ring.factor for ring in result.rings):.4g}"
    said = " ".join(MistuningStudy().lines(result))
    assert f"amplification factor {section.rows[0][1]} at most of 3 rings" in said
    assert "stuck contacts, 12 rings: 5 %" in said
    assert (done[0] / "out" / "figures" / "mistuning.png").is_file()
    figure = mistuning_figure(result, "title")
    assert overlapping_texts(figure) == []
    envelope = figure.axes[0].lines[1]
    assert float(np.max(envelope.get_ydata())) == pytest.approx(result.highest.envelope_m.max(), rel=1e-9)
    assert plain(restored(MistuningResult, plain(result))) == plain(result)
    partial = replace(result, rings=(replace(result.rings[0], complete=False, message="it ended"),), linear=None)
    assert "1 of 1 rings are not complete: it ended" in " ".join(MistuningStudy().lines(partial))
    assert len(mistuning_figure(partial, "title").axes) == 4


def test_a_list_of_deviations_is_one_ring(tmp_path: Path) -> None:
    deviations = [0.01, -0.01, 0.0, 0.02, 0.0, -0.02]
    open_gap = {"preload": 0.0}
    scene = ring_scene(contact=open_gap, frequency=deviations, frequency_range=[0.155, 0.165])
    run_scene(scene, tmp_path / "out", rom=ring_model(tmp_path / "ring.h5"))
    found = read_result(tmp_path / "out")
    assert len(found.rings) == 1
    assert found.highest.frequency_deviation.tolist() == deviations
    assert not found.drawn
    assert found.linear is not None
    assert found.linear.state == "free"
    # free blades: each alone, F / (c omega) at its own resonance, but for terms of zeta^2
    assert found.rings[0].factor == pytest.approx(1.0 / 0.98, rel=1e-4)
    assert found.linear.factor.tolist() == pytest.approx([1.0 / 0.98], rel=1e-4)
    assert found.rings[0].blade == 5


def test_intervals_of_quantiles_hold_the_quantile() -> None:
    rng, inside = np.random.default_rng(2), np.zeros((4, 400))
    for trial in range(400):
        for row, each in enumerate(factor_quantiles(rng.random(120))):
            low = -np.inf if each.low is None else each.low
            high = np.inf if each.high is None else each.high
            inside[row, trial] = low < each.level < high
    assert np.all(inside.mean(axis=1) > 0.93)
    assert [each.level for each in factor_quantiles(np.array([1.0, 2.0, np.nan]))] == [0.5]
    assert factor_quantiles(np.array([])) == ()


@pytest.mark.parametrize(
    ("section", "response", "said"),
    [
        ({"frequency": [0.01, 0.02]}, {}, "mistuning.frequency: a list of 2, allowed: a list of 72 numbers"),
        ({"linear_samples": -1}, {}, "mistuning.linear_samples: -1, allowed: a whole number, 0 to 100000"),
        ({"frequency": [0.9]}, {}, "mistuning.frequency[0]: 0.9, allowed: a list of numbers, -0.5 to 0.5"),
        (
            {"frequency_range": [300.0, 200.0]},
            {},
            "mistuning.frequency_range: [300.0, 200.0], allowed: a list of two",
        ),
        ({"samples": 0}, {}, "mistuning.samples: 0, allowed: a whole number, 1 to 1000"),
        ({}, {"method": "static-first"}, 'response.method: "static-first", allowed: "coupled", with [mistuning]'),
    ],
)
def test_what_does_not_fit_is_refused(
    tmp_path: Path, section: dict[str, Any], response: dict[str, Any], said: str
) -> None:
    scene = small_scene() | {"mistuning": section}
    scene["response"] |= response
    status, _, error = shroud("validate", write_scene(tmp_path / "scene.toml", scene))
    assert status == 2
    assert said in error


def sector_model(path: Path, *, known: bool = True) -> Path:
    """A mass on a spring that stands on a rim, as the reduced model of a sector; the masses of the rim join it."""
    left, right, blade = np.eye(3)
    own = np.outer(blade - left, blade - left)
    rim = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, 0.0], [0.0, 0.0, 0.0]])
    face, place = np.outer([1.0, 0.0, 0.0], blade), np.zeros((1, 3))
    sector = {"cyclic_right": right[None], "cyclic_left": left[None], "blade_stiffness": own if known else None}
    mass = np.diag([2.0, 2.0, 1.0])
    model = ReducedModel(mass, 5.0 * rim + own, face, place, blade, {"tip": blade}, face, n_blades=6, **sector)
    write_reduced_model(path, model)
    return path


def test_rings_on_a_disk(tmp_path: Path) -> None:
    """Their factors are those of the solver; blades that differ need their stiffness in the model."""
    from nonlinear import ContactParameters, Excitation, SolverOptions
    from nonlinear.mistuned_ring.linear_sectors import LinearSectors
    from nonlinear.mistuned_ring.mistuning import Mistuning
    from nonlinear.mistuned_ring.ring_response import mistuned_response
    from rom import modal_model, read_reduced_model

    deviations = [0.01, -0.01, 0.0, 0.02, 0.0, -0.02]
    scene = ring_scene(frequency=deviations, frequency_range=[0.14, 0.18], linear_samples=1)
    run_scene(scene, tmp_path / "out", rom=sector_model(tmp_path / "sector.h5"))
    found = read_result(tmp_path / "out")
    modal = modal_model(read_reduced_model(tmp_path / "sector.h5"), damping_ratio=0.005)
    values = {"normal_stiffness": 0.0, "tangential_stiffness": 0.1, "friction": 1.0, "preload": 0.2}
    problem = modal, ContactParameters.shared(1, **values), Excitation(engine_order=1, force=0.1)
    mistuning, options = Mistuning.of(6, frequency=deviations), SolverOptions((0.14, 0.18))
    tuned, ring = mistuned_response(*problem, options).peak, mistuned_response(*problem, options, mistuning).peak
    assert tuned is not None
    assert ring is not None
    assert found.rings[0].factor == pytest.approx(ring.amplitude_m / tuned.amplitude_m, rel=1e-9)
    assert found.rings[0].factor > 1.01
    assert found.linear is not None
    assert 1.0 < found.linear.factor[0] < found.bound
    stuck, same = (LinearSectors.of(*problem, each, highest_hz=0.25) for each in (mistuning, Mistuning.of(6)))
    range_hz = (0.9 * found.linear.tuned_hz, 1.1 * found.linear.tuned_hz)
    factor = stuck.peak(range_hz).amplitude_m / same.peak(range_hz).amplitude_m
    assert found.linear.factor[0] == pytest.approx(factor, rel=1e-6)
    (tmp_path / "scene.toml").write_text(to_toml(scene))
    rom = sector_model(tmp_path / "unknown.h5", known=False)
    status, _, error = shroud("respond", tmp_path / "scene.toml", "--rom", rom, "--out", tmp_path / "other")
    assert status == 1
    assert "blades on a disk that differ need blade_stiffness in the reduced model; without it allowed: " in error


def test_rings_with_coriolis_forces(tmp_path: Path) -> None:
    """Their factors are those of the solver."""
    from nonlinear import ContactParameters, Excitation, SolverOptions
    from nonlinear.mistuned_ring.linear_sectors import LinearSectors
    from nonlinear.mistuned_ring.mistuning import Mistuning
    from nonlinear.mistuned_ring.ring_response import mistuned_response
    from rom import modal_model

    speed, still, face = 0.06, np.zeros(2), np.eye(3, 2)  # rad/s: the frequencies are 1 and 1.1
    skew, along = 2.0 * np.array([[0.0, -1.0], [1.0, 0.0]]), np.eye(2)[0]
    model = ReducedModel(
        np.eye(2),
        np.diag([1.0, 1.21]),
        face,
        np.zeros((1, 3)),
        along,
        {"tip": along},
        face,
        n_blades=6,
        coriolis=skew,
        speed_rpm=speed * 30.0 / np.pi,
        force_centrifugal=still,
    )
    write_reduced_model(tmp_path / "turning.h5", model)
    deviations = [0.01, -0.01, 0.0, 0.02, 0.0, -0.02]
    scene = ring_scene(frequency=deviations, linear_samples=1)
    scene["load"] = {"speed_rpm": model.speed_rpm, "coriolis": True}
    scene["response"]["frequency"] = [0.14, 0.18]
    run_scene(scene, tmp_path / "out", rom=tmp_path / "turning.h5")
    found = read_result(tmp_path / "out")
    modal = modal_model(model, damping_ratio=0.005, coriolis=True)
    values = {"normal_stiffness": 0.0, "tangential_stiffness": 0.1, "friction": 1.0, "preload": 0.2}
    problem = modal, ContactParameters.shared(1, **values), Excitation(engine_order=1, force=0.1)
    mistuning, options = Mistuning.of(6, frequency=deviations), SolverOptions((0.14, 0.18))
    tuned, ring = mistuned_response(*problem, options).peak, mistuned_response(*problem, options, mistuning).peak
    assert tuned is not None
    assert ring is not None
    assert found.rings[0].factor == pytest.approx(ring.amplitude_m / tuned.amplitude_m, rel=1e-9)
    assert found.linear is not None
    stuck, same = (LinearSectors.of(*problem, each, highest_hz=0.25) for each in (mistuning, Mistuning.of(6)))
    range_hz = (0.9 * found.linear.tuned_hz, 1.1 * found.linear.tuned_hz)
    factor = stuck.peak(range_hz).amplitude_m / same.peak(range_hz).amplitude_m
    assert found.linear.factor[0] == pytest.approx(factor, rel=1e-6)


@pytest.mark.parametrize(
    ("n_blades", "said"),
    [
        (None, "mistuning: the reduced model does not say how many blades the ring has"),
        (4, "mistuning: mistuning.frequency: a list of 6, allowed: one of 4, as the model"),
    ],
)
def test_a_model_that_does_not_fit_has_no_rings(tmp_path: Path, n_blades: int | None, said: str) -> None:
    (tmp_path / "scene.toml").write_text(to_toml(ring_scene(frequency=6 * [0.01])))
    rom = ring_model(tmp_path / "ring.h5", n_blades)
    status, _, error = shroud("respond", tmp_path / "scene.toml", "--rom", rom, "--out", tmp_path / "out")
    assert status == 1
    assert said in error

"""The study `uncertainty`: closed forms of a stuck oscillator, of quantiles and of sensitivities; bad input."""

import json
import math
from dataclasses import replace
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest
from pipeline_support import MAIN_BRANCH, RAW_TEXT, overlapping_texts, shroud, small_scene, write_scene
from scipy import stats

from pipeline import run_scene
from pipeline.codec import plain, restored
from pipeline.figures.style import styled
from pipeline.scene.reading import read_scene
from pipeline.stages.scene_to_solver import contact_on_model
from pipeline.studies.study import StudyError
from pipeline.studies.uncertainty.figure import uncertainty_figure
from pipeline.studies.uncertainty.quantiles import exceedance, mixed_values, quantile, sampled_values
from pipeline.studies.uncertainty.random_field import RandomField, karhunen_loeve, random_field
from pipeline.studies.uncertainty.remarks import headline, remarks_on
from pipeline.studies.uncertainty.report import uncertainty_section
from pipeline.studies.uncertainty.result import UncertaintyResult
from pipeline.studies.uncertainty.section import Marginal
from pipeline.studies.uncertainty.sensitivities import polynomial_chaos, sobol_indices
from pipeline.studies.uncertainty.study import _without_derivative
from rom import ReducedModel, read_reduced_model, write_reduced_model

FRICTION = {"key": "contact.friction", "distribution": "normal", "deviation": 0.05}
LOGNORMAL = Marginal("excitation.force", "lognormal", 2.0, 1.3, 1e-12, 1e15)
NORMAL = Marginal("contact.friction", "normal", 0.4, 0.2, 0.3, 0.9)
UNIFORM = Marginal("contact.interference", "uniform", 1.0, 3.0, -2.0, 4.0)


@pytest.mark.parametrize("marginal", [LOGNORMAL, NORMAL, UNIFORM, Marginal("k", "lognormal", 2.0, 1.5, 1.0, 3.0)])
def test_moments_are_those_of_the_quantiles(marginal: Marginal) -> None:
    values = marginal.quantile((np.arange(400_000) + 0.5) / 400_000)
    assert np.all(np.diff(values) > 0.0)
    assert marginal.low <= values[0] < values[-1] <= marginal.high
    assert marginal.moments == pytest.approx((values.mean(), values.std()), rel=2e-4)


def test_a_random_field_has_the_covariance_of_its_correlation() -> None:
    """At each node the deviation of its distribution, between nodes the correlation exp(-(d / l)^2)."""
    position = np.column_stack([np.repeat([0.0, 4e-3, 8e-3], 2), np.tile([0.0, 3e-3], 3), np.zeros(6)])
    modes = karhunen_loeve(position, 6e-3)
    marginal = Marginal("contact.interference", "normal", 1e-5, 2e-6, -1e3, 1e3)
    field = RandomField(marginal.key, marginal, modes, np.full(6, 1e-5), np.ones(6))
    coordinates = sampled_values(field.coordinates, 1024, 0)[0]
    values = np.array([field.values(row) for row in coordinates])
    distance = np.linalg.norm(position[:, None] - position[None], axis=2)
    assert np.abs(np.cov(values.T) / 2e-6**2 - np.exp(-((distance / 6e-3) ** 2))).max() < 0.03
    assert values.mean(axis=0) == pytest.approx(np.full(6, 1e-5), rel=2e-3)
    assert karhunen_loeve(position, 1.0).shape == (6, 1)  # all nodes alike
    assert karhunen_loeve(position, 1e-4).shape == (6, 6)  # each for itself


VARIED = {"key": "contact.friction", "distribution": "lognormal", "factor": 1.2, "correlation_length": 8e-3}


def test_friction_that_varies_over_the_face(tmp_path: Path) -> None:
    """Its median is the scene's own value at each node; one field for one face."""
    tilted = {"mean": 0.4, "tilt": [0.1, 0.0]}
    tables = small_scene(contact__friction=tilted, uncertainty={"samples": 16, "parameter": [VARIED]})
    tables.pop("sweep", None)
    path = write_scene(tmp_path / "scene.toml", tables)
    results = run_scene(path, tmp_path / "out", until="reduce", quiet=True)
    rom = results.folder / results.summary["models"][0]["rom"]
    scene, model = read_scene(path).first, read_reduced_model(rom, with_basis=False)
    assert scene.uncertainty is not None
    (item,) = scene.uncertainty.parameter
    field = random_field(item, scene, rom)
    friction = contact_on_model(scene, model).friction
    assert field.values(np.zeros(len(field.coordinates))) == pytest.approx(friction)
    one = np.array(field.values([1.0, *[0.0] * (len(field.coordinates) - 1)]))
    assert np.log(one / friction) == pytest.approx(math.log(1.2) * field.modes[:, 0])
    two = {"left": model.n_contacts // 2, "right": model.n_contacts - model.n_contacts // 2}
    write_reduced_model(tmp_path / "two.h5", replace(model, interfaces=two))
    with pytest.raises(StudyError, match=r"allowed: interface\.left\.friction, interface\.right\.friction"):
        random_field(item, scene, tmp_path / "two.h5")
    tables["uncertainty"]["parameter"] = [VARIED | {"key": "excitation.force"}]
    status, _, error = shroud("validate", write_scene(path, tables))
    assert (status, error.count("\n")) == (2, 1)
    assert "uncertainty.parameter[0].correlation_length: 0.008, allowed: nothing with this key" in error


def test_samples_of_smaller_runs_are_the_first_of_larger_ones() -> None:
    few, many = sampled_values([LOGNORMAL, NORMAL], 64, 3), sampled_values([LOGNORMAL, NORMAL], 256, 3)
    for one, other in zip(few, many, strict=True):
        assert np.array_equal(one, other[:64])
    assert not np.array_equal(few[0], few[1])
    assert not np.array_equal(few[0], sampled_values([LOGNORMAL, NORMAL], 64, 4)[0])


def lognormal_sum(count: int, seed: int) -> np.ndarray:
    """Samples of a product of powers of four lognormal parameters, lognormal itself with median 1."""
    marginals = [Marginal(str(k), "lognormal", 1.0, factor, 1e-12, 1e15) for k, factor in enumerate(FACTORS)]
    return np.asarray(sampled_values(marginals, count, seed)[0].prod(axis=1))


Z95 = NormalDist().inv_cdf(0.95)
FACTORS = (1.5, 1.3, 1.2, 1.1)
DEVIATION = math.sqrt(sum(math.log(factor) ** 2 for factor in FACTORS))


@pytest.mark.parametrize("level", [0.05, 0.5, 0.95])
def test_quantiles_converge_faster_than_random_ones_and_their_intervals_hold(level: float) -> None:
    exact = math.exp(DEVIATION * NormalDist().inv_cdf(level))
    errors, random, held = {}, {}, 0
    density = NormalDist().pdf(NormalDist().inv_cdf(level))
    for count in (64, 512):
        found = [quantile(lognormal_sum(count, seed), level) for seed in range(60)]
        errors[count] = math.sqrt(np.mean([(each.value / exact - 1.0) ** 2 for each in found]))
        held += sum((e.low is None or e.low <= exact) and (e.high is None or exact <= e.high) for e in found)
        random[count] = DEVIATION * math.sqrt(level * (1.0 - level) / count) / density  # of independent samples
    assert errors[512] < 0.62 * random[512]
    assert errors[512] / errors[64] < 0.9 * random[512] / random[64]
    assert held >= 0.93 * 120


def test_samples_that_are_lower_bounds_leave_quantiles_open() -> None:
    values, open_above = np.arange(1.0, 129.0), np.zeros(128, dtype=bool)
    closed = quantile(values, 0.5, open_above)
    assert closed.at_most == closed.value == pytest.approx(64.5)
    open_above[:8] = True  # the lowest may be the highest
    assert quantile(values, 0.5, open_above).at_most == pytest.approx(72.5)
    assert quantile(values, 0.95, open_above).at_most is None
    above = exceedance(values, 100.5, open_above)
    assert (above.value, above.at_most) == (28.0 / 128.0, 36.0 / 128.0)
    values[5] = np.nan
    assert quantile(values, 0.5).value == pytest.approx(65.0)


def ishigami(x: np.ndarray) -> np.ndarray:
    return np.asarray(np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0]))


def test_sobol_indices_of_the_function_of_ishigami() -> None:
    """Closed form: Ishigami, Homma, Proc. ISUMA (1990)."""
    marginals = [Marginal(key, "uniform", 0.0, math.pi, -math.pi, math.pi) for key in "abc"]
    first, second = sampled_values(marginals, 2048, 5)
    mixed = np.stack([ishigami(mixed_values(first, second, k)) for k in range(3)])
    found = sobol_indices("abc", ishigami(first), ishigami(second), mixed, 0)
    functions = {"f_A": ishigami(first)[None], "f_B": ishigami(second)[None], "f_AB": mixed[:, None]}
    peer = stats.sobol_indices(func=functions, n=2048)
    np.testing.assert_allclose([index.first for index in found], peer.first_order, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose([index.total for index in found], peer.total_order, rtol=1e-9)
    variance = 7.0**2 / 8.0 + 0.1 * math.pi**4 / 5.0 + 0.1**2 * math.pi**8 / 18.0 + 0.5
    alone = np.array([0.5 * (1.0 + 0.1 * math.pi**4 / 5.0) ** 2, 7.0**2 / 8.0, 0.0]) / variance
    both = 0.1**2 * math.pi**8 * (1.0 / 18.0 - 1.0 / 50.0) / variance  # of the first and the third
    for index, exact, total in zip(found, alone, alone + np.array([both, 0.0, both]), strict=True):
        assert index.first == pytest.approx(exact, abs=0.04)
        assert index.total == pytest.approx(total, abs=0.04)
        assert index.first_interval[0] <= exact <= index.first_interval[1]
        assert index.total_interval[0] <= total <= index.total_interval[1]


def test_polynomial_through_the_samples_of_a_polynomial_is_exact() -> None:
    """Of z1 + 2 z2 + z1 z3, with standardised z: variances 1, 4 and 1."""
    marginals = [UNIFORM, NORMAL, LOGNORMAL]
    points, _ = sampled_values(marginals, 128, 0)
    first, second = ((points[:, k] - m.moments[0]) / m.moments[1] for k, m in enumerate(marginals[:2]))
    third = np.log(points[:, 2] / 2.0) / math.log(1.3)
    values = 5.0 + first + 2.0 * second + first * third
    found = polynomial_chaos(marginals, points, values, 0)
    assert found is not None
    assert found.leave_one_out < 1e-6
    assert [index.first for index in found.indices] == pytest.approx([1 / 6, 4 / 6, 0.0], abs=2e-3)
    assert [index.total for index in found.indices] == pytest.approx([2 / 6, 4 / 6, 1 / 6], abs=2e-3)
    rough = polynomial_chaos(marginals, points, np.where(points[:, 0] > 1.2, values, -values), 0)
    assert rough is not None
    assert rough.leave_one_out > 0.1  # a jump is no polynomial
    assert polynomial_chaos(marginals, points, np.full(128, 3.0), 0) is None


def oscillator_scene(**uncertainty: Any) -> dict[str, Any]:
    """A mass of 1 kg on 1 N/m, on a spring of 3 N/m that friction never lets slip."""
    parameters = [
        {"key": "excitation.force", "distribution": "lognormal", "factor": 1.4},
        {"key": "contact.tangential_stiffness", "distribution": "normal", "deviation": 0.3},
        {"key": "response.damping_ratio", "distribution": "uniform", "low": 0.02, "high": 0.05},
    ]
    return {
        "name": "stuck",
        "contact": {"normal_stiffness": 0.0, "tangential_stiffness": 3.0, "friction": 1e3, "preload": 1e3},
        "excitation": {"engine_order": 0, "force": 0.5},
        "response": {
            "frequency": [0.25, 0.4],
            "harmonics": 1,
            "damping_ratio": 0.035,
            **MAIN_BRANCH,
        },
        "uncertainty": {"samples": 16, "limit": 4.0, "parameter": parameters, **uncertainty},
    }


def run_study(folder: Path, scene: dict[str, Any], name: str, jobs: int = 1, until: str = "study") -> dict[str, Any]:
    """Run a scene on the oscillator; the published result."""
    one = np.ones(1)
    model = ReducedModel(np.eye(1), np.eye(1), np.eye(3, 1), np.zeros((1, 3)), one, {"tip": one})
    write_reduced_model(folder / "rom.h5", model)
    results = run_scene(scene, folder / name, rom=folder / "rom.h5", jobs=jobs, until=until, quiet=True)
    assert results.complete
    found: dict[str, Any] = json.loads((folder / name / "uncertainty.json").read_text())
    return found


def closed_form(force: np.ndarray, stiffness: np.ndarray, ratio: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Highest amplitude and its frequency of a mass with the damping of its free spring."""
    total, damping = 1.0 + stiffness, 2.0 * ratio
    amplitude = force / (damping * np.sqrt(total - damping**2 / 4.0))
    return amplitude, np.sqrt(total - damping**2 / 2.0) / (2.0 * np.pi)


def test_a_stuck_oscillator_in_closed_form(tmp_path: Path) -> None:
    scene = oscillator_scene()
    scene["response"]["residual_tractions"] = "bounds"  # solved for once, not for every sample
    found = run_study(tmp_path, scene, "out")
    curves = [json.loads(file.read_text()) for file in (tmp_path / "out" / "store" / "curve").glob("*/curve.json")]
    assert [np.isfinite(each["residual_lowest_m"]) for each in curves].count(True) == 1
    force, stiffness, ratio = (
        np.array(found["values"][p["key"]]) for p in oscillator_scene()["uncertainty"]["parameter"]
    )
    amplitude, frequency = closed_form(force, stiffness, ratio)
    np.testing.assert_allclose(found["amplitude_m"], amplitude, rtol=1e-6)
    np.testing.assert_allclose(found["frequency_hz"], frequency, rtol=1e-4)
    assert not any(found["lower_bound"])
    assert found["residual"]["lowest_m"] <= found["centre"]["amplitude_m"] * (1 + 1e-6)
    rates = {term["key"]: term for term in found["first_order"]["terms"]}
    at, step = np.array([0.5, 3.0, 0.035]), 1e-5
    for k, key in enumerate(found["values"]):
        sides = [closed_form(*(at * (1.0 + sign * step * (np.arange(3) == k)))) for sign in (1.0, -1.0)]
        exact = [(above - below) / (2.0 * step * at[k]) for above, below in zip(*sides, strict=True)]
        assert rates[key]["amplitude_rate"] == pytest.approx(exact[0], rel=1e-5)
        assert rates[key]["frequency_rate"] == pytest.approx(exact[1], rel=1e-3, abs=1e-6)
    assert found["exceedance"]["value"] == np.mean(amplitude > 4.0)
    assert "16 samples" in found["message"]


@pytest.mark.long
def test_two_workers_find_the_same_bits(tmp_path: Path) -> None:
    alone, in_workers = (run_study(tmp_path, oscillator_scene(), f"{jobs}", jobs=jobs) for jobs in (1, 2))
    for name in ("amplitude_m", "frequency_hz"):
        assert in_workers[name] == alone[name]


@pytest.mark.long
def test_amplitude_under_a_lognormal_force_is_lognormal(tmp_path: Path) -> None:
    """And first order is exact; half the samples come from the smaller run, and no branch is carried between them."""
    one = oscillator_scene(samples=16)
    one["uncertainty"]["parameter"] = one["uncertainty"]["parameter"][:1]
    before = run_study(tmp_path, one, "out")
    one["uncertainty"]["samples"] = 64
    store = tmp_path / "out" / "store"
    curves = len(list((store / "curve").iterdir()))
    found = run_study(tmp_path, one, "out")
    assert len(list((store / "curve").iterdir())) == curves + 64 - 16
    assert found["amplitude_m"][:16] == before["amplitude_m"]
    assert not (store / "extension").exists()
    median = closed_form(np.array(0.5), np.array(3.0), np.array(0.035))[0]
    for level, sampled, linear in zip(
        found["levels"], found["amplitude"]["quantiles"], found["first_order"]["amplitude"]["quantiles"], strict=True
    ):
        exact = median * 1.4 ** NormalDist().inv_cdf(level)
        assert sampled["value"] == pytest.approx(exact, rel=0.08)
        assert sampled["low"] is None or sampled["low"] <= exact
        assert sampled["high"] is None or exact <= sampled["high"]
        assert linear == pytest.approx(exact, rel=2e-3)
    assert [row["samples"] for row in found["convergence"]] == [16, 32, 64]
    assert found["polynomial"]["indices"][0]["first"] == pytest.approx(1.0)
    fitted = found["polynomial"]["percentiles"]
    assert found["polynomial"]["leave_one_out"] < 1e-5
    assert [fitted[4], fitted[94]] == pytest.approx([median * 1.4**-Z95, median * 1.4**Z95], rel=5e-3)


def test_figure_and_section_tell_what_the_samples_say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("nonlinear.response_solver.residual_bounds", lambda *_: None)  # takes longer than all curves
    scene = oscillator_scene(samples=16, sensitivities=True)
    scene["uncertainty"]["parameter"] = scene["uncertainty"]["parameter"][::2]
    found = run_study(tmp_path, scene, "one", until="figures")
    assert (tmp_path / "one" / "figures" / "uncertainty.png").is_file()
    values = {key: value for key, value in found.items() if key in UncertaintyResult.__dataclass_fields__}
    result = restored(UncertaintyResult, values)
    assert plain(result) == values
    assert found["curves"] == 1 + 4 * 16
    for index, fitted in zip(result.sobol, result.polynomial.indices, strict=True):
        assert index.total_interval[0] <= fitted.total <= index.total_interval[1]
    section = uncertainty_section(result)
    rows = {row[0]: row[1:] for row in section.rows}
    median = result.amplitude.quantiles[1]
    assert rows["worst amplitude, 50 % [m]"][0] == f"{median.value:.5g} ({median.low:.4g} to {median.high:.4g})"
    assert "variance of the amplitude by force, alone and with all others [%]" in rows
    assert "above 4 m" in section.conclusion[0]
    check_what_is_said_of_open_samples(result)


def test_a_missing_derivative_is_not_called_a_zero() -> None:
    said = _without_derivative(["contact.interference"], ["contact.preload"])
    assert said == "the derivative with respect to contact.interference is not available at the centre"
    assert _without_derivative(["contact.preload"], ["contact.preload"]).endswith("(contact.preload is 0 there)")


def check_what_is_said_of_open_samples(result: UncertaintyResult) -> None:
    """Bounds, other branches and quasi-periodic motions are counted, said and drawn."""
    first = np.arange(16) < 2
    top = replace(result.amplitude.quantiles[-1], at_most=None)
    linear = replace(result.first_order.amplitude, quantiles=(0.1, 0.2, 0.3))
    changed = replace(
        result,
        missing=1,
        incomplete=2,
        unresolved=1,
        lower_bound=first,
        branch=np.where(first, 3, 0),
        periodic=np.arange(16) != 5,
        amplitude=replace(result.amplitude, quantiles=(*result.amplitude.quantiles[:-1], top)),
        polynomial=replace(result.polynomial, leave_one_out=0.3),
        first_order=replace(result.first_order, amplitude=linear),
    )
    said = "\n".join(remarks_on(changed, "", True))
    for part in (
        "1 of 16 samples have no curve and are left out",
        "2 incomplete curves and 1 whose worst motion is not settled of 16 samples: quantiles of the amplitude are",
        "that at 95 % is without an upper bound",
        "2 of 16 worst motions lie on a detached branch",
        "1 of 16 worst motions are quasi-periodic",
        "first order and samples disagree on the quantiles of the amplitude (",
        "misses 30 % of the variance",
        "16 samples do not bound the 95 % quantile of the amplitude: take more",
    ):
        assert part in said
    assert "95 % >= " in headline(changed)
    assert "no first-order answer: the reason" in remarks_on(replace(changed, first_order=None), "the reason", False)
    with styled():
        figure = uncertainty_figure(changed, "some")
        labels = figure.axes[3].get_legend_handles_labels()[1]
        assert overlapping_texts(figure) == []
    assert {"main branch", "detached branch", "quasi-periodic", "not settled"} <= set(labels)


@pytest.mark.parametrize(
    ("changes", "scene", "complaint"),
    [
        (
            {"parameter": []},
            {},
            "uncertainty.parameter: missing, allowed: tables [[uncertainty.parameter]], one or more",
        ),
        ({"samples": 100}, {}, "uncertainty.samples: 100, allowed: a power of two, 16 to 4096"),
        ({"parameter": [FRICTION, FRICTION]}, {}, "one or more, each key once"),
        (
            {"key": "contact.law"},
            {},
            'uncertainty.parameter[0].key: "contact.law", allowed: "contact.normal_stiffness"',
        ),
        ({"sigma": 1.0}, {}, "uncertainty.parameter[0].sigma: unknown key, "),
        (
            {"relative_deviation": 0.1},
            {},
            "relative_deviation: 0.1, allowed: deviation or relative_deviation, one of",
        ),
        ({"deviation": None}, {}, "relative_deviation: not given, allowed: deviation or relative_deviation, one of"),
        ({"median": 0.4}, {}, 'parameter[0].median: 0.4, allowed: nothing with distribution = "normal"'),
        (
            {"distribution": "lognormal", "deviation": None},
            {},
            "parameter[0].factor: missing, allowed: a number above 1",
        ),
        ({"distribution": "uniform", "deviation": None, "low": 0.1}, {}, "parameter[0].high: not given, allowed: "),
        ({"low": 0.5, "high": 0.3}, {}, "parameter[0].high: 0.3, allowed: a number, -1e15 to 1e15, above low"),
        ({"low": -0.1}, {}, "parameter[0].low: -0.1, allowed: 0 to 1e+15, as contact.friction"),
        (
            {"deviation": 0.3},
            {},
            "9.1 % of the distribution lies outside 0 to 1e+15, allowed: 0.1 % at most; give low = 0",
        ),
        ({"low": 0.8, "high": 0.9}, {}, "% of the distribution, allowed: 1 % or more"),
        (
            {"key": "contact.preload", "deviation": None, "relative_deviation": 0.1},
            {},
            "mean: 0, the value of contact.pre",
        ),
        (
            {"key": "contact.normal_stiffness"},
            {"contact__normal_stiffness": "punch"},
            'parameter[0].mean: missing, allowed: a number, as contact.normal_stiffness is "punch"',
        ),
        (
            {"key": "response.damping_ratio"},
            {"response__damping_ratio": None, "response__rayleigh": [0.1, 0.0]},
            "parameter[0].key: damping is given by rayleigh",
        ),
    ],
)
def test_bad_input_is_refused_in_one_line(
    tmp_path: Path, changes: dict[str, Any], scene: dict[str, Any], complaint: str
) -> None:
    section = {key: value for key, value in changes.items() if key in ("samples", "parameter")}
    own = {key: value for key, value in (FRICTION | changes).items() if key not in section and value is not None}
    whole = small_scene(**scene) | {"uncertainty": {"parameter": [own], **section}}
    status, said, error = shroud("validate", write_scene(tmp_path / "scene.toml", whole))
    assert (status, said) == (2, "")
    assert complaint in error
    assert len(error.splitlines()) == 1
    assert not RAW_TEXT.search(error)

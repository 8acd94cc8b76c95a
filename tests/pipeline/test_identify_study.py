"""The study and the command `identify`: friction of a mass that rubs, files, figure, page, careless data."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pipeline_support import MAIN_BRANCH, RAW_TEXT, overlapping_texts, shroud, write_scene

from pipeline import identify_scene, read_scene
from pipeline.codec import restored
from pipeline.errors import InputError
from pipeline.results.results import read_results
from pipeline.scene.measured_motions import measured_motions
from pipeline.store.content_store import read_json
from pipeline.studies.identify.figure import identify_figure
from pipeline.studies.identify.result import Identification
from rom import ReducedModel, write_reduced_model

# peaks of the rubbing mass with friction 0.5: computed, then by 2 and -3 % too high and too low
ROWS = "frequency_hz,amplitude_m,excitation.force\n0.2598,0.624,0.6\n0.1983,1.338,1.0\n0.1595,36.1,2.0\n"
COLUMNS = {"frequency_hz": [0.2598, 0.1983], "amplitude_m": [0.624, 1.338], "excitation.force": [0.6, 1.0]}
OVER = {"contact.friction": [0.1, 1.0]}


def scene_of(**changes: Any) -> dict[str, Any]:
    return {
        "name": "rub",
        "contact": {"normal_stiffness": 0.0, "tangential_stiffness": 3.0, "friction": 0.3, "preload": 2.0},
        "excitation": {"engine_order": 3, "force": 1.0},
        "response": {"frequency": [0.1, 0.4], "harmonics": 1, "damping_ratio": 0.01, **MAIN_BRANCH},
        "identify": {"over": OVER, "scouts": 4},
        **changes,
    }


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("model") / "blade.h5"
    one = np.ones(1)
    blade = ReducedModel(np.eye(1), np.eye(1), np.eye(3, 1), np.zeros((1, 3)), one, {"tip": one}, n_blades=12)
    write_reduced_model(file, blade)
    return file


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory, model: Path) -> Path:
    """What `shroud identify` leaves of three peaks."""
    folder = tmp_path_factory.mktemp("identify")
    path = write_scene(folder / "s.toml", scene_of())
    (folder / "peaks.csv").write_text(ROWS)
    status, said, error = shroud("identify", path, folder / "peaks.csv", "--rom", model, "--out", folder / "out")
    assert status == 0, error
    assert "friction coefficient 0.5" in said
    return folder


def result_of(folder: Path) -> Identification:
    values = read_json(folder / "out" / "identify.json")
    result: Identification = restored(
        Identification, {k: v for k, v in values.items() if k not in ("study", "curve_key")}
    )
    return result


def test_friction_and_its_interval(done: Path) -> None:
    found = result_of(done)
    (key,) = found.keys
    assert key.value == pytest.approx(0.5, rel=0.01)
    assert key.low < 0.5 < key.high
    assert found.fits
    assert found.degrees == 5
    assert [item.amplitude for item in found.compared] == [0.624, 1.338, 36.1]
    assert [item.computed_hz for item in found.compared] == pytest.approx([0.2598, 0.1983, 0.1595], rel=5e-3)
    assert found.following
    assert found.following[0].gain > 1.0


def test_the_scene_that_is_written_has_the_values_and_their_distribution(done: Path, model: Path) -> None:
    scene = read_scene(done / "out" / "identified.toml", given_model=True).first
    (key,) = result_of(done).keys
    assert scene.contact.friction == key.value
    assert scene.identify is None
    assert scene.uncertainty is not None
    (item,) = scene.uncertainty.parameter
    assert (item.key, item.distribution, item.low, item.high) == (key.key, "lognormal", 0.1, 1.0)
    assert scene.uncertainty.correlation == ((1.0,),)


def test_values_that_are_not_found_leave_none_of_an_earlier_run(done: Path, model: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    shutil.copytree(done / "out", out)
    columns = {**COLUMNS, "amplitude_m": [0.6e6, 1.4e6]}
    with pytest.raises(RuntimeError, match="other units"):
        identify_scene(scene_of(), columns, out, rom=model, quiet=True)
    left = {path.name for path in out.rglob("*") if path.is_file() and path.relative_to(out).parts[0] != "store"}
    assert left == set()


def test_one_force_written_in_three_ways_is_one_condition(tmp_path: Path, model: Path) -> None:
    """Each has the frequency and height of a mode, as if there were two."""
    (tmp_path / "peaks.csv").write_text(
        "frequency_hz,amplitude_m,excitation.force\n0.1983,1.338,1\n0.198,1.35,1.0\n0.1986,1.33,\n"
    )
    path = write_scene(tmp_path / "s.toml", scene_of())
    assert shroud("identify", path, tmp_path / "peaks.csv", "--rom", model, "--out", tmp_path / "out")[0] == 0
    found = result_of(tmp_path)
    assert {item.label for item in found.compared} == {"force 1 N"}
    assert {curve.label for curve in found.curves} == {"force 1 N"}


def test_a_range_without_the_truth_is_told_and_nothing_is_said_to_fit(model: Path, tmp_path: Path) -> None:
    over = {"contact.friction": (0.7, 0.9)}
    found = identify_scene(scene_of(), COLUMNS, tmp_path / "out", over=over, rom=model, quiet=True)
    assert not found.fits
    assert "a wider range of contact.friction" in found.remarks[0]
    assert not any("fits" in line for line in found.untold)


def test_the_first_values_of_a_sweep_are_told_and_a_row_may_have_a_range_of_its_own(
    model: Path, tmp_path: Path
) -> None:
    """The peak lies beyond response.frequency of the scene, within that of the row."""
    beyond = {"response": {"frequency": [0.1, 0.4]}}
    measured = [{"frequency": 0.1983, "amplitude": 1.338, "at": beyond}]
    response = {**scene_of()["response"], "frequency": [0.1, 0.17]}
    scene = scene_of(
        response=response,
        identify={"over": OVER, "scouts": 4, "measured": measured},
        sweep={"excitation.force": [1.0, 2.0]},
    )
    path = write_scene(tmp_path / "s.toml", scene)
    status, said, error = shroud("identify", path, "--rom", model, "--out", tmp_path / "out")
    assert status == 0, error
    assert "friction coefficient 0.4999" in said
    assert "excitation.force is swept; what was measured without a value of it is of its first, force 1 N" in error


def test_peaks_of_sampled_forces_are_refused_and_points_of_curves_are_not(model: Path, tmp_path: Path) -> None:
    scene = scene_of()
    scene["contact"]["integration"] = "sampled"
    with pytest.raises(InputError, match=r'contact.integration: "sampled", allowed: "exact", with a measured peak'):
        identify_scene(scene, COLUMNS, tmp_path / "out", rom=model, quiet=True)
    points = {"frequency_hz": [0.19, 0.1983], "amplitude_m": [1.2, 1.338], "curve": ["a", "a"]}
    assert identify_scene(scene, points, tmp_path / "out", rom=model, quiet=True).values


def test_two_peaks_of_a_structure_with_one_mode_are_told(model: Path, tmp_path: Path) -> None:
    columns = {"frequency_hz": [0.209, 0.1983], "amplitude_m": [1.338, 1.338]}
    with pytest.raises(RuntimeError, match="5 % apart are several modes"):
        identify_scene(scene_of(), columns, tmp_path / "out", rom=model, quiet=True)


def test_a_candidate_that_is_sought_is_refused(model: Path) -> None:
    section = {"over": OVER, "measured": [{"frequency": 0.2, "amplitude": 1.0}]}
    scene = scene_of(identify={**section, "candidates": {"contact.friction": [0.2, 0.9]}})
    with pytest.raises(InputError, match=r'identify.candidates."contact.friction": which is sought'):
        identify_scene(scene, rom=model, quiet=True)


def test_a_peak_is_compared_with_that_of_its_mode(tmp_path: Path) -> None:
    """Of two modes only the second was measured; the first one is higher. A peak of none of them is told."""
    loads = np.array([1.0, 0.5])
    blade = ReducedModel(
        np.eye(2),
        np.diag([1.0, 9.0]),
        np.array([[1.0, 0.3], [0, 0], [0, 0]]),
        np.zeros((1, 3)),
        loads,
        {"tip": loads},
    )
    write_reduced_model(tmp_path / "two.h5", blade)
    scene = scene_of(response={**scene_of()["response"], "frequency": [0.1, 0.7]})
    columns = {"frequency_hz": [0.48223], "amplitude_m": [1.0385]}
    found = identify_scene(scene, columns, tmp_path / "out", rom=tmp_path / "two.h5", quiet=True)
    assert found.values["contact.friction"] == pytest.approx(0.5, rel=0.01)
    assert not any("another mode" in remark for remark in found.remarks)
    columns = {"frequency_hz": [0.35], "amplitude_m": [1.0385]}
    found = identify_scene(scene, columns, tmp_path / "none", rom=tmp_path / "two.h5", quiet=True)
    assert any("another mode" in remark for remark in found.remarks)


def test_figure_shows_every_motion(done: Path) -> None:
    assert (done / "out" / "figures" / "identify.png").is_file()
    figure = identify_figure(result_of(done), "title")
    assert figure is not None
    assert overlapping_texts(figure) == []


def test_a_run_identifies_what_its_scene_names_and_reports_it(tmp_path: Path, model: Path) -> None:
    measured = [
        {"frequency": f, "amplitude": a, "at": {"excitation": {"force": force}}}
        for f, a, force in zip(*COLUMNS.values(), strict=True)
    ]
    path = write_scene(tmp_path / "s.toml", scene_of(identify={"over": OVER, "scouts": 4, "measured": measured}))
    status, said, error = shroud("respond", path, "--rom", model, "--out", tmp_path / "out")
    assert status == 0, error
    assert "identify: misfit" in said
    assert read_results(tmp_path / "out").studies["identify"]["degrees"] == 3
    # columns in Python are the same data
    found = identify_scene(scene_of(), COLUMNS, tmp_path / "two", rom=model, quiet=True)
    assert found.misfit == pytest.approx(read_results(tmp_path / "out").studies["identify"]["misfit"], rel=1e-6)


def test_a_curve_of_a_universal_file(tmp_path: Path, model: Path) -> None:
    """Points of a response that `shroud export` wrote."""
    pytest.importorskip("pyuff")
    contact = {"normal_stiffness": 0.0, "tangential_stiffness": 3.0, "friction": 0.5, "preload": 2.0}
    scene = scene_of(contact=contact)
    del scene["identify"]
    path = write_scene(tmp_path / "s.toml", scene)
    assert shroud("respond", path, "--rom", model, "--out", tmp_path / "out")[0] == 0
    assert shroud("export", tmp_path / "out", "--to", tmp_path / "curve.uff")[0] == 0
    over = {"excitation.force": (0.5, 2.0)}
    with pytest.raises(InputError, match="times the force of the scene"):
        identify_scene(scene_of(), tmp_path / "curve.uff", tmp_path / "two", over=over, rom=model, quiet=True)
    found = identify_scene(scene_of(), tmp_path / "curve.uff", tmp_path / "two", rom=model, quiet=True)
    assert found.values["contact.friction"] == pytest.approx(0.5, rel=1e-3)
    assert {item.curve for item in found.compared} == {"1"}


def test_the_peak_of_a_sweep_is_compared_with_that_of_a_sweep(tmp_path: Path, model: Path) -> None:
    """Almost without contact, Lewis: at r = 2 a sweep shows .82287 of the peak, 2.052 half bandwidths later."""
    contact = {"normal_stiffness": 0.0, "tangential_stiffness": 1e-6, "friction": 0.3, "preload": 1e-3}
    scene = scene_of(contact=contact)
    f, ratio = 1.0 / (2.0 * np.pi), 0.012
    band = ratio * f
    columns = {
        "frequency_hz": [f + 2.052 * band],
        "amplitude_m": [0.82287 / (2.0 * ratio)],
        "rate_hz_per_s": [2.0 * np.pi * 2.0 * band**2],
    }
    over = {"response.damping_ratio": (0.005, 0.03)}
    found = identify_scene(scene, columns, tmp_path / "out", over=over, rom=model, quiet=True)
    assert found.values["response.damping_ratio"] == pytest.approx(ratio, rel=0.02)
    (item,) = found.compared
    assert item.sweep_factor == pytest.approx(0.823, abs=0.02)


@pytest.mark.parametrize(("kind", "power"), [(8, 0), (11, 1), (12, 2)])
def test_accelerations_of_a_universal_file_are_displacements(tmp_path: Path, kind: int, power: int) -> None:
    """A sample that was not measured, NaN, is left out."""
    pyuff = pytest.importorskip("pyuff")
    x = np.linspace(0.2, 0.3, 11)
    data = 3.0 * (2.0 * np.pi * x) ** power
    data[4] = np.nan
    numbers = {"ordinate_spec_data_type": kind, "abscissa_spec_data_type": 18, "func_type": 6, "load_case_id": 0}
    numbers["orddenom_spec_data_type"] = 0
    numbers |= dict.fromkeys(("rsp_node", "ref_node", "ver_num"), 1) | dict.fromkeys(("rsp_dir", "ref_dir"), 0)
    names = {f"id{k}": "NONE" for k in range(1, 6)} | {"rsp_ent_name": "tip", "ref_ent_name": "force"}
    written = pyuff.prepare_58(data=data, x=x, abscissa_spacing=0, binary=0, **numbers, **names)
    pyuff.UFF(str(tmp_path / "a.uff")).write_sets(written, mode="overwrite")
    scene = scene_of(identify={"over": OVER, "data": "a.uff"})
    motions = measured_motions(read_scene(write_scene(tmp_path / "s.toml", scene), given_model=True).first)
    assert [motion.amplitude for motion in motions] == pytest.approx([3.0] * 10, rel=1e-5)
    assert x[4] not in [motion.frequency for motion in motions]


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("frequency_hz,amplitude_m\n", "no rows"),
        ("frequency_hz,amplitude\n1,1\n", 'column "amplitude"'),
        ("frequency_hz,amplitude_m,strain\n0.2,1,1\n", "2 columns of amplitudes"),
        ("amplitude_m,rate_hz_per_s\n0.2,1\n", "frequency_hz among them"),
        ("frequency_hz,amplitude_m\n0.2,1\n0.3\n", "line 3: 1 values"),
        ("frequency_hz,amplitude_m\n0.2,1_0\n", 'line 2: amplitude_m: "1_0"'),
        ("frequency_hz,amplitude_m,excitation.force\n0.2,1,1_0\n", '"excitation.force": "1_0"'),
        ("frequency_hz,amplitude_m\n0.2,big\n", 'line 2: amplitude_m: "big"'),
        ("frequency_hz,amplitude_m\n0.2,-1\n", "line 2: amplitude: -1.0, allowed: a number above 0, at most"),
        (
            "frequency_hz,amplitude_m,curve,frequency_deviation_hz\n0.2,1,a,0.1\n",
            "0.1, allowed: a number above 0, of",
        ),
        ("frequency_hz,amplitude_m\n20,1\n", "within response.frequency"),
        ("frequency_hz,microstrain\n0.2,1\n", "amplitude_m or amplitude_mm or amplitude_um"),
        ("frequency_hz,amplitude_m,output\n0.2,1,gauge\n", 'output "gauge"'),
        ("frequency_hz,amplitude_m,contact.friction\n0.2,1,0.3\n", "which is sought"),
        ("frequency_hz,amplitude_m,contact.friktion\n0.2,1,0.3\n", 'column "contact.friktion"'),
        ("frequency_hz,amplitude_m,excitation.force\n0.2,1,-3\n", '"excitation.force": -3'),
    ],
)
def test_careless_data_get_one_line(tmp_path: Path, model: Path, rows: str, said: str) -> None:
    path = write_scene(tmp_path / "s.toml", scene_of())
    (tmp_path / "peaks.csv").write_text(rows)
    status, _, error = shroud("identify", path, tmp_path / "peaks.csv", "--rom", model, "--out", tmp_path / "out")
    assert status == 2
    assert said in error
    assert not RAW_TEXT.search(error.replace("InputError", ""))
    assert len(error.strip().splitlines()) == 1


def test_more_keys_than_numbers_and_other_units_are_refused(tmp_path: Path, model: Path) -> None:
    three = {
        "contact.friction": (0.1, 1.0),
        "contact.preload": (1.0, 4.0),
        "contact.tangential_stiffness": (1.0, 9.0),
    }
    one = {"frequency_hz": [0.2], "amplitude_m": [1.4]}
    with pytest.raises(InputError, match="3 keys beside 2 measured numbers"):
        identify_scene(scene_of(), one, tmp_path / "out", over=three, rom=model, quiet=True)
    micrometres = {**COLUMNS, "amplitude_m": [0.6e6, 1.4e6]}
    with pytest.raises(RuntimeError, match="other units"):
        identify_scene(scene_of(), micrometres, tmp_path / "out", rom=model, quiet=True)

"""response.h5, response.csv and summary.json hold what the outputs reference says, and agree with each other."""

import csv
import json
import math
import shutil
from itertools import pairwise
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from pipeline_support import SMALL, ground_scene, shroud, small_scene, summary_of, write_ground_model, write_scene

from geometry.exchange import import_sector
from nonlinear import ContactParameters, Excitation, SolverOptions
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.stability.floquet import FloquetAnalysis
from pipeline.stages.curve.curve_summary import kept_summary
from rom import modal_model, read_reduced_model

POINT_COLUMNS = [
    "frequency_hz",
    "amplitude_m",
    "harmonic_1_m",
    "static_m",
    "phase_rad",
    "stable",
    "sticking",
    "slipping",
    "separating",
    "dissipated_j",
    "iterations",
    "arc",
    "kept_harmonics",
    "growth_rate_per_s",
    "growth_nodal_diameter",
]
CURVE_KEYS = {
    "contact",
    "free_blade_m",
    "parameters",
    "rom",
    "peak_frequency_hz",
    "peak_amplitude_m",
    "points",
    "iterations",
    "seconds",
    "complete",
    "reason",
    "energy_error",
    "harmonics",
    "truncation_error",
    "truncation_branch",
    "truncation_frequency_hz",
    "motion_truncation_error",
    "sampling_error",
    "sampling_frequency_error",
    "bifurcations",
    "detached",
    "carried_from",
    "worst_amplitude_m",
    "worst_frequency_hz",
    "worst_branch",
    "worst_motion",
    "worst_scatter",
    "worst_nodal_diameter",
    "worst_ring_blades",
    "worst_searched",
    "worst_unresolved",
    "worst_open_kinds",
    "worst_at_end",
    "worst_not_counted",
    "worst_truncation_error",
    "worst_unstable",
    "worst_periods",
    "worst_recurrence",
    "worst_followed_hz",
    "worst_followed_m",
    "peak_at_end",
    "peak_stable",
    "static_force_n",
    "static_open_share",
    "static_lowest_m",
    "static_highest_m",
    "static_opened",
    "mean_m",
    "free_nodes",
    "residual_lowest_m",
    "residual_lowest_hz",
    "residual_lowest_vibration_m",
    "residual_lowest_static_m",
    "residual_highest_m",
    "residual_highest_hz",
    "residual_highest_vibration_m",
    "residual_highest_static_m",
    "residual_least_vibration_m",
    "residual_least_vibration_hz",
    "residual_least_vibration_static_m",
    "residual_least_vibration_displacement_m",
    "residual_most_vibration_m",
    "residual_most_vibration_hz",
    "residual_most_vibration_static_m",
    "residual_most_vibration_displacement_m",
}


def rows_of(folder: Path) -> list[dict[str, str]]:
    """response.csv."""
    with (folder / "response.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_csv_and_hdf5_hold_the_same_points(finished: Path) -> None:
    rows = rows_of(finished)
    assert list(rows[0]) == ["curve", "contact.interference_m", *POINT_COLUMNS, "branch"]
    with h5py.File(finished / "response.h5") as file:
        assert sorted(file["curve"]) == ["0", "1"]
        for index, v0 in enumerate((1e-5, 1e-3)):
            mine = [row for row in rows if row["curve"] == str(index) and row["branch"] == "0"]
            group = file[f"curve/{index}"]
            assert (
                {float(row["contact.interference_m"]) for row in mine}
                == {v0}
                == {group.attrs["contact.interference"]}
            )
            for name in POINT_COLUMNS:
                values = group[name.removesuffix("_per_s")][()]
                np.testing.assert_array_equal([float(row[name]) for row in mine], values, err_msg=name)


def test_a_summary_beside_its_curve_is_that_of_the_file(finished: Path, tmp_path: Path) -> None:
    """Types included, and nan where there is no number."""
    files = [*(finished / "store" / "curve").glob("*/curve.h5")]
    assert files
    for file in files:
        assert file.with_suffix(".json").is_file()
        alone = Path(shutil.copy(file, tmp_path))
        assert repr(kept_summary(file)) == repr(kept_summary(alone))


def test_hdf5_holds_the_coefficients(finished: Path) -> None:
    with h5py.File(finished / "response.h5") as file:
        group = file["curve/0"]
        points = len(group["frequency_hz"])
        for name in ("relative_displacement", "contact_force"):
            assert group[name].shape == (points, 2, 4, 3)
            assert group[name].dtype == np.complex128
            assert np.all(group[name][:, 0].imag == 0.0)
        contact = group["contact_force"][()]
        # N is pressure on the right face: its mean on the right node points against the normal
        assert np.all(contact[:, 0, :, 2].real <= 0.0)


def test_hdf5_names_every_parameter_with_its_table(finished: Path) -> None:
    with h5py.File(finished / "response.h5") as file:
        attributes = dict(file["curve/1"].attrs)
    for section in ("contact", "response"):
        for key, value in SMALL[section].items():
            if key != "interference":
                np.testing.assert_array_equal(attributes[f"{section}.{key}"], value)
    assert attributes["excitation.engine_order"] == 36
    assert attributes["excitation.force"] == 0.2
    assert attributes["contact.interference"] == 1e-3
    assert attributes["contact.preload"] == 0.0


def test_punch_becomes_numbers(finished: Path, tmp_path: Path) -> None:
    rom = finished / summary_of(finished)["curves"][0]["rom"]
    punch = {"contact__normal_stiffness": "punch", "contact__tangential_stiffness": "punch"}
    scene = small_scene(**punch, response__stability="ring")
    path = write_scene(tmp_path / "s.toml", scene)
    assert shroud("respond", path, "--rom", rom, "--out", tmp_path / "out", "--quiet")[0] == 0
    area = float(read_reduced_model(rom).contact_area.sum())
    assert area == pytest.approx(0.012 * 0.005, rel=1e-6)
    reduced_modulus = 210e9 / (2 * (1 - 0.3**2))
    normal = 2 * math.sqrt(area / math.pi) * reduced_modulus
    with h5py.File(tmp_path / "out" / "response.h5") as file:
        attributes = dict(file["curve/0"].attrs)
        middle = len(file["curve/0/frequency_hz"]) // 2
        frequency, growth = (file[f"curve/0/{name}"][middle] for name in ("frequency_hz", "growth_rate"))
    assert attributes["contact.normal_stiffness"] == pytest.approx(normal, rel=1e-12)
    assert attributes["contact.tangential_stiffness"] == pytest.approx(normal * 1.4 / 1.7, rel=1e-12)
    assert growth == pytest.approx(slowest_decay(rom, normal, 2.0 * math.pi * frequency), rel=5e-3)


def slowest_decay(rom: Path, normal: float, omega: float) -> float:
    """Largest real part of the exponents of the ring with stuck contacts, nodal diameter by nodal diameter."""
    modal = modal_model(read_reduced_model(rom), damping_ratio=0.01)
    values = {"normal_stiffness": normal, "tangential_stiffness": normal * 1.4 / 1.7, "friction": 0.4}
    contact = ContactParameters.shared(modal.n_contacts, **values, interference=1e-5, area=modal.area)
    options = SolverOptions((300.0, 700.0), integration="sampled", samples=64)
    balance = build_harmonic_balance(modal, contact, Excitation(36, 0.2), options)
    displacement = np.zeros((3, modal.n_contacts, 3))
    jacobian = balance.element.evaluate(displacement).jacobian
    found = [
        FloquetAnalysis.of(balance.receptance, contact, kappa=2.0 * math.pi * k / 72).exponents(
            displacement, jacobian, omega
        )
        for k in range(1, 37)
    ]
    return max(float(each[0].real) for each in found if each.size)


def test_summary_has_the_peaks_of_the_curves(finished: Path) -> None:
    summary = summary_of(finished)
    rows = rows_of(finished)
    assert summary["complete"] is True
    for index, curve in enumerate(summary["curves"]):
        assert set(curve) == CURVE_KEYS
        mine = [row for row in rows if row["curve"] == str(index) and row["branch"] == "0"]
        highest = max(mine, key=lambda row: float(row["amplitude_m"]))
        assert curve["points"] == len(mine)
        assert curve["iterations"] == sum(int(row["iterations"]) for row in mine)
        assert curve["peak_amplitude_m"] == pytest.approx(float(highest["amplitude_m"]), rel=1e-9)
        assert curve["peak_frequency_hz"] == pytest.approx(float(highest["frequency_hz"]), rel=1e-6)
        assert 0.0 <= curve["energy_error"] < 1e-6
        assert curve["harmonics"] == 1
        lasting = max((row for row in mine if row["stable"] == "1"), key=lambda row: float(row["amplitude_m"]))
        assert curve["worst_amplitude_m"] == pytest.approx(float(lasting["amplitude_m"]), rel=1e-9)
        assert (curve["worst_branch"], curve["worst_motion"]) == (0, "periodic")


def test_summary_leads_to_the_models(finished: Path) -> None:
    summary = summary_of(finished)
    (model,) = summary["models"]
    assert {curve["rom"] for curve in summary["curves"]} == {model["rom"]}
    reduced = read_reduced_model(finished / model["rom"])
    sector = import_sector(finished / model["mesh"])
    assert reduced.n_contacts == len(sector.right.nodes) == 4
    assert model["dofs"] == 3 * len(sector.points)
    frequencies = [model["free_hz"], model["sliding_hz"]["36"], model["stuck_hz"]["36"]]
    for values in frequencies:
        assert len(values) == 10
        assert values == sorted(values)
    # springs can only raise frequencies
    for softer, stiffer in pairwise(frequencies):
        assert all(a <= b * (1 + 1e-12) for a, b in zip(softer, stiffer, strict=True))


def test_lists_and_several_keys_in_the_csv(tmp_path: Path) -> None:
    rom = write_ground_model(tmp_path / "g.h5")
    v0 = [[0.0, 0.1, 0.2], [0.3, 0.3, 0.3]]
    quick = {"stability": "folds", "detached": False, "truncation": False, "search": "off"}
    scene = ground_scene(preload=0.0) | {"sweep": {"contact.interference": v0, "response.harmonics": [1, 3]}}
    scene["response"] |= quick
    path = write_scene(tmp_path / "s.toml", scene)
    assert shroud("respond", path, "--rom", rom, "--out", tmp_path / "out", "--quiet", "--jobs", 1)[0] == 0
    rows = rows_of(tmp_path / "out")
    assert list(rows[0])[:4] == ["curve", "contact.interference_m", "response.harmonics", "frequency_hz"]
    assert "harmonic_3_m" in rows[0]
    cases = {(row["curve"], row["contact.interference_m"], row["response.harmonics"]) for row in rows}
    assert cases == {(str(2 * i + j), json.dumps(v0[i]), str(h)) for i in (0, 1) for j, h in ((0, 1), (1, 3))}
    assert all((row["harmonic_3_m"] == "") == (row["response.harmonics"] == "1") for row in rows)


def test_info_tells_what_files_hold(finished: Path) -> None:
    status, said, _ = shroud("info", finished / "response.h5")
    assert status == 0
    assert "2 curves" in said
    assert "contact.friction = 0.4" in said
    status, said, _ = shroud("info", finished / summary_of(finished)["curves"][0]["rom"])
    assert status == 0
    assert "72 blades" in said
    assert "4 nodes" in said


def test_harmonics_chosen_curve_by_curve(finished: Path, tmp_path: Path) -> None:
    rom = finished / summary_of(finished)["curves"][0]["rom"]
    sweep = {"contact.interference": [-1e-2, 1e-5]}
    exact: dict[str, Any] = {
        "contact__integration": "exact"
    }  # 64 samples a period are too few for the harmonics of this tolerance
    exact |= {"response__detached": False, "response__stability": "folds", "response__search": "off"}
    scene = small_scene(response__harmonics="auto", response__tolerance=1e-3, sweep=sweep, **exact)
    path = write_scene(tmp_path / "s.toml", scene)
    status, _, error = shroud("respond", path, "--rom", rom, "--out", tmp_path / "out", "--quiet", "--jobs", 1)
    assert (status, error) == (0, "")
    free, slipping = summary_of(tmp_path / "out")["curves"]
    assert free["harmonics"] == 1  # linear: nothing is left out
    assert slipping["harmonics"] > 1
    assert 0.0 < slipping["truncation_error"] <= 1e-3
    with (tmp_path / "out" / "response.csv").open() as file:
        rows = list(csv.DictReader(file))
    last = f"harmonic_{slipping['harmonics']}_m"
    assert {row[last] for row in rows if row["curve"] == "0"} == {""}
    assert all(float(row[last]) >= 0.0 for row in rows if row["curve"] == "1")

"""A blade at speed from the scene to the summary: equilibrium, Coriolis forces, what is said about them."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5py
import numpy as np
import pytest
from pipeline_support import (
    ground_scene,
    shroud,
    small_scene,
    summary_of,
    write_ground_model,
    write_scene,
)

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from pipeline.report import error_budget
from pipeline.report.viewer import ViewerData
from pipeline.results.certainty import error_sentences
from pipeline.scene.reading import read_scene
from pipeline.stages.cache_keys import curve_key, model_keys
from pipeline.stages.curve.curve_file import modes_of_curve
from pipeline.stages.model.modal_truncation import stored_coriolis_error
from pipeline.stages.model.model_chain import BuiltModel
from pipeline.store.content_store import Store
from rom import Material, inter_blade_phase, modal_model, natural_frequencies, read_reduced_model
from rom.cyclic.natural_frequencies import gyroscopic_frequencies
from rom.files.full_model_file import load_full_model
from rom.files.sector_file import load_sector
from rom.finite_elements.rotation import centrifugal_displacement, stiffen_by_rotation

SPEED = 9000.0
CHANGES = {
    "load__speed_rpm": SPEED,
    "load__coriolis": False,
    "blade__twist": 25.0,
    "mesh__size": 0.012,
    "contact__interference": -1e-3,
    "rom__contact_dofs": "nodal",  # the displacements of the full model are those of nodes
}
SWEEP = {"load.equilibrium": ["nonlinear", "linear"]}


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Folder of a run with both equilibria, and what it said."""
    folder = tmp_path_factory.mktemp("speed")
    scene = write_scene(folder / "scene.toml", small_scene(**CHANGES, sweep=SWEEP))
    status, said, error = shroud("run", scene, "--out", folder / "out", "--until", "respond", "--jobs", "1")
    assert status == 0, error
    return folder, said


def test_the_static_displacement_is_that_of_the_nonlinear_equilibrium(finished: tuple[Path, str]) -> None:
    """The contacts stay open: harmonic 0 of the response is the displacement of the full model."""
    folder, _ = finished
    (matrices,) = (folder / "out" / "store" / "assemble").glob("*/full.h5")
    (mesh,) = (folder / "out" / "store" / "mesh").glob("*/sector.h5")
    full, sector = load_full_model(matrices), load_sector(mesh)
    at_speed = stiffen_by_rotation(full, sector, Material(210e9, 0.3, 7850.0), SPEED)
    squared = (SPEED * np.pi / 30.0) ** 2
    exact = squared * centrifugal_displacement(at_speed).reshape(-1, 3)
    right, left = (
        np.einsum("kij,kj->ki", face.frame, exact[full.vertex_node[face.nodes]])
        for face in (sector.right, sector.left)
    )
    with h5py.File(folder / "out" / "response.h5") as file:
        relative = file["curve/0/relative_displacement"][0, 0].real
    np.testing.assert_allclose(relative, right - left, atol=1e-8 * np.abs(right - left).max())
    linear = squared * centrifugal_displacement(full).reshape(-1, 3)
    tip = full.vertex_node[sector.node_sets["tip"][0]]
    with h5py.File(folder / "out" / "response.h5") as file:
        assert file["curve/0/static_m"][0] == pytest.approx(exact[tip, 1], rel=1e-8)
    assert abs(linear[tip, 1] / exact[tip, 1] - 1.0) > 1e-4


def test_the_equilibrium_is_part_of_the_model_and_the_neglected_forces_are_known(finished: tuple[Path, str]) -> None:
    folder, _ = finished
    models = summary_of(folder / "out")["models"]
    assert len(models) == 2
    free = np.array([model["free_hz"] for model in models])
    assert 1e-6 < np.abs(free[1] / free[0] - 1.0).max() < 1e-2
    model = read_reduced_model(folder / "out" / models[0]["rom"])
    phase = inter_blade_phase(36, 72)
    changes = []
    for springs in ((0.0, 0.0), (2e5 / 4, 0.0), (2e5 / 4, 1.5e5 / 4)):
        kinds = {"normal": springs[0], "tangential": springs[1]}
        still = natural_frequencies(model, phase, **kinds)
        inside = (still >= 300.0) & (still <= 700.0)
        changes.extend(np.abs(gyroscopic_frequencies(model, phase, **kinds) / still - 1.0)[inside])
    assert models[0]["coriolis_error"] == pytest.approx(max(changes), rel=1e-4)
    assert max(changes) > 1e-5
    info = " ".join(shroud("info", folder / "out")[1].split())
    assert "Coriolis forces are neglected: they change natural frequencies in the range by" in info


def test_at_rest_the_equilibrium_is_no_input(tmp_path: Path) -> None:
    for equilibrium in ("nonlinear", "linear"):
        changes = CHANGES | {"load__speed_rpm": 0.0, "load__equilibrium": equilibrium}
        scene = write_scene(tmp_path / "scene.toml", small_scene(**changes))
        status, said, _ = shroud("run", scene, "--out", tmp_path / "out", "--until", "respond", "--jobs", "1")
        assert status == 0
        (model,) = summary_of(tmp_path / "out")["models"]
        assert model["coriolis_error"] == 0.0
        assert "Coriolis" not in said
    assert summary_of(tmp_path / "out")["stages"]["reduce"]["ran"] == 0


def test_of_a_given_model_without_its_coriolis_matrix_the_effect_is_not_known(
    finished: tuple[Path, str], tmp_path: Path
) -> None:
    folder, _ = finished
    rom = tmp_path / "rom.h5"
    rom.write_bytes((folder / "out" / summary_of(folder / "out")["models"][0]["rom"]).read_bytes())
    scene = read_scene(write_scene(tmp_path / "scene.toml", small_scene(**CHANGES))).first
    store = Store(tmp_path / "store")
    assert stored_coriolis_error(store, BuiltModel("whole", rom, None, {}), scene) > 1e-5
    with h5py.File(rom, "r+") as file:
        del file["coriolis"]
    assert stored_coriolis_error(store, BuiltModel("other", rom, None, {}), scene) is None
    said = error_sentences({}, [{"coriolis_error": 1e-3}, {"coriolis_error": None}])
    assert said[-1].startswith("Coriolis forces are neglected: their effect is not known")


def test_coriolis_forces_act_where_the_scene_asks_for_them(tmp_path: Path) -> None:
    skew = np.zeros((12, 12))
    skew[9, 11], skew[6, 8], skew[3, 5] = 1.0, 2.0, 2.0
    turning: Any = {"coriolis": skew - skew.T, "speed_rpm": 3.0, "force_centrifugal": np.zeros(12)}
    model = read_reduced_model(rom := write_ground_model(tmp_path / "rom.h5", **turning))
    scene = {**ground_scene(), "load": {"speed_rpm": 3.0}}
    contact = ContactParameters(
        **{name: np.array(scene["contact"][name]) for name in ("friction", "preload")},
        normal_stiffness=np.array([0.8, 0.7, 0.9]),
        tangential_stiffness=np.array([0.4, 0.5, 0.3]),
        interference=np.zeros(3),
        law="two_sliders",
    )
    options = SolverOptions(frequency_hz=(0.1, 0.3), integration="sampled", samples=128, stability="folds")
    scene["response"] |= {"stability": "folds", "search": "off"}
    path = write_scene(tmp_path / "scene.toml", {**scene, "sweep": {"load.coriolis": [True, False]}})
    assert shroud("respond", path, "--rom", rom, "--out", tmp_path / "out", "--quiet")[0] == 0
    peaks = []
    with h5py.File(tmp_path / "out" / "response.h5") as file:
        for curve, acts in (("curve/0", True), ("curve/1", False)):
            modal = modal_model(model, rayleigh=(0.0, 0.02), coriolis=acts)
            direct = forced_response(modal, contact, Excitation(engine_order=0, force=0.5), options)
            np.testing.assert_allclose(file[curve]["amplitude_m"][()], direct.amplitude_m, rtol=1e-12)
            peaks.append(direct.peak.amplitude_m)
            attributes = dict(file[curve].attrs)
            assert modes_of_curve(model, attributes).turns == acts
            attributes.pop("load.coriolis")
            assert not modes_of_curve(model, attributes).turns  # a file of an earlier version
    assert abs(peaks[1] / peaks[0] - 1.0) > 0.01
    (entry,) = summary_of(tmp_path / "out")["models"]
    assert entry["coriolis_error"] > 0.0
    assert not entry["coriolis_included"]  # not in all curves


def test_shapes_of_modes_say_that_they_are_without_coriolis_forces(tmp_path: Path) -> None:
    """Where these act: the frequency beside a shape is not that of the table of natural frequencies."""
    keys = {"load__speed_rpm": 3000.0, "mesh__size": 0.012, "render": {"modes": [1]}}
    scene = write_scene(tmp_path / "scene.toml", small_scene(**keys))
    assert shroud("run", scene, "--out", tmp_path / "out", "--until", "reduce", "--quiet")[0] == 0
    (entry,) = summary_of(tmp_path / "out")["models"]
    rom, mesh = tmp_path / "out" / entry["rom"], tmp_path / "out" / entry["mesh"]
    first = read_scene(scene).first
    for acts in (True, False):
        load = first.load.model_copy(update={"coriolis": acts})
        data = ViewerData()
        springs = {"free": {"normal": 0.0, "tangential": 0.0}}
        data.add_modes(BuiltModel("key", rom, mesh, {}), first.model_copy(update={"load": load}), springs, "")
        assert data.shapes[0]["name"].endswith("without Coriolis forces") == acts
    said = shroud("export", rom, "--to", tmp_path / "s.vtu", "--mesh", mesh)[1]
    assert "mode shapes without Coriolis forces" in said


def test_keys_change_with_coriolis_forces_where_these_act(tmp_path: Path) -> None:
    def keys(speed: float, coriolis: bool) -> tuple[str, str]:
        changes = {"load__speed_rpm": speed, "load__coriolis": coriolis}
        scene = read_scene(write_scene(tmp_path / "scene.toml", small_scene(**changes))).first
        return model_keys(scene).reduce, curve_key(scene, "model")

    assert keys(0.0, True) == keys(0.0, False)
    assert keys(SPEED, True)[0] == keys(SPEED, False)[0]
    assert keys(SPEED, True)[1] != keys(SPEED, False)[1]


def test_it_is_said_whether_coriolis_forces_are_included() -> None:
    acting, left_out = {"coriolis_error": 2e-3, "coriolis_included": True}, {"coriolis_error": 1e-3}
    included = "Coriolis forces are included; they change natural frequencies in the range by 0.2 %."
    assert error_sentences({}, [acting])[1:] == [included]
    both = error_sentences({}, [acting, left_out])[1:]
    assert both == ["Coriolis forces are neglected: they change natural frequencies in the range by 0.1 %.", included]
    source: Any = SimpleNamespace(model_rows=[acting])
    assert [(row.found, row.verdict) for row in error_budget._coriolis(source)] == [("included", "small")]
    source.model_rows = [acting, {"coriolis_error": None}]
    assert [row.verdict for row in error_budget._coriolis(source)] == ["not known"]


@pytest.mark.parametrize(
    ("errors", "verdicts"),
    [((0.0, 0.0), []), ((0.0, 2e-3), ["small"]), ((2e-3, 0.1), ["large"]), ((None, 0.0), ["not known"])],
)
def test_the_error_budget_has_the_coriolis_forces(errors: tuple[float | None, ...], verdicts: list[str]) -> None:
    source: Any = SimpleNamespace(model_rows=[{"coriolis_error": error} for error in errors])
    assert [row.verdict for row in error_budget._coriolis(source)] == verdicts


def test_a_speed_without_an_equilibrium_is_refused_in_one_line(tmp_path: Path) -> None:
    """The strain of the centrifugal force alone is below 2 % here; bending and untwisting add to it."""
    changes = {"load__speed_rpm": 2.1e4, "blade__length": 0.4, "blade__thickness": 0.002}
    scene = write_scene(tmp_path / "scene.toml", small_scene(**CHANGES | changes))
    status, _, error = shroud("run", scene, "--out", tmp_path / "out", "--until", "respond", "--quiet")
    assert status == 2
    assert "load.speed_rpm: 21000.0, allowed: a lower speed: no static equilibrium" in error
    assert error.count("\n") == 1


def test_verify_says_what_the_linear_equilibrium_costs(
    finished: tuple[Path, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, _ = finished

    def no_other_mesh(*_: object) -> None:
        raise RuntimeError("no other mesh in this test")

    monkeypatch.setattr("pipeline.verify.compare.other_sector", no_other_mesh)
    options = ("--out", folder / "out", "--tolerance", "0.5", "--quiet")
    status, said, _ = shroud("verify", folder / "scene.toml", *options, "--json")
    assert status == 0
    nonlinear, linear = json.loads(said)["cases"]
    assert nonlinear["equilibrium"] is None
    changes = [
        abs(found / exact - 1.0)
        for one, other in zip(linear["joints"], nonlinear["joints"], strict=True)
        for found, exact, inside in zip(one["full_hz"], other["full_hz"], other["within"], strict=True)
        if inside
    ]
    assert linear["equilibrium"] == pytest.approx(max(changes), rel=1e-5)  # of two frequencies, each to 1e-9
    said = shroud("verify", folder / "scene.toml", *options[:-1])[1]
    assert said.count('load.equilibrium = "linear" instead of "nonlinear" changes a frequency by') == 1

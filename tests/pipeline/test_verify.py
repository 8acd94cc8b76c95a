"""`shroud verify` and `rom.modes = "auto"`: numbers against computations of the test's own, advice that holds."""

import json
import re
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pipeline_support import ground_scene, shroud, small_scene, statuses, summary_of, write_scene
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import eigsh

import pipeline.verify.advice
import pipeline.verify.compare
import pipeline.verify.stage
from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
from pipeline.codec import plain, restored
from pipeline.verify.advice import finer_size, mesh_dofs
from pipeline.verify.model_errors import ORDER, JointErrors, ModelErrors, OtherMesh, fitted_order
from rom import Material, assemble
from rom.files.full_model_file import load_full_model
from rom.files.sector_file import load_sector

TWISTED = {
    "blade__section": "lens",
    "blade__twist": 25.0,
    "mesh__element": "hex20",
    "mesh__size": 0.014,
    "response__frequency": [150.0, 600.0],
}

COARSE = {"mesh__element": "hex20", "mesh__size": 0.018}
STIFF = {"contact__normal_stiffness": "punch", "contact__tangential_stiffness": "punch"}


def verify(folder: Path, *options: object, **changes: Any) -> tuple[int, str, str]:
    """`shroud verify` on the changed small scene."""
    path = write_scene(folder / "scene.toml", small_scene(**{"mesh__size": 0.012} | changes))
    return shroud("verify", path, "--out", folder / "out", *options)


def verified(folder: Path, *options: object, **changes: Any) -> dict[str, Any]:
    """What `shroud verify --json` prints for the changed small scene."""
    status, said, error = verify(folder, "--json", "--quiet", *options, **changes)
    assert (status, error) == (0, "")
    values: dict[str, Any] = json.loads(said)
    return values


@pytest.fixture
def no_other_mesh(monkeypatch: pytest.MonkeyPatch) -> None:
    """There is no other mesh, whose errors cost most of the time: for tests that are not about them."""

    def fail(*_: Any) -> Any:
        raise RuntimeError("made to fail")

    monkeypatch.setattr(pipeline.verify.compare, "other_sector", fail)


def directly(folder: Path, normal: float, tangential: float, count: int) -> Any:
    """Lowest natural frequencies in Hz of the full model in the store, neighbours in opposition, springs per node."""
    (matrices,) = (folder / "out" / "store" / "assemble").glob("*/full.h5")
    (mesh,) = (folder / "out" / "store" / "mesh").glob("*/sector.h5")
    full, sector = load_full_model(matrices), load_sector(mesh)
    n_c = len(sector.right.nodes)
    relative = np.zeros((full.n_dofs, 3 * n_c))
    for face in (sector.right, sector.left):  # in opposition, right - (-1) left
        for k in range(n_c):
            dofs = 3 * full.vertex_node[face.nodes[k]] + np.arange(3)
            relative[dofs, 3 * k : 3 * k + 3] += face.frame[k].T
    springs = csc_matrix(relative * np.tile([tangential, tangential, normal], n_c)) @ csc_matrix(relative).T
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    stiffness, mass = (full.stiffness + springs).tocsc()[free][:, free], full.mass.tocsc()[free][:, free]
    squared = eigsh(stiffness, count, mass, sigma=0.0, return_eigenvectors=False)
    return np.sqrt(np.sort(squared)) / (2 * np.pi)


@pytest.mark.usefixtures("no_other_mesh")
def test_frequencies_are_those_of_the_full_model_without_reduction(tmp_path: Path) -> None:
    case = verified(tmp_path, rom__contact_dofs="nodal", **COARSE, rom__modes=2)["cases"][0]
    joints = {"free": (0.0, 0.0), "sliding": (2e5, 0.0), "stuck": (2e5, 1.5e5)}
    assert [joint["joint"] for joint in case["joints"]] == list(joints)
    for joint in case["joints"]:
        normal, tangential = joints[joint["joint"]]
        last = joint["first_mode"] - 1 + len(joint["full_hz"])
        exact = directly(tmp_path, normal / 4, tangential / 4, last)[joint["first_mode"] - 1 :]
        np.testing.assert_allclose(joint["full_hz"], exact, rtol=1e-8)
        errors = np.array(joint["reduced_hz"]) / exact - 1.0
        np.testing.assert_allclose(joint["modes_error"], errors, rtol=1e-3)
        assert np.all(errors > 1e-6)
    assert case["static"] < 1e-8


@pytest.mark.usefixtures("no_other_mesh")
@pytest.mark.long
def test_averages_over_patches_are_measured_against_a_reference_of_their_own(tmp_path: Path) -> None:
    fine = {**TWISTED, "rom__modes": 20}
    found = verified(tmp_path, sweep={"rom.contact_dofs": ["nodal", "patch"]}, **fine)
    assert [case["label"] for case in found["cases"]] == ["contact dofs nodal", "contact dofs patch"]
    for case in found["cases"]:
        assert case["static"] < 1e-8
        assert 0.0 < case["receptance_error"] < 0.03
    nodal, patch = ([joint["full_hz"][0] for joint in case["joints"]] for case in found["cases"])
    assert nodal[0] == pytest.approx(patch[0], rel=1e-8)  # free: the same blade
    assert abs(nodal[2] / patch[2] - 1.0) > 1e-6  # stuck: other joints


@pytest.mark.long
def test_following_the_advice_brings_the_promised_error(tmp_path: Path) -> None:
    coarse = {**TWISTED, **STIFF, "mesh__size": 0.009, "mesh__grading": 1.0, "rom__contact_dofs": "nodal"}
    coarse |= {"rom__modes": 4, "rom__tolerance": 0.006, "response__frequency": [150.0, 2000.0]}
    before = verified(tmp_path, **coarse)
    (advice,) = before["advice"]
    assert not advice["within"]
    said = re.fullmatch(
        r"error of the contact dofs .* % of a frequency, mesh error .* %, modal truncation error .* %;"
        r" for a tolerance of 0.6 %: set rom.contact_dofs = \"mortar\" and"
        r" lower mesh.size from 9 mm to (\S+) mm \((\d+) dofs\) and raise rom.modes from 4 to (\d+) .*",
        advice["text"],
    )
    assert said is not None, advice["text"]
    size, dofs, modes = float(said[1]) / 1000.0, int(said[2]), int(said[3])
    assert advice["needed_modes"] < modes < 1.3 * advice["needed_modes"]  # the mesh is to change too
    changed = coarse | {"mesh__size": size, "rom__modes": modes, "rom__contact_dofs": "mortar"}
    assert shroud("validate", write_scene(tmp_path / "advised.toml", small_scene(**changed)))[0] == 0
    after = verified(tmp_path, **changed)
    assert advice["advised_dofs"] == dofs
    assert after["cases"][0]["dofs"] == pytest.approx(dofs, rel=0.2)
    assert after["advice"][0]["within"]
    assert after["advice"][0]["text"].endswith("for a tolerance of 0.6 %: nothing to do")
    # against a mesh that neither of the two has seen, with the modes that it takes there to be exact
    fine = {"mesh__size": 0.004, "mesh__grading": 8.0, "rom__modes": 60, "rom__contact_dofs": "mortar"}
    scene = write_scene(tmp_path / "fine.toml", small_scene(**(coarse | fine)))
    assert shroud("run", scene, "--out", tmp_path / "fine", "--until", "reduce", "--quiet")[0] == 0
    model = summary_of(tmp_path / "fine")["models"][0]
    for joint, true in ((0, model["free_hz"][0]), (2, model["stuck_hz"]["36"][0])):
        wrong = [abs(each["cases"][0]["joints"][joint]["reduced_hz"][0] / true - 1.0) for each in (before, after)]
        assert wrong[1] < 0.006
        assert wrong[0] > 1.5 * wrong[1]
        if joint == 0:
            assert before["cases"][0]["joints"][0]["mesh_error"][0] == pytest.approx(wrong[0], rel=0.5)
        else:
            assert wrong[0] > 0.006


@pytest.mark.usefixtures("no_other_mesh")
@pytest.mark.long
def test_the_error_of_contact_dofs_is_that_against_many_more_of_them(tmp_path: Path) -> None:
    """Nodes and the mortar on 3 x 3 against a reduced model with a mortar of 6 x 6."""
    stiff = {**COARSE, **STIFF, "rom__tolerance": 0.5, "response__frequency": [150.0, 2000.0]}
    kinds = ["nodal", "mortar"]
    found = verified(tmp_path, sweep={"rom.contact_dofs": kinds}, mesh__contact_grid=[3, 3], **stiff)
    fine = write_scene(tmp_path / "fine.toml", small_scene(**stiff, mesh__contact_grid=[6, 6], rom__modes=60))
    assert shroud("run", fine, "--out", tmp_path / "fine", "--until", "reduce", "--quiet")[0] == 0
    exact = summary_of(tmp_path / "fine")["models"][0]["stuck_hz"]["36"]
    errors = {}
    for kind, case in zip(kinds, found["cases"], strict=True):
        stuck = case["joints"][-1]
        assert stuck["contact_error"][0] == pytest.approx(stuck["full_hz"][0] / exact[0] - 1.0, abs=1e-3)
        assert case["joints"][0]["contact_error"] == [0.0] * len(case["joints"][0]["full_hz"])
        errors[kind] = case["contact_frequency_error"]
    assert errors["nodal"] > 5e-3 > 4.0 * errors["mortar"] > 0.0


def test_stiffness_node_by_node_has_no_value_between_the_nodes(tmp_path: Path) -> None:
    stiffness = {"contact__normal_stiffness": [5e4] * 4, "rom__tolerance": 0.4}
    found = verified(tmp_path, **COARSE, **stiffness)
    case = found["cases"][0]
    assert case["contact_frequency_error"] is None
    assert [joint["face_hz"] for joint in case["joints"]] == [None] * 3
    assert case["mesh_frequency_error"] > 0.0
    assert found["advice"][0]["within"]
    assert "contact dofs" not in found["advice"][0]["text"]


@pytest.mark.long
def test_what_no_mesh_and_no_contact_grid_reaches_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pipeline.verify.advice, "MOST_DOFS", 12_000)
    stiff = {**COARSE, "contact__normal_stiffness": 1e13, "contact__tangential_stiffness": 1e13}
    (advice,) = verified(tmp_path, "--tolerance", 1e-5, **stiff, rom__modes=30)["advice"]
    assert not advice["within"]
    said = re.search(r"lower mesh.size from 18 mm to (\S+) mm \((\d+) dofs\)", advice["text"])
    assert said is not None, advice["text"]
    assert int(said[2]) == advice["advised_dofs"] <= 12_000
    assert "the tolerance takes more dofs than are practical" in advice["text"]
    assert "set mesh.contact_grid = [6, 6]" in advice["text"]
    assert "lower the contact stiffness" in advice["text"]
    # what is proposed is possible
    possible = small_scene(**(stiff | {"mesh__size": float(said[1]) / 1000.0, "mesh__contact_grid": [6, 6]}))
    assert shroud("validate", write_scene(tmp_path / "possible.toml", possible))[0] == 0


@pytest.mark.parametrize("element", ["hex8", "hex20", "hex27"])
def test_dofs_of_a_mesh_are_counted_as_assembly_counts_them(element: str) -> None:
    sector = build_sector(
        BladeParameters(72, 0.3, 0.1, chord=0.03, thickness=0.008),
        ShroudParameters(angle=70.0, thickness=0.006, axial_width=0.036, contact_length=0.01),
        MeshParameters(size=0.012, contact_grid=(2, 2)),
    )
    steel = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0)
    assert mesh_dofs(sector, element) == assemble(sector, steel, element).n_dofs


def test_the_error_of_linear_hexahedra_is_told_by_quadratic_ones(tmp_path: Path) -> None:
    found = verified(tmp_path)
    case = found["cases"][0]
    assert case["other"]["element"] == "hex20"
    assert case["mesh_frequency_error"] > 0.01
    assert 'set mesh.element = "hex20"' in found["advice"][0]["text"]


def test_the_table_and_nothing_is_measured_twice(tmp_path: Path) -> None:
    status, said, error = verify(tmp_path, "--tolerance", "0.5")
    assert status == 0
    assert "measuring small" in error
    assert re.match(r"6 fixed-interface modes, 12 mm hex8, \d+ dofs; other mesh 5.88 mm hex20, \d+ dofs\n", said)
    rows = [[cell.strip() for cell in line.strip("│").split("│")] for line in said.splitlines() if "│" in line]
    assert [row[0] for row in rows if row[0]] == ["free", "sliding", "stuck"]
    assert {"receptance, contact nodes", "receptance, output", "static flexibility"} <= {row[1] for row in rows}
    frequencies = [row for row in rows if row[1].startswith("mode ")]
    assert all(all(row[2:]) for row in frequencies)
    assert all((float(row[3]) > 700.0) == row[1].endswith("(above range)") for row in frequencies)
    assert said.splitlines()[-1].endswith("for a tolerance of 50 %: nothing to do")
    assert not (tmp_path / "out" / "summary.json").exists()  # it is no run
    again = verify(tmp_path, "--tolerance", "0.5")
    assert again == (0, said, "")
    assert "measuring" in verify(tmp_path, "--tolerance", "0.5", "--recompute")[2]


def test_a_sweep_is_one_table_with_the_advice_of_the_worst(tmp_path: Path) -> None:
    sweep = {"excitation.engine_order": [0, 36], "contact.interference": [0.0, 1e-5]}
    status, said, error = verify(tmp_path, sweep=sweep, response__frequency=[200.0, 700.0])
    assert status == 0
    measured = [line for line in error.splitlines() if line.startswith("measuring") and "so far" not in line]
    assert [line.split()[1] for line in measured] == ["1/2", "2/2"]  # the interference changes nothing linear
    rows = [[cell.strip() for cell in line.strip("│").split("│")] for line in said.splitlines() if "│" in line]
    assert [row[0] for row in rows if row[0]] == ["engine order 0", "engine order 36"]
    assert len([line for line in said.splitlines() if "for a tolerance of" in line]) == 1
    found = verified(tmp_path, sweep=sweep, response__frequency=[200.0, 700.0])
    assert [case["engine_order"] for case in found["cases"]] == [0, 36]
    (advice,) = found["advice"]
    each = [verified(tmp_path, excitation__engine_order=n, response__frequency=[200.0, 700.0]) for n in (0, 36)]
    assert advice["needed_modes"] == max(one["advice"][0]["needed_modes"] for one in each)


@pytest.mark.usefixtures("no_other_mesh")
def test_a_choice_of_modes_in_a_sweep_gets_advice_for_each(tmp_path: Path) -> None:
    found = verified(tmp_path, sweep={"rom.modes": [2, 40]}, **COARSE, rom__tolerance=5e-3)
    few, many = found["advice"]
    assert few["text"].startswith("modes kept 2: ")
    assert f"raise rom.modes from 2 to {few['needed_modes']}" in few["text"]
    assert 2 < few["needed_modes"] <= 40
    assert many["text"].startswith("modes kept 40: ")
    assert "rom.modes" not in many["text"]
    receptance = [case["receptance_error"] for case in found["cases"]]
    assert receptance[1] < 5e-3 < receptance[0]


def test_what_cannot_be_verified_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_scene(tmp_path / "ground.toml", ground_scene())
    status, said, error = shroud("verify", path, "--out", tmp_path / "out")
    assert (status, said) == (2, "")
    assert error == (
        f"{path}: blade: missing, allowed: a table [blade] "
        "(a given reduced model or [model] has no mesh to be measured against)\n"
    )
    for options in (["--tolerance", "0"], ["--tolerance", "much"], ["--until", "mesh"]):
        status, said, error = verify(tmp_path, *options)
        assert (status, said, error.count("\n")) == (2, "", 1)
    status, said, error = verify(tmp_path, contact__friction=-1.0)
    assert (status, said, error.count("\n")) == (2, "", 1)
    assert "contact.friction" in error
    monkeypatch.setattr(import_module("rom.reduction.reference_model"), "MOST_MODES", 24)
    status, said, error = verify(tmp_path, "--quiet", response__frequency=[300.0, 3e4])
    assert (status, said, error.count("\n")) == (2, "", 1)
    assert "response.frequency: 30000.0, allowed: a range below 24 modes of the full model" in error
    assert not (tmp_path / "out" / "summary.json").exists()


@pytest.mark.usefixtures("no_other_mesh")
def test_a_case_that_fails_does_not_stop_the_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = pipeline.verify.stage.model_errors

    def measured(scene: Any, *rest: Any) -> Any:
        if scene.excitation.engine_order == 3:
            raise RuntimeError("made to fail")
        return real(scene, *rest)

    monkeypatch.setattr(pipeline.verify.stage, "model_errors", measured)
    status, said, error = verify(tmp_path, sweep={"excitation.engine_order": [3, 36]})
    assert status == 1
    assert error.splitlines()[-1] == "engine order 3: verify: made to fail"
    assert "for a tolerance of" in said
    problem = "engine order 3: verify: made to fail\n"
    assert verify(tmp_path, "--quiet", sweep={"excitation.engine_order": [3, 36]}) == (1, "", problem)


@pytest.mark.usefixtures("no_other_mesh")
def test_a_mesh_without_another_still_has_its_modes_measured(tmp_path: Path) -> None:
    status, said, _ = verify(tmp_path, rom__tolerance=0.1)
    assert status == 0
    assert "no other mesh (made to fail)" in said
    assert said.splitlines()[-1].endswith(
        "mesh error not known (made to fail); for a tolerance of 10 %: nothing to do"
    )
    found = verified(tmp_path, rom__tolerance=0.1)
    assert found["cases"][0]["mesh_frequency_error"] is None
    assert not found["advice"][0]["within"]


@pytest.mark.usefixtures("no_other_mesh")
def test_automatic_modes_stay_within_the_tolerance(tmp_path: Path) -> None:
    kept = {}
    for tolerance in (1e-2, 3e-3):
        found = verified(tmp_path, rom__modes="auto", rom__tolerance=tolerance, **COARSE)
        case = found["cases"][0]
        kept[tolerance] = case["modes"]
        assert max(case["receptance_error"], case["modes_frequency_error"]) <= tolerance
    assert kept[1e-2] < kept[3e-3]
    fewer = verified(tmp_path, rom__modes=kept[1e-2] - 1, rom__tolerance=1e-2, **COARSE)
    assert fewer["cases"][0]["receptance_error"] > 1e-2
    assert fewer["advice"][0]["needed_modes"] == kept[1e-2]
    strict = verified(tmp_path, "--tolerance", 1e-4, rom__modes="auto", rom__tolerance=1e-2, **COARSE)
    assert "lower rom.tolerance from 0.01 to 0.0001" in strict["advice"][0]["text"]


@pytest.mark.usefixtures("no_other_mesh")
def test_a_frequency_limit_gets_advice_in_modes(tmp_path: Path) -> None:
    (advice,) = verified(tmp_path, rom__modes=None, rom__frequency_limit=3000.0, **COARSE, rom__tolerance=5e-3)[
        "advice"
    ]
    assert f"set rom.modes = {advice['needed_modes']} in place of rom.frequency_limit" in advice["text"]


@pytest.mark.usefixtures("no_other_mesh")
def test_a_run_estimates_what_verifying_measures(tmp_path: Path) -> None:
    changes: dict[str, Any] = {**TWISTED, "rom__modes": 6}
    case = verified(tmp_path, **changes)["cases"][0]
    scene = write_scene(tmp_path / "scene.toml", small_scene(**changes))
    status, _said, _ = shroud("run", scene, "--out", tmp_path / "out", "--until", "reduce")
    model = summary_of(tmp_path / "out")["models"][0]
    assert status == 0
    for name in ("modes_frequency_error", "receptance_error"):
        assert model[name] == pytest.approx(case[name], rel=0.02), name
    assert model["modes_error"] == max(model["modes_frequency_error"], model["receptance_error"])


def test_errors_of_modes_that_end_in_the_range_are_not_known(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "scene.toml", small_scene(rom__modes=1, response__frequency=[300.0, 9000.0]))
    status, said, _ = shroud("run", scene, "--out", tmp_path / "out", "--until", "reduce")
    assert status == 0
    model = summary_of(tmp_path / "out")["models"][0]
    assert [model[name] for name in ("modes_error", "modes_frequency_error", "receptance_error")] == [None] * 3
    assert "modal truncation error" not in said


@pytest.mark.long
def test_the_number_kept_is_told_and_chosen_anew_when_it_must_be(tmp_path: Path) -> None:
    def run(**changes: Any) -> tuple[str, dict[str, Any]]:
        scene = small_scene(**{"rom__modes": "auto", "rom__tolerance": 0.01, **changes})
        path = write_scene(tmp_path / "scene.toml", scene)
        status, said, _ = shroud("run", path, "--out", tmp_path / "out", "--until", "respond")
        assert status == 0
        return said, summary_of(tmp_path / "out")["models"][0]

    said, model = run()
    assert 0.0 < model["modes_error"] <= 0.01
    assert model["modes"] == model["reduced_dofs"] - 27
    assert f"{model['modes']} fixed-interface modes: modal truncation error" in said
    run(contact__interference=0.0)
    assert statuses(tmp_path / "out")["reduce"] == "reused"
    said, model = run(response__frequency=[300.0, 1500.0])
    assert statuses(tmp_path / "out")["reduce"] == "ran"
    said, model = run(rom__modes=6)
    assert model["modes"] == 6
    assert (model["modes_error"] is None) == ("modal truncation error" not in said)
    run(rom__modes=6, rom__tolerance=0.1, response__frequency=[300.0, 1500.0])
    assert statuses(tmp_path / "out")["reduce"] == "reused"


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"rom__modes": "many"}, 'rom.modes: "many", allowed: a whole number, 1 to 1000, or "auto"'),
        ({"rom__modes": 1001}, 'rom.modes: 1001, allowed: a whole number, 1 to 1000, or "auto"'),
        ({"rom__modes": 2.5}, 'rom.modes: 2.5, allowed: a whole number, 1 to 1000, or "auto"'),
        ({"rom__tolerance": 0.0}, "rom.tolerance: 0.0, allowed: a number above 0, 1e-6 to 0.5"),
        ({"rom__modes": "auto", "rom__frequency_limit": 1e4}, "rom.frequency_limit: given beside modes"),
        ({"rom__modes": "auto", "response__damping_ratio": [0.01] * 31}, "response.damping_ratio: a list of 31"),
    ],
)
def test_scenes_are_refused(tmp_path: Path, change: dict[str, Any], expected: str) -> None:
    path = write_scene(tmp_path / "scene.toml", small_scene(**change))
    status, said, error = shroud("validate", path)
    assert (status, said) == (2, "")
    assert expected in error
    assert error.count("\n") == 1


@pytest.mark.parametrize("order", [1.1, 2.0, 3.7])
def test_the_order_of_convergence_is_fitted_to_three_meshes(order: float) -> None:
    sizes = [5e-3, 2.5e-3, 5e-3 / 3.0]
    found = fitted_order(sizes, [100.0 + 3e5 * size**order for size in sizes])
    assert found == pytest.approx(order, abs=1e-3)
    assert fitted_order(sizes, [100.0, 99.0, 99.5]) == ORDER  # not monotone: none is told
    assert fitted_order(sizes, [100.0, 99.0, 98.9]) <= 4.0


def test_errors_and_size_follow_the_order_of_each_mode() -> None:
    """Of f = f0 (1 + c h^p) the error is c h^p: Richardson's estimate with the fitted order finds it."""
    true, coefficient, order = np.array([200.0, 950.0]), 120.0, 2.0
    sizes = (6e-3, 3e-3, 2e-3)
    mesh = {size: true * (1.0 + coefficient * size**order) for size in sizes}
    orders = tuple(fitted_order(sizes, [mesh[size][k] for size in sizes]) for k in range(2))
    here, other = (tuple(mesh[size].tolist()) for size in sizes[:2])
    joint = JointErrors("free", 1, here, here, (True, True), 0.0, 0.0, here, other)
    finer, third = OtherMesh(sizes[1], "tet10", 80_000), OtherMesh(sizes[2], "tet10", 250_000)
    assumed = ModelErrors(30, 12_000, sizes[0], "tet10", (3, 3), finer, "", 0.0, None, (joint,))
    fitted = replace(assumed, orders=orders, third=third)
    exact = coefficient * sizes[0] ** order
    assert fitted.mesh_frequency == pytest.approx(exact, rel=1e-3)
    assert assumed.mesh_frequency > 1.4 * exact
    reached = finer_size(fitted, 0.001)
    assert coefficient * reached**order == pytest.approx(0.001 * 0.8, rel=0.1)
    assert finer_size(assumed, 0.001) < 0.4 * reached
    assert restored(ModelErrors, json.loads(json.dumps(plain(fitted)))) == fitted

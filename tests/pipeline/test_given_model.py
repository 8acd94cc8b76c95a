"""`shroud respond --rom`: any reduced model, also one with no blade behind it."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from pipeline_support import (
    changing_when_locked,
    ground_model,
    ground_scene,
    shroud,
    small_scene,
    statuses,
    summary_of,
    write_ground_model,
    write_scene,
)

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from pipeline import run_scene
from rom import modal_model, read_reduced_model


def respond(tmp_path: Path, scene: dict[str, Any], rom: Path) -> tuple[int, str]:
    """Run the scene on the model into tmp_path/out; status and stderr."""
    path = write_scene(tmp_path / "scene.toml", scene)
    status, _, error = shroud("respond", path, "--rom", rom, "--out", tmp_path / "out", "--quiet")
    return status, error


def test_contact_against_ground_with_values_node_by_node(tmp_path: Path) -> None:
    rom = write_ground_model(tmp_path / "ground.h5")
    assert respond(tmp_path, ground_scene(), rom) == (0, "")
    assert statuses(tmp_path / "out") == {
        "mesh": "skipped",
        "assemble": "skipped",
        "reduce": "skipped",
        "respond": "ran",
        "study": "skipped",
        "stresses": "skipped",
        "render": "skipped",
        "report": "skipped",
        "figures": "ran",
    }
    contact = ContactParameters(
        normal_stiffness=np.array([0.8, 0.7, 0.9]),
        tangential_stiffness=np.array([0.4, 0.5, 0.3]),
        friction=np.array([0.5, 0.4, 0.6]),
        interference=np.zeros(3),
        preload=np.array([1.6, 1.2, 1.0]),
        law="two_sliders",
    )
    options = SolverOptions(frequency_hz=(0.1, 0.3), integration="sampled", samples=128)
    direct = forced_response(
        modal_model(ground_model(), rayleigh=(0.0, 0.02)), contact, Excitation(engine_order=0, force=0.5), options
    )
    with h5py.File(tmp_path / "out" / "response.h5") as file:
        group = file["curve/0"]
        np.testing.assert_allclose(group["amplitude_m"][()], direct.amplitude_m, rtol=1e-12)
        np.testing.assert_allclose(group["contact_force"][()], direct.contact_force, atol=1e-12)
        np.testing.assert_array_equal(group.attrs["contact.preload"], [1.6, 1.2, 1.0])
    model = summary_of(tmp_path / "out")["models"][0]
    assert model["mesh"] is None
    assert model["dofs"] == 12
    stiffness = ground_model().stiffness
    free = np.sqrt(np.linalg.eigvalsh(stiffness)[:10]) / (2 * np.pi)
    np.testing.assert_allclose(model["free_hz"], free, rtol=1e-10)
    springs = np.diag([0.4, 0.4, 0.8, 0.5, 0.5, 0.7, 0.3, 0.3, 0.9, 0.0, 0.0, 0.0])
    stuck = np.sqrt(np.linalg.eigvalsh(stiffness + springs)[:10]) / (2 * np.pi)
    np.testing.assert_allclose(model["stuck_hz"]["0"], stuck, rtol=1e-10)


def test_a_given_model_has_a_report(tmp_path: Path) -> None:
    scene, rom = write_scene(tmp_path / "s.toml", ground_scene()), write_ground_model(tmp_path / "g.h5")
    run = run_scene(scene, tmp_path / "out", rom=rom, until="report", quiet=True)
    assert run.summary["problems"] == []
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Reduced model" in page
    assert "pairs of nodes" in page


def test_the_model_travels_with_the_results(tmp_path: Path) -> None:
    rom = write_ground_model(tmp_path / "ground.h5")
    assert respond(tmp_path, ground_scene(), rom) == (0, "")
    rom.unlink()
    named = tmp_path / "out" / summary_of(tmp_path / "out")["curves"][0]["rom"]
    np.testing.assert_array_equal(read_reduced_model(named).stiffness, ground_model().stiffness)


def test_a_model_of_the_same_content_is_the_same_model(tmp_path: Path) -> None:
    assert respond(tmp_path, ground_scene(), write_ground_model(tmp_path / "one.h5")) == (0, "")
    copy = tmp_path / "two.h5"
    copy.write_bytes((tmp_path / "one.h5").read_bytes())
    assert respond(tmp_path, ground_scene(), copy) == (0, "")
    assert statuses(tmp_path / "out")["respond"] == "reused"
    other = write_ground_model(tmp_path / "three.h5", mass=1.1 * np.eye(12))
    assert respond(tmp_path, ground_scene(), other) == (0, "")
    assert statuses(tmp_path / "out")["respond"] == "ran"


def test_a_model_exchanged_while_the_run_waits_is_not_taken_for_the_one_that_was_read(tmp_path: Path) -> None:
    rom = write_ground_model(tmp_path / "one.h5")
    other = write_ground_model(tmp_path / "other.h5", mass=1.1 * np.eye(12))
    assert respond(tmp_path, ground_scene(), write_ground_model(tmp_path / "same.h5")) == (0, "")
    expected = summary_of(tmp_path / "out")["models"][0]
    with changing_when_locked(lambda: rom.write_bytes(other.read_bytes())):
        assert respond(tmp_path, ground_scene(), rom) == (0, "")
    found = summary_of(tmp_path / "out")["models"][0]
    assert statuses(tmp_path / "out")["respond"] == "reused"
    assert found == expected
    assert respond(tmp_path, ground_scene(), rom) == (0, "")
    found = summary_of(tmp_path / "out")["models"][0]
    np.testing.assert_allclose(found["free_hz"], np.array(expected["free_hz"]) / np.sqrt(1.1), rtol=1e-9)


def test_the_blade_of_a_scene_is_ignored(finished: Path, tmp_path: Path) -> None:
    rom = finished / summary_of(finished)["curves"][0]["rom"]
    scene = small_scene(blade={"length": -1}, material=None, mesh__contact_grid=[5, 5], contact__interference=1e-5)
    assert respond(tmp_path, scene, rom) == (0, "")
    curve, original = summary_of(tmp_path / "out")["curves"][0], summary_of(finished)["curves"][0]
    assert curve["peak_amplitude_m"] == pytest.approx(original["peak_amplitude_m"], rel=1e-9)
    assert curve["peak_frequency_hz"] == pytest.approx(original["peak_frequency_hz"], rel=1e-9)


def test_what_a_given_model_makes_useless_is_said(tmp_path: Path) -> None:
    """Sections that describe a blade or need its mesh, loads that are part of the model: each is named."""
    whole = small_scene(
        excitation__load=[{"surface": "pressure_side"}],
        load__pressure=[{"surface": "pressure_side", "pressure": 1e3}],
        load__temperature={"uniform": 400.0},
        load__force=[{"at": "tip"}],
    )
    unused = {
        "stress": {},
        "fatigue": {"endurance_limit": 3e8, "tensile_strength": 9e8},
        "damper": {"mass": 0.01},
        "disk": {"bore_radius": 0.2, "rim_width": 0.05},
        "snubber": {"radius": 0.36, "thickness": 0.004, "width": 0.01},
        "platform": {"radius": 0.33, "thickness": 0.008},
        "render": {},
    }
    scene = whole | unused | {name: ground_scene()[name] for name in ("contact", "response")}
    path, rom = write_scene(tmp_path / "s.toml", scene), write_ground_model(tmp_path / "g.h5", n_blades=72)
    status, _, error = shroud("respond", path, "--rom", rom, "--out", tmp_path / "out")
    (line,) = [line for line in error.splitlines() if "not used" in line]
    assert status == 0
    names = {part.strip() for part in line.partition("what it has:")[2].split(",")}
    assert names >= {f"[{name}]" for name in (*unused, "blade", "shroud", "mesh", "rom")}
    assert names >= {"excitation.at", "excitation.load", "load.pressure", "load.temperature", "load.force"}


def test_a_model_of_another_speed_is_refused(finished: Path, tmp_path: Path) -> None:
    """The centrifugal force of one speed does not belong to the stiffness of another; each way round."""
    rom = finished / summary_of(finished)["curves"][0]["rom"]
    assert read_reduced_model(rom).speed_rpm == 0.0
    stiffened = tmp_path / "stiffened.h5"
    stiffened.write_bytes(rom.read_bytes())
    with h5py.File(stiffened, "r+") as file:
        file.attrs["speed_rpm"] = 3000.0
    for model, made, asked in ((rom, 0.0, 3000.0), (stiffened, 3000.0, 0.0), (stiffened, 3000.0, 1500.0)):
        status, error = respond(tmp_path, small_scene(load__speed_rpm=asked), model)
        assert status == 2
        assert f"load.speed_rpm = {asked:g}" in error
        assert f"{made:g} rev/min" in error
        assert error.count("\n") == 1
        assert not (tmp_path / "out").exists()
    assert respond(tmp_path, small_scene(load__speed_rpm=3000.0), stiffened) == (0, "")


@pytest.mark.parametrize("left", [None, np.zeros((0, 12))])
def test_a_model_without_contact_nodes_is_refused_and_shown(tmp_path: Path, left: np.ndarray | None) -> None:
    none = {"contact_right": np.zeros((0, 12)), "contact_position": np.zeros((0, 3)), "contact_left": left}
    rom = write_ground_model(tmp_path / "none.h5", **none, n_blades=None if left is None else 3)
    scene = ground_scene(normal_stiffness=1.0, tangential_stiffness=1.0, friction=0.5, preload=0.1)
    expected = (
        "contact/right: no contact nodes, allowed: one contact node or more: without contact the response is linear"
    )
    assert respond(tmp_path, scene, rom) == (2, f"{rom}: {expected}\n")
    assert not (tmp_path / "out").exists()
    status, said, _ = shroud("info", rom)
    assert status == 0
    assert "0 nodes" in said
    assert shroud("export", rom, "--to", tmp_path / "none.mat", "--quiet") == (0, "", "")


@pytest.mark.parametrize(
    ("changes", "at"),
    [
        ({"contact_right": np.eye(3, 12), "contact_position": np.zeros((1, 3))}, "one node"),
        ({"n_blades": 1, "contact_left": np.eye(9, 12, k=3)}, "one blade"),
        ({"n_blades": 2, "contact_left": np.eye(9, 12, k=3)}, "two blades"),
    ],
)
def test_the_smallest_models_are_solved(tmp_path: Path, changes: dict[str, Any], at: str) -> None:
    """With all that a run finds out unasked, at a tenth of the work."""
    scene = ground_scene(normal_stiffness=1.0, tangential_stiffness=1.0, friction=0.5, preload=0.1)
    scene["response"] = {"frequency": [0.1, 0.3], "rayleigh": [0.0, 0.02], "effort": 0.1}
    rom, path = write_ground_model(tmp_path / "g.h5", **changes), write_scene(tmp_path / "scene.toml", scene)
    found = run_scene(path, tmp_path / "out", rom=rom, until="respond")
    assert [curve.complete for curve in found.curves] == [True], at


@pytest.mark.parametrize(
    ("scene", "expected"),
    [
        (ground_scene(friction=[0.1, 0.2]), "contact.friction: a list of 2, allowed: a number or a list of 3"),
        (ground_scene(normal_stiffness="punch"), 'contact.normal_stiffness: "punch", allowed: numbers'),
        ({**ground_scene(), "sweep": {"shroud.angle": [70.0]}}, 'sweep."shroud.angle": has no effect'),
        ({**ground_scene(), "load": {"speed_rpm": 100.0}}, "force/centrifugal"),
        (
            {**ground_scene(), "sweep": {"load.equilibrium": ["linear"]}},
            'sweep."load.equilibrium": has no effect on a given reduced model',
        ),
        ({**ground_scene(), "contact": {"friction": 0.1}}, "contact.normal_stiffness: missing"),
    ],
)
def test_scenes_that_do_not_fit_the_model(tmp_path: Path, scene: dict[str, Any], expected: str) -> None:
    status, error = respond(tmp_path, scene, write_ground_model(tmp_path / "ground.h5"))
    assert status == 2
    assert expected in error
    assert error.count("\n") == 1
    assert str(tmp_path / "scene.toml") in error
    assert not (tmp_path / "out").exists()


def test_files_that_are_no_model(tmp_path: Path) -> None:
    text, truncated, partial = tmp_path / "text.h5", tmp_path / "truncated.h5", tmp_path / "partial.h5"
    text.write_text("not HDF5")
    whole = write_ground_model(tmp_path / "ground.h5").read_bytes()
    truncated.write_bytes(whole[: len(whole) // 2])
    write_ground_model(partial)
    with h5py.File(partial, "a") as file:
        del file["mass"]
    for path in (text, truncated, partial, tmp_path / "absent.h5", tmp_path):
        status, error = respond(tmp_path, ground_scene(), path)
        assert status == 2
        assert error.count("\n") == 1
        assert str(path) in error
        assert not (tmp_path / "out").exists()

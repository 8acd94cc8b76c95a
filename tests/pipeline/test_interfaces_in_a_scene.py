"""Scenes with several contact interfaces: [interface.NAME], contact.interfaces, results by interface."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from jsonschema import Draft202012Validator
from pipeline_support import ground_model, overlapping_texts, shroud, small_scene, summary_of, write_scene

from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK
from nonlinear.contact_states import nodal_contact
from pipeline import run_scene
from pipeline.explore.live import LiveScene
from pipeline.figures.data import plotted_curves
from pipeline.figures.hysteresis import node_figure
from pipeline.results.outputs import curve_summary
from pipeline.scene.json_schema import scene_schema
from pipeline.scene.reading import read_scene
from pipeline.scene.sweep import key_value
from pipeline.stages.cache_keys import contact_inputs, stiffness_inputs
from pipeline.stages.curve.curve_file import contacts_of_curve, read_curve
from pipeline.stages.curve.curve_summary import kept_summary
from pipeline.stages.curve.respond import CurveResult
from pipeline.stages.scene_to_solver import contact_on_model, nonlinear_problem, touching
from rom import ContactInterface, ReducedModel, read_reduced_model, with_interfaces, write_reduced_model
from rom.cyclic.reduced_model import interfaces_of

QUICK: dict[str, Any] = {"stability": "folds", "detached": False, "truncation": False, "search": "off"}
FAR = -1.0  # m: an interface that never touches
Tables = dict[str, dict[str, Any]]


def scene(**interface: dict[str, Any]) -> dict[str, Any]:
    """A scene for `ground_model` with numbers for whole faces."""
    found: dict[str, Any] = {
        "name": "ground",
        "contact": {
            "normal_stiffness": 2.4,
            "tangential_stiffness": 1.2,
            "friction": 0.5,
            "preload": 1.2,
        },
        "excitation": {"engine_order": 0, "force": 0.5},
        "response": {"frequency": [0.1, 0.3], "rayleigh": [0.0, 0.02], "harmonics": 3, **QUICK},
    }
    return found | ({"interface": interface} if interface else {})


def cut(*names: str) -> ReducedModel:
    """The model with a contact interface for each of its three nodes, or the last with all that are left."""
    model = ground_model()
    (whole,) = interfaces_of(model)
    last = len(names) - 1
    parts = [[k] if k < last else list(range(k, 3)) for k in range(len(names))]
    return with_interfaces(
        model,
        *(
            ContactInterface(
                np.concatenate([whole.right[3 * k : 3 * k + 3] for k in nodes]), whole.position[nodes], name=name
            )
            for name, nodes in zip(names, parts, strict=True)
        ),
    )


def solved(folder: Path, tables: dict[str, Any], model: ReducedModel) -> dict[str, Any]:
    """Run the scene on the model through the command line; the content of summary.json."""
    rom, path = folder / "rom.h5", write_scene(folder / "scene.toml", tables)
    write_reduced_model(rom, model)
    status, _, error = shroud("respond", path, "--rom", rom, "--out", folder / "out", "--quiet")
    assert (status, error) == (0, "")
    return summary_of(folder / "out")


def test_a_face_cut_in_two_interfaces_is_the_same_face(tmp_path: Path) -> None:
    """From rom.h5 through `shroud respond` to summary.json; the node counts and the work add up to the totals."""
    (tmp_path / "whole").mkdir()
    one = solved(tmp_path / "whole", scene(), ground_model())["curves"][0]
    share = {"normal_stiffness": 0.8, "tangential_stiffness": 0.4}
    rest = {"normal_stiffness": 1.6, "tangential_stiffness": 0.8}
    summary = solved(tmp_path, scene(tip=share, foot=rest), cut("tip", "foot"))
    (two,) = summary["curves"]
    assert two["peak_amplitude_m"] == pytest.approx(one["peak_amplitude_m"], rel=1e-9)
    assert two["peak_frequency_hz"] == pytest.approx(one["peak_frequency_hz"], rel=1e-9)
    assert "interfaces" not in one
    assert list(two["interfaces"]) == ["tip", "foot"]
    assert [each["nodes"] for each in two["interfaces"].values()] == [1, 2]
    stiffness = {name: each["normal_stiffness"] for name, each in summary["models"][0]["interfaces"].items()}
    assert stiffness == pytest.approx({"tip": 0.8, "foot": 1.6})
    with h5py.File(tmp_path / "out" / "response.h5") as file:
        group = file["curve/0"]
        at = int(group.attrs["peak_index"])
        for name in ("sticking", "slipping", "separating", "dissipated_j"):
            total = sum(each[name] for each in two["interfaces"].values())
            assert total == pytest.approx(group[name][at], rel=1e-12)
        assert [each.name for each in contacts_of_curve(group)] == ["tip", "foot"]
        assert group.attrs["interface.foot.normal_stiffness"] == 1.6


def test_results_are_told_by_interface(tmp_path: Path) -> None:
    """On the screen, by `shroud info` of folder, response and model, in the report, in the loops."""
    write_reduced_model(tmp_path / "rom.h5", cut("tip", "foot"))
    path = write_scene(tmp_path / "scene.toml", scene(foot={"friction": 0.1}))
    arguments = path, "--rom", tmp_path / "rom.h5", "--out", tmp_path / "out"
    status, said, _ = shroud("respond", *arguments)
    assert status == 0
    (curve,) = summary_of(tmp_path / "out")["curves"]
    lines = said.splitlines()
    at = next(number for number, line in enumerate(lines) if line.startswith("Friction work per cycle"))
    assert lines[at + 1].split() == ["#", "tip", "[mJ]", "foot", "[mJ]"]
    told = [cell.strip() for cell in lines[at + 2].split("  ") if cell.strip()]
    assert told == ["0", "0, 1 stick", f"{1e3 * curve['interfaces']['foot']['dissipated_j']:.3g}, 2 slip"]
    for what in (tmp_path / "out", tmp_path / "out" / "response.h5"):
        assert lines[at + 2] in shroud("info", what)[1]
    assert (
        "contact interfaces, with their nodes: tip 1 (against ground or sector), foot 2"
        in shroud("info", tmp_path / "rom.h5")[1]
    )
    run = run_scene(path, tmp_path / "out", rom=tmp_path / "rom.h5", until="report", quiet=True)
    assert run.summary["problems"] == []
    page = (tmp_path / "out" / "report.html").read_text()
    assert "<h3>tip</h3>" in page
    assert "<h3>foot</h3>" in page
    assert "interface foot" in page
    file = next((tmp_path / "out" / "store").rglob("curve.h5"))
    rom = next((tmp_path / "out" / "store").rglob("rom.h5"))
    result = CurveResult(read_scene(path).members[0], rom, file, kept_summary(file), "")
    assert result.facts is not None
    unknown = tuple(each | {"static_force_n": np.nan} for each in result.facts.interfaces)
    entry = curve_summary(replace(result, facts=replace(result.facts, interfaces=unknown)), tmp_path)
    assert entry["interfaces"]["foot"]["static_force_n"] is None
    (plotted,) = plotted_curves([result])
    assert [plotted.node_name(node) for node in range(3)] == ["node 1 of tip", "node 1 of foot", "node 2 of foot"]
    figure = node_figure(plotted, "cut")
    assert figure is not None
    names = [text.get_text().partition(",")[0] for text in figure.legends[0].get_texts()]
    assert len(names) == 2
    assert "node 1 of tip" in names
    assert overlapping_texts(figure) == []


def test_static_contact_is_that_of_each_interface(tmp_path: Path) -> None:
    """One face is pressed, another has a gap: no force of both, no share, no span of v, wherever they stand."""
    write_reduced_model(tmp_path / "rom.h5", replace(cut("tip", "foot"), force_centrifugal=np.eye(12)[2] * 1e-3))
    pressed = {"interference": 0.5, "preload": 0.0, "normal_stiffness": 6.0}
    tables = scene(tip=pressed, foot={"interference": -1e3, "preload": 0.0}) | {"load": {"speed_rpm": 60.0}}
    path = write_scene(tmp_path / "scene.toml", tables)
    arguments = path, "--rom", tmp_path / "rom.h5", "--out", tmp_path / "out"
    status, said, _ = shroud("respond", *arguments)
    assert status == 0
    (curve,) = summary_of(tmp_path / "out")["curves"]
    assert (curve["static_force_n"], curve["static_open_share"], curve["static_highest_m"]) == (None, None, None)
    tip, foot = (curve["interfaces"][name] for name in ("tip", "foot"))
    assert (foot["static_force_n"], foot["static_open_share"]) == (0.0, 1.0)
    assert (tip["static_open_share"], tip["static_lowest_m"]) == (0.0, tip["static_highest_m"])
    assert tip["static_force_n"] == pytest.approx(6.0 * tip["static_lowest_m"]) != 0.0
    text = f"normal force {tip['static_force_n']:.4g} N, 0 % open"
    assert text in said
    assert text in shroud("info", tmp_path / "out")[1]
    run = run_scene(path, tmp_path / "out", rom=tmp_path / "rom.h5", until="report", quiet=True)
    assert text in (tmp_path / "out" / "report.html").read_text()
    (read,) = run.curves
    assert read.static_contact is None
    assert [each["static_force_n"] for each in read.interfaces] == [tip["static_force_n"], 0.0]
    assert shroud("modes", *arguments)[0] == 0
    (model,) = json.loads((tmp_path / "out/modes/modes.json").read_text())["models"]
    forces = {case["interface"]: case["force_n"] for case in model["static"]}
    assert forces == pytest.approx({"tip": tip["static_force_n"], "foot": 0.0})
    live = LiveScene.open(path, tmp_path / "live", rom=tmp_path / "rom.h5")
    try:
        seen = live.curve().static
    finally:
        live.close()
    assert {name: each.force_n for name, each in seen.items()} == pytest.approx(forces)


def test_an_interface_that_never_touches_changes_nothing(tmp_path: Path) -> None:
    """Numbers of today to 1e-12, whether the second interface lies open or is left out of the model."""
    (near,) = interfaces_of(ground_model())
    far = ContactInterface(np.eye(3, 12, k=9), np.zeros((1, 3)), name="far")
    model = with_interfaces(ground_model(), near, far)
    found = []
    for name, tables, case in (
        ("alone", scene(), ground_model()),
        ("open", scene(far={"interference": FAR, "preload": 0.0}), model),
        ("out", scene(), model),
    ):
        (tmp_path / name).mkdir()
        tables["contact"] |= {"interfaces": ["shroud"]} if name == "out" else {}
        solved(tmp_path / name, tables, case)
        with h5py.File(tmp_path / name / "out" / "response.h5") as file:
            group = file["curve/0"]
            ends = group["amplitude_m"][[0, -1]].tolist()
            found.append(([float(group.attrs["peak_amplitude_m"]), *ends], group["contact_force"].shape[2]))
    (alone, _), (opened, _), (out, _) = found
    np.testing.assert_allclose(opened, alone, rtol=1e-12)
    np.testing.assert_array_equal(out, alone)
    assert [nodes for _, nodes in found] == [3, 4, 3]


def test_each_interface_has_its_own_parameters_and_those_of_contact_otherwise(tmp_path: Path) -> None:
    tables = scene(foot={"friction": 0.1, "interference": [1e-3, 2e-3]})
    tables["material"] = {"young_modulus": 2.0, "poisson_ratio": 0.3, "density": 1.0}
    tables["contact"]["normal_stiffness"] = "punch"
    first = read_scene(write_scene(tmp_path / "s.toml", tables)).first
    model = replace(cut("tip", "foot"), contact_area=np.array([1.0, 3.0, 1.0]))
    contact = contact_on_model(first, model)
    np.testing.assert_array_equal(contact.friction, [0.5, 0.1, 0.1])
    np.testing.assert_array_equal(contact.interference, [0.0, 1e-3, 2e-3])
    np.testing.assert_allclose(contact.tangential_stiffness, [1.2, 0.9, 0.3], rtol=1e-12)
    # the stiffness of a punch goes with the root of the area of its own interface
    assert contact.normal_stiffness[1:].sum() == pytest.approx(2.0 * contact.normal_stiffness[0])
    assert key_value(first, "interface.foot.friction") == 0.1
    assert key_value(first, "interface.tip.friction") == 0.5
    assert key_value(first, "interface.foot.interference") == pytest.approx(1.5e-3)


def test_each_interface_has_its_own_law(tmp_path: Path) -> None:
    """Given, swept and read back from the curve."""
    tables = scene(foot={"law": "cone"}) | {"sweep": {"interface.tip.law": ["two_sliders", "cone"]}}
    one = solved(tmp_path, tables, cut("tip", "foot"))["curves"]
    assert [curve["parameters"] for curve in one] == [{"interface.tip.law": law} for law in ("two_sliders", "cone")]
    with h5py.File(tmp_path / "out" / "response.h5") as file:
        read = contacts_of_curve(file["curve/0"])
    assert [each.contact.law for each in read] == ["two_sliders", "cone"]
    first = read_scene(tmp_path / "scene.toml").first
    assert contact_on_model(first, cut("tip", "foot")).laws == ("two_sliders", "cone", "cone")


def test_scenes_without_the_tables_have_the_inputs_of_before(tmp_path: Path) -> None:
    """Otherwise results kept in stores would be computed again; with them every value counts."""
    plain, named = (
        read_scene(write_scene(tmp_path / "s.toml", tables)).first
        for tables in (scene(), scene(foot={"friction": 0.1}))
    )
    assert set(stiffness_inputs(plain)) == {"normal", "tangential"}
    assert set(contact_inputs(plain)) == {"contact"}
    assert "interfaces" not in contact_inputs(plain)["contact"]
    assert contact_inputs(named)["interface"] == {"foot": {"friction": 0.1}}
    assert stiffness_inputs(named)["interface"]["foot"]["normal_stiffness"] is None


def test_keys_of_interfaces_are_swept(tmp_path: Path) -> None:
    """As a grid, in tables, as points of a file; a swept contact.friction goes to those without a friction."""
    swept = {"sweep": {"interface.foot.friction": [0.1, 0.5]}}
    one = solved(tmp_path, scene() | swept, cut("tip", "foot"))["curves"]
    assert [curve["parameters"] for curve in one] == [{"interface.foot.friction": mu} for mu in (0.1, 0.5)]
    assert one[0]["peak_amplitude_m"] != pytest.approx(one[1]["peak_amplitude_m"], rel=1e-3)
    header = (tmp_path / "out" / "response.csv").read_text().splitlines()[0]
    assert header.startswith("curve,interface.foot.friction,frequency_hz")
    (tmp_path / "points.csv").write_text(
        "interface.foot.interference_m,interface.foot.friction\n1e-3,0.2\n2e-3,0.3\n"
    )
    schema = Draft202012Validator(scene_schema()["properties"]["sweep"])
    for table, keys in (
        ({"interface": {"foot": {"friction": [0.1, 0.5]}}}, ("interface.foot.friction",)),
        ({"points": "points.csv"}, ("interface.foot.interference", "interface.foot.friction")),
        (
            {"latin_hypercube": {"samples": 2, "seed": 1, "ranges": {"interface.foot.preload": [1.0, 2.0]}}},
            ("interface.foot.preload",),
        ),
    ):
        file = read_scene(write_scene(tmp_path / "s.toml", scene(foot={"preload": 1.0}) | {"sweep": table}))
        assert file.swept == keys
        assert len(file.members) == 2
        assert schema.is_valid(table) or "interface" in table
    assert not schema.is_valid({"interface.foot.samples": [64]})
    file = read_scene(
        write_scene(tmp_path / "s.toml", scene(foot={"friction": 0.1}) | {"sweep": {"contact.friction": [0.2, 0.3]}})
    )
    frictions = [contact_on_model(member.scene, cut("tip", "foot")).friction for member in file.members]
    np.testing.assert_array_equal(frictions, [[0.2, 0.1, 0.1], [0.3, 0.1, 0.1]])


def test_values_given_in_python_replace_keys_of_interfaces(tmp_path: Path) -> None:
    path = write_scene(
        tmp_path / "s.toml", scene(foot={"friction": 0.1}) | {"sweep": {"interface.foot.preload": [1, 2]}}
    )
    rom = tmp_path / "rom.h5"
    write_reduced_model(rom, cut("tip", "foot"))
    given = {"interface.foot.friction": 0.3, "interface.tip": {"preload": 0.8}, "interface.foot.preload": 0.9}
    run = run_scene(path, tmp_path / "out", overrides=given, rom=rom, quiet=True)
    (curve,) = run.curves
    with h5py.File(tmp_path / "out" / "response.h5") as file:
        attributes = dict(file["curve/0"].attrs)
    assert curve.parameters == {}
    assert [each["name"] for each in curve.interfaces] == ["tip", "foot"]
    frictions = [attributes[f"interface.{name}.friction"] for name in ("tip", "foot")]
    assert frictions == [0.5, 0.3]
    assert [attributes[f"interface.{name}.preload"] for name in ("tip", "foot")] == [0.8, 0.9]


def test_states_and_work_of_each_node(tmp_path: Path) -> None:
    """Together those of the curve, at every point."""
    solved(tmp_path, scene(), cut("tip", "foot"))
    first = read_scene(tmp_path / "scene.toml").first
    model = touching(first, read_reduced_model(tmp_path / "rom.h5"))
    problem = nonlinear_problem(first, model)
    (file,) = (tmp_path / "out" / "store").rglob("curve.h5")
    curve = read_curve(file)
    for index in range(0, curve.points, 7):
        found = nodal_contact(problem, curve, index)
        counts = [int((found.state == state).sum()) for state in (STICK, SLIP, LIFT_OFF)]
        assert counts == [curve.sticking[index], curve.slipping[index], curve.separating[index]]
        assert found.dissipated_j.sum() == pytest.approx(curve.dissipated_j[index], rel=1e-9, abs=1e-15)


KNOWN = "allowed: contact interfaces of the model: tip, foot"


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"interface": {"fot": {"friction": 0.1}}}, f"interface.fot: unknown name, {KNOWN}"),
        ({"sweep": {"interface.fot.friction": [0.1]}}, f'sweep."interface.fot.friction": unknown name, {KNOWN}'),
        ({"contact": scene()["contact"] | {"interfaces": ["tip", "fot"]}}, f'contact.interfaces: "fot", {KNOWN}'),
        ({"interface": {"foot": {"interference": [0.0] * 3}}}, "interface.foot.interference: a list of 3, allowed: "),
        (
            {"contact": scene()["contact"] | {"interference": [0.0] * 2}},
            "contact.interference: a list of 2, allowed: ",
        ),
        ({"interface": {"foot": {"friction": -0.1}}}, "interface.foot.friction: -0.1, allowed: a number, 0 to "),
        ({"interface": {"foot": {"fricton": 0.1}}}, "interface.foot.fricton: unknown key, did you mean "),
        (
            {"interface": {"foot": {"law": "con"}}},
            'interface.foot.law: "con", did you mean cone?, allowed: "two_sliders" or "cone"',
        ),
        ({"interface": {"foot": {"samples": 64}}}, "interface.foot.samples: unknown key, "),
        (
            {"interface": {"foot": {"normal_stiffness": "punch"}}},
            'interface.foot.normal_stiffness: "punch", allowed: ',
        ),
        ({"interface": {"foot": 3}}, "interface"),
        (
            {"sweep": {"interface.foot.fricton": [0.1]}},
            'sweep."interface.foot.fricton": unknown key, did you mean interface.foot.friction?',
        ),
        ({"sweep": {"contact.interfaces": [["tip"]]}}, 'sweep."contact.interfaces": unknown key'),
        (
            {"map": {"over": {"interface.fot.friction": [0.1, 0.2], "contact.friction": [0.1, 0.2]}}},
            'map.over."interface.fot.friction": "interface.fot.friction", unknown name fot, allowed: ',
        ),
    ],
)
def test_what_the_model_does_not_have_is_said_in_a_line(tmp_path: Path, changes: dict[str, Any], said: str) -> None:
    rom, path = tmp_path / "rom.h5", write_scene(tmp_path / "s.toml", scene() | changes)
    write_reduced_model(rom, cut("tip", "foot"))
    status, _, error = shroud("respond", path, "--rom", rom, "--out", tmp_path / "out")
    assert status == 2
    assert len(error.splitlines()) == 1
    assert said in error
    assert ", allowed: " in error


def test_names_of_a_blade_made_here_are_checked_without_a_model(tmp_path: Path) -> None:
    for name, status in (("shroud", 0), ("snuber", 2)):
        path = write_scene(tmp_path / "s.toml", small_scene() | {"interface": {name: {"friction": 0.2}}})
        found, _, error = shroud("validate", path)
        assert found == status
        assert ("unknown name, allowed: contact interfaces of the model: shroud" in error) == (status == 2)


def test_faces_that_are_left_out_are_no_boundary_of_the_model(tmp_path: Path) -> None:
    """A blade made here with a snubber: the shroud touches alone, or the snubber; both are known names."""
    snubber = {"radius": 0.38, "thickness": 0.005, "width": 0.012}
    tables = small_scene(response__frequency=[380.0, 420.0]) | {"snubber": snubber}
    sizes = {}
    for chosen in (["shroud"], ["snubber"], ["shroud", "snubber"]):
        tables["contact"]["interfaces"] = chosen
        path = write_scene(tmp_path / "s.toml", tables | {"interface": {"snubber": {"friction": 0.2}}})
        run = run_scene(path, tmp_path / "out", until="reduce", quiet=True)
        model = read_reduced_model(tmp_path / "out" / run.summary["models"][0]["rom"])
        assert list(model.interfaces) == chosen
        sizes[tuple(chosen)] = model.size
    assert sizes["shroud",] == sizes["snubber",] == sizes["shroud", "snubber"] - 24

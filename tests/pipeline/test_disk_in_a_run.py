"""A blade on its disk in a run: its waves, its limits, the same sector from a mesh file, and what is refused."""

import json
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from mesh_writer import write_mesh
from pipeline_support import overlapping_texts, shroud, small_scene, summary_of, write_scene

import pipeline.verify.advice
import pipeline.verify.compare
from geometry import build_sector
from pipeline.figures.campbell import nodal_diameter_figure
from pipeline.scene.geometry_parameters import geometry_parameters
from pipeline.scene.reading import read_scene
from pipeline.stages.model.build_mesh import SECTOR
from pipeline.stages.model.model_files import read_families
from rom import (
    Material,
    ReducedModel,
    WaveSuperelement,
    assemble,
    model_of_waves,
    read_reduced_model,
    write_reduced_model,
)
from rom.cyclic_sector.cyclic_faces import cyclic_faces
from rom.cyclic_sector.cyclic_modes import cyclic_modes, modes_by_nodal_diameter
from rom.files.sector_file import load_sector

DISK: dict[str, Any] = {"bore_radius": 0.2, "rim_width": 0.05, "bore_width": 0.03, "profile": [[0.26, 0.012]]}
STEEL = {"young_modulus": 210e9, "poisson_ratio": 0.3, "density": 7850.0}
SOFT = STEEL | {"young_modulus": 70e9, "density": 2800.0}


def disk_scene(**changes: Any) -> dict[str, Any]:
    """The small blade on a disk of aluminium."""
    return small_scene(**{"disk": dict(DISK), "materials": {"disk": SOFT}, "rom__modes": 12} | changes)


@pytest.fixture(scope="module")
def reduced(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run up to the reduced model, for two engine orders."""
    folder = tmp_path_factory.mktemp("disk")
    scene = write_scene(
        folder / "scene.toml", disk_scene(sweep={"excitation.engine_order": [2, 70, 36]}, render={"modes": [1]})
    )
    assert shroud("run", scene, "--out", folder / "out", "--until", "reduce")[0] == 0
    return folder / "out"


def test_natural_frequencies_are_those_of_the_whole_mesh_in_each_wave(reduced: Path) -> None:
    model = summary_of(reduced)["models"][0]
    sector = load_sector((reduced / model["mesh"]).parent / SECTOR)
    full = assemble(sector, {"": Material(**STEEL), "disk": Material(**SOFT)}, "hex8")
    faces = cyclic_faces(full, sector)
    free, names = model["free_at_order_hz"], model["free_names"]
    for order, diameter in (("2", 2), ("36", 36)):
        np.testing.assert_allclose(free[order][:4], cyclic_modes(full, faces, diameter, 4).frequency_hz, rtol=2e-3)
    np.testing.assert_allclose(free["70"], free["2"], rtol=1e-9)  # the wave that runs backwards
    assert free["2"][0] < 0.99 * free["36"][0]
    assert model["wave_error"] < 5e-3
    assert model["free_hz"] == free["2"]
    assert names["2"][0].endswith("D")
    assert names["36"][0] == "1F"
    status, said, _ = shroud("info", reduced / model["rom"])
    assert status == 0
    assert f"joined to its neighbours at cut faces: {model['cut_face_motions']} motions of each" in said
    assert "free natural frequencies [Hz] at nodal diameter 0" in said


def test_the_share_of_the_disk_is_that_of_its_strain_energy(reduced: Path) -> None:
    """Against the modes of the whole mesh and the matrices of a sector of which only the disk is stiff."""
    model = summary_of(reduced)["models"][0]
    sector = load_sector((reduced / model["mesh"]).parent / SECTOR)
    full = assemble(sector, {"": Material(**STEEL), "disk": Material(**SOFT)}, "hex8")
    soft_blade = Material(**STEEL | {"young_modulus": 1.0})
    disk = assemble(sector, {"": soft_blade, "disk": Material(**SOFT)}, "hex8").stiffness
    families = read_families(reduced / model["rom"])
    assert families is not None
    rom = read_reduced_model(reduced / model["rom"])
    for diameter in (1, 3, 9):
        exact = cyclic_modes(full, cyclic_faces(full, sector), diameter, 4)
        energy = np.real(np.sum(exact.shapes.conj() * (disk @ exact.shapes), axis=0)) / exact.omega**2
        hz, _, share = families.modes(rom, 2.0 * np.pi * diameter / 72, count=4)
        np.testing.assert_allclose(hz, exact.frequency_hz, rtol=2e-3)
        np.testing.assert_allclose(share, energy, rtol=0.02, atol=2e-3)


def test_engine_orders_are_folded_at_half_the_number_of_blades(reduced: Path) -> None:
    """At speed the diagram marks each engine order at its nodal diameter and at its frequency."""
    model = summary_of(reduced)["models"][0]
    scene = read_scene(reduced.parent / "scene.toml").first
    at_speed = scene.model_copy(update={"load": scene.load.model_copy(update={"speed_rpm": 1200.0})})
    curve: Any = SimpleNamespace(
        rom=reduced / model["rom"],
        scene=at_speed,
    )
    figure = nodal_diameter_figure(curve, "wheel", {2, 70, 36})
    assert figure is not None
    marks = {text.get_text(): text.xy for text in figure.axes[0].texts if text.get_text().startswith("EO ")}
    assert marks["EO 2"] == (2, 40.0)
    assert marks["EO 36"] == (36, 720.0)
    assert marks["EO 70"] == (2, 1400.0)
    numbers = {part for text in figure.axes[0].texts if text.get_visible() for part in text.get_text().split(", ")}
    listed = len(figure.legends[0].get_texts())
    assert {str(number) for number in range(1, listed + 1)} | set(marks) <= numbers
    assert not overlapping_texts(figure)
    assert figure.axes[1].get_ylabel().startswith("share of the disk")


def test_exported_shapes_are_those_of_the_wave_of_the_scene(reduced: Path, tmp_path: Path) -> None:
    """They were those of nodal diameter 0; each wave has shapes and frequencies of its own."""
    order, free = next(iter(summary_of(reduced)["models"][0]["free_at_order_hz"].items()))
    said = shroud("export", reduced, "--to", tmp_path / "s.vtu")[1]
    assert f"(engine order {order}), {free[0]:.5g}" in said
    other = shroud("export", reduced, "--to", tmp_path / "o.vtu", "--engine-order", "0")[1]
    assert "of nodal diameter 0 (engine order 0)" in other
    assert f"{free[0]:.5g}" not in other


def test_resonance_crossings_of_each_engine_order(reduced: Path) -> None:
    """In summary.json against the lists of frequencies there, in the diagram with the same numbers."""
    model = summary_of(reduced)["models"][0]
    scene = read_scene(reduced.parent / "scene.toml").first
    low, high = scene.response.frequency
    limits = {
        order: list(zip(model["free_at_order_hz"][order], model["stuck_hz"][order], strict=True))
        for order in ("2", "36", "70")
    }
    inside = [
        (int(order), mode, model["free_names"][order][mode - 1], free, stuck)
        for order, modes in limits.items()
        for mode, (free, stuck) in enumerate(modes, start=1)
        if free <= high and stuck >= low
    ]
    crossings = sorted(model["crossings"], key=lambda each: (each["engine_order"], each["mode"]))
    keys = ("engine_order", "mode", "name", "free_hz", "stuck_hz")
    assert [tuple(each[key] for key in keys) for each in crossings if each["range_distance"] == 0.0] == inside
    assert {each["wave"] for each in crossings if each["engine_order"] == 70} == {"forward"}
    for each in crossings:
        assert each["nodal_diameter"] == {2: 2, 70: 2, 36: 36}[each["engine_order"]]
        assert each["free_rpm"] * each["engine_order"] == pytest.approx(60.0 * each["free_hz"], rel=1e-12)
    curve: Any = SimpleNamespace(
        rom=reduced / model["rom"],
        scene=scene,
    )
    figure = nodal_diameter_figure(curve, "wheel", {2, 70, 36})
    assert figure is not None
    listed = [text.get_text() for text in figure.legends[0].get_texts()]
    assert [line.split(":")[0] for line in listed] == [
        f"EO {order}, { {2: 'backward', 36: 'standing', 70: 'forward'}[order] }, {name}"
        for order, _, name, *_ in inside
    ]


def test_a_stiff_and_heavy_disk_is_a_clamp(tmp_path: Path) -> None:
    """From the scene to the peak of the curve: a disk hardly moves that is thousands of times stiffer and heavier."""
    rigid = STEEL | {"young_modulus": 1e15, "density": 3.7e7}
    quick = {"response__frequency": [330.0, 420.0]}
    found = {}
    for name, scene in {
        "clamped": small_scene(rom__modes=12, **quick),
        "rigid": disk_scene(materials={"disk": rigid}, rom__modes=12, **quick),
    }.items():
        file = write_scene(tmp_path / f"{name}.toml", scene)
        assert shroud("run", file, "--out", tmp_path / name, "--force")[0] == 0  # no disk is that heavy
        found[name] = summary_of(tmp_path / name)
    peaks = {name: summary["curves"][0] for name, summary in found.items()}
    assert peaks["rigid"]["peak_amplitude_m"] == pytest.approx(peaks["clamped"]["peak_amplitude_m"], rel=5e-3)
    assert peaks["rigid"]["peak_frequency_hz"] == pytest.approx(peaks["clamped"]["peak_frequency_hz"], rel=2e-3)
    stuck = [summary["models"][0]["stuck_hz"]["36"][:4] for summary in found.values()]
    np.testing.assert_allclose(stuck[1], stuck[0], rtol=3e-3)


def test_the_same_sector_from_a_mesh_file(reduced: Path, tmp_path: Path) -> None:
    """Its cut faces are known by their names; `shroud new` says so."""
    made = summary_of(reduced)["models"][0]
    sector = load_sector((reduced / made["mesh"]).parent / SECTOR)
    write_mesh(tmp_path / "wheel.inp", sector, {"": STEEL, "disk": SOFT})
    status, said, error = shroud("new", tmp_path / "new", "--mesh", tmp_path / "wheel.inp")
    assert status == 0, error
    scene = tomllib.loads((tmp_path / "new" / "scene.toml").read_text())
    assert scene["mesh"]["sets"]["cyclic_right"] == "cyclic_right"
    count = len(sector.node_sets["cyclic_right"])
    assert f"sector of a disk: {count} nodes of each cut face are joined to the neighbours" in said
    mesh = {"file": "wheel.inp", "n_blades": 72, "contact_grid": [2, 2]}
    mesh["sets"] = {"root": "root", "contact_right": "face_right", "contact_left": "face_left", "tip": "tip"}
    own = disk_scene(disk=None, blade=None, shroud=None, mesh=mesh, excitation__engine_order=2)
    file = write_scene(tmp_path / "own.toml", {name: value for name, value in own.items() if value is not None})
    status, said, error = shroud("run", file, "--out", tmp_path / "out", "--until", "reduce")
    assert status == 0, error
    found = summary_of(tmp_path / "out")["models"][0]
    np.testing.assert_allclose(found["free_hz"], made["free_at_order_hz"]["2"], rtol=1e-4)
    np.testing.assert_allclose(found["stuck_hz"]["2"], made["stuck_hz"]["2"], rtol=1e-4)


def test_a_free_disk_from_a_mesh_file(tmp_path: Path) -> None:
    """Frequencies of the whole mesh and responses at 0, 1 and 2 nodal diameters, as with a disk made here."""
    quick = {"response__frequency": [270.0, 300.0], "sweep": {"excitation.engine_order": [0, 1, 2]}}
    file = write_scene(tmp_path / "made.toml", disk_scene(disk=DISK | {"bore": "free"}, **quick))
    assert shroud("run", file, "--out", tmp_path / "made", "--until", "respond")[0] == 0
    made = summary_of(tmp_path / "made")
    sector = load_sector((tmp_path / "made" / made["models"][0]["mesh"]).parent / SECTOR)
    write_mesh(tmp_path / "wheel.inp", sector, {"": STEEL, "disk": SOFT})
    mesh: dict[str, Any] = {"file": "wheel.inp", "n_blades": 72, "contact_grid": [2, 2], "bore": "free"}
    mesh["sets"] = {"contact_right": "face_right", "contact_left": "face_left", "tip": "tip"}
    own = disk_scene(disk=None, blade=None, shroud=None, mesh=mesh, **quick)
    own = {name: value for name, value in own.items() if value is not None}
    status, _, error = shroud(
        "run", write_scene(tmp_path / "own.toml", own), "--out", tmp_path / "own", "--until", "respond"
    )
    assert status == 0, error
    assert "wheel.inp: the disk is free: nothing holds it" in error
    found = summary_of(tmp_path / "own")
    read = load_sector((tmp_path / "own" / found["models"][0]["mesh"]).parent / SECTOR)
    materials = {"": Material(**STEEL), "MATERIAL": Material(**STEEL), "disk": Material(**SOFT)}
    wholes = [assemble(each, materials) for each in (sector, read)]
    assert wholes[1].fixed.size == 0
    modes = [
        modes_by_nodal_diameter(full, cyclic_faces(full, each), (0, 1, 2), 5)
        for full, each in zip(wholes, (sector, read), strict=True)
    ]
    for n, rigid in ((0, 2), (1, 2), (2, 0)):
        before, after = (each[n].frequency_hz for each in modes)
        np.testing.assert_allclose(after[rigid:], before[rigid:], rtol=1e-9)
        assert np.all(after[:rigid] < 1e-2 * after[rigid])
        pairs = [summary["models"][0]["stuck_hz"][str(n)][rigid:6] for summary in (made, found)]
        np.testing.assert_allclose(pairs[1], pairs[0], rtol=1e-5)
    for before, after in zip(made["curves"], found["curves"], strict=True):
        assert after["peak_frequency_hz"] == pytest.approx(before["peak_frequency_hz"], rel=2e-5)  # flat
        assert after["peak_amplitude_m"] == pytest.approx(before["peak_amplitude_m"], rel=1e-5)
    assert 280.0 < made["curves"][2]["peak_frequency_hz"] < 290.0  # a resonance
    status, _, error = shroud("validate", write_scene(tmp_path / "stress.toml", own | {"stress": {}}))
    assert status == 2
    assert 'stress: given with mesh.bore = "free", allowed: mesh.bore = "clamped"' in error
    with_root = own | {"mesh": mesh | {"sets": mesh["sets"] | {"root": "bore"}}}
    status, _, error = shroud("validate", write_scene(tmp_path / "root.toml", with_root))
    assert status == 2
    assert 'mesh.sets.root: "bore", allowed: must not be named with bore = "free"' in error


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"disk__bore_radius": 0.3}, "disk.bore_radius: 0.3, allowed: must lie between 0 and the hub radius (0.3 m)"),
        ({"disk__bore_radius": 0.0}, "disk.bore_radius: 0.0, allowed: a number above 0, 1e-6 to 1000"),
        ({"disk__rim_width": 0.03}, "disk.rim_width: 0.03, allowed: must be at least 0.0368 m to carry the root"),
        (
            {"disk__profile": [[0.27, 0.02], [0.25, 0.02]]},
            "allowed: must be rows [radius, width] with ascending radii between 0.2 and 0.3 m",
        ),
        ({"disk__bore": "held"}, 'disk.bore: "held", allowed: "clamped" or "free"'),
        ({"disk__size": 0.5}, "disk.size: 0.5, allowed: must lie between a tenth of mesh.size and 0.099 m"),
        ({"disk__size": 1e-6}, "mesh.size: 0.009, allowed: larger elements"),
        ({"rom__nodal_diameters": [0, 37]}, "rom.nodal_diameters: [0, 37], allowed: whole numbers, 0 to 36 with 72"),
        ({"disk": None, "materials": None, "rom__nodal_diameters": [0]}, "[0], allowed: nothing without a disk"),
        (
            {"stress": {}, "disk__bore": "free"},
            'stress: given with disk.bore = "free", allowed: disk.bore = "clamped"',
        ),
        ({"materials__rim": STEEL}, "materials.rim: given without mesh.file, allowed: tables [material] and"),
        ({"disk": None}, "materials: given without mesh.file, allowed: a table [material]"),
        ({"sweep": {"disk.rim_width": [0.05, 0.01]}}, 'sweep."disk.rim_width": 0.01, allowed: must be at least'),
        ({"sweep": {"disk.profile": [[]]}}, 'sweep."disk.profile": unknown key'),
    ],
)
def test_disks_that_do_not_fit_are_refused(tmp_path: Path, changes: dict[str, Any], expected: str) -> None:
    status, _, error = shroud("validate", write_scene(tmp_path / "scene.toml", disk_scene(**changes)))
    assert status == 2
    assert expected in error
    assert "Traceback" not in error


@pytest.mark.long
def test_verify_measures_against_the_whole_mesh_in_the_wave_excited(
    reduced: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Frequencies with free contacts against modes of both meshes at 2 nodal diameters, which order 70 excites."""
    monkeypatch.setattr(pipeline.verify.compare, "_MOST_ELEMENTS", 10)  # so that the other mesh is a coarser one
    monkeypatch.setattr(pipeline.verify.advice, "_HALVINGS", 0)
    monkeypatch.setattr(pipeline.verify.advice, "MOST_DOFS", 10)  # one mesh is tried
    shutil.copytree(reduced / "store", tmp_path / "store")
    tolerance, rest = 3e-4, ("--out", tmp_path, "--json", "--quiet")
    file = write_scene(tmp_path / "scene.toml", disk_scene(excitation__engine_order=70))
    status, said, error = shroud("verify", file, *rest, "--tolerance", tolerance)
    assert (status, error) == (0, "")
    found = json.loads(said)
    assert found["problems"] == []
    (case,), (advice,) = found["cases"], found["advice"]
    scene, materials = read_scene(file).first, {"": Material(**STEEL), "disk": Material(**SOFT)}
    parameters = geometry_parameters(scene)
    mesh = parameters["mesh"]
    coarse = replace(mesh, size=case["other"]["size"])
    assert coarse.size > mesh.size
    free = case["joints"][0]
    for name, chosen in (("full_hz", mesh), ("other_hz", coarse)):
        sector = build_sector(**parameters | {"mesh": chosen})
        full = assemble(sector, materials, "hex8")
        exact = cyclic_modes(full, cyclic_faces(full, sector), 2, 4).frequency_hz[free["first_mode"] - 1 :]
        np.testing.assert_allclose(free[name][: len(exact)], exact[: len(free[name])], rtol=1e-6)
    assert case["static"] < 1e-6
    assert advice["needed_modes"] > 12
    monkeypatch.setattr(pipeline.verify.compare, "other_sector", lambda *_: 1 / 0)
    enough = disk_scene(rom__modes=advice["needed_modes"], excitation__engine_order=70)
    _, said, _ = shroud("verify", write_scene(tmp_path / "enough.toml", enough), *rest)
    after = json.loads(said)["cases"][0]
    assert after["receptance_error"] < 1.1 * tolerance < case["receptance_error"]


def lumped() -> ReducedModel:
    """A blade with one contact node, on rims left and right of it that springs join and hold; twelve sectors."""
    rim = 1e6 * np.array([[2.0, -1.0, -1.0], [-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]]) + 1e5 * np.eye(3)
    blade, left, right = np.eye(3)
    along_t, along_n = np.outer([0.3, 0.0, 1.0], blade), np.outer([0.0, 0.0, 0.8], blade)
    cuts = {"cyclic_right": right[None], "cyclic_left": left[None]}
    return ReducedModel(
        np.eye(3), rim, along_t, np.zeros((1, 3)), blade, {"tip": blade}, along_n, n_blades=12, producer="x", **cuts
    )


def superelements(model: ReducedModel) -> dict[int, WaveSuperelement]:
    """The same for each nodal diameter, as another program reduces it."""
    found = {}
    for n in range(7):
        wave = model.wave(np.pi * n / 6)
        assert wave is not None
        assert model.contact_left is not None
        own = wave.real if n in (0, 6) else wave * np.exp(0.3j)
        adjoint = own.conj().T
        found[n] = WaveSuperelement(
            adjoint @ model.mass @ own,
            adjoint @ model.stiffness @ own,
            model.contact_right @ own,
            model.contact_left @ own,
            adjoint @ model.force_excitation,
            {"tip": model.outputs["tip"] @ own},
        )
    return found


def test_models_from_elsewhere_with_cut_faces_or_a_superelement_for_each_wave(tmp_path: Path) -> None:
    """Both give the same curve; what a file holds is said, and what cannot be exported."""
    scene = {
        "name": "lumped",
        "contact": {"normal_stiffness": 1e5, "tangential_stiffness": 5e4, "friction": 0.4, "interference": 1e-4},
        "excitation": {"engine_order": 2, "force": 10.0},
        "response": {"frequency": [50.0, 300.0], "damping_ratio": 0.01, "truncation": False, "detached": False},
    }
    file, peaks = write_scene(tmp_path / "scene.toml", scene), []
    waves = model_of_waves(superelements(lumped()), 12, np.zeros((1, 3)))
    said = {"cuts": "cut faces: 1 motion of each", "waves": "a superelement for each: 0, 1, 2, 3, 4, 5, 6"}
    for name, model in {"cuts": lumped(), "waves": waves}.items():
        rom = tmp_path / f"{name}.h5"
        write_reduced_model(rom, model)
        assert said[name] in shroud("info", rom)[1]
        assert shroud("respond", file, "--rom", rom, "--out", tmp_path / name)[0] == 0
        peaks.append(summary_of(tmp_path / name)["curves"][0]["peak_amplitude_m"])
        assert list(summary_of(tmp_path / name)["models"][0]["free_at_order_hz"]) == ["2"]
        assert shroud("export", rom, "--to", tmp_path / f"{name}.op4")[0] == (0 if name == "cuts" else 2)
    assert peaks[1] == pytest.approx(peaks[0], rel=1e-9)

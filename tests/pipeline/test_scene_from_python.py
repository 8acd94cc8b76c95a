"""`run_scene` takes a file, a dict and overrides; its progress is shown where somebody looks."""

import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pipeline_support import ground_scene, small_scene, write_ground_model, write_scene

import shroud
from pipeline import python_interface
from pipeline.scene.reading import SceneFile, given_scene, read_scene, toml_text

SHIPPED = sorted(Path(__file__).parents[2].glob("scenes/*.toml"))
SWEEP = {"contact.interference": [0.0, 1e-5], "contact.friction": [0.1, 0.2]}


def frictions(file: SceneFile) -> list[Any]:
    return [member.scene.contact.friction for member in file.members]


def test_a_dict_is_the_same_scene_as_its_file(tmp_path: Path) -> None:
    scene = small_scene(sweep=SWEEP, title='Quotes "here" and ü')
    path = write_scene(tmp_path / "s.toml", scene)
    assert given_scene(scene, {}).members == read_scene(path).members == given_scene(path, {}).members
    arrays = small_scene(
        mesh__contact_grid=(2, 2), contact__friction=np.full(4, 0.3), contact__preload=np.float64(1.0)
    )
    assert frictions(given_scene(arrays, {})) == [(0.3, 0.3, 0.3, 0.3)]


@pytest.mark.parametrize("scene", SHIPPED, ids=lambda path: path.stem)
def test_tables_written_as_toml_are_read_as_they_were(scene: Path) -> None:
    tables = tomllib.loads(scene.read_text())
    assert tomllib.loads(toml_text(tables)) == tables


@pytest.mark.parametrize(
    "overrides",
    [
        {"contact.friction": 0.7},
        {"contact": {"friction": 0.7}},
        {"sweep.contact.friction": None, "contact.friction": 0.7},
    ],
)
@pytest.mark.parametrize("sweep", [SWEEP, {"contact": {"friction": [0.1, 0.2], "interference": [0.0, 1e-5]}}])
def test_an_override_takes_the_place_of_a_key_and_of_its_sweep(
    tmp_path: Path, overrides: dict[str, Any], sweep: dict[str, Any]
) -> None:
    path = write_scene(tmp_path / "s.toml", small_scene(sweep=sweep))
    file = given_scene(path, overrides)
    assert frictions(file) == [0.7, 0.7]
    assert file.swept == ("contact.interference",)
    assert tomllib.loads(file.text)["contact"]["friction"] == 0.7, "the text is of the scene as it is run"
    assert frictions(given_scene(read_scene(path), overrides)) == [0.7, 0.7]
    assert sorted(frictions(read_scene(path))) == [0.1, 0.1, 0.2, 0.2], "the file is as it was"


def test_overrides_add_remove_and_sweep(tmp_path: Path) -> None:
    path = write_scene(tmp_path / "s.toml", small_scene(sweep=SWEEP))
    file = given_scene(path, {"sweep": None, "accuracy": "draft", "mesh.size": None, "load": {"speed_rpm": 100.0}})
    assert len(file.members) == 1
    assert file.first.load.speed_rpm == 100.0
    assert file.accuracy is not None
    assert file.first.mesh is not None
    assert file.first.mesh.size != small_scene()["mesh"]["size"]
    swept = given_scene(path, {"sweep": {"contact.friction": [0.3], "shroud.angle": [60.0, 70.0]}})
    assert swept.swept == ("contact.interference", "contact.friction", "shroud.angle")
    assert set(frictions(swept)) == {0.3}


@pytest.mark.parametrize("value", [{"contact": {"friction": 0.2}}, {"contact.friction": 0.2}])
@pytest.mark.parametrize("sweep", [[0.1, 0.2], (0.1, 0.2), np.array([0.1, 0.2])])
@pytest.mark.parametrize(
    "scene_sweep", [{}, {"contact.friction": [0.5, 0.6]}, {"points": [{"contact.friction": 0.5}]}]
)
def test_a_sweep_of_a_call_stands(scene_sweep: dict[str, Any], value: dict[str, Any], sweep: Any) -> None:
    scene = small_scene(sweep=scene_sweep)
    columns = {"points": [{"contact.friction": item} for item in sweep]}
    swept = columns if "points" in scene_sweep else {"contact.friction": sweep}
    file = given_scene(scene, value, more={"sweep": swept})
    assert frictions(file) == [0.1, 0.2]
    both = given_scene(scene, value, more={"sweep": None})
    assert frictions(both) == [0.2]


@pytest.mark.parametrize(
    ("overrides", "tables", "said"),
    [
        ({}, {"contact": {"friction": 0.3}, "sweep": {"contact.friction": [0.1, 1.0]}}, "beside a sweep of it"),
        ({"contact.friction": 0.3}, {"sweep": {"contact": {"friction": [0.1]}}}, "beside a sweep of it"),
        ({"sweep.contact.friction": [0.1], "contact.friction": 0.3}, {}, "beside a sweep of it"),
        ({}, {"contact": {"friction": 0.3}, "sweep": {"points": [{"contact.friction": 0.1}]}}, "beside a sweep"),
        ({"contact.friction": 0.3}, {"contact": {"friction": 0.4}}, "given twice, 0.3 and 0.4"),
        ({"contact": {"friction": 0.3}}, {"contact": {"friction": 0.4, "preload": 1.0}}, "given twice"),
        ({"sweep": {"contact.friction": [0.3]}}, {"sweep": {"contact.friction": [0.4]}}, "given twice"),
    ],
)
def test_what_a_call_says_twice_is_refused(overrides: dict[str, Any], tables: dict[str, Any], said: str) -> None:
    with pytest.raises(shroud.InputError, match=rf"contact\.friction: .*{said}"):
        given_scene(small_scene(), overrides, more=tables)
    file = given_scene(small_scene(), {"contact": {"friction": 0.3}}, more={"contact": {"preload": 1.0}})
    assert (file.first.contact.friction, file.first.contact.preload) == (0.3, 1.0)


def test_what_is_wrong_in_an_override_is_said_as_in_a_file(tmp_path: Path) -> None:
    path = write_scene(tmp_path / "s.toml", small_scene())
    with pytest.raises(shroud.InputError, match=r"s\.toml: contact\.mu: unknown key, did you mean contact\.friction"):
        shroud.run_scene(path, overrides={"contact.mu": 0.3})
    with pytest.raises(shroud.InputError, match=r"^scene: contact\.friction: -1, allowed: "):
        shroud.run_scene(small_scene(contact__friction=-1))
    with pytest.raises(TypeError, match="unexpected keyword argument 'job'"):
        shroud.run_scene(path, job=2)
    points = small_scene(sweep={"points": [{"contact.friction": 0.1}, {"contact.friction": 0.2}]})
    assert len(given_scene(points, {"contact.law": "cone"}).members) == 2
    with pytest.raises(shroud.InputError, match=r"contact\.friction: swept by sweep\.points"):
        given_scene(points, {"contact.friction": 0.3})
    assert frictions(given_scene(points, {"contact.friction": 0.3, "sweep": None})) == [0.3]


def test_a_run_of_a_dict_with_overrides(tmp_path: Path) -> None:
    rom = write_ground_model(tmp_path / "g.h5")
    results = shroud.run_scene(
        ground_scene(),
        tmp_path / "out",
        rom=rom,
        overrides={"contact.friction": 0.9},
        sweep={"contact.preload": [0.0]},
    )
    assert [dict(curve.parameters) for curve in results.curves] == [{"contact.preload": 0.0}]


@pytest.mark.parametrize(("terminal", "shell"), [(False, ""), (True, ""), (False, "ZMQInteractiveShell")])
def test_progress_is_shown_where_somebody_looks(monkeypatch: pytest.MonkeyPatch, terminal: bool, shell: str) -> None:
    monkeypatch.setattr("sys.stderr", SimpleNamespace(isatty=lambda: terminal))
    own = type(shell or "Shell", (), {})()
    monkeypatch.setitem(python_interface.sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: own))
    reporter = python_interface._reporter(None)
    assert reporter.quiet is not (terminal or bool(shell))
    assert python_interface._reporter(True).quiet
    assert not python_interface._reporter(False).quiet
    assert (reporter.stream is python_interface.sys.stdout) == bool(shell)

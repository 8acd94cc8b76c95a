"""Every key of every section with values of every wrong kind: taken, or refused in one line before any work."""

import math
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from pipeline_support import RAW_TEXT, shroud, small_scene, to_toml, write_scene

from pipeline.errors import InputError
from pipeline.scene.json_schema import scene_schema
from pipeline.scene.reading import read_scene
from pipeline.scene.schema import SECTIONS
from pipeline.scene.toml_text import LARGEST_FILE
from pipeline.scene.validation_errors import MOST_ERRORS

REPOSITORY = Path(__file__).parents[2]
KEYS = [(section, key) for section, model in SECTIONS.items() for key in model.model_fields]
WRONG: dict[str, Any] = {
    "text": "nonsense",
    "truth": True,
    "one": 1,
    "zero": 0,
    "negative": -1,
    "fraction": 0.37,
    "not a number": math.nan,
    "infinite": math.inf,
    "enormous": 1e300,
    "400 digits": 10**400,
    "tiny": 1e-300,
    "empty list": [],
    "nested": [[1.0, 2.0], [3.0]],
    "list of three": [1.0, 2.0, 3.0],
    "long list": [1.0] * 1000,
    "list with text": [1.0, "x"],
    "list with nan": [math.nan, 1.0],
    "table": {"a": 1},
    "date": date(2011, 7, 24),
}


WHOLE: dict[str, dict[str, Any]] = {  # sections that the small scene lacks
    "snubber": {"radius": 0.39, "thickness": 0.006, "width": 0.014},
    "platform": {"radius": 0.312, "thickness": 0.006},
    "damper": {"mass": 0.02, "radius": 0.3, "inertia": [1e-6, 1e-6, 1e-6]},
    "disk": {"bore_radius": 0.2, "rim_width": 0.05, "profile": [[0.25, 0.02]]},
    "model": {"stiffness": "K.mtx", "mass": "M.mtx", "nodes": "nodes.csv", "n_blades": 12},
    "aero": {"family": [{"mode": 1, "offset": [0], "real": [0.0], "imaginary": [-0.01]}]},
    "stress": {},
    "fatigue": {"endurance_limit": 3e8, "tensile_strength": 9e8, "factor": 1.5},
    "flutter": {"nodal_diameters": [3, -2], "harmonics": 1, "curves": [0]},
    "backbone": {"modes": [1], "nodal_diameters": [3], "amplitudes": [1e-6, 1e-3], "curves": [0]},
    "run_up": {"rate": [5.0, 20.0], "frequency": [420.0, 440.0], "curves": [0], "probes": {"angles": [10.0]}},
    "identify": {
        "over": {"contact.friction": [0.1, 0.9]},
        "measured": [{"frequency": 430.0, "amplitude": 2e-6, "rate": 5.0, "at": {"excitation": {"force": 0.3}}}],
    },
    "crossings": {"speed": [1000.0, 6000.0], "steady": [3000.0]},
    "optimum": {"over": {"contact.interference": [-1e-5, 1e-5]}},
    "map": {"over": {"contact.interference": [-1e-5, 1e-5], "contact.friction": [0.2, 0.4]}, "values": 3},
    "mistuning": {"frequency": [0.01] * 72, "frequency_range": [200.0, 300.0]},
    "wear": {"coefficient": 1e-14, "hours": 1000.0, "duty": [{"share": 1.0, "force": 0.1}]},
    "uncertainty": {"parameter": [{"key": "contact.friction", "distribution": "normal", "deviation": 0.05}]},
}
TEXTS = ("stiffness", "mass", "nodes", "dofs", "stiffness_name", "mass_name", "centrifugal", "transformation")
INSTEAD_OF_BLADE = ("blade", "shroud", "mesh", "material")  # what [model] takes the place of
# Keys of a mesh from a file, which do not go with those of a mesh made here: the schema does not say it.
OF_A_MESH_FILE = {
    ("mesh", key) for key in ("file", "n_blades", "unit", "axis", "axis_point", "tolerance", "bore", "sets")
}


@pytest.fixture(scope="module")
def validator() -> Draft202012Validator:
    return Draft202012Validator(scene_schema())


def whole_scene(section: str, key: str, value: Any) -> dict[str, Any]:
    """The small scene with every section in it and one value changed; None removes the key."""
    base = small_scene(render={"modes": [1]}, figures={"formats": ["png"]})
    for other in INSTEAD_OF_BLADE if section == "model" else ():
        base.pop(other, None)
    base[section] = {name: held for name, held in (base.get(section) or WHOLE[section]).items() if name != key}
    if value is not None:
        base[section][key] = value
    return base


def judged(path: Path, scene: dict[str, Any]) -> str:
    """The complaints of `shroud validate`, empty where there are none; checks that they are tidy."""
    status, said, error = shroud("validate", write_scene(path, scene))
    if status == 0:
        assert "valid" in said
        assert all(line.startswith(("warning: ", "note: ")) for line in error.splitlines()), error
        return ""
    assert (status, said) == (2, ""), error
    for line in error.splitlines():
        assert re.match(rf"{re.escape(str(path))}(:\d+)?: ", line), error
        assert ", allowed: " in line or "no such file" in line
        assert not RAW_TEXT.search(line), error
        assert len(line) < len(str(path)) + (1700 if "unknown key" in line else 500)
    assert error
    return error


def fits(validator: Draft202012Validator, path: Path) -> bool:
    """Whether the JSON schema takes the scene file."""
    return validator.is_valid(tomllib.loads(path.read_text()))


@pytest.mark.parametrize(("section", "key"), KEYS)
def test_wrong_values(tmp_path: Path, validator: Draft202012Validator, section: str, key: str) -> None:
    """A sixth of the wrong kinds, for each key another one than for the next."""
    path = tmp_path / "scene.toml"
    for kind, value in [*WRONG.items()][KEYS.index((section, key)) % 6 :: 6]:
        complaint = judged(path, whole_scene(section, key, value))
        assert list(tmp_path.iterdir()) == [path], kind
        if complaint:
            assert "None" not in complaint, (kind, complaint)
        if not fits(validator, path):
            assert complaint, f"{kind}: the schema refuses what the program takes"
        elif _is_json(value) and (section, key) not in OF_A_MESH_FILE:
            try:
                read_scene(path)
            except InputError as error:
                pytest.fail(f"{kind}: the schema takes what the reader refuses: {error}")


def _is_json(value: Any) -> bool:
    """Whether JSON has such a value and takes it for the same: it knows no nan, and 1.0 is a whole number there."""
    if isinstance(value, list):
        return all(_is_json(item) for item in value)
    return not isinstance(value, float) or (math.isfinite(value) and value % 1 != 0)


@pytest.mark.parametrize(("section", "key"), KEYS)
def test_missing_and_misspelt_keys(tmp_path: Path, validator: Draft202012Validator, section: str, key: str) -> None:
    path = tmp_path / "scene.toml"
    complaint = judged(path, whole_scene(section, key, None))
    if SECTIONS[section].model_fields[key].is_required():
        assert f"{section}.{key}: missing, allowed: " in complaint
    assert fits(validator, path) or complaint
    misspelt = whole_scene(section, key, None)
    misspelt[section][f"{key}x"] = 1
    complaint = judged(path, misspelt)
    assert f"{section}.{key}x: unknown key, did you mean {section}.{key}?" in complaint
    assert not fits(validator, path)


@pytest.mark.parametrize(("section", "key"), KEYS)
def test_wrong_values_in_a_sweep(tmp_path: Path, section: str, key: str) -> None:
    path = tmp_path / "scene.toml"
    scene = whole_scene(section, key, None) if section == "model" else small_scene()
    names = (section, key) == ("mesh", "file") or (section == "model" and key in TEXTS)  # any text may name a file
    for value in ("nonsense", math.nan, {"a": 1})[names:]:
        complaint = judged(path, scene | {"sweep": {f"{section}.{key}": [value]}})
        assert f'sweep."{section}.{key}"' in complaint


@pytest.mark.parametrize("section", SECTIONS)
@pytest.mark.parametrize("value", ["x", [{}], math.nan])
def test_a_section_that_is_no_table(tmp_path: Path, section: str, value: Any) -> None:
    assert f": {section}: " in judged(tmp_path / "scene.toml", small_scene(**{section: value}))


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"mesh__size": 0.0005}, "mesh.size: 0.0005, allowed: larger elements"),
        ({"shroud__axial_width": 1000.0}, "mesh.size: 0.009, allowed: larger elements"),
        ({"blade__length": 1000.0}, "mesh.size: 0.009, allowed: larger elements"),
        ({"mesh__contact_grid": [15, 15], "response__harmonics": 15}, "response.harmonics: 15, allowed: 6 at most"),
        (
            {"contact__samples": 400, "mesh__contact_grid": [9, 9], "response__harmonics": 99},
            "harmonics: 99, allowed: 20",
        ),
        ({"excitation__at": [0.0, 0.0, 450.0]}, "excitation.at: [0.0, 0.0, 450.0], allowed: a point of the blade"),
        ({"excitation__at": [0.0, 0.0, -0.45]}, "excitation.at: [0.0, 0.0, -0.45], allowed: a point of the blade"),
        ({"excitation__at": [40.0, 0.0, 0.45]}, "excitation.at: [40.0, 0.0, 0.45], allowed: a point of the blade"),
        ({"render": {"modes": [100]}}, "render.modes: [100], allowed: 1 to 33"),
        ({"response__damping_ratio": [0.01] * 34}, "response.damping_ratio: a list of 34, allowed: 33 at most"),
        (
            {"mesh__size": 0.001, "sweep": {"blade.length": [0.15 + 1e-6 * k for k in range(1000)]}},
            "sweep: 1000 different models of some ",
        ),
        ({"response__frequency": [300.0, 300.0]}, "response.frequency: [300.0, 300.0], allowed: "),
    ],
)
def test_what_would_never_end(tmp_path: Path, changes: dict[str, Any], expected: str) -> None:
    assert expected in judged(tmp_path / "scene.toml", small_scene(**changes))


def test_a_large_sweep_of_one_model_is_checked_once_a_shape(tmp_path: Path) -> None:
    sweep = {
        "contact.interference": [1e-9 * k for k in range(40)],
        "contact.friction": [0.01 * k for k in range(40)],
    }
    assert judged(tmp_path / "scene.toml", small_scene(sweep=sweep)) == ""


BROKEN: dict[str, Callable[[Path], object]] = {
    "empty": lambda path: path.write_bytes(b""),
    "latin-1": lambda path: path.write_bytes('name = "Schaufel für ENOC"\n'.encode("latin-1")),
    "utf-16": lambda path: path.write_bytes(to_toml(small_scene()).encode("utf-16")),
    "zero bytes": lambda path: path.write_bytes(to_toml(small_scene()).encode() + b"\0\0\0"),
    "all zero bytes": lambda path: path.write_bytes(bytes(4096)),
    "doubled key": lambda path: path.write_text(to_toml(small_scene()) + "damping_ratio = 0.1\n"),
    "doubled table": lambda path: path.write_text(to_toml(small_scene()) + "[blade]\n"),
    "table and value": lambda path: path.write_text("blade = 1\n[blade.length]\n"),
    "half a file": lambda path: path.write_text(to_toml(small_scene())[:700]),
    "long line": lambda path: path.write_text('title = "' + "x" * (LARGEST_FILE // 2) + '"\n'),
    "long key": lambda path: path.write_text("x" * 100_000 + " = 1\n"),
    "deep table": lambda path: path.write_text("[" + ".".join("a" * 1000) + "]\n"),
    "key of many parts": lambda path: path.write_text(".".join("a" * 100_000) + " = 1\n"),
    "key of many parts in quotes": lambda path: path.write_text(" . ".join(['"a"'] * 100_000) + " = 1\n"),
    "heading of many parts": lambda path: path.write_text("[" + ".".join("a" * 100_000) + "]\n"),
    "many keys": lambda path: path.write_text("".join(f"k{k}.a = 1\n" for k in range(40_000))),
    "many quotes": lambda path: path.write_text('"' * 900_000),
    "deep list": lambda path: path.write_text("name = " + "[" * 100_000),
    "too large": lambda path: path.write_text("#" * (LARGEST_FILE + 1)),
    "directory": lambda path: path.mkdir(),
    "link to nowhere": lambda path: path.symlink_to(path.with_name("nowhere")),
    "link to itself": lambda path: path.symlink_to(path),
    "link to an endless device": lambda path: path.symlink_to("/dev/zero"),
    "link to a tree of the kernel": lambda path: path.symlink_to("/proc/self/mem"),
    "pipe": lambda path: os.mkfifo(path),
    "absent": lambda path: None,
}


@pytest.mark.parametrize("kind", BROKEN)
@pytest.mark.parametrize("command", ["validate", "run"])
def test_broken_files(tmp_path: Path, kind: str, command: str) -> None:
    path, out = tmp_path / "scene.toml", tmp_path / "out"
    BROKEN[kind](path)
    status, said, error = shroud(command, path, *([] if command == "validate" else ["--out", out]))
    assert (status, said) == (2, ""), error
    assert error.count("\n") == 1 or command == "validate", error
    assert error.count("\n") <= MOST_ERRORS
    for line in error.splitlines():
        assert line.startswith(f"{path}:"), error
        assert not RAW_TEXT.search(line), error
        assert len(line) < len(str(path)) + 500
    assert not out.exists()


UNREADABLE = {
    ("validate", "FILE"): ": cannot be read: Permission denied, allowed: a readable scene file in TOML\n",
    ("info", "FILE"): ": cannot be read: Permission denied, allowed: an HDF5 file with ",
    ("respond", "SCENE", "--rom", "FILE"): ": not readable as a reduced model: Permission denied\n",
}


@pytest.mark.parametrize("command", UNREADABLE, ids=lambda command: command[0])
def test_a_file_that_may_not_be_read(tmp_path: Path, command: tuple[str, ...]) -> None:
    places = {"SCENE": write_scene(tmp_path / "scene.toml", small_scene()), "FILE": tmp_path / "file"}
    places["FILE"].touch(0)
    # root reads every file unless it gives up the right to
    rights = ["setpriv", "--bounding-set=-dac_override,-dac_read_search"] if os.geteuid() == 0 else []
    if rights and subprocess.run([*rights, "true"], capture_output=True).returncode:
        pytest.skip("root cannot give up reading every file here")
    words = [str(places.get(word, word)) for word in command]
    done = subprocess.run([*rights, sys.executable, "-m", "pipeline", *words], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"{places['FILE']}{UNREADABLE[command]}")
    assert done.stderr.count("\n") == 1


def test_a_byte_order_mark_and_windows_line_ends_are_taken(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(b"\xef\xbb\xbf" + to_toml(small_scene()).replace("\n", "\r\n").encode())
    assert shroud("validate", path)[0] == 0


NAMES = [
    "",
    ".",
    "..",
    "../x",
    "/x",
    "a/b",
    "a\\b",
    "C:x",
    "a\x00b",
    "a\tb",
    "a\u202eb",
    "ａ",
    "é",
    "a" * 65,
    "-x",
    "~",
    "$HOME",
]


@pytest.mark.parametrize("name", NAMES)
def test_names_cannot_lead_elsewhere(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "scene.toml"
    path.write_text(to_toml(small_scene(name="NAME")).replace('"NAME"', _escaped(name)))
    status, said, error = shroud("run", path)
    assert (status, said) == (2, ""), error
    assert error.startswith(f"{path}:1: name: "), error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == [path]


def _escaped(text: str) -> str:
    return '"' + "".join(f"\\U{ord(c):08x}" for c in text) + '"'


def test_nothing_heavy_is_imported_before_a_complaint(tmp_path: Path) -> None:
    """One process is given a wrong value for every key; by its end neither mesher nor solver nor HDF5 is there."""
    paths = []
    for section, key in KEYS:
        path = tmp_path / f"{section}.{key}.toml"
        paths.append(str(write_scene(path, whole_scene(section, key, {"a": math.nan}))))
    code = (
        "import sys\nfrom pipeline.cli import command\n"
        f"found = [command(['run', path, '--out', {str(tmp_path / 'out')!r}]) for path in {paths!r}]\n"
        "assert set(found) == {2}, found\n"
        "print(*{name.partition('.')[0] for name in sys.modules})"
    )
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY)}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=tmp_path, env=environment
    )
    assert done.returncode == 0, done.stderr
    assert not {"gmsh", "h5py", "scipy", "numba", "skfem", "meshio", "matplotlib", "pyvista"} & set(
        done.stdout.split()
    )
    assert len(done.stderr.splitlines()) == len(KEYS)
    assert not (tmp_path / "out").exists()

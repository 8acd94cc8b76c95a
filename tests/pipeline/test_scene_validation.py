"""Bad scenes: exit status 2, one line that names file, key, value and what is allowed, and nothing written."""

import math
import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pipeline_support import RAW_TEXT, SMALL, ground_scene, shroud, small_scene, to_toml, write_scene

from pipeline.errors import InputError
from pipeline.scene.reading import read_scene
from pipeline.scene.schema import SECTIONS
from pipeline.scene.validation_errors import allowed_values


def refused(tmp_path: Path, content: str | bytes) -> str:
    """Run the content as a scene; check that it is refused tidily, and return the complaint."""
    path, out = tmp_path / "scene.toml", tmp_path / "out"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    status, said, error = shroud("run", path, "--out", out)
    assert status == 2, (status, error)
    assert error.count("\n") == 1, error
    assert not RAW_TEXT.search(error), error
    assert said == ""
    assert error.startswith(str(path)), error
    assert not out.exists()
    return error


def test_the_small_scene_is_valid(tmp_path: Path) -> None:
    path = write_scene(tmp_path / "s.toml", small_scene())
    status, said, error = shroud("validate", path)
    assert (status, error) == (0, "")
    assert said == f"{path}: valid, 1 curve\n"


@pytest.mark.parametrize("scene", sorted(Path(__file__).parents[2].glob("scenes/*.toml")), ids=lambda path: path.stem)
def test_shipped_scenes_are_valid(scene: Path) -> None:
    status, said, error = shroud("validate", scene)
    assert (status, error) == (0, "")
    assert "valid" in said
    assert read_scene(scene).first.name == scene.stem


REQUIRED = [
    (section, key)
    for section, keys in SMALL.items()
    if isinstance(keys, dict)
    for key in keys
    if SECTIONS[section].model_fields[key].is_required()
]


@pytest.mark.parametrize(("section", "key"), REQUIRED)
def test_missing_keys_are_named(tmp_path: Path, section: str, key: str) -> None:
    error = refused(tmp_path, to_toml(small_scene(**{f"{section}__{key}": None})))
    assert f": {section}.{key}: missing, allowed: " in error


@pytest.mark.parametrize("section", ["blade", "shroud", "material", "mesh", "contact", "excitation", "response"])
def test_missing_sections_are_named(tmp_path: Path, section: str) -> None:
    error = refused(tmp_path, to_toml(small_scene(**{section: None})))
    assert f": {section}: missing, allowed: a table [{section}]" in error


@pytest.mark.parametrize(
    ("change", "key", "shown"),
    [
        ({"contact__friction": -0.1}, "contact.friction", "-0.1"),
        ({"contact__friction": math.nan}, "contact.friction", "nan"),
        ({"contact__friction": True}, "contact.friction", "true"),
        ({"contact__friction": [0.1, 0.2, "x", 0.4]}, "contact.friction[2]", '"x"'),
        ({"contact__friction": [0.1, 0.2, 0.3]}, "contact.friction", "a list of 3"),
        ({"contact__interference": math.inf}, "contact.interference", "inf"),
        ({"contact__interference": []}, "contact.interference", "[]"),
        ({"contact__normal_stiffness": "stiff"}, "contact.normal_stiffness", '"stiff"'),
        ({"contact__law": "isotropic"}, "contact.law", '"isotropic"'),
        ({"contact__samples": 1}, "contact.samples", "1"),
        ({"contact__samples": 64, "response__harmonics": 30}, "contact.samples", "64"),
        ({"contact__integration": "trapezoidal"}, "contact.integration", '"trapezoidal"'),
        ({"blade__n_blades": 72.0}, "blade.n_blades", "72.0"),
        ({"blade__n_blades": 2}, "blade.n_blades", "2"),
        ({"blade__length": 0}, "blade.length", "0"),
        ({"blade": 3}, "blade", "3"),
        ({"shroud__angle": 190.0}, "shroud.angle", "190.0"),
        ({"shroud__angle": 0.0}, "shroud.angle", "0.0"),
        ({"shroud__contact_length": 0.2}, "shroud.contact_length", "0.2"),
        ({"shroud__edge_angle": 80.0}, "shroud.edge_angle", "80.0"),
        ({"shroud__edge_angle": "axial"}, "shroud.edge_angle", '"axial"'),
        ({"shroud__fillet_radius": 0.1}, "shroud.fillet_radius", "0.1"),
        ({"blade__camber": 91.0}, "blade.camber", "91.0"),
        ({"blade__root_stagger": -81.0}, "blade.root_stagger", "-81.0"),
        ({"blade__fillet_radius": -0.001}, "blade.fillet_radius", "-0.001"),
        ({"material__poisson_ratio": 0.5}, "material.poisson_ratio", "0.5"),
        ({"mesh__size": 1e-6}, "mesh.size", "1e-06"),
        ({"mesh__contact_grid": [3]}, "mesh.contact_grid", "[3]"),
        ({"mesh__contact_grid": [0, 3]}, "mesh.contact_grid[0]", "0"),
        ({"mesh__grading": 0.5}, "mesh.grading", "0.5"),
        ({"rom__modes": 0}, "rom.modes", "0"),
        ({"rom__frequency_limit": 1e4}, "rom.frequency_limit", "given beside modes"),
        ({"rom__contact_dofs": "lumped"}, "rom.contact_dofs", '"lumped"'),
        ({"load__speed_rpm": -1.0}, "load.speed_rpm", "-1.0"),
        ({"excitation__engine_order": -1}, "excitation.engine_order", "-1"),
        ({"excitation__force": "1 N"}, "excitation.force", '"1 N"'),
        ({"excitation__direction": [0, 0, 0]}, "excitation.direction", "[0.0, 0.0, 0.0]"),
        ({"excitation__direction": "up"}, "excitation.direction", '"up"'),
        ({"excitation__at": [1.0, 2.0]}, "excitation.at", "[1.0, 2.0]"),
        ({"response__frequency": [700.0, 300.0]}, "response.frequency", "[700.0, 300.0]"),
        ({"response__frequency": 300.0}, "response.frequency", "300.0"),
        ({"response__harmonics": "many"}, "response.harmonics", '"many"'),
        ({"response__harmonics": 0}, "response.harmonics", "0"),
        ({"response__tolerance": 0.0}, "response.tolerance", "0.0"),
        ({"response__damping_ratio": None}, "response.damping_ratio", "missing"),
        ({"response__damping_ratio": [0.01] * 50}, "response.damping_ratio", "a list of 50"),
        ({"response__damping_ratio": 0.0}, "response.damping_ratio", "0.0"),
        ({"response__rayleigh": [0.0, 1e-6]}, "response.rayleigh", "given beside damping_ratio"),
        ({"render__modes": []}, "render.modes", "[]"),
        ({"name": "../escape"}, "name", '"../escape"'),
        ({"name": "a\nb"}, "name", '"a b"'),
        ({"name": None}, "name", "missing"),
    ],
)
def test_values_are_refused(tmp_path: Path, change: dict[str, Any], key: str, shown: str) -> None:
    error = refused(tmp_path, to_toml(small_scene(**change)))
    assert f": {key}: {shown}, allowed: " in error


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"interface": {"snubber": 3}}, "interface.snubber: 3, allowed: a table [interface.snubber]"),
        ({"interface": {"a b": {"friction": "x"}}}, 'interface."a b".friction: "x", allowed: a number'),
        ({"interface": {"a b": {"mu": 0.3}}}, 'interface."a b".mu: unknown key, did you mean contact.friction?'),
        ({"wear": {"coefficient": {"root": "x"}}}, 'wear.coefficient.root: "x", allowed: a number'),
        (
            {"map": {"over": {"contact.friction": [0.1, "x"]}}},
            'map.over."contact.friction"[1]: "x", allowed: a table',
        ),
        ({"contact__friction": {"mean": 0.3, "tilt": [0.1, "x"]}}, 'contact.friction.tilt[1]: "x", allowed: two'),
        ({"contact__friction": {"tilt": [0.1, 0.2]}}, "contact.friction.mean: missing, allowed: a number"),
        ({"load__force": [{"at": "tip"}, {}]}, "load.force[1].file: not given, allowed: one of at, set, file"),
        (
            {"load__temperature": {}},
            "load.temperature.of_mesh: not given, allowed: one of uniform, linear, file, of_mesh",
        ),
        (
            {"blade__section": "rect"},
            'blade.section: "rect", did you mean rectangle?, allowed: "rectangle" or "lens"',
        ),
    ],
)
def test_an_error_leads_to_its_place_at_any_depth(tmp_path: Path, change: dict[str, Any], line: str) -> None:
    assert f": {line}" in refused(tmp_path, to_toml(small_scene(**change)))


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"contact__frction": 0.1}, "contact.frction: unknown key, did you mean contact.friction?"),
        ({"blade__twsit": 3.0}, "blade.twsit: unknown key, did you mean blade.twist?"),
        ({"balde": {}}, "balde: unknown key, did you mean blade?"),
        ({"qqqq": 1}, "qqqq: unknown key, allowed: name, "),
        ({"contact__a\nb": 1}, '"a b": unknown key'),
        ({"sweep": {"contact.interferense": [0.0]}}, "did you mean contact.interference?"),
        ({"sweep": {"render.modes": [[1], [2]]}}, 'sweep."render.modes": unknown key'),
    ],
)
def test_unknown_keys_get_a_suggestion(tmp_path: Path, change: dict[str, Any], expected: str) -> None:
    assert expected in refused(tmp_path, to_toml(small_scene(**change)))


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"blade__length": "0,15"}, "; a number without quotes and unit, in m: 0.15\n"),
        ({"blade__length": "150 mm"}, "; a number without quotes and unit, in m: 0.15\n"),
        ({"material__young_modulus": "210GPa"}, "; a number without quotes and unit, in Pa: 210000000000\n"),
        ({"contact__normal_stiffness": "200 N/mm"}, "; a number without quotes and unit, in N/m: 200000\n"),
        ({"damper": {"mass": "5 g"}}, "; a number without quotes and unit, in kg: 0.005\n"),
        ({"response__damping_ratio": "0.3 %"}, "; a number without quotes and unit: 0.003\n"),
        ({"response__frequency": [0, 3, 0, 9]}, "; with decimal points: [0.3, 0.9]\n"),
        ({"blade__length": "long"}, "a number above 0, 1e-6 to 1000\n"),
        ({"response__frequency": [100, 300, 600]}, "the second above the first\n"),
    ],
)
def test_the_number_that_a_text_or_a_list_with_decimal_commas_means_is_named(
    tmp_path: Path, change: dict[str, Any], expected: str
) -> None:
    assert refused(tmp_path, to_toml(small_scene(**change))).endswith(expected)


@pytest.mark.parametrize(
    ("sweep", "expected"),
    [
        ({"contact.friction": []}, 'sweep."contact.friction": [], allowed: a list of one or more values'),
        ({"contact.friction": 0.3}, 'sweep."contact.friction": 0.3, allowed: a list of one or more values'),
        ({"contact.friction": [0.1, -0.2]}, 'sweep."contact.friction"[1]: -0.2, allowed: '),
        ({"shroud.angle": [70.0, -5.0]}, 'sweep."shroud.angle"[1]: -5.0, allowed: '),
        ({"contact.interference": [[0.0] * 4, [0.0] * 5]}, 'sweep."contact.interference": a list of 5, allowed: '),
        (
            {
                "contact.friction": [0.1 + 0.001 * k for k in range(200)],
                "excitation.force": [1.0 + k for k in range(100)],
            },
            "sweep: 20000 combinations",
        ),
        ({"contact.friction": [0.1, 0.2, 0.1]}, 'sweep."contact.friction": 0.1 twice, allowed: each value once'),
        (
            {"contact.friction": [0.1], "contact": {"friction": [0.2]}},
            'sweep."contact.friction": given twice, as "contact.friction" and as friction of [sweep.contact], ',
        ),
        ({"contact": {"friction": [0.2]}, "contact.friction": [0.2]}, 'sweep."contact.friction": given twice'),
    ],
)
def test_sweeps_are_checked(tmp_path: Path, sweep: dict[str, Any], expected: str) -> None:
    assert expected in refused(tmp_path, to_toml(small_scene(sweep=sweep)))


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("", "name: missing"),
        ("name = ", "not valid TOML"),
        ("name = 'a'\nname = 'b'\n", "not valid TOML"),
        (b"\xff\xfe\x00", "not UTF-8"),
        ("name = " + "1" * 5000, "not valid TOML"),
        ("name = " + "[" * 5000, "not valid TOML"),
        ("name = 'a'\nsweep = 3\n", "sweep: 3, allowed: a table"),
    ],
)
def test_broken_files_are_refused(tmp_path: Path, content: str | bytes, expected: str) -> None:
    assert expected in refused(tmp_path, content)


def test_what_is_not_a_file_is_refused(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "absent.toml"):
        status, _, error = shroud("validate", path)
        assert status == 2
        assert error.count("\n") == 1
        assert error.startswith(str(path))


def test_every_key_says_what_it_means_and_allows() -> None:
    for section, model in SECTIONS.items():
        for key, field in model.model_fields.items():
            assert field.description, f"{section}.{key}"
            assert allowed_values(f"{section}.{key}"), f"{section}.{key}"


def test_every_field_has_one_bound_of_a_kind() -> None:
    """A bound beside that of its type is dropped in silence: of two, pydantic holds to one."""
    for section, model in SECTIONS.items():
        for key, field in model.model_fields.items():
            kinds = [type(bound) for bound in field.metadata]
            assert len(kinds) == len(set(kinds)), f"{section}.{key}"


@pytest.mark.parametrize("key", ["load__speed_rpm", "shroud__gap", "shroud__angle", "render__deformation"])
def test_bounds_hold_where_they_are_said(tmp_path: Path, key: str) -> None:
    section, name = key.split("__")
    allowed = allowed_values(f"{section}.{name}")
    above = math.nextafter(float(allowed.split()[-1]), math.inf)
    scene = small_scene(render={"modes": [1]}, **({} if section == "render" else {key: above}))
    scene["render"] |= {name: above} if section == "render" else {}
    assert f"{section}.{name}: {above!r}, allowed: {allowed}\n" in refused(tmp_path, to_toml(scene))


def test_a_speed_that_no_material_stands_is_refused(tmp_path: Path) -> None:
    """Strain rho Omega^2 (r_tip^2 - r_hub^2) / (2 E) of steel from 0.3 to 0.45 m: 5 % at 46 566 rev/min."""
    omega = math.sqrt(2.0 * 0.05 * 210e9 / (7850.0 * (0.45**2 - 0.3**2)))
    limit = omega * 30.0 / math.pi
    assert limit == pytest.approx(46_566.1, rel=1e-4)
    said = refused(tmp_path, to_toml(small_scene(load__speed_rpm=limit * 1.0001)))
    assert "load.speed_rpm: " in said
    assert "allowed: 0 to 46000 rev/min: faster, the centrifugal strain of this blade is above 5 %" in said
    swept = to_toml(small_scene(sweep={"load.speed_rpm": [3000.0, 1e5]}))
    assert 'sweep."load.speed_rpm": 100000.0, allowed: 0 to 46000 rev/min' in refused(tmp_path, swept)
    path = write_scene(tmp_path / "s.toml", small_scene(load__speed_rpm=limit * 0.9999))
    status, _, error = shroud("validate", path)
    assert status == 0
    assert error.startswith(f"warning: {path}: load.speed_rpm: {limit * 0.9999!r} is unusual; ")
    assert error.endswith("the centrifugal strain of this blade is about 5 %\n")
    path = write_scene(tmp_path / "s.toml", small_scene(load__speed_rpm=limit * math.sqrt(0.0999)))
    assert shroud("validate", path) == (0, f"{path}: valid, 1 curve\n", "")


def test_every_combination_of_a_sweep_is_a_member(tmp_path: Path) -> None:
    per_node = [[0.0, 0.0, 0.0, 1e-6], [1e-6] * 4]
    sweep = {"contact.friction": [0.1, 0.2, 0.3], "contact.interference": per_node}
    file = read_scene(write_scene(tmp_path / "s.toml", small_scene(sweep=sweep)))
    assert file.swept == ("contact.friction", "contact.interference")
    found = [(m.scene.contact.friction, m.scene.contact.interference) for m in file.members]
    assert found == [(mu, tuple(v0)) for mu in (0.1, 0.2, 0.3) for v0 in per_node]


def test_a_swept_key_needs_no_value_of_its_own(tmp_path: Path) -> None:
    scene = small_scene(excitation__engine_order=None, sweep={"excitation.engine_order": [3, 5]})
    assert [m.scene.excitation.engine_order for m in read_scene(write_scene(tmp_path / "s.toml", scene)).members] == [
        3,
        5,
    ]


def test_a_scene_without_a_blade_is_for_a_given_model_only(tmp_path: Path) -> None:
    assert "blade: missing" in refused(tmp_path, to_toml(ground_scene()))


keys = st.sampled_from([(s, k) for s, table in SMALL.items() if isinstance(table, dict) for k in table])
numbers = st.floats() | st.integers(-(10**6), 10**6) | st.just(10**400)
junk = st.recursive(
    numbers | st.booleans() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner, max_size=2),
    max_leaves=6,
)


@settings(max_examples=80, deadline=None, suppress_health_check=list(HealthCheck))
@given(key=keys, value=junk)
def test_any_value_anywhere_is_taken_or_refused_in_one_line(
    tmp_path_factory: pytest.TempPathFactory, key: tuple[str, str], value: Any
) -> None:
    folder = tmp_path_factory.mktemp("mutated")
    path = write_scene(folder / "scene.toml", small_scene(**{f"{key[0]}__{key[1]}": value}))
    status, said, error = shroud("validate", path)
    if status == 0:
        assert "valid" in said
        assert all(line.startswith(f"warning: {path}: ") for line in error.splitlines())
    else:
        assert status == 2, error
        for line in error.splitlines():
            assert re.match(rf"{re.escape(str(path))}(:\d+)?: ", line), error
            assert "allowed: " in line
            assert not RAW_TEXT.search(line.replace(str(value), ""))
            assert len(line) < len(str(path)) + 400


@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
@given(content=st.binary(max_size=60) | st.text(max_size=60).map(lambda text: text.encode("utf-8", "ignore")))
def test_any_bytes_are_refused_in_one_line(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    path = tmp_path_factory.mktemp("bytes") / "scene.toml"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_scene(path)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(path))


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"response__damping_ratio": 1e-12}, "response.damping_ratio: 1e-12, allowed: a number from 1e-9"),
        (
            {"response__damping_ratio": None, "response__rayleigh": [0.0, 1e-15]},
            "response.rayleigh: 2.2e-12 of critical damping in the range, allowed: 1e-09 or more",
        ),
        (
            {"excitation__harmonic": [{"order": 1, "amplitude": 0.0}]},
            "excitation.harmonic: amplitudes that are all 0",
        ),
        ({"excitation__load": [{"at": "tip", "amplitude": 0.0}]}, "excitation.load: amplitudes that are all 0"),
        (
            {"aero": {"family": [{"mode": 1, "offset": [0], "real": [1.0], "imaginary": [0.0]}]}},
            "aero.family[0].real: 1 of the stiffness at nodal diameter 0, allowed: less than 1 in every wave",
        ),
        (
            {
                "aero": {
                    "scale": 3.0,
                    "family": [{"mode": 1, "offset": [0, 1], "real": [0.2, 0.2], "imaginary": [0, 0]}],
                }
            },
            "aero.family[0].real: 1.2 of the stiffness at nodal diameter 0",
        ),
    ],
)
def test_what_leaves_no_answer_is_refused(tmp_path: Path, changes: dict[str, Any], complaint: str) -> None:
    status, _, error = shroud("validate", write_scene(tmp_path / "s.toml", small_scene(**changes)))
    assert (status, error.count("\n")) == (2, 1)
    assert complaint in error

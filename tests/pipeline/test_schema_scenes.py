"""Scenes drawn from the JSON schema: what fits it is read, and is valid or refused in one line."""

import math
import tomllib
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator
from pipeline_support import shroud, small_scene, write_scene

from pipeline.scene.json_schema import scene_schema
from pipeline.scene.reading import read_scene

SCHEMA = scene_schema()
VALIDATOR = Draft202012Validator(SCHEMA)
# the same scenes each time, and no search for smaller ones that fail too: that takes minutes
BOUNDED = settings(
    max_examples=25,
    deadline=None,
    suppress_health_check=list(HealthCheck),
    derandomize=True,
    phases=[Phase.generate],
)
OWN_MESH = ("file", "n_blades", "unit")  # keys of a mesh from a file; axis, point and tolerance stay the default
SMALL_CHORD = 1e-4  # m, of which a preset makes elements that the schema does not allow
LONGEST = 5  # of lists that may have any length


def values(node: dict[str, Any]) -> st.SearchStrategy[Any]:
    """Values that fit a node of the schema; null, which TOML has not, is left out."""
    if "$ref" in node:
        beside = {key: value for key, value in node.items() if key != "$ref"}
        return values(SCHEMA["$defs"][node["$ref"].rpartition("/")[2]] | beside)
    if "anyOf" in node:
        return st.one_of([values(each) for each in node["anyOf"] if each.get("type") != "null"])
    if "const" in node or "enum" in node:
        return st.sampled_from(node.get("enum", [node.get("const")]))
    return KINDS[node["type"]](node)


def numbers(node: dict[str, Any]) -> st.SearchStrategy[float]:
    low, high = node.get("minimum", node.get("exclusiveMinimum")), node.get("maximum", node.get("exclusiveMaximum"))
    inside = st.floats(
        low, high, exclude_min="exclusiveMinimum" in node, exclude_max="exclusiveMaximum" in node, allow_nan=False
    ).filter(math.isfinite)
    if low is not None and high is not None and low > 0.0:  # of every order of magnitude
        orders = st.floats(math.log10(low), math.log10(high))
        return inside | orders.map(lambda order: min(max(10.0**order, low), high)).filter(lambda x: x < high)
    return inside


def whole_numbers(node: dict[str, Any]) -> st.SearchStrategy[int]:
    return st.integers(node.get("minimum"), node.get("maximum", 10**6))


def texts(node: dict[str, Any]) -> st.SearchStrategy[str]:
    plain = st.text(st.characters(exclude_categories=("Cc", "Cs")))  # TOML allows no control characters
    drawn = st.from_regex(node["pattern"], fullmatch=True) if "pattern" in node else plain
    least, most = node.get("minLength", 0), node.get("maxLength", 100)
    return drawn.filter(lambda text: least <= len(text) <= most and not text.endswith("\n"))


def lists(node: dict[str, Any]) -> st.SearchStrategy[list[Any]]:
    if "prefixItems" in node:
        return st.tuples(*(values(item) for item in node["prefixItems"])).map(list)
    return st.lists(values(node["items"]), min_size=node.get("minItems", 0), max_size=LONGEST)


def tables(node: dict[str, Any]) -> st.SearchStrategy[dict[str, Any]]:
    """All keys that are required, some of the others; of a table with any names one or two of these."""
    if "properties" not in node:
        names = st.from_regex(r"[A-Za-z][A-Za-z0-9_-]{0,8}", fullmatch=True)
        least = node.get("minProperties", 0)
        return st.dictionaries(names, values(node["additionalProperties"]), min_size=least, max_size=2)
    keys = {
        key: values(each)
        for key, each in node["properties"].items()
        if key not in ("sweep", "temperature", *TOGETHER) and "$ref" not in each.get("items", {})
    }  # in lists of tables one of several keys is given, or no two are alike, which the schema does not say
    required = {key: keys.pop(key) for key in node.get("required", ()) if key in keys}
    return st.fixed_dictionaries(required, optional=keys)


KINDS = {
    "number": numbers,
    "integer": whole_numbers,
    "string": texts,
    "boolean": lambda node: st.booleans(),
    "array": lists,
    "object": tables,
}


# what fits depends on their other numbers or keys
TOGETHER = ("axes", "along", "stiffness", "run_up", "identify", "correlation")


@st.composite
def scenes(draw: st.DrawFn) -> dict[str, Any]:
    """A scene of what the schema knows, with everything that it asks for."""
    scene = draw(tables(SCHEMA))
    properties = SCHEMA["properties"]
    for section in {
        *SCHEMA["required"],
        "contact",
        *draw(st.sets(st.sampled_from(["blade", "shroud", "material", "mesh"]))),
    }:
        scene.setdefault(section, draw(values(properties[section])))
    for rule in SCHEMA["allOf"]:
        for section, needed in rule["anyOf"][0].get("properties", {}).items():
            definition = _definition(properties[section])
            for key in needed["required"]:
                if section in scene:
                    scene[section].setdefault(key, draw(values(definition["properties"][key])))
    if "mesh" in scene:
        scene["mesh"] = draw(meshes(_definition(properties["mesh"])["properties"]))
    if "blade" in scene:
        scene["blade"] = draw(blades(_definition(properties["blade"])["properties"]))
    if scene.get("blade", {}).get("chord", 1.0) < SMALL_CHORD:
        scene.pop("accuracy", None)
    return scene


def blades(keys: dict[str, Any]) -> st.SearchStrategy[dict[str, Any]]:
    """[blade] with a parametric airfoil, or with sections from a file: each has keys of its own."""
    drawn = {key: values(node) for key, node in keys.items()}
    both = {key: drawn.pop(key) for key in ("n_blades", "hub_radius", "length")}
    sections = both | {"sections": drawn.pop("sections")}
    both |= {key: drawn.pop(key) for key in ("chord", "thickness")}
    return st.one_of(st.fixed_dictionaries(both, optional=drawn), st.fixed_dictionaries(sections))


def meshes(keys: dict[str, Any]) -> st.SearchStrategy[dict[str, Any]]:
    """[mesh] of a blade that is made here, or of one from a file: each has keys of its own."""
    own = {key: values(keys[key]) for key in OWN_MESH}
    made = {key: values(keys[key]) for key in ("contact_grid", "element", "grading")}
    from_file = {"contact_grid": made["contact_grid"], "unit": own.pop("unit")}
    return st.one_of(
        st.fixed_dictionaries({"size": values(keys["size"])}, optional=made),
        st.fixed_dictionaries(own, optional=from_file),
    )


def _definition(node: dict[str, Any]) -> dict[str, Any]:
    """The definition behind a section, which may be left out."""
    inner = next(each for each in node.get("anyOf", [node]) if "$ref" in each)
    found: dict[str, Any] = SCHEMA["$defs"][inner["$ref"].rpartition("/")[2]]
    return found


@BOUNDED
@given(scene=scenes())
def test_what_fits_the_schema_is_read(tmp_path_factory: pytest.TempPathFactory, scene: dict[str, Any]) -> None:
    path = write_scene(tmp_path_factory.mktemp("drawn") / "scene.toml", scene)
    written = tomllib.loads(path.read_text(encoding="utf-8"))
    assert written == scene  # the file says what was drawn
    assert VALIDATOR.is_valid(written)
    assert read_scene(path).first.name == scene["name"]
    status, said, error = shroud("validate", path)
    if status == 0:
        assert "valid" in said
        assert all(line.startswith("warning: ") for line in error.splitlines())
    else:
        assert (status, said) == (2, ""), error
        assert all(line.startswith(f"{path}:") for line in error.splitlines())
        assert all(", allowed: " in line or "no such file" in line for line in error.splitlines())


@BOUNDED
@given(
    key=st.sampled_from(
        [
            (s, k)
            for s in ("contact", "response", "excitation")
            for k in _definition(SCHEMA["properties"][s])["properties"]
        ]
    ),
    value=st.one_of(
        st.text(max_size=3),
        st.integers(),
        st.floats(allow_nan=False, allow_infinity=False),
        st.booleans(),
        st.lists(st.floats(0.1, 0.9), max_size=3),
    ),
)
def test_what_the_schema_refuses_is_refused(
    tmp_path_factory: pytest.TempPathFactory, key: tuple[str, str], value: Any
) -> None:
    scene = small_scene()
    scene[key[0]][key[1]] = value
    path = write_scene(tmp_path_factory.mktemp("changed") / "scene.toml", scene)
    if not VALIDATOR.is_valid(scene):
        status, said, error = shroud("validate", path)
        assert (status, said) == (2, ""), error
        found = [line.partition(": ")[2] for line in error.splitlines()]
        assert any(line.startswith(f"{key[0]}.{key[1]}") for line in found), error
    elif not _whole_as_fraction(value):
        read_scene(path)


def _whole_as_fraction(value: Any) -> bool:
    """Whether it is a number like 3.0, which is a whole number to JSON and none to TOML."""
    return any(isinstance(v, float) and v % 1 == 0 for v in (value if isinstance(value, list) else [value]))

"""Public names are those that users meet, and each has a numpydoc docstring that explains each of its parameters."""

import dataclasses
import importlib
import inspect
import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from numpydoc.docscrape import NumpyDocString

import shroud

PACKAGES = ("geometry", "rom", "nonlinear", "pipeline")
ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *(ROOT / "docs").glob("*.md"), *(ROOT / "docs" / "tutorials").glob("*.md")]
CODE = re.compile(r"```.*?```|`[^`\n]+`", re.DOTALL)


def names(package: str) -> list[str]:
    """The public names of a package."""
    return list(importlib.import_module(package).__all__)


def methods(item: type) -> Iterator[tuple[str, Any]]:
    """Public methods and properties that a class defines itself."""
    for name, value in vars(item).items():
        function = value.fget if isinstance(value, property) else getattr(value, "func", value)
        function = getattr(function, "__func__", function)
        if not name.startswith("_") and inspect.isfunction(function):
            yield name, function


def parameters(item: Any) -> list[str]:
    """What a caller gives: parameters of a function, fields of a dataclass or a named tuple."""
    if dataclasses.is_dataclass(item):
        return [field.name for field in dataclasses.fields(item) if field.init]
    if inspect.isclass(item):
        if hasattr(item, "_fields"):
            return list(item._fields)
        if getattr(item, "_is_protocol", False):  # its __init__ is that of typing.Protocol
            return []
        item = vars(item).get("__init__", lambda: None)
    names = inspect.signature(item).parameters
    return [name for name in names if name not in ("self", "cls")]


def faults(item: Any) -> list[str]:
    """What is missing from the docstring of a function or class, or is too much in it."""
    text = inspect.cleandoc(item.__doc__ or "")
    if not text or text.startswith(f"{item.__name__}("):  # a dataclass without a docstring gets its signature as one
        return ["no docstring"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            found = NumpyDocString(text)
        except (ValueError, UserWarning) as error:  # an unknown section, or one that is there twice
            return [str(error).splitlines()[0]]
    wrong = [] if len(found["Summary"]) == 1 and found["Summary"][0] else ["the summary is not one line"]
    if found["Attributes"] and not inspect.isclass(item):
        wrong.append("attributes of a function")
    listed = found["Parameters"] + found["Other Parameters"] + found["Attributes"]
    explained = {name.strip().lstrip("*"): entry.desc for entry in listed for name in entry.name.split(",")}
    wrong += [f"{name}: not explained" for name in parameters(item) if not any(explained.get(name, []))]
    if not inspect.isclass(item):  # attributes of a class may be properties too
        wrong += [f"{name}: no such parameter" for name in explained if name not in parameters(item)]
    return wrong


@pytest.mark.parametrize("package", PACKAGES)
def test_public_names_are_explained(package: str) -> None:
    module = importlib.import_module(package)
    wrong = {}
    for name in names(package):
        item = getattr(module, name)
        if not (inspect.isclass(item) or inspect.isfunction(item)):  # a constant
            continue
        wrong[name] = faults(item)
        if inspect.isclass(item):
            wrong |= {f"{name}.{method}": faults(function) for method, function in methods(item)}
    assert {where: what for where, what in wrong.items() if what} == {}


def named_by(item: Any) -> set[str]:
    """Words in the types of a function, or of the fields and methods of a class, and in the errors they raise."""
    functions = [function for _, function in methods(item)] if inspect.isclass(item) else []
    types = [getattr(thing, "__annotations__", {}) for thing in (item, *functions)]
    raised = [str(thing.__doc__).partition("Raises\n")[2] for thing in (item, *functions)]
    return set(re.findall(r"\w+", str([types, raised, getattr(item, "__mro__", ())])))


def test_public_names_are_those_that_users_meet() -> None:
    """They stand in `shroud` or as code on a page for users, or are a type or an error of such a one."""
    public = {
        name: getattr(importlib.import_module(package), name) for package in PACKAGES for name in names(package)
    }
    text = "\n".join(page.read_text() for page in PAGES if page.name != "CONTRIBUTING.md")
    met = {*shroud.__all__, *re.findall(r"\w+", " ".join(CODE.findall(text)))} & set(public)
    reached = met
    while reached:
        reached = set().union(*(named_by(public[name]) for name in reached)) & set(public) - met
        met = met | reached
    assert set(public) - met == set()


def resize(size: float, mass: float) -> float:
    """Make something of another size.

    Parameters
    ----------
    size : float
        The new size, m.
    mass : float
        Its mass, kg.

    Returns
    -------
    float
        Density, kg/m^3.
    """
    return mass / size**3


def test_a_numpydoc_docstring_is_accepted() -> None:
    assert faults(resize) == []


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("mass : float\n        Its mass, kg.", "mass : its mass, kg.", "mass: not explained"),
        ("    mass : float\n        Its mass, kg.\n", "", "mass: not explained"),
        ("size : float", "length : float", "size: not explained"),
        ("size : float", "length : float", "length: no such parameter"),
        ("mass : float\n        Its mass, kg.", "mass : float", "mass: not explained"),
        ("Parameters\n    ----------", "Arguments\n    ---------", "Unknown section Arguments"),
        ("Returns\n    -------", "Parameters\n    ----------", "The section Parameters appears twice"),
        ("Parameters\n    ----------", "Attributes\n    ----------", "attributes of a function"),
        ("of another size.", "of another\n    size.", "the summary is not one line"),
    ],
)
def test_what_is_no_numpydoc_is_refused(old: str, new: str, fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    text = str(resize.__doc__)
    assert old in text
    monkeypatch.setattr(resize, "__doc__", text.replace(old, new))
    assert any(fault in wrong for wrong in faults(resize))


def test_fields_of_a_dataclass_are_attributes() -> None:
    @dataclasses.dataclass
    class Box:
        """A box.

        Attributes
        ----------
        width, height : float
            Its sides, m.
        """

        width: float
        height: float
        depth: float
        volume: float = dataclasses.field(init=False)

    @dataclasses.dataclass
    class Silent:
        width: float

    assert faults(Box) == ["depth: not explained"]
    assert faults(Silent) == ["no docstring"]

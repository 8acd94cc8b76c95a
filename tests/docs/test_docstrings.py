"""Every public name of the four packages is explained: what it takes, in its own words, by name."""

import dataclasses
import importlib
import inspect
import re
from collections.abc import Iterator
from typing import Any

import pytest

ROOMS = ("geometry", "rom", "nonlinear", "pipeline")
PUBLIC = [(room, name) for room in ROOMS for name in importlib.import_module(room).__all__]


def functions_of(item: type) -> Iterator[tuple[str, Any]]:
    """Public methods and properties that a class defines itself."""
    for name, value in vars(item).items():
        if name.startswith("_"):
            continue
        function = value.fget if isinstance(value, property) else getattr(value, "func", value)
        function = getattr(function, "__func__", function)
        if inspect.isfunction(function):
            yield name, function


def parameters(item: Any) -> list[str]:
    """What a user gives: parameters of a function, fields of a dataclass or a named tuple."""
    if dataclasses.is_dataclass(item):
        return [field.name for field in dataclasses.fields(item) if field.init]
    if inspect.isclass(item):
        return list(getattr(item, "_fields", ()))
    return [name for name in inspect.signature(item).parameters if name not in ("self", "cls")]


def unexplained(item: Any, text: str) -> list[str]:
    """Parameters that a docstring does not mention."""
    return [name for name in parameters(item) if not re.search(rf"(?<![\w.]){name}(?!\w)", text)]


@pytest.mark.parametrize(("room", "name"), PUBLIC)
def test_a_public_name_is_explained(room: str, name: str) -> None:
    item = getattr(importlib.import_module(room), name)
    if isinstance(item, int | tuple):  # a constant: its value is its meaning
        return
    text = inspect.cleandoc(item.__doc__ or "")
    assert len(text.split()) > 4, "no docstring"
    assert not text.startswith(f"{name}("), "the docstring that dataclasses write by themselves"
    assert unexplained(item, text) == []
    if inspect.isclass(item):
        for method, function in functions_of(item):
            said = inspect.cleandoc(function.__doc__ or "")
            assert said, f"{name}.{method}: no docstring"
            assert unexplained(function, f"{said}\n{text}") == [], method


def test_names_are_looked_for_as_words() -> None:
    def function(size: float, mass: float) -> None:
        """Resizes; `mass` in kg."""

    assert unexplained(function, function.__doc__ or "") == ["size"]

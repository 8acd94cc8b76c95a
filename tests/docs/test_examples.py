"""Every public function and class has an example in its docstring that runs and gives what it shows; `np` is NumPy.

Examples that say so go on from the example of another name.
"""

import doctest
import importlib
import inspect
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytestmark = pytest.mark.xdist_group("examples")  # one worker: an example from which others go on runs once

ROOT = Path(__file__).parents[2]
PACKAGES = ("geometry", "rom", "nonlinear", "pipeline", "shroud")
GOES_ON = re.compile(r"With the names of the example of `(\w+)`")
PRINTED: Any = {"legacy": False, "precision": 8, "suppress": False, "linewidth": 75}  # whatever other tests have set


def public(package: str) -> dict[str, Any]:
    """Functions and classes of a package by name; constants have no docstring of their own."""
    module = importlib.import_module(package)
    items = {name: getattr(module, name) for name in module.__all__}
    return {name: item for name, item in items.items() if inspect.isclass(item) or inspect.isfunction(item)}


def has_example(item: Any) -> bool:
    return ">>> " in (item.__doc__ or "")


WITH_EXAMPLES = {
    name: (package, item)
    for package in reversed(PACKAGES)  # what shroud takes over from a package belongs to that package
    for name, item in public(package).items()
    if has_example(item)
}


def run(item: Any, names: dict[str, Any]) -> dict[str, Any]:
    """Run the example of an item with these names known; all names known after it."""
    test = doctest.DocTestParser().get_doctest(
        item.__doc__, {"np": np, item.__name__: item, **names}, item.__name__, None, None
    )
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    said: list[str] = []
    with np.printoptions(**PRINTED):
        runner.run(test, out=said.append, clear_globs=False)
    assert runner.summarize(verbose=False).failed == 0, "".join(said)
    return test.globs


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One folder for all examples: those that read files go on from those that write them."""
    place = tmp_path_factory.mktemp("examples")
    (place / "scenes").symlink_to(ROOT / "scenes")
    return place


@pytest.fixture(scope="module")
def known() -> dict[str, dict[str, Any]]:
    """Names known after the examples that have run."""
    return {}


def names_after(name: str, known: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Names known after the example of an item: run once, after the example that it goes on from."""
    if name not in known:
        item = WITH_EXAMPLES[name][1]
        before = GOES_ON.search(item.__doc__)
        known[name] = run(item, names_after(before[1], known) if before else {})
    return known[name]


@pytest.mark.parametrize("name", sorted(WITH_EXAMPLES))
def test_an_example_runs(
    name: str, folder: Path, known: dict[str, dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    names_after(name, known)


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_has_an_example(package: str) -> None:
    assert [name for name, item in public(package).items() if not has_example(item)] == []

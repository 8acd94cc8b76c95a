"""Examples in the docstrings of public names run and give what they show; `np` is NumPy."""

import doctest
import importlib
import inspect
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("geometry", "rom", "nonlinear", "pipeline")
MODULES = [importlib.import_module(package) for package in PACKAGES]
ITEMS = [getattr(module, name) for module in MODULES for name in module.__all__]
WITH_EXAMPLES = [
    item for item in ITEMS if (inspect.isclass(item) or inspect.isfunction(item)) and ">>> " in (item.__doc__ or "")
]


@pytest.mark.parametrize("item", WITH_EXAMPLES, ids=lambda item: item.__name__)
def test_an_example_runs(item: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    monkeypatch.chdir(tmp_path)
    test = doctest.DocTestParser().get_doctest(
        item.__doc__, {"np": np, item.__name__: item}, item.__name__, None, None
    )
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    said: list[str] = []
    runner.run(test, out=said.append)
    assert runner.summarize(verbose=False).failed == 0, "".join(said)


def test_the_interface_has_examples() -> None:
    assert {"run_scene", "read_scene", "InputError"} <= {item.__name__ for item in WITH_EXAMPLES}

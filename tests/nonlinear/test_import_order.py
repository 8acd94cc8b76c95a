"""Each sub-package of `nonlinear` imports only from itself and from those before it."""

import ast
from pathlib import Path

import pytest

import nonlinear

PACKAGE = Path(nonlinear.__file__).parent
ORDER = ("contact", "harmonic_balance", "stability", "continuation", "branches", "harmonic_selection")


@pytest.mark.parametrize("package", ORDER)
def test_imports_go_one_way(package):
    files = list((PACKAGE / package).glob("*.py"))
    assert len(files) > 1
    for path in files:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("nonlinear."):
                other = str(node.module).split(".")[1]
                if other != "options":
                    assert ORDER.index(other) <= ORDER.index(package), f"{path.name} imports {node.module}"

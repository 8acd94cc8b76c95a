"""The notebook runs, prints what it shows, and is short."""

import os
import shutil
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

from docs.execute import agrees

ROOT = Path(__file__).parents[2]
NOTEBOOK = ROOT / "docs" / "tutorials" / "friction_map.ipynb"


def printed(cell: Any) -> list[str]:
    """Texts that a cell shows; a picture by its kind."""
    data = [output.get("data", {}) for output in cell.get("outputs", ())]
    texts = ["picture" if "image/png" in each else each.get("text/plain", "") for each in data]
    return [text or output.get("text", "") for text, output in zip(texts, cell.get("outputs", ()), strict=True)]


def test_the_notebook_is_true(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown = nbformat.read(NOTEBOOK, as_version=4)
    shutil.copy(NOTEBOOK.with_suffix(".toml"), tmp_path)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    ran = NotebookClient(shown.copy(), timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    for before, after in zip(nbformat.read(NOTEBOOK, as_version=4).cells, ran.cells, strict=True):
        assert len(printed(before)) == len(printed(after))
        for one, other in zip(printed(before), printed(after), strict=True):
            assert agrees(one, other), f"{one}\n{other}"


def test_from_the_import_to_the_map_in_few_lines() -> None:
    cells = [cell for cell in nbformat.read(NOTEBOOK, as_version=4).cells if cell.cell_type == "code"]
    lines = [line for cell in cells for line in cell.source.splitlines() if line.strip()]
    assert "import shroud" in lines
    assert len(lines) <= 15
    assert "picture" in printed(cells[-1])

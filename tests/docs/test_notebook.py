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


def printed(cell: Any, kinds: set[str] | None = None) -> list[str]:
    """Texts that a cell shows, those of some `kinds` of output only; a picture by its kind."""
    texts = []
    for output in cell.get("outputs", ()):
        data = output.get("data", {})
        if kinds is None or output.output_type in kinds:
            texts.append("picture" if "image/png" in data else data.get("text/plain", output.get("text", "")))
    return texts


def test_the_notebook_is_true(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown, ran = (nbformat.read(NOTEBOOK, as_version=4) for _ in range(2))
    shutil.copy(NOTEBOOK.with_suffix(".toml"), tmp_path)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    NotebookClient(ran, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    for before, after in zip(shown.cells, ran.cells, strict=True):
        kinds = {output.output_type for output in before.get("outputs", ())}  # the progress of a run is not stored
        assert len(printed(before)) == len(printed(after, kinds))
        for one, other in zip(printed(before), printed(after, kinds), strict=True):
            assert agrees(one, other), f"{one}\n{other}"


def test_from_the_import_to_the_map_in_few_lines() -> None:
    cells = [cell for cell in nbformat.read(NOTEBOOK, as_version=4).cells if cell.cell_type == "code"]
    lines = [line for cell in cells for line in cell.source.splitlines() if line.strip()]
    assert "import shroud" in lines
    assert len(lines) <= 15
    assert "picture" in printed(cells[-1])

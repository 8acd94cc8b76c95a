"""Files in the working folder are not taken for modules of Python: it may be one where others can write."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]
HOSTILE = "open('mark', 'a').write(__name__)\nraise SystemExit(1)\n"
WORKER = """
import math
from pipeline.process.workers import call_apart
if __name__ == "__main__":
    print(call_apart(math.sqrt, 4.0))
"""
DRAWING = """
from pathlib import Path
from pipeline.render.drawing_process import RenderError, draw_apart
try:
    draw_apart("pipeline.render.mode_shapes", "{}", [Path("none.png")])
except RenderError as error:
    print(error)
"""


@pytest.mark.parametrize(("program", "said"), [(WORKER, "2.0"), (DRAWING, "TypeError")], ids=["worker", "drawing"])
def test_child_processes_do_not_import_from_the_working_folder(tmp_path: Path, program: str, said: str) -> None:
    (folder := tmp_path / "folder").mkdir()
    for name in ("multiprocessing", "selectors", "numpy", "json", "pipeline", "rom"):
        (folder / f"{name}.py").write_text(HOSTILE)
    (tmp_path / "program.py").write_text(program)
    environment = {**os.environ, "PYTHONPATH": str(PROJECT)}
    command = [sys.executable, str(tmp_path / "program.py")]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert not (folder / "mark").exists(), (folder / "mark").read_text()
    assert done.stdout.startswith(said), done.stderr

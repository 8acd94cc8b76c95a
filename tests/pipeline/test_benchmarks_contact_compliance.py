"""The compliance under contact dofs against the mesh size: a row for every mesh and kind of contact dofs."""

import csv
import subprocess
import sys
from pathlib import Path

import pytest
from pipeline_support import small_scene, write_scene

BENCHMARK = Path(__file__).parents[2] / "benchmarks" / "contact_compliance.py"


def test_a_row_for_every_mesh_and_kind_of_contact_dofs(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "small.toml", small_scene())
    command = [sys.executable, str(BENCHMARK), "--scene", str(scene), "--out", str(tmp_path / "out")]
    done = subprocess.run(
        [*command, "--sizes", "12", "6", "--grid", "3", "2"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    with (tmp_path / "out" / "contact_compliance.csv").open() as file:
        rows = list(csv.DictReader(file))
    cases = [(float(row["size_mm"]), row["contact_dofs"], int(row["n_contacts"])) for row in rows]
    assert cases == [(12.0, "nodal", 6), (12.0, "patch", 6), (6.0, "nodal", 6), (6.0, "patch", 6)]
    for row in rows:
        hertz = [float(row[f"{name}_1_hz"]) for name in ("free", "scene", "punch", "rigid")]
        assert hertz == sorted(hertz)
        for name in ("normal", "tangential"):
            assert 0.0 < float(row[f"local_{name}"]) < float(row[f"whole_{name}"])
    for nodal, patch in (rows[:2], rows[2:]):
        assert float(patch["local_normal"]) < float(nodal["local_normal"])
        assert float(patch["free_1_hz"]) == pytest.approx(float(nodal["free_1_hz"]), rel=1e-3)
    assert (tmp_path / "out" / "contact_compliance.md").read_text() in done.stdout

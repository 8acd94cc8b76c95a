"""Linear elements of a mesh file are named where the findings of the file stand."""

from pathlib import Path

import numpy as np

from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
from geometry.own_mesh.own_sector import OwnSector, SectorFindings
from pipeline.stages.model.build_mesh import write_findings
from pipeline.stages.model.scene_materials import own_findings


def test_linear_elements_are_a_finding(tmp_path: Path) -> None:
    blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    sector = build_sector(blade, shroud, MeshParameters(size=0.02))
    found = SectorFindings(True, 0.0, (0.0, 0.0), 1.0, (1e-4, 1e-4), 0.0, np.eye(3))
    write_findings(tmp_path, OwnSector(sector, found, {}))
    lines = own_findings(tmp_path)["findings"]
    assert lines[:-1] == list(found.lines)
    assert lines[-1].startswith(f"{sector.n_elements} hex8 elements bend far too stiffly")

"""A sector that nobody here made: the academic rotor among the examples of mapdl-archive (MIT licence), 24 sectors.

Its file has nodes and 8-node bricks, no sets and no material. Root and contact faces are found by geometry. With
rigid springs on all free nodes of its faces the ring is a disk in one piece, which CalculiX computes under cyclic
symmetry; without them it is a ring of 24 blades with friction on their faces.
"""

from functools import cache
from pathlib import Path

import calculix_blocks
import numpy as np
import pytest
from calculix import PROGRAM

from geometry import read_mesh
from geometry.errors import OwnMeshError
from geometry.own_mesh.own_sector import sector_from_mesh
from geometry.own_mesh.sector_choice import SectorChoice
from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from rom import (
    BoundaryChoice,
    Material,
    ReductionOptions,
    RomParameterError,
    assemble,
    modal_model,
    natural_frequencies,
    reduce_sector,
)

ROTOR = Path(pytest.importorskip("mapdl_archive").__file__).parent / "examples" / "academic_rotor.cdb"
STEEL = Material(young_modulus=2.0e11, poisson_ratio=0.28, density=7850.0)
N_SECTORS = 24
RIGID = 1e15  # N/m, the whole face
needs_calculix = pytest.mark.skipif(PROGRAM is None, reason="CalculiX (ccx) is not installed")


@cache
def rotor(grid=None):
    """The sector and its findings."""
    return sector_from_mesh(read_mesh(ROTOR), SectorChoice(N_SECTORS, "in", "z", contact_grid=grid))


@cache
def reduced(grid, kind):
    sector = rotor(grid).sector
    full = assemble(sector, STEEL, None)
    options = ReductionOptions(modes=90, store_basis=False)
    return reduce_sector(full, sector, options, BoundaryChoice((1.0, 0.0, 0.0), contact_dofs=kind)).model


def stuck_hz(grid, kind, diameter, stiffness=RIGID):
    """Lowest frequencies at a number of nodal diameters."""
    model = reduced(grid, kind)
    share = stiffness * model.contact_area / model.contact_area.sum()
    phase = 2 * np.pi * diameter / N_SECTORS
    return natural_frequencies(model, phase, normal=share, tangential=share, count=5)


def test_root_and_faces_are_found():
    own = rotor()
    assert "contact faces found: 50 element faces each, the only ones a pitch apart" in own.findings.lines
    assert any(line.startswith("root found: the innermost surface") for line in own.findings.lines)
    assert own.findings.matching
    assert own.findings.mismatch < 1e-12
    sector = own.sector
    radius = np.hypot(*sector.points[sector.node_sets["root"], 1:].T)
    np.testing.assert_allclose(radius, 3 * 0.0254, rtol=1e-9)
    np.testing.assert_allclose(own.findings.areas, 2.0 * 0.8 * 0.0254**2, rtol=2e-5)
    # the face is radial and axial: its normal is circumferential
    turn = np.pi / N_SECTORS
    np.testing.assert_allclose(sector.right.frame[:, 2], [[0.0, np.cos(turn), -np.sin(turn)]] * 60, atol=1e-6)


def test_a_sector_with_swept_faces_is_found_with_its_number_of_blades():
    """The other example: 15 sectors of bricks and wedges, faces that are curved, swept and no rectangles."""
    mesh = read_mesh(ROTOR.parent / "sector.cdb")
    with pytest.raises(OwnMeshError, match="they would be with n_blades = 15"):
        sector_from_mesh(mesh, SectorChoice(14, "in", "z"))
    own = sector_from_mesh(mesh, SectorChoice(15, "in", "z", contact_grid=(3, 2)))
    assert own.findings.matching
    assert own.findings.mismatch < 1e-12
    assert own.sector.right.area.min() > 0.4 * own.sector.right.area.mean()
    full = assemble(own.sector, STEEL, None)
    options = ReductionOptions(modes=10, store_basis=False)
    model = reduce_sector(full, own.sector, options, BoundaryChoice(contact_dofs="patch")).model
    free = natural_frequencies(model, 0.4, count=4)
    stuck = natural_frequencies(model, 0.4, normal=1e10, tangential=1e10, count=4)
    assert np.all(stuck > 1.2 * free)
    with pytest.raises(RomParameterError, match='"patch" is for any shape'):
        reduce_sector(full, own.sector, options, BoundaryChoice(contact_dofs="mortar"))


@needs_calculix
@pytest.mark.parametrize("diameter", [0, 5])
def test_rigid_contacts_make_the_disk_of_calculix(diameter, tmp_path):
    sector = rotor().sector
    free = [np.setdiff1d(sector.node_sets[f"face_{side}"], sector.node_sets["root"]) for side in ("right", "left")]
    lines = calculix_blocks.body(sector, {"1": STEEL}, sector.node_sets["root"])
    for name, nodes in zip(("RIGHT", "LEFT"), free, strict=True):
        lines += [f"*SURFACE, NAME={name}, TYPE=NODE", *[f"{node + 1}," for node in nodes]]
    lines += ["*TIE, CYCLIC SYMMETRY, NAME=FACES, POSITION TOLERANCE=1.e-6", "LEFT, RIGHT"]
    lines += [f"*CYCLIC SYMMETRY MODEL, N={N_SECTORS}", "0., 0., 0., 1., 0., 0.", "*STEP", "*FREQUENCY", "10"]
    lines += [f"*SELECT CYCLIC SYMMETRY MODES, NMIN={diameter}, NMAX={diameter}", "*END STEP"]
    rows = [line.split() for line in calculix_blocks.run(tmp_path, "\n".join(lines) + "\n").splitlines()]
    table = [float(row[4]) for row in rows if len(row) >= 5 and row[0] == str(diameter) and row[1].isdigit()]
    printed = np.array(table[::2])[:4]  # each twice
    found = stuck_hz(None, "nodal", diameter)[: len(printed)]
    assert len(printed) == 4
    np.testing.assert_allclose(found, printed, rtol=1e-4)


@pytest.mark.parametrize("kind", ["mortar", "patch"])
def test_a_few_contact_points_come_near_the_disk_in_one_piece(kind):
    exact = stuck_hz(None, "nodal", 3)
    few, more = (np.abs(stuck_hz(grid, kind, 3) / exact - 1.0).max() for grid in ((3, 3), (4, 5)))
    assert few < 0.1
    assert more < 0.6 * few


def test_friction_on_the_faces_damps_between_stuck_and_free():
    """Constant normal load: stuck under small forces, as good as free under large ones, most damped between."""
    grid, diameter, stiffness = (2, 1), 3, 2e7
    model, phase = reduced(grid, "mortar"), 2 * np.pi * diameter / N_SECTORS
    free, stuck = (natural_frequencies(model, phase, tangential=kt / 2, count=1)[0] for kt in (0.0, stiffness))
    modal = modal_model(model, damping_ratio=0.003)
    values = {"normal_stiffness": 0.0, "tangential_stiffness": stiffness, "friction": 0.3, "preload": 500.0}
    contact = ContactParameters.shared(2, **values)
    options = SolverOptions((0.97 * free, 1.03 * stuck), harmonics=1, detached=False, search="off")
    peaks = []
    for force in (1.0, 30.0, 1e4):
        curve = forced_response(modal, contact, Excitation(engine_order=diameter, force=force), options)
        assert curve.termination.complete
        peaks.append((curve.peak.frequency_hz, curve.peak.amplitude_m / force))
    assert peaks[0][0] == pytest.approx(stuck, rel=1e-4)
    assert peaks[2][0] == pytest.approx(free, rel=1e-4)
    assert peaks[1][1] < 0.7 * min(peaks[0][1], peaks[2][1])

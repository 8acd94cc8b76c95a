"""Plain disks under cyclic symmetry: problems of CalculiX with the values printed for them, and an annular plate."""

import calculix
import calculix_blocks
import numpy as np
import pytest
from rom_meshes import NODAL
from wheels import annular_sector, wheel_mesh

from rom import Material, ReductionOptions, assemble, reduce_sector
from rom.cyclic_sector.cyclic_faces import cyclic_faces
from rom.cyclic_sector.cyclic_modes import cyclic_modes, modes_by_nodal_diameter, static_motion
from rom.cyclic_sector.interface_motion import interface_motion
from rom.cyclic_sector.wave_reference import wave_errors
from rom.finite_elements.rotation import coriolis_acceleration, stiffen_by_rotation

STEEL = Material(2.1e11, 0.3, 7850.0)
# Hz, at each nodal diameter, in the file segdyn.dat.ref of CalculiX (units mm, t, s).
SEGDYN = (
    (104408.2, 146828.5, 584726.3, 1591412.0, 1809065.0),
    (81837.41, 635994.5, 650172.6, 1663027.0, 1667191.0),
    (136331.5, 852643.2, 1236424.0, 1934084.0, 2195894.0),
    (302066.2, 1212303.0, 1845949.0, 2187071.0, 2391600.0),
    (521193.7, 1630932.0, 1792174.0, 2401560.0, 2926736.0),
    (784586.5, 1424368.0, 2082240.0, 2924063.0, 3056161.0),
    (1087156.0, 1087161.0, 2558821.0, 2558827.0, 3429903.0),
)


@pytest.mark.parametrize("backend", ["auto", "superlu"])
def test_nodes_that_are_clamped_on_one_cut_face_are_clamped_on_the_other(backend):
    """CalculiX's problem `segdyn`: the bore is fixed but for its nodes on the left face. Its nodes are rounded."""
    sector = annular_sector(12, (0.1, 1.0), 0.1, (2, 12, 4), "clamped")
    bore = np.setdiff1d(sector.node_sets["root"], sector.node_sets["cyclic_left"])
    sector.node_sets["root"] = bore
    full = assemble(sector, Material(210000.0, 0.3, 7.8e-9), None)
    diameters = range(7) if backend == "auto" else (2, 6)
    found = modes_by_nodal_diameter(full, cyclic_faces(full, sector), diameters, 5, backend=backend)
    for modes in found:
        np.testing.assert_allclose(modes.frequency_hz, SEGDYN[modes.nodal_diameter], rtol=1e-5)


def test_a_reduced_sector_clamped_on_one_cut_face():
    """Its nodes on the other face are clamped in the reduced model too."""
    sector = annular_sector(12, (0.1, 1.0), 0.1, (2, 4, 2), "clamped")
    sector.node_sets["root"] = np.setdiff1d(sector.node_sets["root"], sector.node_sets["cyclic_left"])
    full = assemble(sector, STEEL, None)
    choice = interface_motion(full, sector, cyclic_faces(full, sector), NODAL)
    model = reduce_sector(full, sector, ReductionOptions(modes=60, store_basis=False), choice).model
    errors = wave_errors(model, choice.interface, 6).errors
    assert np.all((errors > -1e-8) & (errors < 3e-4))  # from above, as a reduced model should


def test_annular_plate():
    """Clamped at the bore, no nodal circle: Kirchhoff's plate, which solid elements near from above."""
    kirchhoff = np.array([79.409, 81.028, 89.649, 113.173, 156.058])
    errors = []
    for divisions in ((1, 12, 3), (1, 24, 6)):
        sector = annular_sector(18, (0.1, 0.2), 0.001, divisions, "clamped")
        full = assemble(sector, Material(2e11, 0.3, 7800.0), None)
        found = modes_by_nodal_diameter(full, cyclic_faces(full, sector), range(5), 1)
        errors.append(np.array([modes.frequency_hz[0] for modes in found]) / kirchhoff - 1.0)
    coarse, fine = errors
    assert np.all(coarse > 1.9 * fine)
    assert np.all((fine > 0.0) & (fine < 5e-3))


def whirling(sector, rpm, nodal_diameter, count):
    """Frequencies (Hz) with Coriolis forces of the lowest modes, and whether the points move round as the disk turns.

    The modes are combinations of those without; w = -e_x, and q(t) = Re q exp(i w t).
    """
    full = assemble(sector, STEEL, None)
    faces, omega = cyclic_faces(full, sector), rpm * np.pi / 30.0
    turning = stiffen_by_rotation(full, sector, STEEL, rpm, "linear", static_motion(full, faces))
    modes = cyclic_modes(turning, faces, abs(nodal_diameter), count)
    shapes = modes.shapes if nodal_diameter >= 0 else modes.shapes.conj()
    still = np.diag(modes.omega)
    gyroscopic = 1j * omega * (shapes.conj().T @ (turning.mass @ coriolis_acceleration(shapes)))
    values, vectors = np.linalg.eigh(np.block([[np.zeros_like(still), still], [still, gyroscopic]]))
    motion = (shapes @ vectors[count:, count:]).reshape(-1, 3, count)
    momentum = (turning.mass @ motion.reshape(-1, count)).reshape(motion.shape)
    about_x = -np.sum(np.cross(motion.real, momentum.imag, axis=1)[:, 0], axis=0)
    return values[count:] / (2.0 * np.pi), about_x < 0.0


@pytest.mark.skipif(calculix.PROGRAM is None, reason="CalculiX (ccx) is not installed")
def test_waves_turn_as_in_calculix(tmp_path):
    """The whole disk at 30 000 rev/min there, one nodal diameter here: +1 lags the rotation, -1 leads it."""
    rpm = 30000.0
    sector = annular_sector(6, (0.05, 0.15), 0.1, (2, 2, 1), "clamped")
    whole = wheel_mesh(sector)
    load = ["*DLOAD", f"BLADE, CENTRIF, {(rpm * np.pi / 30.0) ** 2:.12e}, 0., 0., 0., -1., 0., 0."]
    lines = calculix_blocks.body(whole, {"": STEEL}, whole.node_sets["root"])
    lines += ["*STEP", "*STATIC", *load, "*END STEP", "*STEP, PERTURBATION", "*FREQUENCY, STORAGE=YES", "12"]
    lines += ["*END STEP", "*STEP, PERTURBATION", "*COMPLEX FREQUENCY, CORIOLIS", "12", *load, "*END STEP"]
    said = calculix_blocks.run(tmp_path, "\n".join(lines) + "\n")
    printed = calculix.gyroscopic_frequencies(said[: said.index("P A R T I C I P A T I O N   F A C T O R S   F O R")])
    turning = [word for word in said[said.index("F=FORWARD,B=BACKWARD") :].split() if word in ("F", "B")]
    for diameter in (1, -1):
        hertz, forward = whirling(sector, rpm, diameter, 2)
        for value, along in zip(hertz, forward, strict=True):
            place = int(np.argmin(np.abs(printed - value)))
            assert printed[place] == pytest.approx(value, rel=1e-6)
            assert turning[place] == ("F" if along else "B")
            assert along == (diameter < 0)

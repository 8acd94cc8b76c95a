"""Blades of different stiffness on a disk: the reduced sector against the finite element mesh of the whole wheel."""

from dataclasses import replace

import numpy as np
from scipy.sparse.linalg import eigsh, splu
from wheels import RIM, bladed_sector, whole_wheel

from nonlinear import ContactParameters, Excitation
from nonlinear.mistuned_ring.linear_sectors import LinearSectors
from nonlinear.mistuned_ring.mistuning import Mistuning
from rom import BoundaryChoice, Material, ReductionOptions, assemble, modal_model, reduce_sector
from rom.cyclic_sector.cyclic_faces import cyclic_faces
from rom.cyclic_sector.interface_motion import interface_motion
from rom.cyclic_sector.part_stiffness import blade_stiffness

SECTORS, ENGINE_ORDER = 6, 2
STEEL = Material(2.1e11, 0.3, 7850.0)
DAMPING = 60.0  # C = a M


def test_a_wheel_of_blades_of_different_stiffness():
    """Twelve frequencies, and the response of each blade at a resonance, with deviations of up to 5 %."""
    sector, deviation = bladed_sector(SECTORS), Mistuning.sampled(SECTORS, 3, frequency=0.02)
    stiffer = [
        {"": replace(STEEL, young_modulus=(1.0 + own) ** 2 * STEEL.young_modulus), "disk": STEEL}
        for own in deviation.frequency
    ]
    sectors = [assemble(sector, materials, None) for materials in stiffer]
    full = assemble(sector, {"": STEEL, "disk": STEEL}, None)
    faces = cyclic_faces(full, sector)
    stiffness, mass, held, _ = whole_wheel(full, faces, sectors)
    free = np.setdiff1d(np.arange(mass.shape[0]), held)
    k, m = (matrix[free][:, free].tocsc() for matrix in (stiffness, mass))
    exact = np.sqrt(np.sort(eigsh(k, 12, m, sigma=0.0, return_eigenvectors=False))) / (2.0 * np.pi)
    assert np.ptp(exact[:6]) > 0.01 * exact[0]
    respond, hertz = driven(full, faces, sector, (k, m, free)), None
    choice = interface_motion(full, sector, faces, BoundaryChoice(contact_dofs="nodal"))
    contact = ContactParameters.shared(
        len(sector.right.nodes), normal_stiffness=0.0, tangential_stiffness=0.0, friction=0.0
    )
    errors = []
    for modes in (20, 60):
        model = reduce_sector(full, sector, ReductionOptions(modes=modes), choice).model
        own = blade_stiffness(full, sector, {"": STEEL, "disk": STEEL}, model.basis, RIM)
        difference = model.basis.T @ ((sectors[0].stiffness - full.stiffness) @ model.basis)
        factor = (1.0 + deviation.frequency[0]) ** 2 - 1.0
        np.testing.assert_allclose(factor * own, difference, atol=1e-9 * np.abs(difference).max())
        modal = modal_model(replace(model, blade_stiffness=own), rayleigh=(DAMPING, 0.0))
        ring = LinearSectors.of(
            modal, contact, Excitation(ENGINE_ORDER, 1.0), deviation, highest_hz=1.2 * exact[-1], state="free"
        )
        found = np.sqrt(ring._modes[0][:12]) / (2.0 * np.pi)
        hertz = hertz or ring.peak((0.9 * exact[0], 1.1 * exact[-1])).frequency_hz
        response, motion = ring.vibration([hertz])[0], respond(hertz)
        assert np.ptp(np.abs(response)) > 0.2 * np.abs(response).max()
        errors.append((np.abs(found / exact - 1.0).max(), np.abs(response - motion).max() / np.abs(motion).max()))
    assert errors[1][0] < 1e-4
    assert errors[1][1] < 5e-3  # at a resonance
    assert errors[1][0] < 0.6 * errors[0][0]  # what stays: the cut faces have the motions of the tuned ring


def driven(full, faces, sector, wheel):
    """Gives the motion of the tips along y at a frequency, each in the time of its blade, under 1 N on each of them.

    The forces travel around the wheel.
    """
    k, m, free = wheel
    phase, expanded = 2.0 * np.pi * ENGINE_ORDER / SECTORS, whole_wheel(full, faces)[3]
    tip = np.zeros((len(full.positions), 3), complex)
    tip[full.vertex_node[sector.node_sets["tip"][0]], 1] = 1.0
    force = [expanded(tip.ravel(), phase + 2.0 * np.pi * n / SECTORS)[free] for n in range(SECTORS)]

    def respond(hertz):
        omega = 2.0 * np.pi * hertz
        dynamic = (k + (1j * omega * DAMPING - omega**2) * m).tocsc()
        factor = splu(dynamic, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        motion = factor.solve(force[0])
        return np.fft.ifft([each.conj() @ motion for each in force])

    return respond

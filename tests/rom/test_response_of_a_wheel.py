"""A nonlinear solution of a reduced sector, applied to the finite element mesh of the whole wheel."""

import numpy as np
from scipy.sparse.linalg import splu
from wheels import bladed_sector, whole_wheel

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from rom import BoundaryChoice, Material, ReductionOptions, assemble, modal_model, natural_frequencies, reduce_sector
from rom.cyclic_sector.cyclic_faces import cyclic_faces
from rom.cyclic_sector.interface_motion import interface_motion
from rom.stress.mesh_motion import MeshMotion, SolvedPoint

SECTORS, ENGINE_ORDER, FORCE = 6, 2, 30.0
RAYLEIGH = 10.0, 1e-6  # C = a M + b K holds for modes and mesh alike
STEEL = Material(2.1e11, 0.3, 7850.0)
PITCH = 2.0 * np.pi / SECTORS


def on_faces(sector, full, values):
    """Forces (n, 3) on the nodes of a sector: contact forces (n_c, 3) on its right face, minus these on its left."""
    found = np.zeros((len(full.positions), 3), complex)
    for face, factor in ((sector.right, 1.0), (sector.left, -np.exp(-1j * ENGINE_ORDER * PITCH))):
        np.add.at(found, full.vertex_node[face.nodes], factor * np.einsum("kij,ki->kj", face.frame, values))
    return found


def relative_motion_of_the_wheel(sector, full, faces, pushed, omega):
    """Relative displacement (n_c, 3) in harmonic 1, from the whole wheel under excitation and contact forces."""
    stiffness, mass, held, expanded = whole_wheel(full, faces)
    free, (a, b) = np.setdiff1d(np.arange(mass.shape[0]), held), RAYLEIGH
    dynamic = (stiffness * (1.0 + 1j * omega * b) + mass * (1j * omega * a - omega**2))[free][:, free].tocsc()
    factor = splu(dynamic, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    forces, phase = on_faces(sector, full, pushed), ENGINE_ORDER * PITCH
    forces[full.vertex_node[sector.node_sets["tip"][0]], 1] += FORCE
    motion = factor.solve(expanded(forces.ravel(), phase)[free])
    units = np.eye(pushed.size).reshape(-1, *pushed.shape)
    work = [expanded(on_faces(sector, full, unit).ravel(), phase)[free].conj() @ motion for unit in units]
    return np.reshape(work, pushed.shape) / SECTORS


def test_contact_forces_of_a_sector_move_the_wheel_as_its_relative_displacement():
    """Slip and lift-off in engine order 2 of six sectors; the error falls with the modes kept.

    The mesh of one sector under the same forces, of which stresses are computed, is nearer still.
    """
    sector = bladed_sector(SECTORS)
    full = assemble(sector, {"": STEEL, "disk": STEEL}, None)
    faces = cyclic_faces(full, sector)
    choice = interface_motion(full, sector, faces, BoundaryChoice(contact_dofs="nodal"))
    contact = ContactParameters.shared(
        len(sector.right.nodes), normal_stiffness=2e7, tangential_stiffness=1e7, friction=0.3, interference=2e-7
    )
    quick = {"detached": False, "truncation": False, "search": "off", "stability": "folds"}
    errors, by_mesh = [], []
    for modes in (20, 60):
        model = reduce_sector(full, sector, ReductionOptions(modes=modes), choice).model
        lowest = natural_frequencies(model, ENGINE_ORDER * PITCH)[0]
        options = SolverOptions((0.98 * lowest, 1.1 * lowest), harmonics=3, **quick)
        modal = modal_model(model, rayleigh=RAYLEIGH)
        curve = forced_response(modal, contact, Excitation(ENGINE_ORDER, FORCE), options)
        place = int(np.argmax(np.where(curve.slipping > 0, curve.amplitude_m, 0.0)))
        assert curve.separating[place] + curve.slipping[place] > 5
        omega, pushed = 2.0 * np.pi * curve.frequency_hz[place], curve.contact_force[place, 1]
        found = relative_motion_of_the_wheel(sector, full, faces, pushed, omega)
        moved = curve.relative_displacement[place, 1]
        errors.append(float(np.abs(found - moved).max() / np.abs(moved).max()))
        mesh = MeshMotion(full, sector, (model, modal), BoundaryChoice(contact_dofs="nodal"), faces)
        point = SolvedPoint(omega, ENGINE_ORDER * PITCH, FORCE, curve.contact_force[place])
        solved = mesh.solved(point, mesh.corrected(point))[0][1].reshape(-1, 3)
        right, left = (
            np.einsum("kij,kj->ki", face.frame, solved[full.vertex_node[face.nodes]])
            for face in (sector.right, sector.left)
        )
        again = right - np.exp(1j * ENGINE_ORDER * PITCH) * left
        by_mesh.append(float(np.abs(found - again).max() / np.abs(found).max()))
    assert errors[1] < 1e-3
    assert errors[1] < 0.3 * errors[0]
    assert by_mesh[1] < 2e-5  # the damping of the modes left out
    assert by_mesh[1] < 0.3 * by_mesh[0]

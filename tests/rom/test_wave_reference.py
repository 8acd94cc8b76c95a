"""The reference of a disk sector in one wave, against direct solutions with the matrices of its whole mesh."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import eigh

from geometry import BladeParameters, DiskParameters, MeshParameters, SectorMesh, ShroudParameters, build_sector
from rom import (
    BoundaryChoice,
    FullModel,
    Material,
    ReducedModel,
    ReductionOptions,
    WaveSuperelement,
    assemble,
    model_of_waves,
    natural_frequencies,
    reduce_sector,
)
from rom.cyclic_sector.cyclic_faces import cyclic_faces
from rom.cyclic_sector.interface_motion import interface_motion
from rom.cyclic_sector.wave_reference import wave_reference
from rom.reduction.mode_selection import reduce_to_tolerance
from rom.reduction.model_comparison import LinearOperation, linear_responses
from rom.reduction.reference_model import static_error

N_BLADES = 40
NODAL = BoundaryChoice(contact_dofs="nodal")
NORMAL, TANGENTIAL = 3e6, 1e6
RANGE = (200.0, 2000.0)


def wheel(bore: str) -> tuple[FullModel, SectorMesh]:
    blade, shroud = BladeParameters(N_BLADES, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    disk, steel = DiskParameters(0.26, 0.03, bore=bore), Material(2e11, 0.3, 7800.0)
    sector = build_sector(blade, shroud, MeshParameters(size=0.02, contact_grid=(1, 1)), disk)
    return assemble(sector, {"": steel, "disk": steel}, element="hex8"), sector


def constraint(full: FullModel, sector: SectorMesh, order: int) -> NDArray[np.complex128]:
    """T with u = T z: the right face follows the left one, clamped dofs are left out."""
    faces = cyclic_faces(full, sector)
    motion = np.eye(full.n_dofs, dtype=complex)
    for right, left in zip(faces.right, faces.left, strict=True):
        rows = slice(3 * right, 3 * right + 3)
        motion[rows] = np.exp(2j * np.pi * order / N_BLADES) * (faces.turn @ motion[3 * left : 3 * left + 3])
    held = np.zeros(full.n_dofs, dtype=bool)
    held[full.fixed] = True
    followers = (3 * faces.right[:, None] + np.arange(3)).ravel()
    kept = np.setdiff1d(np.flatnonzero(~held), followers)
    return motion[:, kept]


@pytest.mark.parametrize(("bore", "order"), [("free", 0), ("free", 1), ("clamped", 37)])
def test_frequencies_and_receptances_are_those_of_the_whole_mesh(bore: str, order: int) -> None:
    full, sector = wheel(bore)
    reference = wave_reference(full, sector, min(order, N_BLADES - order), RANGE[1], NODAL)
    phase = 2.0 * np.pi * order / N_BLADES
    operation = LinearOperation(RANGE, phase, np.array([NORMAL]), np.array([TANGENTIAL]), rayleigh=(0.0, 1e-6))
    motion = constraint(full, sector, order)
    right, left = (3 * full.vertex_node[face.nodes[0]] + np.arange(3) for face in (sector.right, sector.left))
    relative = sector.right.frame[0] @ motion[right] - np.exp(1j * phase) * sector.left.frame[0] @ motion[left]
    tip = 3 * full.vertex_node[sector.node_sets["tip"][0]] + 1
    mass, stiffness = (motion.conj().T @ (part @ motion) for part in (full.mass, full.stiffness))
    for found, (normal, tangential) in zip(
        linear_responses(reference.model, operation), operation.contact_conditions().values(), strict=True
    ):
        springs = np.diag([tangential[0], tangential[0], normal[0]])
        held = stiffness + relative.conj().T @ springs @ relative
        squared = eigh(held, mass, eigvals_only=True, subset_by_index=(0, 9))
        exact = np.sqrt(np.maximum(squared, 0.0))[found.first_mode - 1 :] / (2.0 * np.pi)
        np.testing.assert_allclose(found.natural_hz, exact[: len(found.natural_hz)], rtol=1e-6)
        hertz = found.sample_hz[2]
        omega = 2.0 * np.pi * hertz
        dynamic = (1.0 + 1e-6j * omega) * stiffness - omega**2 * mass + relative.conj().T @ springs @ relative
        moved = np.linalg.solve(dynamic, np.column_stack([motion[tip].conj(), relative.conj().T]))
        np.testing.assert_allclose(
            found.contact[2], relative @ moved[:, 1:], rtol=2e-4, atol=2e-4 * abs(found.contact[2]).max()
        )
        assert abs(found.output[2]).max() > 0.0
        np.testing.assert_allclose(found.output[2][0], motion[tip] @ moved[:, 0], rtol=2e-4)


@pytest.mark.parametrize("bore", ["free", "clamped"])
def test_a_reduced_model_against_it(bore: str) -> None:
    """Static flexibility exact where the disk is held, springs over the face as those of a mortar."""
    full, sector = wheel(bore)
    choice = interface_motion(full, sector, cyclic_faces(full, sector))
    model = reduce_sector(full, sector, ReductionOptions(modes=20), choice).model
    reference = wave_reference(full, sector, 3, RANGE[1], with_face=True)
    phase = 2.0 * np.pi * 3 / N_BLADES
    exact = natural_frequencies(reference.model, phase, normal=NORMAL, tangential=TANGENTIAL, count=4)
    found = natural_frequencies(model, phase, normal=NORMAL, tangential=TANGENTIAL, count=4)
    np.testing.assert_allclose(found, exact, rtol=2e-3)
    assert np.all(found >= exact * (1.0 - 1e-9))  # a subspace is stiffer
    if full.fixed.size:
        assert reference.flexibility is not None
        assert static_error(model, reference.flexibility, phase) < 1e-6
    else:
        assert reference.flexibility is None
    mortar = reference.with_mortar((1, 1))
    np.testing.assert_allclose(
        natural_frequencies(mortar, phase, normal=NORMAL, tangential=TANGENTIAL, count=4), exact, rtol=1e-3
    )


def test_modes_for_a_tolerance_with_cut_faces() -> None:
    """The fewest modes, against the model with many."""
    full, sector = wheel("clamped")
    choice = interface_motion(full, sector, cyclic_faces(full, sector))
    operation = LinearOperation(
        RANGE, 2.0 * np.pi * 3 / N_BLADES, np.array([NORMAL]), np.array([TANGENTIAL]), damping_ratio=0.01
    )
    made = reduce_to_tolerance(full, sector, 1e-3, [operation], choice)
    assert made.error is not None
    assert made.error <= 1e-3
    many = reduce_sector(full, sector, ReductionOptions(modes=4 * made.modes + 20), choice).model
    found, exact = (natural_frequencies(model, 2.0 * np.pi * 3 / N_BLADES, count=2) for model in (made.model, many))
    np.testing.assert_allclose(found, exact, rtol=1e-3)


def test_superelements_are_excited_in_the_waves_of_both_directions() -> None:
    """A load that is real on the blade: the wave of -n answers with the conjugate, as in a model of cut faces."""
    rim = 1e6 * np.array([[2.0, -1.0, -1.0], [-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]]) + 1e5 * np.eye(3)
    blade, left, right = np.eye(3)
    at_left, at_right = np.outer([0.3, 0.0, 1.0], blade), np.outer([0.0, 0.0, 0.8], blade)
    cuts = {"cyclic_right": right[None], "cyclic_left": left[None]}
    model = ReducedModel(
        np.eye(3), rim, at_left, np.zeros((1, 3)), blade, {"tip": blade}, at_right, n_blades=12, **cuts
    )
    waves = {}
    for n in range(7):
        own = model.wave(np.pi * n / 6)
        assert own is not None
        own = own.real if n in (0, 6) else own * np.exp(0.3j)
        adjoint = own.conj().T
        waves[n] = WaveSuperelement(
            adjoint @ model.mass @ own,
            adjoint @ model.stiffness @ own,
            at_left @ own,
            at_right @ own,
            adjoint @ blade,
            {"tip": blade @ own},
        )
    other = model_of_waves(waves, 12, np.zeros((1, 3)))
    for order in (0, 2, 6, 10):
        operation = LinearOperation((50.0, 300.0), np.pi * order / 6, np.full(1, 1e5), np.full(1, 5e4), 0.01)
        for found, exact in zip(linear_responses(other, operation), linear_responses(model, operation), strict=True):
            np.testing.assert_allclose(found.output, exact.output, rtol=1e-9)
            assert abs(exact.output).max() > 1e-6

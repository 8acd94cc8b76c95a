"""Mistuned rings of sectors joined at a disk, against the ring as one structure and against clamped blades."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade
from lumped_disk import sector_places, sector_with_disk, whole_ring

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.contact.fourier import to_complex, to_real
from nonlinear.harmonic_balance.initial_solution import solve_at
from nonlinear.mistuned_ring import sector_ring as ring_of_sectors
from nonlinear.mistuned_ring.linear_contacts import blade_strain, strain_directions
from nonlinear.mistuned_ring.linear_sectors import LinearSectors
from nonlinear.mistuned_ring.mistuning import Mistuning, MistuningError
from nonlinear.mistuned_ring.ring_balance import RingBalance
from nonlinear.mistuned_ring.ring_response import mistuned_response
from nonlinear.mistuned_ring.sector_ring import SectorRing
from nonlinear.response_solver import build_harmonic_balance
from rom import SectorModes, modal_model, read_reduced_model, write_reduced_model
from rom.cyclic.receptance import RelativeReceptance

RAYLEIGH = (0.02, 0.0)  # C = a M: the same matrix whatever the stiffness
VALUES = {"normal_stiffness": 6.0, "tangential_stiffness": 4.0, "friction": 0.4, "interference": [0.6, 0.05]}
CONTACT = ContactParameters.shared(2, **VALUES)
OPTIONS = SolverOptions((0.14, 0.2), harmonics=1, stability="folds", truncation=False, detached=False, search="off")
N = 6


def mistuned_whole(sector, mistuning, engine_order):
    """The ring of blades that differ as one structure."""
    places = sector_places(sector, mistuning.n_blades)
    change = (1.0 + mistuning.frequency) ** 2 - 1.0
    whole = whole_ring(sector, mistuning.n_blades, engine_order)
    added = np.einsum("j,jna,nk,jkb->ab", change, places, sector.blade_stiffness, places)
    return replace(whole, stiffness=whole.stiffness + added)


def sector_ring(sector, contact, engine_order, harmonics, *, every):
    """The ring with all strains of its blades, or with those that are chosen."""
    modal = modal_model(sector, rayleigh=RAYLEIGH)
    tuned = RelativeReceptance(modal, modal.phase(engine_order), tuple(range(harmonics + 1)), 1.0)
    rows = blade_strain(modal)
    chosen = strain_directions(tuned, contact, 2.0 * np.pi * OPTIONS.frequency_hz[1])
    return SectorRing(tuned, N, np.pad(rows, ((0, -len(rows) % 3), (0, 0))) if every else chosen)


@pytest.mark.parametrize(("harmonics", "law"), [(1, "two_sliders"), (3, "cone")])
def test_a_mistuned_ring_is_the_ring_in_one_piece(harmonics, law):
    """Solutions of the whole ring with friction and lift-off, in the unknowns of the sectors."""
    sector, engine_order = sector_with_disk(N), 1
    contact = replace(CONTACT, law=law)
    mistuning = Mistuning.sampled(N, 1, frequency=0.03, stiffness=0.05, friction=0.1, interference=0.02)
    ring_contact, options = mistuning.contact(contact), replace(OPTIONS, harmonics=harmonics)
    modal = modal_model(mistuned_whole(sector, mistuning, engine_order), rayleigh=RAYLEIGH)
    whole = build_harmonic_balance(modal, ring_contact, Excitation(0, 1.0), options)
    structure = sector_ring(sector, contact, engine_order, harmonics, every=True)
    balance = RingBalance.of(structure, contact, mistuning, options)
    turn = np.exp(-2j * np.pi * np.arange(harmonics + 1)[:, None] * np.arange(N) / N)[..., None]
    states = set()
    for hertz in (0.12, 0.165, 0.3):
        omega = 2.0 * np.pi * hertz
        solved = solve_at(whole, omega, np.zeros(whole.size), options)
        assert solved.converged
        states |= set(whole.forces(solved.solution).state.tolist())
        coefficients = solved.solution.reshape(2 * harmonics + 1, N, -1)
        known = np.concatenate([coefficients[:1] + 0j, coefficients[1::2] + 1j * coefficients[2::2]]) * turn
        start = np.zeros((harmonics + 1, N, balance.pair_dofs), complex)
        start[..., : known.shape[2]] = known
        forces = balance.forces(to_real(start.reshape(harmonics + 1, -1)).reshape(-1))
        start[..., known.shape[2] :] = structure.response(omega, balance.by_harmonic(forces.force))[0][
            ..., known.shape[2] :
        ]
        found = solve_at(balance, omega, to_real(start.reshape(harmonics + 1, -1)).reshape(-1), options)
        assert found.converged
        own = balance.by_harmonic(found.solution.reshape(2 * harmonics + 1, -1, 3))[..., : known.shape[2]]
        np.testing.assert_allclose(own, known, atol=1e-9 * np.abs(known).max())
    assert {1, 2} <= states


def test_chosen_strains_suffice():
    """The peak with a few strains of the blades against that of the whole ring; without mistuning the tuned curve."""
    sector, excitation = sector_with_disk(N), Excitation(1, 1.0)
    modal, mistuning = modal_model(sector, rayleigh=RAYLEIGH), Mistuning.sampled(N, 1, frequency=0.03)
    ring = mistuned_response(modal, CONTACT, excitation, OPTIONS, mistuning)
    assert ring.complete
    assert ring.peak.located
    structure = sector_ring(sector, CONTACT, 1, 1, every=False)
    assert len(structure.strain) < len(blade_strain(modal))
    name = "tip" if ring.peak.blade == 0 else f"tip{ring.peak.blade}"
    whole = modal_model(mistuned_whole(sector, mistuning, 1), rayleigh=RAYLEIGH)
    near = tuple(factor * ring.peak.frequency_hz for factor in (0.99, 1.01))
    options = replace(OPTIONS, output=name, frequency_hz=near)
    curve = forced_response(whole, mistuning.contact(CONTACT), Excitation(0, 1.0), options)
    beside = int(np.argmin(np.abs(curve.frequency_hz - ring.peak.frequency_hz)))
    coefficients = curve.relative_displacement[beside].reshape(2, -1)
    balance = build_harmonic_balance(whole, mistuning.contact(CONTACT), Excitation(0, 1.0), options)
    omega = 2.0 * np.pi * ring.peak.frequency_hz
    solved = solve_at(balance, omega, to_real(coefficients).reshape(-1), options)
    assert solved.converged
    force = to_complex(balance.forces(solved.solution).force.reshape(3, -1))
    output = balance.receptance.output(name, balance.receptance.modal_response(omega, force)[0])
    assert ring.peak.amplitude_m == pytest.approx(abs(output[1]), rel=5e-5)
    tuned = mistuned_response(modal, CONTACT, excitation, OPTIONS)
    same = mistuned_response(modal, CONTACT, excitation, OPTIONS, Mistuning.of(N))
    np.testing.assert_allclose(same.frequency_hz, tuned.frequency_hz, rtol=1e-9)
    np.testing.assert_allclose(same.amplitude_m, np.repeat(tuned.amplitude_m, N, axis=1), rtol=1e-9)
    cyclic = forced_response(modal, CONTACT, excitation, OPTIONS)
    at = np.argmin(np.abs(cyclic.frequency_hz - tuned.peak.frequency_hz))
    assert np.abs(cyclic.output[at, 1]) == pytest.approx(tuned.peak.amplitude_m, rel=1e-6)
    assert abs(ring.peak.amplitude_m / tuned.peak.amplitude_m - 1.0) > 0.003


@pytest.mark.parametrize("n_blades", [2, 7])
def test_iterative_solution_is_the_dense_one(n_blades, monkeypatch):
    """Jacobian against differences; GMRES with factors of this state and of another one against a dense solution."""
    sector = sector_with_disk(n_blades)
    mistuning = Mistuning.sampled(n_blades, 3, frequency=0.05, stiffness=0.1)
    modal, rng = modal_model(sector, rayleigh=(0.002, 0.0)), np.random.default_rng(n_blades)
    tuned = RelativeReceptance(modal, modal.phase(1), (0, 1, 2), 1.0)
    rows = strain_directions(tuned, CONTACT, 1.2)
    balance = RingBalance.of(SectorRing(tuned, n_blades, rows), CONTACT, mistuning, replace(OPTIONS, harmonics=2))
    x, direction, right, column, row = 0.1 * rng.standard_normal((5, balance.size))
    for omega in (0.97, 1.0):
        linearised = balance.evaluate(x, omega)
        step = 1e-7 * direction
        difference = balance.evaluate(x + step, omega).residual - balance.evaluate(x - step, omega).residual
        exact = linearised.jacobian @ direction
        np.testing.assert_allclose(exact, difference / 2e-7, atol=1e-5 * np.abs(exact).max())
        product, indices = balance.structure.coupling(omega, linearised.system(column, row, 0.3).change)
        np.testing.assert_allclose(np.eye(balance.size) - product, linearised.jacobian, atol=1e-11)
        assert indices.size == balance.size
        monkeypatch.setattr(ring_of_sectors, "SMALLEST_ITERATIVE", balance.size + 1)
        dense = linearised.factorise(column, row, 0.3)
        monkeypatch.setattr(ring_of_sectors, "SMALLEST_ITERATIVE", balance.size)
        factors = linearised.factorise(column, row, 0.3)
        for one, other in zip(dense.solve(right, 0.7), factors.solve(right, 0.7), strict=True):
            np.testing.assert_allclose(other, one, atol=1e-6 * np.abs(dense.solve(right, 0.7)[0]).max())
        assert type(factors) is not type(dense)


def test_linear_sectors_are_the_ring_in_one_piece():
    """Stuck contacts of different stiffness, blades of different frequency, at all modes and at a few."""
    sector, engine_order = sector_with_disk(N), 2
    modal = modal_model(sector, rayleigh=RAYLEIGH)
    mistuning = Mistuning.sampled(N, 4, frequency=0.03, stiffness=0.2)
    whole, places = mistuned_whole(sector, mistuning, engine_order), sector_places(sector, N)
    springs = (np.tile([2.0, 2.0, 3.0], 2) * (1.0 + mistuning.stiffness)[:, None]).reshape(-1)
    stiffness = whole.stiffness + (whole.contact_right.T * springs) @ whole.contact_right
    problem = modal, CONTACT, Excitation(engine_order, 2.0)
    every, few = (LinearSectors.of(*problem, mistuning, highest_hz=hertz) for hertz in (1e4, 0.2))
    assert few.force.size < every.force.size == N * modal.at(0).angular_frequency.size
    tips = sector.outputs["tip"] @ places
    for hertz in (0.16, 0.19):
        omega = 2.0 * np.pi * hertz
        dynamic = stiffness + (1j * omega * RAYLEIGH[0] - omega**2) * whole.mass
        expected = tips @ np.linalg.solve(dynamic, 2.0 * whole.force_excitation)
        expected *= np.exp(-2j * np.pi * engine_order * np.arange(N) / N)  # each in its own time
        largest = np.abs(expected).max()
        np.testing.assert_allclose(every.vibration([hertz])[0], expected, atol=1e-9 * largest)
        np.testing.assert_allclose(few.vibration([hertz])[0], expected, atol=3e-3 * largest)
    again = LinearSectors.of(*problem, Mistuning.of(N), highest_hz=0.2)
    assert again.with_mistuning(mistuning).peak((0.14, 0.2)) == few.peak((0.14, 0.2))
    assert again.peak((0.14, 0.2)).amplitude_m != few.peak((0.14, 0.2)).amplitude_m


def test_on_a_rigid_disk_the_blades_are_clamped():
    """The disk a million times as stiff: the response of a mistuned ring of clamped blades."""
    blade, flexible = lumped_blade(N), sector_with_disk(N)
    stiff = flexible.blade_stiffness + 1e7 * (flexible.stiffness - flexible.blade_stiffness)
    force = np.zeros(flexible.size, complex)
    force[: blade.size] = blade.force_excitation
    sector = replace(flexible, stiffness=stiff, force_excitation=force, force_static=np.zeros(flexible.size))
    mistuning = Mistuning.sampled(N, 2, frequency=0.02)
    problem = CONTACT, Excitation(1, 1.0), OPTIONS, mistuning
    clamped, mounted = (mistuned_response(modal_model(m, rayleigh=RAYLEIGH), *problem) for m in (blade, sector))
    assert mounted.peak.blade == clamped.peak.blade
    assert mounted.peak.amplitude_m == pytest.approx(clamped.peak.amplitude_m, rel=1e-3)
    assert mounted.peak.frequency_hz == pytest.approx(clamped.peak.frequency_hz, rel=1e-4)


def test_blades_differ_only_where_their_stiffness_is_known(tmp_path):
    sector = sector_with_disk(N)
    write_reduced_model(tmp_path / "rom.h5", sector)
    np.testing.assert_array_equal(read_reduced_model(tmp_path / "rom.h5").blade_stiffness, sector.blade_stiffness)
    modal = modal_model(replace(sector, blade_stiffness=None), rayleigh=RAYLEIGH)
    assert isinstance(modal, SectorModes)
    problem, deviating = (modal, CONTACT, Excitation(1, 1.0)), Mistuning.of(N, frequency=0.01)
    said = "frequency: blades on a disk that differ, allowed: with blade_stiffness in the reduced model"
    with pytest.raises(MistuningError, match=said):
        mistuned_response(*problem, OPTIONS, deviating)
    with pytest.raises(MistuningError, match=said):
        LinearSectors.of(*problem, deviating, highest_hz=0.2)
    with pytest.raises(MistuningError, match="mistuning: 5 blades, allowed: 6, as the model"):
        LinearSectors.of(*problem, Mistuning.of(5), highest_hz=0.2)
    rubbing = mistuned_response(*problem, OPTIONS, Mistuning.of(N, friction=0.1))
    assert rubbing.complete

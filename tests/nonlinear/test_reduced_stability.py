"""Perturbations in few modes: against all modes, and against dense matrices."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactParameters, Excitation, SolverOptions
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.stability import reduced_refinement
from nonlinear.stability.contact_feedback import ContactFeedback
from nonlinear.stability.eigenproblem import SLICE_WIDTH, WIDTH, eigenvalues_by_slices
from nonlinear.stability.floquet import (
    FloquetAnalysis,
    floquet_exponents,
    grows,
)
from nonlinear.stability.modal_contact import FaceJacobian, face_contact
from nonlinear.stability.point_contact import PointContact, in_harmonics
from nonlinear.stability.reduced_problem import LEAST, CondensedPoles, reduced_modes
from nonlinear.stability.reduced_refinement import ReducedRefinement, ReducedWave
from nonlinear.stability.ring_scan import FaceScan, PatternScan
from nonlinear.stability.ring_structure import RingStructure
from rom import modal_model

N_BLADES, HARMONICS, OMEGA = 12, 2, 1.3


def case(law="two_sliders", seed=2, omega=OMEGA):
    """The analysis of a motion with slip and lift-off, its contact, and the contact parameters."""
    modal = modal_model(lumped_blade(N_BLADES), damping_ratio=0.02)
    contact = ContactParameters.shared(
        2, normal_stiffness=6.0, tangential_stiffness=4.0, friction=0.5, interference=0.1, law=law
    )
    options = SolverOptions((0.1, 0.8), harmonics=HARMONICS)
    balance = build_harmonic_balance(modal, contact, Excitation(5, 1.0), options)
    displacement = 0.3 * np.random.default_rng(seed).normal(size=(2 * HARMONICS + 1, 2, 3))
    analysis = FloquetAnalysis.of(balance.receptance, contact)
    jacobian = balance.element.evaluate(displacement).jacobian
    return analysis, PointContact(jacobian, omega, analysis.sampler.memory(displacement)), contact


def face_flexibility(modal, contact):
    """Static flexibility of both faces times the contact stiffness, symmetric."""
    kt, kn = contact.tangential_stiffness, contact.normal_stiffness
    weight = np.tile(np.sqrt(np.stack([kt, kt, kn], axis=1).ravel()), 2)[:, None]
    faces = weight * np.concatenate([modal.right, modal.left]) / modal.angular_frequency
    return faces @ faces.T


@pytest.mark.parametrize("negligible", [0.0, 1e-3, 1.0])
def test_residual_modes_have_the_flexibility(negligible):
    """Beside the lowest modes nothing but the stated flexibility is left out, and every mode keeps unit mass."""
    analysis, _, contact = case()
    modal = analysis.problem.modal
    reduced, omitted = reduced_modes(modal, contact, 2, negligible, 100)
    missing = np.linalg.eigvalsh(face_flexibility(modal, contact) - face_flexibility(reduced, contact))
    assert missing.min() > -1e-10
    assert missing.max() == pytest.approx(omitted, abs=1e-10)
    assert reduced.angular_frequency[:2] == pytest.approx(modal.angular_frequency[:2])
    assert (np.diff(reduced.angular_frequency) > 0.0).all()
    assert reduced.damping.size == 2 + LEAST or omitted <= negligible


def test_harmonics_of_a_real_jacobian():
    size = 2 * HARMONICS + 1
    values = np.random.default_rng(1).normal(size=(2, size, size))
    to_real = np.eye(size, dtype=complex)
    for h in range(1, size, 2):
        to_real[h : h + 2, h : h + 2] = [[1.0, 1.0], [-1j, 1j]]
    assert in_harmonics(values) == pytest.approx(np.linalg.inv(to_real) @ values @ to_real)


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
def test_contact_of_both_faces_gives_that_of_every_kappa(law):
    analysis, point, _ = case(law)
    reduced = analysis.few_modes.at(OMEGA)
    values, _ = point.at(0.2j)
    faces = FaceJacobian.of(reduced, values)
    kappas = np.array([0.4, -2.0])
    for kappa, found in zip(kappas.tolist(), faces.at(kappas), strict=True):
        direct = reduced.projected(reduced.in_harmonics(values), reduced.relative(reduced.modal, kappa))
        assert found == pytest.approx(direct, abs=1e-12 * np.abs(direct).max())


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
def test_what_is_kept_with_a_point_is_freed_with_it(law):
    """At once: large arrays would else stay until the next garbage collection."""
    for _ in range(2):  # what compiles kernels, at the first time, keeps what it was called with
        analysis, point, _ = case(law)
        faces = face_contact(analysis.few_modes.at(OMEGA), point)
        faces.linearised(0.02 + 0.3j, np.array([1.1]))
    gone, enabled = [weakref.ref(point), weakref.ref(faces)], gc.isenabled()
    gc.disable()
    try:
        del point, faces
        assert [reference() for reference in gone] == [None, None]
    finally:
        if enabled:
            gc.enable()


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
@pytest.mark.parametrize("sigma", [0.0, 0.02 + 0.3j])
def test_contact_in_modes_with_its_memory(law, sigma):
    """K(sigma) and dK/dsigma of both faces, low rank where it is, against the whole Jacobian of one kappa."""
    analysis, point, _ = case(law)
    reduced, kappa = analysis.few_modes.at(OMEGA), 1.1
    relative = reduced.relative(reduced.modal, kappa)
    value, derivative = (reduced.projected(reduced.in_harmonics(part), relative) for part in point.at(complex(sigma)))
    kappas = np.array([0.3, kappa])
    faces, memory = face_contact(reduced, point).linearised(complex(sigma), kappas)
    matrix = faces.at(kappas)[1]
    assert matrix == pytest.approx(value, abs=1e-12 * np.abs(value).max())
    product = (memory[0] @ memory[1] if isinstance(memory, tuple) else memory)[1]
    assert np.abs(derivative).max() > 1e-3 * np.abs(value).max()
    assert product == pytest.approx(derivative, abs=1e-12 * np.abs(derivative).max())


@pytest.mark.parametrize("states", [[0, 3, 3, 4], [], list(range(7))])
@pytest.mark.parametrize("factors", [True, False])
def test_unknowns_without_a_state_are_eliminated_exactly(states, factors):
    """Of several contacts at once, against each closed in all unknowns; in two states one unknown may move."""
    rng, size, state = np.random.default_rng(4), 7, np.array(states, dtype=np.int64)

    def random(*shape):
        return rng.normal(size=shape) + 1j * rng.normal(size=shape)

    poles = CondensedPoles(state, random(state.size), random(state.size), 0.1 * random(size), 0.1 * random(size))
    change = random(2, size, 3), random(2, 3, size)
    parts, weights = random(3, size, size), rng.normal(size=(2, 3))
    contact = np.einsum("km,mij->kij", weights, parts)
    found = poles.pencils(parts, weights, change if factors else change[0] @ change[1])
    for k in range(2):
        exact = ContactFeedback.closed(poles.model, contact[k]).pencil(change[0][k] @ change[1][k])
        assert found.matrix[k] == pytest.approx(exact.matrix, abs=1e-11)
        assert found.descriptor[k] == pytest.approx(exact.descriptor, abs=1e-11)


def test_open_contacts_leave_the_poles_of_the_blade():
    """No node touches: the scan finds what the blade has without contact."""
    analysis, point, contact = case()
    open_point = PointContact(np.zeros_like(point.jacobian), OMEGA, None)
    scan = PatternScan(analysis.few_modes, contact, N_BLADES)
    found = scan.scanned(open_point).eigenvalues()
    least = analysis.problem.modal.damping.min()  # 2 zeta omega
    assert found[0][0].real * OMEGA == pytest.approx(-least / 2.0, rel=1e-6)


def test_opposite_kappa_is_mirrored():
    """The slice around a - i c at -kappa, against its own matrices."""
    analysis, point, contact = case()
    form, kappas = PatternScan(analysis.few_modes, contact, N_BLADES).scanned(point).form, np.array([0.7, -1.9])
    mirrored = form(0.3 + WIDTH * 1j, kappas).mirrored(analysis.problem.static)
    direct = form(0.3 - WIDTH * 1j, -kappas)
    assert (mirrored.retained == direct.retained).all()
    assert mirrored.pencil.matrix == pytest.approx(direct.pencil.matrix, abs=1e-10)
    assert mirrored.pencil.descriptor == pytest.approx(direct.pencil.descriptor, abs=1e-10)


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
def test_both_scans_find_the_same(law):
    analysis, point, contact = case(law)
    few = PatternScan(analysis.few_modes, contact, N_BLADES).scanned(point).eigenvalues()
    full = FaceScan(RingStructure(analysis.problem, contact, N_BLADES)).scanned(point).eigenvalues()
    for sigma, k in full[:6]:
        assert min(abs(sigma - other) for other, n in few if n == k) < 0.01


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
@pytest.mark.parametrize("unknowns", [0, 1000])
def test_refined_exponents_are_those_of_all_modes(law, unknowns, monkeypatch):
    """With the fewest modes too: what is left out is added to first order."""
    monkeypatch.setattr(reduced_refinement, "UNKNOWNS", unknowns)
    analysis, point, contact = case(law)
    refinement, checked = ReducedRefinement(analysis.problem, contact), 0
    for k in (2, 5):
        kappa = 2.0 * np.pi * k / N_BLADES
        exact = replace(analysis.problem, kappa=kappa).eigenproblem(point.jacobian, OMEGA, point.memory)
        starts = exact.eigenvalues(0.1j)
        for start in starts[np.abs(starts) < 0.6]:
            found = refinement.converged(point, kappa, complex(start))
            if found is None:
                continue
            value, is_exact = found
            distance = distance_to_eigenvalue(analysis.problem, kappa, point, value)
            assert distance < (1e-6 if is_exact else 5e-3)
            checked += 1
    assert checked >= 2


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
@pytest.mark.parametrize("omega", [1.7, 2.2])  # a pair grows; a real exponent
def test_growing_exponents_of_the_wave_in_few_modes(law, omega, monkeypatch):
    """As many as with all modes, and each an eigenvalue of the dense problem."""
    monkeypatch.setattr(reduced_refinement, "LEAST_SIZE", 0)
    analysis, point, contact = case(law, 7, omega)
    wave = ReducedWave(analysis.few_modes.at(omega), contact, point)
    full = floquet_exponents(analysis.problem, point.jacobian, omega, point.memory)
    full = full[grows(full, omega)] / omega
    assert full.size
    approximate = np.concatenate([wave.eigenvalues(0.0), wave.eigenvalues(1j / 3)])
    for sigma in full[full.imag >= 0.0]:
        nearest = approximate[np.argmin(np.abs(approximate - sigma))]
        assert abs(nearest - sigma) < 0.02
        value, exact = analysis.refinement.converged(point, 0.0, complex(nearest))
        assert exact
        assert abs(value - sigma) < 1e-3
        # a kappa that is not quite 0, so that the dense problem is written in the amplitudes of h and -h
        assert distance_to_eigenvalue(analysis.problem, 1e-9, point, value) < 1e-6


def distance_to_eigenvalue(problem, kappa, point, sigma):
    """By the eigenvalue of I - G(sigma) K(sigma) next to 0, with dense matrices of all contact dofs and harmonics."""
    nodes, size = len(point.jacobian), 2 * HARMONICS + 1
    harmonics = np.array([0, *np.ravel([(h, -h) for h in range(1, HARMONICS + 1)])])
    every = np.ones(3 * nodes, dtype=bool)
    problem = replace(problem, kappa=kappa, retention_radius=np.inf)  # no pole is condensed
    model = problem.contact_free.condensed(point.omega, every)
    assert (problem.contact_free.harmonics == harmonics).all()

    def smallest(value):
        states = np.linalg.solve(value * np.eye(len(model.state_matrix)) - model.state_matrix, model.input_matrix)
        eye = np.eye(3 * nodes * size)
        receptance = model.output_matrix @ states + (model.flexibility @ eye)
        receptance = receptance + value * (model.flexibility_derivative @ eye)
        jacobian, full = in_harmonics(point.at(value)[0]), np.zeros((size, nodes, 3, size, nodes, 3), dtype=complex)
        for node in range(nodes):
            full[:, node, :, :, node] = jacobian[node].transpose(2, 0, 3, 1)
        values = np.linalg.eigvals(np.eye(len(eye)) - receptance @ full.reshape(len(eye), -1))
        return values[np.argmin(np.abs(values))]

    step = 1e-7
    return abs(smallest(sigma) * step / (smallest(sigma + step) - smallest(sigma)))


@pytest.mark.parametrize("width", [SLICE_WIDTH, WIDTH])
def test_no_eigenvalue_of_the_strip_is_lost_beside_another_one(width):
    """At a border of two slices, and just beyond the strip."""
    true = np.array([-0.0025 + 0.5025j, -0.007 + 0.484j, -0.004 + 0.16j, 0.002 + 0.17j, 0.003, -0.001 + 0.376j])
    found = eigenvalues_by_slices(lambda shift: np.append(true, true[:-2].conj()), width, True)
    for value in true:
        assert np.count_nonzero(np.abs(found - value) < 1e-12) == 1

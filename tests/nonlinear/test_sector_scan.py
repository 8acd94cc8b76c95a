"""Stability of sectors on a disk: the few contact motions that waves share, against all modes of each wave."""

import numpy as np
import pytest
from lumped_disk import sector_with_disk

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.contact.fourier import to_real
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.stability import ring_scan
from nonlinear.stability.eigenproblem import Refined, converged
from nonlinear.stability.floquet import NEUTRAL, FloquetAnalysis
from nonlinear.stability.perturbation_pencils import series
from nonlinear.stability.ring_scan import AxisInterpolation, SectorScan
from nonlinear.stability.ring_stability import MAX_REFINED, SAME_RATE, LinearisedContact, RingStability
from nonlinear.stability.ring_structure import NEGLIGIBLE_DEVIATION, RingStructure, WaveFlexibility
from rom import modal_model
from rom.cyclic.cyclic_symmetry import relative_contact_motion


def problem(n_blades, harmonics, interference, law="two_sliders"):
    """Modes, contact, excitation and options of a lumped sector with two contact nodes."""
    modal = modal_model(sector_with_disk(n_blades), damping_ratio=0.01)
    contact = ContactParameters.shared(
        2, normal_stiffness=6.0, tangential_stiffness=4.2, friction=0.4, interference=interference, law=law
    )
    options = SolverOptions(
        (0.08, 0.3), harmonics=harmonics, stability="folds", detached=False, truncation=False, search="off"
    )
    return modal, contact, Excitation(n_blades // 3, 1.0), options


def nonlinear_points(case):
    """Balance, and all points of the curve in which contacts slip or open."""
    balance, curve = build_harmonic_balance(*case), forced_response(*case)
    found = []
    for index in np.flatnonzero((curve.slipping > 0) | (curve.separating > 0)):
        displacement = to_real(curve.relative_displacement[index])
        jacobian = balance.element.evaluate(displacement).jacobian
        if jacobian.any():
            found.append(LinearisedContact(displacement, jacobian, 2.0 * np.pi * curve.frequency_hz[index]))
    return balance, found


def least_stable(analysis, contact):
    """The largest growth rate of one k in units of omega, all modes; leading eigenvalues are converged."""
    omega, memory = contact.omega, analysis.sampler.memory(contact.displacement)
    eigenproblem = analysis.problem.eigenproblem(contact.jacobian, omega, memory)
    found = []
    for value in analysis.exponents(*contact)[:4] / omega:
        refined = converged(eigenproblem, complex(value)) if value.real > -0.01 else Refined(value)
        found += [] if refined is None else [refined.value.real]
    return max(found, default=-np.inf)


@pytest.mark.parametrize(
    ("n_blades", "harmonics", "interference", "law", "stride"),
    [
        (24, 1, 0.3, "two_sliders", 3),
        (24, 3, -0.5, "two_sliders", 60),
        (24, 3, 0.3, "cone", 6),
        (120, 1, -0.5, "two_sliders", 36),
    ],
)
def test_the_verdict_is_that_of_all_nodal_diameters(n_blades, harmonics, interference, law, stride):
    """Points with friction or lift-off, and for each all k with all modes of their waves."""
    case = problem(n_blades, harmonics, interference, law)
    balance, points = nonlinear_points(case)
    ring = RingStability(FloquetAnalysis.of(balance.receptance, case[1]), n_blades)
    kappas = 2.0 * np.pi / n_blades * np.arange(1, n_blades // 2 + 1)
    single = [FloquetAnalysis.of(balance.receptance, case[1], kappa=kappa) for kappa in kappas]
    assert len(points) > 2 * stride
    for contact in points[::stride]:
        highest = max(least_stable(analysis, contact) for analysis in single)
        spurious = [value for value, _ in ring.approximate(contact) if value.real > highest + 0.02]
        assert len(spurious) <= MAX_REFINED / 3
        found = ring.leading(contact)
        rate = -np.inf if found is None else found.exponent.real / contact.omega
        assert (rate > NEUTRAL) == (highest > NEUTRAL)
        assert rate == pytest.approx(highest, abs=1e-6, rel=2.0 * SAME_RATE)


def test_the_shared_motions_have_the_flexibility_of_every_wave():
    """Against the sum over all modes, near the highest frequency of a perturbation, away from resonances."""
    case = problem(24, 1, 0.0)
    modal, contact = case[:2]
    highest, stiffness = 2.0, np.tile([4.2, 4.2, 6.0], 2)
    waves = WaveFlexibility.of(modal, contact, highest)
    assert waves.shared.shape[1] < 6
    s = np.array([0.9j + 0.05])
    means = series(waves.mean, s, 1.0)[0][0]
    weights = np.sqrt(np.outer(stiffness, stiffness))
    for n in range(24):
        own = modal.at(n)
        motion = relative_contact_motion(own.right, own.left, 2.0 * np.pi * n / 24)
        exact = motion / (s**2 + own.damping * s + own.angular_frequency**2) @ motion.conj().T
        low = 1.0 / (s**2 + waves.damping[n] * s + waves.stiffness[n])
        shared = (waves.motion[n] * low) @ waves.motion[n].conj().T + series(waves.deviation[n], s, 1.0)[0]
        found = means + waves.shared @ shared @ waves.shared.T
        assert np.abs(weights * (found - exact)).max() < 2.0 * NEGLIGIBLE_DEVIATION
        assert np.abs(weights * (found - exact)).max() < 0.05 * np.abs(weights * exact).max()


def test_a_matrix_along_the_axis_from_values_and_derivatives():
    """A matrix with a pole at -2: exact at the nodes, near in between, derivatives in sigma."""
    one, other = np.random.default_rng(1).normal(size=(2, 3, 3))
    known = {c: (one / (2.0 + 1j * c) + 1j * c * other, other - one / (2.0 + 1j * c) ** 2) for c in (0.0, 0.3, -0.3)}
    centres = np.array([0.3, 0.15, -0.45])
    matrix, change = AxisInterpolation(known).at(centres)
    for c, value, slope in zip(centres, matrix, change, strict=True):
        error = 1e-12 if c in known else 1e-3
        assert value == pytest.approx(one / (2.0 + 1j * c) + 1j * c * other, abs=error)
        assert slope == pytest.approx(other - one / (2.0 + 1j * c) ** 2, abs=20.0 * error)


def test_nodal_diameters_in_small_groups_have_the_same_eigenvalues(monkeypatch):
    case = problem(24, 2, -0.5)
    balance, points = nonlinear_points(case)
    analysis = FloquetAnalysis.of(balance.receptance, case[1])
    contact = analysis.point(*points[len(points) // 2])
    found = []
    for size in (ring_scan.AT_ONCE, 1.0):
        monkeypatch.setattr(ring_scan, "AT_ONCE", size)
        found.append(SectorScan(RingStructure(analysis.problem, case[1], 24)).eigenvalues(contact))
    assert {k for _, k in found[0]} == set(range(1, 13))
    one, other = (np.array([value.real for value, _ in values]) for values in found)
    assert one == pytest.approx(other, abs=1e-9)

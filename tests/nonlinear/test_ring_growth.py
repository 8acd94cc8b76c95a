"""Perturbations of all nodal diameters: against each of them alone, against a ring in time, along a branch."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade, oscillator
from ring_map import ring_map

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.branches import growth_along_branch
from nonlinear.contact.fourier import to_real
from nonlinear.continuation.point_stability import PointStability, least_damped_of_ring, least_damped_pole
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.stability.floquet import FloquetAnalysis
from nonlinear.stability.ring_stability import SCAN_ERROR, LinearisedContact, RingStability
from rom import modal_model


def problem(n_blades, order, interference, harmonics, law="two_sliders", friction=0.4, **options):
    """Modes, contact, excitation and options of a lumped blade with one contact node."""
    modal = modal_model(lumped_blade(n_blades, 1), damping_ratio=0.01)
    contact = ContactParameters.shared(
        1,
        normal_stiffness=6.0,
        tangential_stiffness=4.2,
        friction=friction,
        interference=interference,
        law=law,
    )
    values = {"frequency_hz": (0.1, 0.4), "detached": False, "truncation": False, "search": "off"} | options
    return modal, contact, Excitation(order, 1.0), SolverOptions(harmonics=harmonics, **values)


def nonlinear_points(modal, contact, excitation, options, curve, count):
    """Some points in which contacts slip or open, with their balance."""
    balance = build_harmonic_balance(modal, contact, excitation, options)
    found = []
    for index in range(curve.points):
        displacement = to_real(curve.relative_displacement[index])
        jacobian = balance.element.evaluate(displacement).jacobian
        if curve.slipping[index] or (curve.separating[index] and jacobian.any()):
            found.append((index, LinearisedContact(displacement, jacobian, 2.0 * np.pi * curve.frequency_hz[index])))
    return balance, found[:: max(1, len(found) // count)]


@pytest.mark.parametrize(
    ("n_blades", "order", "interference", "harmonics", "law"),
    [
        (12, 5, -0.5, 1, "two_sliders"),
        (12, 6, 0.3, 2, "two_sliders"),
        (5, 1, 0.3, 1, "cone"),
        (3, 1, 0.3, 2, "two_sliders"),
        (2, 1, -0.5, 1, "two_sliders"),
    ],
)
def test_leading_exponent_is_the_largest_of_all_kappas(n_blades, order, interference, harmonics, law):
    """Interpolated matrices and slices of the strip, against each kappa with its own matrices."""
    case = problem(n_blades, order, interference, harmonics, law, stability="folds")
    balance, points = nonlinear_points(*case, forced_response(*case), 5)
    kappas = 2.0 * np.pi / n_blades * np.arange(1, n_blades // 2 + 1)
    single = [FloquetAnalysis.of(balance.receptance, case[1], kappa=kappa) for kappa in kappas]
    ring = RingStability(FloquetAnalysis.of(balance.receptance, case[1]), n_blades)
    assert len(points) >= 4
    for _, contact in points:
        leaders = [analysis.exponents(*contact)[:1] for analysis in single]  # a kappa may have none in the strip
        rates = np.array([row[0].real if row.size else -np.inf for row in leaders]) / contact.omega
        found = ring.leading(contact)
        if found is None:
            assert np.isinf(rates).all()
            continue
        # what decays is refined as far as the sign is in doubt
        assert found.exponent.real / contact.omega == pytest.approx(rates.max(), abs=SCAN_ERROR, rel=0.2)
        assert found.grows(contact.omega) == (rates.max() > 1e-6)
        if found.grows(contact.omega):
            assert found.exponent.real / contact.omega == pytest.approx(rates.max(), abs=1e-6)
            assert rates[found.nodal_diameter - 1] == pytest.approx(rates.max(), abs=1e-6)


def test_opposite_nodal_diameters_have_complex_conjugate_exponents():
    case = problem(12, 5, -0.5, 2, stability="folds")
    balance, points = nonlinear_points(*case, forced_response(*case), 3)
    for _, contact in points:
        one, other = (
            FloquetAnalysis.of(balance.receptance, case[1], kappa=sign * 2.0 * np.pi * 4 / 12).exponents(*contact)
            for sign in (1, -1)
        )
        assert one.size > 1
        assert max(np.abs(other.conj() - value).min() for value in one[:2]) < 1e-8 * contact.omega


def test_a_ring_in_time_leaves_what_only_the_wave_keeps():
    """Five blades: growth and nodal diameter of the perturbation, by the multipliers of the ring in time."""
    n_blades, order = 5, 2
    case = problem(n_blades, order, -4.0, 7, frequency_hz=(0.156, 0.158))
    curve = forced_response(*case)
    wave = forced_response(*case[:3], replace(case[3], stability="wave"))
    assert not wave.growth_nodal_diameter.any()
    lost = np.flatnonzero((curve.growth_nodal_diameter > 0) & (curve.growth_rate > 0.0))
    index = lost[np.argmax(curve.growth_rate[lost])]
    assert not curve.stable[index]
    same = np.argmin(np.abs(wave.arc - curve.arc[index]))
    assert wave.stable[same]
    balance = build_harmonic_balance(*case)
    omega = 2.0 * np.pi * curve.frequency_hz[index]
    unknown = balance.unknown(to_real(curve.relative_displacement[index]))
    ring = ring_map(balance, case[1], omega, n_blades, unknown, steps=500)
    _, jacobian = ring.fixed_point(ring.start)
    assert ring.exponents(jacobian)[0].real == pytest.approx(curve.growth_rate[index], rel=0.06)
    # the vector that grows turns by 2 pi k / N_b from blade to blade, beside the turn of the wave: h psi + kappa
    values, vectors = np.linalg.eig(jacobian)
    shape = vectors[: ring.positions, np.argmax(np.abs(values))].reshape(n_blades, -1)
    content = np.linalg.norm(np.fft.fft(shape, axis=0), axis=1)
    k = curve.growth_nodal_diameter[index]
    allowed = {(h * order + sign * k) % n_blades for h in (0, 1, -1) for sign in (1, -1)}
    assert int(np.argmax(content)) in allowed


@pytest.mark.parametrize(("order", "interference", "harmonics"), [(5, 0.3, 1), (5, -0.5, 1)])
def test_what_is_not_looked_at_is_known_all_the_same(order, interference, harmonics, monkeypatch):
    """A ring of 24: points whose exponents are interpolated, of the wave and of the others, against all computed."""
    case, computed = problem(24, order, interference, harmonics), []
    exponents = PointStability.exponents

    def counted(stability, point):
        computed.append(point)
        return exponents(stability, point)

    monkeypatch.setattr(PointStability, "exponents", counted)
    curve = forced_response(*case)
    sampled = len(computed)
    monkeypatch.setattr(growth_along_branch, "STRIDE", 1)
    monkeypatch.setattr(growth_along_branch, "WAVE_STRIDE", 1)
    full = forced_response(*case)
    assert sampled < 0.8 * (len(computed) - sampled)
    assert (curve.growth_nodal_diameter[~curve.stable] > 0).any()
    same = [int(np.argmin(np.abs(full.arc - arc))) for arc in curve.arc]
    both = np.abs(full.arc[same] - curve.arc) < 1e-9
    assert both.mean() > 0.9
    assert (curve.stable == full.stable[same])[both].all()
    grows = both & (curve.growth_rate > 0.0)
    assert curve.growth_rate[grows] == pytest.approx(full.growth_rate[same][grows], rel=0.25, abs=1e-4)
    decays = both & (curve.growth_rate < 0.0)
    assert curve.growth_rate[decays] == pytest.approx(full.growth_rate[same][decays], rel=0.25)


@pytest.mark.parametrize(("order", "interference", "friction"), [(5, 0.0, 0.1), (9, -0.5, 0.4), (12, -0.2, 0.4)])
def test_the_sign_of_the_growth_of_the_wave_between_points_looked_at(order, interference, friction, monkeypatch):
    """Followed, interpolated or computed: at some points a node opens, or an exponent leaves the strip."""
    case = problem(24, order, interference, 3, friction=friction, stability="wave")
    curve = forced_response(*case)
    monkeypatch.setattr(growth_along_branch, "WAVE_STRIDE", 1)
    full = forced_response(*case)
    same = [int(np.argmin(np.abs(full.arc - arc))) for arc in curve.arc]
    both = np.abs(full.arc[same] - curve.arc) < 1e-9
    assert both.mean() > 0.9
    assert (curve.stable == full.stable[same])[both].all()
    assert 20 < np.count_nonzero(~curve.stable[both]) < 0.9 * np.count_nonzero(both)


def test_bifurcations_name_the_nodal_diameter():
    """The motion becomes unstable where the perturbation of that nodal diameter begins to grow."""
    case = problem(24, 5, -0.5, 1)
    curve = forced_response(*case)
    others = [item for item in curve.bifurcations if item.nodal_diameter > 0]
    assert len(others) >= 2
    balance, checked = build_harmonic_balance(*case), 0
    for item in others:
        assert curve.stable[item.index - 1] != curve.stable[item.index + 1]
        displacement, omega = to_real(curve.relative_displacement[item.index]), 2.0 * np.pi * item.frequency_hz
        kappa = 2.0 * np.pi * item.nodal_diameter / 24
        analysis = FloquetAnalysis.of(balance.receptance, case[1], kappa=kappa)
        exponents = analysis.exponents(displacement, balance.element.evaluate(displacement).jacobian, omega)
        if exponents.size:  # at low frequency, more harmonics than those of the motion are needed
            checked += 1
            assert np.abs(exponents.real).min() < 5e-4 * omega
    assert checked >= 2


def test_least_damped_pole_of_the_ring():
    """Over all nodal diameters, with damping that differs from mode to mode."""
    modal = modal_model(lumped_blade(40), damping_ratio=[0.02, 0.03, 0.001, 0.05])
    springs = np.array([[4.0, 4.0, 6.0], [0.0, 0.0, 6.0]])
    pole, n = least_damped_of_ring(modal, springs)
    poles = [least_damped_pole(modal, 2.0 * np.pi * k / 40, springs) for k in range(21)]
    assert pole.real == pytest.approx(max(value.real for value in poles), rel=1e-9)
    assert pole == poles[n]


@pytest.mark.parametrize("stability", ["ring", "wave", "folds"])
@pytest.mark.parametrize("n_blades", [1, None])
def test_a_single_blade_has_no_other_nodal_diameter(n_blades, stability):
    modal = modal_model(oscillator(n_blades=n_blades), damping_ratio=0.01)
    contact = ContactParameters.shared(
        1, normal_stiffness=0.0, tangential_stiffness=1.0, friction=1.0, preload=1.0, interference=0.0
    )
    options = SolverOptions((0.1, 0.4), stability=stability, detached=False, truncation=False, search="off")
    curve = forced_response(modal, contact, Excitation(0, 2.0), options)
    assert curve.slipping.any()
    assert (curve.growth_nodal_diameter == (-1 if stability == "folds" else 0)).all()


@pytest.mark.parametrize("interference", [-1e3, 1e3])
def test_neutral_exponents_do_not_grow(interference):
    """Without damping every exponent of open and of stuck contacts is neutral."""
    modal = modal_model(lumped_blade(12, 1), rayleigh=(1e-14, 0.0))
    contact = ContactParameters.shared(
        1, normal_stiffness=6.0, tangential_stiffness=4.2, friction=0.4, interference=interference
    )
    options = SolverOptions((0.1, 0.13), detached=False, truncation=False, search="off")
    curve = forced_response(modal, contact, Excitation(5, 1.0), options)
    assert curve.stable.all()
    assert np.abs(curve.growth_rate).max() < 1e-6 * 2.0 * np.pi * 0.1

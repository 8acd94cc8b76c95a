"""Several contact interfaces in one model, against all blades of the ring in one structure, and in time."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade
from scipy.linalg import block_diag

from nonlinear import ContactError, ContactParameters, Excitation, SolverOptions
from nonlinear.continuation.linear_segments import LinearSegments
from nonlinear.continuation.solution_point import LinearState
from nonlinear.harmonic_balance.initial_solution import periodic_start
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.stability.eigenproblem import converged
from nonlinear.stability.floquet import FloquetAnalysis
from nonlinear.stability.ring_stability import LinearisedContact, RingStability
from nonlinear.time_integration.ring import Ring
from nonlinear.time_integration.ring_integrator import RingIntegrator
from rom import (
    ContactInterface,
    ReducedModelError,
    modal_model,
    read_reduced_model,
    with_interfaces,
    write_reduced_model,
)
from rom.cyclic.reduced_model import interfaces_of

N, HARMONICS, OMEGA = 4, 2, 1.6  # the 512 instants at which events of sliders are sampled are those of all 4 blades
BLADE = lumped_blade(N)
RIGHT, LEFT, PLACE = BLADE.contact_right, BLADE.contact_left, BLADE.contact_position
TIP = np.eye(3, BLADE.size)
SHROUD = ContactInterface(RIGHT, PLACE, LEFT)  # two nodes between neighbours
DAMPER = ContactInterface(RIGHT[3:], PLACE[:1], LEFT[:3], inside=True)  # a node inside a sector
STOP = ContactInterface(TIP, PLACE[:1])  # a node against the ground
MODEL = with_interfaces(BLADE, SHROUD, DAMPER, STOP)


def interface(nodes, stiffness, interference, friction=0.4):
    return ContactParameters.shared(
        nodes,
        normal_stiffness=stiffness,
        tangential_stiffness=0.7 * stiffness,
        friction=friction,
        interference=interference,
    )


CONTACT = ContactParameters.joined(interface(2, 6.0, 0.1), interface(1, 2.0, 0.6), interface(1, 1.0, -0.3, 0.2))


def whole_ring():
    """All blades of the ring and their contacts as one structure: each pair of nodes is one against the ground."""
    every = np.eye(N)
    rows = [
        np.concatenate(
            [
                np.kron(every[j], RIGHT) - np.kron(every[(j + 1) % N], LEFT),
                np.kron(every[j], RIGHT[3:] - LEFT[:3]),
                np.kron(every[j], TIP),
            ]
        )
        for j in range(N)
    ]
    wave = np.exp(2j * np.pi * np.arange(N) / N)
    ring = replace(
        BLADE,
        mass=np.kron(every, BLADE.mass),
        stiffness=np.kron(every, BLADE.stiffness),
        contact_right=np.concatenate(rows),
        contact_left=None,
        contact_position=np.tile(MODEL.contact_position, (N, 1)),
        force_excitation=np.kron(wave, BLADE.force_excitation),
        force_static=None,
        outputs={"tip": np.kron(every[0], BLADE.outputs["tip"])},
        n_blades=None,
    )
    return modal_model(ring, damping_ratio=0.02), ContactParameters.joined(*[CONTACT] * N), Excitation(1, 1.0)


def solved(problem, harmonics=HARMONICS, integration="exact"):
    """The balance and its solution from rest."""
    options = SolverOptions((0.1, 0.8), harmonics=harmonics, integration=integration)
    balance = build_harmonic_balance(*problem, options)
    start = periodic_start(balance, OMEGA, np.zeros((balance.n_contacts, 3)), options)
    assert start.converged
    return balance, balance.displacement(start.solution)


@pytest.fixture(scope="module")
def wave():
    problem = modal_model(MODEL, damping_ratio=0.02), CONTACT, Excitation(1, 1.0)
    return problem, *solved(problem)


def test_the_wave_is_that_of_the_whole_ring(wave):
    _, balance, displacement = wave
    _, every = solved(whole_ring())
    assert set(balance.forces(balance.unknown(displacement)).state.tolist()) == {0, 1, 2}  # stick, slip, lift-off
    assert every[:, :4] == pytest.approx(displacement, abs=1e-9)
    for h in range(1, HARMONICS + 1):
        own = displacement[2 * h - 1] + 1j * displacement[2 * h]
        second = every[2 * h - 1, 4:8] + 1j * every[2 * h, 4:8]
        assert second == pytest.approx(own * np.exp(2j * np.pi * h / N), abs=1e-9)


def test_stuck_contacts_are_the_same_springs(wave):
    (_, contact, _), balance, _ = wave
    ring = whole_ring()
    whole = build_harmonic_balance(*ring, SolverOptions((0.1, 0.8), harmonics=HARMONICS))
    one, every = (
        LinearSegments(each, parameters).uniform()[1].motion(OMEGA).displacement
        for each, parameters in ((balance, contact), (whole, ring[1]))
    )
    assert every[:, :4] == pytest.approx(one, abs=1e-12)


def test_exponents_of_all_nodal_diameters_are_those_of_the_whole_ring(wave):
    """All poles retained: the leading one of each nodal diameter; then the same from the scan in few modes."""
    (_, contact, _), balance, displacement = wave
    ring = whole_ring()
    whole, every = solved(ring)
    jacobian = balance.element.evaluate(displacement).jacobian
    of_ring = eigenproblem(whole, ring[1], every, 0.0)
    leading = []
    for k in range(N):
        problem = eigenproblem(balance, contact, displacement, 2.0 * np.pi * k / N)
        values = problem.eigenvalues(0.2j)
        values = values[np.abs(values.imag - 0.2) < 0.25]
        refined = converged(problem, values[np.argmax(values.real)])
        again = converged(of_ring, refined.value)
        assert again.value == pytest.approx(refined.value, abs=1e-7)
        leading.append(refined.value.real)
    analysis = FloquetAnalysis.of(balance.receptance, contact)
    worst = RingStability(analysis, N).leading(LinearisedContact(displacement, jacobian, OMEGA))
    assert worst.exponent.real / OMEGA == pytest.approx(max(leading[1:]), abs=1e-3)


def eigenproblem(balance, contact, displacement, kappa):
    """The perturbations of a solution with all poles."""
    analysis = FloquetAnalysis.of(balance.receptance, contact, kappa=kappa)
    jacobian = balance.element.evaluate(displacement).jacobian
    problem = replace(analysis.problem, retention_radius=np.inf)
    return problem.eigenproblem(jacobian, OMEGA, analysis.sampler.memory(displacement))


def test_the_ring_in_time_stays_on_the_wave(wave):
    problem = wave[0]
    _, displacement = solved(problem, 11)
    integrator = RingIntegrator.of(Ring(*problem), OMEGA, retention=200.0)
    balanced = integrator.wave_output(displacement)
    integrated = integrator.march(integrator.on_wave(displacement), 20).output_m[-1]
    assert integrated == pytest.approx(balanced, abs=2e-3 * np.abs(balanced).max())


def test_interfaces_keep_their_names_and_rows_in_a_file(tmp_path):
    named = with_interfaces(BLADE, replace(SHROUD, name="shroud"), replace(DAMPER, name="damper"), STOP)
    write_reduced_model(tmp_path / "rom.h5", named)
    read = read_reduced_model(tmp_path / "rom.h5")
    assert read.interfaces == {"shroud": 2, "damper": 1, "interface 3": 1}
    again = with_interfaces(BLADE, *interfaces_of(read))
    assert np.array_equal(again.contact_right, named.contact_right)
    assert np.array_equal(again.contact_left, named.contact_left)
    assert BLADE.interfaces == {"shroud": 2}  # of a model that names none


def test_interfaces_that_do_not_fit_are_refused():
    with pytest.raises(ReducedModelError, match="a name of its own"):
        with_interfaces(BLADE, replace(STOP, name="stop"), replace(STOP, name="stop"))
    with pytest.raises(ReducedModelError, match="contact/interfaces"):
        replace(MODEL, interfaces={"shroud": 2, "stop": 1})
    with pytest.raises(ReducedModelError, match="right: shape"):
        with_interfaces(BLADE, replace(STOP, right=TIP[:2]))
    with pytest.raises(ContactError, match="one for each of 4 nodes"):
        replace(CONTACT, law=("cone", "two_sliders"))


LAWS = "cone", "two_sliders"
HALVES = slice(0, 2), slice(2, 4)  # nodes under each
OTHER = replace(BLADE, stiffness=1.3 * BLADE.stiffness)


def under_two_laws():
    """Each blade with a law of its own, and both in one sector: nothing but the sector joins them."""
    alone = [
        (modal_model(blade, damping_ratio=0.02), replace(interface(2, stiffness, 0.1), law=law), Excitation(1, 1.0))
        for blade, stiffness, law in zip((BLADE, OTHER), (6.0, 5.0), LAWS, strict=True)
    ]

    def joined(name):
        return block_diag(*(getattr(blade, name) for blade in (BLADE, OTHER)))

    sector = replace(
        BLADE,
        mass=joined("mass"),
        stiffness=joined("stiffness"),
        contact_right=joined("contact_right"),
        contact_left=joined("contact_left"),
        contact_position=np.tile(PLACE, (2, 1)),
        force_excitation=np.tile(BLADE.force_excitation, 2),
        force_static=None,
        outputs={"tip": np.tile(BLADE.outputs["tip"], 2)},
    )
    contact = ContactParameters.joined(*(each[1] for each in alone))
    return alone, (modal_model(sector, damping_ratio=0.02), contact, Excitation(1, 1.0))


@pytest.mark.parametrize("integration", ["exact", "sampled"])
def test_two_laws_that_nothing_joins_are_each_its_own(integration):
    """The balance and its forces, its linear states, and the growth rates of all nodal diameters."""
    alone, both = under_two_laws()
    balance, displacement = solved(both, integration=integration)
    parts = [solved(each, integration=integration) for each in alone]
    assert both[1].laws == (LAWS[0],) * 2 + (LAWS[1],) * 2
    assert displacement == pytest.approx(np.concatenate([motion for _, motion in parts], axis=1), abs=1e-9)
    assert set(balance.forces_of(displacement).state[:2]) | set(balance.forces_of(displacement).state[2:]) == {1, 2}
    every = np.array([True, False, True, False])
    state = LinearState(every)
    whole = LinearSegments(balance, both[1]).system(state)
    own = [
        LinearSegments(each, problem[1]).system(LinearState(every[:2]))
        for (each, _), problem in zip(parts, alone, strict=True)
    ]
    moved = 1e-3 * np.random.default_rng(2).normal(size=displacement.shape)
    assert whole.margin(moved) == pytest.approx(
        min(one.margin(moved[:, part]) for one, part in zip(own, HALVES, strict=True))
    )
    assert whole.moved(moved).sum() == sum(
        one.moved(moved[:, part]).sum() for one, part in zip(own, HALVES, strict=True)
    )
    for k in range(N):
        kappa = 2.0 * np.pi * k / N
        problem = eigenproblem(balance, both[1], displacement, kappa)
        for (each, motion), (_, contact, _) in zip(parts, alone, strict=True):
            separate = eigenproblem(each, contact, motion, kappa)
            values = separate.eigenvalues(0.2j)
            values = values[np.abs(values.imag - 0.2) < 0.25]
            refined = converged(separate, values[np.argmax(values.real)])
            assert converged(problem, refined.value).value == pytest.approx(refined.value, abs=1e-7)


def test_two_laws_in_time_are_each_its_own():
    alone, both = under_two_laws()

    def period(problem):
        integrator = RingIntegrator.of(Ring(*problem), OMEGA, retention=200.0)
        output = integrator.march(integrator.on_wave(solved(problem)[1]), 2).output_m[-1]
        instants = np.arange(len(output)) / len(output)
        return np.array([np.interp(np.linspace(0.0, 0.9, 40), instants, blade) for blade in output.T])

    together, apart = period(both), [period(each) for each in alone]
    assert together == pytest.approx(sum(apart), abs=1e-3 * np.abs(together).max())

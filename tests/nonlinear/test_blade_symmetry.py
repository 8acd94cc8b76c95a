"""The same properties on a meshed blade: mirror image in the shroud angle, backward wave, homogeneity."""

from functools import lru_cache

import numpy as np
import pytest

from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from rom import Material, ReductionOptions, assemble, modal_model, reduce_sector


@lru_cache(maxsize=4)
def modes(angle, twist):
    blade = BladeParameters(n_blades=72, hub_radius=0.30, length=0.15, chord=0.036, thickness=0.009, twist=twist)
    shroud = ShroudParameters(angle=angle, thickness=0.005, axial_width=0.040, contact_length=0.012)
    sector = build_sector(blade, shroud, MeshParameters(size=0.007))
    full = assemble(sector, Material(210e9, 0.3, 7850.0))
    return modal_model(
        reduce_sector(full, sector, ReductionOptions(modes=10, store_basis=False)).model, damping_ratio=0.003
    )


def solve(angle, twist, engine_order, interference=2e-6, force=1.0):
    contact = ContactParameters.shared(
        9, normal_stiffness=2e5, tangential_stiffness=1.5e5, friction=0.4, interference=interference
    )
    modal = modes(angle, twist)
    free = modal.angular_frequency[0] / (2.0 * np.pi)
    options = SolverOptions(
        (0.8 * free, 2.2 * free),
        harmonics=3,
        detached=False,
        stability="wave",
        truncation=False,
        search="off",
    )
    return forced_response(modal, contact, Excitation(engine_order, force), options)


def test_mirror_image_in_the_shroud_angle():
    one, mirrored = solve(70.0, 15.0, 24), solve(110.0, -15.0, 24)
    assert one.termination.complete
    assert one.peak.located
    assert np.max(one.slipping + one.separating) > 0
    assert mirrored.peak.frequency_hz == pytest.approx(one.peak.frequency_hz, rel=1e-6)
    assert mirrored.peak.amplitude_m == pytest.approx(one.peak.amplitude_m, rel=1e-6)
    assert mirrored.dissipated_j.max() == pytest.approx(one.dissipated_j.max(), rel=0.05)


def test_backward_wave():
    forward, backward = solve(70.0, 15.0, 20), solve(70.0, 15.0, 52)
    assert backward.peak.frequency_hz == pytest.approx(forward.peak.frequency_hz, rel=1e-6)
    assert backward.peak.amplitude_m == pytest.approx(forward.peak.amplitude_m, rel=1e-6)


def test_scales_with_force_and_interference_together():
    one, scaled = solve(70.0, 15.0, 24), solve(70.0, 15.0, 24, interference=2e-8, force=0.01)
    assert scaled.points == one.points
    assert scaled.amplitude_m == pytest.approx(0.01 * one.amplitude_m, rel=1e-7)


def test_energy_balance_on_the_blade():
    for interference in (-20e-6, 0.0, 5e-6, 1e-3):
        curve = solve(70.0, 15.0, 36, interference=interference)
        assert curve.termination.complete
        assert curve.energy_error.max() < 1e-8

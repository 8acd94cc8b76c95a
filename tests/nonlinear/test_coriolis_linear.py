"""Small Coriolis forces, and Coriolis forces with linear contacts."""

from dataclasses import replace

import numpy as np
import pytest
from test_floating_bodies import sector
from turning import SPEED, turning

from nonlinear import SolverOptions, forced_response
from rom import linear_response, modal_model

N, EO = 12, 2
OPTIONS = SolverOptions((0.05, 0.3), harmonics=1, stability="folds", search="off", detached=False, truncation=False)


def test_small_coriolis_forces_change_little_where_contacts_alone_hold_a_body():
    model, contact, excitation = sector("two_sliders")
    skew = np.random.default_rng(3).normal(size=(model.size, model.size))
    root = np.sqrt(np.diag(model.mass))
    model = replace(
        model,
        coriolis=1e-8 * (skew - skew.T) * np.outer(root, root),
        speed_rpm=1.0,
        force_centrifugal=np.zeros(model.size),
    )
    options = replace(OPTIONS, frequency_hz=(0.1, 0.4))
    curve, without = (
        forced_response(modal_model(model, damping_ratio=0.02, coriolis=acts), contact, excitation, options)
        for acts in (True, False)
    )
    assert curve.termination.complete
    assert curve.peak.amplitude_m == pytest.approx(without.peak.amplitude_m, rel=1e-6)
    assert curve.amplitude_m[[0, -1]] == pytest.approx(without.amplitude_m[[0, -1]], rel=1e-6)


@pytest.mark.parametrize("disk", [False, True], ids=["blade", "disk"])
def test_linear_contacts_with_coriolis_forces(disk):
    """(K + B^H k B - x^2 M + i x (C + W G)) q = f of the wave, in reduced coordinates."""
    model, phase = turning(N, disk), 2.0 * np.pi * EO / N
    modal = modal_model(model, damping_ratio=0.01, coriolis=True)
    own, wave = modal.at(EO), model.wave(phase) if disk else np.eye(model.size)
    mass, stiffness, skew = (wave.conj().T @ part @ wave for part in (model.mass, model.stiffness, model.coriolis))
    inertia = mass @ np.linalg.lstsq(wave, own.shapes, rcond=None)[0]
    damping = inertia @ np.diag(own.damping) @ inertia.conj().T + SPEED * skew
    relative = (model.contact_right - np.exp(1j * phase) * model.contact_left) @ wave
    held = relative.conj().T @ (np.tile([2.0, 2.0, 3.0], 2)[:, None] * relative)
    hertz = [0.1, 0.13]
    found = linear_response(modal, hertz, phase=phase, force=1.0, normal=3.0, tangential=2.0)
    for value, x in zip(found, 2.0 * np.pi * np.array(hertz), strict=True):
        dynamic = stiffness + held - x**2 * mass + 1j * x * damping
        moved = np.linalg.solve(dynamic, wave.conj().T @ model.force_excitation)
        assert value == pytest.approx(model.outputs["tip"] @ wave @ moved, rel=1e-9)

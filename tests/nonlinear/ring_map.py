"""The map of a ring of blades over one period with all its modes: an independent check of stability."""

import numpy as np
from period_map import PeriodMap

from nonlinear import Excitation
from nonlinear.time_integration.ring import RetainedModes, Ring
from nonlinear.time_integration.ring_integrator import RingIntegrator


def ring_map(balance, contact, omega, n_blades, unknown, steps=1000):
    """The map near the wave that solves the balance; `steps` a period."""
    receptance = balance.receptance
    engine_order = round(receptance.phase * (receptance.modal.n_blades or 1) / (2.0 * np.pi))
    ring = Ring(receptance.modal, contact, Excitation(engine_order, receptance.force))
    integrator = RingIntegrator(ring, omega, n_blades, steps, RetainedModes(ring, np.inf))
    return PeriodMap(integrator, integrator.on_wave(balance.displacement(unknown)))

"""Energy balance of a ring of blades over one period of its time integration: a check of the integration."""

from dataclasses import dataclass

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.time_integration.ring import RingState
from nonlinear.time_integration.ring_integrator import RingIntegrator


@dataclass(frozen=True)
class RingEnergy:
    """Work and energy of all blades over one period, J."""

    excitation: float  # work of the excitation and of the static forces
    # work dissipated by structural damping; that of the residual flexibility under contact forces is neglected
    damping: float
    contact: float  # work done on the contacts: friction, and the elastic energy that is left in them
    stored: float  # change of the kinetic and elastic energy of the blades

    @property
    def error(self) -> float:
        """Mismatch relative to the largest of the four."""
        largest = max(abs(self.excitation), abs(self.damping), abs(self.contact), abs(self.stored))
        mismatch = self.excitation - self.damping - self.contact - self.stored
        return abs(mismatch) / largest if largest > 0.0 else 0.0


def energy_balance(integrator: RingIntegrator, start: RingState) -> RingEnergy:
    """Integrate one period and balance its energy."""
    structure = integrator.structure
    states, _ = integrator.history(start)
    states = [start, *states]
    coordinates = np.array([state.coordinates for state in states])
    change = np.diff(coordinates, axis=0)
    motion = structure.motion(coordinates)
    force = np.array([state.force.reshape(integrator.n_blades, -1) for state in states])
    theta = 2.0 * np.pi * np.arange(len(states)) / integrator.steps
    angle = theta[:, None] + integrator.ring.phase * np.arange(integrator.n_blades)
    excited = integrator.ring.excited
    turns = np.exp(1j * angle[:, :, None] * np.asarray(excited.harmonics))
    external = np.zeros(coordinates.shape)
    external[:, :, : excited.modal_force.shape[1]] = (turns @ excited.modal_force).real
    step = integrator.period / integrator.steps
    free = np.diff(np.array([integrator.contact_free(angle)[0] for angle in theta]), axis=0)
    damped = structure.scaled(change, structure.retained) + structure.scaled(free, ~structure.retained)
    return RingEnergy(
        excitation=float((_means(external) * change).sum()),
        damping=float((damped * structure.scaled(damped, structure.damping)).sum() / step),
        contact=float(-(_means(force) * np.diff(motion, axis=0)).sum()),
        stored=_stored(integrator, states[-1]) - _stored(integrator, states[0]),
    )


def _means(values: Array) -> Array:
    """Means over the steps of values at their ends."""
    return 0.5 * (values[1:] + values[:-1])


def _stored(integrator: RingIntegrator, state: RingState) -> float:
    """Kinetic and elastic energy of the blades; modes that are not integrated have no kinetic energy."""
    structure = integrator.structure
    rates = structure.scaled(state.rates, structure.retained)
    elastic = structure.scaled(state.coordinates, structure.angular_frequency)
    return float(0.5 * (rates**2).sum() + 0.5 * (elastic**2).sum())

"""Time integration of a whole ring of blades: an independent check of the balance under cyclic symmetry.

Every blade in its own modal coordinates, every contact with its own sliders, marched in time. The linear part is
advanced exactly under forces that vary linearly over a step, so the error is of second order in the step.
"""

import numpy as np
from numba import njit


def transition(frequency, damping, step):
    """Coefficients of eta'' + c eta' + w^2 eta = a + b t over one step: state' = A state + B f0 + C f1."""
    from scipy.linalg import expm

    size = frequency.size
    matrices = np.empty((size, 2, 4))
    for mode in range(size):
        generator = np.zeros((4, 4))  # state eta, eta', force, force slope
        generator[0, 1] = generator[1, 2] = generator[2, 3] = 1.0
        generator[1, 0], generator[1, 1] = -(frequency[mode] ** 2), -damping[mode]
        full = expm(generator * step)
        matrices[mode, :, :2] = full[:2, :2]
        matrices[mode, :, 3] = full[:2, 3] / step  # coefficient of f1
        matrices[mode, :, 2] = full[:2, 2] - full[:2, 3] / step  # coefficient of f0
    return matrices


@njit
def march_ring(matrices, right, left, external, laws, coupled, eta, rate, slider, n_steps, tip):
    """March `n_steps`; external (period steps, blades, modes); returns the tip motion of blade 0, (n_steps + 1,)."""
    kn, kt, mu, v0 = laws
    n_blades, n_modes = eta.shape
    n_rows = right.shape[0]
    period = external.shape[0]
    motion = np.zeros(n_steps + 1)
    total = np.zeros((n_blades, n_modes))
    trial, trial_rate = eta.copy(), rate.copy()
    placed = slider.copy()
    for step in range(n_steps + 1):
        after = step % period
        for _iteration in range(1 if step == 0 else 4):
            # contact forces at the trial state
            force = external[after].copy()
            for blade in range(n_blades):
                neighbour = (blade + 1) % n_blades
                d = right @ trial[blade] - left @ trial[neighbour]
                f = np.zeros(n_rows)
                for node in range(n_rows // 3):
                    load = max(kn[node] * (v0[node] + d[3 * node + 2]), 0.0)
                    f[3 * node + 2] = -load
                    reach = mu[node] * load / kt[node]
                    over = 0.0
                    if coupled:
                        stretch = d[3 * node : 3 * node + 2] - slider[blade, node]
                        far = np.sqrt(stretch[0] ** 2 + stretch[1] ** 2)
                        over = max(1.0 - reach / far, 0.0) if far > 0.0 else 0.0
                    for a in range(2):
                        w = slider[blade, node, a]
                        if coupled:  # drawn towards d up to the circle
                            w += over * stretch[a]
                        else:
                            w = min(max(w, d[3 * node + a] - reach), d[3 * node + a] + reach)
                        placed[blade, node, a] = w
                        f[3 * node + a] = -kt[node] * (d[3 * node + a] - w)
                force[blade] += right.T @ f
                force[neighbour] -= left.T @ f
            if step > 0:
                for blade in range(n_blades):
                    for m in range(n_modes):
                        known = matrices[m, :, 0] * eta[blade, m] + matrices[m, :, 1] * rate[blade, m]
                        both = known + matrices[m, :, 2] * total[blade, m] + matrices[m, :, 3] * force[blade, m]
                        trial[blade, m], trial_rate[blade, m] = both[0], both[1]
        total = force
        eta, rate = trial.copy(), trial_rate.copy()
        slider = placed.copy()
        motion[step] = tip @ eta[0]
    return motion


def integrate_ring(modal, contact, point, *, engine_order, force, periods, steps_per_period):
    """Tip motion of blade 0 over the last period, started from a harmonic balance solution.

    `point`: (omega, modal coefficients (H+1, m), d^(h) (H+1, n_c, 3)) of that solution.
    """
    from nonlinear import contact_cycle

    omega, coordinates, displacement = point
    n_blades, psi = modal.n_blades, modal.phase(engine_order)
    order = np.arange(coordinates.shape[0])
    phases = np.exp(1j * np.outer(np.arange(n_blades) * psi, order))  # blade j: exp(i h j psi)
    eta = np.einsum("jh,hm->jm", phases, coordinates).real
    rate = np.einsum("jh,h,hm->jm", phases, 1j * order * omega, coordinates).real
    slider = np.zeros((n_blades, contact.n_contacts, 2))
    for blade in range(n_blades):
        cycle = contact_cycle(displacement * phases[blade][:, None, None], contact, samples=4096)
        slider[blade] = cycle.displacement[0, :, :2] - cycle.force[0, :, :2] / contact.tangential_stiffness[:, None]
    theta = 2.0 * np.pi * np.arange(steps_per_period) / steps_per_period
    wave = np.cos(theta[:, None] + psi * np.arange(n_blades))
    external = wave[:, :, None] * (force * modal.force)
    laws = (contact.normal_stiffness, contact.tangential_stiffness, contact.friction, contact.interference)
    step = 2.0 * np.pi / omega / steps_per_period
    matrices = transition(modal.angular_frequency, modal.damping, step)
    motion = march_ring(
        matrices,
        np.ascontiguousarray(modal.right),
        np.ascontiguousarray(modal.left),
        external,
        laws,
        contact.law == "cone",
        eta,
        rate,
        slider,
        periods * steps_per_period,
        modal.outputs["tip"],
    )
    return motion[-steps_per_period:]

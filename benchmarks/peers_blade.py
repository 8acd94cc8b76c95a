"""A problem of the size of a shrouded blade for the comparison with peers: the default blade as they can take it.

With engine order N_b / 2 neighbours vibrate in opposite directions, and the relative displacement of the contact
faces, right plus left, is real. With that in place of the displacement of the right nodes the blade stands against
ground in its contacts, as the peers' problem does: 9 nodes, their normal loads about a preload in equilibrium. It is
the blade in its ring while all is linear; beyond that it is a problem of its size, since its static displacement
changes its sign from blade to blade too.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

MODES = 21  # with the displacements of contacts and tip a multiple of 3
LENGTH, FORCE, HERTZ = 1e-5, 0.2, 400.0  # units: metres, newtons; w = 1 is 400 Hz
DAMPING_RATIO, FRICTION = 0.003, 0.4
LOADS = (4e-6, 5e-6, 6e-6)  # preloads of the contacts in turn, as interferences in metres
SPAN = (0.9, 1.2)  # round the resonance of the slipping contacts


def write_blade(target: Path, scene_file: Path, store: Path) -> None:
    """Write matrices, contacts and force as `peers_programs.Problem` reads them."""
    from problems import cached_model, curve_problem, scene_with

    from rom import read_reduced_model

    scene = scene_with(scene_file, {"rom.modes": MODES, "rom.contact_dofs": "nodal"})
    file = cached_model(store, scene)
    model, contact = read_reduced_model(file, with_basis=False), curve_problem(file, scene).contact
    contacts, size = model.n_contacts, model.size
    change = relative_coordinates(model)
    mass, stiffness = (change.T @ matrix @ change for matrix in (model.mass, model.stiffness))
    place = int(np.flatnonzero(model.force_excitation)[0])  # a unit load on one dof of the tip
    normal, tangential = contact.normal_stiffness, contact.tangential_stiffness
    omega, per_length = 2.0 * np.pi * HERTZ, LENGTH / FORCE
    arrays: dict[str, Any] = {
        "mass": mass * per_length * omega**2,
        "stiffness": stiffness * per_length,
        "damping": 2.0 * DAMPING_RATIO,  # C = 2 zeta / w_1 K with w_1 = 1
        "contacts": np.arange(contacts),
        "forces": np.array([[place // 3, place % 3, 1.0]]),
        "output": np.array([place // 3, place % 3]),
        "normal": normal * per_length,
        "tangential": tangential * per_length,
        "friction": np.full(contacts, FRICTION),
        "load": normal * np.resize(LOADS, contacts) / FORCE,
        "span": np.array(SPAN),
    }
    assert size % 3 == 0
    target.parent.mkdir(parents=True, exist_ok=True)
    np.savez(target, **arrays)


def relative_coordinates(model: Any) -> np.ndarray:
    """q = T z: in z the relative displacement (t1, t2, -n) stands where q has that of the right nodes."""
    count = 3 * model.n_contacts
    change = np.eye(model.size)
    change[:count] = -model.contact_left  # q_R = d - q_L: neighbours move in opposite directions
    change[:count, :count] = np.diag(np.tile([1.0, 1.0, -1.0], model.n_contacts))
    return change

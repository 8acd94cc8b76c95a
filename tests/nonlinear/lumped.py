"""Small blades without a mesh: models for tests that must not depend on geometry or finite elements."""

import numpy as np

from rom import ReducedModel

# Rows of the left contact motion under a half turn about the stacking axis: t1 and n change sign, t2 does not.
HALF_TURN = np.array([-1.0, 1.0, -1.0])


def lumped_blade(n_blades: int | None = 12, n_contacts: int = 2, seed: int = 7) -> ReducedModel:
    """A tip mass (x, y, z) on springs with light contact nodes on both sides, symmetric under a half turn.

    Unit-size numbers: tip frequencies near 1 rad/s, contact nodes on springs of 40 N/m.
    """
    rng = np.random.default_rng(seed)
    tip_stiffness = np.diag([3.0, 1.0, 20.0])  # diagonal in x, y, z: a half turn leaves it
    size = 3 + 6 * n_contacts
    stiffness = np.zeros((size, size))
    stiffness[:3, :3] = tip_stiffness
    angle = np.deg2rad(60.0)
    frame = np.array([[np.cos(angle), np.sin(angle), 0.0], [0.0, 0.0, 1.0], [-np.sin(angle), np.cos(angle), 0.0]])
    turn = np.diag([-1.0, -1.0, 1.0])
    positions = rng.normal(size=(n_contacts, 3))
    for node in range(n_contacts):
        root = rng.normal(size=(3, 3))
        spring = 40.0 * np.eye(3) + 4.0 * (root + root.T)
        rows = slice(3 + 3 * node, 6 + 3 * node)
        add_spring(stiffness, rows, frame, spring)
        # The left node is the right one turned by pi: its spring in its own (unturned) frame changes accordingly.
        mirror = np.diag(HALF_TURN)
        rows = slice(3 + 3 * (n_contacts + node), 6 + 3 * (n_contacts + node))
        add_spring(stiffness, rows, mirror @ frame @ turn, mirror @ spring @ mirror)
    mass = np.diag(np.r_[np.ones(3), np.full(6 * n_contacts, 0.01)])
    select = np.eye(size)
    force = np.zeros(size)
    force[1] = 1.0
    return ReducedModel(
        mass=mass,
        stiffness=stiffness,
        contact_right=select[3 : 3 + 3 * n_contacts],
        contact_left=select[3 + 3 * n_contacts :],
        contact_position=positions,
        force_excitation=force,
        outputs={"tip": force.copy()},
        force_static=np.zeros(size),
        n_blades=n_blades,
        producer="test",
    )


def add_spring(stiffness: np.ndarray, rows: slice, frame: np.ndarray, spring: np.ndarray) -> None:
    """Join the tip (x, y, z in rows 0..2) and a contact node, in contact coordinates in `rows`, by a 3 x 3 spring."""
    stiffness[rows, rows] += spring
    stiffness[:3, :3] += frame.T @ spring @ frame
    stiffness[rows, :3] -= spring @ frame
    stiffness[:3, rows] -= frame.T @ spring


def oscillator(
    mass: float = 1.0, stiffness: float = 1.0, tangential: bool = True, n_blades: int | None = None
) -> ReducedModel:
    """One degree of freedom against ground: along t1 (`tangential`) or along n, on one contact node."""
    right = np.zeros((3, 1))
    right[0 if tangential else 2, 0] = 1.0
    return ReducedModel(
        mass=np.array([[mass]]),
        stiffness=np.array([[stiffness]]),
        contact_right=right,
        contact_position=np.zeros((1, 3)),
        force_excitation=np.ones(1),
        outputs={"tip": np.ones(1)},
        n_blades=n_blades,
        producer="test",
    )

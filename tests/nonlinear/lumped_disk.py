"""Lumped blades on a ring of masses: a sector with cut faces, and the whole ring as one structure.

Masses of three directions stand between the sectors, each shared by two of them. A spring joins the two masses of a
sector, the blade stands on a point between them, nearer to one: waves of +n and -n move differently.
"""

from dataclasses import replace

import numpy as np
from lumped import lumped_blade

from rom import ReducedModel

NEARER = 0.7  # share of the motion of the left mass in that of the root
DISK_MASS = 3.0


def sector_with_disk(n_blades, n_contacts=2, ground=2.0, seed=7):
    """A sector: coordinates of the blade, of the left and of the right mass; `ground` holds these masses."""
    blade = lumped_blade(n_blades, n_contacts, seed)
    n = blade.size
    rng = np.random.default_rng(seed)
    clamp = np.diag([3.0, 1.0, 20.0])  # that of the tip in `lumped_blade`, here to the root
    size = n + 6
    root = np.hstack([np.zeros((3, n)), NEARER * np.eye(3), (1.0 - NEARER) * np.eye(3)])
    tip = np.eye(3, size)
    stiffness = np.zeros((size, size))
    stiffness[:n, :n] = blade.stiffness
    stiffness += (tip - root).T @ clamp @ (tip - root) - tip.T @ clamp @ tip
    blade_stiffness = stiffness.copy()
    left, right = np.eye(3, size, n), np.eye(3, size, n + 3)
    skewed = rng.normal(size=(3, 3))
    joint = 6.0 * np.eye(3) + skewed @ skewed.T
    stiffness += (right - left).T @ joint @ (right - left) + 0.5 * ground * (left.T @ left + right.T @ right)
    mass = 0.5 * DISK_MASS * np.eye(size)
    mass[:n, :n] = blade.mass
    wider = {name: np.pad(getattr(blade, name), ((0, 0), (0, 6))) for name in ("contact_right", "contact_left")}
    force = np.pad(blade.force_excitation, (0, 6)) + 0.3j * np.eye(size)[0] - 0.2 * right[2]
    return replace(
        blade,
        mass=mass,
        stiffness=stiffness,
        force_excitation=force,
        force_static=0.2 * np.eye(size)[2] + 0.1 * left[1] if ground else np.zeros(size),
        outputs={"tip": np.pad(blade.outputs["tip"], (0, 6))},
        cyclic_right=right,
        cyclic_left=left,
        blade_stiffness=blade_stiffness,
        **wider,
    )


def sector_places(sector, n_sectors):
    """Selection (q, n, N) of the coordinates of each sector from those of a ring of q sectors."""
    own = sector.size - 6
    size = (own + 3) * n_sectors
    places = np.zeros((n_sectors, sector.size, size))
    for j in range(n_sectors):
        first, following = j * (own + 3), (j + 1) % n_sectors * (own + 3) + own
        places[j, : own + 3, first : first + own + 3] = np.eye(own + 3)
        places[j, own + 3 :, following : following + 3] = np.eye(3)
    return places


def whole_ring(sector, n_sectors, engine_order):
    """The ring as one structure in contact with itself; outputs tip, tip1, ... of the blades."""
    places = sector_places(sector, n_sectors)
    turn = np.exp(2j * np.pi * engine_order * np.arange(n_sectors) / sector.n_blades)
    relative = np.stack(
        [
            sector.contact_right @ here - (0.0 if sector.contact_left is None else sector.contact_left @ there)
            for here, there in zip(places, np.roll(places, -1, axis=0), strict=True)
        ]
    )
    tips = sector.outputs["tip"] @ places
    return ReducedModel(
        mass=np.einsum("jna,nk,jkb->ab", places, sector.mass, places),
        stiffness=np.einsum("jna,nk,jkb->ab", places, sector.stiffness, places),
        contact_right=relative.reshape(-1, places.shape[2]),
        contact_position=np.tile(sector.contact_position, (n_sectors, 1)),
        force_excitation=np.einsum("j,n,jna->a", turn, sector.force_excitation, places),
        force_static=np.einsum("n,jna->a", sector.force_static, places),
        outputs={"tip" if j == 0 else f"tip{j}": row for j, row in enumerate(tips)},
        producer="test",
    )

"""Small valid files of every kind that the package reads, for the fuzzer to start from."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from geometry import ContactFace, SectorMesh
from rom import Material, ReducedModel, assemble, save_full_model, save_sector, write_reduced_model

CURVE = {
    "peak_frequency_hz": 100.0,
    "peak_amplitude_m": 1e-5,
    "peak_index": 1,
    "peak_located": True,
    "points": 3,
    "total_iterations": 9,
    "seconds": 0.1,
    "complete": True,
    "reason": "complete",
    "energy_error": 1e-12,
    "harmonics": 1,
    "truncation_error": 1e-3,
    "bifurcations": "[]",
    "detached": "[]",
    "contact.friction": 0.4,
    "contact.interference": [1e-5],
    "excitation.force": 0.2,
}


def write_seeds(folder: Path) -> None:
    """Write a reduced model with all that it can have, one with the least, a response, a sector and a full model."""
    write_reduced_model(folder / "seed-model", small_model())
    write_reduced_model(folder / "seed-least", small_model(least=True))
    write_response(folder / "seed-response")
    sector = one_element()
    save_sector(folder / "seed-sector", sector)
    save_full_model(folder / "seed-full", assemble(sector, Material(2e11, 0.3, 7800.0), "hex8"))


def one_element() -> SectorMesh:
    """A cube that is a sector: clamped below, one contact node on each side."""
    corners = [(x, y, z) for z in (0.0, 1.0) for x, y in ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))]
    points = np.array(corners)

    def face(node: int) -> ContactFace:
        return ContactFace(np.array([node]), points[[node]], np.eye(3)[None], np.ones(1))

    sets = {"root": range(4), "tip": [6], "contact_right": [7], "contact_left": [4], "tip_surface": [4, 5, 6, 7]}
    node_sets = {name: np.array(nodes, dtype=np.int64) for name, nodes in sets.items()}
    return SectorMesh(points, np.arange(8)[None], node_sets, face(7), face(4), 8)


def small_model(least: bool = False) -> ReducedModel:
    """Six coordinates, one contact node."""
    n = 6
    more = {
        "contact_left": np.eye(3, n, k=3),
        "contact_area": np.ones(1),
        "force_centrifugal": np.ones(n),
        "force_static": np.ones(n),
        "basis": np.ones((6, n)),
        "n_blades": 9,
    }
    return ReducedModel(
        mass=np.eye(n),
        stiffness=2.0 * np.eye(n),
        contact_right=np.eye(3, n),
        contact_position=np.zeros((1, 3)),
        force_excitation=np.ones(n),
        outputs={"tip": np.ones(n)},
        **({} if least else more),
    )


def write_response(path: Path) -> None:
    """A response of one curve of three points and a branch."""
    with h5py.File(path, "w") as file:
        for name in ("curve/0", "curve/0/branch/1"):
            group = file.create_group(name)
            group["frequency_hz"] = np.array([90.0, 100.0, 110.0])
            group["amplitude_m"] = np.array([1e-6, 1e-5, 1e-6])
            group["stable"] = np.array([True, True, False])
            group["output"] = np.ones((3, 2), dtype=complex)
        file["curve/0"].attrs.update(CURVE)

"""A mode shape in a window or a notebook, to be turned by hand."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pipeline.errors import input_error
from pipeline.render import ring
from pipeline.render.mode_shapes import WITHOUT_CORIOLIS, at_largest, named_shapes
from pipeline.scene.contact_section import PER_NODE, Contact
from pipeline.stages.model.build_mesh import SECTOR
from pipeline.stages.scene_to_solver import STATES, InterfaceContact, contact_parameters, springs_by_state

if TYPE_CHECKING:
    import pyvista

    from pipeline.results.results import Results

DEFORMATION = 0.08  # largest displacement over the height of the mesh


def mode_plotter(results: Results, number: int, contact: str, model: int) -> pyvista.Plotter:
    """A plotter of pyvista with the mesh of a reduced model moved by one of its modes, and coloured by it."""
    import pyvista as pv

    from rom.cyclic.cyclic_symmetry import inter_blade_phase
    from rom.files.reduced_model_file import read_reduced_model
    from rom.files.sector_file import load_sector

    entries = results.summary.get("models", ())
    if contact not in STATES:
        raise input_error("contact", "", repr(contact), ", ".join(STATES))
    if not 0 <= model < len(entries) or entries[model]["mesh"] is None:
        raise input_error(results.folder, "", f"model {model} is not one with a mesh", "a run that makes a mesh")
    entry = entries[model]
    rom = results.folder / entry["rom"]
    reduced, sector = read_reduced_model(rom), load_sector((results.folder / entry["mesh"]).parent / SECTOR)
    if not 1 <= number <= reduced.size:
        raise input_error("number", "", str(number), f"1 to {reduced.size}, the modes of the reduced model")
    phase = inter_blade_phase(int(next(iter(entry["stuck_hz"]))), reduced.n_blades)
    faces = []
    for name, nodes in reduced.interfaces.items():
        values = entry.get("interfaces", {}).get(name, entry)
        stiffness = {key: values[key] for key in PER_NODE[:2]}
        faces.append(InterfaceContact(name, Contact(friction=0.0, **stiffness), nodes))
    springs = springs_by_state(contact_parameters(faces, reduced.contact_area))[contact]
    frequency, shapes, names = named_shapes(rom, reduced, phase, number, springs)
    motion = np.real(at_largest(shapes[-1][: len(sector.points)]))
    moved = ring.surface_of(ring.grid(sector, motion, DEFORMATION * float(np.ptp(sector.points[:, 2])), 0.0))
    plotter = pv.Plotter()
    plotter.add_mesh(moved, scalars="displacement", cmap="viridis", scalar_bar_args={"title": "displacement, scaled"})
    ring.add_outline(plotter, sector)
    still = f" {WITHOUT_CORIOLIS}" if entry.get("coriolis_included") else ""
    plotter.add_text(f"mode {number} ({names[-1]}), shrouds {contact}, {frequency[-1]:.1f} Hz{still}", font_size=12)
    ring.aim_from_side(plotter, sector)
    return plotter
